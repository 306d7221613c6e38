"""What all devices do alike: find a kernel, bind it by name, bring its inputs over, run it in strips.

A subclass (gl.py, cl.py) says how text is built, how bytes travel, and how one box of pixels or voxels runs.
"""

from __future__ import annotations

import math
import threading
import time
from abc import ABC, abstractmethod
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nodegraph import locations, shaders
from nodegraph.compute import language
from nodegraph.compute.bindings import check_names, field_sources, leaf_values
from nodegraph.compute.dispatch import (
    BuildFailure,
    FieldRead,
    Job,
    KernelRun,
    Program,
    Resident,
    Size,
    Slot,
    located,
)
from nodegraph.compute.language import Layout, Module, OutputDecl, Storage
from nodegraph.compute.memory import Budget, Entry, Memory
from nodegraph.compute.spares import Owned
from nodegraph.compute.storage import Placement, choose, item_bytes
from nodegraph.compute.strips import boxes, run_in_strips
from nodegraph.data.buffer import Array, Buffer
from nodegraph.errors import DeviceError, ParameterError, ShaderError

VOLUME_SHARE = 0.8
"""Of a device's budget, what one volume may take: pictures, tables and programs want room as well."""

Defines = Mapping[str, int | float | bool]
Span = tuple[int, int]
Box = tuple[int, int, int, int]
"""Pixels (left, top, right, bottom), ends left out."""


class Device(ABC):
    """A machine that runs kernels: OpenGL, OpenCL in single or in double precision.

    It belongs to the thread that opened it. ``call``, when set (the engine does), runs a function on that thread
    and waits, so that results may be read from others. ``roots`` are the folders in which kernel names are looked up.
    ``lost`` is True once the driver gave up the context: nothing runs there any more, and results that lie there alone
    are gone. ``last_run`` tells what the latest run was; what is made while ``working_for`` names a node is counted
    under it.
    """

    name: str
    api: str
    description: str
    is_hardware: bool
    is_host_memory: bool
    real: np.dtype[Any]
    limits: dict[str, Any]
    strip_multiple = 1
    least_columns = 16
    recycles = False
    """Whether an object of a result that died may stand for another. Not where it *is* the array that was read."""

    def __init__(self, budget: Budget | int | None = None, roots: Sequence[Path | str] | None = None) -> None:
        self.memory = Memory(budget, name=self.name)
        self.roots: list[Path | str] = [locations.shaders()] if roots is None else list(roots)
        self.call: Callable[[Callable[[], None]], object] | None = None
        self._thread = threading.get_ident()
        self._closed = False
        self.lost = False
        self.last_run: KernelRun | None = None
        self._sources: dict[str, tuple[shaders.Source, tuple[Any, ...]]] = {}
        self._modules: dict[tuple[Any, ...], Module] = {}
        self._programs: dict[str, Program] = {}
        self._variants: dict[tuple[Any, ...], tuple[Program, dict[str, tuple[Storage, ...]]]] = {}

    # What a processor calls.

    def run(
        self,
        kernel: str | shaders.Source,
        size: Sequence[int],
        *,
        defines: Defines | None = None,
        check: Callable[[], None] | None = None,
        progress: Callable[[float], None] | None = None,
        work: float = 1.0,
        turns: float = 0,
        box: Box | None = None,
        into: Sequence[Buffer] = (),
        **bindings: Any,
    ) -> Any:
        """Run a kernel over ``size``, (w, h) pixels or (x, y, z) voxels, and return what it computes.

        ``kernel`` is a name such as ``render/raycast`` or a source. Every uniform and field that the variant reads is
        bound by its name. The result is a Buffer (h, w[, c]) or (z, y, x[, c]), or a named tuple of them; it stays on
        the device until ``.array`` is read, and may be bound to a later run as it is. ``check()`` is called between
        strips and may raise Cancelled; ``progress(fraction)`` after each. ``work`` tells how dear a pixel or voxel is,
        relative to other runs of this kernel, where a parameter decides about that: strips are cut by it. ``turns`` is
        how many turns the loops of one pixel or voxel may take in all, where that may be tens of thousands.

        ``into`` are outputs of an earlier run of this size that nobody else has seen: pixels outside ``box`` are kept,
        those inside (at the least) are run, and they are the result. All pixels are run, into new ones, where they were
        read or left the device.

        ParameterError for bindings, ShaderError for the kernel, DeviceError when the device cannot.
        """
        started = time.perf_counter()
        self.require_thread()
        self.memory.drain()
        source = kernel if isinstance(kernel, shaders.Source) else self._source(kernel)
        label = kernel if isinstance(kernel, str) else source.files[0].removesuffix(shaders.SUFFIX)
        key = (source.digest, source.files[0], tuple((n, type(d), d) for n, d in sorted((defines or {}).items())))
        module = self._modules.get(key)
        if module is None:
            module = self._modules[key] = self.compile(source, defines or {})
        grid = _grid(size, module.entry, label)
        most = self.limits.get("turns")
        if most is not None and turns > most:
            raise DeviceError(
                f"{self.name}: {label}: up to {turns:.0f} turns of a loop for one {module.entry}, and this driver ends "
                f"loops after {most}; use a greater step, or --device cl"
            )
        check_names(module, bindings, label)

        placements = self._place(module, bindings, label)
        storages = {name: tuple(p.storage for _, p in items) for name, items in placements.items()}
        variant = (key, tuple((name, tuple(s.variant for s in items)) for name, items in storages.items()))
        known = len(self._programs)
        if variant not in self._variants:
            self._variants[variant] = self._program(source, module, storages), storages
        program = self._variants[variant][0]
        values = leaf_values(module, program.layout, bindings, label, self.real)

        held: list[Entry] = []
        try:
            slots = []
            fields = []
            for wanted in program.layout.slots:
                buffer, placement = placements[wanted.field][wanted.element]
                there = self.memory.find(buffer, placement.key)
                entry = self._bring(buffer, placement, f"{label}.{wanted.field}")
                fields.append(FieldRead(wanted.field, entry.bytes, entry is not there))
                entry.pins += 1
                held.append(entry)
                slots.append(Slot(entry, placement))
            outputs = []
            kept = self._kept(into, program.layout.outputs, grid, module.entry)
            for i, output in enumerate(program.layout.outputs):
                buffer, entry = kept[i] if kept else self.make_output(output, grid, module.entry, label)
                entry.pins += 1
                held.append(entry)
                outputs.append((output.name, buffer, entry))
            job = Job(program, module.entry == "voxel", grid, values, slots, [entry.object for _, _, entry in outputs])
            self._dispatch(job, work, check, progress, box if kept and box else (0, 0, grid[0], grid[1]))
        finally:
            for entry in held:
                entry.pins -= 1
        self.last_run = KernelRun(
            label,
            self.name,
            grid[: 2 if module.entry == "pixel" else 3],
            source,
            dict(defines or {}),
            program.text,
            tuple(fields),
            tuple((name, entry.bytes) for name, _, entry in outputs),
            time.perf_counter() - started,
            len(self._programs) > known,
        )
        if len(outputs) == 1 and outputs[0][0] == "":
            return outputs[0][1]
        return named_outputs(tuple(name for name, _, _ in outputs), label)(*(buffer for _, buffer, _ in outputs))

    @property
    def working_for(self) -> str:
        """Path of the node that runs now; empty between nodes."""
        return self.memory.node

    @working_for.setter
    def working_for(self, path: str) -> None:
        self.memory.node = path

    @property
    def budget(self) -> int | None:
        """Bytes that everything on the device may take, and on the host where that is the same memory."""
        return self.memory.budget.limit

    def fits(self, shape: Sequence[int], dtype: Any) -> bool:
        """Whether a volume (z, y, x) may lie on this device as a whole, within its budget and its limits."""
        nbytes = math.prod(shape) * item_bytes(np.dtype(dtype), self.api)
        limit = self.memory.budget.limit
        try:
            self.check_limits(tuple(shape), nbytes, self.name)
        except DeviceError:
            return False
        return limit is None or nbytes <= VOLUME_SHARE * limit

    def describe_storage(self, value: Any, kind: str) -> Storage:
        """Return how a Value, Buffer or array would lie on this device as a field of ``kind``; ``loss`` is in it."""
        declaration = language.FieldDecl("field", kind, 0, "", 0, True)
        source = field_sources(declaration, value, self.name)[0]
        return self._choose(source.buffer, kind, source.mapping, self.name).storage

    def close(self) -> None:
        """Free everything. Results that are alive and were not read yet are brought to the host first."""
        if self._closed:
            return
        self.require_thread()
        self.memory.close()
        self._closed = True
        self._programs.clear()
        self._variants.clear()
        self._release()

    # What the engine and Buffer.array need.

    def on_own_thread(self, action: Callable[[], None]) -> None:
        """Run ``action`` on the thread that owns the device."""
        if threading.get_ident() == self._thread:
            self.make_current()
            action()
        elif self.call is not None:
            self.call(lambda: self.on_own_thread(action))
        else:
            raise DeviceError(f"{self.name}: this result lies on a device of another thread; read it there first")

    def require_thread(self) -> None:
        """Raise DeviceError unless this is the owner's thread and the device is open; make it current."""
        if self._closed:
            raise DeviceError(f"{self.name}: the device is closed; open another with Devices.choose()")
        if threading.get_ident() != self._thread:
            raise DeviceError(f"{self.name}: a device runs only on the thread that opened it; use Engine.call")
        self.make_current()

    def compile(self, source: shaders.Source, defines: Defines) -> Module:
        """Check a kernel for one set of defines."""
        return language.compile(source, dict(defines))

    def try_text(self, old: shaders.Source, new: shaders.Source) -> None:
        """Compile a changed kernel for every set of defines and storages that its old text has run with.

        Raises ShaderError for what the language or the driver refuses; what compiles is kept for the runs to come.
        """
        self.require_thread()
        for digest, file, defines in [key for key in self._modules if key[:2] == (old.digest, old.files[0])]:
            module = self.compile(new, {name: value for name, _, value in defines})
            self._modules[new.digest, new.files[0], defines] = module
            read = {declaration.name for declaration in module.fields if declaration.used}
            for (key, _), (_, storages) in list(self._variants.items()):
                if key == (digest, file, defines) and read == storages.keys():
                    self._program(new, module, storages)

    # The parts of run().

    def _source(self, name: str) -> shaders.Source:
        """Load a kernel, again only when one of its files has changed."""
        known = self._sources.get(name)
        if known is not None and known[1] == shaders.stamps(known[0].paths):
            return known[0]
        source = shaders.load(name, self.roots)
        self._sources[name] = (source, shaders.stamps(source.paths))
        return source

    def _place(
        self, module: Module, bindings: Mapping[str, Any], label: str
    ) -> dict[str, list[tuple[Buffer, Placement]]]:
        placements = {}
        for declaration in module.fields:
            if declaration.used:
                sources = field_sources(declaration, bindings[declaration.name], label)
                where = f"{label}.{declaration.name}"
                placements[declaration.name] = [
                    (s.buffer, self._choose(s.buffer, declaration.kind, s.mapping, where)) for s in sources
                ]
        return placements

    def _choose(self, buffer: Buffer, kind: str, mapping: tuple[float, float], where: str) -> Placement:
        filtering = bool(self.limits.get("filtering", False))
        return choose(buffer, kind, self.api, mapping=mapping, filtering=filtering, where=where)

    def _program(self, source: shaders.Source, module: Module, storages: dict[str, tuple[Storage, ...]]) -> Program:
        text, layout = self.print(module, storages)
        program = self._programs.get(text)
        if program is None:
            try:
                handle, objects = self._build(text, layout)
            except BuildFailure as failure:
                raise located(failure, layout.files, source) from None
            program = self._programs[text] = Program(handle, layout, text)
            for thing, nbytes, release in objects:
                self.memory.add(thing, nbytes, "program", release)
        return program

    def _bring(self, buffer: Buffer, placement: Placement, where: str) -> Entry:
        """Return the copy of a buffer on this device, uploading it when there is none."""
        entry = self.memory.find(buffer, placement.key)
        if entry is not None:
            return entry
        self.check_limits(placement.shape, placement.nbytes, where)
        thing, nbytes, release = self._upload(buffer.array, placement, where)
        return self.memory.add(thing, nbytes, "input", release, owner=buffer, key=placement.key)

    def make_output(self, output: OutputDecl, grid: Size, entry_kind: str, label: str) -> tuple[Buffer, Entry]:
        """Allocate one output and the device-born buffer that stands for it."""
        kind = output.type
        where = f"{label} ({output.name})" if output.name else label
        placement = self._output_placement(output, grid, entry_kind)
        shape, dtype = placement.shape, placement.dtype
        self.check_limits(shape, placement.nbytes, where)
        form = placement if self.recycles else None
        spare = None if form is None else self.memory.take(form)
        if spare is None:
            self.memory.reserve(placement.nbytes, f"the result of {where}")
        thing, nbytes, release = spare or self._allocate(placement, where)
        full = shape + ((kind.n,) if kind.n > 1 else ())
        resident = Resident(self, full, dtype)
        buffer = Buffer.on_device(full, dtype, resident.fetch)
        resident.entry = self.memory.add(
            thing,
            nbytes,
            "output",
            release,
            owner=buffer,
            key=placement.key,
            read_back=resident.save,
            saved=resident.saved,
            form=form,
        )
        return buffer, resident.entry

    def _output_placement(self, output: OutputDecl, grid: Size, entry_kind: str) -> Placement:
        kind = output.type
        dtype = {"float": self.real, "int": np.dtype(np.int32), "uint": np.dtype(np.uint32)}[kind.base]
        shape = grid[1::-1] if entry_kind == "pixel" else grid[::-1]
        return Placement(Storage(f"{dtype.kind}{dtype.itemsize}", kind.n), shape, kind.n)

    def _kept(
        self, into: Sequence[Buffer], outputs: Sequence[OutputDecl], grid: Size, entry_kind: str
    ) -> list[tuple[Buffer, Entry]]:
        """Outputs of an earlier run that can be drawn into; none where any of them cannot."""
        found = []
        for buffer, output in zip(into, outputs, strict=bool(into)):
            placement = self._output_placement(output, grid, entry_kind)
            entry = self.memory.find(buffer, placement.key)
            if entry is None or entry.purpose != "output" or entry.saved() or buffer.shape[:2] != placement.shape:
                return []
            found.append((buffer, entry))
        return found

    def _dispatch(
        self,
        job: Job,
        work: float,
        check: Callable[[], None] | None,
        progress: Callable[[float], None] | None,
        box: Box,
    ) -> None:
        left, top, right, bottom = box
        width, height, depth = right - left, bottom - top, job.size[2]
        if width <= 0 or height <= 0:
            return
        program = job.program
        self._begin(job)
        try:
            if not program.warm:
                # Drivers compile when a program first runs; strip times must not contain that.
                self._warm_up(job, left, top)
                program.warm = True

            def draw(first: int, count: int, x: int = 0, columns: int = width) -> None:
                for y, rows, z, slices in boxes(first, count, height):
                    self._draw(job, (left + x, columns), (top + y, rows), (z, slices))
                self.wait()

            run_in_strips(
                draw,
                height * depth,
                width,
                program.pace,
                work=work,
                multiple=self.strip_multiple,
                least_columns=self.least_columns,
                check=check,
                progress=progress,
            )
            self._verify()
        finally:
            self._end(job)

    # What a subclass brings.

    def make_current(self) -> None:  # noqa: B027 (only OpenGL has one)
        """Make the device's context the thread's current one, where there is such a thing."""

    @abstractmethod
    def print(self, module: Module, storages: dict[str, tuple[Storage, ...]]) -> tuple[str, Layout]:
        """Translate a checked kernel into this device's language."""

    @abstractmethod
    def check_limits(self, shape: tuple[int, ...], nbytes: int, where: str) -> None:
        """Raise DeviceError when no single object of this shape can exist. Nothing has been allocated yet."""

    @abstractmethod
    def wait(self) -> None:
        """Wait for everything that was issued, without holding the GIL."""

    @abstractmethod
    def read(self, entry: Entry, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Array:
        """Bring an object to the host."""

    @abstractmethod
    def _build(self, text: str, layout: Layout) -> tuple[Any, list[Owned]]:
        """Build a program; return its handle and the objects that `Memory` shall own. Raises BuildFailure."""

    @abstractmethod
    def _upload(self, array: Array, placement: Placement, where: str) -> Owned:
        """Reserve memory and copy host data to the device; return the object, its bytes and how to free it."""

    @abstractmethod
    def _allocate(self, placement: Placement, where: str) -> Owned:
        """Make an uninitialised object; memory is reserved already."""

    @abstractmethod
    def _begin(self, job: Job) -> None:
        """Set everything that is the same for all strips: program, uniforms, fields, targets."""

    @abstractmethod
    def _warm_up(self, job: Job, x: int, y: int) -> None:
        """Make the driver compile, at the least cost; pixel (x, y) may be drawn, no other."""

    @abstractmethod
    def _draw(self, job: Job, x: Span, y: Span, z: Span) -> None:
        """Issue one box: columns, rows and slices, each as (first, count)."""

    @abstractmethod
    def _end(self, job: Job) -> None:
        """Undo what `_begin` left behind, also after a failure."""

    def _verify(self) -> None:  # noqa: B027 (OpenCL reports in wait)
        """Raise DeviceError if the device reports that drawing failed."""

    @abstractmethod
    def _release(self) -> None:
        """Close the context. All objects are freed already."""


def _grid(size: Sequence[int], entry: str, label: str) -> Size:
    wanted = 2 if entry == "pixel" else 3
    names = "(w, h) pixels" if entry == "pixel" else "(x, y, z) voxels"
    try:
        numbers = tuple(int(n) for n in size)
        whole = all(n == m for n, m in zip(numbers, size, strict=True))
    except (TypeError, ValueError):
        numbers, whole = (), False
    if len(numbers) != wanted or not whole or min(numbers) < 1:
        raise ParameterError(f"{label}.size: expected {names}, each at least 1, got {size!r}")
    return (numbers[0], numbers[1], 1) if wanted == 2 else (numbers[0], numbers[1], numbers[2])


_tuple_types: dict[tuple[str, ...], Any] = {}


def named_outputs(names: tuple[str, ...], label: str) -> Any:
    """Return the named tuple class for several outputs."""
    found = _tuple_types.get(names)
    if found is None:
        try:
            found = _tuple_types[names] = namedtuple("Outputs", names)
        except ValueError as error:
            raise ShaderError(f"{label}: an output has a name that Python cannot use: {error}") from None
    return found
