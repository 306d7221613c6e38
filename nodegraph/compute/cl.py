"""OpenCL 1.2 and later through pyopencl, in single or double precision.

Fields are buffers that kernels interpolate themselves: image samplers are 3 to 8 times slower on a CPU, and PoCL
reads half images wrongly. On a CPU the host's arrays are used where they lie.
"""

from __future__ import annotations

import atexit
import os
import re
import shutil
import sys
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nodegraph.compute import language
from nodegraph.compute.device import Device, Span
from nodegraph.compute.dispatch import BuildFailure, Job
from nodegraph.compute.language import Layout, Leaf, Matrix, Module, Storage
from nodegraph.compute.memory import Budget, Entry
from nodegraph.compute.spares import Owned
from nodegraph.compute.storage import Placement
from nodegraph.data.buffer import Array
from nodegraph.errors import DeviceError, DeviceMissing

PACKAGES = "apt install pocl-opencl-icd, or pip install pocl-binary-distribution"
LINKER = "PoCL needs the program ld to build kernels; get it with apt install binutils"
EMPTY_LIBRARIES = Path(__file__).with_name("empty_libraries")
GROUP = 16
"""Work items of a group, along x. One fixed shape: PoCL compiles a kernel anew for every shape of group. Its threads
take 32 groups at a time, so the end of a strip waits for at most 32 * GROUP items: 64 were 5 to 40 % slower."""

# How drivers write a place: clang "a.glsl:3:7: error: ...", PoCL "error: a.glsl:3:7: ...".
_ERRORS = (
    re.compile(r'^"?(?P<file>[^":\n]+)"?:(?P<line>\d+)(?::\d+)?: (?:fatal )?error: (?P<text>.*)$', re.M),
    re.compile(r'^error: "?(?P<file>[^":\n]+)"?:(?P<line>\d+)(?::\d+)?: (?P<text>.*)$', re.M),
)


class _Handle:
    """A built kernel and the host's side of its two blocks of uniforms."""

    def __init__(self, kernel: Any, reals: Array, ints: Array) -> None:
        self.kernel = kernel
        self.reals = reals
        self.ints = ints


class CLDevice(Device):
    """One OpenCL device. ``precision`` "float" is the device cl, "double" is cl64."""

    api: str
    least_columns = GROUP

    def __init__(
        self,
        precision: str = "float",
        budget: Budget | int | None = None,
        roots: Sequence[Path | str] | None = None,
        *,
        driver: Any = None,
    ) -> None:
        self.name = self.api = "cl64" if precision == "double" else "cl"
        self.real = np.dtype(np.float64 if precision == "double" else np.float32)
        cl = import_pyopencl()
        device = driver if driver is not None else best_driver(precision)
        super().__init__(budget, roots)
        self._cl = cl
        self._device = device
        try:
            self._context = cl.Context([device])
            self._queue = cl.CommandQueue(self._context)
        except cl.Error as error:
            raise DeviceError(f"{self.name}: {device.name.strip()} cannot be opened: {error}") from None
        self._blocks: list[Entry] = []
        self._event: Any = None
        self.description = describe_driver(device)
        self.is_hardware = not device.type & cl.device_type.CPU
        self.is_host_memory = not self.is_hardware
        self.limits = {
            "object_bytes": int(device.max_mem_alloc_size),
            "global_bytes": int(device.global_mem_size),
            "filtering": False,
        }

    # Text and programs.

    def print(self, module: Module, storages: dict[str, tuple[Storage, ...]]) -> tuple[str, Layout]:
        return language.print_opencl(module, storages, real="double" if self.name == "cl64" else "float")

    def _build(self, text: str, layout: Layout) -> tuple[Any, list[Owned]]:
        cl = self._cl
        # Unsuffixed constants would otherwise pull the whole kernel into double.
        options = ["-cl-single-precision-constant"] if self.name == "cl" else []
        try:
            with warnings.catch_warnings():
                # Drivers chatter about unused parameters; what matters arrives as an error.
                warnings.simplefilter("ignore")
                program = cl.Program(self._context, text).build(options=options)
        except cl.RuntimeError as error:
            for pattern in _ERRORS:
                found = pattern.search(str(error))
                if found:
                    raise BuildFailure(found["text"].strip(), found["file"], int(found["line"])) from None
            raise BuildFailure(str(error).strip().splitlines()[0]) from None
        kernel = cl.Kernel(program, layout.kernel)
        reals = np.zeros(max(1, layout.reals), self.real)
        ints = np.zeros(max(1, layout.ints), np.int32)
        # The driver's objects go with the last reference: dropping the program and kernel is their release.
        return _Handle(kernel, reals, ints), [(program, len(text), lambda: None), (kernel, 0, lambda: None)]

    # Buffers.

    def check_limits(self, shape: tuple[int, ...], nbytes: int, where: str) -> None:
        most = self.limits["object_bytes"]
        if nbytes > most:
            size = "x".join(map(str, shape[::-1]))
            raise DeviceError(
                f"{self.name}: {where}: {size} takes {nbytes} bytes, this driver's buffers hold at most {most}"
            )

    def _allocate(self, placement: Placement, where: str) -> Owned:
        flags = self._cl.mem_flags
        if self.is_host_memory:
            # The array is the result: reading it back will copy nothing.
            host = self.memory.host.empty(placement.nbytes)
            return self._buffer(flags.READ_WRITE | flags.USE_HOST_PTR, placement.nbytes, where, hostbuf=host)
        return self._buffer(flags.READ_WRITE, placement.nbytes, where)

    def _buffer(self, flags: int, nbytes: int, where: str, hostbuf: Any = None) -> Owned:
        try:
            if hostbuf is not None:
                buffer = self._cl.Buffer(self._context, flags, hostbuf=hostbuf)
            else:
                buffer = self._cl.Buffer(self._context, flags, nbytes)
        except (self._cl.Error, MemoryError) as error:
            raise DeviceError(f"{self.name}: {nbytes} bytes for {where} were refused by the driver: {error}") from None
        return buffer, nbytes, buffer.release

    def _upload(self, array: Array, placement: Placement, where: str) -> Owned:
        flags = self._cl.mem_flags
        if placement.is_verbatim(array) and self.is_host_memory:
            thing, _, release = self._buffer(
                flags.READ_ONLY | flags.USE_HOST_PTR, placement.nbytes, where, hostbuf=array
            )
            return thing, 0, release
        self.memory.reserve(placement.nbytes, where)
        if self.is_host_memory:
            host = self.memory.host.empty(placement.nbytes)
            whole = host.view(placement.dtype).reshape(*placement.shape, placement.texture_components)
            for first, slab in placement.slabs(array):
                whole[first : first + len(slab)] = slab
            return self._buffer(flags.READ_ONLY | flags.USE_HOST_PTR, placement.nbytes, where, hostbuf=host)
        thing, nbytes, release = self._buffer(flags.READ_ONLY, placement.nbytes, where)
        try:
            offset = 0
            for _, slab in placement.slabs(array):
                self._cl.enqueue_copy(self._queue, thing, np.ascontiguousarray(slab), dst_offset=offset)
                offset += slab.nbytes
        except self._cl.Error as error:
            release()
            raise DeviceError(f"{self.name}: the upload of {where} failed: {error}") from None
        return thing, nbytes, release

    def read(self, entry: Entry, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Array:
        cl = self._cl
        try:
            if self.is_host_memory:
                # Mapping tells the driver to make the host's view current; the array below is that very memory.
                mapped, event = cl.enqueue_map_buffer(
                    self._queue, entry.object, cl.map_flags.READ, 0, shape, dtype, is_blocking=False
                )
                event.wait()
                mapped.base.release(self._queue)
                self._queue.finish()
                host: Array = entry.object.hostbuf.view(dtype).reshape(shape)
                self.memory.resize(entry, 0)
                return host
            out = np.empty(shape, dtype)
            cl.enqueue_copy(self._queue, out, entry.object, is_blocking=False).wait()
            return out
        except cl.Error as error:
            raise DeviceError(f"{self.name}: reading a result failed: {error}") from None

    # One dispatch.

    def _begin(self, job: Job) -> None:
        cl, handle, layout = self._cl, job.program.handle, job.program.layout
        for leaf, numbers in zip(layout.leaves, job.values, strict=True):
            block = handle.reals if leaf.block == "real" else handle.ints
            block[leaf.offset : leaf.offset + leaf.length] = _as_stored(leaf, numbers)
        buffers = []
        for wanted, slot in zip(layout.slots, job.slots, strict=True):
            size = slot.placement.shape[::-1]
            handle.ints[wanted.size_offset : wanted.size_offset + len(size)] = size
            if wanted.mapping_offset >= 0:
                storage = slot.placement.storage
                handle.reals[wanted.mapping_offset : wanted.mapping_offset + 2] = storage.scale, storage.offset
            buffers.append(slot.entry.object)
        try:
            # Fresh buffers that start with their data cost PoCL 2 us each, a copy into a lasting one 100 us.
            flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
            for block in (handle.reals, handle.ints):
                made = cl.Buffer(self._context, flags, hostbuf=block)
                self._blocks.append(self.memory.add(made, block.nbytes, "scratch", made.release))
            blocks = [entry.object for entry in self._blocks]
            handle.kernel.set_args(*job.targets, *buffers, *blocks, *(np.int32(n) for n in job.size))
        except cl.Error as error:
            raise DeviceError(f"{self.name}: the kernel's arguments were refused: {error}") from None

    def _enqueue(self, job: Job, x: Span, y: Span, z: Span) -> None:
        width = -(-x[1] // GROUP) * GROUP
        # PoCL compiles a kernel once for offset 0 and once for all others. A pixel entry never asks for its third
        # coordinate, so that one is always 1 and the first variant is never needed.
        offset = (x[0], y[0], z[0] if job.volume else 1)
        try:
            self._event = self._cl.enqueue_nd_range_kernel(
                self._queue, job.program.handle.kernel, (width, y[1], z[1]), (GROUP, 1, 1), global_work_offset=offset
            )
        except self._cl.Error as error:
            raise DeviceError(f"{self.name}: the kernel could not be started: {error}") from None

    def _warm_up(self, job: Job, x: int, y: int) -> None:
        # One row beyond the result, where every work item returns at once, and for volumes the first row.
        row = (0, job.size[0])
        self._enqueue(job, row, (job.size[1], 1), (job.size[2], 1))
        if job.volume:
            self._enqueue(job, row, (0, 1), (0, 1))
        self.wait()

    def _draw(self, job: Job, x: Span, y: Span, z: Span) -> None:
        self._enqueue(job, x, y, z)

    def _end(self, job: Job) -> None:
        while self._blocks:
            self.memory.drop(self._blocks.pop())

    def wait(self) -> None:
        try:
            # The queue keeps order, so the last event stands for all. pyopencl waits without the GIL.
            if self._event is not None:
                self._event.wait()
                self._event = None
        except self._cl.Error as error:
            raise DeviceError(f"{self.name}: the kernel failed: {error}") from None

    def _release(self) -> None:
        self._queue.finish()


def _as_stored(leaf: Leaf, numbers: Array) -> Array:
    """Return a leaf's numbers in its block's type; unsigned ones keep their bits."""
    if isinstance(leaf.type, Matrix) or leaf.type.base == "float":
        return numbers
    return numbers.astype(np.uint32).view(np.int32) if leaf.type.base == "uint" else numbers


def import_pyopencl() -> Any:
    """Import pyopencl, or raise DeviceMissing with what to install."""
    _offer_empty_libraries()
    _offer_kernel_cache()
    try:
        import pyopencl
    except ImportError as error:
        raise DeviceMissing(
            f"cl: pyopencl cannot be imported ({error}); install it with pip install pyopencl"
        ) from None
    return pyopencl


def _offer_empty_libraries() -> None:
    """Let PoCL link its kernels where no C compiler is installed.

    PoCL links every kernel with libgcc, libm and libc, and ends the whole process where it finds none. A kernel needs
    nothing of them that is not loaded already: empty ones will do. LIBRARY_PATH comes last, so real ones win.
    """
    before = os.environ.get("LIBRARY_PATH", "")
    if str(EMPTY_LIBRARIES) not in before.split(os.pathsep):
        os.environ["LIBRARY_PATH"] = os.pathsep.join(filter(None, (before, str(EMPTY_LIBRARIES))))


def _offer_kernel_cache() -> None:
    """Let PoCL and pyopencl start where the user's cache folder cannot be written to.

    PoCL would hide its devices without a word, and pyopencl would fail at the first kernel.
    """
    global _unwritable
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    if not _is_writable(base):
        os.environ.setdefault("PYOPENCL_NO_CACHE", "1")
    folder = os.environ.get("POCL_CACHE_DIR") or os.path.join(base, "pocl", "kcache")
    if not _is_writable(folder):
        _unwritable = folder
        os.environ["POCL_CACHE_DIR"] = own = tempfile.mkdtemp(prefix="nodegraph-kernels-")
        atexit.register(shutil.rmtree, own, ignore_errors=True)


def _is_writable(folder: str) -> bool:
    """Whether files can be written into a folder, or into the one above that it would be made in."""
    there = os.path.abspath(folder)
    while not os.path.lexists(there):
        there = os.path.dirname(there)
    return os.path.isdir(there) and os.access(there, os.W_OK | os.X_OK)


_unwritable = ""  # where PoCL would have kept its kernels


def drivers() -> list[Any]:
    """Return every OpenCL device of this machine, best first: GPUs, then Intel's CPU driver, then the newest PoCL."""
    cl = import_pyopencl()
    found = []
    try:
        platforms = cl.get_platforms()
    except cl.Error:
        return []
    for platform in platforms:
        try:
            found += [d for d in platform.get_devices() if d.available and d.compiler_available]
        except cl.Error:
            continue

    def rank(device: Any) -> tuple[int, int, tuple[int, ...]]:
        gpu = 0 if device.type & cl.device_type.GPU else 1
        vendor = 0 if "intel" in device.platform.name.lower() else 1
        numbers = re.search(r"PoCL (?:HSTR: )?(\d+)\.(\d+)", device.platform.version, re.I)
        version = tuple(-int(n) for n in numbers.groups()) if numbers else (0,)
        return gpu, vendor, version

    return sorted(found, key=rank)


def may_have_hardware() -> bool:
    """Tell, without the third of a second that loading the drivers takes, whether one of them may be a GPU's.

    False only where every driver that is registered here is known to be for the CPU.
    """
    if not sys.platform.startswith("linux") or {"OCL_ICD_VENDORS", "OCL_ICD_FILENAMES"} & set(os.environ):
        return True
    try:
        names = [path.read_text("utf-8", "replace") + path.name for path in Path("/etc/OpenCL/vendors").glob("*.icd")]
    except OSError:
        return True
    return not all("pocl" in name.lower() or "intelocl" in name.lower() for name in names)


def lacks_linker(device: Any) -> bool:
    """Tell whether a driver would end the whole process at its first kernel: PoCL does where it finds no ``ld``."""
    return "portable computing language" in device.platform.name.lower() and shutil.which("ld") is None


def best_driver(precision: str) -> Any:
    """Return the device to use for a precision; DeviceMissing says what to install."""
    name = "cl64" if precision == "double" else "cl"
    found = drivers()
    if not found:
        raise DeviceMissing(f"{name}: there is no OpenCL driver on this machine; install one with {PACKAGES}")
    if all(lacks_linker(device) for device in found):
        raise DeviceMissing(f"{name}: {LINKER}")
    found = [device for device in found if not lacks_linker(device)]
    if precision == "double":
        found = [device for device in found if device.double_fp_config]
        if not found:
            raise DeviceMissing(f"{name}: no OpenCL driver here computes in double; install one with {PACKAGES}")
    return found[0]


def describe_driver(device: Any) -> str:
    """Return name and driver of an OpenCL device in one line."""
    platform = device.platform
    text = f"{device.name.strip()}, {platform.name.strip()} {device.driver_version.strip()}"
    if _unwritable and "portable computing language" in platform.name.lower():
        text += f" (builds its kernels anew, since {_unwritable} cannot be written to)"
    return text
