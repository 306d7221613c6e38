"""Set parameters from text, as ``--set raycast.step=0.5`` does; what a text means follows from the parameter's kind."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from nodegraph import links
from nodegraph.errors import ParameterError, near_miss
from nodegraph.network import split

if TYPE_CHECKING:
    from nodegraph.network import Network
    from nodegraph.params import Parameter

_SWITCH = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}
_PLAIN_TEXT = ("Text", "Choice")
_PATHS = ("File", "Folder")


def assign(network: Network, place: str, text: str) -> None:
    """Set ``node.param``, ``group/node.param`` or a variable of a network.

    Raises ParameterError or CommandError naming the place and the near miss, also where a wire would win.
    """
    network.set(place, to_json(text, declaration(network, place)), encoded=True)


def declaration(network: Network, place: str) -> Parameter:
    """The declaration that values of ``place`` must satisfy. Raises ParameterError, CommandError."""
    if "." not in place:
        scoped = links.lookup(network, place)
        if scoped is None:
            names = [*links.visible_names(network), *(f"{path}." for path in network.nodes)]
            hint = "; a parameter is written node.param" if place in network.nodes else near_miss(place, names)
            raise ParameterError(f"{place}: no such variable{hint}")
        return links.codec(scoped, links.evaluate(scoped))
    path, name = split(place, "node.param")
    node = network.node(path)
    leaf, inner, declared = links.plain_parameter(node, name)
    if links.is_wired(leaf, inner):
        raise ParameterError(
            f"{place}: a wire feeds this parameter, so a value has no effect; set it at the wire's source"
        )
    return declared


def to_json(text: str, parameter: Parameter) -> Any:
    """The JSON value that a text means for a kind of parameter.

    Text and choices are taken as they are; paths are relative to the current folder, as everywhere on a command line;
    switches may be words; vectors may be written ``1,2,3``; all else is JSON, or text that the declaration judges.
    """
    if parameter.kind in _PLAIN_TEXT:
        return text
    if parameter.kind in _PATHS:
        return os.path.abspath(os.path.expanduser(text)) if text else ""
    word = text.strip()
    if parameter.kind == "Bool":
        return _SWITCH.get(word.lower(), word)
    try:
        return json.loads(word)
    except (ValueError, RecursionError):
        pass
    if "," in word:
        try:
            return [float(part) for part in word.split(",")]
        except ValueError:
            pass
    return word
