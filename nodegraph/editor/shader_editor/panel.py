"""The kernels of the selected node and all others, as text that can be changed."""

from __future__ import annotations

import os
import re
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from nodegraph import locations
from nodegraph.editor.buttons import flat_button
from nodegraph.editor.reloading import Reloader
from nodegraph.editor.session import Message, Session
from nodegraph.editor.shader_editor.code import CodeEdit
from nodegraph.editor.shader_editor.copying import copy_and_use
from nodegraph.errors import GraphError
from nodegraph.kernel_sources import kernel_source
from nodegraph.network import Node
from nodegraph.reloading import Outcome

_PLACE = re.compile(r"([\w./-]+\.glsl):(\d+): (.*)")


class ShaderPanel(QWidget):
    """One file at a time. What is saved is tried at once; lines that fail are marked, and the old text goes on."""

    opened = Signal(object)  # Path

    def __init__(self, session: Session, reloader: Reloader) -> None:
        super().__init__()
        self.session = session
        self.reloader = reloader
        self.path: Path | None = None
        self._told: dict[int, str] = {}
        self.files = QComboBox()
        self.files.setAccessibleName("Shader file")
        self.files.setMinimumContentsLength(16)
        self.files.setMaxVisibleItems(30)
        self.files.activated.connect(self._chosen)
        self.code = CodeEdit()
        self.code.setAccessibleName("Shader")
        self.save_it = flat_button("Save", "Save and see it in the picture (Ctrl+S)", self.save)
        self.revert_it = flat_button("Revert", "Take the text that is in the file", self.revert)
        self.copy_it = flat_button("Copy to my plug-ins", "Make a processor of your own with this text", self.copy)
        self.state = QLabel()
        self.state.setProperty("dim", True)
        self.state.setWordWrap(True)
        self.state.setContentsMargins(10, 4, 10, 6)
        self.state.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        row = QHBoxLayout()
        row.setContentsMargins(8, 6, 6, 6)
        row.setSpacing(4)
        row.addWidget(self.files, 1)
        for button in (self.save_it, self.revert_it, self.copy_it):
            row.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(row)
        layout.addWidget(self.code, 1)
        layout.addWidget(self.state)
        self.code.save_asked.connect(self.save)
        self.code.document().modificationChanged.connect(lambda _changed: self._enable())
        session.selected.connect(self._follow)
        session.replaced.connect(self._fill)
        session.message.connect(self._hear)
        reloader.looked.connect(self._looked)
        reloader.mended.connect(lambda _place: self._mark())
        self._fill()
        self._enable()

    # -- files ------------------------------------------------------------------------------------------------------

    @property
    def modified(self) -> bool:
        """Whether the text differs from the file."""
        return self.code.document().isModified()

    @property
    def read_only(self) -> bool:
        """Whether the file belongs to an installed package, or may not be written."""
        if self.path is None:
            return True
        installed = locations.home().name == "share" and self.path.is_relative_to(locations.home())
        return installed or not os.access(self.path, os.W_OK)

    def open(self, path: Path, line: int = 0) -> bool:
        """Show a file, unless the text of another one has changes that are not saved."""
        if path != self.path:
            if self.modified:
                self._say(f"{self.path.name if self.path else ''} has changes: save or revert it first")
                self._fill()
                return False
            try:
                text = path.read_text("utf-8")
            except (OSError, UnicodeDecodeError) as error:
                self._say(f"{path} cannot be read: {error}")
                return False
            self.path, self._told = path, {}
            self._take(text)
            self._fill()
            self.opened.emit(path)
        if line:
            self.code.go_to(line)
        return True

    def save(self) -> None:
        """Write the text to the file and try it."""
        if self.path is None or self.read_only or not self.modified:
            return
        try:
            # An editor writes into the file itself: it may be a link, and others may watch it.
            self.path.write_text(self.code.toPlainText(), "utf-8")
        except OSError as error:
            self._say(f"{self.path} cannot be written: {error.strerror}; save it elsewhere")
            return
        self._told = {}
        self.code.document().setModified(False)
        self._say("saved; trying it ...")
        self.reloader.look()

    def revert(self) -> None:
        """Forget the changes."""
        if self.path is not None and self.path.is_file():
            self._take(self.path.read_text("utf-8"))
            self._mark()

    def copy(self) -> None:
        """Copy the selected processor with its kernels to the user's plug-ins, and let the node use the copy."""
        chosen = self._node()
        if chosen is None or chosen.processor is None:
            self._say("select the node whose processor is to be copied")
            return
        try:
            made = copy_and_use(self.session, chosen.path)
        except GraphError as error:
            self.session.tell("error", str(error), chosen.path)
            self._say(str(error))
            return
        self.reloader.look()
        name = self.path.name if self.path is not None else ""
        self.open(next((path for path in made if path.name == name), made[-1]))
        self.session.tell("info", f"{chosen.path}: uses your own copy now, in {made[0].parent}", chosen.path)

    # -- what is shown ----------------------------------------------------------------------------------------------

    def _node(self) -> Node | None:
        paths = [path for path in self.session.selection if path in self.session.network]
        return self.session.network.node(paths[0]) if paths else None

    def _own(self) -> list[Path]:
        """The kernels of the selected node and what they include, each once."""
        node = self._node()
        processor = node.processor if node is not None else None
        found: dict[Path, None] = {}
        for name in processor.kernels if processor is not None else ():
            try:
                assert processor is not None
                found.update(dict.fromkeys(map(Path, kernel_source(processor, name).paths)))
            except GraphError:
                continue  # the message of the node says why
        return list(found)

    def _follow(self, *_: object) -> None:
        own = self._own()
        if own and self.path not in own and not self.modified:
            self.open(own[0])
        self._fill()
        self._enable()

    def _fill(self) -> None:
        """List the files of the selected node, then all others."""
        own = self._own()
        others = [path for path in self.reloader.kernels if path not in own]
        if self.path is not None and self.path not in (*own, *others):
            others.insert(0, self.path)
        self.files.clear()
        for place, path in enumerate([*own, *others]):
            if own and place == len(own):
                self.files.insertSeparator(place)
            self.files.addItem(short_name(path), path)
            self.files.setItemData(self.files.count() - 1, str(path), Qt.ItemDataRole.ToolTipRole)
        index = next((row for row in range(self.files.count()) if self.files.itemData(row) == self.path), -1)
        self.files.setCurrentIndex(index)

    def _chosen(self, row: int) -> None:
        path = self.files.itemData(row)
        if isinstance(path, Path):
            self.open(path)

    def _take(self, text: str) -> None:
        self.code.setPlainText(text)
        self.code.document().setModified(False)
        self._mark()
        self._enable()

    def _enable(self) -> None:
        locked = self.read_only
        self.code.setReadOnly(locked)
        self.save_it.setEnabled(self.modified and not locked)
        self.revert_it.setEnabled(self.modified)
        node = self._node()
        self.copy_it.setVisible(locked and self.path is not None and node is not None and self.path in self._own())

    def _say(self, text: str) -> None:
        self.state.setText(text)

    # -- errors -----------------------------------------------------------------------------------------------------

    def _looked(self, outcomes: list[Outcome]) -> None:
        # What is refused stands in the reloader; what was taken over tells anew what fails where it runs.
        if any(one.file == self.path or not one.reason for one in outcomes):
            self._told = {}
        if self.path is not None and self.path.is_file() and not self.modified:
            text = self.path.read_text("utf-8", errors="replace")
            if text != self.code.toPlainText():  # another program changed it
                self._take(text)
        self._fill()
        self._mark()

    def _hear(self, message: Message) -> None:
        """A kernel that never worked fails where it runs."""
        found = _PLACE.search(message.text) if message.level == "error" else None
        if found and self.path is not None and str(self.path).endswith(found[1]) and not self.modified:
            self._told[int(found[2])] = found[3]
            self._mark()

    def _mark(self) -> None:
        errors = {one.line: one.reason for one in self.reloader.refused if one.file == self.path} or self._told
        self.code.mark(errors)
        if errors:
            line, reason = next(iter(errors.items()))
            self._say(f"line {line}: {reason}" if line else reason)
        elif self.read_only and self.path is not None:
            self._say("This file comes with an installed package. Copy it to your plug-ins to change it.")
        else:
            self._say(str(self.path) if self.path is not None else "Select a node that has a kernel, or choose a file.")


def short_name(path: Path) -> str:
    """Category and file, as kernels are called."""
    return f"{path.parent.name}/{path.name}"
