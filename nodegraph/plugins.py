"""What installed packages offer to nodegraph through entry points.

A package says in its pyproject.toml, for example::

    [project.entry-points."nodegraph.formats"]
    vti = "my_package.vti"

Groups: nodegraph.processors, .formats, .port_types, .parameter_kinds, .presets, .measures.
"""

from __future__ import annotations

import functools
import os
import sys
from typing import Any, NamedTuple

from nodegraph.errors import line_in, one_sentence

GROUPS = (
    "nodegraph.processors",
    "nodegraph.formats",
    "nodegraph.port_types",
    "nodegraph.parameter_kinds",
    "nodegraph.presets",
    "nodegraph.measures",
)


class Plugin(NamedTuple):
    """One entry point: its object, or the reason why it has none."""

    name: str
    object: Any
    reason: str
    origin: str  #: the distribution that brings it


class Offer(NamedTuple):
    """An entry point that was not loaded yet."""

    name: str
    value: str
    origin: str


@functools.cache
def offers(group: str) -> tuple[Offer, ...]:
    """Entry points of a group, by name, nothing imported. A name that two packages use is listed twice."""
    if group not in GROUPS:
        raise ValueError(f"{group}: no such plug-in group; there are {', '.join(GROUPS)}")
    if not _any_offer(tuple(sys.path)):
        return ()
    from importlib.metadata import entry_points

    found = [
        Offer(point.name, point.value, point.dist.name if point.dist else "") for point in entry_points(group=group)
    ]
    return tuple(sorted(set(found)))


@functools.cache
def discover(group: str) -> tuple[Plugin, ...]:
    """Load every entry point of a group, once. One that fails is listed with its reason and stops nothing."""
    loaded = []
    for offer in offers(group):
        try:
            loaded.append(Plugin(offer.name, _load(offer.value), "", offer.origin))
        except Exception as error:
            loaded.append(Plugin(offer.name, None, explain_failure(error), offer.origin))
    return tuple(loaded)


def failures() -> dict[str, str]:
    """Why entry points could not be loaded, by ``group/name``. Loads all groups but the processors, which are files."""
    return {
        f"{group}/{plugin.name}": plugin.reason
        for group in GROUPS
        if group != "nodegraph.processors"
        for plugin in discover(group)
        if plugin.reason
    }


def refresh() -> None:
    """Forget what was found: packages were installed or removed."""
    _any_offer.cache_clear()
    offers.cache_clear()
    discover.cache_clear()


@functools.cache
def _any_offer(search_path: tuple[str, ...]) -> bool:
    """Whether some installed package may have an entry point for us.

    A look at the files themselves takes 2 ms where `importlib.metadata`, which parses the metadata of every package,
    takes 100; and most installations have no plug-in.
    """
    for folder in search_path:
        if os.path.isfile(folder):
            return True  # a zip archive: let importlib.metadata look inside
        try:
            names = os.listdir(folder or ".")
        except OSError:
            continue
        for name in names:
            if name.endswith((".dist-info", ".egg-info")):
                try:
                    with open(os.path.join(folder, name, "entry_points.txt"), "rb") as file:
                        if b"[nodegraph." in file.read():
                            return True
                except OSError:
                    continue
    return False


#: Packages whose name on the package index is not the name that is imported.
_PACKAGE_OF = {
    "PIL": "pillow",
    "cv2": "opencv-python-headless",
    "nrrd": "pynrrd",
    "sklearn": "scikit-learn",
    "skimage": "scikit-image",
    "yaml": "pyyaml",
    "SimpleITK": "SimpleITK",
}


def explain_failure(error: BaseException, file: str = "") -> str:
    """Say in one sentence why a plug-in could not be loaded, and for a missing package how to get it.

    ``file``: name the line of this file at which it went wrong.
    """
    if isinstance(error, ModuleNotFoundError) and error.name:
        package = error.name.partition(".")[0]
        return f"needs the package {package!r}: pip install {_PACKAGE_OF.get(package, package)}"
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}: {error.msg}" if error.lineno else str(error.msg)
    line = line_in(file, error)
    return f"{f'line {line}: ' if line else ''}{one_sentence(error)}"


def _load(value: str) -> Any:
    import importlib

    module, _, attribute = value.partition(":")
    found: Any = importlib.import_module(module.strip())
    for name in filter(None, attribute.split(".")):
        found = getattr(found, name.strip())
    return found
