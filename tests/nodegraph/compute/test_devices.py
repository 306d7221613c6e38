"""Choosing a device, saying what is missing, and sharing a budget with the host."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nodegraph.compute import Budget, Devices, survey
from nodegraph.compute import cl as cl_module
from nodegraph.compute import gl as gl_module
from nodegraph.data import Volume
from nodegraph.errors import DeviceMissing
from nodegraph.shaders import Source

ONE = Source.of("field3 v;\nfloat voxel(ivec3 at) { return 1.0 + fetch3(v, at); }", "tests/one.glsl")


def without_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    import moderngl

    def refuse(**_settings: Any) -> Any:
        raise Exception("libEGL.so: cannot open shared object file")  # what glcontext raises

    monkeypatch.setattr(moderngl, "create_context", refuse)


def without_opencl(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cl_module, "drivers", list)


@pytest.fixture
def devices() -> Any:
    """Devices of this test's own: what is opened or missing here must not last."""
    own = Devices()
    yield own
    own.close()


def test_auto_prefers_llvmpipe_to_opencl_on_the_cpu(devices: Devices) -> None:
    device, reason = devices.choose()
    assert not device.is_hardware
    assert device.is_host_memory
    assert reason == f"gl, the faster software device here: {device.description}"
    assert "llvmpipe" in device.description
    assert devices.opened == (device,)  # OpenCL was not even loaded
    assert devices.choose("gl").device is device


def test_hardware_comes_first(devices: Devices) -> None:
    gl, cl = devices.choose("gl").device, devices.choose("cl").device
    cl.is_hardware = True
    devices_with_gpu = pytest.MonkeyPatch()
    devices_with_gpu.setattr(cl_module, "may_have_hardware", lambda: True)
    try:
        assert devices.choose().device is cl
        gl.is_hardware = True
        assert devices.choose().device is gl
    finally:
        devices_with_gpu.undo()


def test_without_opengl_auto_takes_opencl_and_says_why(devices: Devices, monkeypatch: pytest.MonkeyPatch) -> None:
    without_opengl(monkeypatch)
    with pytest.raises(
        DeviceMissing, match=r"libEGL.so: cannot open.*; get one with apt install libegl1 libgl1"
    ) as caught:
        devices.choose("gl")
    assert caught.value.exit_code == 2
    device, reason = devices.choose()
    assert device.name == "cl"
    assert "libegl1" in reason
    assert devices.next_after(device) is None


def test_without_opencl_the_package_is_named(devices: Devices, monkeypatch: pytest.MonkeyPatch) -> None:
    without_opencl(monkeypatch)
    for name in ("cl", "cl64"):
        with pytest.raises(DeviceMissing, match=rf"^{name}: .*pocl-opencl-icd.*pocl-binary-distribution"):
            devices.choose(name)
    assert devices.choose().device.name == "gl"
    assert devices.next_after(devices.choose().device) is None


def test_without_anything_every_reason_is_given(devices: Devices, monkeypatch: pytest.MonkeyPatch) -> None:
    without_opengl(monkeypatch)
    without_opencl(monkeypatch)
    with pytest.raises(DeviceMissing, match=r"^auto: no device runs on this machine: gl: .*libegl1.*cl: .*pocl"):
        devices.choose()


def test_a_device_without_double_is_no_cl64(monkeypatch: pytest.MonkeyPatch) -> None:
    class Single:
        double_fp_config = 0

    monkeypatch.setattr(cl_module, "drivers", lambda: [Single()])
    monkeypatch.setattr(cl_module, "lacks_linker", lambda device: False)
    with pytest.raises(DeviceMissing, match=r"^cl64: no OpenCL driver here computes in double"):
        cl_module.best_driver("double")


LINKER = """#!/bin/sh
# ld as a machine without a C compiler has it: it looks in none of the system's folders.
for word; do
    shift
    case $word in -L/usr/* | -L/lib/*) ;; *) set -- "$@" "$word" ;; esac
done
exec {ld} -nostdlib "$@"
"""

RUN_ONE = """
import numpy as np
from nodegraph.compute.cl import CLDevice
from nodegraph.data import Volume
from nodegraph.shaders import Source

one = Source.of("field3 v; float voxel(ivec3 at) { return 1.0 + fetch3(v, at); }", "tests/one.glsl")
print(CLDevice("float").run(one, (5, 4, 3), v=Volume(np.zeros((3, 4, 5), np.float32))).array.sum())
"""


@pytest.mark.slow
def test_opencl_needs_no_c_compiler(tmp_path: Path) -> None:
    linker = tmp_path / "ld"
    linker.write_text(LINKER.format(ld=shutil.which("ld")))
    linker.chmod(0o755)
    environment = {name: value for name, value in os.environ.items() if name != "LIBRARY_PATH"} | {
        "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}",
        "POCL_CACHE_DIR": str(tmp_path / "kernels"),  # nothing is linked that was linked before
    }
    done = subprocess.run([sys.executable, "-c", RUN_ONE], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "60.0\n"), done.stderr


@pytest.mark.slow
def test_opencl_needs_no_folder_to_keep_kernels_in(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    environment = {name: value for name, value in os.environ.items() if name != "POCL_CACHE_DIR"} | {
        "XDG_CACHE_HOME": str(tmp_path / "file"),
        "TMPDIR": str(tmp_path),
    }
    code = f"{RUN_ONE}\nprint(CLDevice('float').description)"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    total, description = done.stdout.splitlines()
    assert total == "60.0"
    assert f"since {tmp_path / 'file' / 'pocl' / 'kcache'} cannot be written to" in description
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_folder_of_empty_libraries_is_searched_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIBRARY_PATH", "/opt/own")
    for _twice in range(2):
        cl_module.import_pyopencl()
        assert os.environ["LIBRARY_PATH"] == f"/opt/own{os.pathsep}{cl_module.EMPTY_LIBRARIES}"
    monkeypatch.delenv("LIBRARY_PATH")
    cl_module.import_pyopencl()
    assert os.environ["LIBRARY_PATH"] == str(cl_module.EMPTY_LIBRARIES)


def test_unknown_names_are_refused_with_the_near_miss(devices: Devices) -> None:
    with pytest.raises(DeviceMissing, match=r"^cl46: no such device \(did you mean 'cl64'\?\); choose one of auto, gl"):
        devices.choose("cl46")


def test_the_next_device_after_a_failure(devices: Devices) -> None:
    gl, cl, cl64 = (devices.choose(name).device for name in ("gl", "cl", "cl64"))
    after_gl, after_cl = devices.next_after(gl), devices.next_after(cl)
    assert after_gl is not None
    assert after_cl is not None
    assert after_gl.device is cl
    assert after_gl.reason.startswith("cl, after gl failed: ")
    assert after_cl.device is gl
    assert devices.next_after(cl64) is None


def test_results_of_one_device_feed_another(devices: Devices) -> None:
    result: Any = np.zeros((3, 4, 5), np.float32)
    for name in ("gl", "cl", "cl64", "gl", "cl64"):
        result = devices.choose(name).device.run(ONE, (5, 4, 3), v=Volume(result))
    assert (result.array == 5.0).all()
    assert result.dtype == np.float64


def test_a_device_in_host_memory_shares_the_budget_of_the_cache() -> None:
    budget = Budget(1 << 30)
    budget.watch(lambda: 1000)
    devices = Devices(host_budget=budget, device_bytes=5)
    device = devices.choose("gl").device
    result = device.run(ONE, (5, 4, 3), v=np.zeros((3, 4, 5), np.float32))
    assert device.memory.budget is budget
    assert budget.used == 1000 + device.memory.bytes
    assert result.array[0, 0, 0] == 1.0
    devices.close()
    assert budget.used == 1000


def test_survey_lists_devices_drivers_and_limits() -> None:
    found = {(finding.name, finding.chosen): finding for finding in survey()}
    for name in ("gl", "cl", "cl64"):
        finding = found[name, True]
        assert finding.available
        assert finding.description
        assert finding.cure == ""
    assert found["gl", True].limits["texture_3d"] >= 2048
    assert found["cl", True].limits["object_bytes"] >= 1 << 27


def test_survey_names_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    without_opengl(monkeypatch)
    without_opencl(monkeypatch)
    found = {finding.name: finding for finding in survey()}
    assert not any(finding.available for finding in found.values())
    assert found["gl"].cure == "apt install libegl1 libgl1"
    assert "pocl-opencl-icd" in found["cl"].cure
    assert "pocl-binary-distribution" in found["cl64"].cure


def test_pocl_without_a_linker_is_no_device(devices: Devices, monkeypatch: pytest.MonkeyPatch) -> None:
    # It would end the whole process at its first kernel.
    monkeypatch.setattr(cl_module.shutil, "which", lambda name: None)
    found = [finding for finding in survey() if finding.name == "cl"]
    assert not any(finding.available for finding in found)
    assert {finding.cure for finding in found} == {"apt install binutils"}
    with pytest.raises(DeviceMissing, match=r"^cl: PoCL needs the program ld .* apt install binutils"):
        devices.choose("cl")


def test_hardware_filtering_is_chosen_by_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NODEGRAPH_FILTER", "hardware")
    monkeypatch.setattr(gl_module, "LLVMPIPE_OBJECT_BYTES", 1)
    device = gl_module.GLDevice()
    assert device.limits["filtering"] is True
    device.close()


def test_importing_devices_loads_no_graphics_library(root: Path) -> None:
    code = (
        "import sys, nodegraph.compute, nodegraph.compute.devices, nodegraph.compute.gl, nodegraph.compute.cl;"
        "print([m for m in ('moderngl', 'pyopencl', 'glcontext') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
