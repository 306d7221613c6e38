"""The one owner of everything that lies on a device: counts, budgets, eviction.

A device never frees an object by itself and never keeps one in a private list: it hands each object to
its `Memory` with the way to release it. So the number of objects and bytes is known at any time, and is 0
after `close`. moderngl in particular frees nothing that is merely forgotten.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
import weakref
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Any

from nodegraph.compute.spares import HostSpares, ObjectSpares, Owned
from nodegraph.data.buffer import Buffer
from nodegraph.errors import DeviceError

SPARE_BYTES = 64 << 20
SPARE_SHARE = 16
"""Of objects that nobody uses any more at most so many bytes are kept, and one part in so many of the budget; arrays
on the host take as much again."""

_clock = itertools.count(1)


class Budget:
    """A number of bytes that one or several owners share.

    The result cache and the memory of a device share one where the device *is* the host's memory (llvmpipe,
    OpenCL on a CPU), since the bytes come out of the same chips there. ``limit`` None means no bound.
    """

    def __init__(self, limit: int | None = None) -> None:
        self.limit = limit
        self._owners: dict[Callable[[], int], Callable[[], int]] = {}

    def watch(self, count: Callable[[], int], most: Callable[[], int] | None = None) -> None:
        """Add an owner: ``count()`` returns the bytes it holds now, ``most()`` no fewer, at once."""
        self._owners[count] = most or count

    def unwatch(self, count: Callable[[], int]) -> None:
        """Forget an owner that is closed. Raises KeyError where there is none."""
        del self._owners[count]

    @property
    def used(self) -> int:
        """Bytes that all owners hold now."""
        return sum(count() for count in self._owners)

    def exceeded(self, wanted: int = 0) -> int:
        """Bytes by which the limit is passed, or would be with ``wanted`` more; 0 where it is not."""
        if self.limit is None or sum(most() for most in self._owners.values()) + wanted <= self.limit:
            return 0
        return max(0, self.used + wanted - self.limit)

    @property
    def room(self) -> int | None:
        """Bytes that are left (0 when over the limit), or None without a limit."""
        return None if self.limit is None else max(0, self.limit - self.used)


class Entry:
    """One device object and what is known of it.

    ``read_back`` is given for objects that hold the only copy of a device-born buffer; it saves that copy,
    after which ``saved()`` says so and the object may be dropped. Objects of equal ``form`` can stand for each other.
    """

    __slots__ = (
        "bytes", "death", "form", "last_use", "live", "node", "object", "owner", "pins", "place", "purpose",
        "read_back", "release", "saved", "token",
    )  # fmt: skip

    def __init__(
        self,
        token: int,
        object: Any,
        bytes: int,
        purpose: str,
        release: Callable[[], None],
        owner: Buffer | None,
        key: Hashable,
        read_back: Callable[[], None] | None,
        saved: Callable[[], bool],
        node: str = "",
        form: Hashable = None,
    ) -> None:
        self.token = token
        self.form = form
        self.object = object
        self.bytes = bytes
        self.purpose = purpose
        self.node = node
        self.release = release
        self.owner: weakref.ref[Buffer] | None = None if owner is None else weakref.ref(owner)
        self.place = (id(owner), key)
        self.read_back = read_back
        self.saved = saved
        self.death: weakref.finalize[..., Buffer] | None = None
        self.pins = 0
        self.live = True
        self.last_use = next(_clock)

    @property
    def evictable(self) -> bool:
        """True for a copy of a buffer that no running dispatch reads: programs and scratch are never evicted."""
        return self.live and self.owner is not None and self.pins == 0

    @property
    def on_host(self) -> bool:
        """True when dropping this object loses nothing that somebody can still ask for."""
        buffer = None if self.owner is None else self.owner()
        return buffer is None or buffer.on_host or self.saved()


class Memory:
    """Owner of all objects of one device, within a budget.

    Only the device's thread allocates and frees. Buffers may die on any thread: their objects are queued and
    freed by `drain`, which the device calls before each dispatch.
    """

    def __init__(
        self,
        budget: Budget | int | None = None,
        *,
        name: str = "device",
        on_pressure: Callable[[int], object] | None = None,
    ) -> None:
        self.budget = budget if isinstance(budget, Budget) else Budget(budget)
        self.name = name
        # Called with the number of bytes that are missing; the result cache drops what is cheap to make again.
        self.on_pressure = on_pressure
        # For whom objects are made now, as `by_node` counts them.
        self.node = ""
        self._entries: dict[int, Entry] = {}
        self._by_buffer: dict[tuple[int, Hashable], Entry] = {}
        self._dead: deque[int] = deque()
        self._tokens = itertools.count(1)
        self._bytes = 0
        self.host = HostSpares()
        self._spares = ObjectSpares()
        self.host.bound(self._spare_share)
        self.budget.watch(self._count)

    @property
    def objects(self) -> int:
        """Number of device objects that live now."""
        return len(self._entries)

    @property
    def bytes(self) -> int:
        """Bytes that they hold. Host memory used in place is the host's and counts 0."""
        return self._bytes

    @property
    def spare_bytes(self) -> int:
        """Bytes that nobody uses, kept for results to come."""
        return self._spares.nbytes + self.host.nbytes

    def join(self, budget: Budget) -> None:
        """Count in another budget from now on."""
        self.budget.unwatch(self._count)
        self.budget = budget
        self.host.bound(self._spare_share)
        self.budget.watch(self._count)

    @property
    def _spare_share(self) -> int:
        return sys.maxsize if self.budget.limit is None else self.budget.limit // SPARE_SHARE

    def _count(self) -> int:
        return self._bytes + self.spare_bytes

    def by_purpose(self) -> dict[str, int]:
        """Bytes for each purpose (input, output, program, scratch)."""
        totals: dict[str, int] = {}
        for entry in self._entries.values():
            totals[entry.purpose] = totals.get(entry.purpose, 0) + entry.bytes
        return totals

    def by_node(self) -> dict[str, dict[str, int]]:
        """Bytes by the node for which an object was made first ("" for the device's own), then by purpose."""
        totals: dict[str, dict[str, int]] = {}
        for entry in self._entries.values():
            purposes = totals.setdefault(entry.node, {})
            purposes[entry.purpose] = purposes.get(entry.purpose, 0) + entry.bytes
        return totals

    def reserve(self, wanted: int, purpose: str) -> None:
        """Make room for ``wanted`` more bytes, or raise DeviceError. Call it before allocating."""
        limit = self.budget.limit
        self.drain()
        if limit is None:
            return
        self._evict(wanted, lambda entry: entry.on_host, save=False)
        if self._missing(wanted) and self.on_pressure is not None:
            self.on_pressure(self._missing(wanted))
            self.drain()
        self._evict(wanted, lambda entry: not entry.on_host, save=True)
        if self._missing(wanted):
            raise DeviceError(
                f"{self.name}: {wanted} bytes for {purpose} do not fit, {self.budget.used} of the budget of {limit} "
                f"bytes are in use by running work; raise the budget, or use a smaller size or volume"
            )

    def add(
        self,
        object: Any,
        bytes: int,
        purpose: str,
        release: Callable[[], None],
        *,
        owner: Buffer | None = None,
        key: Hashable = None,
        read_back: Callable[[], None] | None = None,
        saved: Callable[[], bool] = lambda: False,
        form: Hashable = None,
    ) -> Entry:
        """Take ownership of an object; ``release()`` frees it. With ``owner`` it dies with that buffer.

        One with a ``form`` may be kept then, until somebody `take`s one of that form.
        """
        entry = Entry(
            next(self._tokens), object, bytes, purpose, release, owner, key, read_back, saved, self.node, form
        )
        self._entries[entry.token] = entry
        self._bytes += bytes
        if owner is not None:
            self._by_buffer[entry.place] = entry
            # The callback may run inside the garbage collector of any thread: appending to a deque is all it does.
            entry.death = weakref.finalize(owner, self._dead.append, entry.token)
            entry.death.atexit = False
        return entry

    def find(self, owner: Buffer, key: Hashable) -> Entry | None:
        """Return the live copy of a buffer in the given form, or None."""
        entry = self._by_buffer.get((id(owner), key))
        # Identities repeat once a buffer has died, so the weak reference decides.
        if entry is None or not entry.live or entry.owner is None or entry.owner() is not owner:
            return None
        entry.last_use = next(_clock)
        return entry

    def take(self, form: Hashable) -> Owned | None:
        """An object of that form that nobody uses any more: the caller's now, to be added again. Or None."""
        self.drain()
        return self._spares.take(form)

    def resize(self, entry: Entry, bytes: int) -> None:
        """Correct what an entry counts, for memory that passed into the host's hands."""
        if entry.live:
            self._bytes += bytes - entry.bytes
            entry.bytes = bytes

    def drop(self, entry: Entry) -> None:
        """Free an object now. Device's thread only."""
        if entry.live:
            self._forget(entry)
            entry.release()

    def _forget(self, entry: Entry) -> None:
        entry.live = False
        del self._entries[entry.token]
        self._bytes -= entry.bytes
        if self._by_buffer.get(entry.place) is entry:
            del self._by_buffer[entry.place]
        if entry.death is not None:
            entry.death.detach()
        # What brings it to the host knows it as well: the array there would wait for the garbage collector.
        entry.read_back, entry.saved = None, bool

    def drain(self) -> None:
        """Free what died buffers left behind, or keep it for others. Device's thread only."""
        while self._dead:
            entry = self._entries.get(self._dead.popleft())
            if entry is not None and entry.form is not None:
                self._forget(entry)
                most = min(SPARE_BYTES, self._spare_share)
                self._spares.keep(entry.form, (entry.object, entry.bytes, entry.release), most)
            elif entry is not None:
                self.drop(entry)

    @contextlib.contextmanager
    def pinned(self, entries: Iterable[Entry]) -> Iterator[None]:
        """Protect entries from eviction while a dispatch uses them."""
        held = list(entries)
        for entry in held:
            entry.pins += 1
        try:
            yield
        finally:
            for entry in held:
                entry.pins -= 1

    def close(self) -> None:
        """Free everything. Buffers that live on this device alone are read back first where that still works."""
        self.drain()
        for entry in list(self._entries.values()):
            if entry.read_back is not None and not entry.on_host:
                with contextlib.suppress(DeviceError):
                    entry.read_back()
        for entry in list(self._entries.values()):
            self.drop(entry)
        self._dead.clear()
        self._clear_spares()
        self.host.bound(0)
        with contextlib.suppress(KeyError):
            self.budget.unwatch(self._count)

    def _clear_spares(self) -> None:
        self._spares.clear()
        self.host.clear()

    def _missing(self, wanted: int) -> int:
        missing = self.budget.exceeded(wanted)
        if missing and self.spare_bytes:
            self._clear_spares()
            missing = self.budget.exceeded(wanted)
        return missing

    def _evict(self, wanted: int, chosen: Callable[[Entry], bool], save: bool) -> None:
        """Drop entries, oldest use first, until ``wanted`` fits or no candidate is left."""
        if not self._missing(wanted):
            return
        candidates = [entry for entry in self._entries.values() if entry.evictable and chosen(entry)]
        for entry in sorted(candidates, key=lambda entry: entry.last_use):
            if save and entry.read_back is not None:
                entry.read_back()
            self.drop(entry)
            if not self._missing(wanted):
                return
