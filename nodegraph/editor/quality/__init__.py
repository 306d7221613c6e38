"""The quality panel: how wrong the picture of a view is, and what it would cost to have it otherwise."""
