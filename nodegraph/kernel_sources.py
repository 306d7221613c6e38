"""The GLSL text of a processor's kernels, read again only when one of its files has changed.

Fingerprints digest exactly the text that the device is handed, so both ask here. While texts are held, a changed file
changes nothing until somebody has tried its new text and accepts it: an editor goes on showing pictures while a kernel
is half typed.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from nodegraph import shaders
from nodegraph.errors import ShaderError

if TYPE_CHECKING:
    from nodegraph.processor import Processor
    from nodegraph.shaders import Source

Key = tuple[str, tuple[str, ...]]
"""Name of a kernel, and the folders in which it is looked up."""

_lock = threading.Lock()
_known: dict[Key, tuple[Source, tuple[Any, ...]]] = {}
_holders: set[object] = set()


class Changed(NamedTuple):
    """A kernel whose text on disk is no longer the one in use. ``new``: its text now, or why it cannot be read."""

    key: Key
    old: Source
    new: Source | ShaderError


def kernel_source(processor: type[Processor], name: str) -> Source:
    """Return a kernel after includes, from the processor's own shader folders. Raises ShaderError."""
    key = (name, processor.shader_roots)
    with _lock:
        known = _known.get(key)
        if known is not None and _holders:
            return known[0]
    if known is not None and known[1] == shaders.stamps(known[0].paths):
        return known[0]
    return _put(key, shaders.load(name, roots(key)))


def hold(holder: object) -> None:
    """Keep the texts that are in use, until `release`."""
    with _lock:
        _holders.add(holder)


def release(holder: object) -> None:
    """Let changed files count at once again."""
    with _lock:
        _holders.discard(holder)


def changed() -> list[Changed]:
    """Every kernel in use whose files now hold another text."""
    with _lock:
        known = dict(_known)
    found = []
    for key, (old, stamps) in known.items():
        if stamps == shaders.stamps(old.paths):
            continue
        try:
            new = shaders.load(key[0], roots(key))
        except ShaderError as error:
            found.append(Changed(key, old, error))
            continue
        if new.text != old.text:
            found.append(Changed(key, old, new))
        else:
            _put(key, new)
    return found


def accept(change: Changed) -> None:
    """Use the new text from now on."""
    assert not isinstance(change.new, ShaderError)
    _put(change.key, change.new)


def _put(key: Key, source: Source) -> Source:
    with _lock:
        _known[key] = (source, shaders.stamps(source.paths))
    return source


def roots(key: Key) -> Sequence[Path | str]:
    """The folders in which a kernel and its includes are looked up."""
    from nodegraph import locations

    return key[1] or locations.built_in().shaders
