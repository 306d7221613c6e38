"""What all values that travel on wires have in common."""

from __future__ import annotations

from typing import Any, ClassVar

from nodegraph.data.buffer import Array, Buffer

Parts = tuple[dict[str, Any], dict[str, Array]]


class Value:
    """Base of everything that a port may carry: immutable, and able to say what it is.

    Subclasses store their attributes once, with `_set`, and refuse assignment afterwards. ``provenance`` is
    the one exception: the scheduler writes there, once, the key of the result that the value came from, so
    that ``memo`` can be keyed on values without hashing their data.
    """

    provenance: bytes | None = None
    kind: ClassVar[str] = "Value"

    def _set(self, **attributes: Any) -> None:
        for name, value in attributes.items():
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "provenance" and self.__dict__.get("provenance") in (None, value):
            object.__setattr__(self, name, value)
            return
        raise AttributeError(f"{type(self).__name__}.{name}: values on ports are immutable; make a new one instead")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"{type(self).__name__}.{name}: values on ports are immutable")

    @property
    def buffers(self) -> tuple[Buffer, ...]:
        """Everything bulky in this value; caches and devices count these."""
        return ()

    @property
    def nbytes(self) -> int:
        """Bytes of the bulk data, one copy."""
        return sum(buffer.nbytes for buffer in self.buffers)

    def summary(self) -> str:
        """One line that says what the value is."""
        return type(self).__name__

    def to_parts(self) -> Parts:
        """Return plain metadata and named arrays from which `from_parts` makes an equal value."""
        raise TypeError(f"{type(self).__name__}: this type cannot be stored on disk")

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: dict[str, Array]) -> Value:
        """Make the value that `to_parts` took apart."""
        raise TypeError(f"{cls.__name__}: this type cannot be stored on disk")

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.summary()}>"
