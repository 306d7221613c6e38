"""The window: the canvas in the middle, panels around it, and the commands that belong to no panel."""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QIcon
from PySide6.QtWidgets import (
    QApplication,
    QDockWidget,
    QFileDialog,
    QMainWindow,
    QMenu,
    QMessageBox,
    QStackedWidget,
    QWidget,
)

from nodegraph.editor import actions, theme
from nodegraph.editor.animation.timeline import Timeline
from nodegraph.editor.arrangement import Arrangement
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.link_table import LinkTable
from nodegraph.editor.command_palette import CommandPalette
from nodegraph.editor.console import Console
from nodegraph.editor.docks import Titles, scrolled
from nodegraph.editor.help import Help
from nodegraph.editor.messages import Messages
from nodegraph.editor.offers import Beginning, is_workspace, name_filter
from nodegraph.editor.palette import Palette
from nodegraph.editor.parameters import ParameterPanel
from nodegraph.editor.profile import Profile
from nodegraph.editor.quality.panel import QualityPanel
from nodegraph.editor.recorder import Recorder
from nodegraph.editor.recovery import Autosave
from nodegraph.editor.reloading import Reloader
from nodegraph.editor.session import Session
from nodegraph.editor.settings import Settings
from nodegraph.editor.shader_editor import ShaderPanel
from nodegraph.editor.status import Banner, Status
from nodegraph.editor.view_docks import ViewDocks
from nodegraph.editor.views.browser import ImageBrowser
from nodegraph.editor.views.compare import CompareView
from nodegraph.editor.views.measure_list import MeasureList
from nodegraph.editor.welcome import Welcome
from nodegraph.network import Network

FILES = "Workspaces and pictures that carry one (*.json *.png *.exr)"


class Window(QMainWindow):
    """One document in a window. It owns the session and closes it."""

    def __init__(self, session: Session | None = None, settings: Settings | None = None) -> None:
        super().__init__()
        self.session = session if session is not None else Session()
        self.settings = settings if settings is not None else Settings()
        self.autosave = Autosave(self.session)
        self.reloader = Reloader(self.session)
        self.submenus: dict[str, QMenu] = {}
        self.docks: dict[str, QDockWidget] = {}
        self.view_docks = ViewDocks(self)
        self.views = self.view_docks.docks
        self.box: QMessageBox | QFileDialog | None = None
        self.arrangement = Arrangement(self)
        self.titles = Titles(self)
        self._leaving = False
        self._repaint = QTimer(self, singleShot=True, interval=0)
        self._repaint.timeout.connect(self._paint_icons)
        self.setWindowIcon(QIcon(str(Path(__file__).parent / "icons" / "app.svg")))
        self.setAcceptDrops(True)
        self.resize(1440, 900)

        self.welcome = Welcome(self.session, lambda: self.settings.recent)
        self.canvas = CanvasView(self.session)
        # A timer of its own: one of QTimer.singleShot that has not ended yet keeps what it calls for good.
        self._fit = QTimer(self, singleShot=True, interval=0)
        self._fit.timeout.connect(self.canvas.fit_all)
        self.middle = QStackedWidget()
        self.middle.addWidget(self.welcome)
        self.middle.addWidget(self.canvas)
        self.setCentralWidget(self.middle)
        self.palette_panel = Palette(self.session)
        self.parameters = ParameterPanel(self.session)
        self.help = Help(self.session)
        self.messages = Messages(self.session)
        self.profile = Profile(self.session)
        self.console = Console(self.session)
        self.links = LinkTable(self.session)
        self.links.marked.connect(self.canvas.scene.arcs.mark)
        self.images = ImageBrowser(self.session)
        self.compare = CompareView(self.session)
        self.quality = QualityPanel(self.session, self.settings)
        self.timeline = Timeline(self.session)
        self.recorder = Recorder(self.session)
        self.shader = ShaderPanel(self.session, self.reloader)
        self._add_dock("palette", "Processors", self.palette_panel)
        self._add_dock("parameters", "Parameters", self.parameters)
        self._add_dock("help", "Help", self.help)
        self._add_dock("messages", "Messages", self.messages)
        self._add_dock("profile", "Profile", self.profile)
        self._add_dock("links", "Links", scrolled(self.links))
        self._add_dock("images", "Images", self.images)
        self._add_dock("compare", "Compare", self.compare)
        self._add_dock("measures", "Measures", MeasureList(self.session))
        self._add_dock("quality", "Quality", scrolled(self.quality))
        self._add_dock("timeline", "Timeline", self.timeline)
        self._add_dock("console", "Python", self.console)
        self._add_dock("recorder", "Recorder", self.recorder)
        self._add_dock("shader", "Shader", self.shader)
        self.actions_by_name = actions.make(self)
        self.bar = actions.make_bar(self, self.actions_by_name)
        self.status = Status(self.session)
        self.setStatusBar(self.status)
        self.banner = Banner(self)
        self.beginning = Beginning(self.session, self, self.when_safe)
        self.commands = CommandPalette(self, partial(actions.entries, self))
        # What listens to the session holds the window, so the session must go for either to be forgotten.
        self.destroyed.connect(self.session.deleteLater)
        self._connect()
        self._paint_icons()
        self.reset_layout()
        self._replaced()

    # -- files ----------------------------------------------------------------------------------------------------

    def new(self) -> None:
        """Begin an empty network, after asking about one that is not saved."""
        self.when_safe(self._new)

    def open_dialog(self) -> None:
        """Choose a file to open."""
        box = QFileDialog(self, "Open", str(self.session.path.parent) if self.session.path else "", FILES)
        box.setFileMode(QFileDialog.FileMode.ExistingFile)
        box.fileSelected.connect(lambda name: self.open_file(Path(name)))
        self._ask(box)

    def open_file(self, path: Path) -> None:
        """Open a workspace, after asking about a document that is not saved; of a data file, offer networks."""
        self.open_files([path])

    def open_files(self, paths: list[Path]) -> None:
        """Open the first workspace among some files; where there is none, begin a network with all of them."""
        workspaces = [path for path in paths if is_workspace(path)]
        if workspaces:
            self.when_safe(lambda: self._open(workspaces[0]))
        elif paths:
            self.beginning.start(paths)

    def new_from_data(self) -> None:
        """Choose data files to begin a network with."""
        box = QFileDialog(self, "New from data", "", name_filter())
        box.setFileMode(QFileDialog.FileMode.ExistingFiles)
        box.filesSelected.connect(lambda names: self.beginning.start([Path(name) for name in names]))
        self._ask(box)

    def save(self) -> None:
        """Save to the file of the document; one without a file asks for it."""
        self._save_then(lambda: None)

    def save_as(self) -> None:
        """Choose where to save."""
        self._save_as_then(lambda: None)

    def _save_then(self, then: Callable[[], object]) -> None:
        if self.session.path is None:
            self._save_as_then(then)
        elif self._save(self.session.path):
            then()

    def _save_as_then(self, then: Callable[[], object]) -> None:
        box = QFileDialog(self, "Save as", str(self.session.path or "network.json"), "Workspaces (*.json)")
        box.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        box.setDefaultSuffix("json")
        box.fileSelected.connect(lambda name: then() if self._save(Path(name)) else None)
        self._ask(box)

    def take_over(self, network: Network) -> None:
        """Show a document that was made elsewhere, as by recovery."""
        self.session.adopt(network)
        self._show_canvas()
        self.autosave.write()

    def _new(self) -> None:
        self.session.new()
        self._show_canvas()

    def _open(self, path: Path) -> None:
        if self.session.open(path):
            self.settings.add_recent(path.absolute())
            self._show_canvas()
        else:
            self._show_messages()

    def _save(self, path: Path) -> bool:
        self._show_canvas()
        self.arrangement.note()
        saved = self.session.save(path)
        if saved and self.session.path is not None:
            self.settings.add_recent(self.session.path)
        self._name()
        return saved

    def when_safe(self, then: Callable[[], object]) -> None:
        """Do something that lets the document go, at once or after the user has said what becomes of its changes."""
        if not self.session.modified:
            then()
            return
        name = self.session.path.name if self.session.path else "this network"
        box = QMessageBox(QMessageBox.Icon.NoIcon, "Unsaved changes", f"Save the changes of {name}?", parent=self)
        keep, drop = QMessageBox.StandardButton.Save, QMessageBox.StandardButton.Discard
        box.setStandardButtons(keep | drop | QMessageBox.StandardButton.Cancel)

        def answered(_result: int) -> None:
            chosen = box.standardButton(box.clickedButton())
            if chosen == drop:
                then()
            elif chosen == keep:
                self._save_then(then)

        box.finished.connect(answered)
        self._ask(box)

    def _ask(self, box: QMessageBox | QFileDialog) -> None:
        """Show a dialog without stopping the program; the window waits, the engine goes on."""
        self.box = box
        box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        box.destroyed.connect(lambda: setattr(self, "box", None))
        box.open()

    # -- commands ---------------------------------------------------------------------------------------------------

    def undo(self) -> None:
        self.session.undo()

    def redo(self) -> None:
        self.session.redo()

    def retry(self) -> None:
        self.session.retry()

    def open_commands(self) -> None:
        """Find anything by its name."""
        self.commands.open()

    def show_help(self) -> None:
        """Bring the help to the front."""
        self._raise("help")

    def show_compare(self) -> None:
        """Bring the comparison of views to the front."""
        self._raise("compare", roomy=True)

    def show_quality(self) -> None:
        """Bring the errors and times of views to the front."""
        self._raise("quality", roomy=True)

    def _show_messages(self) -> None:
        self._raise("messages")

    def _raise(self, name: str, roomy: bool = False) -> None:
        """Show a panel before the others; ``roomy``: it takes a third of the window if it has less."""
        dock = self.docks[name]
        dock.show()
        dock.raise_()
        if roomy and not dock.isFloating() and dock.height() < self.height() // 3:
            self.resizeDocks([dock], [self.height() // 3], Qt.Orientation.Vertical)

    def show_shader(self, path: Path | None = None, line: int = 0) -> None:
        """Bring the editor of kernels to the front, with a file where one is named."""
        self.docks["shader"].show()
        self.docks["shader"].raise_()
        if path is not None:
            self.shader.open(path, line)

    def show_recorder(self) -> None:
        """Bring what was recorded to the front."""
        self.docks["recorder"].show()
        self.docks["recorder"].raise_()

    def show_welcome(self) -> None:
        """Show the page with examples and recent files; the document stays open behind it."""
        self.welcome.refresh()
        self.middle.setCurrentWidget(self.welcome)
        self.arrangement.set_aside()
        self.welcome.show_pictures()

    def toggle_full_screen(self) -> None:
        self.setWindowState(self.windowState() ^ Qt.WindowState.WindowFullScreen)

    def toggle_theme(self) -> None:
        """Change between light and dark, for good."""
        name = "light" if theme.theme_of(self.palette()) is theme.DARK else "dark"
        self.settings.set("theme", name)
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        theme.apply(app, name)

    def reset_layout(self) -> None:
        """Put the panels where they are at first."""
        self.arrangement.reset()

    def quad_view(self) -> None:
        """Show the volume that is meant in three dimensions and in three cuts, two by two; what is missing is added."""
        self.view_docks.quad()
        self._fit_soon()

    # -- behind it --------------------------------------------------------------------------------------------------

    def _add_dock(self, name: str, title: str, widget: QWidget) -> None:
        dock = QDockWidget(title, self)
        dock.setObjectName(name)
        dock.setWidget(widget)
        self.titles.add(dock)
        self.docks[name] = dock

    def _connect(self) -> None:
        session = self.session
        session.replaced.connect(self._replaced)
        session.changed.connect(self._changed)
        session.stepped.connect(self._enable)
        session.saved.connect(lambda _path: self._name())
        session.selected.connect(lambda _paths: self._enable())
        self.palette_panel.chosen.connect(self.add_processor)
        self.palette_panel.highlighted.connect(self.help.show_processor)
        self.messages.counted.connect(self._count_errors)
        self.reloader.looked.connect(lambda _outcomes: self.palette_panel.refresh())
        self.reloader.mended.connect(self.messages.forget)
        self.messages.kernel_chosen.connect(self.show_shader)
        self.beginning.refused.connect(self._show_messages)
        self.beginning.done.connect(self._show_whole)
        self.welcome.wants_data.connect(self.new_from_data)
        self.welcome.wants_new.connect(self.new)
        self.welcome.wants_dialog.connect(self.open_dialog)
        self.welcome.wants_file.connect(self.open_file)
        self.submenus["recent"].aboutToShow.connect(partial(actions.fill_recent, self))
        self.submenus["panels"].aboutToShow.connect(partial(actions.fill_panels, self))

    def add_processor(self, id: str) -> None:
        """Add a processor in the middle of what the canvas shows."""
        self._show_canvas()
        self.canvas.view.drop_processor(id, self.canvas.view.seen().center())

    def go_to(self, path: str) -> None:
        """Show a node on the canvas."""
        self._show_canvas()
        self.session.enter(path.rpartition("/")[0])
        self.session.select(path)
        self.canvas.fit()

    def _show_whole(self) -> None:
        self._show_canvas()
        self._fit_soon()

    def _fit_soon(self) -> None:
        self._fit.start()  # when the docks of its views have taken their room

    def _show_canvas(self) -> None:
        self.middle.setCurrentWidget(self.canvas)
        self.arrangement.bring_back()
        self.canvas.setFocus()

    def _replaced(self) -> None:
        self.view_docks.sync()
        self.arrangement.restore()
        self._changed()
        self._fit_soon()

    def _changed(self, *_: object) -> None:
        self.view_docks.sync()
        if self.session.network.nodes and self.middle.currentWidget() is self.welcome:
            self._show_canvas()
        self._name()
        self._enable()

    def _name(self) -> None:
        name = self.session.path.name if self.session.path else "untitled"
        self.setWindowTitle(f"{name}[*] - nodegraph")
        self.setWindowModified(self.session.modified)

    def _enable(self) -> None:
        history, chosen = self.session.history, self.session.selection
        undo, redo = self.actions_by_name["undo"], self.actions_by_name["redo"]
        undo.setEnabled(bool(history.undo_name))
        undo.setText(f"Undo {history.undo_name}".rstrip())
        redo.setEnabled(bool(history.redo_name))
        redo.setText(f"Redo {history.redo_name}".rstrip())
        groups = [path for path in chosen if self.session.network.node(path).network is not None]
        for name in ("mute", "group", "duplicate", "cut", "copy", "rename_selection", "add_frame", "pull_out"):
            self.actions_by_name[name].setEnabled(bool(chosen))
        self.actions_by_name["ungroup"].setEnabled(bool(groups))

    def _paint_icons(self) -> None:
        actions.paint(self, self.actions_by_name)

    def _count_errors(self, errors: int) -> None:
        self.docks["messages"].setWindowTitle(f"Messages ({errors})" if errors else "Messages")

    # -- events -----------------------------------------------------------------------------------------------------

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "actions_by_name"):
            self._repaint.start()  # once the palette has reached everybody

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if any(url.isLocalFile() for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        self.open_files([Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()])

    def closeEvent(self, event: QCloseEvent) -> None:
        if self.session.modified and not self._leaving:
            event.ignore()
            self.when_safe(self._leave)
            return
        self.settings.set("geometry", base64.b64encode(self.saveGeometry().data()).decode())
        self.autosave.close()
        self.reloader.close()
        for dock in self.views:
            dock.close()
        self.session.close()
        event.accept()

    def _leave(self) -> None:
        self._leaving = True
        self.close()
