"""The examples of docs/write_a_processor.md work as they are printed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from nodegraph import testing
from nodegraph.data import Image, TransferFunction
from nodegraph.ports import Condition
from nodegraph.testing import Bench

pytestmark = pytest.mark.slow

PAGE = Path(__file__).resolve().parents[2] / "docs" / "write_a_processor.md"
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A plug-in folder with every example that begins with the name of its file."""
    for _, text in BLOCKS:
        first, _, rest = text.partition("\n")
        name = re.fullmatch(r"(?:#|//) (\w+/\w+\.(?:py|glsl))", first)
        if name:
            path = tmp_path / name[1]
            path.parent.mkdir(exist_ok=True)
            path.write_text(rest, "utf-8")
    return tmp_path


def test_every_example_keeps_the_contract(folder: Path, devices: object) -> None:
    found = testing.processors_of(folder)
    assert [processor.id for processor in found] == ["filter.extinction", "filter.sharpen", "image.gain"]
    for processor in found:
        testing.verify(processor, bench=Bench(devices))  # type: ignore[arg-type]


def test_the_python_example_sharpens(folder: Path) -> None:
    sharpen = testing.processor_of(folder, "filter.sharpen")
    array = np.zeros((7, 7, 7), "f4")
    array[3, 3, 3] = 1.0
    result = testing.call(sharpen, volume=array, sigma=1.0, amount=2.0)
    assert result.data[3, 3, 3] > 2.5
    assert result.data[3, 3, 2] < 0.0
    np.testing.assert_array_equal(testing.call(sharpen, volume=array, amount=0.0).data, array)


def test_the_kernels_do_what_they_say_on_each_device(folder: Path, devices: object, device: object) -> None:
    bench = Bench(devices, device.name)  # type: ignore[attr-defined, arg-type]
    gain = testing.processor_of(folder, "image.gain")
    image = Image(np.full((2, 3, 4), 0.25, "f4"))
    np.testing.assert_allclose(bench.call(gain, {"image": image})["result"].color[0, 0], (0.5, 0.5, 0.5, 0.25))
    extinction = testing.processor_of(folder, "filter.extinction")
    table = TransferFunction([(0.0, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.5)])
    array = np.linspace(0.0, 1.0, 24, dtype="f4").reshape(2, 3, 4)
    result = bench.call(extinction, {"volume": array, "table": table})["result"]
    np.testing.assert_allclose(result.data.ravel(), table.evaluate(array.ravel())[:, 3], atol=1e-4)


def test_the_small_examples() -> None:
    condition = next(text for _, text in BLOCKS if text.startswith("cubic ="))
    scope: dict[str, object] = {"Condition": Condition}
    exec(condition, scope)
    assert isinstance(scope["cubic"], Condition)
    migrate = next(text for _, text in BLOCKS if text.startswith("@staticmethod"))
    exec(migrate, scope)
    moved = scope["migrate"]
    assert isinstance(moved, staticmethod)
    assert moved({"width": 2.0}, 1) == {"sigma": 2.0}
    assert moved({}, 1) == {"sigma": 1.0}
    assert moved({"sigma": 3.0}, 2) == {"sigma": 3.0}


def test_the_page_names_every_kind_and_service() -> None:
    from nodegraph import params
    from nodegraph.signature import SERVICES

    page = PAGE.read_text("utf-8")
    assert [kind for kind in params.kinds() if f"`{kind}" not in page] == []
    assert [name for name in SERVICES if f"| `{name}` |" not in page] == []
