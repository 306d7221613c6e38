"""Bells are remembered in the ``ui`` of the node, beside the keys that the document has of them.

They hold as long as the document has the very keys that were written; somebody else's edit of these makes them keys.
"""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from nodegraph.commands import SetUI
from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.editor.parameters.place import Place

KEY = "bells"


def recall(place: Place | None, function: TransferFunction) -> Shape:
    """The keys and bells that a function of the document was made of; else all of it is keys.

    What another node remembers is taken as well: of a linked parameter, a copy, a pasted value.
    """
    if place is None:
        return Shape(function)
    mark = None
    for noted in _noted(place):
        mark = mark or digest(function)
        if noted.get("digest") == mark:
            try:
                return Shape.from_json(noted)
            except (GraphError, KeyError, TypeError, ValueError):
                continue  # somebody wrote that by hand
    return Shape(function)


def note(place: Place, shape: Shape) -> SetUI | None:
    """The command that remembers a shape for this parameter, or forgets its bells; None where nothing changes."""
    ui = place.node.ui.get(KEY)
    before = dict(ui) if isinstance(ui, dict) else {}
    after = {name: kept for name, kept in before.items() if name != place.name}
    if shape.bells:
        after[place.name] = {**shape.to_json(), "digest": digest(shape.function)}
    return SetUI(place.path, KEY, after or None) if after != before else None


@functools.lru_cache(maxsize=64)
def digest(function: TransferFunction) -> str:
    """What tells a function from every other."""
    text = json.dumps(function.to_json(), sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=12).hexdigest()


def _noted(place: Place) -> Iterator[dict[str, Any]]:
    """What is noted for this parameter, then for others."""
    own = place.node
    for node in (own, *(other for other in place.session.network.walk() if other is not own)):
        ui = node.ui.get(KEY)
        if isinstance(ui, dict):
            names = sorted(ui, key=lambda name: node is own and name != place.name)
            yield from (ui[name] for name in names if isinstance(ui[name], dict))
