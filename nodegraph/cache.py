"""Results by fingerprint, in memory: a byte budget, the least recently used go first.

What a node makes quickly, such as pictures of a camera that moves, gets a share of the budget and no more.

Bytes are counted over distinct memory: two results that share an array count it once, and a view counts
the whole array that it keeps alive. All methods may be called from any thread.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from nodegraph.data import Buffer, Value

if TYPE_CHECKING:
    from nodegraph.compute.dispatch import KernelRun

KEPT_ERRORS = 4096
QUICK = 1.0
"""Seconds: what took less is quick to make again."""
QUICK_SHARE = 16
QUICK_KEPT = 4
"""The quick results of a node may take one part in so many of the budget. So many of the latest are kept whatever they
take: what is changed and changed back runs nothing, however large a picture is."""


class SharedBudget(Protocol):
    """Bytes that several owners share, for a device whose memory is the host's."""

    def exceeded(self, wanted: int = 0) -> int: ...


@dataclass(slots=True, frozen=True)
class Result:
    """What a task or a memo made: its outputs, how long it took, and what has to be said about it each time.

    ``runs`` are the kernels that made it and ``decisions`` what the processor said of its own choices, for `explain`.
    """

    values: Mapping[str, Any]
    seconds: float = 0.0
    notes: tuple[str, ...] = ()
    memos: tuple[str, ...] = ()
    runs: tuple[KernelRun, ...] = ()
    decisions: tuple[str, ...] = ()

    @property
    def nbytes(self) -> int:
        """Bytes of distinct memory behind the values."""
        return sum({key: nbytes for key, nbytes, _ in blocks(self.values)}.values())


@dataclass(slots=True)
class _Entry:
    result: Result
    blocks: list[tuple[int, int, Any]] = field(default_factory=list)
    node: str = ""

    @property
    def nbytes(self) -> int:
        return sum(count for _, count, _ in self.blocks)


class ResultCache:
    """Results by key, within ``limit`` bytes. A limit of 0 keeps nothing.

    ``failures`` of the same keys are remembered apart from the budget, the latest few thousand.
    """

    def __init__(self, limit: int) -> None:
        self.limit = limit
        self.shared: SharedBudget | None = None
        self._lock = threading.RLock()
        self._entries: OrderedDict[bytes, _Entry] = OrderedDict()
        self._failures: OrderedDict[bytes, Exception] = OrderedDict()
        self._pins: dict[bytes, int] = {}
        # Quick results by the node that made them, least recently used first.
        self._quick: dict[str, OrderedDict[bytes, int]] = {}
        # Distinct memory: identity of its owner -> (how many entries hold it, bytes, the owner itself).
        self._blocks: dict[int, tuple[int, int, Any]] = {}
        self._bytes = 0
        # Those whose bytes come and go, since they read their file in pieces.
        self._chunked: dict[int, Buffer] = {}

    def get(self, key: bytes) -> Result | None:
        """Return a result and count it as used, or None."""
        with self._lock:
            entry = self._entries.get(key)
            if entry is None:
                return None
            self._entries.move_to_end(key)
            if entry.node:
                self._quick[entry.node].move_to_end(key)
            return entry.result

    def __contains__(self, key: bytes) -> bool:
        return key in self._entries

    def __len__(self) -> int:
        return len(self._entries)

    def put(self, key: bytes, result: Result, node: str = "") -> bool:
        """Keep a result if the budget allows, letting go of older ones. Returns whether it is kept.

        ``node`` is the path of the node that made it: its quick results are bounded by themselves.
        """
        with self._lock:
            self._failures.pop(key, None)
            if self.limit <= 0:
                return False
            self._remove(key)
            entry = _Entry(result, list(blocks(result.values)), node if result.seconds < QUICK else "")
            self._entries[key] = entry
            for identity, nbytes, owner in entry.blocks:
                holders, _, _ = self._blocks.get(identity, (0, 0, None))
                self._blocks[identity] = (holders + 1, nbytes, owner)
                self._bytes += nbytes if holders == 0 else 0
                if isinstance(owner, Buffer) and owner.chunks is not None:
                    self._chunked[identity] = owner
            if entry.node:
                self._quick.setdefault(node, OrderedDict())[key] = entry.nbytes
                self._bound_quick(self._quick[node])
            self.trim()
            return key in self._entries

    def fail(self, key: bytes, error: Exception) -> None:
        """Remember that this key failed."""
        with self._lock:
            self._failures[key] = error
            while len(self._failures) > KEPT_ERRORS:
                self._failures.popitem(last=False)

    def failure(self, key: bytes) -> Exception | None:
        """Return the error that this key ended in, or None."""
        return self._failures.get(key) if self._failures else None

    def forget_failures(self) -> None:
        """Let everything that failed be tried again."""
        with self._lock:
            self._failures.clear()

    def clear(self) -> None:
        """Let go of everything that is not pinned."""
        with self._lock:
            for key in [key for key in self._entries if key not in self._pins]:
                self._remove(key)

    def forget(self, keys: Iterable[bytes]) -> None:
        """Let go of some results, so that they are made again when somebody asks. Pinned ones stay."""
        with self._lock:
            for key in keys:
                if key not in self._pins:
                    self._remove(key)

    @property
    def nbytes(self) -> int:
        """Bytes of distinct memory that is kept, on the host or on a device."""
        return self._bytes + self._read_bytes()

    def host_bytes(self) -> int:
        """Bytes that lie on the host: what the cache counts in a budget that it shares with a device.

        It looks at all that is kept; `nbytes` is at once, and never less.
        """
        with self._lock:
            owners = list(self._blocks.values())
        kept = sum(nbytes for _, nbytes, owner in owners if not isinstance(owner, Buffer) or owner.on_host)
        return kept + self._read_bytes()

    def pin(self, key: bytes) -> None:
        """Keep a key from eviction, also when it is put later, until it is unpinned as often."""
        with self._lock:
            self._pins[key] = self._pins.get(key, 0) + 1

    def unpin(self, key: bytes) -> None:
        """Undo one `pin`; the budget holds again."""
        with self._lock:
            self._pins[key] -= 1
            if not self._pins[key]:
                del self._pins[key]
                self.trim()

    def trim(self) -> None:
        """Remove the least recently used until the budget holds."""
        with self._lock:
            if self._over() > 0:
                for owner in tuple(self._chunked.values()):
                    if owner.resident:
                        owner.release()  # nothing is cheaper to have again than what lies in a file
                        if self._over() <= 0:
                            return
                for key in [key for key in self._entries if key not in self._pins]:
                    self._remove(key)
                    if self._over() <= 0:
                        return

    def release_cheap(self, wanted: int) -> int:
        """Let go of what is cheapest to make again (seconds per byte) until ``wanted`` bytes are free; return how many.

        A device that runs short calls this. Only results that lie on a device alone count, since dropping
        anything else frees nothing there, unless the device shares its budget with this cache.
        """
        with self._lock:
            free = [key for key in self._entries if key not in self._pins]

            def dearness(key: bytes) -> float:
                entry = self._entries[key]
                return entry.result.seconds / max(1, entry.nbytes)

            before = self._bytes
            for key in sorted(free, key=dearness):
                if before - self._bytes >= wanted:
                    break
                owners = [owner for _, _, owner in self._entries[key].blocks]
                if self.shared is not None or any(isinstance(owner, Buffer) and not owner.on_host for owner in owners):
                    self._remove(key)
            return before - self._bytes

    def _read_bytes(self) -> int:
        """Bytes that buffers in chunks have read by now."""
        with self._lock:
            return sum(owner.resident for owner in self._chunked.values())

    def _over(self) -> int:
        over = self.nbytes - self.limit
        return over if self.shared is None else max(over, self.shared.exceeded())

    def _bound_quick(self, made: OrderedDict[bytes, int]) -> None:
        """Let go of the oldest quick results of a node. The latest few stay, and so does what is pinned."""
        over = sum(made.values()) - self.limit // QUICK_SHARE
        for key, nbytes in list(made.items())[:-QUICK_KEPT]:
            if over <= 0:
                return
            if key not in self._pins:
                self._remove(key)
                over -= nbytes

    def _remove(self, key: bytes) -> None:
        entry = self._entries.pop(key, None)
        if entry is not None and entry.node:
            made = self._quick[entry.node]
            del made[key]
            if not made:
                del self._quick[entry.node]
        for identity, nbytes, _ in entry.blocks if entry is not None else ():
            holders, _, owner = self._blocks[identity]
            if holders == 1:
                del self._blocks[identity]
                self._chunked.pop(identity, None)
                self._bytes -= nbytes
            else:
                self._blocks[identity] = (holders - 1, nbytes, owner)


def blocks(value: Any) -> Iterator[tuple[int, int, Any]]:
    """Distinct memory behind a value: (identity, bytes, owner) of each array or device buffer, each once."""
    seen: set[int] = set()
    for identity, nbytes, owner in _blocks(value):
        if identity not in seen:
            seen.add(identity)
            yield identity, nbytes, owner


def _blocks(value: Any) -> Iterator[tuple[int, int, Any]]:
    if isinstance(value, Value):
        for buffer in value.buffers:
            yield from _blocks(buffer)
    elif isinstance(value, Buffer):
        if value.chunks is not None:
            yield id(value), 0, value  # what it read comes and goes: `ResultCache.nbytes` asks for it
        elif value.on_host:
            yield from _blocks(value.array)
        else:
            yield id(value), value.nbytes, value
    elif isinstance(value, np.ndarray):
        base: Any = value
        while isinstance(base.base, np.ndarray):
            base = base.base
        mapped = isinstance(base, np.memmap)  # pages of a file, which the system takes back when it needs them
        yield id(base), 0 if mapped else base.nbytes, base
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _blocks(item)
    elif isinstance(value, (list, tuple, set, frozenset)):
        for item in value:
            yield from _blocks(item)


def each_buffer(value: Any, act: Callable[[Buffer], Any]) -> None:
    """Call ``act`` with every buffer of a value or of a collection of values."""
    if isinstance(value, Value):
        for buffer in value.buffers:
            act(buffer)
    elif isinstance(value, Mapping):
        each_buffer(tuple(value.values()), act)
    elif isinstance(value, (list, tuple)):
        for item in value:
            each_buffer(item, act)
