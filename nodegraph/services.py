"""What ``process`` is handed by name besides inputs and parameters.

The facades here are narrow on purpose: a processor sees a device that runs its own kernels, a way to say how
far it is, and `memo`. Each of them is also a place where a cancelled evaluation stops.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph.cache import Result, ResultCache
from nodegraph.data import Value
from nodegraph.errors import DeviceError, GraphError, near_miss
from nodegraph.fingerprint import code_of, content_key, digest, function_key
from nodegraph.kernel_sources import kernel_source

if TYPE_CHECKING:
    from nodegraph.compute.dispatch import KernelRun
    from nodegraph.disk_cache import DiskCache
    from nodegraph.processor import Processor

PROGRESS_SECONDS = 0.03


class Progress:
    """The service ``progress(fraction, text="")``: says how far the work is; raises Cancelled to stop it."""

    def __init__(self, check: Callable[[], None], report: Callable[[float, str], None]) -> None:
        self._check = check
        self._report = report
        self._last = -PROGRESS_SECONDS

    def __call__(self, fraction: float, text: str = "") -> None:
        self._check()
        now = time.monotonic()
        if now - self._last >= PROGRESS_SECONDS or fraction >= 1.0:
            self._last = now
            self._report(min(1.0, max(0.0, float(fraction))), text)


class DeviceService:
    """The service ``device``: runs the kernels that the processor declares, nothing else.

    Strips check for cancel and report progress. ``seconds`` counts what its kernels took; ``runs`` tells each of them.
    """

    def __init__(
        self, device: Any, processor: type[Processor], path: str, check: Callable[[], None], progress: Progress
    ):
        self._device = device
        self._processor = processor
        self._path = path
        self._check = check
        self._progress = progress
        self.seconds = 0.0
        self._runs: list[KernelRun] = []

    @property
    def name(self) -> str:
        """gl, cl or cl64."""
        return str(self._device.name)

    @property
    def description(self) -> str:
        """Renderer and driver."""
        return str(self._device.description)

    @property
    def is_hardware(self) -> bool:
        """False where the processor of the computer does the work."""
        return bool(self._device.is_hardware)

    @property
    def real(self) -> np.dtype[Any]:
        """Type of a kernel's ``float``: float32 or float64."""
        found: np.dtype[Any] = np.dtype(self._device.real)
        return found

    @property
    def limits(self) -> Mapping[str, Any]:
        """Greatest sizes that the device takes."""
        return dict(self._device.limits)

    @property
    def budget(self) -> int | None:
        """Bytes that everything on the device may take, with what lies on the host where that is the same memory."""
        limit: int | None = self._device.budget
        return limit

    def fits(self, shape: Sequence[int], dtype: Any) -> bool:
        """Whether a volume (z, y, x) may lie on the device as a whole, within its budget."""
        return bool(self._device.fits(shape, dtype))

    def run(
        self,
        kernel: str,
        size: Any,
        *,
        defines: Mapping[str, Any] | None = None,
        work: float = 1.0,
        turns: float = 0,
        progress: Callable[[float], None] | None = None,
        **bindings: Any,
    ) -> Any:
        """Run a kernel over (width, height) pixels or (x, y, z) voxels; returns a Buffer, or a named tuple of Buffers.

        ``work`` tells how dear a pixel or voxel is, relative to other runs, where a parameter decides about that;
        ``turns`` how many turns its loops may take in all. A driver that ends loops earlier refuses: DeviceError.
        ``progress(fraction)`` stands in for the node's own where a run is a part of the work; ``box`` and ``into`` are
        those of `Device.run`.
        Raises GraphError for a kernel that the processor does not declare, ShaderError, DeviceError, Cancelled.
        """
        if kernel not in self._processor.kernels:
            raise GraphError(
                f"{self._path}: runs the kernel {kernel!r}, which {self._processor.__name__} does not declare"
                f"{near_miss(kernel, self._processor.kernels)}; add it to kernels = (...)"
            )
        self._check()
        started = time.perf_counter()
        try:
            source = kernel_source(self._processor, kernel)
            result = self._device.run(
                source,
                size,
                defines=defines,
                check=self._check,
                progress=self._progress if progress is None else progress,
                work=work,
                turns=turns,
                **bindings,
            )
            done = getattr(self._device, "last_run", None)
            if done is not None:
                self._note(replace(done, kernel=kernel))
            return result
        finally:
            self.seconds += time.perf_counter() - started

    @property
    def runs(self) -> tuple[KernelRun, ...]:
        """What ran, equal runs as one each."""
        return tuple(self._runs)

    def _note(self, run: KernelRun) -> None:
        from nodegraph.compute.dispatch import merged

        self._runs = merged([*self._runs, run])

    def memo_key(self) -> bytes:
        """What a device among the arguments of `memo` contributes: its name and every kernel it may run."""
        return digest("device", self.name, code_of(self._processor).digest)


class Memo:
    """The service ``memo(fn, *args, disk=False)``: the result of a pure function, made once per set of arguments.

    The function belongs to a module and is named by it; arguments are values from ports, arrays, numbers, text,
    and the services ``device`` and ``progress``. The result lies in the same cache and budget as those of nodes;
    with ``disk=True`` it is also kept between runs. Results are shared: arrays come back read-only.
    """

    def __init__(
        self,
        path: str,
        cache: ResultCache,
        disk: DiskCache | None,
        check: Callable[[], None],
        done: Callable[[str, float, bool, int], None],
        note: Callable[[str], None],
        lasting: Callable[[bytes], bytes | None],
    ) -> None:
        self._path = path
        self._cache = cache
        self._disk = disk
        self._check = check
        self._done = done
        self._note = note
        self._lasting = lasting

    def kept(self, function: Callable[..., Any], *args: Any) -> bool:
        """Whether the result lies in memory: for what another way makes as well, to rounding, while one interacts."""
        return self._full_key(function, args) in self._cache

    def __call__(self, function: Callable[..., Any], *args: Any, disk: bool = False) -> Any:
        self._check()
        where = f"memo({function.__name__})"
        key = self._full_key(function, args)
        label = f"{self._path}/{function.__name__}"
        found = self._cache.get(key)
        if found is None and disk and self._disk is not None:
            code = function_key(function)
            lasting = digest("memo", code, *(self._lasting_key(arg, f"{where}: argument") for arg in args))
            found = self._disk.get(lasting)
            if found is not None:
                _own(found.values, key)
                self._cache.put(key, found)
        if found is not None:
            self._done(label, 0.0, True, found.nbytes)
            return found.values[""]
        started = time.perf_counter()
        value = function(*args)
        seconds = time.perf_counter() - started
        self._check()
        result = Result({"": value}, seconds)
        _own(result.values, key)
        self._cache.put(key, result)
        if disk and self._disk is not None:
            refused = self._disk.put(lasting, result)
            if refused:
                self._note(f"{label}: not kept on disk: {refused}")
        self._done(label, seconds, False, result.nbytes)
        return value

    def _full_key(self, function: Callable[..., Any], args: tuple[Any, ...]) -> bytes:
        where = f"memo({function.__name__}): argument"
        keys = (self._key(arg, f"{where} {i + 1}") for i, arg in enumerate(args))
        return digest("memo", function_key(function), *keys)

    def _key(self, arg: Any, where: str) -> bytes:
        if isinstance(arg, Value) and arg.provenance is not None:
            return digest("made", arg.provenance)
        return self._small_key(arg, where)

    def _lasting_key(self, arg: Any, where: str) -> bytes:
        """A key that another process finds again: provenance where it lasts, else content."""
        if isinstance(arg, Value) and arg.provenance is not None:
            lasting = self._lasting(arg.provenance)
            if lasting is not None:
                return digest("made", lasting)
        return self._small_key(arg, where)

    def _small_key(self, arg: Any, where: str) -> bytes:
        if isinstance(arg, DeviceService):
            return arg.memo_key()
        if isinstance(arg, Progress):
            return b"progress"
        if isinstance(arg, (list, tuple)):
            return digest("list", *(self._key(item, where) for item in arg))
        return content_key(arg, where)


def _own(values: Any, key: bytes) -> None:
    """Mark what a key made, and protect its arrays: later readers share them."""
    for name, value in values.items() if isinstance(values, Mapping) else enumerate(values):
        if isinstance(value, Value):
            value.provenance = value.provenance or digest("output", key, str(name))
        elif isinstance(value, np.ndarray):
            value.flags.writeable = False
        elif isinstance(value, (Mapping, list, tuple)):
            _own(value, digest("part", key, str(name)))


def own(values: Mapping[str, Any], key: bytes) -> None:
    """Write the provenance of what a task made; a value that was passed through keeps its own."""
    for name, value in values.items():
        if isinstance(value, Value) and value.provenance is None:
            value.provenance = provenance(key, name)


def provenance(key: bytes, output: str) -> bytes:
    """Key of one output of the task or given value with this fingerprint."""
    return digest("output", key, output)


def open_raster(device: Any, path: str) -> Any:
    """The service ``gl``, or DeviceError saying that this processor needs OpenGL."""
    raster = getattr(device, "raster", None)
    if raster is None:
        raise DeviceError(
            f"{path}: needs OpenGL, and {device.name} is no OpenGL device; install a driver or use --device gl"
        )
    return raster
