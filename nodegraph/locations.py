"""Where processors, shaders and workspaces lie.

In a checkout they stand at the top of the repository; a wheel carries them in ``nodegraph/share``. Plug-in folders are
named by the environment variable NODEGRAPH_PATH and by the entry-point group ``nodegraph.processors``.
"""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

VARIABLE = "NODEGRAPH_PATH"

_PACKAGE = Path(__file__).resolve().parent


class PluginFolder(NamedTuple):
    """A place that processors are loaded from.

    processors: the folder whose sub-folders are categories. shaders: where their kernels and includes are looked up,
    in order. origin: "nodegraph", the folder as the user named it, or the distribution that brings it.
    reason: why it cannot be used, or "".
    """

    processors: Path
    shaders: tuple[Path, ...]
    origin: str
    reason: str = ""


@functools.cache
def home() -> Path:
    """The folder that holds processors/, shaders/ and workspaces/."""
    share = _PACKAGE / "share"
    return share if (share / "processors").is_dir() else _PACKAGE.parent


def processors() -> Path:
    """The built-in processors."""
    return home() / "processors"


def shaders() -> Path:
    """The built-in shaders."""
    return home() / "shaders"


def workspaces() -> Path:
    """The workspaces that users open first."""
    return home() / "workspaces"


def built_in() -> PluginFolder:
    """The processors that come with nodegraph."""
    return PluginFolder(processors(), (shaders(), processors()), "nodegraph")


def on_path() -> list[PluginFolder]:
    """The folders in NODEGRAPH_PATH, in order, each once."""
    named = dict.fromkeys(part for part in os.environ.get(VARIABLE, "").split(os.pathsep) if part.strip())
    return [plugin_folder(Path(part).expanduser(), part) for part in named]


def from_entry_points() -> list[PluginFolder]:
    """The folders that installed packages offer. Finds packages without importing them."""
    from nodegraph import plugins

    found = []
    for offer in plugins.offers("nodegraph.processors"):
        folder = _package_folder(offer.value)
        if folder is None:
            reason = f"the entry point {offer.name} names {offer.value}, which is neither a package nor a folder"
            found.append(PluginFolder(Path(offer.value), (), offer.origin, reason))
        else:
            found.append(plugin_folder(folder, offer.origin or offer.name))
    return found


def plugin_folder(folder: Path, origin: str) -> PluginFolder:
    """Look at a folder that a user named: it holds categories, or processors/ with the categories and shaders/."""
    folder = folder.absolute()
    if not folder.is_dir():
        return PluginFolder(folder, (), origin, "this folder does not exist")
    inner = folder / "processors" if (folder / "processors").is_dir() else folder
    own = [folder / "shaders"] if (folder / "shaders").is_dir() else []
    if inner == folder and folder.name == "processors" and (folder.parent / "shaders").is_dir():
        own = [folder.parent / "shaders"]
    return PluginFolder(inner, (*own, inner, shaders()), origin)


def _package_folder(value: str) -> Path | None:
    """Folder of ``package.sub``, found through the top package's search path so that nothing is imported."""
    if os.path.isabs(value):
        return Path(value) if os.path.isdir(value) else None
    parts = value.partition(":")[0].strip().split(".")
    for root in _search_path(parts[0]):
        folder = root.joinpath(*parts[1:])
        if folder.is_dir():
            return folder
    return None


def _search_path(package: str) -> Iterator[Path]:
    module = sys.modules.get(package)
    if module is not None and hasattr(module, "__path__"):
        yield from map(Path, module.__path__)
        return
    import importlib.util

    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return
    if spec is not None:
        yield from map(Path, spec.submodule_search_locations or ())
