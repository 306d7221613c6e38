"""Random actions on the canvas: no exception, nothing shown that is not in the document, and undo brings all back."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QGuiApplication

from nodegraph.bends import bends_of
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.faces import as_position, wires_of
from nodegraph.editor.session import Session
from tests.editor.canvas.conftest import Hand, text_of

pytestmark = pytest.mark.slow

TYPES = ("filter.gaussian_blur", "render.slice", "image.compose", "source.synthetic", "output.view", "filter.gradient")
ALT = Qt.KeyboardModifier.AltModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


class Monkey:
    """Does one random thing at a time, as somebody with a mouse could."""

    def __init__(self, canvas: CanvasView, seed: int) -> None:
        self.canvas = canvas
        self.hand = Hand(canvas)
        self.rng = random.Random(seed)
        self.actions: list[Callable[[], object]] = [
            self.add, self.add, self.wire, self.wire, self.wire, self.move, self.move, self.insert, self.pull,
            self.band, self.choose, self.choose, canvas.delete_selection, canvas.duplicate, canvas.mute, self.paste,
            canvas.copy, canvas.group, canvas.ungroup, canvas.layout_all, canvas.layout_selection, canvas.fit,
            self.enter, canvas.leave_group, self.rename, self.frame, self.note, self.align, self.zoom, self.undo,
            self.redo, self.find, self.cancel, self.arrows, canvas.toggle_minimap,
            self.bend, self.bend, canvas.straighten, canvas.accept_proposals, canvas.toggle_arcs, canvas.pull_out,
        ]  # fmt: skip

    def step(self) -> None:
        self.rng.choice(self.actions)()

    def node(self) -> str | None:
        ids = list(self.canvas.scene.nodes)
        return self.rng.choice(ids) if ids else None

    def spot(self) -> QPointF:
        seen = self.canvas.view.seen()
        return QPointF(seen.left() + self.rng.random() * seen.width(), seen.top() + self.rng.random() * seen.height())

    def add(self) -> None:
        if len(self.canvas.scene.nodes) < 25:
            self.canvas.view.drop_processor(self.rng.choice(TYPES), self.spot())

    def bend(self) -> None:
        wires = list(self.canvas.scene.wires.values())
        if wires:
            start = self.rng.choice(wires).path().pointAtPercent(self.rng.random())
            if self.rng.random() < 0.3:
                self.hand.double_click(start)
            else:
                self.hand.drag(start, self.spot(), ALT if self.rng.random() < 0.7 else Qt.KeyboardModifier.NoModifier)
        if self.canvas.field is not None:
            self.canvas.field.deleteLater()
            self.canvas.field = None
        if self.canvas.chooser is not None:
            self.canvas.chooser.close()

    def wire(self) -> None:
        self.canvas.scene.choose(())
        self.canvas.fit()
        ends = [
            self.hand.port(id, port.name, port.output)
            for id, item in self.canvas.scene.nodes.items()
            for port in (*item.face.inputs, *item.face.outputs)
        ]
        if len(ends) > 1:
            self.hand.drag(self.rng.choice(ends), self.rng.choice([*ends, self.spot()]))
        chooser = self.canvas.chooser
        if chooser is not None:
            if chooser.shown() and self.rng.random() < 0.5:
                chooser.chosen.emit(self.rng.choice(chooser.shown()))
            chooser.close()

    def move(self) -> None:
        id = self.node()
        if id is not None:
            self.hand.drag(self.hand.title(id), self.spot())

    def insert(self) -> None:
        wires = list(self.canvas.scene.wires.values())
        id = self.node()
        if wires and id is not None:
            self.hand.drag(self.hand.title(id), self.rng.choice(wires).path().pointAtPercent(0.5))

    def pull(self) -> None:
        id = self.node()
        if id is not None:
            self.hand.drag(self.hand.title(id), self.spot(), ALT)

    def band(self) -> None:
        self.hand.drag(self.spot(), self.spot(), SHIFT if self.rng.random() < 0.5 else Qt.KeyboardModifier.NoModifier)

    def choose(self) -> None:
        items = list(self.canvas.scene.nodes.values())
        self.canvas.scene.choose(self.rng.sample(items, min(len(items), self.rng.randrange(4))))

    def paste(self) -> None:
        if len(self.canvas.scene.nodes) < 25:
            self.canvas.paste()

    def enter(self) -> None:
        groups = [item for item in self.canvas.scene.nodes.values() if item.face.group]
        if groups:
            self.canvas.session.enter(self.rng.choice(groups).path)

    def rename(self) -> None:
        id = self.node()
        if id is not None:
            self.canvas.rename(self.canvas.scene.nodes[id])
            assert self.canvas.field is not None
            self.canvas.field.setText(self.rng.choice(["a", "b", "two words", "", "view"]))  # type: ignore[union-attr]
            self.canvas.field.editingFinished.emit()  # type: ignore[union-attr]

    def frame(self) -> None:
        if self.canvas.scene.chosen():
            self.canvas.edits.add_frame()
        for item in list(self.canvas.scene.boxes.values())[:1]:
            self.hand.drag(item.pos() + QPointF(20, 10), self.spot())

    def note(self) -> None:
        self.canvas.add_note()
        if self.canvas.field is not None:
            self.canvas.field.setPlainText("words")  # type: ignore[union-attr]
            self.canvas.field.finish()  # type: ignore[union-attr]

    def align(self) -> None:
        self.canvas.align(self.rng.choice(["left", "right", "top", "bottom", "columns"]))

    def zoom(self) -> None:
        self.canvas.view.zoom_by(self.rng.choice([0.5, 0.8, 1.25, 2.0]), QPointF(200, 200))

    def undo(self) -> None:
        self.canvas.session.undo()

    def redo(self) -> None:
        self.canvas.session.redo()

    def find(self) -> None:
        self.canvas.find()
        self.canvas.finder.field.setText(self.rng.choice(["", "blur", "v", "nothing at all"]))
        self.hand.canvas.finder.stepped.emit(1)
        self.canvas.finder.hide()
        self.canvas.finder.closed.emit()

    def cancel(self) -> None:
        id = self.node()
        if id is not None:
            self.hand.press(self.hand.middle(id))
            self.hand.move(self.spot())
            self.hand.key(Qt.Key.Key_Escape)
            self.hand.release(self.spot())

    def arrows(self) -> None:
        key = self.rng.choice([Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down])
        self.hand.key(key, self.rng.choice([ALT, SHIFT, Qt.KeyboardModifier.NoModifier]))


def check_shows_the_document(canvas: CanvasView) -> None:
    """The scene shows exactly what the level holds, where the document says."""
    scene, level = canvas.scene, canvas.scene.level
    scene.flush()
    assert set(scene.nodes) == set(level.nodes)
    assert sorted(wire for wire, _ in scene.wires) == sorted(wires_of(level))
    for id, node in level.nodes.items():
        place = as_position(node.ui.get("position"))
        item = scene.nodes[id]
        assert item.path == node.path
        assert item.face.muted == node.muted
        if place is not None:
            assert (item.x(), item.y()) == pytest.approx(place, abs=1e-6)  # a drag adds up to it
    for (source, target, name), twin in scene.wires:
        item = scene.wires[(source, target, name), twin]
        bends = bends_of(level.nodes[target], name, source)
        assert [(place.x(), place.y()) for place in item.bends] == bends
    assert all({arc.start, arc.end} <= set(scene.nodes) for arc in scene.arcs.items)
    for (kind, key), box in scene.boxes.items():
        assert scene.ui[kind][key]["text"] == box.text
    assert sum(len(scene.ui.get(kind, {})) for kind in ("frames", "notes")) == len(scene.boxes)
    here = [path for path in canvas.session.selection if path.rpartition("/")[0] == canvas.session.level]
    assert sorted(here) == sorted(scene.path_of(id) for id in scene.chosen())
    assert canvas.view.drag is None
    assert not canvas.session.in_gesture


@pytest.mark.parametrize("seed", [1, 2])
def test_monkey(session: Session, canvas: CanvasView, seed: int) -> None:
    QGuiApplication.clipboard().setText("no JSON")
    before = text_of(session)
    monkey = Monkey(canvas, seed)
    for _ in range(500):
        monkey.step()
        check_shows_the_document(canvas)
    after = text_of(session)
    assert after != before
    canvas.grab()  # paints every kind of thing
    steps = 0
    while session.history.undo_name:
        session.undo()
        steps += 1
    assert steps > 50
    assert text_of(session) == before
    check_shows_the_document(canvas)
    for _ in range(steps):
        session.redo()
    check_shows_the_document(canvas)
