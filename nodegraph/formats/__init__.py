"""Reading and writing files. One module per format; a format is found by the suffix of the path.

    volume = formats.read("chest.nii.gz")
    labels = formats.read_labels("organs.nrrd")
    formats.write(image, "picture.png", workspace=text)
    formats.info("chest.nii.gz")          # the header alone, whatever the size of the file

A format is a module, or any object, with ``suffixes``, ``read(path, **options)`` and, where it makes sense,
``write(value, path, **options)``, ``info(path)`` and ``read_labels(path, **options)``. Installed packages add theirs
through the entry-point group ``nodegraph.formats``; a suffix of theirs never hides a built-in one.

Whatever is wrong with a file is a FormatError that names the file and the field.
"""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nodegraph.data import Labels, Value, Volume
from nodegraph.errors import FormatError, near_miss
from nodegraph.formats.atomic import make_folder, replacing

__all__ = ["find", "info", "make_folder", "read", "read_labels", "replacing", "suffixes", "write"]

BUILT_IN = {
    ".nii": "nifti",
    ".nii.gz": "nifti",
    ".nrrd": "nrrd",
    ".nhdr": "nrrd",
    ".npy": "npy",
    ".npz": "npy",
    ".png": "png",
    ".exr": "exr",
    ".zarr": "zarr",
}
READ_ONLY = (".nhdr", ".zarr")

PathLike = str | os.PathLike[str]


def read(path: PathLike, **options: Any) -> Value:
    """Return the volume or the image in a file.

    Volume formats take ``time`` (index of a time step) and ``fourth_axis`` ("auto", "time" or "components": what a
    fourth axis means where the file does not say), those of several resolutions ``level``. Uncompressed data is mapped,
    and data in chunks read when it is needed.
    """
    path, format = _there(path), find(path)
    value = _call(format.read, "read", path, options)
    if not isinstance(value, Value):
        raise FormatError(f"its format returned {type(value).__name__}, which is no value of nodegraph", file=str(path))
    return value


def read_labels(path: PathLike, **options: Any) -> Labels:
    """Return the ids in a file. Whole numbers stored as reals are accepted; anything else is refused."""
    path, format = _there(path), find(path)
    if hasattr(format, "read_labels"):
        labels: Labels = _call(format.read_labels, "read_labels", path, options)
        return labels
    value = _call(format.read, "read", path, options)
    if isinstance(value, Labels):
        return value
    if not isinstance(value, Volume):
        raise FormatError(f"holds {value.kind}, not labels", file=str(path))
    from nodegraph.formats.raw import to_labels

    return to_labels(value, path)


def write(value: Value, path: PathLike, **options: Any) -> None:
    """Write a value in the format that the suffix names. The file appears whole or not at all."""
    path, format = Path(path), find(path)
    if not hasattr(format, "write"):
        raise FormatError(f"this format is only read; choose one of {', '.join(suffixes(write=True))}", file=str(path))
    _call(lambda path, **rest: format.write(value, path, **rest), "write", path, options, like=format.write)


def info(path: PathLike) -> dict[str, Any]:
    """What the header says, as JSON: kind, format, size, type, spacing, ... Cheap where the format has a header."""
    path, format = _there(path), find(path)
    if hasattr(format, "info"):
        told: dict[str, Any] = _call(format.info, "info", path, {})
    else:
        value = _call(format.read, "read", path, {})
        told = {"kind": value.kind, "summary": value.summary()}
    # A folder may hold a million chunks: they are not counted.
    size = {} if path.is_dir() else {"bytes_on_disk": path.stat().st_size}
    return {"file": str(path), **size, **told}


def suffixes(*, write: bool = False) -> tuple[str, ...]:
    """Every known suffix; with ``write=True`` those that can be written."""
    plugged = {s: f for s, f in _plugged().items() if not write or hasattr(f, "write")}
    return (*(s for s in BUILT_IN if not write or s not in READ_ONLY), *plugged)


def find(path: PathLike) -> Any:
    """The format of a path: the longest known suffix that the name ends with."""
    name = Path(path).name.lower()
    for suffix in sorted(BUILT_IN, key=len, reverse=True):
        if name.endswith(suffix):
            return importlib.import_module(f"nodegraph.formats.{BUILT_IN[suffix]}")
    plugged = _plugged()
    for suffix in sorted(plugged, key=len, reverse=True):
        if name.endswith(suffix):
            return plugged[suffix]
    known = suffixes()
    ending = "".join(Path(name).suffixes[-2:]) if name.endswith(".gz") else Path(name).suffix
    message = f"no format has the suffix {ending!r}{near_miss(ending, known)}" if ending else "the name has no suffix"
    broken = "".join(f"; the plug-in {name} is unavailable: {reason}" for name, reason in _broken().items())
    raise FormatError(f"{message}; known are {', '.join(known)}{broken}", file=str(path))


def _plugged() -> dict[str, Any]:
    from nodegraph import plugins

    found: dict[str, Any] = {}
    for plugin in plugins.discover("nodegraph.formats"):
        if plugin.object is not None and hasattr(plugin.object, "read"):
            for suffix in getattr(plugin.object, "suffixes", ()):
                if suffix not in BUILT_IN:
                    found.setdefault(suffix.lower(), plugin.object)
    return found


def _broken() -> dict[str, str]:
    from nodegraph import plugins

    return {plugin.name: plugin.reason for plugin in plugins.discover("nodegraph.formats") if plugin.reason}


def _there(path: PathLike) -> Path:
    path = Path(path)
    if path.is_dir() and not _is_folder_format(path):
        raise FormatError("this is a folder; choose a file in it", file=str(path))
    if not path.exists():
        near = near_miss(path.name, _others(path)) if path.parent.is_dir() else ""
        raise FormatError(f"there is no such file{near}; check the path", file=str(path))
    if not path.is_dir() and not path.is_file():  # to open a pipe would wait for somebody to write into it
        raise FormatError("this is a pipe or a device, and no file", file=str(path))
    return path


def _others(path: Path) -> list[str]:
    """What lies beside a file. A link that leads nowhere has the very name that was asked for."""
    return [name for name in os.listdir(path.parent) if name != path.name]


def _is_folder_format(path: Path) -> bool:
    try:
        return bool(getattr(find(path), "folders", False))
    except FormatError:
        return False


def _call(
    function: Callable[..., Any], verb: str, path: Path, options: dict[str, Any], like: Callable[..., Any] | None = None
) -> Any:
    """Call a format; what the system refuses and options that the format lacks become FormatErrors."""
    parameters = inspect.signature(like or function).parameters
    if not any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        for name in options:
            if name not in parameters:
                known = [n for n, p in parameters.items() if p.kind is p.KEYWORD_ONLY]
                raise FormatError(
                    f"this format has no option {name!r} to {verb}{near_miss(name, known)}", file=str(path)
                )
    try:
        return function(path, **options)
    except OSError as error:
        raise FormatError(f"cannot {verb}: {error.strerror or error}", file=str(path)) from error
