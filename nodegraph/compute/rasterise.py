"""The service ``gl``: draw a triangle mesh with a shader into float or integer images. OpenGL only.

Kernels never need it: convex proxies are intersected analytically. It is for what only a rasteriser does well,
such as the entry and exit distances of a mesh that is not convex, or an image of ids.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from nodegraph.compute import gl_calls as gl
from nodegraph.compute.bindings import NAMED_OUTPUTS
from nodegraph.compute.device import Device, named_outputs
from nodegraph.compute.dispatch import BuildFailure
from nodegraph.compute.language import OutputDecl
from nodegraph.compute.memory import Entry
from nodegraph.data.buffer import Array, Buffer
from nodegraph.data.mesh import Mesh
from nodegraph.errors import DeviceError, ParameterError, ShaderError, near_miss

if TYPE_CHECKING:
    from nodegraph.compute.gl import GLDevice

BLENDS = ("none", "min", "max", "add", "over")
CULLS = ("none", "front", "back")

_VERTEX = """#version 330
in vec3 in_position;
out vec3 position;
uniform mat4 view_projection;
void main() {
    position = in_position;
    gl_Position = view_projection * vec4(in_position, 1.0);
    gl_Position.y = -gl_Position.y;  // row 0 is the top row
}
"""
# moderngl's letter for the type of a uniform, and numpy's.
_CODES = {"f": "f4", "i": "i4", "I": "u4"}
_CLEARS: dict[str, Any] = {"float": ctypes.c_float, "int": ctypes.c_int, "uint": ctypes.c_uint}


class Rasteriser:
    """Draws meshes on a device. DeviceError, saying "needs OpenGL", when the device is another."""

    def __init__(self, device: Device) -> None:
        if device.api != "gl":
            raise DeviceError(f"{device.name}: drawing a mesh needs OpenGL; run with --device gl")
        self._device = cast("GLDevice", device)
        self._programs: dict[str, Any] = {}

    def draw(
        self,
        mesh: Mesh,
        size: tuple[int, int],
        fragment: str,
        targets: Mapping[str, str],
        *,
        view_projection: Any,
        origin: Any = (0.0, 0.0, 0.0),
        clear: Mapping[str, float] | float = 0.0,
        blend: str = "none",
        depth_test: bool = False,
        cull: str = "none",
        **uniforms: Any,
    ) -> Any:
        """Draw ``mesh`` into new images of ``size`` (w, h); return a named tuple of Buffers, one for each target.

        ``targets`` maps names to types (float, vec2, vec4, int, uint). ``fragment`` is GLSL 3.30 without ``#version``
        and ``main``: it declares its uniforms and defines ``void shade()``, which assigns the targets by name. It may
        read ``position``, the point in world mm minus ``origin``, ``gl_PrimitiveID``, the triangle's number, and
        ``gl_FrontFacing``, true where the triangle is seen counter-clockwise. ``view_projection`` (4, 4) takes
        positions to OpenGL's clip space, y up; give the eye as ``origin`` to keep digits far from the world's centre.

        ``clear`` is what pixels without mesh hold, one number or one for each target. ``blend`` min, max and add
        combine all triangles of a pixel, component by component; over is premultiplied, in the order of the triangles.
        Without ``depth_test`` nothing is cut off at the near and far plane. ``cull`` leaves out front or back faces.
        """
        device = self._device
        device.require_thread()
        device.memory.drain()
        _check_choice("blend", blend, BLENDS)
        _check_choice("cull", cull, CULLS)
        outputs = [_output(name, kind) for name, kind in targets.items()]
        if not outputs or (blend != "none" and any(output.type.base != "float" for output in outputs)):
            raise ParameterError("gl.draw.targets: expected at least one target, and floats only where they blend")
        if blend == "over" and any(output.type.n != 4 for output in outputs):
            raise ParameterError("gl.draw.targets: over needs vec4 targets, whose last component is the opacity")
        clears = {o.name: float(clear[o.name] if isinstance(clear, Mapping) else clear) for o in outputs}

        handle = self._program(fragment, outputs)
        self._set_uniforms(handle, {"view_projection": view_projection, **uniforms})
        scratch: list[Entry] = []
        held: list[Entry] = []
        made: list[tuple[OutputDecl, Buffer, Entry]] = []
        try:
            vertices, indices = self._buffers(mesh, origin, held)
            for output in outputs:
                buffer, entry = device.make_output(output, (int(size[0]), int(size[1]), 1), "pixel", "gl.draw")
                entry.pins += 1
                held.append(entry)
                made.append((output, buffer, entry))
            depth = self._depth(size, scratch) if depth_test else None
            if len(mesh.triangles):
                content = [(vertices.object, "3f4", "in_position")]
                array = device.context.vertex_array(handle.program, content, indices.object)
                scratch.append(device.memory.add(array, 0, "scratch", array.release))
            self._prepare(size, [entry.object for _, _, entry in made], depth, blend, cull)
            self._clear([output for output, _, _ in made], clears, depth_test)
            if len(mesh.triangles):
                array.render()
            device.wait()
            device.require_no_error("drawing a mesh")
        finally:
            self._restore(len(made))
            for entry in held:
                entry.pins -= 1
            for entry in scratch:
                device.memory.drop(entry)
        return named_outputs(tuple(targets), "gl.draw")(*(buffer for _, buffer, _ in made))

    def _program(self, fragment: str, outputs: list[OutputDecl]) -> Any:
        declarations = "".join(
            f"layout(location = {i}) out {output.type} {output.name};\n" for i, output in enumerate(outputs)
        )
        text = f"#version 330\nin vec3 position;\n{declarations}#line 1\n{fragment}\nvoid main() {{ shade(); }}\n"
        handle = self._programs.get(text)
        if handle is None:
            try:
                handle = self._device.make_handle(_VERTEX, text)
            except BuildFailure as failure:
                lines = fragment.splitlines()
                excerpt = lines[failure.line - 1] if 0 < failure.line <= len(lines) else ""
                message = f"the driver refuses this shader: {failure}"
                raise ShaderError(message, file="gl.draw.fragment", line=failure.line, excerpt=excerpt) from None
            self._programs[text] = handle
            self._device.memory.add(handle.program, len(text), "program", handle.program.release)
        return handle

    def _set_uniforms(self, handle: Any, values: Mapping[str, Any]) -> None:
        known = list(handle.uniforms)
        for name in known:
            if name not in values:
                raise ParameterError(f"gl.draw.{name}: the shader reads it and nothing is bound to it")
        for name, value in values.items():
            if name not in known:
                if name == "view_projection":
                    continue
                raise ParameterError(f"gl.draw.{name}: the shader reads no such uniform{near_miss(name, known)}")
            uniform = handle.uniforms[name]
            numbers = np.asarray(value)
            count = uniform.dimension * uniform.array_length
            if numbers.size != count or numbers.dtype.kind not in "biuf":
                raise ParameterError(f"gl.draw.{name}: expected {count} numbers, got {value!r:.60}")
            if uniform.matrix:
                numbers = np.swapaxes(numbers, -1, -2)
            handle.write(name, numbers.astype(_CODES[uniform.fmt[-1]]))

    def _buffers(self, mesh: Mesh, origin: Any, held: list[Entry]) -> tuple[Entry, Entry]:
        """Return the mesh's vertices (relative to the origin) and indices on the device, uploaded when new."""
        start = np.asarray(origin, np.float64)
        if start.shape != (3,):
            raise ParameterError(f"gl.draw.origin: expected 3 numbers, got {origin!r}")

        def bring(owner: Buffer, key: Any, make: Callable[[], Array]) -> Entry:
            entry = self._device.memory.find(owner, key)
            if entry is None:
                # OpenGL refuses empty buffers; nothing is drawn from this one.
                data = make() if owner.nbytes else np.zeros(4, np.uint8)
                self._device.memory.reserve(data.nbytes, "a mesh")
                thing = self._device.context.buffer(data)
                entry = self._device.memory.add(thing, data.nbytes, "input", thing.release, owner=owner, key=key)
            entry.pins += 1
            held.append(entry)
            return entry

        vertices, triangles = mesh.buffers
        points = bring(vertices, ("vertices", *start), lambda: (vertices.array - start).astype(np.float32))
        return points, bring(triangles, "triangles", lambda: triangles.array)

    def _depth(self, size: tuple[int, int], scratch: list[Entry]) -> Any:
        nbytes = 4 * int(size[0]) * int(size[1])
        self._device.memory.reserve(nbytes, "a depth buffer")
        texture = self._device.context.depth_texture((int(size[0]), int(size[1])))
        scratch.append(self._device.memory.add(texture, nbytes, "scratch", texture.release))
        return texture

    def _prepare(self, size: tuple[int, int], textures: list[Any], depth: Any, blend: str, cull: str) -> None:
        calls = self._device.calls
        calls.get_error()
        calls.bind_framebuffer(gl.FRAMEBUFFER, self._device.framebuffer)
        for i, texture in enumerate(textures):
            calls.framebuffer_texture(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture.glo, 0)
        calls.framebuffer_texture(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth.glo if depth else 0, 0)
        points = range(gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT0 + len(textures))
        calls.draw_buffers(len(textures), (ctypes.c_uint * len(textures))(*points))
        calls.viewport(0, 0, int(size[0]), int(size[1]))
        calls.disable(gl.SCISSOR_TEST)
        (calls.enable if depth is not None else calls.disable)(gl.DEPTH_TEST)
        calls.depth_func(gl.LESS)
        (calls.disable if depth is not None else calls.enable)(gl.DEPTH_CLAMP)
        (calls.disable if blend == "none" else calls.enable)(gl.BLEND)
        equation = {"min": gl.MIN, "max": gl.MAX}.get(blend, gl.FUNC_ADD)
        calls.blend_equation(equation)
        calls.blend_func(gl.ONE, gl.ONE_MINUS_SRC_ALPHA if blend == "over" else gl.ONE)
        (calls.disable if cull == "none" else calls.enable)(gl.CULL_FACE)
        calls.cull_face(gl.FRONT if cull == "front" else gl.BACK)
        # Turning the picture over turns every triangle around.
        calls.front_face(gl.CW)

    def _clear(self, outputs: list[OutputDecl], clears: Mapping[str, float], depth: bool) -> None:
        calls = self._device.calls
        for i, output in enumerate(outputs):
            base = output.type.base
            number = clears[output.name] if base == "float" else int(clears[output.name])
            numbers = (_CLEARS[base] * 4)(*[number] * 4)
            {"float": calls.clear_float, "int": calls.clear_int, "uint": calls.clear_uint}[base](gl.COLOR, i, numbers)
        if depth:
            calls.clear_float(gl.DEPTH, 0, (ctypes.c_float * 1)(1.0))

    def _restore(self, count: int) -> None:
        calls = self._device.calls
        for point in (*range(gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT0 + count), gl.DEPTH_ATTACHMENT):
            calls.framebuffer_texture(gl.FRAMEBUFFER, point, gl.TEXTURE_2D, 0, 0)
        for state in (gl.BLEND, gl.CULL_FACE, gl.DEPTH_TEST, gl.DEPTH_CLAMP):
            calls.disable(state)


def _check_choice(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise ParameterError(f"gl.draw.{name}: {value!r} is none of {', '.join(known)}{near_miss(value, known)}")


def _output(name: str, kind: str) -> OutputDecl:
    if kind not in NAMED_OUTPUTS:
        raise ParameterError(f"gl.draw.targets.{name}: {kind!r} is none of {', '.join(NAMED_OUTPUTS)}")
    return OutputDecl(name, NAMED_OUTPUTS[kind])
