"""Names in the printed program: the author's own get a prefix, so that any name may be used."""

from __future__ import annotations


def mangle(prefix: str, name: str) -> str:
    """Return ``name`` with a prefix; never two underscores in a row, which both printed languages reserve."""
    return f"{prefix}{name}" if name.startswith("_") else f"{prefix}_{name}"
