"""Columns of numbers and text."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from nodegraph.data.buffer import Array, Buffer
from nodegraph.data.value import Parts, Value
from nodegraph.errors import PortError


class Table(Value):
    """Named columns of equal length: numbers or text, in a fixed order, with a unit for some."""

    kind: ClassVar[str] = "Table"
    _columns: dict[str, Buffer]
    units: Mapping[str, str]

    def __init__(self, columns: Mapping[str, Any], units: Mapping[str, str] | None = None) -> None:
        arrays = {str(name): np.atleast_1d(np.asarray(data)) for name, data in columns.items()}
        lengths = {name: array.shape for name, array in arrays.items()}
        if any(array.ndim != 1 for array in arrays.values()) or len(set(lengths.values())) > 1:
            raise PortError(f"Table: expected columns of one length, got {lengths}")
        for name, array in arrays.items():
            if array.dtype.kind not in "biufU":
                raise PortError(f"Table: column {name!r} must hold numbers or text, it holds {array.dtype}")
        self._set(
            _columns={name: Buffer(array) for name, array in arrays.items()}, units=MappingProxyType(dict(units or {}))
        )

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(self._columns)

    def __getitem__(self, column: str) -> Array:
        return self._columns[column].array

    def __len__(self) -> int:
        return next((buffer.shape[0] for buffer in self._columns.values()), 0)

    @property
    def buffers(self) -> tuple[Buffer, ...]:
        return tuple(self._columns.values())

    def rows(self) -> list[dict[str, Any]]:
        """The rows as plain dictionaries, for JSON."""
        lists = {name: buffer.array.tolist() for name, buffer in self._columns.items()}
        return [{name: lists[name][i] for name in lists} for i in range(len(self))]

    def summary(self) -> str:
        return f"{len(self)} rows: {', '.join(self.columns)}"

    def to_parts(self) -> Parts:
        names = {f"c{i}": name for i, name in enumerate(self.columns)}
        return {"names": names, "units": dict(self.units)}, {key: self[name] for key, name in names.items()}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: dict[str, Array]) -> Table:
        return cls({name: arrays[key] for key, name in meta["names"].items()}, meta["units"])
