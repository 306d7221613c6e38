"""One parameter in the panel: its name, its widget, who decides it, and what was wrong with the last entry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QPointF, QSize, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QFontMetrics, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QSizePolicy, QToolButton, QWidget

from nodegraph.editor.parameters.kinds import make_field
from nodegraph.editor.parameters.look import (
    GAP,
    LABEL_WIDTH,
    ROW_HEIGHT,
    accent,
    caption,
    complaint,
    icon,
    ink,
    name_text,
)
from nodegraph.editor.parameters.menu import ParameterMenu
from nodegraph.editor.parameters.place import Place, Tie
from nodegraph.editor.parameters.simple import LineEntry
from nodegraph.errors import GraphError, ParameterError

if TYPE_CHECKING:
    from nodegraph.params import Parameter


FOLDED = "folded"
"""Key of the document's ``ui`` that lists the parameters whose widgets are put away, as ``processor.parameter``."""


class NameLabel(QWidget):
    """The name of a parameter; a dot before it says that the value is not the default, a diamond that it has keys.

    A double click resets.
    """

    INDENT = 12
    """Pixels before the name, where the dot is."""
    reset = Signal()

    def __init__(self, text: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.text = text
        self.changed = False
        self.keyed = False
        self.setFixedHeight(ROW_HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName(text)

    def sizeHint(self) -> QSize:
        return QSize(LABEL_WIDTH, ROW_HEIGHT)

    def set_changed(self, changed: bool) -> None:
        if changed != self.changed:
            self.changed = changed
            self.update()

    def set_keyed(self, keyed: bool) -> None:
        if keyed != self.keyed:
            self.keyed = keyed
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self.keyed:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(accent(self.palette()))
            middle = QPointF(5.0, self.height() / 2)
            painter.drawPolygon([middle + QPointF(x, y) for x, y in ((-4, 0), (0, -4), (4, 0), (0, 4))])
        elif self.changed:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(accent(self.palette()))
            painter.drawEllipse(QPointF(4.5, self.height() / 2), 2.5, 2.5)
        painter.setPen(ink(self.palette(), 1.0 if self.changed else 0.85))
        area = self.rect().adjusted(self.INDENT, 0, 0, 0)
        text = QFontMetrics(self.font()).elidedText(self.text, Qt.TextElideMode.ElideRight, area.width())
        painter.drawText(area, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, text)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() is Qt.MouseButton.LeftButton:
            self.reset.emit()


class ParameterRow(QWidget):
    """A parameter of one node. `refresh` shows what the document has."""

    def __init__(self, place: Place, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.place = place
        self.declared: Parameter = place.declared
        self.label = NameLabel(name_text(place.name))
        self.label.reset.connect(self.reset)
        self.field = make_field(self.declared, place)
        self.field.edited.connect(self._edit)
        self.field.began.connect(self._begin)
        self.field.ended.connect(self._end)
        self.field.cancelled.connect(self._cancel)
        self.field.refused.connect(self.show_error)
        self._open = False
        self.tie = QToolButton()
        self.tie.setAutoRaise(True)
        self.tie.setFixedSize(22, ROW_HEIGHT)
        self.tie.clicked.connect(lambda: self.menu().popup(self.tie.mapToGlobal(self.tie.rect().bottomLeft())))
        self.arrow = QToolButton(self)
        self.arrow.setAutoRaise(True)
        self.arrow.setFixedSize(22, ROW_HEIGHT)
        self.arrow.clicked.connect(lambda: self.fold(not self.folded))
        self.tied = caption()
        self.tied.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.expression = LineEntry()
        self.expression.setPlaceholderText("expression, as  coarse / 2")
        self.expression.setAccessibleName(f"{place.name}: expression")
        self.expression.entered.connect(self._express)
        self.error = complaint()
        self._editing_expression = False
        self._shown_tie: tuple[Tie, bool] | None = None
        self._arrange()
        self._show_fold()
        self._explain()
        self.refresh()

    def _arrange(self) -> None:
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(GAP)
        layout.setVerticalSpacing(2)
        top = QHBoxLayout()
        top.setSpacing(0)
        top.addWidget(self.label, 1)
        top.addWidget(self.tie)
        if self.field.wide:
            top.addWidget(self.arrow)
            layout.addLayout(top, 0, 0, 1, 2)
            layout.addWidget(self.field, 1, 0, 1, 2)
            layout.setContentsMargins(0, 0, 0, 4)
        else:
            self.arrow.hide()
            holder = QWidget()
            holder.setFixedWidth(LABEL_WIDTH)
            holder.setLayout(top)
            top.setContentsMargins(0, 0, 0, 0)
            layout.addWidget(holder, 0, 0, Qt.AlignmentFlag.AlignTop)
            layout.addWidget(self.field, 0, 1)
        layout.setColumnStretch(1, 1)
        below = 2 if self.field.wide else 1
        if self.field.wide:
            self.tied.setIndent(NameLabel.INDENT)
            self.error.setIndent(NameLabel.INDENT)
        for row, widget in enumerate((self.expression, self.tied, self.error), below):
            layout.addWidget(widget, row, 0 if self.field.wide else 1, 1, 2 if self.field.wide else 1)
            widget.hide()

    # -- folding ------------------------------------------------------------------------------------------------

    @property
    def folded(self) -> bool:
        """Whether the widget is put away, on all nodes of the type. The document keeps it as it keeps the panels."""
        return self.field.wide and self._kind in self.place.session.network.ui.get(FOLDED, ())

    @property
    def _kind(self) -> str:
        return f"{self.place.node.type}.{self.place.name}"

    def fold(self, folded: bool) -> None:
        """Put the widget away, or show it."""
        self.leave()
        others = [kind for kind in self.place.session.network.ui.get(FOLDED, ()) if kind != self._kind]
        self.place.session.note(FOLDED, [*others, self._kind] if folded else others or None)
        self._show_fold()

    def _show_fold(self) -> None:
        folded = self.folded
        self.field.setVisible(not folded)
        self.arrow.setIcon(icon("right" if folded else "down", ink(self.palette(), 0.8)))
        self.arrow.setToolTip("Unfold" if folded else "Fold")
        self.arrow.setAccessibleName(f"{'Unfold' if folded else 'Fold'} {self.place.name}")

    # -- showing ------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show what the document has now."""
        tie = self.place.tie()
        try:
            self.field.show_value(self.place.value())
            trouble = ""
        except ParameterError as error:
            trouble = str(error)
        self.field.set_read_only(tie.locked)
        self.label.set_changed(tie.kind == "own" and not self.place.is_default())
        self._show_tie(tie)
        self.show_error(trouble)

    def show_error(self, text: str) -> None:
        """Show under the widget why an entry was refused; an empty text clears it."""
        front = f"{self.place.target}: "
        self.error.setText(text.removeprefix(front))
        self.error.setVisible(bool(text))

    def _show_tie(self, tie: Tie) -> None:
        if (tie, self._editing_expression) == self._shown_tie:
            return  # most changes are of values
        self._shown_tie = (tie, self._editing_expression)
        self.tie.setVisible(tie.kind != "own")
        names = {"wire": "wire", "variable": "link", "expression": "expression"}
        says = {
            "wire": f"wired from {tie.source}",
            "variable": f"follows the variable {tie.source}",
            "expression": f"{tie.source} = {tie.text}",
        }
        if tie.kind != "own":
            self.tie.setIcon(icon(names[tie.kind], accent(self.palette())))
            self.tie.setToolTip(says[tie.kind])
            self.tie.setAccessibleName(says[tie.kind])
            self.tied.setText(says[tie.kind])
        if tie.kind == "expression":
            self.expression.show_text(f"= {tie.text}")
        self.expression.setVisible(tie.kind == "expression" or self._editing_expression)
        self.tied.setVisible(tie.kind in ("wire", "variable"))

    def _explain(self) -> None:
        """The declaration's doc and default as tooltips."""
        declared = self.declared
        default = declared.encode(declared.default)
        unit = f" {declared.unit}" if declared.unit else ""
        shown = default if isinstance(default, (int, float, str)) and default != "" else None
        end = f"<br>Default: {shown}{unit}." if shown is not None else ""
        self.label.setToolTip(f"<p>{_html(declared.doc)}{end}<br><i>Double-click to reset.</i></p>")
        self.field.setToolTip(f"<p>{_html(declared.doc)}</p>")

    @property
    def changed(self) -> bool:
        """Whether something else than the default decides the value."""
        return self.label.changed or self.place.tie().kind != "own"

    # -- changing -----------------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Return to the default."""
        self.finish(self.place.reset())

    def start_expression(self) -> None:
        """Open the line for an expression."""
        self._editing_expression = True
        tie = self.place.tie()
        self.expression.show_text(f"= {tie.text}" if tie.text else "")
        self.expression.show()
        self.expression.setFocus()

    def finish(self, error: str) -> None:
        """Show the document after an edit, or why there was none."""
        self.refresh()
        if error:
            self.show_error(error)

    def menu(self) -> ParameterMenu:
        """The menu of this parameter."""
        return ParameterMenu(self)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        self.menu().popup(event.globalPos())
        event.accept()

    def leave(self) -> None:
        """End an open gesture: the row is about to go."""
        self.field.leave()
        if self._open:
            self._end()

    def _begin(self) -> None:
        if not self._open:
            self._open = True
            self.place.begin()

    def _end(self) -> None:
        if self._open:
            self._open = False
            self.place.end()

    def _cancel(self) -> None:
        if self._open:
            self._open = False
            self.place.cancel()

    def _edit(self, value: Any) -> None:
        error = self.place.set(value)
        if error:
            self.finish(error)
        else:
            self.show_error("")

    def _express(self, text: str) -> None:
        try:
            error = self.place.express(text)
        except GraphError as refused:
            error = str(refused)
        if not error:
            self._editing_expression = False
        self.finish(error)


def _html(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")
