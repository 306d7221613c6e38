"""Writing a file so that it is there whole, or not at all."""

from __future__ import annotations

import atexit
import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from nodegraph.errors import FormatError

_parts: set[Path] = set()


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give the body another name to write to, in the same folder, and put that file in place of ``path`` at the end.

    When the body raises (a full disk, Ctrl-C, a bug), what it wrote is removed and an older file at ``path`` is
    untouched. A reader sees the old file or the new one, never half of one; who has the old one mapped keeps it. A
    symbolic link is followed, so that the link stays and its target changes. Raises FormatError for what the system
    refuses.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise FormatError("this is a folder; add a file name", file=os.fspath(path))
    if not target.parent.is_dir():
        raise FormatError(f"the folder {target.parent} does not exist; create it first", file=os.fspath(path))
    part = target.with_name(f".{target.name[:100]}.{secrets.token_hex(4)}.part")
    _parts.add(part)
    try:
        # Not tempfile: its files are private to the user, whatever the umask says.
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        if target.exists():
            os.chmod(part, target.stat().st_mode & 0o777)
        yield part
        os.replace(part, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            part.unlink()
        if isinstance(error, OSError):
            raise FormatError(f"cannot be written: {_reason(error)}", file=os.fspath(path)) from error
        raise
    finally:
        _parts.discard(part)


@atexit.register
def remove_parts() -> None:
    """Remove what threads are still writing, when the program ends without waiting for them."""
    for part in list(_parts):
        with contextlib.suppress(OSError):
            part.unlink()


def make_folder(path: Path) -> None:
    """Make a folder and those above it, where they are not there yet. Raises FormatError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise FormatError("a file is in the way of this folder; choose another place", file=os.fspath(path)) from None
    except OSError as error:
        raise FormatError(f"this folder cannot be made: {_reason(error)}", file=os.fspath(path)) from error


def _reason(error: OSError) -> str:
    cures = {
        errno.ENOSPC: "the disk is full; free some space or write elsewhere",
        errno.EDQUOT: "your quota of the disk is used up; free some space or write elsewhere",
        errno.EACCES: "permission denied; write to a folder of yours",
        errno.EPERM: "permission denied; write to a folder of yours",
        errno.EROFS: "the disk is read-only; write elsewhere",
    }
    if error.errno is None:  # numpy says only how many bytes were written
        return f"{error or type(error).__name__}; is the disk full?"
    return cures.get(error.errno, error.strerror or type(error).__name__)
