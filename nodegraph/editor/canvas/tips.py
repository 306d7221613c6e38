"""What the canvas shows of what the mouse rests on: words at once, and what there is to see of a value soon after."""

from __future__ import annotations

import weakref
from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from typing import Any

from PySide6.QtCore import QEvent, QObject, QPoint
from PySide6.QtWidgets import QWidget

from nodegraph.data.value import Value
from nodegraph.editor.canvas.faces import Port
from nodegraph.editor.canvas.preview_card import PreviewCard
from nodegraph.editor.canvas.scene import CanvasScene
from nodegraph.editor.canvas.told import node_tip, port_tip, shown_value
from nodegraph.editor.previews import Preview

KEPT = 32
"""Previews that are kept, the ones seen last."""


class Known:
    """Previews by value. It holds no value: one that is gone is forgotten."""

    def __init__(self) -> None:
        self._made: OrderedDict[int, tuple[weakref.ref[Any], Preview]] = OrderedDict()

    def get(self, value: Any) -> Preview | None:
        found = self._made.get(id(value))
        if found is None or found[0]() is not value:
            return None
        self._made.move_to_end(id(value))
        return found[1]

    def keep(self, value: Any, preview: Preview) -> None:
        self._made[id(value)] = (weakref.ref(value), preview)
        while len(self._made) > KEPT:
            self._made.popitem(last=False)


class Tips(QObject):
    """Shows the tips of one view. Nothing is evaluated for them: they show values that exist."""

    def __init__(self, scene: CanvasScene, viewport: QWidget) -> None:
        super().__init__(viewport)
        self.scene = scene
        self.card = PreviewCard(viewport)
        self.subject: object = None  # what the mouse rests on: (id, port) or a wire
        self.preview: Preview | None = None
        self._known = Known()
        self._cancel: Callable[[], None] | None = None
        self._told: Callable[[], str] | None = None  # the words
        self._wanted: Callable[[], Any] | None = None  # the value
        self._value: weakref.ref[Any] | None = None  # that is shown, or on its way
        viewport.installEventFilter(self)
        scene.leaving.connect(self.hide)
        scene.session.values_changed.connect(self._renew)

    @property
    def text(self) -> str:
        """The words that are shown, empty where nothing is."""
        return self.card.words.text() if self.card.isVisible() else ""

    def show(self, where: QPoint, subject: object, id: str, port: Port | None) -> None:
        """Show what is known of a node or of one of its ports at a point of the screen."""
        self.hide()
        session, node = self.scene.session, self.scene.level.nodes[id]
        self.subject = subject
        if port is None:
            self._told = partial(node_tip, session, node, self.scene.standing)
            self.card.show_words(where, self._told())
            return
        self._told = partial(port_tip, session, node, port)
        self._wanted = partial(shown_value, session, node, port)
        self.card.show_words(where, self._told())
        self._ask()

    def _ask(self) -> None:
        """Show what there is to see of the value at the port, now or as soon as it is made."""
        self._stop()
        value = self._wanted() if self._wanted is not None else None
        if not isinstance(value, Value):
            return  # a number says all in the words
        self._value = weakref.ref(value)
        known = self._known.get(value)
        if known is not None:
            self._add(known)
        else:
            self._cancel = self.scene.session.preview(value, partial(self._take, self._value))

    def _renew(self, _paths: object) -> None:
        """Values are known anew while the mouse rests: what is shown of the old one stays until the new one is made."""
        if self.subject is None or self._told is None:
            return
        self.card.words.setText(self._told())
        value = self._wanted() if self._wanted is not None else None
        if self._wanted is not None and (self._value is None or self._value() is not value):
            self._ask()

    def say(self, where: QPoint, subject: object, text: str) -> None:
        """Show words alone; without any, nothing."""
        self.hide()
        if text:
            self.subject = subject
            self.card.show_words(where, text)

    def stay(self, subject: object) -> None:
        """The mouse is on this now: what is shown of anything else goes."""
        if self.subject is not None and subject != self.subject:
            self.hide()

    def hide(self) -> None:
        """Show nothing, and make nothing that was begun."""
        self._stop()
        self.subject = self.preview = self._told = self._wanted = self._value = None
        self.card.hide()

    def _stop(self) -> None:
        if self._cancel is not None:
            self._cancel()
            self._cancel = None

    def _take(self, value: weakref.ref[Any], made: Preview | None) -> None:
        self._cancel = None
        there = value()
        if made is None:
            made = Preview(lines=("No picture of it could be made.",))
        elif there is not None:
            self._known.keep(there, made)
        self._add(made)

    def _add(self, made: Preview) -> None:
        self.preview = made
        if self._told is not None:
            self.card.words.setText(self._told())  # the range of a volume is known by now
        self.card.add(made)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in _ENDS:
            self.hide()
        return False


_ENDS = (QEvent.Type.Leave, QEvent.Type.MouseButtonPress, QEvent.Type.Wheel, QEvent.Type.Hide)
