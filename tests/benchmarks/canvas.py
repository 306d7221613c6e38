"""How long the canvas takes for a network of 500 nodes: ``python -m tests.benchmarks.canvas``.

Processor time of the window's thread, so that other programs do not count: opening from a document to the first
painting, a step of panning at several zooms, following a change of the structure, selecting a node of many parameters.
"""

from __future__ import annotations

import os
import random
import statistics
import time

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtWidgets import QApplication

from nodegraph import Network
from nodegraph.editor import theme
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.parameters import ParameterPanel
from nodegraph.editor.session import Session

NODES, STEPS = 500, 40
KINDS = (("filter.gaussian_blur", "smoothed"), ("filter.gaussian_blur", "smoothed"), ("filter.gradient", "gradient"))


def network() -> Network:
    """Filters, each of which reads one of the twelve before it."""
    made, chance = Network(), random.Random(1)
    made.add("source.synthetic", "source")
    outputs = ["source.volume"]
    for i in range(1, NODES):
        kind, output = chance.choice(KINDS)
        made.add(kind, f"node_{i}")
        made.connect(chance.choice(outputs[-12:]), f"node_{i}.volume")
        outputs.append(f"node_{i}.{output}")
    made.add("render.raycast", "raycast")
    return made


def main() -> None:
    """Measure and tell."""
    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    theme.apply(app, "dark")
    session = Session(network())
    start = time.thread_time()
    canvas = CanvasView(session)
    canvas.resize(1600, 1000)
    canvas.show()
    for _ in range(3):
        app.processEvents()
    canvas.view.viewport().repaint()
    print(f"open {NODES} nodes, laid out and painted: {time.thread_time() - start:.2f} s")
    for zoom in (canvas.view.zoom, 0.3, 0.5, 1.0):
        canvas.view.resetTransform()
        canvas.view.scale(zoom, zoom)
        canvas.view.centerOn(canvas.scene.content().center())
        canvas.view.viewport().repaint()
        taken = []
        for i in range(STEPS):
            start = time.thread_time()
            canvas.view.pan(9 * (-1) ** (i // 10), 5)
            canvas.view.viewport().repaint()
            taken.append(time.thread_time() - start)
        print(f"pan at zoom {zoom:.2f}: {_ms(statistics.median(taken))}, at most {_ms(max(taken))}")
    start = time.thread_time()
    canvas.scene.sync()
    print(f"follow a change of the structure: {_ms(time.thread_time() - start)}")
    panel = ParameterPanel(session)
    panel.resize(400, 1000)
    panel.show()
    for word in ("for the first time", "again"):
        session.select("source")
        _settle(app)
        start = time.thread_time()
        session.select("raycast")
        _settle(app)
        print(f"select a ray-caster {word}, all its parameters shown: {_ms(time.thread_time() - start)}")
    session.close()


def _settle(app: QApplication) -> None:
    for _ in range(40):
        app.processEvents()


def _ms(seconds: float) -> str:
    return f"{seconds * 1e3:.1f} ms"


if __name__ == "__main__":
    main()
