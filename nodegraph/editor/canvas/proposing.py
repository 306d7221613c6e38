"""Proposals on the canvas: dashed wires while a processor is dragged in, and a small bar after it was dropped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, Signal
from PySide6.QtGui import QPainter, QPaintEvent, QPalette, QPen
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QGraphicsPathItem,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QToolButton,
    QWidget,
)

from nodegraph.commands import Connect
from nodegraph.editor import theme
from nodegraph.editor.canvas.faces import face_of
from nodegraph.editor.canvas.level_edits import Refused
from nodegraph.editor.canvas.look import wire_path
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.proposals import (
    Box,
    Proposal,
    WireProposal,
    detached,
    explained,
    possible,
    propose,
    propose_wires,
    told,
)
from nodegraph.editor.canvas.wires import WireItem
from nodegraph.errors import GraphError
from nodegraph.variable_commands import Link
from nodegraph.wires import is_many

if TYPE_CHECKING:
    from nodegraph.editor.canvas.view import GraphView

MOST = 4
"""Proposals that the bar names; more are counted."""


class ProposalBar(QFrame):
    """A line at the lower edge of the canvas: what is proposed, each to be left out by a click, and two buttons."""

    accepted = Signal()
    dismissed = Signal()
    changed = Signal()  # a proposal was left out, or taken in again

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.canvas = parent
        self.chips: list[QCheckBox] = []
        self.accept = QPushButton("Accept")
        self.accept.setToolTip("Do what is ticked (Ctrl+Return)")
        self.accept.setDefault(True)
        self.close_it = QToolButton(autoRaise=True)
        self.close_it.setToolTip("Dismiss (Esc)")
        self.close_it.setAccessibleName("Dismiss")
        self.more = QLabel()
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(8, 6, 6, 6)
        self._row.setSpacing(10)
        for widget in (self.more, self.accept, self.close_it):
            widget.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            self._row.addWidget(widget)
        self.accept.clicked.connect(self.accepted)
        self.close_it.clicked.connect(self.dismissed)
        self.hide()

    def show_proposals(self, lines: list[tuple[str, str]]) -> None:
        """Show these proposals, each in few words and in a sentence, all ticked."""
        for chip in self.chips:
            self._row.removeWidget(chip)
            chip.deleteLater()
        self.chips = []
        for i, (words, sentence) in enumerate(lines[:MOST]):
            chip = QCheckBox(words)
            chip.setToolTip(sentence)
            chip.setChecked(True)
            chip.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            chip.setCursor(Qt.CursorShape.PointingHandCursor)
            chip.toggled.connect(self._toggle)
            self.chips.append(chip)
            self._row.insertWidget(i, chip)
        self.more.setText(f"and {len(lines) - MOST} more" if len(lines) > MOST else "")
        self.more.setVisible(len(lines) > MOST)
        self.close_it.setIcon(theme.icon("clear", self.palette(), 12))
        self.accept.setEnabled(True)
        self.show()
        self.place()
        self.raise_()

    def ticked(self, i: int) -> bool:
        """Whether a proposal is to be done; those that are only counted are."""
        return i >= len(self.chips) or self.chips[i].isChecked()

    def place(self) -> None:
        """Stand at the middle of the lower edge."""
        self.adjustSize()
        self.move(max(8, (self.canvas.width() - self.width()) // 2), self.canvas.height() - self.height() - 14)

    def _toggle(self) -> None:
        self.accept.setEnabled(any(self.ticked(i) for i in range(len(self.chips))))
        self.changed.emit()

    def paintEvent(self, event: QPaintEvent) -> None:
        """A card, told apart from the canvas below in light and dark."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(self.palette().color(QPalette.ColorRole.Mid))
        painter.setBrush(self.palette().color(QPalette.ColorRole.Button))
        painter.drawRoundedRect(self.rect().adjusted(0, 0, -1, -1), 6, 6)


class Proposing(QObject):
    """Finds, shows and follows the proposals for one node at a time. It holds none that no longer is possible."""

    def __init__(self, view: GraphView) -> None:
        super().__init__(view)
        self.view = view
        self.scene = view.canvas_scene
        self.bar = ProposalBar(view)
        self.id = ""
        self.proposals: list[Proposal] = []
        self._lines: list[QGraphicsPathItem] = []
        self._hovered: tuple[str, QPointF] | None = None
        self.bar.accepted.connect(self.accept)
        self.bar.dismissed.connect(self.dismiss)
        self.bar.changed.connect(self._draw_shown)
        self.scene.synced.connect(self._recheck)
        self.scene.leaving.connect(self.dismiss)
        view.installEventFilter(self)

    # -- while a processor is dragged in ------------------------------------------------------------------------

    def hover(self, type: str, corner: QPointF) -> None:
        """Draw the wires that a processor would be offered if it were dropped with its corner here."""
        if self._hovered is not None and self._hovered[0] == type:
            if self.view.pixels(corner - self._hovered[1]) < 3:
                return
        self._hovered = (type, corner)
        try:
            node = detached(self.scene.level, self.scene.session.network.find(type))
        except GraphError:
            return
        item = NodeItem(node.id, face_of(node), self.scene.look, self.scene.standing.status)
        item.setPos(corner)
        over = self.view.wire_below(item.body_in_scene(), lambda wire: bool(self.view.edits.fits_into(node, wire)))
        self._mark(over)
        if over is not None:
            self._draw([])  # it would go in there, which wires it
            return
        found = propose_wires(self.scene.level, node, self._boxes(item), self._known)
        self._draw([self._ends(one, item) for one in found])

    def leave(self) -> None:
        """The processor was dragged away or dropped."""
        self._hovered = None
        self._mark(None)
        self._draw([])

    def _mark(self, over: WireItem | None) -> None:
        """Mark the wire that the processor would be inserted into, and no other."""
        for item in self.scene.wires.values():
            if item.marked != (item is over):
                item.marked = item is over
                item.dress()

    # -- after it was dropped -----------------------------------------------------------------------------------

    def offer(self, id: str) -> None:
        """Show what is proposed for a node of the level, if anything is."""
        found = self.found(id)
        self.dismiss()
        if found:
            self.id, self.proposals = id, found
            level = self.scene.level
            self.bar.show_proposals([(told(one), explained(level, one)) for one in found])
            self._draw_shown()

    def found(self, id: str) -> list[Proposal]:
        """What suggests itself for a node of the level now."""
        self.scene.flush()
        return propose(self.scene.level, self.scene.level.nodes[id], self._boxes(), self._known)

    def accept(self) -> None:
        """Do what is ticked in the bar, as one step."""
        chosen = [one for i, one in enumerate(self.proposals) if self.bar.ticked(i)]
        self.dismiss()
        self.follow(chosen)

    def follow(self, proposals: list[Proposal]) -> None:
        """Do what was proposed, all or nothing, as one step."""
        if not proposals:
            return
        try:
            with self.scene.session.gesture("connect as proposed"):
                for one in proposals:
                    self._do(one)
        except Refused:
            pass  # the session has told why
        self.scene.flush()

    def dismiss(self) -> None:
        """Forget what is proposed."""
        if self.id:
            self.id, self.proposals = "", []
            self.bar.hide()
        self._draw([])

    def _do(self, one: Proposal) -> None:
        edits, prefix = self.view.edits, self.scene.level.prefix
        if isinstance(one, WireProposal):
            many = is_many(self.scene.level.nodes[one.target], one.name)
            edits.must(Connect(prefix + one.source, f"{prefix}{one.target}.{one.name}", replace=not many))
        else:
            if one.fresh:
                edits.must(Link(prefix + one.giver, one.variable))
            edits.must(Link(prefix + one.parameter, one.variable))

    def _recheck(self) -> None:
        """The network changed: what can no longer be followed is no longer shown."""
        if not self.id:
            return
        level = self.scene.level
        node = level.nodes.get(self.id)
        left = [one for one in self.proposals if node is not None and possible(level, node, one)]
        if len(left) != len(self.proposals):
            id = self.id
            self.dismiss()
            if left:
                self.id, self.proposals = id, left
                self.bar.show_proposals([(told(one), explained(level, one)) for one in left])
        self._draw_shown()

    # -- pictures -----------------------------------------------------------------------------------------------

    def _boxes(self, *added: NodeItem) -> dict[str, Box]:
        items = [*self.scene.nodes.values(), *added]
        return {item.face.id: (item.x(), item.y(), *item.size) for item in items}

    def _known(self, id: str, output: str) -> object:
        return self.scene.session.value(self.scene.path_of(id), output) if id in self.scene.level.nodes else None

    def _ends(self, one: WireProposal, item: NodeItem | None = None) -> tuple[QPointF, QPointF]:
        giver, _, output = one.source.rpartition(".")
        items = {**self.scene.nodes, **({item.face.id: item} if item is not None else {})}
        return items[giver].anchor(True, output), items[one.target].anchor(False, one.name)

    def _draw_shown(self) -> None:
        self._draw(
            [
                self._ends(one)
                for i, one in enumerate(self.proposals)
                if isinstance(one, WireProposal) and self.bar.ticked(i)
            ]
        )

    def _draw(self, ends: list[tuple[QPointF, QPointF]]) -> None:
        for line in self._lines:
            self.scene.removeItem(line)
        self._lines = []
        pen = QPen(self.scene.look.accent, 2.5, Qt.PenStyle.DashLine)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        for start, end in ends:
            path = wire_path(start, end)
            for spot in (start, end):
                path.addEllipse(spot, 9, 9)
            line = QGraphicsPathItem(path)
            line.setPen(pen)
            line.setZValue(20)
            self.scene.addItem(line)
            self._lines.append(line)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize and self.id:
            self.bar.place()
        return False
