"""Parameters whose value is a whole object: Camera, Light, Plane, TransferFunction, TransferFunction2D."""

from __future__ import annotations

import inspect
from typing import Any, ClassVar

from nodegraph import data
from nodegraph.errors import GraphError, ParameterError
from nodegraph.params.parameter import Parameter


class _Value(Parameter):
    """A parameter that holds an immutable value from `nodegraph.data`, which knows its own JSON form.

    Without a default the type's own is taken. ``optional=True`` allows None, which then is the default.
    """

    schema_type = "object"
    default_handle: ClassVar[str | None] = None

    def __init__(
        self, default: Any = None, *, optional: bool = False, handle: str | None = None, **common: Any
    ) -> None:
        for name in common:
            if name in inspect.signature(self.value_type).parameters:
                raise TypeError(
                    f"nodegraph.{self.kind} declares a parameter and has no {name!r}; "
                    f"the value is made by nodegraph.data.{self.value_type.__name__}"
                )
        self.optional = optional
        if default is None and not optional:
            default = self.value_type()
        super().__init__(default, handle=handle or self.default_handle, **common)

    def check(self, value: Any, where: str) -> Any:
        if isinstance(value, self.value_type) or (value is None and self.optional):
            return value
        if isinstance(value, _Value):
            raise ParameterError(f"{where}: got a declaration; the value is made by nodegraph.data.{value.kind}")
        self._refuse(where, value, f"a {self.value_type.__name__}" + (" or null" if self.optional else ""))

    def encode(self, value: Any) -> Any:
        return None if value is None else value.to_json()

    def decode(self, json: Any, where: str) -> Any:
        if json is None and self.optional:
            return None
        if not isinstance(json, dict):
            self._refuse(where, json, f"an object that describes a {self.value_type.__name__}")
        try:
            value = self.value_type.from_json(json, where)  # type: ignore[attr-defined]
        except ParameterError:
            raise
        except GraphError as error:
            raise ParameterError(str(error)) from error
        return self.check(value, where)

    def schema(self) -> dict[str, Any]:
        return {"type": ["object", "null"]} if self.optional else {"type": "object"}

    def _limits(self) -> dict[str, Any]:
        return {"optional": True} if self.optional else {}


class Camera(_Value):
    """Where the eye is and what it sees."""

    value_type: ClassVar[type] = data.Camera
    default_handle = "camera"


class Light(_Value):
    """A light."""

    value_type: ClassVar[type] = data.Light
    default_handle = "light"


class Plane(_Value):
    """An oriented plane in the world, for clipping and slicing."""

    value_type: ClassVar[type] = data.Plane
    default_handle = "plane"


class TransferFunction(_Value):
    """How real values become colour and extinction."""

    value_type: ClassVar[type] = data.TransferFunction


class TransferFunction2D(_Value):
    """How real values and the steepness of their field become colour and extinction."""

    value_type: ClassVar[type] = data.TransferFunction2D
