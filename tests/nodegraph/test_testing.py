"""The contract tests find what they are there to find: each broken processor here fails exactly its check."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nodegraph import data, params, testing
from nodegraph.errors import DeviceError
from nodegraph.ports import Input, has_components
from nodegraph.processor import Processor
from nodegraph.testing import Bench, ContractError, samples
from nodegraph.testing.contract import CHECKS

GOOD = '''
"""A processor."""
import numpy as np
from nodegraph import Bool, Choice, Float, Input, Int, Output, Processor, Text
from nodegraph.data import Image, Volume


class Thing(Processor):
    """Add a number to a volume."""

    volume = Input(Volume, doc="Any volume.")
    result = Output(Volume, doc="Same grid.")
    number = Float(1.0, doc="What is added.")
    fine = Bool(False, doc="In double precision.")

    def process(self, volume, number, fine):
        return volume.with_data(volume.real("f8" if fine else "f4") + np.float32(number))
'''

BROKEN = {
    "documented": [('"""Add a number to a volume."""', ""), ("What is added.", "number")],
    "repeatable": [("+ np.float32(number))", "+ np.random.default_rng().random())")],
    "odd_inputs": [
        ("return volume", "assert volume.data.shape[0] > 1; return volume"),
        ("return volume", "assert np.isfinite(volume.data).all(); return volume"),
        ("return volume", "assert volume.dtype != np.uint8; return volume"),
        ("return volume", "assert volume.dtype != np.float64; return volume"),
    ],
    "every_choice": [("return volume", "assert not fine; return volume")],
    "light_import": [("import numpy as np", "import numpy as np\nimport nibabel")],
}  # fmt: skip


def load(folder: Path, text: str = GOOD, name: str = "thing") -> type[Processor]:
    (folder / f"{name}.py").write_text(text)
    return testing.processor_of(folder, name)


def check_of(processor: type[Processor], name: str, **keywords: Any) -> Callable[[], None]:
    return next(check for check in testing.contract(processor, **keywords) if check.name == name)


def test_a_good_processor_passes_every_check(tmp_path: Path) -> None:
    testing.verify(load(tmp_path))


def test_checks_are_named(tmp_path: Path) -> None:
    names = [str(check) for check in testing.contract(load(tmp_path))]
    assert names == [f"thing-{name}" for name in CHECKS]
    assert "thing-light_import" not in [str(check) for check in testing.contract(load(tmp_path), imports=False)]


@pytest.mark.parametrize(
    ("name", "old", "new"), [(name, old, new) for name, pairs in BROKEN.items() for old, new in pairs]
)
def test_a_broken_processor_fails_its_check(tmp_path: Path, name: str, old: str, new: str) -> None:
    assert old in GOOD
    processor = load(tmp_path, GOOD.replace(old, new))
    with pytest.raises(ContractError, match=r"Thing|thing"):
        check_of(processor, name)()


def test_verify_lists_everything_that_is_broken(tmp_path: Path) -> None:
    text = GOOD.replace("What is added.", "number").replace("return volume", "assert not fine; return volume")
    with pytest.raises(ContractError, match=r"(?s)documented: Thing\.number.*every_choice: Thing: fine = True"):
        testing.verify(load(tmp_path, text))


def test_a_class_that_does_not_bear_its_id_is_found(tmp_path: Path) -> None:
    processor = load(tmp_path)
    processor.id = "filter.other"
    with pytest.raises(ContractError, match="class, file and id share one name"):
        check_of(processor, "id_is_path")()
    processor.id = "filter.thing"
    with pytest.raises(ContractError, match="is not the path"):
        check_of(processor, "id_is_path")()


class Clumsy(params.Float):
    """A kind of parameter that forgets what it is told."""

    def encode(self, value: float) -> float | str:
        return 1.0


def test_a_value_that_json_loses_and_a_deaf_fingerprint_are_found() -> None:
    class Thing(Processor):
        """A thing."""

        image = Input(data.Image, doc="Picture.")
        result = Input(data.Image, doc="Picture.", required=False)
        number = Clumsy(1.0, doc="A number.")

        def process(self, image: Any, result: Any, number: Any) -> None:
            return None

    with pytest.raises(ContractError, match=r"Thing\.number: .* does not survive JSON"):
        check_of(Thing, "json_round_trip")()
    with pytest.raises(ContractError, match=r"Thing\.number: changing it does not change the fingerprint"):
        check_of(Thing, "fingerprinted")()


def test_an_input_that_is_changed_is_found() -> None:
    class Thing(Processor):
        """A thing."""

        table = Input(data.Table, doc="Columns.")
        result = params.Float(1.0, doc="Nothing.")

        def process(self, table: Any, result: Any) -> None:
            column = table["value"]
            column.base.setflags(write=True) if column.base is not None else None
            raw = column.__array_interface__["data"][0]
            import ctypes

            ctypes.c_double.from_address(raw).value += 1.0

    with pytest.raises(ContractError, match=r"Thing\.table: process\(\) changed its input"):
        check_of(Thing, "repeatable")()


def test_an_output_that_differs_when_alone_is_found() -> None:
    from nodegraph.ports import Output

    class Thing(Processor):
        """A thing."""

        one = Output(float, doc="A number.")
        two = Output(float, doc="A number.")

        def process(self, *, wanted: Any) -> Any:
            return self.Outputs(1.0, float(len(wanted)))

    with pytest.raises(ContractError, match=r"Thing\.two: differs when it is wanted alone"):
        check_of(Thing, "each_output_alone")()


def test_a_missing_kernel_is_found(tmp_path: Path) -> None:
    text = GOOD.replace("    volume = Input", '    kernels = ("filter/nowhere",)\n    volume = Input')
    with pytest.raises(ContractError, match="there is no such shader file"):
        check_of(load(tmp_path, text), "kernels_found")()


def test_values_stand_in_where_samples_do_not_do(tmp_path: Path) -> None:
    text = GOOD.replace("return volume", "assert volume.dims == (1, 2, 3); return volume")
    processor = load(tmp_path, text)
    check_of(processor, "repeatable", values={"volume": np.zeros((3, 2, 1), "f4")})()
    with pytest.raises(ContractError, match="AssertionError"):
        check_of(processor, "repeatable")()


def test_the_bench_gives_every_service(device: Any, devices: Any) -> None:
    class Thing(Processor):
        """A thing."""

        image = Input(data.Image, doc="Picture.", required=False)
        result = params.Float(1.0, doc="Nothing.")

        def process(
            self,
            image: Any,
            result: Any,
            *,
            size: Any,
            quality: Any,
            wanted: Any,
            device: Any,
            progress: Any,
            memo: Any,
        ) -> None:
            progress(0.5, "half")
            assert memo(max, 1, 2) == 2
            assert (size, quality, wanted) == ((3, 2), "final", frozenset())
            assert device.name in ("gl", "cl", "cl64")

    assert Bench(devices, device.name).call(Thing, {}, size=(3, 2)) == {}


def test_the_bench_follows_a_generator() -> None:
    from nodegraph.ports import Output

    class Thing(Processor):
        """A thing."""

        result = Output(float, doc="A number.")

        def process(self) -> Iterator[Any]:
            yield None
            yield 1.0
            yield 2.0
            yield None

    assert Bench().call(Thing, {}) == {"result": 2.0}
    assert testing.call(Thing) == 2.0


def test_an_error_that_is_not_ours_to_raise_breaks_the_contract() -> None:
    class Thing(Processor):
        """A thing."""

        image = Input(data.Image, doc="Picture.")

        def process(self, image: Any) -> None:
            raise DeviceError("no memory")

    with pytest.raises(ContractError, match="raises DeviceError: no memory"):
        check_of(Thing, "repeatable")()
    assert isinstance(Bench().outcome(Thing, {"image": samples.sample(Thing.inputs["image"])}), DeviceError)


@pytest.mark.parametrize("name", ["Volume", "Labels", "Image", "Mesh", "Table", "Camera", "Light", "Plane"])
def test_every_type_has_a_sample_and_odd_ones(name: str) -> None:
    port = Input(getattr(data, name), doc="x")
    assert isinstance(samples.sample(port), getattr(data, name))
    assert isinstance(samples.sample(Input(getattr(data, name), doc="x", many=True)), tuple)
    if name in ("Volume", "Labels", "Image"):
        assert len(list(samples.odd(port))) >= 4


def test_samples_obey_conditions() -> None:
    port = Input(data.Volume, doc="x", accepts=has_components(3))
    assert samples.sample(port).components == 3
    kinds = dict(samples.odd(port))
    assert {"volume of f8", "volume of i2", "volume of u1", "volume with nan and inf", "one voxel", "one slice"} <= set(
        kinds
    )
    assert kinds["volume of i2"]().components == 3

    class Unheard:
        """A type without samples."""

    with pytest.raises(TypeError, match="give one in values="):
        samples.sample(Input(Unheard, doc="x"))


@pytest.mark.parametrize("kind", sorted(params.kinds()))
def test_every_kind_has_a_second_value(kind: str) -> None:
    declared = params.Choice("a", "b", doc="x") if kind == "Choice" else None
    defaults = {"Float": 1.0, "Int": 1, "Bool": True, "Vector": (0.0, 1.0), "Interval": (0.0, 1.0)}
    made = declared or params.kind(kind)(*([defaults[kind]] if kind in defaults else []), doc="x")
    other = samples.another(made)
    assert made.check(other, "x") == other
    assert other != made.default


def test_a_kind_with_one_value_is_told_what_to_do() -> None:
    with pytest.raises(TypeError, match=r"give Float another\(\)"):
        samples.another(params.Float(1.0, min=1.0, max=1.0, doc="x"))


def test_a_sweep_names_what_is_unavailable(tmp_path: Path) -> None:
    load(tmp_path)
    assert [processor.id for processor in testing.processors_of(tmp_path)] == ["thing"]
    (tmp_path / "bad.py").write_text("x = (")
    with pytest.raises(ContractError, match="bad: line 1"):
        testing.processors_of(tmp_path)


def test_heavy_imports_are_named(tmp_path: Path) -> None:
    text = GOOD.replace("import numpy as np", "import numpy as np\nimport nrrd")
    assert testing.heavy_imports([load(tmp_path, text)]) == {"thing": ["nrrd"]}
