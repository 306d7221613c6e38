"""What a result depends on, as 20 bytes.

Two tasks with equal fingerprints give equal results, so a fingerprint is the key under which a result is
kept. It covers the code (id, version, source text, GLSL after includes), the visible parameters, the state
of files that parameters name, the fingerprints of everything upstream, and those services that ``process``
names. Nothing here reads bulk data, except `content_key`, which the disk cache and ``memo`` use for arrays
that no task made.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib
import itertools
import json
import math
import os
import secrets
import stat
import sys
import weakref
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import CodeType, FunctionType
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph.data import Buffer, Value
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.flat import FlatNode
    from nodegraph.processor import Processor

SIZE = 20
FOLDER_METADATA = ("zarr.json", ".zattrs", ".zgroup", ".zarray", ".zmetadata")
# A key that no other process and no later run of this one can repeat.
_PROCESS = secrets.token_bytes(12)
_count = itertools.count()
_class_digests: weakref.WeakKeyDictionary[type[Processor], bytes] = weakref.WeakKeyDictionary()


def digest(*parts: bytes | str) -> bytes:
    """Hash a list of parts; each is preceded by its length, so lists that join to the same text differ."""
    state = hashlib.blake2b(digest_size=SIZE)
    for part in parts:
        data = part.encode("utf-8", "surrogatepass") if isinstance(part, str) else part
        state.update(len(data).to_bytes(8, "little"))
        state.update(data)
    return state.digest()


def unique_key() -> bytes:
    """Return a key for a value that a script brought: never seen before, on any machine."""
    return digest("given", _PROCESS, str(next(_count)))


def given_key(value: Any) -> bytes:
    """Key of a value that a script brought: its provenance, given now if it has none; content for what is small."""
    if not isinstance(value, Value):
        return digest("given", content_key(value))
    if value.provenance is None:
        # Another engine may do the same at this moment; then its key is as good.
        with contextlib.suppress(AttributeError):
            value.provenance = unique_key()
    assert value.provenance is not None
    return value.provenance


@dataclasses.dataclass(frozen=True, slots=True)
class Code:
    """What the code of a processor contributes. ``parts`` are (what, short digest), for `why`."""

    digest: bytes
    parts: tuple[tuple[str, str], ...]


@dataclasses.dataclass(frozen=True, slots=True)
class Local:
    """What a node contributes by itself: its code, its parameters and the files that these name.

    ``encoded`` holds canonical JSON for each visible parameter; ``files`` the state of each file parameter.
    """

    digest: bytes
    code: Code
    encoded: Mapping[str, str]
    files: Mapping[str, str]


def code_of(processor: type[Processor]) -> Code:
    """Digest a processor: id, version, class name, source file, and each of its kernels after includes."""
    source = _source_digest(processor)
    parts = [
        ("id", processor.id),
        ("version", str(processor.version)),
        ("class", processor.__qualname__),
        ("source text", source.hex()),
    ]
    parts += [(f"shader {name}", text.hex()) for name, text in _shader_digests(processor)]
    return Code(digest(*itertools.chain.from_iterable(parts)), tuple((what, text[:16]) for what, text in parts))


def local_of(node: FlatNode, code: Code) -> Local:
    """Combine a node's code with its visible parameters and the present state of its files."""
    params = node.processor.params if node.processor is not None else {}
    encoded: dict[str, str] = {}
    files: dict[str, str] = {}
    for name, value in node.values.items():
        kind = params[name]
        encoded[name] = canonical(kind.encode(value))
        if getattr(kind, "write", True) is False and value:
            files[name] = file_state(value)
    parts = itertools.chain.from_iterable(itertools.chain(sorted(encoded.items()), sorted(files.items())))
    return Local(digest(code.digest, str(len(encoded)), *parts), code, encoded, files)


def file_state(path: str | os.PathLike[str]) -> str:
    """Say which file and which state of it: path, size and mtime_ns. A missing file is a state too."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return f"{os.fspath(path)} missing"
    told = f"{os.path.abspath(path)} {found.st_size} bytes, mtime {found.st_mtime_ns}"
    if not stat.S_ISDIR(found.st_mode):
        return told
    # A file that is a folder of chunks: who writes it writes its metadata too, and nobody looks at a million chunks.
    parts = [os.path.join(path, name) for name in FOLDER_METADATA]
    return "; ".join([told, *(file_state(part) for part in parts if os.path.isfile(part))])


def canonical(value: Any) -> str:
    """Encode plain data so that equal data give equal text, in every process: sorted keys, repr of floats."""
    return json.dumps(_plain(value), sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        # -0.0 and 0 are told apart by JSON, as they must be: 1 / x differs.
        return value if math.isfinite(value) else {"float": repr(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value


def content_key(value: Any, where: str = "value") -> bytes:
    """Key of a value by what it holds: arrays are hashed whole. Raises TypeError for what has no content.

    Understands None, numbers, text, bytes, numpy scalars and arrays, lists, tuples, dicts and sets of these,
    and everything with ``to_parts``.
    """
    if value is None or isinstance(value, (bool, int, float, str, np.generic)):
        return digest("plain", type(value).__name__, repr(value))
    if isinstance(value, bytes):
        return digest("bytes", value)
    if isinstance(value, (np.ndarray, Buffer)):
        return array_key(value.array if isinstance(value, Buffer) else value)
    if isinstance(value, (list, tuple)):
        return digest("list", *(content_key(item, f"{where}[{i}]") for i, item in enumerate(value)))
    if isinstance(value, (set, frozenset)):
        return digest("set", *sorted(content_key(item, where) for item in value))
    if isinstance(value, Mapping):
        pairs = sorted((content_key(key, where), content_key(item, f"{where}[{key!r}]")) for key, item in value.items())
        return digest("dict", *itertools.chain.from_iterable(pairs))
    if isinstance(value, Value):
        meta, arrays = value.to_parts()
        parts: list[bytes | str] = [type(value).__qualname__, canonical(meta)]
        for name, array in sorted(arrays.items()):
            parts += [name, array_key(array)]
        return digest("value", *parts)
    if isinstance(value, os.PathLike):
        return digest("file", file_state(value))
    raise TypeError(f"{where}: a {type(value).__name__} has no key; pass numbers, text, arrays or values of ports")


def array_key(array: np.ndarray[Any, Any]) -> bytes:
    """Hash dtype, shape and bytes of an array, about 1 GB/s, without a copy where it is contiguous."""
    if array.dtype.hasobject:
        raise TypeError("an array of Python objects has no key; use numbers or fixed-length text")
    state = hashlib.blake2b(digest_size=SIZE)
    state.update(f"{array.dtype.str} {array.shape}".encode())
    if array.flags.c_contiguous:
        state.update(as_bytes(array))
    else:
        for part in array if array.ndim > 1 else [array]:
            state.update(np.ascontiguousarray(part).tobytes())
    return state.digest()


def as_bytes(array: np.ndarray[Any, Any]) -> memoryview:
    """The bytes of a contiguous array, without a copy."""
    return memoryview(array.reshape(-1).view(np.uint8).data) if array.size else memoryview(b"")


def function_key(function: Any) -> bytes:
    """Key of a module-level function: module, qualified name, and the text of the file that holds it.

    The whole file counts, since the function may call its neighbours. Raises TypeError, with the reason, for
    what cannot be found again by its name.
    """
    name = getattr(function, "__qualname__", repr(function))
    if not isinstance(function, FunctionType):
        raise TypeError(f"memo({name}): expected a function of a module, got a {type(function).__name__}")
    if function.__name__ == "<lambda>":
        raise TypeError("memo(<lambda>): a lambda has no name that says what it does; write a function in the module")
    if function.__closure__ or "<locals>" in name:
        raise TypeError(
            f"memo({name}): a nested function may depend on variables that no key sees; "
            f"move it to the top of the module and pass what it needs as arguments"
        )
    if "." in name:
        raise TypeError(f"memo({name}): a method depends on its object; write a function in the module")
    return digest("function", function.__module__, name, _function_digest(function))


@functools.lru_cache(maxsize=1024)
def _function_digest(function: FunctionType) -> bytes:
    return _file_digest(function.__code__.co_filename) or digest("bytecode", *_bytecode(function.__code__))


def _source_digest(processor: type[Processor]) -> bytes:
    """Digest of the text that the class was made from, read once, when the class is first seen."""
    known: bytes | None = processor.__dict__.get("source_digest") or _class_digests.get(processor)
    if known is None:
        module = sys.modules.get(processor.__module__)
        known = _file_digest(getattr(module, "__file__", None) or "")
        if known is None:
            # Classes typed into an interpreter have no file: their byte code stands for it.
            members = (item for _, item in sorted(vars(processor).items()) if isinstance(item, FunctionType))
            known = digest("bytecode", *(part for item in members for part in _bytecode(item.__code__)))
        _class_digests[processor] = known
    return known


def _file_digest(path: str) -> bytes | None:
    try:
        return digest("file", Path(path).read_bytes())
    except (OSError, ValueError):
        return None


def _bytecode(code: CodeType) -> Iterable[bytes | str]:
    yield code.co_code
    yield repr(code.co_names)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _bytecode(constant)
        else:
            yield repr(constant)


def _shader_digests(processor: type[Processor]) -> list[tuple[str, bytes]]:
    """Name and digest of each kernel's text after includes. A kernel that cannot be read counts as its error."""
    if not processor.kernels:
        return []
    from nodegraph.kernel_sources import kernel_source

    found = []
    for name in processor.kernels:
        try:
            found.append((name, digest(kernel_source(processor, name).digest)))
        except GraphError as error:
            found.append((name, digest("unreadable", str(error))))
    return found
