"""PNG: pictures to look at. sRGB, straight alpha, 8 or 16 bits; carries the workspace that made it.

Colour is stored straight (not premultiplied), so what was hardly visible loses digits: for exact colour, and for depth
and ids, write EXR.
"""

from __future__ import annotations

import json
import struct
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from nodegraph.data import Image, Value
from nodegraph.data.buffer import Array
from nodegraph.errors import FormatError
from nodegraph.formats import oiio, raw, srgb
from nodegraph.formats.atomic import replacing

suffixes = (".png",)
SIGNATURE = b"\x89PNG\r\n\x1a\n"
KEYWORD = "nodegraph-workspace"
TEXT_LIMIT = 64 << 20
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples per pixel by colour type: grey, RGB, palette, grey and alpha, RGBA."""


def read(path: Path) -> Image:
    """Return linear premultiplied RGBA, float32; grey and opaque pictures too."""
    path = Path(path)
    header = _header(path)
    width, height, bits = header
    opened = oiio.open_input(path, "png")
    spec = opened.spec()
    if (spec.width, spec.height) != (width, height):
        raise FormatError("the picture has another size than its header says", file=str(path), field="IHDR")
    pixels = oiio.read_pixels(opened, 0, spec.nchannels, "uint16" if bits == 16 else "uint8", path)
    opened.close()
    stored = pixels.reshape(height, width, -1).astype(np.float32) / (65535 if bits == 16 else 255)
    count = stored.shape[2]
    color = np.empty((height, width, 4), np.float32)
    color[..., :3] = srgb.decode(stored[..., :3] if count > 2 else stored[..., :1])
    color[..., 3] = stored[..., -1] if count in (2, 4) else 1.0
    color[..., :3] *= color[..., 3:]
    return Image(color)


def info(path: Path) -> dict[str, Any]:
    """What the header says."""
    width, height, bits = _header(Path(path))
    has = read_workspace(Path(path)) is not None
    return {"kind": "Image", "format": "PNG", "size": [width, height], "bits": bits, "workspace": has}


def write(
    value: Value, path: Path, *, bits: int = 8, background: Sequence[float] | None = None, workspace: str = ""
) -> None:
    """Write a picture, straight RGBA; with a ``background`` (linear RGB) opaque RGB.

    ``workspace`` is the JSON text that `read_workspace` gives back. One channel becomes grey; what lies outside 0..1
    is clipped.
    """
    path = Path(path)
    part = _part(value, path, bits, background, workspace)
    with replacing(path) as temporary:
        oiio.write(temporary, path, "png", [part])


def encode(image: Image, *, bits: int = 8, background: Sequence[float] | None = None, workspace: str = "") -> bytes:
    """The bytes of the file that `write` would write."""
    with tempfile.TemporaryDirectory(prefix="nodegraph-") as folder:  # OpenImageIO writes to files only
        path = Path(folder) / "picture.png"
        oiio.write(path, path, "png", [_part(image, path, bits, background, workspace)])
        return path.read_bytes()


def read_workspace(path: Path) -> str | None:
    """The workspace in a PNG as JSON text, or None where it carries none. No pixel is read."""
    path = Path(path)
    with open(path, "rb") as file:
        for kind, length in _chunks(file, path):
            if kind == b"tEXt" and length <= TEXT_LIMIT:
                keyword, _, text = file.read(length).partition(b"\0")
                if keyword == KEYWORD.encode():
                    return text.decode("latin-1")
    return None


def _part(value: Value, path: Path, bits: int, background: Sequence[float] | None, workspace: str) -> oiio.Part:
    if not isinstance(value, Image):
        raise FormatError(f"PNG holds pictures, this is {value.kind}; choose another suffix", file=str(path))
    if bits not in (8, 16):
        raise FormatError(f"expected 8 or 16 bits, got {bits}", file=str(path), field="bits")
    if value.channels == 2:
        raise FormatError("PNG cannot hold two channels of distances; write .exr", file=str(path))
    straight = _straight(value, background)
    names = "Y" if straight.shape[2] == 1 else "RGBA"[: straight.shape[2]]
    attributes: dict[str, Any] = {"oiio:UnassociatedAlpha": 1, "oiio:ColorSpace": "sRGB"}
    if workspace:
        attributes[KEYWORD] = _ascii(workspace)
    type = f"uint{bits}"
    return oiio.Part(_quantise(straight, bits), tuple((name, type) for name in names), attributes)


def _straight(image: Image, background: Sequence[float] | None) -> Array:
    """sRGB colour (h, w, 1, 3 or 4), not premultiplied, alpha linear, real 0..1."""
    if image.channels == 1:
        return srgb.encode(image.color)
    if background is not None:
        return srgb.encode(image.over((float(background[0]), float(background[1]), float(background[2]))))
    alpha = np.clip(np.nan_to_num(image.color[..., 3:], nan=0.0), 0.0, 1.0)
    color = image.color[..., :3] / np.where(alpha > 0.0, alpha, 1.0)
    return np.concatenate([srgb.encode(color), alpha], axis=2)


def _quantise(unit: Array, bits: int) -> Array:
    """Reals 0..1 to the nearest integer of so many bits."""
    top = 2**bits - 1
    return np.ascontiguousarray((unit.astype(np.float64) * top + 0.5).astype(np.uint16 if bits == 16 else np.uint8))


def _ascii(text: str) -> str:
    """The same JSON without characters that a tEXt chunk (Latin-1) could not hold."""
    return "".join(c if c.isascii() else json.dumps(c)[1:-1] for c in text)


def _header(path: Path) -> tuple[int, int, int]:
    """(width, height, bits), held against the size of the file: a PNG bomb is refused before it is unpacked."""
    with open(path, "rb") as file:
        kind, length = next(_chunks(file, path), (b"", 0))
        block = file.read(13)
    if kind != b"IHDR" or length != 13 or len(block) < 13:
        raise FormatError("the file does not begin with its header", file=str(path), field="IHDR")
    width, height, bits, colour = struct.unpack(">IIBB", block[:10])
    if not width or not height or colour not in CHANNELS or bits not in (1, 2, 4, 8, 16):
        raise FormatError(f"{width}x{height}, {bits} bits, colour type {colour}", file=str(path), field="IHDR")
    row = (width * bits * CHANNELS[colour] + 7) // 8
    raw.check_packed(row * height, path.stat().st_size, path, "IHDR")
    return width, height, bits


def _chunks(file: BinaryIO, path: Path) -> Iterator[tuple[bytes, int]]:
    """Kind and length of each chunk; the file stands at the chunk's data when it is handed out."""
    if file.read(8) != SIGNATURE:
        raise FormatError("this is no PNG file", file=str(path), field="signature")
    while len(head := file.read(8)) == 8:
        length, kind = struct.unpack(">I4s", head)
        start = file.tell()
        yield kind, length
        if kind == b"IEND":
            return
        file.seek(start + length + 4)
