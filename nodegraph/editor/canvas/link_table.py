"""The panel of what is shared: every variable with its expression, value, and the parameters that follow it."""

from __future__ import annotations

import json
from typing import Any

from PySide6.QtCore import QAbstractItemModel, QEvent, QModelIndex, QPersistentModelIndex, QPoint, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QHideEvent, QIcon, QKeyEvent, QPainter, QPixmap, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMenu,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.commands import Command
from nodegraph.editor.canvas.sharing import Shared, shared
from nodegraph.editor.parameters.look import complaint
from nodegraph.editor.session import Message, Session
from nodegraph.errors import ParameterError
from nodegraph.links import value_of
from nodegraph.variable_commands import RemoveVariable, RenameVariable, SetExpression, SetVariable, Unlink

NAME, EXPRESSION, VALUE, USERS = range(4)
COLUMNS = ("Variable", "Expression", "Value", "Followed by")
_PATH = Qt.ItemDataRole.UserRole
_USER = Qt.ItemDataRole.UserRole + 1


class LinkTable(QWidget):
    """A row for each variable; below it, the parameters that follow it. A click on one of these goes to its node."""

    marked = Signal(str)  # path of the variable that is selected, or empty

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.variables: dict[str, Shared] = {}
        self.refused: tuple[str, int, str] | None = None  # variable, column, and what was typed there
        self.summary = QLabel()
        self.summary.setProperty("dim", True)
        self.summary.setContentsMargins(10, 6, 10, 6)
        self.tree = QTreeWidget()
        self.tree.setAccessibleName("Links")
        self.tree.setUniformRowHeights(True)
        self.tree.setIndentation(16)
        self.tree.setHeaderLabels(list(COLUMNS))
        self.tree.setItemDelegate(_Cells(self))
        self.tree.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        self.tree.setExpandsOnDoubleClick(False)
        self.tree.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.tree.header().setStretchLastSection(True)
        self.tree.header().setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        for column, width in ((NAME, 190), (EXPRESSION, 190), (VALUE, 230)):
            self.tree.setColumnWidth(column, width)
        self.error = complaint()
        self.error.setContentsMargins(10, 4, 10, 6)
        self.error.hide()
        box = QVBoxLayout(self)
        box.setContentsMargins(0, 0, 0, 0)
        box.setSpacing(0)
        for widget, stretch in ((self.summary, 0), (self.tree, 1), (self.error, 0)):
            box.addWidget(widget, stretch)
        self.tree.itemClicked.connect(self._click)
        self.tree.itemSelectionChanged.connect(self._mark)
        self.tree.customContextMenuRequested.connect(self._open_menu)
        self.tree.installEventFilter(self)
        self._soon = QTimer(self, singleShot=True, interval=0)
        self._soon.timeout.connect(self.refresh)
        session.changed.connect(self._on_change)
        session.replaced.connect(self._start_over)
        self.refresh()

    # -- showing ------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show what the document has now."""
        self._soon.stop()
        found = {one.path: one for one in shared(self.session.network)}
        if [(one.path, one.users) for one in found.values()] != [
            (one.path, one.users) for one in self.variables.values()
        ]:
            self._build(found)
        self.variables = found
        for item in self._tops():
            self._write(item, found[item.data(NAME, _PATH)])
        count = sum(len(one.users) for one in found.values())
        self.summary.setText(
            f"{len(found)} variable{'s' * (len(found) != 1)}, followed by {count} parameter{'s' * (count != 1)}"
            if found
            else "Nothing is shared. Right-click a parameter to let it follow a variable, and others with it."
        )

    def _build(self, found: dict[str, Shared]) -> None:
        """Make all rows anew; what was open and current stays so."""
        closed = {item.data(NAME, _PATH) for item in self._tops() if not item.isExpanded()}
        current = self.current
        self.tree.blockSignals(True)
        self.tree.clear()
        for one in found.values():
            item = QTreeWidgetItem(self.tree)
            item.setData(NAME, _PATH, one.path)
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
            for user in one.users:
                child = QTreeWidgetItem(item, [user])
                child.setData(NAME, _PATH, one.path)
                child.setData(NAME, _USER, user)
                child.setToolTip(NAME, f"Go to {user.rpartition('.')[0]}")
            item.setExpanded(one.path not in closed)
            if one.path == current:
                self.tree.setCurrentItem(item)
        self.tree.blockSignals(False)
        if current not in found:
            self._mark()

    def _write(self, item: QTreeWidgetItem, one: Shared) -> None:
        texts = (one.path, one.expression, one.trouble or one.value, ", ".join(one.users) or "nobody yet")
        for column, text in enumerate(texts):
            if item.text(column) != text:
                item.setText(column, text)
                item.setToolTip(column, text)
        item.setIcon(NAME, _swatch(one.color))
        item.setToolTip(
            NAME, f"{one.path}, a {one.kind}" + (f"; {', '.join(one.derived)} of it" if one.derived else "")
        )
        item.setForeground(VALUE, QColor("#d9534f") if one.trouble else self.palette().text())

    def _on_change(self, commands: list[Command]) -> None:
        if any(command.touched or command.structural for command in commands) or any(
            isinstance(command, (RenameVariable, RemoveVariable, SetExpression)) for command in commands
        ):
            self.show_error("")
            if self.isVisible():
                self._soon.start()

    def _start_over(self) -> None:
        self.show_error("")
        self.refresh()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()
        self._mark()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self.marked.emit("")

    def show_error(self, text: str) -> None:
        """Say below the table why an entry was refused; an empty text ends that."""
        if not text:
            self.refused = None
        self.error.setText(text)
        self.error.setVisible(bool(text))

    # -- changing -----------------------------------------------------------------------------------------------

    def enter(self, path: str, column: int, text: str) -> bool:
        """Take what was typed into a cell of a variable. False where it is refused, and said why."""
        one, text = self.variables[path], text.strip()
        if column == NAME:
            new = text.rpartition("/")[2]
            return new == one.name or self._do(RenameVariable(path, new), path, column, text)
        if column == EXPRESSION:
            text = text.removeprefix("=").strip()
            return text == one.expression or self._do(SetExpression(path, text), path, column, text)
        if text == one.value:
            return True
        try:
            value = json.loads(text)
        except (json.JSONDecodeError, RecursionError):
            value = text
        return self._do(SetVariable(path, value, encoded=True), path, column, text)

    def shown_text(self, path: str, column: int) -> str:
        """What the field of a cell begins with: what was refused there last, else what the document has."""
        if self.refused is not None and self.refused[:2] == (path, column):
            return self.refused[2]
        one = self.variables[path]
        if column == VALUE:
            return self._whole_value(path)
        return one.path if column == NAME else one.expression

    def can_enter(self, path: str, column: int) -> bool:
        """Whether a cell takes typing: everything but who follows, and values that are no numbers and no text."""
        return column in (NAME, EXPRESSION) or (column == VALUE and self.variables[path].plain)

    def remove(self, path: str) -> None:
        """Remove a variable; those that followed keep its value."""
        self._do(RemoveVariable(path), path, NAME, "")

    def unlink(self, user: str) -> None:
        """Let one parameter follow no longer."""
        self._do(Unlink(user), "", USERS, "")

    def _whole_value(self, path: str) -> str:
        try:
            value = value_of(self.session.network, path) if "/" not in path else None
        except ParameterError:
            value = None
        if isinstance(value, (bool, int, float, str, tuple, list)):
            return json.dumps(value, ensure_ascii=False)
        return self.variables[path].value

    def _do(self, command: Command, path: str, column: int, text: str) -> bool:
        said: list[str] = []

        def listen(message: Message) -> None:
            said.append(message.text)

        self.session.message.connect(listen)
        try:
            done = self.session.do(command)
        finally:
            self.session.message.disconnect(listen)
        if done:
            self.refresh()
        else:
            self.refused = (path, column, text)
            self.show_error(said[-1] if said else f"{path}: this was refused")
        return done

    # -- mouse and keys -----------------------------------------------------------------------------------------

    def _tops(self) -> list[QTreeWidgetItem]:
        items = (self.tree.topLevelItem(i) for i in range(self.tree.topLevelItemCount()))
        return [item for item in items if item is not None]

    def _path(self, item: QTreeWidgetItem | None) -> str:
        return str(item.data(NAME, _PATH)) if item is not None else ""

    @property
    def current(self) -> str:
        """Path of the variable that is selected, or of which a follower is; empty where none is."""
        return next((self._path(item) for item in self.tree.selectedItems()), "")

    def _mark(self) -> None:
        self.marked.emit(self.current)

    def _click(self, item: QTreeWidgetItem) -> None:
        user = item.data(NAME, _USER)
        if user:
            self.go_to(user.rpartition(".")[0])

    def go_to(self, path: str) -> None:
        """Show a node on the canvas, selected."""
        if path in self.session.network:
            self.session.enter(path.rpartition("/")[0])
            self.session.select(path)

    def menu_for(self, item: QTreeWidgetItem) -> QMenu:
        """The menu of a variable, or of a parameter that follows it."""
        menu, path, user = QMenu(self), self._path(item), item.data(NAME, _USER)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        if user:
            menu.addAction("Go to the node").triggered.connect(lambda: self.go_to(user.rpartition(".")[0]))
            menu.addAction("Follow no longer").triggered.connect(lambda: self.unlink(user))
            return menu
        menu.addAction("Rename").triggered.connect(lambda: self.tree.editItem(item, NAME))
        menu.addAction("Edit the expression").triggered.connect(lambda: self.tree.editItem(item, EXPRESSION))
        if self.variables[path].expression:
            menu.addAction("Make it plain").triggered.connect(lambda: self.enter(path, EXPRESSION, ""))
        menu.addSeparator()
        menu.addAction("Remove").triggered.connect(lambda: self.remove(path))
        return menu

    def _open_menu(self, where: QPoint) -> None:
        item = self.tree.itemAt(where)
        if item is not None:
            self.menu_for(item).popup(self.tree.viewport().mapToGlobal(where))

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        item = self.tree.currentItem()
        if event.type() != QEvent.Type.KeyPress or not isinstance(event, QKeyEvent) or item is None:
            return super().eventFilter(watched, event)
        user = item.data(NAME, _USER)
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and user:
            self.go_to(user.rpartition(".")[0])
        elif event.key() == Qt.Key.Key_Delete:
            self.unlink(user) if user else self.remove(self._path(item))
        else:
            return super().eventFilter(watched, event)
        return True


class _Cells(QStyledItemDelegate):
    """Edits cells; what is typed goes to the document, never into the table."""

    def __init__(self, table: LinkTable) -> None:
        super().__init__(table)
        self.table = table

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> QWidget:
        if index.parent().isValid() or not self.table.can_enter(_variable_of(index), index.column()):
            return None  # type: ignore[return-value]  # no field: the cell is only read
        field = QLineEdit(parent)
        field.setFrame(False)
        return field

    def setEditorData(self, editor: QWidget, index: QModelIndex | QPersistentModelIndex) -> None:
        assert isinstance(editor, QLineEdit)
        editor.setText(self.table.shown_text(_variable_of(index), index.column()))
        editor.selectAll()

    def setModelData(
        self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        assert isinstance(editor, QLineEdit)
        self.table.enter(_variable_of(index), index.column(), editor.text())


def _variable_of(index: QModelIndex | QPersistentModelIndex) -> str:
    return str(index.sibling(index.row(), NAME).data(_PATH))


def _swatch(color: str) -> QIcon:
    """A disc in a colour."""
    picture = QPixmap(20, 20)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(color))
    painter.drawEllipse(4, 4, 12, 12)
    painter.end()
    return QIcon(picture)
