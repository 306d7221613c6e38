"""Beginning with a data file: which networks suit it, and a choice among them."""

from nodegraph.editor.offers.beginning import Beginning, is_workspace, name_filter

__all__ = ["Beginning", "is_workspace", "name_filter"]
