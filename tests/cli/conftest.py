"""Processors that need no device, and workspaces made of them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

PICTURE = '''
"""A picture of one grey, as large as it is asked for."""
import numpy as np
from nodegraph import Bool, Choice, File, Float, Input, Int, Output, Processor, Vector
from nodegraph.data import Image

class Picture(Processor):
    """One grey."""

    image = Output(Image, doc="The picture.")
    level = Float(0.5, min=0.0, max=1.0, doc="Grey, linear.")
    shade = Choice("plain", "ramp", doc="Pattern.")
    inverted = Bool(False, doc="Take one minus the grey.")
    offset = Vector((0.0, 0.0), doc="Added to red and green.")
    number = Int(0, doc="Of no effect.")
    table = File(doc="Text with a number that replaces the grey.")

    def process(self, level, shade, inverted, offset, number, table, *, size):
        if table:
            with open(table) as file:
                level = float(file.read())
        color = np.full((size[1], size[0], 4), level, np.float32)
        if shade == "ramp":
            color[..., :3] *= np.linspace(0.0, 1.0, size[0], dtype=np.float32)[None, :, None]
        if inverted:
            color[..., :3] = 1.0 - color[..., :3]
        color[..., 0] += offset[0]
        color[..., 1] += offset[1]
        color[..., 3] = 1.0
        return Image(color)
'''

FAULTY = '''
"""Fails."""
from nodegraph import Input, Int, Output, Processor
from nodegraph.data import Image

class Faulty(Processor):
    """Divides by a number that may be zero."""

    image = Input(Image, doc="Passed on.")
    same = Output(Image, doc="The same.")
    divisor = Int(0, doc="Zero fails.")

    def process(self, image, divisor):
        1 / divisor
        return image
'''

DEADLY = '''
"""Takes its process along."""
import os
from nodegraph import Bool, Input, Output, Processor
from nodegraph.data import Image

class Deadly(Processor):
    """Ends the process, as a driver that crashes does."""

    image = Input(Image, doc="Passed on.")
    same = Output(Image, doc="The same.")
    now = Bool(False, doc="End it.")

    def process(self, image, now):
        if now:
            os._exit(11)
        return image
'''

NOTE = '''
"""Writes a text."""
from nodegraph import File, Input, Processor
from nodegraph.data import Image

class Note(Processor):
    """Write the mean of a picture into a file."""

    effect = True
    image = Input(Image, doc="What is measured.")
    path = File(doc="Where to.", write=True)

    def process(self, image, path):
        with open(path, "w") as file:
            file.write(f"{float(image.color.mean()):.4f}")
'''


class Ran(NamedTuple):
    """What a command did: exit code, standard output, error output."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


@pytest.fixture(scope="session")
def plugin_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plug-in folder with processors of the category ``trial``, and one that cannot be imported."""
    folder = tmp_path_factory.mktemp("plugins")
    (folder / "trial").mkdir()
    for name, text in {"picture": PICTURE, "faulty": FAULTY, "deadly": DEADLY, "note": NOTE}.items():
        (folder / "trial" / f"{name}.py").write_text(text)
    (folder / "trial" / "broken.py").write_text("import a_package_that_nobody_has\n")
    return folder


@pytest.fixture
def plugins(plugin_folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The plug-in folder, in NODEGRAPH_PATH."""
    from nodegraph import registry

    monkeypatch.setenv("NODEGRAPH_PATH", str(plugin_folder))
    registry.default.cache_clear()
    yield plugin_folder
    registry.default.cache_clear()


@pytest.fixture
def cli(plugins: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., Ran]:
    """Run a command in this process."""
    from nodegraph.cli import main

    def run(*arguments: object) -> Ran:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return Ran(code, out, err)

    return run


Nodes = dict[str, dict[str, Any]]


@pytest.fixture
def workspace(tmp_path: Path) -> Callable[..., Path]:
    """Write a workspace: a grey picture and a view of it, and whatever nodes are given; None removes one."""

    def write(name: str = "grey.json", variables: Nodes | None = None, **nodes: dict[str, Any] | None) -> Path:
        content: Nodes = {
            "picture": {"type": "trial.picture", "version": 1},
            "view": {
                "type": "output.view",
                "version": 1,
                "params": {"width": 16, "height": 8},
                "inputs": {"image": "picture.image"},
            },
        }
        for id, node in nodes.items():
            content.pop(id, None)
            if node is not None:
                content[id] = node
        path = tmp_path / name
        path.write_text(json.dumps({"nodegraph": 1, "variables": variables or {}, "nodes": content, "ui": {}}))
        return path

    return write
