"""Time and memory of every node in the last evaluation."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPalette
from PySide6.QtWidgets import (
    QHeaderView,
    QLabel,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor.session import Session
from nodegraph.report import Report

_SHARE = Qt.ItemDataRole.UserRole
_PATH = Qt.ItemDataRole.UserRole + 1
COLUMNS = ("Node", "Time", "On the device", "Memory", "")


class Profile(QWidget):
    """A row for each node, the dearest first; below a node, the intermediates that it kept. A click selects it."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.summary = QLabel()
        self.summary.setProperty("dim", True)
        self.summary.setContentsMargins(10, 6, 10, 6)
        self.tree = QTreeWidget()
        self.tree.setUniformRowHeights(True)
        self.tree.setIndentation(14)
        self.tree.setHeaderLabels(list(COLUMNS))
        self.tree.setItemDelegateForColumn(4, _Bar(self.tree))
        header = self.tree.header()
        header.setStretchLastSection(True)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        for column in (1, 2, 3):
            self.tree.setColumnWidth(column, 104)
            self.tree.headerItem().setTextAlignment(column, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.summary)
        layout.addWidget(self.tree, 1)
        self.tree.itemClicked.connect(self._go)
        session.answered.connect(self._answered)
        session.replaced.connect(lambda: self.show_report(Report()))
        self.show_report(session.report)

    def _answered(self, channel: object, report: Report) -> None:
        if self.session.watches(channel):
            self.show_report(report)

    def show_report(self, report: Report) -> None:
        """Show what an evaluation took."""
        self.tree.clear()
        if not report.states:
            self.summary.setText("Nothing was computed yet.")
            return
        nodes = {path: report.timings.get(path, 0.0) for path in report.states}
        memos = {label: seconds for label, seconds in report.timings.items() if label not in nodes}
        total = sum(nodes.values())
        memory = sum(report.bytes.get(path, 0) for path in nodes)
        ran = sum(path in report.timings for path in nodes)
        if not ran:
            self.summary.setText(f"Nothing had to be computed: {len(nodes)} nodes were kept from before")
        else:
            self.summary.setText(
                f"{seconds_text(total)} in {ran} node{'s' * (ran != 1)}, {len(nodes) - ran} kept from before, "
                f"{bytes_text(memory)} made"
            )
        for path, seconds in sorted(nodes.items(), key=lambda item: -item[1]):
            item = self._row(report, self.tree, path, path, seconds if path in report.timings else None, total)
            for label, cost in memos.items():
                if label.rpartition("/")[0] == path:
                    self._row(report, item, path, label.rpartition("/")[2], cost, total, label)
        self.tree.expandAll()

    def _row(
        self,
        report: Report,
        parent: QTreeWidget | QTreeWidgetItem,
        path: str,
        name: str,
        seconds: float | None,
        total: float,
        label: str = "",
    ) -> QTreeWidgetItem:
        label = label or path
        state = str(report.states.get(path, ""))
        time = seconds_text(seconds) if seconds is not None else ("kept" if state == "clean" else state)
        device = report.device_seconds.get(label)
        size = report.bytes.get(label)
        item = QTreeWidgetItem(
            [name, time, seconds_text(device) if device else "", bytes_text(size) if size is not None else "", ""]
        )
        for column in (1, 2, 3):
            item.setTextAlignment(column, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        item.setData(4, _SHARE, (seconds or 0.0) / total if total else 0.0)
        item.setData(0, _PATH, path)
        if isinstance(parent, QTreeWidget):
            parent.addTopLevelItem(item)
        else:
            parent.addChild(item)
        return item

    def _go(self, item: QTreeWidgetItem) -> None:
        path = item.data(0, _PATH)
        if path in self.session.network:
            self.session.enter(path.rpartition("/")[0])
            self.session.select(path)


class _Bar(QStyledItemDelegate):
    """A bar whose length is the share of the whole time."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        share = float(index.data(_SHARE) or 0.0)
        room = QRectF(option.rect).adjusted(12, 7, -12, -7)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        color = QColor(option.palette.color(QPalette.ColorRole.Highlight))
        color.setAlphaF(0.75)
        painter.setBrush(color)
        if share > 0.0:
            room.setWidth(max(2.0, min(room.width(), 360.0) * share))
            painter.drawRoundedRect(room, 2, 2)
        painter.restore()


def seconds_text(seconds: float) -> str:
    """A duration with three figures: 12.3 ms."""
    if seconds >= 1.0:
        return f"{seconds:.2f} s"
    return f"{seconds * 1e3:.1f} ms" if seconds >= 1e-3 else f"{seconds * 1e6:.0f} µs"


def bytes_text(size: int) -> str:
    """A number of bytes in the unit that suits it: 24.1 MB."""
    value = float(size)
    for unit in ("B", "kB", "MB"):
        if value < 1000.0:
            return f"{value:.0f} {unit}" if unit == "B" else f"{value:.1f} {unit}"
        value /= 1000.0
    return f"{value:.2f} GB"
