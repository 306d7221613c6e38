"""All extremes, in the order of the page."""

from importlib import import_module

from tests.extremes.case import CASES

# A module puts its cases into the list when it is imported.
for topic in ("sampling", "transfer", "space", "values", "views", "by_gradient", "filters", "pixels"):
    import_module(f"tests.extremes.{topic}")

__all__ = ["CASES"]
