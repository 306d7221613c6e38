"""OpenEXR: pictures to compute with. Linear, premultiplied, float32 or half; depth as channel Z, ids as a second part.

The first part holds R G B A (or Y; or entry and exit) and, always as float32, Z: mm along the view axis, inf where
nothing is. Ids are uint32, which float32 could not hold, and lie in a part called "ids".
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nodegraph.data import Image, Value
from nodegraph.data.buffer import Array
from nodegraph.errors import FormatError, PortError
from nodegraph.formats import oiio
from nodegraph.formats.atomic import replacing

suffixes = (".exr",)
COLORS = {1: ("Y",), 2: ("entry", "exit"), 4: ("R", "G", "B", "A")}
KEYWORD = "nodegraph-workspace"
SLACK = 64 << 20
RATIO = 2000
"""A picture of up to 64 MiB is always unpacked; a larger one if its file is not absurdly small for it."""


def read(path: Path) -> Image:
    """Return colour as float32, with depth and ids where the file has them. RGB alone is opaque."""
    path = Path(path)
    opened = oiio.open_input(path, "openexr")
    channels, size = _first(opened, path)
    pixels = oiio.read_pixels(opened, 0, len(channels), "float", path).reshape(size[1], size[0], -1)
    color = _color(pixels, channels, path)
    depth = np.ascontiguousarray(pixels[..., channels.index("Z")]) if "Z" in channels else None
    ids = None
    index = 1
    while opened.seek_subimage(index, 0):
        if opened.spec().channelnames == ("id",):
            _check_size(opened.spec(), path)
            ids = oiio.read_pixels(opened, index, 1, "uint", path).reshape(opened.spec().height, -1)
        index += 1
    opened.close()
    try:
        return Image(color, depth, ids)
    except PortError as error:
        raise FormatError(str(error), file=str(path)) from None


def info(path: Path) -> dict[str, Any]:
    """What the header says."""
    path = Path(path)
    opened = oiio.open_input(path, "openexr")
    channels, size = _first(opened, path)
    spec = opened.spec()
    told = {
        "kind": "Image",
        "format": f"OpenEXR, {spec.get_string_attribute('compression')}",
        "size": list(size),
        "channels": channels,
        "type": str(spec.channelformats[0] if spec.channelformats else spec.format),
        "ids": bool(opened.seek_subimage(1, 0)) and opened.spec().channelnames == ("id",),
        "workspace": bool(spec.get_string_attribute(KEYWORD)),
    }
    opened.close()
    return told


def write(value: Value, path: Path, *, half: bool = False, workspace: str = "") -> None:
    """Write a picture; ``half`` stores colour in 16 bits (depth stays float32). Nothing is clipped."""
    path = Path(path)
    if not isinstance(value, Image):
        raise FormatError(f"OpenEXR holds pictures, this is {value.kind}; choose another suffix", file=str(path))
    planes = [value.color.astype(np.float32, copy=False)]
    channels = [(name, "half" if half else "float") for name in COLORS[value.channels]]
    if value.depth is not None:
        planes.append(value.depth.astype(np.float32, copy=False)[..., None])
        channels.append(("Z", "float"))
    attributes: dict[str, Any] = {"compression": "zip", "oiio:ColorSpace": "lin_rec709_scene"}
    if workspace:
        attributes[KEYWORD] = workspace
    parts = []
    if value.ids is not None:
        attributes["oiio:subimagename"] = "color"
        ids = np.ascontiguousarray(value.ids[..., None], np.uint32)
        parts.append(oiio.Part(ids, (("id", "uint"),), {"compression": "zip", "oiio:subimagename": "ids"}))
    parts.insert(0, oiio.Part(np.ascontiguousarray(np.concatenate(planes, axis=2)), tuple(channels), attributes))
    with replacing(path) as temporary:
        oiio.write(temporary, path, "openexr", parts)


def read_workspace(path: Path) -> str | None:
    """The workspace in a file as JSON text, or None where it carries none."""
    opened = oiio.open_input(Path(path), "openexr")
    text = str(opened.spec().get_string_attribute(KEYWORD))
    opened.close()
    return text or None


def _first(opened: Any, path: Path) -> tuple[list[str], tuple[int, int]]:
    """Channel names and size of the first part, checked."""
    spec = opened.spec()
    _check_size(spec, path)
    if spec.deep:
        raise FormatError("deep pictures are not read; flatten it first", file=str(path))
    return list(spec.channelnames), (spec.width, spec.height)


def _check_size(spec: Any, path: Path) -> None:
    promised = spec.width * spec.height * spec.nchannels * 4
    if promised > path.stat().st_size * RATIO + SLACK:
        raise FormatError(
            f"{spec.width}x{spec.height} pixels in a file of {path.stat().st_size} bytes; the header is wrong",
            file=str(path),
            field="dataWindow",
        )


def _color(pixels: Array, channels: list[str], path: Path) -> Array:
    for names in COLORS.values():
        if all(name in channels for name in names) and not (names == ("Y",) and "A" in channels):
            return np.ascontiguousarray(pixels[..., [channels.index(name) for name in names]])
    color = np.ones((*pixels.shape[:2], 4), np.float32)
    if all(name in channels for name in "RGB"):
        color[..., :3] = pixels[..., [channels.index(name) for name in "RGB"]]
        return color
    if "Y" in channels:  # with an alpha of its own
        color[..., :3] = pixels[..., [channels.index("Y")]]
        color[..., 3] = pixels[..., channels.index("A")]
        return color
    raise FormatError(
        f"expected channels R G B, found {', '.join(channels[:12])}; rename the layer that you want", file=str(path)
    )
