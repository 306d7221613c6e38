"""Finding processors: ids from paths, plug-in folders, failures that stop nothing, reloading, old names."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nodegraph
from nodegraph import locations, params, plugins, ports, registry
from nodegraph.errors import UnknownProcessor
from nodegraph.processor import Processor
from nodegraph.registry import Registry

ROOT = Path(__file__).resolve().parents[2]

PLUGIN = '''
"""Multiply a volume."""
from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Volume


class {name}(Processor):
    """Multiply every voxel."""

    {extra}
    volume = Input(Volume, doc="Field.")
    scaled = Output(Volume, doc="Same grid.")
    factor = Float({default}, doc="Factor.")

    def process(self, volume, factor):
        return volume.with_data(volume.data * factor)
'''


def write(path: Path, name: str = "Scale", default: float = 2.0, extra: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(PLUGIN.format(name=name, default=default, extra=extra))
    return path


def registry_of(*folders: Path) -> Registry:
    return Registry([locations.plugin_folder(folder, str(folder)) for folder in folders])


def reasons(found: Registry) -> dict[str, str]:
    return {entry["id"]: entry["unavailable"] for entry in found.catalogue() if "unavailable" in entry}


def test_a_file_in_a_folder_is_a_processor(tmp_path: Path) -> None:
    path = write(tmp_path / "filter" / "scale.py")
    found = registry_of(tmp_path)
    assert found.ids() == ["filter.scale"]
    scale = found.find("filter.scale")
    assert scale.id == "filter.scale"
    assert scale.__name__ == "Scale"
    assert scale.file == str(path)
    volume = nodegraph.data.Volume(np.ones((2, 2, 2), "f4"))
    assert float(scale().process(volume, 3.0).data[0, 0, 0]) == 3.0
    assert found.find("filter.scale") is scale


def test_listing_imports_nothing(tmp_path: Path) -> None:
    path = write(tmp_path / "scale.py")
    path.write_text("raise RuntimeError('imported')")
    assert registry_of(tmp_path).ids() == ["scale"]


def test_only_the_file_asked_for_is_imported(tmp_path: Path) -> None:
    write(tmp_path / "a" / "scale.py")
    (tmp_path / "a" / "bomb.py").write_text("raise RuntimeError('imported')")
    found = registry_of(tmp_path)
    found.find("a.scale")
    assert [entry.reason for entry in found.entries()] == ["", ""]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("import surely_not_installed_here", "needs the package 'surely_not_installed_here': pip install"),
        ("import skimage_of_nobody.filters", "needs the package 'skimage_of_nobody'"),
        ("x = (", "line 1: "),
        ("x = 1\nraise ValueError('no such\\nluck')", "line 2: ValueError: no such luck"),
        ("import sys; sys.exit(3)", "SystemExit: 3"),
        ("x = 1", r"the file defines no processor; expected class Broken\(Processor\)"),
        (
            PLUGIN.format(name="Other", default=1.0, extra=""),
            "the class is called Other; after its file it must be called Broken",
        ),
        (
            PLUGIN.format(name="Broken", default=1.0, extra="") + "\n\nclass Second(Broken):\n    pass\n",
            r"the file defines 2 processors \(Broken, Second\)",
        ),
        (PLUGIN.format(name="Broken", default="'x'", extra=""), "default of Float: expected a number, got 'x'"),
        (PLUGIN.format(name="Broken", default=1.0, extra="formerly = 'x'"), "Broken.formerly: give a tuple"),
    ],
)
def test_a_broken_plugin_is_listed_and_stops_nothing(tmp_path: Path, text: str, reason: str) -> None:
    write(tmp_path / "filter" / "scale.py")
    (tmp_path / "filter" / "broken.py").write_text(text)
    found = registry_of(tmp_path)
    listed = reasons(found)
    assert list(listed) == ["filter.broken"]
    assert "\n" not in listed["filter.broken"]
    with pytest.raises(UnknownProcessor, match=rf"^filter.broken: this processor is unavailable: .*{reason}"):
        found.find("filter.broken")
    assert found.find("filter.scale").id == "filter.scale"


def test_helpers_of_a_plugin_do_not_count_as_processors(tmp_path: Path) -> None:
    text = PLUGIN.format(name="_Shared", default=1.0, extra="") + textwrap.dedent(
        """

        class Scale(_Shared):
            \"\"\"The one.\"\"\"
        """
    )
    (tmp_path / "scale.py").write_text(text)
    assert registry_of(tmp_path).find("scale").__name__ == "Scale"


def test_what_is_no_plugin_is_passed_over(tmp_path: Path) -> None:
    write(tmp_path / "filter" / "scale.py")
    for name in ("_private.py", ".hidden.py", "test_scale.py", "conftest.py", "setup.py", "notes.txt"):
        (tmp_path / name).write_text("raise RuntimeError")
    for folder in ("tests", "shaders", "__pycache__", ".git", "environment"):
        write(tmp_path / folder / "scale.py")
    (tmp_path / "environment" / "pyvenv.cfg").write_text("")
    found = registry_of(tmp_path)
    assert found.ids() == ["filter.scale"]
    assert reasons(found) == {}


def test_a_bad_file_name_is_listed_with_the_reason(tmp_path: Path) -> None:
    write(tmp_path / "My-Filter.py")
    assert "is no name of a processor" in reasons(registry_of(tmp_path))["My-Filter"]


def test_the_first_folder_keeps_an_id(tmp_path: Path) -> None:
    first = write(tmp_path / "one" / "filter" / "scale.py", default=1.0)
    write(tmp_path / "two" / "filter" / "scale.py", default=2.0)
    found = registry_of(tmp_path / "one", tmp_path / "two")
    assert found.find("filter.scale").params["factor"].default == 1.0
    assert reasons(found) == {"filter.scale": f"the id filter.scale is taken by {first}"}
    assert len(found.catalogue()) == 2


def test_a_folder_that_is_not_there_is_listed(tmp_path: Path) -> None:
    found = registry_of(tmp_path / "nowhere")
    assert reasons(found) == {"nowhere": "this folder does not exist"}


def test_unknown_ids_name_the_near_miss(tmp_path: Path) -> None:
    write(tmp_path / "filter" / "scale.py")
    with pytest.raises(UnknownProcessor, match=r"filter\.scael: no such processor \(did you mean 'filter\.scale'\?\)"):
        registry_of(tmp_path).find("filter.scael")


def test_old_names_find_the_new_processor_without_importing_others(tmp_path: Path) -> None:
    write(tmp_path / "filter" / "scale.py", extra='formerly = ("filter.multiply", "filter.times")')
    (tmp_path / "filter" / "bomb.py").write_text("raise RuntimeError('imported')")
    found = registry_of(tmp_path)
    assert found.find("filter.times").id == "filter.scale"
    assert all(entry.reason == "" for entry in found.entries())


def test_a_kernel_of_the_same_stem_belongs_to_the_python_file(tmp_path: Path) -> None:
    write(tmp_path / "filter" / "scale.py")
    (tmp_path / "filter" / "scale.glsl").write_text("field3 volume;\nfloat voxel(ivec3 at) { return 0.0; }")
    write(tmp_path / "filter" / "plain.py", name="Plain")
    write(tmp_path / "filter" / "named.py", name="Named", extra='kernels = ("common/x",)')
    found = registry_of(tmp_path)
    assert found.ids() == ["filter.named", "filter.plain", "filter.scale"]
    assert found.find("filter.scale").kernels == ("filter/scale",)
    assert found.find("filter.plain").kernels == ()
    assert found.find("filter.named").kernels == ("common/x",)
    assert tmp_path in found.shader_roots(found.find("filter.scale"))


def test_a_plugin_folder_may_hold_processors_and_shaders_apart(tmp_path: Path) -> None:
    write(tmp_path / "processors" / "filter" / "scale.py")
    (tmp_path / "shaders" / "filter").mkdir(parents=True)
    (tmp_path / "shaders" / "filter" / "scale.glsl").write_text("")
    found = registry_of(tmp_path)
    assert found.ids() == ["filter.scale"]
    assert found.find("filter.scale").kernels == ("filter/scale",)
    assert found.shader_roots(found.find("filter.scale"))[0] == tmp_path / "shaders"
    assert found.shader_roots()[0] == locations.shaders()


def test_reload_takes_the_new_text_and_keeps_the_old_class_when_it_fails(tmp_path: Path) -> None:
    path = write(tmp_path / "scale.py", default=2.0)
    found = registry_of(tmp_path)
    old = found.find("scale")
    write(path, default=3.0)  # the same length, within the same second: compiled bytes would look fresh
    new = found.reload("scale")
    assert new is not old
    assert new.params["factor"].default == 3.0
    assert new.source_digest != old.source_digest
    path.write_text("raise ValueError('half typed')")
    with pytest.raises(UnknownProcessor, match="line 1: ValueError: half typed"):
        found.reload("scale")
    assert found.find("scale") is new
    assert sys.modules[new.__module__].__dict__["Scale"] is new


def test_reload_mends_a_broken_file(tmp_path: Path) -> None:
    path = tmp_path / "scale.py"
    path.write_text("x = (")
    found = registry_of(tmp_path)
    with pytest.raises(UnknownProcessor):
        found.find("scale")
    write(path)
    assert found.reload("scale") is found.find("scale")


def test_refresh_sees_new_files_and_keeps_classes(tmp_path: Path) -> None:
    write(tmp_path / "scale.py")
    found = registry_of(tmp_path)
    scale = found.find("scale")
    write(tmp_path / "shift.py", name="Shift")
    assert found.ids() == ["scale"]
    found.refresh()
    assert found.ids() == ["scale", "shift"]
    assert found.find("scale") is scale


def test_many_threads_get_one_class(tmp_path: Path) -> None:
    path = write(tmp_path / "scale.py")
    path.write_text("import time; time.sleep(0.05)\n" + path.read_text())
    found = registry_of(tmp_path)
    got: list[type[Processor]] = []
    threads = [threading.Thread(target=lambda: got.append(found.find("scale"))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == 8
    assert len(set(got)) == 1


def test_the_environment_names_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "one" / "mine.py", name="Mine")
    write(tmp_path / "two" / "yours.py", name="Yours")
    monkeypatch.setenv("NODEGRAPH_PATH", os.pathsep.join([str(tmp_path / "one"), "", str(tmp_path / "two")]))
    found = Registry()
    assert {"mine", "yours", "filter.gaussian_blur"} <= set(found.ids())
    assert found.entry("mine").origin == str(tmp_path / "one")
    assert found.entry("filter.gaussian_blur").origin == "nodegraph"


def test_entry_points_name_packages_that_are_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "surface_tools"
    write(package / "nodes" / "surface" / "smooth.py", name="Smooth")
    (package / "__init__.py").write_text("raise RuntimeError('imported')")
    info = tmp_path / "surface_tools-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: surface-tools\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[nodegraph.processors]\nsurface = surface_tools.nodes\nlost = surface_tools.nothing\n"
        "[nodegraph.measures]\nmean = statistics:fmean\nbad = surface_tools:measure\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    plugins.refresh()
    try:
        found = Registry()
        assert found.find("surface.smooth").__name__ == "Smooth"
        assert found.entry("surface.smooth").origin == "surface-tools"
        assert any("neither a package nor a folder" in reason for reason in reasons(found).values())
        measures = {plugin.name: plugin for plugin in plugins.discover("nodegraph.measures")}
        assert measures["mean"].object([1.0, 2.0]) == 1.5
        assert measures["bad"].object is None
        assert "imported" in measures["bad"].reason
        assert list(plugins.failures()) == ["nodegraph.measures/bad"]
    finally:
        plugins.refresh()


def test_packages_bring_parameter_kinds_and_port_types(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "angle_tools.py").write_text(
        "from nodegraph import Float, PortType\n"
        "class Angle(Float):\n    'Degrees.'\n"
        "class Curve:\n    'Points in a row.'\n"
        "CURVE = PortType(Curve, 'Curve', '#336699', 'ring', repr, 'Points in a row.')\n"
    )
    info = tmp_path / "angle_tools-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: angle-tools\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[nodegraph.parameter_kinds]\nangle = angle_tools:Angle\n[nodegraph.port_types]\ncurve = angle_tools:CURVE\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(ports, "_asked_plugins", False)
    monkeypatch.setattr(ports, "_TYPES", dict(ports._TYPES))
    plugins.refresh()
    try:
        assert params.kind("Angle").__name__ == "Angle"
        assert params.stand_in("Angle", 90.0).check(45, "variables.turn") == 45.0
        curve = sys.modules["angle_tools"].Curve
        assert ports.port_type(curve).color == "#336699"
        assert "Curve" in [record.name for record in ports.port_types()]
    finally:
        plugins.refresh()
        sys.modules.pop("angle_tools", None)


def test_an_unknown_group_is_refused() -> None:
    with pytest.raises(ValueError, match="no such plug-in group"):
        plugins.discover("nodegraph.procesors")


def test_a_missing_package_is_named_as_it_is_installed() -> None:
    error = ModuleNotFoundError("No module named 'skimage.filters'", name="skimage.filters")
    assert plugins.explain_failure(error) == "needs the package 'skimage': pip install scikit-image"


def test_every_built_in_processor_loads() -> None:
    listed = {entry["id"]: entry.get("unavailable", "") for entry in Registry([locations.built_in()]).catalogue()}
    assert "filter.gaussian_blur" in listed
    assert {id: reason for id, reason in listed.items() if reason} == {}


def test_processors_are_reached_as_attributes() -> None:
    blur = nodegraph.processors.filter.GaussianBlur
    assert blur is registry.find("filter.gaussian_blur")
    assert "GaussianBlur" in dir(nodegraph.processors.filter)
    assert "filter" in dir(nodegraph.processors)
    with pytest.raises(AttributeError, match=r"did you mean 'GaussianBlur'"):
        _ = nodegraph.processors.filter.GausianBlur


def test_the_catalogue_is_json() -> None:
    assert json.loads(json.dumps(registry.catalogue(), allow_nan=False))


def run_python(text: str) -> Any:
    result = subprocess.run(
        [sys.executable, "-c", text],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


@pytest.mark.slow
def test_importing_nodegraph_loads_numpy_and_the_cheap_part_of_the_standard_library() -> None:
    loaded = run_python("import sys, json, nodegraph; print(json.dumps(sorted(sys.modules)))")
    slow = {"asyncio", "multiprocessing", "concurrent.futures", "importlib.metadata", "json", "tempfile", "subprocess"}
    ours = {
        "nodegraph.registry", "nodegraph.plugins", "nodegraph.compute", "nodegraph.formats", "nodegraph.network",
        "nodegraph.engine", "nodegraph.scheduler", "nodegraph.cli",
    }  # fmt: skip
    before = set(run_python("import sys, json, numpy; print('[]')")) | set(
        run_python("import sys, numpy; names = sorted(sys.modules); import json; print(json.dumps(names))")
    )
    before |= {"json", "json.decoder", "json.encoder", "json.scanner"}  # the question itself
    new = set(loaded) - before
    assert not new & (slow | ours)
    packages = {name.partition(".")[0] for name in new} - {"nodegraph", "numpy"}
    assert packages <= set(sys.stdlib_module_names) | {"_frozen_importlib_external"}


def test_a_built_in_processor_is_found_without_reading_package_metadata() -> None:
    loaded = run_python(
        "import sys, json; from nodegraph import registry; registry.find('geometry.proxy_box');"
        "print(json.dumps([name for name in sys.modules]))"
    )
    assert "importlib.metadata" not in loaded
    assert [name for name in loaded if name.startswith("nodegraph.processors.")] == [
        "nodegraph.processors.geometry.proxy_box"
    ]
