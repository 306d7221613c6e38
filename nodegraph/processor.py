"""Processor: a function with declared inputs, parameters and outputs.

    class GaussianBlur(Processor):
        \"\"\"Replace every voxel by the Gaussian-weighted mean of its surroundings.\"\"\"

        volume = Input(Volume, doc="Scalar field.")
        smoothed = Output(Volume, doc="Same grid, float32.")
        sigma = Float(1.0, min=0.0, unit="mm", doc="Standard deviation.")

        def process(self, volume, sigma):
            ...

Everything that can be wrong with a declaration is found when the class is made, as a TypeError that names the place. So
what runs later needs no checks, and a plug-in with a slip in it fails where its author looks.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Collection, Mapping
from types import FunctionType
from typing import Any, ClassVar, NamedTuple, NoReturn

from nodegraph.errors import GraphError, ParameterError, PortError, near_miss
from nodegraph.params import Parameter
from nodegraph.ports import Input, Output, port_type
from nodegraph.signature import SERVICES, check_signature, is_generator, snake

__all__ = ["SERVICES", "Bound", "Processor", "bind"]

_NEEDS = ("size", "quality", "wanted", "params")


class Processor:
    """One step of a network. Subclasses declare ports and parameters and define ``process``.

    process(self, inputs and parameters by their declared names, *, services): returns the value of the one output, or
    a named tuple of several (``self.Outputs(...)``, where those that nobody wants may be left out). It may be a
    generator: each yield is a point at which it can be cancelled and a preview; the last one is the result.

    needs(self, size, quality, wanted, params): optional, pure; returns what is asked of each input, see
    docs/decisions/0004: ``{"volume": None}`` when that branch need not run.

    migrate(params, version): optional static method; takes the encoded parameters that an older ``version`` of this
    processor wrote and returns them as this version would.

    A subclass holds no state: ``__init__`` and assignment to self are refused.
    ``class Shared(Processor, abstract=True)`` only carries declarations for others.
    """

    inputs: ClassVar[dict[str, Input]] = {}
    outputs: ClassVar[dict[str, Output]] = {}
    params: ClassVar[dict[str, Parameter]] = {}
    services: ClassVar[tuple[str, ...]] = ()  #: keyword-only arguments of process, in their order
    Outputs: ClassVar[Any] = None  #: named tuple of the outputs, where there are several

    id: ClassVar[str] = ""  #: set by the registry from the path: filter.gaussian_blur
    file: ClassVar[str] = ""  #: where the source lies
    version: ClassVar[int] = 1  #: raise it when the same parameters mean something else
    formerly: ClassVar[tuple[str, ...]] = ()  #: ids under which workspaces may know this processor
    effect: ClassVar[bool] = False  #: it changes the world: never cached, runs only when named or in a headless run
    disk_cache: ClassVar[bool] = False  #: results are worth keeping between runs
    kernels: ClassVar[tuple[str, ...]] = ()  #: GLSL files that it runs, without suffix; the registry knows the default

    shader_roots: ClassVar[tuple[str, ...]] = ()  #: folders of its kernels and includes; () means the built-in ones
    source_digest: ClassVar[bytes | None] = None  #: of the text that was loaded; set by the registry

    generator: ClassVar[bool] = False  #: process yields
    has_needs: ClassVar[bool] = False  #: the class defines needs
    conditional: ClassVar[bool] = False  #: some parameter has visible_if
    abstract: ClassVar[bool] = False

    process: ClassVar[Callable[..., Any]]

    def __init_subclass__(cls, abstract: bool = False, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        cls.abstract = abstract
        _refuse_state(cls)
        _collect(cls)
        _check_visibility(cls)
        _check_settings(cls)
        if not abstract:
            process = cls.__dict__.get("process", getattr(cls, "process", None))
            cls.services = check_signature(cls.__name__, process, cls.inputs, cls.params, cls.outputs)
            if "workspace" in cls.services and not cls.effect:
                # It is in no fingerprint, since every edit of any node changes it.
                raise TypeError(f"{cls.__name__}.process: only an effect may ask for the workspace; set effect = True")
            cls.generator = is_generator(process)
        if len(cls.outputs) > 1:
            cls.Outputs = namedtuple("Outputs", list(cls.outputs), defaults=[None] * len(cls.outputs))  # type: ignore[misc]
        if "id" not in cls.__dict__:
            cls.id = snake(cls.__name__)

    def __setattr__(self, name: str, value: Any) -> NoReturn:
        raise AttributeError(
            f"{type(self).__name__}.{name}: a processor keeps nothing between runs; return it, or let memo keep it"
        )

    @staticmethod
    def migrate(params: dict[str, Any], version: int) -> dict[str, Any]:
        """Encoded parameters of an older version as this version would write them. Default: unchanged."""
        return params

    # -- what the engine asks of a class ------------------------------------------------------------------------

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """The default of every parameter."""
        return {name: parameter.default for name, parameter in cls.params.items()}

    @classmethod
    def visible(cls, values: Mapping[str, Any]) -> tuple[str, ...]:
        """Names of the parameters that mean something under these values; missing values are defaults.

        A parameter that is not visible counts as its default, also for those that depend on it.
        """
        if not cls.conditional:
            return tuple(cls.params)
        effective: dict[str, Any] = {}
        shown = {name: _is_visible(cls, name, values, effective) for name in cls.params}
        return tuple(name for name, visible in shown.items() if visible)

    @classmethod
    def effective(cls, values: Mapping[str, Any]) -> dict[str, Any]:
        """What ``process`` gets: the values, with defaults for those that are missing or not visible."""
        shown = set(cls.visible(values))
        return {
            name: values.get(name, parameter.default) if name in shown else parameter.default
            for name, parameter in cls.params.items()
        }

    @classmethod
    def pack(cls, returned: Any, wanted: Collection[str] | None = None, where: str = "") -> dict[str, Any]:
        """Take apart what ``process`` returned: values by output name, each of its declared type.

        Outputs that are not ``wanted`` (None: all are) may be None and are then left out. Raises PortError naming the
        output that is missing, unknown or of the wrong type.
        """
        where = where or cls.id
        wanted = cls.outputs.keys() if wanted is None else wanted
        fields = _fields(cls, returned, where)
        packed: dict[str, Any] = {}
        for name, output in cls.outputs.items():
            value = fields.get(name)
            if value is not None:
                packed[name] = output.check(value, f"{where}.{name}")
            elif name in wanted:
                raise PortError(f"{where}.{name}: process() returned nothing for this output")
        return packed

    @classmethod
    def category(cls) -> str:
        """The palette's category: the folders of the id."""
        return cls.id.rpartition(".")[0]

    @classmethod
    def describe(cls) -> dict[str, Any]:
        """The whole declaration as JSON: for catalogues, editors, schemas and docs."""
        text = (cls.__doc__ or "").strip().expandtabs()
        told: dict[str, Any] = {
            "id": cls.id,
            "name": cls.__name__,
            "version": cls.version,
            "doc": "\n".join(line.strip() for line in text.splitlines()),
            "inputs": {name: port.describe() for name, port in cls.inputs.items()},
            "outputs": {name: port.describe() for name, port in cls.outputs.items()},
            "params": {name: parameter.describe() for name, parameter in cls.params.items()},
            "services": list(cls.services),
        }
        for name in ("formerly", "kernels"):
            if getattr(cls, name):
                told[name] = list(getattr(cls, name))
        for name in ("effect", "disk_cache"):
            if getattr(cls, name):
                told[name] = True
        return told


class Bound(NamedTuple):
    """Checked arguments of ``process``."""

    inputs: dict[str, Any]
    params: dict[str, Any]


def bind(cls: type[Processor], given: Mapping[str, Any], where: str = "") -> Bound:
    """Check inputs and parameters that are given by name, as in ``run(GaussianBlur, volume=v, sigma=2.0)``.

    Arrays are accepted where the type of an input can be made of one. Raises PortError or ParameterError naming the
    place; an unknown name names the nearest known one.
    """
    where = where or cls.id
    known = [*cls.inputs, *cls.params]
    for name in given:
        if name not in known:
            raise ParameterError(f"{where}.{name}: no such input or parameter{near_miss(name, known)}")
    inputs = {
        name: port.check(_made_of_arrays(port, given.get(name)), f"{where}.{name}") for name, port in cls.inputs.items()
    }
    values = {name: cls.params[name].check(given[name], f"{where}.{name}") for name in cls.params if name in given}
    return Bound(inputs, cls.effective(values))


def _made_of_arrays(port: Input, value: Any) -> Any:
    if port.many and isinstance(value, (list, tuple)):
        return tuple(_made_of_arrays_one(port, one) for one in value)
    return _made_of_arrays_one(port, value)


def _made_of_arrays_one(port: Input, value: Any) -> Any:
    if hasattr(value, "__array_interface__") and getattr(value, "ndim", 0) >= 2 and not isinstance(value, port.type):
        try:
            return port.type(value)
        except GraphError:
            raise
        except TypeError:
            return value  # the port's own check says what it expected
    return value


def _refuse_state(cls: type[Processor]) -> None:
    for name in ("__init__", "__new__", "__setattr__", "__init_subclass__"):
        if name in cls.__dict__:
            raise TypeError(f"{cls.__name__}.{name}: a processor is a function of what it declares; remove {name}")


def _collect(cls: type[Processor]) -> None:
    """Gather declarations, those of ancestors first; an overriding one keeps its ancestor's place."""
    inputs, outputs, params = dict(cls.inputs), dict(cls.outputs), dict(cls.params)
    for ancestor in cls.__mro__[:0:-1]:
        if issubclass(ancestor, Processor):
            inputs.update({n: p for n, p in ancestor.inputs.items() if n not in inputs})
            outputs.update({n: p for n, p in ancestor.outputs.items() if n not in outputs})
            params.update({n: p for n, p in ancestor.params.items() if n not in params})
    tables: tuple[tuple[type, dict[str, Any]], ...] = ((Input, inputs), (Output, outputs), (Parameter, params))
    for name, value in cls.__dict__.items():
        where = f"{cls.__name__}.{name}"
        mine = next((table for kind, table in tables if isinstance(value, kind)), None)
        if mine is None:
            if isinstance(value, type) and issubclass(value, (Input, Output, Parameter)):
                raise TypeError(f"{where}: declare an object, {value.__name__}(...), not the class {value.__name__}")
            if any(name in table for _, table in tables):
                raise TypeError(f"{where}: this hides a declared port or parameter; choose another name")
            continue
        if any(name in table for _, table in tables if table is not mine):
            raise TypeError(f"{where}: an ancestor declares this name as something else; choose another")
        if name.startswith("_") or hasattr(Processor, name):
            raise TypeError(f"{where}: this name is reserved; choose another")
        if not value.doc:
            raise TypeError(f"{where}: say what it is, with doc=...")
        mine[name] = value
    cls.inputs, cls.outputs, cls.params = inputs, outputs, params


def _check_visibility(cls: type[Processor]) -> None:
    cls.conditional = any(parameter.visible_if for parameter in cls.params.values())
    for name, parameter in cls.params.items():
        where = f"{cls.__name__}.{name}"
        for other, values in parameter.visible_if.items():
            if other not in cls.params:
                raise TypeError(f"{where}: visible_if names {other!r}, no parameter{near_miss(other, cls.params)}")
            for value in values:
                try:
                    checked = cls.params[other].check(value, f"{where}: visible_if {other}")
                except ParameterError as error:
                    raise TypeError(str(error)) from None
                if checked != value:
                    raise TypeError(f"{where}: visible_if {other}: write {checked!r} instead of {value!r}")
        _follow(cls, name, ())


def _follow(cls: type[Processor], name: str, path: tuple[str, ...]) -> None:
    if name in path:
        raise TypeError(f"{cls.__name__}.{name}: visible_if goes in a circle: {' -> '.join([*path, name])}")
    for other in cls.params[name].visible_if:
        if other in cls.params:
            _follow(cls, other, (*path, name))


def _is_visible(cls: type[Processor], name: str, values: Mapping[str, Any], effective: dict[str, Any]) -> bool:
    """Whether all conditions of a parameter hold; fills ``effective`` with the values that count on the way."""
    parameter = cls.params[name]
    visible = True
    for other, allowed in parameter.visible_if.items():
        if other not in effective:
            _is_visible(cls, other, values, effective)
        visible = visible and effective[other] in allowed
    effective[name] = values.get(name, parameter.default) if visible else parameter.default
    return visible


def _check_settings(cls: type[Processor]) -> None:
    where = cls.__name__
    for name in ("formerly", "kernels"):
        listed = getattr(cls, name)
        if not isinstance(listed, tuple) or not all(isinstance(item, str) and item for item in listed):
            raise TypeError(f'{where}.{name}: give a tuple of names, for example ("filter.gauss",)')
    if not isinstance(cls.version, int) or isinstance(cls.version, bool) or cls.version < 1:
        raise TypeError(f"{where}.version: give a whole number from 1, not {cls.version!r}")
    for name in ("effect", "disk_cache"):
        if not isinstance(getattr(cls, name), bool):
            raise TypeError(f"{where}.{name}: give True or False")
    if cls.effect and cls.disk_cache:
        raise TypeError(f"{where}: an effect is never cached; remove disk_cache")
    needs = cls.__dict__.get("needs")
    if needs is not None:
        cls.has_needs = True
        names = _argument_names(needs)
        if names != _NEEDS:
            raise TypeError(f"{where}.needs: takes (self, {', '.join(_NEEDS)}), not ({', '.join(names)})")
    migrate = cls.__dict__.get("migrate")
    if migrate is not None and (
        not isinstance(migrate, (staticmethod, classmethod)) or _argument_names(migrate) != ("params", "version")
    ):
        raise TypeError(f"{where}.migrate: write it as @staticmethod with the arguments (params, version)")


def _argument_names(function: Any) -> tuple[str, ...]:
    """Positional arguments without self or cls; a static method has neither."""
    inner = function.__func__ if isinstance(function, (staticmethod, classmethod)) else function
    if not isinstance(inner, FunctionType):
        return ()
    code = inner.__code__
    first = 0 if isinstance(function, staticmethod) else 1
    return code.co_varnames[first : code.co_argcount]


def _fields(cls: type[Processor], returned: Any, where: str) -> dict[str, Any]:
    """Returned values by output name, before their types are checked."""
    names = list(cls.outputs)
    named = getattr(type(returned), "_fields", None) if isinstance(returned, tuple) else None
    if named is not None and (len(names) != 1 or names[0] in named):
        for name in named:
            if name not in cls.outputs:
                raise PortError(f"{where}.{name}: process() returned an undeclared output{near_miss(name, names)}")
        return dict(zip(named, returned, strict=True))
    if not names:
        if returned is None:
            return {}
        raise PortError(f"{where}: process() returned a {type(returned).__name__}, but no output is declared")
    if len(names) == 1:
        return {names[0]: returned}
    raise PortError(
        f"{where}: process() must return self.Outputs({', '.join(f'{n}=...' for n in names)}), "
        f"not {port_type(type(returned)).name}"
    )
