"""What kind of file a path names, in a line and a small picture. Nothing here needs the window's thread."""

from __future__ import annotations

import itertools
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtGui import QImage

from nodegraph import formats
from nodegraph.data import Image, Volume
from nodegraph.editor.previews import middle_slice, picture_of
from nodegraph.errors import GraphError, one_sentence

MOST_BYTES = 256 << 20
"""Data that would take more than this when it is unpacked gets no picture."""
MOST_ENTRIES = 10_000
"""Entries of a folder that are counted."""
SIDE = 96
"""Longer side of a picture, pixels."""


@dataclass(frozen=True, slots=True)
class Look:
    """What was found. text: one line, empty where nothing is known. trouble: why the file is of no use, or empty."""

    text: str = ""
    picture: QImage | None = None
    trouble: str = ""


def look_at(path: Path) -> Look:
    """Look at a file: its header, and its middle slice or its picture where that takes little memory."""
    try:
        if not path.exists():
            return Look(trouble=f"not found: {path.name}")
        told = formats.info(path)
        text = describe(told)
        return Look(text, _picture(path, told))
    except (GraphError, OSError, MemoryError, ValueError) as error:
        return Look(trouble=one_sentence(error).removeprefix(f"{path}: "))


def look_into(folder: Path) -> Look:
    """How many things a folder holds."""
    try:
        count = sum(1 for _ in itertools.islice(os.scandir(folder), MOST_ENTRIES))
    except FileNotFoundError:
        return Look(trouble=f"not found: {folder.name}")
    except NotADirectoryError:
        return Look(trouble=f"{folder.name} is a file, not a folder")
    except OSError as error:
        return Look(trouble=f"{folder.name}: {error.strerror or error}")
    if count == MOST_ENTRIES:
        return Look(f"{count} entries or more")
    return Look("empty" if count == 0 else f"{count} {'entry' if count == 1 else 'entries'}")


def describe(told: dict[str, Any]) -> str:
    """What `formats.info` says, as "256x256x60 int16, 0.7x0.7x1 mm, NIfTI-1, gzip, 2.1 MB"."""
    parts = []
    if "size" in told:
        bits = f"{told['bits']} bit" if "bits" in told else str(told.get("type", ""))
        parts.append(f"{'x'.join(str(side) for side in told['size'])} {bits}".strip())
    elif "summary" in told:
        parts.append(str(told["summary"]))
    if "spacing" in told:
        parts.append(f"{'x'.join(f'{step:.4g}' for step in told['spacing'])} mm")
    for key, word in (("components", "components"), ("times", "times"), ("levels", "resolutions")):
        if told.get(key, 1) > 1:
            parts.append(f"{told[key]} {word}")
    parts.append(str(told.get("format", told.get("kind", ""))))
    if "bytes_on_disk" in told:
        parts.append(in_bytes(told["bytes_on_disk"]))
    return ", ".join(part for part in parts if part)


def in_bytes(count: int) -> str:
    """A number of bytes as a person says it."""
    for unit, size in (("GB", 10**9), ("MB", 10**6), ("kB", 10**3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"


def _picture(path: Path, told: dict[str, Any]) -> QImage | None:
    """The picture, or None where it would take too much memory or there is nothing to see."""
    options: dict[str, Any] = {}
    if told.get("levels", 1) > 1:
        options["level"] = told["levels"] - 1  # its data is read when it is needed, and the coarsest is the least
    elif told.get("kind") == "Image":
        if math.prod(told["size"]) * 16 > MOST_BYTES:
            return None
    elif _unpacked(told) > max(MOST_BYTES, told.get("bytes_on_disk", 0)):
        return None  # what is not packed is mapped, and only the slice is read
    value = formats.read(path, **options)
    if isinstance(value, Volume):
        return middle_slice(value, (SIDE, SIDE))
    return picture_of(value, (SIDE, SIDE)) if isinstance(value, Image) else None


def _unpacked(told: dict[str, Any]) -> int:
    """Bytes of the data in memory, as far as the header says; 0 for a format that does not."""
    try:
        counts = [*told["size"], told.get("components", 1), told.get("times", 1), np.dtype(told["type"]).itemsize]
        return math.prod(int(count) for count in counts)
    except (KeyError, TypeError):
        return 0
