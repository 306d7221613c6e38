"""What all parameter kinds share: the declaration of one setting of a processor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, NoReturn, Self

from nodegraph.errors import ParameterError

HANDLES = ("wheel", "box", "plane", "light", "camera")


class Parameter:
    """One setting of a processor, declared as a class attribute.

    The declaration says everything that anybody needs to know of the setting: its default and its limits, its
    unit, its documentation, when it is shown, and how its values are written to JSON. A processor never stores a
    value; ``process`` is handed one under the declared name.

    doc:        one or two sentences; obligatory, checked when the processor class is made.
    unit:       "mm", "voxel", "deg", ...; appears in editors and in messages.
    visible_if: ``{"mode": ("iso", "composite")}`` or ``{"lit": True}``: other parameters and the values under
                which this one means something; all must hold. A tuple lists alternatives.
    handle:     what a view can offer to move the value with: one of `HANDLES`.
    quality:    says that the parameter trades speed for accuracy and in which direction accuracy lies; see the
                kinds that support it. `nodegraph tune` varies exactly these parameters.
    reference:  the value that a reference picture takes, or a tuple of them, each more accurate than the one before;
                kept as a tuple, empty where the general rule of `nodegraph.accuracy.reference` will do.
    """

    value_type: ClassVar[type] = object  #: what a wire into this parameter carries
    has_reference: ClassVar[bool] = False  #: whether ``reference`` means something for this kind
    schema_type: ClassVar[str] = ""  #: JSON type of an encoded value

    name: str = ""
    owner: str = ""

    def __init__(
        self,
        default: Any,
        *,
        doc: str = "",
        unit: str = "",
        visible_if: Mapping[str, Any] | None = None,
        handle: str | None = None,
        quality: Any = None,
        reference: Any = None,
    ) -> None:
        if handle is not None and handle not in HANDLES:
            raise TypeError(f"{self.kind}: handle is one of {', '.join(HANDLES)}, not {handle!r}")
        self.doc = " ".join(doc.split())
        self.unit = unit
        self.visible_if = _conditions(self.kind, visible_if)
        self.handle = handle
        self.quality = quality
        self._check_quality(quality)
        self.reference = self._references(reference)
        self.default = self.check(default, f"default of {self.kind}")

    @property
    def kind(self) -> str:
        """Name of the class; what workspaces and catalogues call it."""
        return type(self).__name__

    # -- values -----------------------------------------------------------------------------------------------

    def check(self, value: Any, where: str) -> Any:
        """Return the value in its one normal, immutable form.

        Raises ParameterError, whose message begins with ``where``, for what the declaration does not allow.
        """
        return value

    def encode(self, value: Any) -> Any:
        """Return a checked value as JSON: numbers, strings, booleans, lists, objects; never inf or nan."""
        return value

    def decode(self, json: Any, where: str) -> Any:
        """Return the checked value that `encode` wrote. Raises ParameterError beginning with ``where``."""
        return self.check(json, where)

    def schema(self) -> dict[str, Any]:
        """JSON Schema of an encoded value."""
        return {"type": self.schema_type} if self.schema_type else {}

    def describe(self) -> dict[str, Any]:
        """The whole declaration as JSON, for catalogues and editors. Only what was stated."""
        told: dict[str, Any] = {"kind": self.kind, "default": self.encode(self.default), "doc": self.doc}
        if self.unit:
            told["unit"] = self.unit
        told.update(self._limits())
        if self.visible_if:
            told["visible_if"] = {name: list(values) for name, values in self.visible_if.items()}
        if self.handle:
            told["handle"] = self.handle
        if self.quality is not None:
            told["quality"] = list(self.quality) if isinstance(self.quality, tuple) else self.quality
        if self.reference:
            told["reference"] = [self.encode(value) for value in self.reference]
        return told

    def _limits(self) -> dict[str, Any]:
        """What a kind adds to `describe`."""
        return {}

    def _check_quality(self, quality: Any) -> None:
        """Raise TypeError where ``quality`` does not say a direction of this kind."""
        if quality is not None:
            raise TypeError(f"{self.kind}: quality= has no meaning for this kind of parameter")

    def _references(self, reference: Any) -> tuple[Any, ...]:
        """The checked values of ``reference``. Raises TypeError for a kind or an order that makes no sense."""
        if reference is None:
            return ()
        if not self.has_reference:
            raise TypeError(f"{self.kind}: reference= has no meaning for this kind of parameter")
        listed = reference if isinstance(reference, tuple) else (reference,)
        values = tuple(self.check(value, f"reference of {self.kind}") for value in listed)
        if not values or not self._is_ascending(values):
            raise TypeError(
                f"{self.kind}: reference is one value, or a tuple in which each is more accurate than the one before; "
                f"not {reference!r}"
            )
        return values

    def _is_ascending(self, values: tuple[Any, ...]) -> bool:
        """Whether each value is more accurate than the one before, as far as ``quality`` tells."""
        return len(set(values)) == len(values)

    def _refuse(self, where: str, value: Any, expected: str) -> NoReturn:
        raise ParameterError(f"{where}: expected {expected}, got {_short(value)}")

    # -- the descriptor ---------------------------------------------------------------------------------------

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        self.owner = owner.__name__

    def __get__(self, instance: object | None, owner: type) -> Self:
        if instance is None:
            return self
        raise AttributeError(f"{owner.__name__}.{self.name}: take the value as an argument of process()")

    def __set__(self, instance: object, value: Any) -> NoReturn:
        raise AttributeError(f"{type(instance).__name__}.{self.name}: a declaration holds no value; set it on a node")

    def __repr__(self) -> str:
        place = f"{self.owner}.{self.name}" if self.name else "undeclared"
        return f"<{self.kind} {place}, default {_short(self.default)}>"


def as_float(value: Any) -> float | None:
    """The number that ``value`` is, or None: booleans and text are no numbers, "inf" and "nan" in JSON are."""
    if isinstance(value, str):
        return {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}.get(value.strip().lower())
    if isinstance(value, bool) or type(value).__name__ == "bool":  # numpy has a bool of its own
        return None
    if not hasattr(value, "__float__") or getattr(value, "ndim", 0) != 0:
        return None
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return None


def json_float(value: float) -> float | str:
    """A number that JSON can hold: inf and nan as text."""
    return value if math.isfinite(value) else str(value)


def _conditions(kind: str, visible_if: Mapping[str, Any] | None) -> dict[str, tuple[Any, ...]]:
    if visible_if is None:
        return {}
    if not isinstance(visible_if, Mapping) or not visible_if:
        raise TypeError(f"{kind}: visible_if maps names of parameters to values, for example {{'lit': True}}")
    return {
        str(name): tuple(values) if isinstance(values, (tuple, list, set, frozenset)) else (values,)
        for name, values in visible_if.items()
    }


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
