"""A few threads for processors that need no device, and the inbox of the engine's thread."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable


class Inbox:
    """Callables for one thread to run. Anybody may post; only the owner serves."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def post(self, act: Callable[[], None]) -> None:
        """Have ``act()`` run on the owner's thread, soon. It must not raise."""
        self._queue.put(act)

    def wake(self) -> None:
        """Make a blocked `serve` return, so that its caller looks again at what it waits for."""
        self._queue.put(_nothing)

    def serve(self, timeout: float | None = None) -> bool:
        """Run the next callable, waiting for it up to ``timeout`` seconds (None: as long as it takes)."""
        try:
            act = self._queue.get(timeout=timeout)
        except queue.Empty:
            return False
        act()
        return True

    def serve_waiting(self) -> None:
        """Run what is there now, without waiting."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._queue.get_nowait()()


def _nothing() -> None:
    """What `Inbox.wake` posts."""


class Job:
    """One call on a worker's thread."""

    __slots__ = ("_act", "abandoned", "running")

    def __init__(self, act: Callable[[], None]) -> None:
        self._act = act
        self.running = False
        self.abandoned = False


class Workers:
    """Up to ``count`` daemon threads, started when first needed.

    A job that is inside a library call cannot be stopped. It is *abandoned*: its thread ends when the call
    returns, and another thread takes its place at once, so nothing waits for it. The threads are daemons,
    since a program that wants to end must not wait for abandoned work either.
    """

    def __init__(self, count: int, name: str = "nodegraph-worker") -> None:
        self.count = max(1, count)
        self._name = name
        self._queue: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._threads = 0
        self._busy = 0
        self._waiting = 0
        self._closed = False

    def submit(self, act: Callable[[], None]) -> Job:
        """Run ``act()`` on a worker. It must not raise."""
        job = Job(act)
        with self._lock:
            if self._closed:
                raise RuntimeError("workers: they are closed")
            self._waiting += 1
            if self._threads < self.count and self._threads - self._busy < self._waiting:
                self._start()
        self._queue.put(job)
        return job

    def abandon(self, job: Job) -> None:
        """Drop a job: it does not start any more, or nobody waits for its end."""
        with self._lock:
            if job.abandoned:
                return
            job.abandoned = True
            if job.running:
                # Its thread ends with it; from now on it does not count.
                self._threads -= 1
                self._busy -= 1
                if self._waiting:
                    self._start()

    def close(self) -> None:
        """End the threads once they are idle. Running jobs are not waited for."""
        with self._lock:
            self._closed = True
            threads = self._threads
        for _ in range(threads):
            self._queue.put(None)

    def join(self, seconds: float) -> bool:
        """Wait until no job runs or waits, at most so long. Returns whether that came about."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with self._lock:
                if not self._busy and not self._waiting:
                    return True
            time.sleep(0.001)
        return False

    def _start(self) -> None:
        self._threads += 1
        threading.Thread(target=self._work, name=self._name, daemon=True).start()

    def _work(self) -> None:
        while True:
            job = self._queue.get()
            if job is None:
                return
            with self._lock:
                self._waiting -= 1
                if job.abandoned:
                    continue
                job.running = True
                self._busy += 1
            try:
                job._act()
            finally:
                ended = self._finish(job)
            if ended:
                return
            del job

    def _finish(self, job: Job) -> bool:
        """Count a job's end. Returns whether it was abandoned meanwhile."""
        with self._lock:
            job.running = False
            if not job.abandoned:
                self._busy -= 1
            return job.abandoned
