"""The strip of the timeline: frames, the keys of every track, and the frame that is shown."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPalette, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from nodegraph.animation import Span, Track

LABELS = 150
HEAD = 30
ROW = 24
KEY = 5.0
STEPS = (1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10_000)


class Ruler(QWidget):
    """Draws the tracks. A drag on the scale sends `scrubbed`, a key dragged aside `key_moved`, a click `key_chosen`."""

    scrub_began = Signal()
    scrubbed = Signal(int)
    scrub_ended = Signal()
    key_chosen = Signal(object)  # (target, frame) or None
    key_moved = Signal(str, int, int)  # target, from frame, to frame

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.span = Span()
        self.tracks: list[Track] = []
        self.frame = 0
        self.chosen: tuple[str, int] | None = None
        self._drag = ""
        self._moving = 0
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        return QSize(480, HEAD + ROW * max(len(self.tracks), 2) + 4)

    def show_tracks(self, span: Span, tracks: list[Track], frame: int) -> None:
        """Draw these."""
        rows = len(self.tracks)
        self.span, self.tracks, self.frame = span, tracks, frame
        if self.chosen is not None and self.chosen not in {(t.target, k.frame) for t in tracks for k in t.keys}:
            self.chosen = None
        if rows != len(tracks):
            self.updateGeometry()
        self.update()

    # -- places ---------------------------------------------------------------------------------------------------

    def x_of(self, frame: float) -> float:
        """Where a frame stands."""
        count = max(self.span.last - self.span.first, 1)
        return LABELS + 12 + (frame - self.span.first) / count * (self.width() - LABELS - 24)

    def frame_at(self, x: float) -> int:
        """The frame that stands nearest, within the span."""
        count = max(self.span.last - self.span.first, 1)
        frame = self.span.first + round((x - LABELS - 12) / max(self.width() - LABELS - 24, 1) * count)
        return min(max(frame, self.span.first), self.span.last)

    def key_at(self, place: QPointF) -> tuple[str, int] | None:
        """The key under a place: target and frame."""
        row = int((place.y() - HEAD) // ROW)
        if not 0 <= row < len(self.tracks):
            return None
        keys = [(abs(self.x_of(key.frame) - place.x()), key.frame) for key in self.tracks[row].keys]
        distance, frame = min(keys, default=(99.0, 0))
        return (self.tracks[row].target, frame) if distance <= KEY + 3 else None

    # -- events ---------------------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette = self.palette()
        text, dim = palette.color(QPalette.ColorRole.Text), palette.color(QPalette.ColorRole.PlaceholderText)
        line, accent = palette.color(QPalette.ColorRole.Mid), palette.color(QPalette.ColorRole.Highlight)
        painter.fillRect(self.rect(), palette.color(QPalette.ColorRole.Base))
        painter.fillRect(QRectF(0, 0, self.width(), HEAD), palette.color(QPalette.ColorRole.Window))
        self._paint_scale(painter, dim, line)
        for row, track in enumerate(self.tracks):
            top = HEAD + row * ROW
            painter.setPen(line)
            painter.drawLine(QPointF(0, top + ROW), QPointF(self.width(), top + ROW))
            painter.setPen(text)
            label = self.fontMetrics().elidedText(track.target, Qt.TextElideMode.ElideMiddle, LABELS - 16)
            painter.drawText(QRectF(8, top, LABELS - 16, ROW), Qt.AlignmentFlag.AlignVCenter, label)
            self._paint_keys(painter, track, top + ROW / 2, text, accent, line)
        if not self.tracks:
            painter.setPen(dim)
            room = QRectF(LABELS, HEAD, self.width() - LABELS, self.height() - HEAD)
            painter.drawText(room, Qt.AlignmentFlag.AlignCenter, "Nothing moves yet. Add a key, or a turntable.")
        x = self.x_of(self.frame)
        painter.setPen(accent)
        painter.drawLine(QPointF(x, HEAD - 6), QPointF(x, self.height()))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(accent)
        head = [QPointF(x - 5, HEAD - 12), QPointF(x + 5, HEAD - 12), QPointF(x + 5, HEAD - 6), QPointF(x, HEAD - 1)]
        painter.drawPolygon(QPolygonF([*head, QPointF(x - 5, HEAD - 6)]))

    def _paint_scale(self, painter: QPainter, dim: QColor, line: QColor) -> None:
        room = max(self.width() - LABELS - 24, 1)
        count = max(self.span.last - self.span.first, 1)
        step = next((step for step in STEPS if step * room / count >= 48), STEPS[-1])
        painter.setPen(line)
        painter.drawLine(QPointF(LABELS, 0), QPointF(LABELS, self.height()))
        first = -(-self.span.first // step) * step
        for frame in range(first, self.span.last + 1, step):
            x = self.x_of(frame)
            painter.setPen(line)
            painter.drawLine(QPointF(x, HEAD - 5), QPointF(x, HEAD))
            painter.setPen(dim)
            painter.drawText(QRectF(x - 24, 1, 48, 16), Qt.AlignmentFlag.AlignCenter, str(frame))

    def _paint_keys(
        self, painter: QPainter, track: Track, y: float, text: QColor, accent: QColor, line: QColor
    ) -> None:
        painter.save()
        painter.setClipRect(QRectF(LABELS + 1, 0, self.width(), self.height()))
        for a, b in zip(track.keys, track.keys[1:], strict=False):
            painter.setPen(line)
            painter.drawLine(QPointF(self.x_of(a.frame), y), QPointF(self.x_of(b.frame), y))
        for key in track.keys:
            x = self.x_of(key.frame)
            chosen = self.chosen == (track.target, key.frame)
            painter.setPen(text if chosen else Qt.PenStyle.NoPen)
            painter.setBrush(accent)
            corners = [QPointF(x, y - KEY), QPointF(x + KEY, y), QPointF(x, y + KEY), QPointF(x - KEY, y)]
            painter.drawPolygon(QPolygonF(corners))
        painter.restore()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or event.position().x() < LABELS:
            return
        found = self.key_at(event.position())
        self.chosen = found
        self.key_chosen.emit(found)
        self.update()
        self._drag = "key" if found is not None else "scrub"
        if found is not None:
            self._moving = found[1]
        else:
            self.scrub_began.emit()
            self.scrubbed.emit(self.frame_at(event.position().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._drag == "scrub":
            self.scrubbed.emit(self.frame_at(event.position().x()))
        elif not self._drag:
            found = self.key_at(event.position())
            self.setCursor(Qt.CursorShape.PointingHandCursor if found else Qt.CursorShape.ArrowCursor)
            self.setToolTip(f"{found[0]} at frame {found[1]}" if found else "")

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        drag, self._drag = self._drag, ""
        if drag == "scrub":
            self.scrub_ended.emit()
        elif drag == "key" and self.chosen is not None:
            frame = self.frame_at(event.position().x())
            if frame != self._moving:
                target, self.chosen = self.chosen[0], (self.chosen[0], frame)
                self.key_moved.emit(target, self._moving, frame)
