"""What the picture formats ask of OpenImageIO."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from nodegraph.data.buffer import Array
from nodegraph.errors import FormatError


class Part(NamedTuple):
    """One sub-image to be written: an array (h, w, c) in a type of its own, and the type of each channel in the file.

    ``channels`` are (name, type) with OpenImageIO's own names of types: "float", "half", "uint8", "uint16", "uint".
    ("float32" is taken for another type without an error.)
    """

    pixels: Array
    channels: tuple[tuple[str, str], ...]
    attributes: dict[str, Any]


def write(path: Path, name: Path, format: str, parts: list[Part]) -> None:
    """Write sub-images to ``path``; ``name`` is what errors call the file."""
    import OpenImageIO as oiio

    output = oiio.ImageOutput.create(format)
    if output is None:
        raise FormatError(f"this OpenImageIO writes no {format}: {oiio.geterror()}", file=str(name))
    specs = tuple(_spec(oiio, part) for part in parts)
    done = bool(output.open(str(path), specs) if len(specs) > 1 else output.open(str(path), specs[0]))
    for i, part in enumerate(parts):
        if done and i:
            done = bool(output.open(str(path), specs[i], "AppendSubimage"))
        done = done and bool(output.write_image(part.pixels))
    done = bool(output.close()) and done
    if not done:
        raise FormatError(f"cannot be written: {output.geterror() or 'is the disk full?'}", file=str(name))


def _spec(oiio: Any, part: Part) -> Any:
    height, width, count = part.pixels.shape
    types = [type for _, type in part.channels]
    spec = oiio.ImageSpec(width, height, count, types[0])
    spec.channelnames = tuple(name for name, _ in part.channels)
    if len(set(types)) > 1:
        spec.channelformats = tuple(oiio.TypeDesc(type) for type in types)
    if "A" in spec.channelnames:
        spec.alpha_channel = spec.channelnames.index("A")
    if "Z" in spec.channelnames:
        spec.z_channel = spec.channelnames.index("Z")
    for key, value in part.attributes.items():
        spec.attribute(key, value)
    return spec


def open_input(path: Path, format: str) -> Any:
    """An open reader, straight alpha left as it is; FormatError where the file is none of the format."""
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    opened = oiio.ImageInput.open(str(path), config)
    if opened is None:
        reason = oiio.geterror() or "its content is damaged"
        raise FormatError(f"no readable {format.upper()}: {_one_line(reason)}", file=str(path))
    if opened.format_name() != format:
        raise FormatError(f"this is a file of type {opened.format_name()}; rename it", file=str(path))
    return opened


def read_pixels(opened: Any, subimage: int, count: int, type: str, path: Path) -> Array:
    """Channels 0..count of a sub-image (h, w, count), in one of OpenImageIO's types."""
    try:
        pixels = opened.read_image(subimage, 0, 0, count, type)
    except MemoryError:
        raise FormatError("the picture does not fit into memory", file=str(path)) from None
    if pixels is None or opened.has_error:
        raise FormatError(f"the pixels cannot be read: {_one_line(opened.geterror())}", file=str(path), field="data")
    array: Array = pixels
    return array


def _one_line(text: str) -> str:
    return " ".join(str(text).split()) or "no reason is given"
