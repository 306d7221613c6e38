"""What this machine can run kernels on, and which package brings what is missing: data for ``nodegraph check``."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from dataclasses import dataclass, field
from typing import Any

from nodegraph.errors import DeviceError


@dataclass(frozen=True)
class Finding:
    """One device, or the lack of one. ``cure`` names the package to install, "" when nothing is missing."""

    name: str
    available: bool
    description: str
    hardware: bool = False
    chosen: bool = False
    limits: dict[str, Any] = field(default_factory=dict)
    cure: str = ""
    notes: tuple[str, ...] = ()


def survey() -> list[Finding]:
    """Look at every device without keeping any open: gl, then each OpenCL driver, best first, for cl and cl64."""
    return [_opengl(), *_opencl()]


def _opengl() -> Finding:
    from nodegraph.compute.gl import PACKAGES, GLDevice

    try:
        device = GLDevice()
    except DeviceError as error:
        cure = "pip install moderngl" if importlib.util.find_spec("moderngl") is None else PACKAGES
        return Finding("gl", False, str(error), cure=cure)
    notes = []
    if device.limits["filtering"] and device.is_hardware:
        notes.append("NODEGRAPH_FILTER=hardware: volumes are interpolated with the 8-bit weights of texture units")
    found = Finding("gl", True, device.description, device.is_hardware, True, dict(device.limits), notes=tuple(notes))
    device.close()
    return found


def _opencl() -> list[Finding]:
    from nodegraph.compute.cl import PACKAGES, describe_driver, drivers, import_pyopencl

    try:
        cl = import_pyopencl()
    except DeviceError as error:
        return [Finding(name, False, str(error), cure="pip install pyopencl") for name in ("cl", "cl64")]
    notes = _linker_notes()
    findings = []
    for name in ("cl", "cl64"):
        found = [device for device in drivers() if name == "cl" or device.double_fp_config]
        for rank, device in enumerate(found):
            limits = {
                "object_bytes": int(device.max_mem_alloc_size),
                "global_bytes": int(device.global_mem_size),
                "units": int(device.max_compute_units),
                "version": device.version.strip(),
            }
            hardware = not device.type & cl.device_type.CPU
            findings.append(
                Finding(name, True, describe_driver(device), hardware, rank == 0, limits, notes=tuple(notes))
            )
        if not found:
            what = "no OpenCL driver is installed" if name == "cl" else "no OpenCL driver computes in double"
            findings.append(Finding(name, False, f"{name}: {what}", cure=PACKAGES, notes=tuple(notes)))
    return findings


def _linker_notes() -> list[str]:
    """Say what PoCL lacks: the wheel of it links each kernel with the system's linker."""
    if sys.platform.startswith("linux") and importlib.util.find_spec("pocl_binary_distribution") is not None:
        if shutil.which("ld") is None:
            return ["pocl-binary-distribution needs the program ld to build kernels: apt install binutils"]
    return []
