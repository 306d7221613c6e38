"""What the picture formats ask of OpenImageIO."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

from nodegraph.data.buffer import Array
from nodegraph.errors import FormatError

PNG_END = b"\0\0\0\0IEND\xaeB`\x82"


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
        raise FormatError(f"this OpenImageIO writes no {format}: {_message(oiio)}", file=str(name))
    specs = tuple(_spec(oiio, part) for part in parts)
    done = bool(output.open(_name(path), specs) if len(specs) > 1 else output.open(_name(path), specs[0]))
    for i, part in enumerate(parts):
        if done and i:
            done = bool(output.open(_name(path), specs[i], "AppendSubimage"))
        done = done and bool(output.write_image(part.pixels))
    done = bool(output.close()) and done
    if not done or not _is_whole(oiio, path, format, len(parts)):
        raise FormatError(f"cannot be written: {_message(output)}; is the disk full?", file=str(name))


def _is_whole(oiio: Any, path: Path, format: str, parts: int) -> bool:
    """Whether the end of the file is on the disk: a PNG ends with a known chunk; else the last rows are read back.

    The libraries below close files without looking whether the last bytes found room.
    """
    if format == "png":
        with open(path, "rb") as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - 12))
            return file.read(12) == PNG_END
    written = oiio.ImageInput.open(_name(path))
    if written is None:
        _message(oiio)  # takes the message out of the library, which would show it to the next one who asks
        return False
    for i in range(parts):
        if not written.seek_subimage(i, 0):
            return False
        spec = written.spec()
        last = spec.y + spec.height - 1
        if written.read_scanlines(last, last + 1, 0, 0, spec.nchannels, "uint8") is None or written.has_error:
            return False
    return bool(written.close())


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
    opened = oiio.ImageInput.open(_name(path), config)
    if opened is None:
        raise FormatError(f"no readable {format.upper()}: {_message(oiio)}", file=str(path))
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
        raise FormatError(f"the pixels cannot be read: {_message(opened)}", file=str(path), field="data")
    array: Array = pixels
    return array


def _name(path: Path) -> str:
    """A path as the library takes it, which knows names in UTF-8 only, whatever the system does."""
    try:
        return os.fsencode(path).decode("utf-8")
    except UnicodeDecodeError:
        raise FormatError("this name is no UTF-8 text; rename the file or its folder", file=ascii(str(path))) from None


def _message(source: Any) -> str:
    """What the library or one of its readers and writers has to say, on one line."""
    try:
        return " ".join(str(source.geterror()).split()) or "no reason is given"
    except UnicodeDecodeError:  # it quotes the file
        return "its content is damaged"
