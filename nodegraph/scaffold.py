"""Writes the first version of a processor, with a test: what ``nodegraph new processor`` does."""

from __future__ import annotations

import itertools
import keyword
import re
from pathlib import Path

from nodegraph import formats, locations, registry
from nodegraph.errors import CommandError
from nodegraph.kernel_sources import kernel_source
from nodegraph.processor import Processor
from nodegraph.signature import camel

_TAKEN = ("Float", "Image", "Input", "Output", "Path", "Processor", "Volume")
"""What the written files import."""

_PYTHON = '''"""Scale the values of a volume."""

from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Volume


class {name}(Processor):
    """Multiply every voxel by a factor.

    Say here what a user has to know: what is computed, what it is good for, and where the method comes from.
    """

    volume = Input(Volume, doc="Any volume.")
    scaled = Output(Volume, doc="Same grid, float32.")

    factor = Float(2.0, soft_min=0.0, soft_max=10.0, doc="What every voxel is multiplied by.")

    def process(self, volume, factor):
        return volume.with_data(volume.real() * factor)
'''

_PYTHON_TEST = '''"""Tests of {id}."""

from pathlib import Path

import numpy as np
import pytest

import nodegraph.testing
from nodegraph.data import Volume

{name} = nodegraph.testing.processor_of(Path(__file__).parents[1], "{id}")


@pytest.mark.parametrize("check", nodegraph.testing.contract({name}), ids=str)
def test_contract(check):
    check()


def test_every_voxel_is_multiplied():
    volume = Volume(np.arange(24, dtype="f4").reshape(2, 3, 4))
    result = nodegraph.testing.call({name}, volume=volume, factor=3.0)
    np.testing.assert_allclose(result.data, 3.0 * volume.data)
'''

_GLSL = """\
// Brighten a picture.
// Alpha and depth stay as they are.
field2 image;                // Any picture.
uniform float gain = 2.0;    // 0..10; Factor on the colour.

vec4 pixel(ivec2 at) {
    vec4 color = fetch2(image, at);
    return vec4(gain * color.rgb, color.a);
}
"""

_GLSL_TEST = '''"""Tests of {id}."""

from pathlib import Path

import numpy as np
import pytest

import nodegraph.testing
from nodegraph.data import Image

{name} = nodegraph.testing.processor_of(Path(__file__).parents[1], "{id}")


@pytest.mark.parametrize("check", nodegraph.testing.contract({name}), ids=str)
def test_contract(check):
    check()


def test_colour_is_multiplied_and_alpha_stays():
    image = Image(np.full((2, 3, 4), 0.25, "f4"))
    result = nodegraph.testing.call({name}, image=image, gain=3.0)
    np.testing.assert_allclose(result.color[..., :3], 0.75, rtol=1e-6)
    np.testing.assert_allclose(result.color[..., 3], 0.25)
'''


def new_processor(name: str, folder: str | Path = ".", *, glsl: bool = False) -> list[Path]:
    """Write ``category/stem.py`` (or ``.glsl``) and ``tests/test_stem.py`` below a plug-in folder; return their paths.

    ``name`` is the id, ``filter.sharpen``. Existing files are left alone: CommandError names the one in the way.
    Raises FormatError for what the system refuses.
    """
    id = name.strip().replace("/", ".").removesuffix(".py")
    parts = id.split(".")
    reason = registry.why_no_id(tuple(parts))
    if reason:
        raise CommandError(f"new processor {name}: {reason}; write it as filter.sharpen")
    if keyword.iskeyword(camel(parts[-1])) or camel(parts[-1]) in _TAKEN or hasattr(Processor, parts[-1]):
        raise CommandError(f"new processor {name}: {parts[-1]!r} means something else in Python; choose another name")
    if id in registry.ids() and registry.default().entry(id).origin == "nodegraph":
        raise CommandError(f"new processor {name}: nodegraph has a processor of this id; choose another name")
    top = Path(folder)
    stem = top.joinpath(*parts)
    source, test = stem.with_suffix(".glsl" if glsl else ".py"), top / "tests" / f"test_{'_'.join(parts)}.py"
    for path in (stem.with_suffix(".py"), stem.with_suffix(".glsl"), test):
        if path.exists():
            raise CommandError(f"new processor {name}: {path} exists already; nothing was written")
    texts = {source: _GLSL if glsl else _PYTHON, test: _GLSL_TEST if glsl else _PYTHON_TEST}
    for path, text in texts.items():
        formats.make_folder(path.parent)
        with formats.replacing(path) as part:
            filled = text if path.suffix == ".glsl" else text.format(name=camel(parts[-1]), id=id)
            part.write_text(filled, "utf-8")
    return [source, test]


def copy_processor(id: str, folder: str | Path) -> tuple[list[Path], str]:
    """Copy a processor into a plug-in folder, with its kernels and what they include; return the files and its new id.

    ``filter.blur`` becomes ``filter.my_blur``. Kernels lie in ``shaders/`` of the folder, where its processors find
    them before the built-in ones. Raises CommandError or UnknownProcessor.
    """
    original = registry.find(id)
    source, home = Path(original.file), locations.plugin_folder(Path(folder), "")
    kernels_at = home.shaders[0] if len(home.shaders) > 2 else Path(folder) / "shaders"
    category, _, stem = original.id.rpartition(".")
    taken = set(registry.ids())
    names = (f"my_{stem}" if n == 1 else f"my_{stem}_{n}" for n in itertools.count(1))
    parts = [*filter(None, category.split("."))]
    parts.append(next(name for name in names if ".".join([*parts, name]) not in taken))
    old, new = original.id.replace(".", "/"), "/".join(parts)
    text = re.sub(
        r"(?im)^//\s*formerly:.*\n|^\s*formerly\b[^=\n]*=\s*(?:\([^)]*\)|[^\n]*)\n", "", source.read_text("utf-8")
    )
    texts: dict[Path, str] = {}
    if source.suffix == ".py":
        # A kernel that is called after the processor is called after the copy.
        text = re.sub(rf"([\"']){old}\1", rf"\g<1>{new}\1", text)
        text = re.sub(rf"\b{original.__name__}\b", camel(parts[-1]), text)
        for kernel in original.kernels:
            found = kernel_source(original, kernel)
            for short, place in zip(found.files, found.paths, strict=True):
                own = f"{new}.glsl" if short == f"{old}.glsl" else short
                texts[kernels_at / own] = Path(place).read_text("utf-8")
    texts[home.processors.joinpath(*parts).with_suffix(source.suffix)] = text
    written = [path for path in texts if not path.exists()]
    for path in written:
        formats.make_folder(path.parent)
        with formats.replacing(path) as part:
            part.write_text(texts[path], "utf-8")
    return written, ".".join(parts)
