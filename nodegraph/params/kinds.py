"""Every parameter kind by name: ours, and those of plug-ins (entry-point group ``nodegraph.parameter_kinds``)."""

from __future__ import annotations

from typing import Any

from nodegraph.errors import ParameterError, near_miss
from nodegraph.params import geometry, numbers, text, values
from nodegraph.params.parameter import Parameter

_BUILT_IN: dict[str, type[Parameter]] = {
    kind.__name__: kind
    for kind in (
        numbers.Float,
        numbers.Int,
        numbers.Bool,
        text.Choice,
        text.Text,
        text.File,
        text.Folder,
        geometry.Color,
        numbers.Vector,
        geometry.Matrix,
        numbers.Interval,
        geometry.Box,
        values.Camera,
        values.Light,
        values.Plane,
        values.TransferFunction,
        values.TransferFunction2D,
        numbers.Seed,
    )
}


def kind(name: str) -> type[Parameter]:
    """The class of a parameter kind. Raises ParameterError for a name that nothing offers."""
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    offered = kinds()
    if name in offered:
        return offered[name]
    raise ParameterError(f"{name}: no such kind of parameter{near_miss(name, offered)}")


def kinds() -> dict[str, type[Parameter]]:
    """All kinds by name. Looks through the installed plug-ins; those that fail are left out here and listed by
    `nodegraph.plugins.discover`."""
    from nodegraph import plugins

    found = dict(_BUILT_IN)
    for plugin in plugins.discover("nodegraph.parameter_kinds"):
        if isinstance(plugin.object, type) and issubclass(plugin.object, Parameter):
            found.setdefault(plugin.object.__name__, plugin.object)
    return found


def stand_in(name: str, value: Any, *, doc: str = "A variable.") -> Parameter:
    """A parameter of a kind that belongs to no processor, with its widest limits and ``value`` as its default.

    What a variable of a workspace is checked and written with, where no linked parameter says more: vectors and
    colours take their count from the value, a choice becomes text.
    """
    made = kind(name)
    if made is text.Choice:
        return text.Text(value, doc=doc)
    if made in (numbers.Float, numbers.Interval, numbers.Vector):
        return made(value, doc=doc, finite=False, nan=made is numbers.Float)
    if made is geometry.Color:
        return geometry.Color(value, doc=doc, max=None)
    if issubclass(made, values._Value):
        return made(None, doc=doc) if isinstance(value, dict) else made(value, doc=doc)
    return made(value, doc=doc)
