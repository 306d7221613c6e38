"""The GLSL text of a processor's kernels, read again only when one of its files has changed.

Fingerprints digest exactly the text that the device is handed, so both ask here.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from nodegraph import shaders

if TYPE_CHECKING:
    from nodegraph.processor import Processor
    from nodegraph.shaders import Source

_lock = threading.Lock()
_known: dict[tuple[str, tuple[str, ...]], tuple[Source, tuple[Any, ...]]] = {}


def kernel_source(processor: type[Processor], name: str) -> Source:
    """Return a kernel after includes, from the processor's own shader folders. Raises ShaderError."""
    key = (name, processor.shader_roots)
    with _lock:
        known = _known.get(key)
    if known is not None and known[1] == shaders.stamps(known[0].paths):
        return known[0]
    from nodegraph import locations

    roots = processor.shader_roots or locations.built_in().shaders
    source = shaders.load(name, roots)
    with _lock:
        _known[key] = (source, shaders.stamps(source.paths))
    return source
