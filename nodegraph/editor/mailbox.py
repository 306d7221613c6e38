"""What other threads say to the window, and the threads that wait and work for it."""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from PySide6.QtCore import QObject, Qt, Signal

from nodegraph.accuracy.running import Cancelled, Show

if TYPE_CHECKING:
    from nodegraph.evaluation import Evaluation
    from nodegraph.report import Report

T = TypeVar("T")


class Task(Generic[T]):
    """Something that takes seconds or minutes, on a thread of its own; `cancel` it at any time.

    ``function`` gets ``show(text, fraction or None)`` to say how far it is and ``cancelled()`` to ask whether to stop.
    Of what it shows, the window hears the newest: ``told(text, fraction)``.
    """

    def __init__(
        self,
        mailbox: Mailbox,
        function: Callable[[Show, Cancelled], T],
        told: Callable[[str, float | None], object],
        then: Callable[[T | BaseException], object],
    ) -> None:
        self._mailbox, self._told = mailbox, told
        self._stop = threading.Event()
        self._news: tuple[str, float | None] | None = None
        self._thread = threading.Thread(target=self._run, args=(function, then), name="nodegraph-task", daemon=True)
        self._thread.start()

    def cancel(self) -> None:
        """Tell it to stop, which it does soon; returns at once."""
        self._stop.set()

    def join(self) -> None:
        """Wait until it has ended."""
        self._thread.join()

    def _run(self, function: Callable[[Show, Cancelled], T], then: Callable[[T | BaseException], object]) -> None:
        outcome: T | BaseException
        try:
            outcome = function(self._show, self._stop.is_set)
        except BaseException as error:
            outcome = error
        self._mailbox.post(lambda: self._end(then, outcome))

    def _show(self, text: str, fraction: float | None) -> None:
        first, self._news = self._news is None, (text, fraction)
        if first:
            self._mailbox.post(self._speak)

    def _speak(self) -> None:
        news, self._news = self._news, None
        if news is not None and not self._stop.is_set():
            self._told(*news)

    def _end(self, then: Callable[[T | BaseException], object], outcome: T | BaseException) -> None:
        self._mailbox.ended(self)
        then(outcome)


class Mailbox(QObject):
    """Runs functions on the window's thread that others post, in order.

    However many are posted meanwhile, the event loop is woken once; progress reports cannot drown it.
    """

    _woken = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._letters: deque[Callable[[], object]] = deque()
        self._lock = threading.Lock()
        self._closed = False
        self._evaluations: queue.SimpleQueue[tuple[Evaluation, Callable[[Any], object]] | None] = queue.SimpleQueue()
        self._workers = ThreadPoolExecutor(2, thread_name_prefix="nodegraph-beside")
        self._tasks: list[Task[Any]] = []
        self._waiter = threading.Thread(target=self._wait, name="nodegraph-waiter", daemon=True)
        self._woken.connect(self._deliver, Qt.ConnectionType.QueuedConnection)
        self._waiter.start()

    def post(self, letter: Callable[[], object]) -> None:
        """Call a function on the window's thread soon. Any thread."""
        with self._lock:
            if self._closed:
                return
            self._letters.append(letter)
            if len(self._letters) == 1:
                self._woken.emit()

    def wait_for(self, evaluation: Evaluation, then: Callable[[Report | BaseException], object]) -> None:
        """Call ``then`` on the window's thread with the report of an evaluation, or with what it raised."""
        self._evaluations.put((evaluation, then))

    def work(self, function: Callable[[], T], then: Callable[[T | None], object]) -> None:
        """Run a function beside the window and call ``then`` on its thread with the outcome, None if it raised."""

        def act() -> None:
            try:
                outcome = function()
            except Exception:
                outcome = None  # no picture of it can be made
            self.post(lambda: then(outcome))

        if not self._closed:
            self._workers.submit(act)

    def begin(
        self,
        function: Callable[[Show, Cancelled], T],
        told: Callable[[str, float | None], object],
        then: Callable[[T | BaseException], object],
    ) -> Task[T]:
        """Begin a task; ``then`` is called on the window's thread with its outcome, or with what it raised."""
        task = Task(self, function, told, then)
        self._tasks.append(task)
        return task

    def ended(self, task: Task[Any]) -> None:
        """Forget a task."""
        self._tasks.remove(task)

    def cancel(self) -> None:
        """Tell all tasks to stop."""
        for task in self._tasks:
            task.cancel()

    def close(self) -> None:
        """Deliver nothing any more and end the threads."""
        self.cancel()
        with self._lock:
            self._closed = True
            self._letters.clear()
        self._evaluations.put(None)
        self._workers.shutdown(wait=True, cancel_futures=True)
        self._waiter.join()
        for task in self._tasks:
            task.join()
        self._tasks.clear()

    def _wait(self) -> None:
        # The engine works one by one in order, so waiting in order delays nobody.
        while (item := self._evaluations.get()) is not None:
            evaluation, then = item
            outcome: Report | BaseException
            try:
                outcome = evaluation.result()
            except BaseException as error:
                outcome = error
            self.post(lambda then=then, outcome=outcome: then(outcome))  # type: ignore[misc]
            del item, evaluation, then, outcome  # they hold pictures and volumes

    def _deliver(self) -> None:
        with self._lock:
            letters = list(self._letters)
            self._letters.clear()
        for letter in letters:
            if self._closed:
                return
            letter()
