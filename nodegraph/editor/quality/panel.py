"""The quality panel: the measured error of a view, the time of its frame, and settings that trade one for the other."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QHBoxLayout, QProgressBar, QPushButton, QVBoxLayout, QWidget

from nodegraph.accuracy.running import Cancelled as Stop
from nodegraph.accuracy.running import Show
from nodegraph.accuracy.settings import Settings as Values
from nodegraph.accuracy.settings import snapshot
from nodegraph.commands import Set
from nodegraph.data import Image
from nodegraph.editor.quality.figures import Figures
from nodegraph.editor.quality.measuring import Errors, Proposal, bounded, measure, propose
from nodegraph.editor.quality.proposals import Proposals
from nodegraph.editor.quality.words import dim, said, sentence, upright
from nodegraph.errors import Cancelled, GraphError, one_sentence
from nodegraph.pacing import BUDGET_MS
from nodegraph.pictures import views_of
from nodegraph.requests import sink_size

if TYPE_CHECKING:
    from nodegraph.commands import Command
    from nodegraph.editor.mailbox import Task
    from nodegraph.editor.session import Session
    from nodegraph.editor.settings import Settings
    from nodegraph.report import Report

T = TypeVar("T")
WIDTH = 300


class QualityPanel(QWidget):
    """Measures one view, and proposes other settings for it. Both run beside the window and end when it is edited."""

    def __init__(self, session: Session, settings: Settings) -> None:
        super().__init__()
        self.session, self.settings = session, settings
        self.errors: Errors | None = None
        self._stale = False  # the network was changed since it was measured
        self._task: Task[Any] | None = None
        # Of final pictures: seconds, size. Whoever shows a view first owns its entry; others show it smaller.
        self._frames: dict[str, tuple[float, tuple[int, int]]] = {}
        self._owners: dict[str, object] = {}
        self._lay_out()
        session.changed.connect(self._changed)
        session.replaced.connect(self._replaced)
        session.answered.connect(self._answered)
        self.measure_it.clicked.connect(self.measure)
        self.cancel_it.clicked.connect(self.cancel)
        self.apply_it.clicked.connect(self.apply)
        self.proposals.wanted.connect(self.propose)
        self.proposals.marked.connect(self._enable)
        self.proposals.taken.connect(self.apply)
        self.budget.valueChanged.connect(self._set_budget)
        kept = settings.get("budget_ms", BUDGET_MS)
        self.budget.setValue(float(kept) if isinstance(kept, (int, float)) else BUDGET_MS)
        self._fill()
        self._forget()

    def _lay_out(self) -> None:
        self.view = QComboBox()
        self.view.setMinimumWidth(110)
        self.view.setToolTip("The view that is measured")
        self.view.currentIndexChanged.connect(lambda _: self._forget())
        self.measure_it = QPushButton("Measure")
        self.measure_it.setToolTip("Compare the view with its reference, in double precision")
        self.figures = Figures()
        self.budget = QDoubleSpinBox()
        self.budget.setRange(5.0, 2000.0)
        self.budget.setDecimals(0)
        self.budget.setSingleStep(10.0)
        self.budget.setSuffix(" ms")
        self.budget.setMinimumWidth(86)
        self.budget.setToolTip("What a picture may take while something is dragged; all views together share it")
        self.proposals = Proposals()
        self.summary = sentence()
        self.summary.setMinimumHeight(28)
        self.bar = QProgressBar()
        self.bar.setFixedSize(140, 6)
        self.bar.setTextVisible(False)
        self.bar.setRange(0, 1000)
        self.cancel_it = QPushButton("Cancel")
        self.apply_it = QPushButton("Apply")
        self.apply_it.setToolTip("Set what the marked row says, as one step that can be undone")

        choose, moving, ending = QHBoxLayout(), QHBoxLayout(), QHBoxLayout()
        choose.addWidget(self.view, 1)
        choose.addWidget(self.measure_it)
        moving.addWidget(dim("Picture while dragging"), 1)
        moving.addWidget(self.budget)
        ending.addWidget(self.summary, 1)
        for one in (self.bar, self.cancel_it, self.apply_it):
            ending.addWidget(one)
        side = QWidget()
        side.setFixedWidth(WIDTH)
        left = QVBoxLayout(side)
        left.setContentsMargins(0, 0, 0, 0)
        left.setSpacing(4)
        left.addLayout(choose)
        left.addWidget(self.figures)
        left.addStretch(1)
        left.addLayout(moving)
        right = QVBoxLayout()
        right.setSpacing(4)
        right.addWidget(self.proposals, 1)
        right.addLayout(ending)
        whole = QHBoxLayout(self)
        whole.setContentsMargins(10, 6, 10, 6)
        whole.setSpacing(12)
        whole.addWidget(side)
        whole.addWidget(upright())
        whole.addLayout(right, 1)

    # -- what can be done -----------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Whether something is measured or searched for."""
        return self._task is not None

    def measure(self) -> None:
        """Measure the error of the chosen view."""
        path = self._path()
        if path and not self.busy:
            size, copy = bounded(self._size(path)), snapshot(self.session.network)
            work = partial(measure, copy, path, size, self.session.engine, self.session.precise)
            self._begin(work, self._take_errors)

    def propose(self) -> None:
        """Search for settings that keep what is asked for."""
        path, asked = self._path(), self.proposals.asked
        if not path or self.busy or (asked.max_error is None and asked.milliseconds is None):
            return
        whole = self._size(path)
        size = bounded(whole)
        if asked.milliseconds is not None:
            # Nearly all that is tuned is done for each pixel, so the smaller picture has as much less time.
            share = size[0] * size[1] / (whole[0] * whole[1])
            asked = asked._replace(milliseconds=asked.milliseconds * share)
        used = self.session.engine.device_in_use
        device = used["name"] if used is not None else self.session.engine.device_name
        copy = snapshot(self.session.network)
        self._begin(partial(propose, copy, path, *asked, size, device, self.session.precise), self._take_proposal)

    def cancel(self) -> None:
        """Stop what runs."""
        if self.busy:
            self._end("Stopped.")

    def apply(self) -> None:
        """Set what the marked row says, as one step."""
        choice = self.proposals.choice
        if choice is not None and not self.busy and self._can_be_set(choice.changes):
            with self.session.gesture("settings of quality"):
                for place, value in choice.changes.items():
                    self.session.do(Set(place, value))

    # -- what runs ------------------------------------------------------------------------------------------------

    def _begin(self, work: Callable[[Show, Stop], T], then: Callable[[T], None]) -> None:
        self.summary.setText("Beginning ...")
        self.bar.setValue(0)

        def take(outcome: T | BaseException) -> None:
            if task is not self._task:
                return  # it was stopped, and something else may run
            self._end("")
            if isinstance(outcome, BaseException):
                self._say("Stopped." if isinstance(outcome, Cancelled) else said(one_sentence(outcome)))
            else:
                then(outcome)

        task = self._task = self.session.begin_task(work, self._tell, take)
        self._enable()

    def _tell(self, text: str, fraction: float | None) -> None:
        if self.busy:
            self._say(text)
            if fraction is not None:
                self.bar.setValue(round(1000 * fraction))

    def _end(self, why: str) -> None:
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
        self._say(why)
        self._enable()

    def _say(self, text: str, *more: str) -> None:
        self.summary.setText(text)
        self.summary.setToolTip("\n".join((text, *more)) if more else "")

    def _take_errors(self, found: Errors) -> None:
        self.errors, self._stale = found, False
        self.figures.show_errors(found, stale=False)

    def _take_proposal(self, found: Proposal) -> None:
        self.proposals.show_proposal(found)
        ended = " More time may find better." if found.tuned.ended else ""
        self._say(said(found.tuned.summary()) + ended, *(said(note) for note in found.tuned.notes))
        self._enable()

    # -- what is measured -----------------------------------------------------------------------------------------

    def _path(self) -> str:
        path = str(self.view.currentData() or "")
        return path if path in self.session.network else ""

    def _size(self, path: str) -> tuple[int, int]:
        """The size of the view on the screen; its own where it is on none."""
        return self._frames[path][1] if path in self._frames else sink_size(self.session.network.flatten(), path)

    def _fill(self) -> None:
        views = views_of(self.session.network.flatten(), None)
        if [self.view.itemData(i) for i in range(self.view.count())] == views:
            return
        before = self.view.currentData()
        self.view.blockSignals(True)
        self.view.clear()
        for path in views:
            self.view.addItem(path, path)
        self.view.setCurrentIndex(max(self.view.findData(before), 0) if views else -1)
        self.view.blockSignals(False)
        if self.view.currentData() != before:
            self._forget()

    def _changed(self, commands: list[Command]) -> None:
        if not any(command.touched or command.structural for command in commands):
            return
        self._fill()
        if self.busy:
            self._end("Stopped, since the network was changed.")
        elif self.errors is not None or self.proposals.proposal is not None:
            self._say("The network was changed since.")
        self._stale = True
        self.figures.show_errors(self.errors, stale=True)
        self._enable()

    def _replaced(self) -> None:
        self._frames.clear()
        self._owners.clear()
        self._fill()
        self._forget()

    def _forget(self) -> None:
        """Nothing is known of another view."""
        self._end("")
        self.errors, self._stale = None, False
        self.figures.show_errors(None, stale=False)
        self.proposals.show_proposal(None)
        self._show_frame()
        self._enable()

    def _answered(self, channel: object, report: Report) -> None:
        if not self.session.watches(channel) or self.session.quality(channel) != "final" or not report.ran:
            return
        for path, values in report.shown.items():
            image = next((value for value in values.values() if isinstance(value, Image)), None)
            owner = self._owners.get(path)
            if image is not None and (owner is None or owner is channel or not self.session.watches(owner)):
                self._owners[path] = channel
                self._frames[path] = (sum(report.timings.get(name, 0.0) for name in report.states), image.size)
        self._show_frame()

    def _show_frame(self) -> None:
        self.figures.show_frame(*self._frames.get(self._path(), (0.0, None)))

    def _set_budget(self, value: float) -> None:
        self.session.budget_ms = value
        self.settings.set("budget_ms", value)

    def _enable(self) -> None:
        path, asked, choice = bool(self._path()), self.proposals.asked, self.proposals.choice
        self.measure_it.setEnabled(path and not self.busy)
        anything = asked.max_error is not None or asked.milliseconds is not None
        self.proposals.propose.setEnabled(path and not self.busy and anything)
        self.bar.setVisible(self.busy)
        self.cancel_it.setVisible(self.busy)
        self.apply_it.setVisible(not self.busy and self.proposals.proposal is not None)
        self.apply_it.setEnabled(choice is not None and self._can_be_set(choice.changes))

    def _can_be_set(self, changes: Values) -> bool:
        """Whether anything would change, and everything is still there."""
        try:
            return {place: self.session.network.get(place) for place in changes} != changes
        except GraphError:
            return False  # a node was removed or renamed since
