"""Workspaces: a network as a JSON file.

``load`` and ``save`` for files, ``loads`` and ``dumps`` for text. Reading is in ``workspace_reader.py``, writing in
``workspace_writer.py``; docs/workspace-format.md describes the format. A workspace is data: reading one runs nothing of
it and writes nothing, and what is not understood is kept and written back.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from nodegraph import json_text
from nodegraph.errors import WorkspaceError
from nodegraph.workspace_reader import read
from nodegraph.workspace_writer import document

if TYPE_CHECKING:
    from nodegraph.network import Network
    from nodegraph.processor import Processor

PICTURES = (".png", ".exr")  #: suffixes of pictures that carry the workspace that made them

Find = Callable[[str], "type[Processor]"]


def load(path: str | os.PathLike[str], *, find: Find | None = None) -> Network:
    """Read a workspace file, or the workspace that a PNG or EXR picture carries.

    Raises WorkspaceError, which names the file and the place in it.
    """
    path = Path(os.path.abspath(path))
    is_picture = path.suffix.lower() in PICTURES
    text = _picture_text(path) if is_picture else _file_text(path)
    network = loads(text, folder=path.parent, file=path.name, find=find)
    if not is_picture:  # saving must not put JSON in the place of the picture
        network.file = path
    return network


def loads(
    text: str, *, folder: str | os.PathLike[str] | None = None, file: str = "", find: Find | None = None
) -> Network:
    """Make a network from the text of a workspace.

    Args:
        folder: what relative paths are relative to; without one they stay as they are.
        file: name for messages.
        find: processor class by id; default: the registry.
    """
    network = read(json_text.parse(text, file), None if folder is None else os.path.abspath(folder), file, find)
    network.history.mark_saved()
    return network


def dumps(network: Network, *, folder: str | os.PathLike[str] | None = None) -> str:
    """Return the text of a workspace. Paths below ``folder`` become relative; without one they stay as they are."""
    return json_text.write(document(network.root, None if folder is None else os.path.abspath(folder)))


def moved(text: str, folder: str | os.PathLike[str]) -> str:
    """The text that `dumps` returned without a folder, for a file in this one."""
    return dumps(loads(text), folder=folder)


def save(network: Network, path: str | os.PathLike[str] | None = None) -> None:
    """Write a workspace so that the file is the old one or the new one at any time, and never half of it.

    Without a path: the file that it came from. Raises WorkspaceError; the old file is then as it was.
    """
    root = network.root
    if path is None and root.file is None:
        raise WorkspaceError("this workspace has no file yet; say where to save it")
    target = Path(os.path.abspath(path if path is not None else root.file or ""))
    text = dumps(root, folder=target.parent)
    try:
        _replace(target, text.encode())
    except OSError as error:
        raise WorkspaceError(
            f"cannot be written: {error.strerror or error}; the old file is untouched, save elsewhere", file=str(target)
        ) from error
    root.file = target
    root.history.mark_saved()


def _file_text(path: Path) -> str:
    try:
        if path.stat().st_size > json_text.LARGEST * 4:
            raise WorkspaceError("too large to be a workspace", file=str(path))
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise WorkspaceError("there is no such file", file=str(path)) from None
    except OSError as error:
        raise WorkspaceError(f"cannot be read: {error.strerror or error}", file=str(path)) from None
    except UnicodeDecodeError as error:
        raise WorkspaceError(f"byte {error.start}: this is not UTF-8 text, so no workspace", file=str(path)) from None


def _picture_text(path: Path) -> str:
    from nodegraph.formats import exr, png

    if path.is_dir():
        raise WorkspaceError("this is a folder; choose a file in it", file=str(path))
    if not path.is_file():
        raise WorkspaceError("there is no such file", file=str(path))
    text = png.read_workspace(path) if path.suffix.lower() == ".png" else exr.read_workspace(path)
    if text is None:
        raise WorkspaceError("this picture carries no workspace", file=str(path))
    return text


def _replace(target: Path, data: bytes) -> None:
    """Write beside the target, force it to the disk, then put it in the target's place."""
    import secrets

    target = Path(os.path.realpath(target))  # a symbolic link stays one
    beside = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    try:
        with open(beside, "xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            os.chmod(beside, target.stat().st_mode & 0o777)
        os.replace(beside, target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
