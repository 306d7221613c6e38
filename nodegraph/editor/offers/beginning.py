"""From data files to a network in the document: look at them beside the window, let the user choose, build."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from nodegraph import formats, offers
from nodegraph.clipboard import Paste
from nodegraph.editor.offers.chooser import Chooser
from nodegraph.editor.session import Session
from nodegraph.errors import GraphError
from nodegraph.network import Network
from nodegraph.offers import Offer


class Surveyed(NamedTuple):
    """What was found out about one file: what it can be shown by, or why it cannot."""

    path: Path
    offers: list[Offer]
    refusal: str = ""


def is_workspace(path: Path) -> bool:
    """Whether a file is one to open, and not one to begin a network with."""
    return path.suffix.lower() in (".json", ".png", ".exr")


def name_filter() -> str:
    """The volume files, for a dialog."""
    known = [suffix for suffix in formats.suffixes() if suffix not in (".png", ".exr")]
    return f"Volumes ({' '.join(f'*{suffix}' for suffix in known)})"


class Beginning(QObject):
    """Makes networks of data files. ``when_safe`` runs a function that lets the document go, after asking."""

    refused = Signal()  # a file could not be used; a message says why
    done = Signal()

    def __init__(self, session: Session, window: QWidget, when_safe: Callable[[Callable[[], object]], object]) -> None:
        super().__init__(window)
        self.session = session
        self.window = window
        self.chooser: Chooser | None = None
        self._when_safe = when_safe

    def start(self, paths: list[Path]) -> None:
        """Look at the files, then offer what suits them."""
        names = ", ".join(path.name for path in paths)
        self.session.tell("info", f"looking at {names}")
        self.session.work(lambda: [_survey(path) for path in paths], self._offer)

    def _offer(self, found: list[Surveyed] | None) -> None:
        for one in found or ():
            if one.refusal:
                self.session.tell("error", one.refusal)
                self.refused.emit()
        good = [one for one in found or () if one.offers]
        if not good:
            return
        self.chooser = Chooser(self.session, good[0].path, good[0].offers, len(good) - 1, self.window)
        self.chooser.chosen.connect(partial(self._chosen, good))
        self.chooser.destroyed.connect(lambda: setattr(self, "chooser", None))
        self.chooser.open()

    def _chosen(self, found: list[Surveyed], name: str, afresh: bool) -> None:
        picked = [next((offer for offer in one.offers if offer.name == name), one.offers[0]) for one in found]
        title = f"new from {', '.join(one.path.name for one in found)}"
        # Building opens the files' headers again and may find them changed.
        self.session.work(lambda: _build(picked), partial(self._show, title, afresh))

    def _show(self, title: str, afresh: bool, built: Network | str | None) -> None:
        if not isinstance(built, Network):
            self.session.tell("error", built or f"{title}: it could not be built; try again")
            self.refused.emit()
            return

        def show() -> None:
            if afresh:
                self.session.new()
            paste = Paste(built.copy(*built.nodes))
            with self.session.gesture(title):
                if self.session.do(paste):
                    self.session.enter("")
            rendering = (path for path in paste.paths if self.session.network.node(path).type.startswith("render."))
            self.session.select(*list(rendering)[-1:])
            self.done.emit()

        if afresh:
            self._when_safe(show)
        else:
            show()


def _survey(path: Path) -> Surveyed:
    try:
        return Surveyed(path, offers.offers(path))
    except GraphError as error:
        return Surveyed(path, [], str(error))


def _build(picked: list[Offer]) -> Network | str:
    """One network that holds those of all offers."""
    whole = Network()
    try:
        for offer in picked:
            one = offer.network()
            whole.paste(one.copy(*one.nodes))
    except GraphError as error:
        return str(error)
    return whole
