"""All extremes, in the order of the page."""

from tests.extremes import filters, pixels, sampling, space, transfer, values, views
from tests.extremes.case import CASES

TOPICS = (sampling, transfer, space, values, views, filters, pixels)
__all__ = ["CASES", "TOPICS"]
