"""What this machine can run kernels on, and which package brings what is missing: data for ``nodegraph check``."""

from __future__ import annotations

import importlib.util
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
    from nodegraph.compute import cl as opencl

    try:
        cl = opencl.import_pyopencl()
    except DeviceError as error:
        return [Finding(name, False, str(error), cure="pip install pyopencl") for name in ("cl", "cl64")]
    findings = []
    for name in ("cl", "cl64"):
        found = [device for device in opencl.drivers() if name == "cl" or device.double_fp_config]
        chosen = next((device for device in found if not opencl.lacks_linker(device)), None)
        for device in found:
            limits = {
                "object_bytes": int(device.max_mem_alloc_size),
                "global_bytes": int(device.global_mem_size),
                "units": int(device.max_compute_units),
                "version": device.version.strip(),
            }
            hardware = not device.type & cl.device_type.CPU
            text = opencl.describe_driver(device)
            if opencl.lacks_linker(device):
                findings.append(Finding(name, False, f"{text}: {opencl.LINKER}", cure="apt install binutils"))
            else:
                findings.append(Finding(name, True, text, hardware, device is chosen, limits))
        if not found:
            what = "no OpenCL driver is installed" if name == "cl" else "no OpenCL driver computes in double"
            findings.append(Finding(name, False, f"{name}: {what}", cure=opencl.PACKAGES))
    return findings
