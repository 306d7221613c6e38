"""Somebody who knows nothing and tries everything: one random thing after another, anywhere in the window."""

from __future__ import annotations

import difflib
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import shiboken6
from PySide6.QtCore import QEvent, QObject, QPoint, Qt, QTimer
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QDialog,
    QDialogButtonBox,
    QDockWidget,
    QFileDialog,
    QMenu,
    QMessageBox,
    QWidget,
)

from nodegraph import Network, workspace
from nodegraph.editor.arrangement import LAYOUT
from nodegraph.editor.parameters.row import FOLDED
from nodegraph.editor.window import Window
from tests.editor.proof import hand

TYPES = ("filter.gaussian_blur", "render.slice", "image.compose", "output.view", "filter.gradient", "image.background")
WORDS = ("1", "0.5", "-3", "1e9", "abc", "blur", "net", "view", "", "12", "x", "nan", "2*3", "#ff8000")
KEYS = (
    "Tab Shift+Tab Esc Return Space Up Down Left Right Home End PgUp PgDown Del Backspace F2 F F5 F11 M N L 1 3 5 7 "
    "Shift+A Shift+L Alt+Left Shift+Right Ctrl+Z Ctrl+Z Ctrl+Shift+Z Ctrl+C Ctrl+X Ctrl+V Ctrl+D Ctrl+G Ctrl+Shift+G "
    "Ctrl+A Ctrl+F Ctrl+M Ctrl+K F1 Ctrl+N Ctrl+S Ctrl+O Ctrl+Alt+S Ctrl+Alt+F Ctrl+Shift+S Ctrl+1 Ctrl+7"
).split()
NODES = 14
"""More nodes than these are not added: what the monkey proves does not depend on how many there are."""


class Stays(QObject):
    """Keeps a window open, whatever is pressed in it."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Close:
            event.ignore()
            return True
        return super().eventFilter(watched, event)


def text_of(network: Network) -> str:
    """A document as it would be saved, without where panels are and what is folded: no steps anybody would undo."""
    kept = {key: network.ui.pop(key) for key in (LAYOUT, FOLDED) if key in network.ui}
    text = workspace.dumps(network)
    network.ui.update(kept)
    return text


def difference(one: str, other: str) -> str:
    """The lines in which two texts differ."""
    return "\n".join(difflib.unified_diff(one.splitlines(), other.splitlines(), lineterm="", n=1))


class Monkey:
    """Does one thing at a time. `log` says what, so that a failure can be read.

    folder: where everything that it saves goes; workspaces in it are what it opens.
    """

    def __init__(self, window: Window, folder: Path, seed: int) -> None:
        self.window, self.folder = window, folder
        self.rng = random.Random(seed)
        self.log: list[str] = []
        self.documents = 0
        self._stays = Stays()
        window.installEventFilter(self._stays)
        self._acting = 0
        self._rescued = 0
        self._timer = QTimer(window)
        self._timer.timeout.connect(self._rescue)
        self._timer.start(100)
        self._seen = -1
        window.session.replaced.connect(self._replaced)
        self._begin()
        self.actions: list[Callable[[], object]] = [
            self.click, self.click, self.click, self.double_click, self.menu_button, self.drag, self.drag, self.wheel,
            self.key, self.key, self.key, self.write, self.canvas_drag, self.canvas_drag, self.wire, self.wire,
            self.command, self.command, self.add, self.add, self.choose, self.choose, self.parameter, self.parameter,
            self.undo, self.redo, self.dock, self.tab, self.turn, self.open, self.save, self.theme, self.resize,
        ]  # fmt: skip

    # -- the document and its history -------------------------------------------------------------------------------

    def _begin(self) -> None:
        self.network = self.window.session.network
        self.first = text_of(self.network)

    def _replaced(self) -> None:
        self.check_history()
        self._begin()

    def check_history(self) -> None:
        """Undo everything: the document is what it was at first. Redo everything: it is what it became."""
        self.documents += 1
        history = self.network.history
        if history._gesture is not None:
            history.cancel()
        steps = 0
        while history.redo_name:  # to the newest state
            history.redo()
        last = text_of(self.network)
        while history.undo_name:
            history.undo()
            steps += 1
        found = text_of(self.network)
        assert found == self.first, f"undo of {steps} steps: {difference(self.first, found)}"
        for _ in range(steps):
            history.redo()
        assert text_of(self.network) == last, f"redo of {steps} steps"

    # -- one thing --------------------------------------------------------------------------------------------------

    def step(self) -> None:
        """Do something."""
        self._acting += 1
        if QApplication.activePopupWidget() is not None:
            self.popup()
        elif QApplication.activeModalWidget() is not None:
            self.dialog()
        else:
            self.rng.choice(self.actions)()
        QApplication.processEvents()

    def note(self, *what: Any) -> None:
        self.log.append(" ".join(str(part) for part in what))

    def _rescue(self) -> None:
        """Where something waits in a loop of its own (a drag, a file dialog of Qt's), go on from inside of it."""
        if self._seen != self._acting:
            self._seen = self._acting
            return
        popup, modal = QApplication.activePopupWidget(), QApplication.activeModalWidget()
        if popup is not None:
            popup.close()
        elif isinstance(modal, QDialog):
            modal.reject()
        elif self.window.windowHandle() is not None:
            QTest.mouseRelease(self.window.windowHandle(), hand.LEFT, hand.NONE, self.spot(self.window))

    def popup(self) -> None:
        """Something in the menu that is open, or away with it."""
        popup = QApplication.activePopupWidget()
        if isinstance(popup, QMenu) and self.rng.random() < 0.7:
            found = [action for action in popup.actions() if action.isEnabled() and action.isVisible()]
            if found:
                action = self.rng.choice(found)
                self.note("menu", action.text())
                hand.click(popup, popup.actionGeometry(action).center())
                return
        if self.rng.random() < 0.5 and popup is not None:
            self.note("popup", type(popup).__name__)
            hand.click(popup, self.spot(popup))
        popup = QApplication.activePopupWidget()
        if popup is not None:
            hand.key(popup, Qt.Key.Key_Escape)
        popup = QApplication.activePopupWidget()
        if popup is not None:
            popup.close()

    def dialog(self) -> None:
        """Answer what is asked; files go into the folder."""
        box = QApplication.activeModalWidget()
        assert box is not None
        self.note("dialog", type(box).__name__, box.windowTitle())
        if isinstance(box, QFileDialog):
            saving = box.acceptMode() == QFileDialog.AcceptMode.AcceptSave
            name = f"saved{self.rng.randrange(3)}.json" if saving else self.rng.choice(self.files()).name
            if self.rng.random() < 0.5:
                box.fileSelected.emit(str(self.folder / name))
            box.reject()
        elif isinstance(box, QMessageBox):
            hand.click(self.rng.choice(box.buttons()))
        elif self.rng.random() < 0.6:
            inside = [child for child in box.findChildren(QWidget) if child.isVisible()]
            widget = self.rng.choice(inside)
            hand.click(widget, self.spot(widget))
            if QApplication.activeModalWidget() is box:
                hand.write(box, self.rng.choice(WORDS))
        else:
            buttons: list[QAbstractButton] = []
            for group in box.findChildren(QDialogButtonBox):
                buttons += group.buttons()
            pressed = [button for button in buttons if button.isVisible() and button.isEnabled()]
            if pressed and self.rng.random() < 0.5:
                hand.click(self.rng.choice(pressed))
            elif isinstance(box, QDialog):
                box.reject()
            else:
                box.close()

    # -- anywhere ---------------------------------------------------------------------------------------------------

    def spot(self, widget: QWidget) -> QPoint:
        return QPoint(self.rng.randrange(max(1, widget.width())), self.rng.randrange(max(1, widget.height())))

    def widget(self) -> QWidget:
        """A visible widget: first which part of the window, then which widget of it."""
        window = self.window
        parts = [window.middle, window.bar, window.menuBar(), *(dock for dock in self.docks() if dock.isVisible())]
        part = self.rng.choice(parts)
        inside = [child for child in part.findChildren(QWidget) if self.reachable(child)]
        return self.rng.choice(inside) if inside and self.rng.random() < 0.9 else part

    def reachable(self, widget: QWidget) -> bool:
        home = widget.window()
        if not widget.isVisible() or widget.visibleRegion().isEmpty() or home.windowHandle() is None:
            return False
        return home is self.window or (isinstance(home, QDockWidget) and home.parentWidget() is self.window)

    def docks(self) -> list[QDockWidget]:
        return [dock for dock in self.window.findChildren(QDockWidget) if shiboken6.isValid(dock)]

    def click(self) -> None:
        widget = self.widget()
        button = self.rng.choice([hand.LEFT, hand.LEFT, hand.LEFT, hand.MIDDLE, hand.RIGHT])
        self.note("click", named(widget), button.name)
        hand.click(widget, self.spot(widget), button)

    def double_click(self) -> None:
        widget = self.widget()
        self.note("double click", named(widget))
        hand.double_click(widget, self.spot(widget))

    def menu_button(self) -> None:
        widget = self.widget()
        self.note("right click", named(widget))
        hand.click(widget, self.spot(widget), hand.RIGHT)
        if shiboken6.isValid(widget) and widget.isVisible():
            from PySide6.QtGui import QContextMenuEvent

            at = self.spot(widget)
            event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, widget.mapToGlobal(at))
            QApplication.sendEvent(widget, event)

    def drag(self) -> None:
        widget = self.widget()
        button = self.rng.choice([hand.LEFT, hand.LEFT, hand.MIDDLE, hand.RIGHT])
        self.note("drag", named(widget), button.name)
        hand.drag(widget, self.spot(widget), self.spot(widget), button, self.modifier())

    def wheel(self) -> None:
        widget = self.widget()
        self.note("wheel", named(widget))
        hand.wheel(widget, self.spot(widget), self.rng.choice([-2, -1, 1, 2]), self.modifier())

    def modifier(self) -> Qt.KeyboardModifier:
        some = Qt.KeyboardModifier
        return self.rng.choice([hand.NONE, hand.NONE, some.ShiftModifier, some.ControlModifier, some.AltModifier])

    def key(self) -> None:
        keys = self.rng.choice(KEYS)
        self.note("key", keys)
        both = QKeySequence(keys)[0]
        if not (keys in ("Ctrl+V", "Ctrl+D") and self.many()):
            hand.key(self.window, both.key(), both.keyboardModifiers())

    def write(self) -> None:
        word = self.rng.choice(WORDS)
        self.note("write", word)
        hand.write(self.window, word)
        if self.rng.random() < 0.5:
            hand.key(self.window, Qt.Key.Key_Return)

    # -- with a purpose ---------------------------------------------------------------------------------------------

    def many(self) -> bool:
        return sum(1 for _ in self.window.session.network.walk()) >= NODES

    def add(self) -> None:
        if not self.many():
            id = self.rng.choice(TYPES)
            self.note("add", id)
            self.window.add_processor(id)

    def choose(self) -> None:
        nodes = [node.path for node in self.window.session.network.walk()]
        if nodes:
            path = self.rng.choice(nodes)
            self.note("choose", path)
            self.window.go_to(path)

    def canvas_drag(self) -> None:
        viewport = self.window.canvas.view.viewport()
        if viewport.isVisible():
            items = list(self.window.canvas.scene.nodes.values())
            start = self.spot(viewport)
            if items:
                item = self.rng.choice(items)
                start = self.window.canvas.view.mapFromScene(item.pos()) + QPoint(30, 12)
            self.note("canvas drag", start, items and item.path)
            hand.drag(viewport, start, self.spot(viewport), keys=self.modifier())

    def wire(self) -> None:
        canvas = self.window.canvas
        viewport = canvas.view.viewport()
        ends = [
            item.anchor(port.output, port.name)
            for item in canvas.scene.nodes.values()
            for port in (*item.face.inputs, *item.face.outputs)
        ]
        if viewport.isVisible() and len(ends) > 1:
            canvas.fit()
            one, other = (canvas.view.mapFromScene(end) for end in self.rng.sample(ends, 2))
            self.note("wire", one, other)
            hand.drag(viewport, one, other if self.rng.random() < 0.8 else self.spot(viewport))

    def command(self) -> None:
        """One of the commands of the menus, or of the palette of commands."""
        actions = [action for action in self.window.actions_by_name.values() if action.isEnabled()]
        action = self.rng.choice(actions)
        if action.objectName() not in ("paste", "duplicate") or not self.many():
            self.note("command", action.objectName())
            action.trigger()

    def parameter(self) -> None:
        """A click, a drag or a number in the panel of parameters."""
        panel = self.window.parameters
        inside = [child for child in panel.findChildren(QWidget) if self.reachable(child)]
        if inside:
            widget = self.rng.choice(inside)
            self.note("parameter", named(widget))
            if self.rng.random() < 0.5:
                hand.drag(widget, self.spot(widget), self.spot(widget))
            else:
                hand.click(widget, self.spot(widget))
                hand.write(self.window, self.rng.choice(WORDS))
                hand.key(self.window, Qt.Key.Key_Return)

    def undo(self) -> None:
        self.note("undo")
        self.window.undo()

    def redo(self) -> None:
        self.note("redo")
        self.window.redo()

    def dock(self) -> None:
        """Move a panel: torn off, to another side, closed, shown, dragged by its title."""
        dock = self.rng.choice(self.docks())
        what = self.rng.choice(["float", "move", "tab", "close", "show", "show", "drag"])
        self.note("dock", what, dock.objectName())
        if what == "float":
            dock.setFloating(not dock.isFloating())
        elif what == "move":
            dock.setFloating(False)
            self.window.addDockWidget(self.rng.choice(list(Qt.DockWidgetArea)[:4]), dock)
        elif what == "tab":
            other = self.rng.choice(self.docks())
            if other is not dock:
                self.window.tabifyDockWidget(other, dock)
        elif what == "drag" and dock.isVisible() and self.reachable(dock):
            hand.drag(dock, QPoint(20, 8), QPoint(20, 8) + self.spot(self.window) - self.spot(self.window))
        else:
            dock.setVisible(what == "show")

    def tab(self) -> None:
        """Bring a panel to the front."""
        dock = self.rng.choice(list(self.window.docks.values()))
        self.note("front", dock.objectName())
        dock.show()
        dock.raise_()

    def turn(self) -> None:
        """Drag in a view."""
        views = [dock.view.area for dock in self.window.views if self.reachable(dock.view.area)]
        if views:
            area = self.rng.choice(views)
            self.note("turn")
            button = self.rng.choice([hand.LEFT, hand.MIDDLE, hand.RIGHT])
            hand.drag(area, self.spot(area), self.spot(area), button, self.modifier())

    def files(self) -> list[Path]:
        return sorted(self.folder.glob("*.json"))

    def open(self) -> None:
        if self.rng.random() < 0.3:
            file = self.rng.choice(self.files())
            self.note("open", file.name)
            self.window.open_file(file)

    def save(self) -> None:
        self.note("save")
        self.window.save()

    def theme(self) -> None:
        if self.rng.random() < 0.1:
            self.note("theme")
            self.window.toggle_theme()

    def resize(self) -> None:
        self.note("resize")
        self.window.resize(self.rng.choice([700, 900, 1100]), self.rng.choice([500, 650, 800]))

    def end(self) -> None:
        """Close what is open and let go."""
        for _ in range(20):
            popup, modal = QApplication.activePopupWidget(), QApplication.activeModalWidget()
            if popup is not None:
                popup.close()
            elif isinstance(modal, QDialog):
                modal.reject()
            QApplication.processEvents()
        self._timer.stop()
        self.window.session.replaced.disconnect(self._replaced)
        self.window.session.cancel()
        self.window.removeEventFilter(self._stays)


def named(widget: QWidget) -> str:
    """The class of a widget with the names around it, for the log."""
    names = []
    at: QObject | None = widget
    while at is not None and not isinstance(at, QDockWidget):
        names.append(at.objectName() or type(at).__name__)
        at = at.parent()
    return "<".join(names[:4]) + (f" in {at.objectName()}" if at is not None else "")
