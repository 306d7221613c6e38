"""The pictures of an evaluation: which sinks show some, and writing them so that they can be made again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from nodegraph.data import Image
from nodegraph.requests import default_sinks

if TYPE_CHECKING:
    from nodegraph.flat import Flat
    from nodegraph.network import Network
    from nodegraph.report import Report


def views_of(flat: Flat, sinks: Sequence[str] | None) -> list[str]:
    """The sinks that show something, as named: all but effects, which write files of their own."""
    return [sink for sink in (sinks or default_sinks(flat)) if not is_effect(flat, sink)]


def is_effect(flat: Flat, sink: str) -> bool:
    """Whether a sink changes the world instead of showing something."""
    node = flat.nodes.get(sink) or flat.nodes.get(sink.rpartition(".")[0])
    return node is not None and node.processor is not None and node.processor.effect


def images_of(report: Report, views: Sequence[str]) -> Mapping[str, Image]:
    """The pictures that the views show, by the name of their file; a view of several shows ``view.output``."""
    found: dict[str, Image] = {}
    for view in views:
        images = {name: value for name, value in report.shown.get(view, {}).items() if isinstance(value, Image)}
        for name, image in images.items():
            found[view if len(images) == 1 else f"{view}.{name}"] = image
    return found


def is_empty(image: Image) -> bool:
    """Whether nothing is to be seen: every pixel is transparent."""
    return image.channels == 4 and not image.color[..., 3].any()


def write_picture(image: Image, path: Path, network: Network) -> None:
    """Write a picture; makes its folder. It carries the workspace that made it. Raises FormatError."""
    from nodegraph import formats, workspace

    formats.make_folder(path.parent)
    if path.suffix.lower() in workspace.PICTURES:
        formats.write(image, path, workspace=workspace.dumps(network, folder=path.parent))
    else:
        formats.write(image, path)
