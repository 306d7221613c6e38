"""Running one output of a network for a measurement: with cancelling, with progress, and with its one value."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nodegraph.errors import CommandError

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network
    from nodegraph.report import Event, Observer, Report

Show = Callable[[str, float | None], None]
"""Told what is done now and, where it is known, which part of it (0..1) is done."""
Cancelled = Callable[[], bool]
"""Asked now and then whether to stop."""

POLL_SECONDS = 0.05


def run_view(
    engine: Engine,
    network: Network,
    view: str,
    size: tuple[int, int] | None = None,
    *,
    label: str = "",
    show: Show | None = None,
    cancelled: Cancelled | None = None,
) -> Report:
    """Evaluate one view and return its report. Raises the first error of a node, Cancelled, CommandError, DeviceError.

    ``cancelled`` is asked about twenty times a second, on the calling thread; Ctrl-C cancels, too.
    """

    def observe(event: Event) -> None:
        if show is not None and event.kind in ("started", "progress"):
            text = " ".join(
                part for part in (label, event.path, event.text if event.kind == "progress" else "") if part
            )
            show(text, event.fraction if event.kind == "progress" else None)

    report = evaluated(engine, network, view, size, observe, cancelled)
    report.raise_first()
    return report


def evaluated(
    engine: Engine,
    network: Network,
    view: str,
    size: tuple[int, int] | None,
    on_event: Observer | None,
    cancelled: Cancelled | None,
) -> Report:
    """The report of one view, with the errors of nodes in it. Raises Cancelled, CommandError, DeviceError."""
    if cancelled is None:
        return engine.evaluate(network, view, size=size, on_event=on_event)
    evaluation = engine.submit(network, view, size=size, on_event=on_event)
    try:
        while not evaluation.done():
            if cancelled():
                evaluation.cancel()
            try:
                evaluation.result(POLL_SECONDS)
            except TimeoutError:
                continue
    except KeyboardInterrupt:
        evaluation.cancel()
        raise
    return evaluation.result()


def shown_value(report: Report, view: str) -> Any:
    """The one value that a view shows. Raises CommandError where it shows none, or several."""
    values = report.shown[view]
    if len(values) != 1:
        listed = ", ".join(f"{view}.{name}" for name in values)
        cure = f"name one of {listed}" if values else "name an output of a node above it"
        raise CommandError(f"{view}: shows {len(values)} values, and one is measured at a time; {cure}")
    return next(iter(values.values()))
