"""Finds processors by id: files in folders, each imported when it is first asked for.

Scanning maps ids to files and imports nothing, so a run pays only for the processors that it uses. Folders are
looked through in this order: built-in, NODEGRAPH_PATH, entry points; the first file that has an id keeps it. A file
that cannot be loaded is listed as unavailable with its reason and stops nothing.
"""

from __future__ import annotations

import functools
import os
import re
import threading
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from nodegraph import locations
from nodegraph.errors import UnknownProcessor, near_miss
from nodegraph.locations import PluginFolder
from nodegraph.plugins import explain_failure
from nodegraph.processor import Processor

_PART = re.compile(r"[a-z][a-z0-9_]*")
_FORMERLY = re.compile(
    r"^\s*formerly\b[^=\n]*=\s*(\([^)]*\)|[^\n]*)|^//\s*formerly:([^\n]*)", re.MULTILINE | re.IGNORECASE
)
_ID = re.compile(r"[A-Za-z_][\w]*(?:\.[\w]+)*")
_NOT_PROCESSORS = re.compile(r"test_.*|.*_test|conftest|setup|noxfile")
_NOT_CATEGORIES = {"shaders", "workspaces", "tests", "docs", "data", "build", "dist", "node_modules"}
_DEEPEST = 6


class Entry:
    """One plug-in file. ``processor`` once it is loaded; ``reason`` why it is unavailable, or ""."""

    __slots__ = ("folder", "id", "lock", "path", "processor", "reason")

    def __init__(self, id: str, path: Path, folder: PluginFolder, reason: str = "") -> None:
        self.id = id
        self.path = path
        self.folder = folder
        self.reason = reason
        self.processor: type[Processor] | None = None
        self.lock = threading.RLock()

    @property
    def origin(self) -> str:
        """Who brings it: "nodegraph", a folder, a distribution."""
        return self.folder.origin

    def __repr__(self) -> str:
        state = f"unavailable: {self.reason}" if self.reason else "loaded" if self.processor else "not loaded"
        return f"<{self.id} from {self.path}, {state}>"


class Registry:
    """All processors of some folders; without any given, those of this installation.

    Safe to use from several threads: tables are guarded by one lock, each file's loading by its own.
    """

    def __init__(self, folders: Iterable[PluginFolder] | None = None) -> None:
        self._lock = threading.RLock()
        self._given = None if folders is None else tuple(folders)
        self._entries: dict[str, Entry] = {}
        self._unusable: list[Entry] = []
        self._former: dict[str, list[Entry]] | None = None
        self._near = self._far = False

    # -- asking ---------------------------------------------------------------------------------------------------

    def find(self, id: str) -> type[Processor]:
        """Return the class of a processor, importing its file if need be. Old names (``formerly``) find it too.

        Raises UnknownProcessor with the nearest known id, or with the reason why the processor is unavailable.
        """
        entry = self.entry(id)
        processor = self._load(entry)
        if processor is None:
            raise UnknownProcessor(id, reason=entry.reason)
        return processor

    def entry(self, id: str) -> Entry:
        """The file that an id or an old name stands for. Raises UnknownProcessor."""
        with self._lock:
            self._scan_near()
            if id not in self._entries:
                self._scan_far()
            if id in self._entries:
                return self._entries[id]
            unusable = next((entry for entry in self._unusable if entry.id == id), None)
            candidates = self._formerly().get(id, [])
        for entry in candidates:
            processor = self._load(entry)
            if processor is not None and id in processor.formerly:
                return entry
        if unusable is not None:
            return unusable
        raise UnknownProcessor(id, self._entries)

    def ids(self) -> list[str]:
        """Every id that some file has, sorted; nothing is imported."""
        with self._lock:
            self._scan_near()
            self._scan_far()
            return sorted(self._entries)

    def entries(self) -> list[Entry]:
        """Every file, by id, those that lost their id to another one included; nothing is imported."""
        ids = self.ids()
        with self._lock:
            return [self._entries[id] for id in ids] + sorted(self._unusable, key=lambda entry: (entry.id, entry.path))

    def catalogue(self) -> list[dict[str, Any]]:
        """Everything about every processor as JSON, by id. Imports them all.

        An unavailable one has ``unavailable`` with the reason instead of a declaration.
        """
        listed = []
        for entry in self.entries():
            processor = self._load(entry)
            place = {"file": str(entry.path), "origin": entry.origin}
            if processor is None:
                listed.append({"id": entry.id, "unavailable": entry.reason, **place})
            else:
                listed.append({**processor.describe(), **place})
        return listed

    def shader_roots(self, processor: type[Processor] | None = None) -> tuple[Path, ...]:
        """Folders in which kernels and their includes are looked up: a processor's own, then the built-in ones."""
        own = tuple(map(Path, processor.shader_roots)) if processor is not None else ()
        return own or locations.built_in().shaders

    # -- changing ---------------------------------------------------------------------------------------------------

    def reload(self, id: str, check: Callable[[type[Processor]], object] | None = None) -> type[Processor]:
        """Load a file anew, for an author who has just changed it, and return its class.

        When the new text fails, or ``check`` raises for the new class, the old class stays in use and the error is
        raised: UnknownProcessor with the reason, or what ``check`` raised.
        """
        entry = self.entry(id)
        trial = Entry(id, entry.path, entry.folder)
        processor = self._load(trial, fresh=True)
        if processor is None:
            if entry.processor is None:
                entry.reason = trial.reason
            raise UnknownProcessor(id, reason=trial.reason)
        if check is not None:
            check(processor)
        with entry.lock:
            entry.processor, entry.reason = processor, ""
        with self._lock:
            self._former = None
        return processor

    def refresh(self) -> None:
        """Look through the folders again: new files appear, removed ones go, loaded classes stay.

        What could not be loaded will be tried again.
        """
        from nodegraph import plugins

        plugins.refresh()
        with self._lock:
            far, known = self._far, {entry.path: entry for entry in self._entries.values()}
            self._entries, self._unusable, self._former = {}, [], None
            self._near = self._far = False
            self._scan_near()
            if far:
                self._scan_far()
            for id, entry in self._entries.items():
                before = known.get(entry.path)
                if before is not None and (before.id, before.folder) == (id, entry.folder):
                    # The same object: another thread may be loading it now.
                    self._entries[id] = before
                    if before.processor is None:
                        before.reason = ""

    # -- inside -------------------------------------------------------------------------------------------------------

    def _load(self, entry: Entry, fresh: bool = False) -> type[Processor] | None:
        with entry.lock:
            if entry.processor is None and not entry.reason:
                from nodegraph import loading

                try:
                    entry.processor = loading.load(
                        entry.id, entry.path, entry.folder.shaders, built_in=entry.origin == "nodegraph", fresh=fresh
                    )
                except loading.PluginError as error:
                    entry.reason = str(error)
                except (Exception, SystemExit) as error:
                    entry.reason = explain_failure(error, str(entry.path))
            return entry.processor

    def _scan_near(self) -> None:
        """The folders that cost nothing to know. What is given by hand is all there is."""
        if not self._near:
            self._near = True
            near = self._given if self._given is not None else (locations.built_in(), *locations.on_path())
            self._add(near)

    def _scan_far(self) -> None:
        """Entry points: reads the metadata of every installed package, so only when nothing nearer has the id."""
        if not self._far:
            self._far = True
            self._add(locations.from_entry_points() if self._given is None else ())

    def _add(self, folders: Iterable[PluginFolder]) -> None:
        self._former = None
        for folder in folders:
            if folder.reason:
                self._unusable.append(Entry(folder.processors.name, folder.processors, folder, folder.reason))
                continue
            for entry in _scan(folder):
                first = self._entries.get(entry.id)
                if entry.reason:
                    self._unusable.append(entry)
                elif first is None:
                    self._entries[entry.id] = entry
                elif first.path != entry.path:
                    entry.reason = f"the id {entry.id} is taken by {first.path}"
                    self._unusable.append(entry)

    def _formerly(self) -> dict[str, list[Entry]]:
        """Old names by a look at the texts, which is a thousand times cheaper than importing every file."""
        if self._former is None:
            self._former = {}
            for entry in self._entries.values():
                try:
                    text = entry.path.read_text("utf-8", errors="replace")
                except OSError:
                    continue
                for match in _FORMERLY.finditer(text):
                    for old in _ID.findall(match[1] or match[2] or ""):
                        self._former.setdefault(old, []).append(entry)
        return self._former


def why_no_id(parts: tuple[str, ...]) -> str:
    """Why a file at ``category/.../stem`` of a plug-in folder would not be found as a processor; "" where it would."""
    bad = next((part for part in parts if not _PART.fullmatch(part)), None)
    if bad is not None:
        return f"{bad!r} is no name of a processor or category: use a-z, 0-9 and _"
    if _NOT_PROCESSORS.fullmatch(parts[-1]):
        return f"a file called {parts[-1]!r} is taken for something else than a processor"
    category = next((part for part in parts[:-1] if part in _NOT_CATEGORIES), None)
    if category is not None:
        return f"a folder called {category!r} is taken for something else than a category"
    return f"categories are at most {_DEEPEST} deep" if len(parts) > _DEEPEST + 1 else ""


def _scan(folder: PluginFolder) -> Iterator[Entry]:
    """Files of a folder, as entries, in a stable order. A ``.glsl`` beside a ``.py`` of its stem belongs to that."""
    for path, parts in _files(folder.processors, (), 0):
        id = ".".join(parts)
        bad = next((part for part in parts if not _PART.fullmatch(part)), None)
        reason = f"{bad!r} is no name of a processor or category: use a-z, 0-9 and _" if bad is not None else ""
        yield Entry(id, path, folder, reason)


def _files(folder: Path, category: tuple[str, ...], depth: int) -> Iterator[tuple[Path, tuple[str, ...]]]:
    try:
        found = sorted(os.scandir(folder), key=lambda item: item.name)
    except OSError:
        return
    stems = {item.name[:-3] for item in found if item.name.endswith(".py")}
    for item in found:
        stem, dot, suffix = item.name.rpartition(".")
        if item.name.startswith((".", "_")):
            continue
        if item.is_dir():
            inside_environment = os.path.exists(os.path.join(item.path, "pyvenv.cfg"))
            if depth < _DEEPEST and item.name not in _NOT_CATEGORIES and not inside_environment:
                yield from _files(Path(item.path), (*category, item.name), depth + 1)
        elif (dot and suffix == "py" and not _NOT_PROCESSORS.fullmatch(stem)) or (
            suffix == "glsl" and stem not in stems
        ):
            yield Path(item.path), (*category, stem)


class Namespace:
    """Processors as attributes: ``nodegraph.processors.filter.GaussianBlur``."""

    def __init__(self, prefix: str = "") -> None:
        self._prefix = prefix

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        choices = self._choices()
        if name in choices:
            id = choices[name]
            return default().find(id) if id else Namespace(f"{self._prefix}{name}.")
        for id in choices.values():
            if id and id.rpartition(".")[2].replace("_", "") == name.lower():  # GaussianBlur, RGBToHSV
                return default().find(id)
        raise AttributeError(f"nodegraph.processors.{self._prefix}{name}: no such processor{near_miss(name, choices)}")

    def __dir__(self) -> list[str]:
        return sorted(self._choices())

    def __repr__(self) -> str:
        return f"<processors {self._prefix}*>"

    def _choices(self) -> dict[str, str]:
        """Names at this level: class names with their ids, categories with ""."""
        from nodegraph.signature import camel

        found = {}
        for id in default().ids():
            if id.startswith(self._prefix):
                head, dot, _ = id[len(self._prefix) :].partition(".")
                found[head if dot else camel(head)] = "" if dot else id
        return found


processors = Namespace()


@functools.cache
def default() -> Registry:
    """The registry of this installation. ``default.cache_clear()`` after NODEGRAPH_PATH has changed."""
    return Registry()


def find(id: str) -> type[Processor]:
    """`Registry.find` of the default registry."""
    return default().find(id)


def ids() -> list[str]:
    """`Registry.ids` of the default registry."""
    return default().ids()


def entries() -> list[Entry]:
    """`Registry.entries` of the default registry."""
    return default().entries()


def catalogue() -> list[dict[str, Any]]:
    """`Registry.catalogue` of the default registry."""
    return default().catalogue()


def reload(id: str) -> type[Processor]:
    """`Registry.reload` of the default registry."""
    return default().reload(id)


def shader_roots(processor: type[Processor] | None = None) -> tuple[Path, ...]:
    """`Registry.shader_roots` of the default registry."""
    return default().shader_roots(processor)
