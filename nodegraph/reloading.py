"""Reload processors and kernels whose files have changed; what fails leaves the old code in use.

    reloading = Reloading()
    outcomes = reloading.look(engine)    # after every change of a file in reloading.folders()
    Rebind().apply(network)              # for every open document

While a `Reloading` is open the texts of kernels are held: a changed one counts when it has compiled, on every device
that is open and for all settings that have run. Close it, or use it as a context manager.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from nodegraph import glsl_processor, kernel_sources, registry, shaders
from nodegraph.errors import GraphError, ShaderError, UnknownProcessor
from nodegraph.kernel_sources import Changed

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.processor import Processor
    from nodegraph.registry import Entry, Registry


DEEPEST = 6


class Outcome(NamedTuple):
    """What became of one changed file. ``reason`` and ``line`` (from 1, 0 unknown) say why it is not in use."""

    id: str  #: of the processor, or the name of a kernel or include
    file: Path
    reason: str = ""
    line: int = 0


class Reloading:
    """Knows which code is in use, and takes over what changed."""

    def __init__(self, processors: Registry | None = None) -> None:
        self.registry = processors if processors is not None else registry.default()
        self._refused: dict[Path, tuple[bytes, Outcome]] = {}
        # Texts of files that nobody has asked for yet; one that changes is being written now, so its author is told.
        self._waiting: dict[Path, bytes | None] | None = None
        kernel_sources.hold(self)

    def __enter__(self) -> Reloading:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let changed kernels count at once again."""
        kernel_sources.release(self)

    @property
    def refused(self) -> list[Outcome]:
        """What is on disk now and not in use, because it failed."""
        by_place = {(outcome.file, outcome.line, outcome.reason): outcome for _, outcome in self._refused.values()}
        return list(by_place.values())

    def folders(self) -> list[Path]:
        """Every folder in which a file may change, appear or go: of processors and shaders, and those inside."""
        entries = self.registry.entries()
        tops = {top for entry in entries for top in (entry.folder.processors, *entry.folder.shaders)}
        inner = {path.parent for top in tops for path in _kernels(top)}
        return sorted(path for path in tops | inner | {entry.path.parent for entry in entries} if path.is_dir())

    def files(self) -> list[Path]:
        """Every file whose text is in use or could be."""
        kernels = {path for folder in self.folders() for path in folder.glob("*.glsl")}
        return sorted(kernels | {entry.path for entry in self.registry.entries()})

    def look(self, engine: Engine | None = None) -> list[Outcome]:
        """Reload what differs from the code in use. A failure is told once; it stands in `refused` until it is mended.

        The first look learns what there is: only from then on are files told that nothing has used yet.
        With an engine, kernels are compiled on its devices, on its thread; without, by the translator alone.
        """
        return engine.call(lambda: list(self._look(engine))) if engine is not None else list(self._look(None))

    def _look(self, engine: Engine | None) -> Iterator[Outcome]:
        self.registry.refresh()
        if self._waiting is None:
            self._waiting = {entry.path: _digest(entry.path) for entry in self.registry.entries()}
        ours = {tuple(map(str, entry.folder.shaders)) for entry in self.registry.entries()}
        kernels = [change for change in kernel_sources.changed() if change.key[1] in ours]
        present: set[Path] = set()
        for entry in self.registry.entries():
            if not entry.path.is_file():
                continue
            present.add(entry.path)
            digest = _digest(entry.path)
            own = [change for change in kernels if _is_of(change, entry)]
            kernels = [change for change in kernels if change not in own]
            if entry.path in self._refused and self._refused[entry.path][0] == digest:
                continue
            if digest is None or (entry.processor is not None and digest == entry.processor.source_digest):
                self._refused.pop(entry.path, None)
            elif entry.processor is None and self._waiting.get(entry.path) == digest:
                continue
            else:
                yield self._reload(entry, own, engine, digest)
            self._waiting[entry.path] = digest
        for change in kernels:
            path = Path(change.old.paths[0])
            present.add(path)
            yield from self._take(change, path, engine)
        self._refused = {path: kept for path, kept in self._refused.items() if path in present}

    def _reload(self, entry: Entry, kernels: list[Changed], engine: Engine | None, digest: bytes) -> Outcome:
        def check(processor: type[Processor]) -> None:
            if entry.path.suffix == ".glsl":
                glsl_processor.verify(processor)
            for change in kernels:
                _try(change, engine)

        try:
            self.registry.reload(entry.id, check)
        except GraphError as error:
            outcome = _refusal(entry.id, entry.path, error)
            self._refused[entry.path] = digest, outcome
            return outcome
        self._refused.pop(entry.path, None)
        for change in kernels:
            kernel_sources.accept(change)
        return Outcome(entry.id, entry.path)

    def _take(self, change: Changed, path: Path, engine: Engine | None) -> Iterator[Outcome]:
        """Accept a kernel that compiles. An include that fails is told once, however many kernels read it."""
        digest = str(change.new).encode() if isinstance(change.new, ShaderError) else change.new.digest.encode()
        if path in self._refused and self._refused[path][0] == digest:
            return
        try:
            _try(change, engine)
        except GraphError as error:
            outcome = _refusal(change.key[0], _path_of(error, change) or path, error)
            known = any(
                (outcome.file, outcome.line, outcome.reason) == (one.file, one.line, one.reason) for one in self.refused
            )
            self._refused[path] = digest, outcome
            if not known:
                yield outcome
        else:
            self._refused.pop(path, None)
            kernel_sources.accept(change)
            yield Outcome(change.key[0], path)


def _kernels(top: Path) -> Iterator[Path]:
    """Kernel files below a folder, as deep as processors may lie; environments and hidden folders are passed over."""
    for folder, inner, names in os.walk(top):
        depth = len(Path(folder).relative_to(top).parts)
        inner[:] = [
            name
            for name in inner
            if depth < DEEPEST and name[0] not in "._" and not os.path.exists(os.path.join(folder, name, "pyvenv.cfg"))
        ]
        yield from (Path(folder, name) for name in names if name.endswith(".glsl"))


def _try(change: Changed, engine: Engine | None) -> None:
    if isinstance(change.new, ShaderError):
        raise change.new
    if engine is not None:
        engine.try_kernel(change.old, change.new)


def _is_of(change: Changed, entry: Entry) -> bool:
    """Whether a kernel is the text of a processor that is nothing but a kernel."""
    return entry.path.suffix == ".glsl" and Path(change.old.paths[0]) == entry.path


def _path_of(error: GraphError, change: Changed) -> Path | None:
    """Where the file lies that a message names by its short name."""
    return (
        shaders.find(error.file, kernel_sources.roots(change.key))
        if isinstance(error, ShaderError) and error.file
        else None
    )


def _refusal(id: str, path: Path, error: GraphError) -> Outcome:
    """Why the old code stays, with the line where it is known."""
    line = error.line if isinstance(error, ShaderError) else 0
    text = str(error)
    if isinstance(error, ShaderError) and error.file:
        text = text.removeprefix(f"{error.file}:{error.line}: ")
    if isinstance(error, UnknownProcessor):
        text = text.removeprefix(f"{id}: this processor is unavailable: ")
        front, colon, rest = text.partition(": ")
        if colon and front.startswith("line ") and front[5:].isdecimal():
            line, text = int(front[5:]), rest
    return Outcome(id, path, text, line)


def _digest(path: Path) -> bytes | None:
    try:
        return hashlib.blake2b(path.read_bytes(), digest_size=20).digest()
    except OSError:
        return None
