"""Which device runs what: opened when first wanted, chosen by name or by what this machine has."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from nodegraph.compute.device import Device
from nodegraph.compute.memory import Budget
from nodegraph.errors import DeviceError, DeviceMissing, near_miss

NAMES = ("auto", "gl", "cl", "cl64")


class Choice(NamedTuple):
    """A device and why it was taken, in one sentence for the user."""

    device: Device
    reason: str


class Devices:
    """The devices of one engine. They belong to the thread that calls `choose` first.

    ``host_budget`` is the result cache's budget: a device whose memory is the host's (llvmpipe, OpenCL on a CPU)
    shares it; others get ``device_bytes`` of their own. ``call`` runs a function on the devices' thread and waits;
    ``on_pressure(bytes)`` asks the cache to let cheap results go.
    """

    def __init__(
        self,
        *,
        host_budget: Budget | None = None,
        device_bytes: int | None = None,
        roots: Sequence[Path | str] | None = None,
        call: Callable[[Callable[[], None]], object] | None = None,
        on_pressure: Callable[[int], object] | None = None,
    ) -> None:
        self.host_budget = host_budget
        self.device_bytes = device_bytes
        self.roots = roots
        self.call = call
        self.on_pressure = on_pressure
        self._open: dict[str, Device] = {}
        self._missing: dict[str, DeviceError] = {}

    @property
    def opened(self) -> tuple[Device, ...]:
        """Devices that are open now."""
        return tuple(self._open.values())

    def choose(self, name: str = "auto") -> Choice:
        """Return the device of that name, opening it if need be, and the reason. DeviceMissing says what to install."""
        if name not in NAMES:
            raise DeviceMissing(f"{name}: no such device{near_miss(name, NAMES)}; choose one of {', '.join(NAMES)}")
        if name != "auto":
            device = self._get(name)
            return Choice(device, f"{name}, as asked: {device.description}")
        for candidate in self._preference():
            device = self._get(candidate)
            kind = "hardware" if device.is_hardware else "the faster software device here"
            if candidate == "cl" and not device.is_hardware:
                kind = f"software, since {self._missing['gl']}" if "gl" in self._missing else "software"
            return Choice(device, f"{candidate}, {kind}: {device.description}")
        reasons = "; ".join(str(error) for error in self._missing.values())
        raise DeviceMissing(f"auto: no device runs on this machine: {reasons}")

    def next_after(self, device: Device) -> Choice | None:
        """Return the device on which a node that failed on ``device`` is tried once more, or None.

        Nothing replaces cl64: another precision would be another result.
        """
        if device.name == "cl64":
            return None
        for candidate in self._preference():
            if candidate != device.name:
                other = self._get(candidate)
                return Choice(other, f"{candidate}, after {device.name} failed: {other.description}")
        return None

    def drop(self, device: Device) -> None:
        """Close one device; whoever asks for its name next gets a new one."""
        if self._open.get(device.name) is device:
            del self._open[device.name]
        device.close()

    def close(self) -> None:
        """Close every device; their memory then holds nothing."""
        for device in self._open.values():
            device.close()
        self._open.clear()
        self._missing.clear()

    def _preference(self) -> Iterator[str]:
        """Names that can be opened, best first: hardware OpenGL, hardware OpenCL, llvmpipe, OpenCL on the CPU.

        Opening OpenCL costs a third of a second, so it is put off where it cannot come first.
        """
        from nodegraph.compute.cl import may_have_hardware

        gl = self._try("gl")
        # llvmpipe runs a ray-caster 1.5 to 1.8 times as fast as PoCL; softpipe and its like are far slower than both.
        good = gl is not None and "llvmpipe" in gl.description.lower()
        if gl is not None and (gl.is_hardware or (good and not may_have_hardware())):
            yield "gl"
            gl = None
        cl = self._try("cl")
        if cl is not None and (cl.is_hardware or not good):
            yield "cl"
            cl = None
        if gl is not None:
            yield "gl"
        if cl is not None:
            yield "cl"

    def _try(self, name: str) -> Device | None:
        with contextlib.suppress(DeviceError):
            return self._get(name)
        return None

    def _get(self, name: str) -> Device:
        if name in self._missing:
            raise self._missing[name]
        device = self._open.get(name)
        if device is None:
            try:
                device = open_device(name, self.roots)
            except DeviceError as error:
                self._missing[name] = error
                raise
            shared = device.is_host_memory and self.host_budget is not None
            device.memory.join(self.host_budget if shared and self.host_budget else Budget(self.device_bytes))
            device.memory.on_pressure = self.on_pressure
            device.call = self.call
            self._open[name] = device
        return device


def open_device(name: str, roots: Sequence[Path | str] | None = None) -> Device:
    """Open gl, cl or cl64 on the calling thread, with no budget. DeviceMissing says what to install."""
    if name == "gl":
        from nodegraph.compute.gl import GLDevice

        return GLDevice(roots=roots)
    from nodegraph.compute.cl import CLDevice

    return CLDevice("double" if name == "cl64" else "float", roots=roots)
