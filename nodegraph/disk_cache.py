"""Results that outlive the process, as files in the user's cache folder.

One file per result: magic, blake2b of all that follows, length of the JSON, the JSON, then the arrays on 64-byte
boundaries. A file appears under its name only when it is complete (`os.replace`), so a torn write is never
seen and two processes that make the same result do not disturb each other. What is read is believed only when
its checksum holds. No pickle: reading a file must not be able to run code.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import secrets
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from nodegraph import data
from nodegraph.cache import Result
from nodegraph.data import Buffer, Value
from nodegraph.errors import GraphError
from nodegraph.fingerprint import SIZE, as_bytes, digest

MAGIC = b"NGRESULT1\n"
SUFFIX = ".ngr"
ALIGNMENT = 64
STALE_SECONDS = 3600.0
DEFAULT_BYTES = 8 << 30


def default_folder() -> Path:
    """``NODEGRAPH_CACHE``, else the user's cache folder."""
    named = os.environ.get("NODEGRAPH_CACHE")
    if named:
        return Path(named)
    import platformdirs

    return Path(platformdirs.user_cache_dir("nodegraph", appauthor=False))


class DiskCache:
    """Results by key in a folder, within ``limit`` bytes; the least recently used go first. Any thread, any process.

    Nothing here raises for a disk that is full, read-only or torn: `get` returns None, `put` returns why not.
    """

    def __init__(self, folder: Path | str | None = None, limit: int = DEFAULT_BYTES) -> None:
        self._folder = Path(folder) if folder is not None else None
        self.limit = limit

    @property
    def folder(self) -> Path:
        """Where the files lie; found when first needed, created when first written."""
        if self._folder is None:
            self._folder = default_folder()
        return self._folder / "results"

    def path(self, key: bytes) -> Path:
        """The file of a key. Another version of this package may compute otherwise, so it has other files."""
        from nodegraph import __version__

        name = digest(key, __version__).hex()
        return self.folder / name[:2] / f"{name}{SUFFIX}"

    def __contains__(self, key: bytes) -> bool:
        """Whether there is a file; it is not looked into."""
        return self.path(key).exists()

    def get(self, key: bytes) -> Result | None:
        """Return a result, or None. A file that is torn or damaged is removed."""
        path = self.path(key)
        try:
            content = np.fromfile(path, np.uint8)
        except OSError:
            return None
        try:
            result = _unpack(content)
        except (GraphError, ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError):
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        with contextlib.suppress(OSError):
            os.utime(path)
        return result

    def put(self, key: bytes, result: Result) -> str:
        """Keep a result. Returns an empty string, or the reason why it was not kept."""
        try:
            head, arrays = _pack(result)
        except TypeError as error:
            return str(error)
        total = len(head) + sum(array.nbytes + ALIGNMENT for array in arrays)
        if total > self.limit:
            return f"{total} bytes are more than the budget of {self.limit} bytes"
        path = self.path(key)
        temporary = path.with_name(f".{path.name}-{os.getpid()}-{secrets.token_hex(4)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                _write(temporary, head, arrays)
                os.replace(temporary, path)
            finally:
                with contextlib.suppress(OSError):
                    temporary.unlink()
        except OSError as error:
            # On Windows a file that is being read cannot be replaced: then it is there already.
            return "" if path.exists() and isinstance(error, PermissionError) else f"{path}: {error.strerror or error}"
        self.trim()
        return ""

    def trim(self) -> None:
        """Remove what was not used for longest until the budget holds, and what broken-off writers left."""
        files = []
        now = time.time()
        for path in self.folder.glob("*/*"):
            with contextlib.suppress(OSError):
                found = path.stat()
                if path.name.startswith("."):
                    if now - found.st_mtime > STALE_SECONDS:
                        path.unlink()
                elif path.suffix == SUFFIX:
                    files.append((found.st_mtime_ns, found.st_size, path))
        total = sum(size for _, size, _ in files)
        for _, size, path in sorted(files):
            if total <= self.limit:
                break
            with contextlib.suppress(OSError):
                path.unlink()
            total -= size

    @property
    def nbytes(self) -> int:
        """Bytes on disk now."""
        total = 0
        for path in self.folder.glob(f"*/*{SUFFIX}"):
            with contextlib.suppress(OSError):
                total += path.stat().st_size
        return total

    def clear(self) -> None:
        """Remove every result."""
        for path in self.folder.glob(f"*/*{SUFFIX}"):
            with contextlib.suppress(OSError):
                path.unlink()


def _write(path: Path, head: bytes, arrays: list[np.ndarray[Any, Any]]) -> None:
    checksum = hashlib.blake2b(digest_size=SIZE)
    with open(path, "xb") as file:
        file.write(MAGIC + bytes(SIZE))
        place = file.tell()

        def write(part: Any) -> None:
            nonlocal place
            checksum.update(part)
            file.write(part)
            place += len(part)

        write(len(head).to_bytes(8, "little"))
        write(head)
        for array in arrays:
            write(bytes(-place % ALIGNMENT))
            write(as_bytes(array))
        file.seek(len(MAGIC))
        file.write(checksum.digest())
        file.flush()
        # Without this a power cut could leave a complete name on an incomplete file.
        os.fsync(file.fileno())


def _pack(result: Result) -> tuple[bytes, list[np.ndarray[Any, Any]]]:
    """Take a result apart into JSON and arrays. Raises TypeError for what cannot be stored."""
    arrays: list[np.ndarray[Any, Any]] = []
    values = {name: _take_apart(value, arrays) for name, value in result.values.items()}
    meta = {
        "values": values,
        "seconds": result.seconds,
        "notes": list(result.notes),
        "arrays": [[array.dtype.str, list(array.shape)] for array in arrays],
    }
    return json.dumps(meta).encode(), arrays


def _take_apart(value: Any, arrays: list[np.ndarray[Any, Any]]) -> Any:
    if value is None or isinstance(value, (bool, int, float, str)):
        return {"plain": value}
    if isinstance(value, Value):
        if getattr(data, type(value).__name__, None) is not type(value):
            raise TypeError(f"a {type(value).__name__} is no type of nodegraph.data")
        meta, parts = value.to_parts()
        named = {name: _place(array, arrays) for name, array in parts.items()}
        return {"value": type(value).__name__, "meta": meta, "parts": named}
    if isinstance(value, np.ndarray):
        return {"array": _place(value, arrays)}
    if isinstance(value, Buffer):
        return {"buffer": _place(value.array, arrays)}
    if isinstance(value, (list, tuple)):
        if hasattr(value, "_fields"):
            raise TypeError("a named tuple loses its names on disk; return a dict")
        return {type(value).__name__: [_take_apart(item, arrays) for item in value]}
    if isinstance(value, dict) and all(isinstance(name, str) for name in value):
        return {"dict": {name: _take_apart(item, arrays) for name, item in value.items()}}
    raise TypeError(f"a {type(value).__name__} cannot be stored on disk")


def _place(array: Any, arrays: list[np.ndarray[Any, Any]]) -> int:
    array = np.asarray(array)
    if array.dtype.hasobject or array.dtype.names:
        raise TypeError("arrays of objects or records cannot be stored on disk")
    arrays.append(np.require(array, requirements="C"))
    return len(arrays) - 1


def _unpack(content: np.ndarray[Any, Any]) -> Result:
    """Put a result together from the bytes of a file. Raises ValueError and the like for anything unexpected."""
    start = len(MAGIC) + SIZE
    if content[: len(MAGIC)].tobytes() != MAGIC or len(content) < start + 8:
        raise ValueError("this is no result")
    checksum = hashlib.blake2b(as_bytes(content[start:]), digest_size=SIZE).digest()
    if checksum != content[len(MAGIC) : start].tobytes():
        raise ValueError("the checksum does not hold")
    length = int.from_bytes(content[start : start + 8].tobytes(), "little")
    place = start + 8
    if length > len(content) - place:
        raise ValueError("the header is longer than the file")
    meta = json.loads(content[place : place + length].tobytes())
    place += length
    arrays = []
    for name, shape in meta["arrays"]:
        kind = np.dtype(name)
        if kind.hasobject:
            raise ValueError("objects are not stored")
        count = math.prod(int(n) for n in shape)
        place += -place % ALIGNMENT
        if count < 0 or place + count * kind.itemsize > len(content):
            raise ValueError("an array is longer than the file")
        array = content[place : place + count * kind.itemsize].view(kind).reshape(shape)
        array.flags.writeable = False
        arrays.append(array)
        place += count * kind.itemsize
    values = {name: _put_together(part, arrays) for name, part in meta["values"].items()}
    return Result(values, float(meta["seconds"]), tuple(meta["notes"]))


_SEQUENCES: dict[str, Callable[[list[Any]], Any]] = {"list": list, "tuple": tuple}


def _put_together(part: dict[str, Any], arrays: list[np.ndarray[Any, Any]]) -> Any:
    if "plain" in part:
        return part["plain"]
    if "value" in part:
        kind = getattr(data, part["value"])
        if not issubclass(kind, Value):
            raise ValueError("this is no type of value")
        return kind.from_parts(part["meta"], {name: arrays[i] for name, i in part["parts"].items()})
    if "array" in part:
        return arrays[part["array"]]
    if "buffer" in part:
        return Buffer(arrays[part["buffer"]])
    if "dict" in part:
        return {name: _put_together(item, arrays) for name, item in part["dict"].items()}
    ((name, items),) = part.items()
    return _SEQUENCES[name]([_put_together(item, arrays) for item in items])
