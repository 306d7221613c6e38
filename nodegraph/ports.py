"""Ports of processors, and the one record that says how a type of value appears everywhere."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, NoReturn, Self

import numpy as np

from nodegraph import data
from nodegraph.errors import PortError


class PortType(NamedTuple):
    """How one type of value looks and reads: in the editor, in messages, in catalogues and docs.

    color: "#rrggbb" of plugs and wires. shape: of the plug: circle, square, diamond, triangle, ring.
    summary: one line about a value. Plug-ins offer theirs as objects in the entry-point group ``nodegraph.port_types``.
    """

    type: type
    name: str
    color: str
    shape: str
    summary: Callable[[Any], str]
    doc: str


def _own_summary(value: Any) -> str:
    return str(value.summary())


SHAPES = ("circle", "square", "diamond", "triangle", "ring")

_TYPES: dict[type, PortType] = {
    record.type: record
    for record in (
        PortType(data.Volume, "Volume", "#4f9bd9", "circle", _own_summary, "Real numbers on a regular grid."),
        PortType(data.Labels, "Labels", "#8e6fd1", "circle", _own_summary, "Ids on a regular grid."),
        PortType(data.Image, "Image", "#d9a441", "square", _own_summary, "A picture, with depth and ids if known."),
        PortType(data.Mesh, "Mesh", "#5fb878", "triangle", _own_summary, "Triangles in the world, mm."),
        PortType(data.Table, "Table", "#9aa5b1", "square", _own_summary, "Named columns of equal length."),
        PortType(data.Camera, "Camera", "#c86b85", "diamond", _own_summary, "Where the eye is and what it sees."),
        PortType(data.Light, "Light", "#e3cf57", "diamond", _own_summary, "A light."),
        PortType(data.Plane, "Plane", "#6fb7b7", "diamond", _own_summary, "An oriented plane in the world."),
        PortType(data.TransferFunction, "TransferFunction", "#e07b53", "diamond", _own_summary, "Values to optics."),
        PortType(
            data.TransferFunction2D,
            "TransferFunction2D",
            "#c9593a",
            "diamond",
            _own_summary,
            "Values and gradient magnitudes to optics.",
        ),
        PortType(float, "Number", "#b0b0b0", "ring", repr, "A real number."),
        PortType(int, "Integer", "#909090", "ring", repr, "A whole number."),
        PortType(bool, "Switch", "#707070", "ring", repr, "On or off."),
        PortType(str, "Text", "#c0b49a", "ring", repr, "Text."),
        PortType(tuple, "Numbers", "#a0a0b8", "ring", repr, "Several numbers: a vector, a colour, a matrix."),
    )
}
_ANY = PortType(object, "Value", "#cccccc", "circle", repr, "Anything.")
_asked_plugins = False


def register(record: PortType) -> None:
    """Add the record of a new type. Raises TypeError where it is malformed or the type has one already."""
    if record.type in _TYPES and _TYPES[record.type] != record:
        raise TypeError(f"{record.name}: the type {record.type.__name__} has a port record already")
    if record.shape not in SHAPES:
        raise TypeError(f"{record.name}: shape is one of {', '.join(SHAPES)}, not {record.shape!r}")
    if len(record.color) != 7 or not record.color.startswith("#"):
        raise TypeError(f"{record.name}: color is '#rrggbb', not {record.color!r}")
    _TYPES[record.type] = record


def port_type(cls: type) -> PortType:
    """The record of a type or of its nearest ancestor that has one."""
    record = _nearest(cls)
    if record is None and not _asked_plugins:
        _ask_plugins()
        record = _nearest(cls)
    if record is not None:
        return record
    return _ANY._replace(type=cls, name=cls.__name__, doc=(cls.__doc__ or _ANY.doc).split("\n")[0])


def port_types() -> tuple[PortType, ...]:
    """All records, those of plug-ins included."""
    _ask_plugins()
    return tuple(_TYPES.values())


def connects(output: type, input: type) -> bool:
    """Whether an output of one type may be wired to an input of another: it is the same or a special case of it.

    Whole numbers go where real ones are expected.
    """
    return issubclass(output, input) or (output is int and input is float)


def _nearest(cls: type) -> PortType | None:
    return next((_TYPES[ancestor] for ancestor in cls.__mro__ if ancestor in _TYPES), None)


def _ask_plugins() -> None:
    global _asked_plugins
    if _asked_plugins:
        return
    _asked_plugins = True
    from nodegraph import plugins

    for plugin in plugins.discover("nodegraph.port_types"):
        records = plugin.object if isinstance(plugin.object, (list, tuple)) else (plugin.object,)
        records = (plugin.object,) if isinstance(plugin.object, PortType) else records
        for record in records:
            if isinstance(record, PortType) and record.type not in _TYPES:
                register(record)


class Condition:
    """What an input asks of a value beyond its type: a test and the sentence that says what is wanted.

    ``Condition(lambda volume: min(volume.dims) > 1, "must have more than one voxel along each axis")``
    """

    __slots__ = ("message", "test")

    def __init__(self, test: Callable[[Any], bool], message: str) -> None:
        if not callable(test) or not isinstance(message, str) or not message:
            raise TypeError("Condition: give a test and a message, as in Condition(test, 'must have one component')")
        self.test = test
        self.message = message

    def __repr__(self) -> str:
        return f"<Condition: {self.message}>"


def has_components(*counts: int) -> Condition:
    """Volumes with so many numbers per voxel."""
    return Condition(lambda volume: volume.components in counts, f"must have {_either(counts)} per voxel")


def channels(*counts: int) -> Condition:
    """Images with so many numbers per pixel."""
    return Condition(lambda image: image.channels in counts, f"must have {_either(counts)} per pixel")


def has_depth() -> Condition:
    """Images that know the depth of what they show."""
    return Condition(lambda image: image.depth_buffer is not None, "must come with depth")


def has_ids() -> Condition:
    """Images that know the ids of what they show."""
    return Condition(lambda image: image.ids_buffer is not None, "must come with ids")


def min_dims(x: int, y: int, z: int) -> Condition:
    """Grids of at least so many voxels."""
    return Condition(
        lambda grid: all(have >= want for have, want in zip(grid.dims, (x, y, z), strict=True)),
        f"must have at least {x}x{y}x{z} voxels",
    )


def _either(counts: Iterable[int]) -> str:
    listed = [str(count) for count in counts]
    return f"{' or '.join(listed)} number{'' if listed == ['1'] else 's'}"


_TYPE = type  # the declarations below have an argument of this name


class _Port:
    """A named, typed place of a processor. Declared as a class attribute; holds no value."""

    name: str = ""
    owner: str = ""

    def __init__(self, type: type, doc: str) -> None:
        self.type = type
        self.doc = " ".join(doc.split())
        if not isinstance(type, _TYPE):
            raise TypeError(f"{self.__class__.__name__}: the first argument is a type such as Volume, not {type!r}")

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        self.owner = owner.__name__

    def __get__(self, instance: object | None, owner: type) -> Self:
        if instance is None:
            return self
        raise AttributeError(f"{owner.__name__}.{self.name}: inputs are arguments of process(), outputs its result")

    def __set__(self, instance: object, value: Any) -> NoReturn:
        raise AttributeError(
            f"{instance.__class__.__name__}.{self.name}: a port holds no value; return it from process()"
        )

    def _is_one(self, value: Any) -> bool:
        return isinstance(value, self.type)

    def _wrong_type(self, value: Any, where: str) -> NoReturn:
        got = port_type(value.__class__).name if isinstance(value, data.Value) else value.__class__.__name__
        raise PortError(f"{where}: expected {article(port_type(self.type).name)}, got {article(got)}")

    def _number(self, value: Any) -> Any:
        """Numbers of numpy as plain ones, so that `float` and `int` ports mean what they say."""
        if self.type in (float, int, bool) and isinstance(value, np.generic):
            value = value.item()
        if self.type is float and value.__class__ is int:
            value = float(value)
        return value


class Input(_Port):
    """Where a value comes in.

    required: an unwired required input blocks the node; an unwired optional one reaches ``process`` as None.
    many:     any number of wires; the values reach ``process`` as a tuple in wire order.
    accepts:  conditions beyond the type, checked before ``process`` runs.
    """

    def __init__(
        self,
        type: type,
        *,
        doc: str = "",
        required: bool = True,
        many: bool = False,
        accepts: Condition | Iterable[Condition] = (),
    ) -> None:
        super().__init__(type, doc)
        self.required = required
        self.many = many
        self.accepts = (accepts,) if isinstance(accepts, Condition) else tuple(accepts)
        if not all(isinstance(condition, Condition) for condition in self.accepts):
            raise TypeError("Input: accepts= holds conditions such as has_components(1)")

    def check(self, value: Any, where: str) -> Any:
        """Return what ``process`` gets. Raises PortError beginning with ``where`` for a wrong type or condition."""
        if self.many:
            values = value if isinstance(value, (tuple, list)) else () if value is None else (value,)
            if self.required and not values:
                raise PortError(f"{where}: nothing is connected; wire at least one {port_type(self.type).name}")
            return tuple(self._check_one(one, f"{where}[{i}]") for i, one in enumerate(values))
        if value is None:
            if self.required:
                raise PortError(f"{where}: nothing is connected; wire {article(port_type(self.type).name)}")
            return None
        return self._check_one(value, where)

    def _check_one(self, value: Any, where: str) -> Any:
        value = self._number(value)
        if not self._is_one(value):
            self._wrong_type(value, where)
        for condition in self.accepts:
            if not condition.test(value):
                raise PortError(f"{where}: {condition.message}; got {port_type(self.type).summary(value)}")
        return value

    def describe(self) -> dict[str, Any]:
        """The declaration as JSON."""
        told: dict[str, Any] = {"type": port_type(self.type).name, "doc": self.doc}
        if not self.required:
            told["required"] = False
        if self.many:
            told["many"] = True
        if self.accepts:
            told["accepts"] = [condition.message for condition in self.accepts]
        return told


class Output(_Port):
    """Where a value goes out."""

    def __init__(self, type: type, *, doc: str = "") -> None:
        super().__init__(type, doc)

    def check(self, value: Any, where: str) -> Any:
        """Return the value. Raises PortError beginning with ``where`` when its type is not the declared one."""
        value = self._number(value)
        if not self._is_one(value):
            self._wrong_type(value, where)
        return value

    def describe(self) -> dict[str, Any]:
        """The declaration as JSON."""
        return {"type": port_type(self.type).name, "doc": self.doc}


def article(name: str) -> str:
    """``name`` after the article that it takes."""
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
