"""Parameters of the selected nodes: one widget per kind, made from the declaration."""

from nodegraph.editor.parameters.kinds import WIDGETS, make_field, widget_for
from nodegraph.editor.parameters.panel import ParameterPanel

__all__ = ["WIDGETS", "ParameterPanel", "make_field", "widget_for"]
