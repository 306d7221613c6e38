"""OpenGL 3.3 and later through moderngl: kernels are fragment shaders that draw into float textures.

moderngl makes the context and the programs; whatever may take long goes past it (see gl_calls.py).
Row 0 of a texture is row 0 of the picture, on upload, in gl_FragCoord and on read-back, so nothing is flipped.
"""

from __future__ import annotations

import ctypes
import math
import os
import re
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nodegraph.compute import gl_calls as gl
from nodegraph.compute import language
from nodegraph.compute.device import Device, Span
from nodegraph.compute.dispatch import BuildFailure, Job
from nodegraph.compute.gl_calls import Calls
from nodegraph.compute.language import Layout, Matrix, Module, Storage, is_line
from nodegraph.compute.memory import Budget, Entry
from nodegraph.compute.rasterise import Rasteriser
from nodegraph.compute.spares import Owned
from nodegraph.compute.storage import Placement
from nodegraph.data.buffer import Array
from nodegraph.errors import DeviceError, DeviceMissing

PACKAGES = "apt install libegl1 libgl1"
LLVMPIPE_OBJECT_BYTES = 1792 << 20
"""Above 1.75 GiB llvmpipe makes a texture without storage and says nothing of it."""
LLVMPIPE_TURNS = 65535
"""So many turns do all loops of one invocation take together on llvmpipe; then they end, and it says nothing of it."""

_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software", "swiftshader", "gdi generic", "basic render")
_VERTEX = """#version 330
void main() {
    // One triangle that covers the target: corners (-1, -1), (3, -1), (-1, 3).
    gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0);
}
"""
# Integers that a sampler of reals reads: shares of their greatest.
_NORMALISED = {"u1": "u1 / 255", "u2": "u2 / 65535"}
_FORMATS = {1: 0x1903, 2: 0x8227, 4: 0x1908}
_INTEGER_FORMATS = {1: 0x8D94, 2: 0x8228, 4: 0x8D99}
_TYPES = {"u1": 0x1401, "u2": 0x1403, "u4": 0x1405, "i4": 0x1404, "f2": 0x140B, "f4": 0x1406}
# How drivers write a place: Mesa "0:12(5): error: ...", NVIDIA "0(12) : error ...", others "ERROR: 0:12: ...".
_PLACES = (
    re.compile(r"^(?P<file>\d+):(?P<line>\d+)\(\d+\): error: (?P<text>.*)$", re.M),
    re.compile(r"^(?P<file>\d+)\((?P<line>\d+)\) : error (?P<text>.*)$", re.M),
    re.compile(r"^ERROR: (?P<file>\d+):(?P<line>\d+): (?P<text>.*)$", re.M),
)
_current = threading.local()


class Handle:
    """A linked program, its uniforms by name, and what was last written to them."""

    def __init__(self, program: Any) -> None:
        self.program = program
        # Vertex attributes are members of the program too; they have no format to write in.
        self.uniforms = {name: program[name] for name in program if hasattr(program[name], "fmt")}
        self.written: dict[str, bytes] = {}

    def write(self, name: str, numbers: Array) -> None:
        """Set a uniform that the driver has not dropped, unless it holds these numbers already."""
        uniform = self.uniforms.get(name)
        if uniform is not None:
            data = numbers.tobytes()
            if self.written.get(name) != data:
                uniform.write(data)
                self.written[name] = data


class _Texture(NamedTuple):
    """A texture of one to three axes, named as moderngl names its own."""

    glo: int
    size: tuple[int, ...]
    components: int


def _target(placement: Placement) -> int:
    if len(placement.shape) == 3:
        return gl.TEXTURE_3D
    return gl.TEXTURE_1D if len(placement.shape) == 1 and is_line(placement.storage, 1) else gl.TEXTURE_2D


class GLDevice(Device):
    """OpenGL, with no window: EGL on Linux, WGL on Windows, CGL on macOS."""

    name = "gl"
    api = "gl"
    real = np.dtype(np.float32)
    recycles = True

    def __init__(self, budget: Budget | int | None = None, roots: Sequence[Path | str] | None = None) -> None:
        self.context = open_context()
        super().__init__(budget, roots)
        self._raster: Rasteriser | None = None
        _current.device = self
        self.calls = Calls()
        info = self.context.info
        renderer, version = str(info["GL_RENDERER"]), str(info["GL_VERSION"])
        self.description = f"{renderer}, OpenGL {version}"
        self.is_hardware = not any(word in renderer.lower() for word in _SOFTWARE)
        self.is_host_memory = not self.is_hardware
        llvmpipe = "llvmpipe" in renderer.lower()
        # llvmpipe works in tiles of 64 x 64: a strip that cuts tiles leaves threads idle.
        self.strip_multiple = 64 if llvmpipe else 1
        self.limits = {
            "version": int(self.context.version_code),
            "texture_2d": int(info["GL_MAX_TEXTURE_SIZE"]),
            "texture_3d": int(info["GL_MAX_3D_TEXTURE_SIZE"]),
            "object_bytes": LLVMPIPE_OBJECT_BYTES if llvmpipe else None,
            "fields": int(info["GL_MAX_TEXTURE_IMAGE_UNITS"]),
            "outputs": int(info["GL_MAX_DRAW_BUFFERS"]),
            "turns": LLVMPIPE_TURNS if llvmpipe else None,
            # llvmpipe interpolates with float weights; hardware with 8 bits, too coarse for a measured picture.
            "filtering": llvmpipe or os.environ.get("NODEGRAPH_FILTER") == "hardware",
        }
        names = (ctypes.c_uint * 2)()
        self.calls.gen_framebuffers(1, ctypes.byref(names, 0))
        self.calls.gen_vertex_arrays(1, ctypes.byref(names, 4))
        self.framebuffer, self._vertex_array = int(names[0]), int(names[1])
        self.memory.add(names, 0, "scratch", self._free_names)

    def _free_names(self) -> None:
        self.calls.delete_framebuffers(1, ctypes.byref(ctypes.c_uint(self.framebuffer)))
        self.calls.delete_vertex_arrays(1, ctypes.byref(ctypes.c_uint(self._vertex_array)))

    def make_current(self) -> None:
        # Several devices may take turns on one thread. `with context:` would leave none current at its end.
        if getattr(_current, "device", None) is not self:
            self.context.mglo.__enter__()
            _current.device = self

    @property
    def raster(self) -> Rasteriser:
        """The service ``gl``: draws meshes."""
        if self._raster is None:
            self._raster = Rasteriser(self)
        return self._raster

    # Text and programs.

    def print(self, module: Module, storages: dict[str, tuple[Storage, ...]]) -> tuple[str, Layout]:
        return language.print_glsl(module, storages, stage="fragment", version=330)

    def _build(self, text: str, layout: Layout) -> tuple[Any, list[Owned]]:
        if len(layout.slots) > self.limits["fields"] or len(layout.outputs) > self.limits["outputs"]:
            raise DeviceError(
                f"gl: a kernel with {len(layout.slots)} fields and {len(layout.outputs)} outputs passes this driver's "
                f"limits of {self.limits['fields']} and {self.limits['outputs']}"
            )
        handle = self.make_handle(_VERTEX, text)
        for unit, slot in enumerate(layout.slots):
            handle.write(slot.sampler, np.array([unit], np.int32))
        return handle, [(handle.program, len(text), handle.program.release)]

    def make_handle(self, vertex: str, fragment: str) -> Handle:
        """Compile and link; the driver's first complaint becomes the message of a BuildFailure."""
        import moderngl

        try:
            return Handle(self.context.program(vertex_shader=vertex, fragment_shader=fragment))
        except moderngl.Error as error:
            log = str(error)
            for pattern in _PLACES:
                found = pattern.search(log)
                if found:
                    raise BuildFailure(found["text"].strip(), found["file"], int(found["line"])) from None
            raise BuildFailure(log.strip().splitlines()[-1] if log.strip() else "no message") from None

    # Textures.

    def check_limits(self, shape: tuple[int, ...], nbytes: int, where: str) -> None:
        largest = self.limits["texture_3d" if len(shape) == 3 else "texture_2d"]
        size = "x".join(map(str, shape[::-1]))
        if max(shape) > largest:
            raise DeviceError(f"gl: {where}: {size} passes this driver's texture limit of {largest} a side")
        most = self.limits["object_bytes"]
        if most is not None and nbytes > most:
            raise DeviceError(f"gl: {where}: {size} takes {nbytes} bytes, this driver's textures hold at most {most}")

    def _allocate(self, placement: Placement, where: str) -> Owned:
        return self.make_texture(placement, where)

    def make_texture(self, placement: Placement, where: str) -> Owned:
        """Make a texture without data; memory is reserved already."""
        self.calls.get_error()
        size = placement.shape[::-1]
        target = _target(placement)
        if target == gl.TEXTURE_2D and len(size) == 1:
            size = (size[0], 1)
        calls, name = self.calls, ctypes.c_uint()
        calls.gen_textures(1, ctypes.byref(name))

        def release() -> None:
            calls.delete_textures(1, ctypes.byref(name))

        storage = placement.storage
        texture = _Texture(int(name.value), size, placement.texture_components)
        calls.active_texture(gl.TEXTURE0)
        calls.bind_texture(target, texture.glo)
        make = (calls.tex_image_1d, calls.tex_image_2d, calls.tex_image_3d)[len(size) - 1]
        # moderngl would hold the GIL while the driver clears what may be hundreds of megabytes.
        make(target, 0, _format(placement), *size, 0, *_transfer(placement), None)
        smooth = self.limits["filtering"] and not storage.sampler and storage.element != "u1"
        mode = gl.LINEAR if smooth else gl.NEAREST
        wraps = (gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R)[: len(size)]
        for parameter, value in (
            (gl.TEXTURE_MIN_FILTER, mode), (gl.TEXTURE_MAG_FILTER, mode), (gl.TEXTURE_MAX_LEVEL, 0),
            *((wrap, gl.CLAMP_TO_EDGE) for wrap in wraps),
        ):  # fmt: skip
            calls.tex_parameter(target, parameter, value)
        self.require_no_error(f"a texture of {'x'.join(map(str, size))} for {where}", release)
        return texture, placement.nbytes, release

    def _upload(self, array: Array, placement: Placement, where: str) -> Owned:
        self.memory.reserve(placement.nbytes, where)
        texture, nbytes, release = self._allocate(placement, where)
        form, kind = _transfer(placement)
        calls = self.calls
        calls.active_texture(gl.TEXTURE0)
        calls.pixel_store(gl.UNPACK_ALIGNMENT, 1)
        target = _target(placement)
        calls.bind_texture(target, texture.glo)
        for first, slab in placement.slabs(array):
            data = slab.ctypes.data
            if len(placement.shape) == 3:
                depth, height, width = slab.shape[:3]
                calls.tex_sub_image_3d(target, 0, 0, 0, first, width, height, depth, form, kind, data)
            elif len(placement.shape) == 2:
                calls.tex_sub_image_2d(target, 0, 0, first, slab.shape[1], slab.shape[0], form, kind, data)
            elif target == gl.TEXTURE_1D:
                calls.tex_sub_image_1d(target, 0, first, slab.shape[0], form, kind, data)
            else:
                calls.tex_sub_image_2d(target, 0, first, 0, slab.shape[0], 1, form, kind, data)
        self.require_no_error(f"the upload of {where}", release)
        return texture, nbytes, release

    def read(self, entry: Entry, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Array:
        texture = entry.object
        out = self.memory.host.empty(math.prod(shape) * dtype.itemsize).view(dtype).reshape(shape)
        form = (_FORMATS if dtype.kind == "f" else _INTEGER_FORMATS)[texture.components]
        # glGetTexImage needs no finish before it: called through ctypes it waits without the GIL.
        target = gl.TEXTURE_3D if len(texture.size) == 3 else gl.TEXTURE_2D
        self.calls.active_texture(gl.TEXTURE0)
        self.calls.bind_texture(target, texture.glo)
        self.calls.pixel_store(gl.PACK_ALIGNMENT, 1)
        self.calls.get_tex_image(target, 0, form, _TYPES[f"{dtype.kind}{dtype.itemsize}"], out.ctypes.data)
        self.require_no_error("reading a result")
        return out

    # One dispatch.

    def _begin(self, job: Job) -> None:
        calls, handle, layout = self.calls, job.program.handle, job.program.layout
        calls.get_error()
        for leaf, numbers in zip(layout.leaves, job.values, strict=True):
            base = "float" if isinstance(leaf.type, Matrix) else leaf.type.base
            handle.write(leaf.name, numbers.astype({"float": np.float32, "uint": np.uint32}.get(base, np.int32)))
        for unit, (wanted, slot) in enumerate(zip(layout.slots, job.slots, strict=True)):
            placement = slot.placement
            calls.active_texture(gl.TEXTURE0 + unit)
            calls.bind_texture(_target(placement), slot.entry.object.glo)
            size = np.array(placement.shape[::-1], np.int32)
            storage = placement.storage
            handle.write(wanted.size, size)
            handle.write(wanted.inverse, (1.0 / size).astype(np.float32))
            mapping = (storage.scale, storage.offset, storage.scale * storage.unorm)
            handle.write(wanted.mapping, np.array(mapping, np.float32))
        calls.bind_framebuffer(gl.FRAMEBUFFER, self.framebuffer)
        self._attach(job, 0)
        count = len(job.targets)
        calls.draw_buffers(count, (ctypes.c_uint * count)(*range(gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT0 + count)))
        if not job.program.warm and calls.framebuffer_status(gl.FRAMEBUFFER) != gl.FRAMEBUFFER_COMPLETE:
            raise DeviceError(f"gl: this driver cannot draw into {count} outputs of these types at once")
        for state in (gl.BLEND, gl.CULL_FACE, gl.DEPTH_TEST):
            calls.disable(state)
        calls.enable(gl.SCISSOR_TEST)
        calls.viewport(0, 0, job.size[0], job.size[1])
        calls.use_program(handle.program.glo)
        calls.bind_vertex_array(self._vertex_array)

    def _attach(self, job: Job, z: int) -> None:
        """Draw into slice z of every target; a picture has one slice."""
        for i, texture in enumerate(job.targets):
            point = gl.COLOR_ATTACHMENT0 + i
            if job.volume:
                self.calls.framebuffer_layer(gl.FRAMEBUFFER, point, texture.glo, 0, z)
            else:
                self.calls.framebuffer_texture(gl.FRAMEBUFFER, point, gl.TEXTURE_2D, texture.glo, 0)

    def _warm_up(self, job: Job, x: int, y: int) -> None:
        self.calls.scissor(x, y, 1, 1)
        self.calls.draw_arrays(gl.TRIANGLES, 0, 3)
        self.calls.finish()

    def _draw(self, job: Job, x: Span, y: Span, z: Span) -> None:
        self.calls.scissor(x[0], y[0], x[1], y[1])
        if not job.volume:
            self.calls.draw_arrays(gl.TRIANGLES, 0, 3)
            return
        for at in range(z[0], z[0] + z[1]):
            # Drawing into a layer of the 3-D texture needs no copy; it is 1.5 times as fast as a compute shader here.
            self._attach(job, at)
            job.program.handle.write(job.program.layout.slice, np.array([at], np.int32))
            self.calls.draw_arrays(gl.TRIANGLES, 0, 3)

    def _end(self, job: Job) -> None:
        # A texture that stays attached would outlive its release.
        for i in range(len(job.targets)):
            point = gl.COLOR_ATTACHMENT0 + i
            self.calls.framebuffer_texture(gl.FRAMEBUFFER, point, gl.TEXTURE_2D, 0, 0)
        self.calls.disable(gl.SCISSOR_TEST)

    def _verify(self) -> None:
        self.require_no_error("drawing")

    def wait(self) -> None:
        self.calls.finish()

    def require_no_error(self, doing: str, undo: Any = None) -> None:
        code = self.calls.get_error()
        if code:
            if undo is not None:
                undo()
            self.lost = self.lost or code == gl.CONTEXT_LOST
            name = {0x0505: "out of memory", gl.CONTEXT_LOST: "the context is lost", 0x0506: "invalid framebuffer"}
            raise DeviceError(f"gl: {doing} failed: {name.get(code, f'OpenGL error 0x{code:04x}')}")

    def _release(self) -> None:
        self.context.release()
        if getattr(_current, "device", None) is self:
            _current.device = None


def _format(placement: Placement) -> int:
    """OpenGL's internal format of a texture."""
    storage = placement.storage
    element = storage.element if storage.sampler else _NORMALISED.get(storage.element, storage.element)
    return gl.FORMATS[element][placement.texture_components]


def _transfer(placement: Placement) -> tuple[int, int]:
    """Return OpenGL's format and type of the host data."""
    formats = _INTEGER_FORMATS if placement.storage.sampler else _FORMATS
    return formats[placement.texture_components], _TYPES[placement.storage.element]


def open_context() -> Any:
    """Make a context that needs no window. DeviceMissing says what to install."""
    try:
        import moderngl
    except ImportError as error:
        raise DeviceMissing(
            f"gl: moderngl cannot be imported ({error}); install it with pip install moderngl"
        ) from None
    attempts: list[dict[str, Any]] = [{"backend": "egl"}, {}] if sys.platform.startswith("linux") else [{}]
    reasons = []
    for settings in attempts:
        try:
            return moderngl.create_context(standalone=True, require=330, **settings)
        except Exception as error:  # glcontext raises plain Exception
            reasons.append(str(error) or type(error).__name__)
    cure = f"get one with {PACKAGES}" if sys.platform.startswith("linux") else "install a driver"
    raise DeviceMissing(f"gl: no OpenGL 3.3 context can be made ({'; '.join(reasons)}); {cure}")
