"""A request to the engine, and what waiting for it or cancelling it means."""

from __future__ import annotations

import threading
from collections.abc import Callable

from nodegraph.errors import Cancelled, GraphError
from nodegraph.report import Report


class Evaluation:
    """A request to the engine, from any thread: wait for its report, or cancel it."""

    def __init__(self, start: Callable[[Evaluation], Report], channel: object, wake: Callable[[], None]) -> None:
        self._start = start
        self._wake = wake
        self.channel = channel
        self._cancelled = threading.Event()
        self._done = threading.Event()
        self._report: Report | None = None
        self._error: BaseException | None = None

    def cancel(self) -> None:
        """Stop at the next strip, yield or progress report; library calls are abandoned. Returns at once."""
        self._cancelled.set()
        self._wake()

    @property
    def cancelled(self) -> bool:
        """True once `cancel` was called, or a newer evaluation of the same channel came."""
        return self._cancelled.is_set()

    def done(self) -> bool:
        """True when `result` returns at once."""
        return self._done.is_set()

    def result(self, timeout: float | None = None) -> Report:
        """Wait for the report. Raises Cancelled, what planning raised, or TimeoutError."""
        if not self._done.wait(timeout):
            raise TimeoutError(f"the evaluation takes longer than {timeout} s")
        if self._error is not None:
            raise self._error
        assert self._report is not None
        return self._report

    def run(self) -> None:
        """Evaluate, on the engine's thread."""
        try:
            if self.cancelled:
                raise Cancelled
            self._report = self._start(self)
        except BaseException as error:
            self._error = error
        finally:
            self._start = _finished
            self._done.set()

    def refuse(self, error: GraphError) -> None:
        """End without having run."""
        self._error = error
        self._start = _finished
        self._done.set()


def _finished(_: Evaluation) -> Report:
    raise Cancelled
