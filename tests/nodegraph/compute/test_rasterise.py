"""The service gl: meshes drawn into float and integer images."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nodegraph.compute.rasterise import Rasteriser
from nodegraph.data import Mesh
from nodegraph.errors import DeviceError, ParameterError, ShaderError

EYE = np.array([1e6, 0.0, 4.0])
# Orthographic, looking along -z from the eye: x to the right, y up, 2 mm to each side.
VIEW = np.diag([0.5, 0.5, -0.1, 1.0])
RANGE = "void shade() { float t = -position.z; range = vec2(t, -t); }"


def box(low: Any, high: Any) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Vertices and triangles of a box, counter-clockwise from outside."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    vertices = np.array([np.where([i & 1, i >> 1 & 1, i >> 2 & 1], high, low) for i in range(8)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return vertices, np.array(triangles)


def mesh(*boxes: tuple[Any, Any]) -> Mesh:
    vertices, triangles = [], []
    for low, high in boxes:
        v, t = box(low, high)
        triangles.append(t + 8 * len(vertices))
        vertices.append(v + np.array([1e6, 0, 0]))
    return Mesh(np.concatenate(vertices), np.concatenate(triangles))


def test_first_and_last_distance_of_a_mesh_that_is_not_convex(gl: Any) -> None:
    two = mesh(((-1, -1, -1), (0, 1, 0)), ((-1, -1, 1), (1, 1, 2)))
    out = Rasteriser(gl).draw(
        two, (64, 32), RANGE, {"range": "vec2"}, view_projection=VIEW, origin=EYE, blend="min", clear=np.inf
    )
    first, last = out.range.array[..., 0], -out.range.array[..., 1]
    assert out.range.shape == (32, 64, 2)
    assert first[16, 20] == pytest.approx(2.0)  # both boxes behind each other
    assert last[16, 20] == pytest.approx(5.0)
    assert (first[16, 44], last[16, 44]) == (pytest.approx(2.0), pytest.approx(3.0))  # the near one alone
    assert np.isinf(first[16, 5])
    assert np.isfinite(first).sum() == 16 * 32


def test_row_0_is_the_top_and_ids_and_depth_come_together(gl: Any) -> None:
    raised = mesh(((-1, 0.5, -1), (1, 1.5, 1)))
    shader = """
uniform uint base;
void shade() {
    id = base + uint(gl_PrimitiveID);
    depth = -position.z;
    facing = gl_FrontFacing ? 1.0 : -1.0;
}
"""
    targets = {"id": "uint", "depth": "float", "facing": "float"}
    out = gl.raster.draw(
        raised, (64, 64), shader, targets, view_projection=VIEW, origin=EYE, depth_test=True, base=2**24 + 1
    )
    rows = np.flatnonzero(out.id.array.any(axis=1))
    assert (rows.min(), rows.max()) == (8, 23)
    assert out.id.dtype == np.uint32
    assert set(np.unique(out.id.array)) == {0, 2**24 + 3, 2**24 + 4}  # the two triangles of the face towards the eye
    assert set(np.unique(out.depth.array)) == {0.0, 3.0}
    assert set(np.unique(out.facing.array)) == {0.0, 1.0}


def test_culling_and_adding(gl: Any) -> None:
    one = mesh(((-1, -1, -1), (1, 1, 1)))
    counts = {}
    for cull in ("none", "front", "back"):
        out = gl.raster.draw(
            one, (8, 8), "void shade() { n = vec4(-position.z); }", {"n": "vec4"}, view_projection=VIEW, origin=EYE,
            blend="add", cull=cull,
        )  # fmt: skip
        counts[cull] = float(out.n.array[4, 4, 0])
    assert counts == {"none": 8.0, "front": 5.0, "back": 3.0}


def test_nothing_is_cut_off_without_a_depth_test(gl: Any) -> None:
    long = mesh(((-1, -1, -5000), (1, 1, 3)))
    out = gl.raster.draw(
        long, (8, 8), RANGE, {"range": "vec2"}, view_projection=VIEW, origin=EYE, blend="min", clear=np.inf
    )
    assert out.range.array[4, 4].tolist() == [1.0, -5004.0]


def test_objects_are_freed_and_meshes_reused(gl: Any) -> None:
    meshes = [mesh(((-1, -1, -1), (1, 1, 1)))]

    def draw() -> Any:
        return gl.raster.draw(
            meshes[0], (16, 16), RANGE, {"range": "vec2"}, view_projection=VIEW, origin=EYE, depth_test=True
        )

    draw()
    gl.memory.drain()
    before = gl.memory.objects
    for _ in range(20):
        draw()
    gl.memory.drain()
    assert gl.memory.objects == before
    meshes.clear()
    gl.memory.drain()
    assert gl.memory.objects == before - 2


def test_kernels_run_as_before_after_a_mesh_was_drawn(gl: Any) -> None:
    from nodegraph.shaders import Source

    source = Source.of("float pixel(ivec2 at) { return float(at.x - at.y); }", "tests/after.glsl")
    want = gl.run(source, (40, 30)).array
    gl.raster.draw(
        mesh(((-1, -1, -1), (1, 1, 1))), (16, 16), RANGE, {"range": "vec2"}, view_projection=VIEW, origin=EYE,
        blend="max", cull="front",
    )  # fmt: skip
    assert (gl.run(source, (40, 30)).array == want).all()


def test_an_empty_mesh_leaves_the_clear_value(gl: Any) -> None:
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))
    out = gl.raster.draw(empty, (4, 4), RANGE, {"range": "vec2"}, view_projection=VIEW, clear={"range": 7.0})
    assert (out.range.array == 7.0).all()


def test_mistakes_are_named(gl: Any) -> None:
    one = mesh(((-1, -1, -1), (1, 1, 1)))

    def draw(fragment: str = RANGE, targets: Any = None, **more: Any) -> Any:
        return gl.raster.draw(one, (4, 4), fragment, targets or {"range": "vec2"}, view_projection=VIEW, **more)

    with pytest.raises(ShaderError, match=r"^gl.draw.fragment:2: .*nonsense"):
        draw("void shade() {\n    range = nonsense;\n}")
    with pytest.raises(ParameterError, match=r"^gl.draw.gian: .*\(did you mean 'gain'\?\)"):
        draw("uniform float gain; void shade() { range = vec2(gain); }", gain=1.0, gian=1.0)
    with pytest.raises(ParameterError, match=r"^gl.draw.gain: the shader reads it"):
        draw("uniform float gain; void shade() { range = vec2(gain); }")
    with pytest.raises(ParameterError, match=r"^gl.draw.gain: expected 1 numbers"):
        draw("uniform float gain; void shade() { range = vec2(gain); }", gain=(1.0, 2.0))
    with pytest.raises(ParameterError, match=r"^gl.draw.blend: 'mim' is none of .*did you mean 'min'"):
        draw(blend="mim")
    with pytest.raises(ParameterError, match=r"^gl.draw.targets.range: 'vec3' is none of float, vec2"):
        draw(targets={"range": "vec3"})
    with pytest.raises(ParameterError, match="floats only where they blend"):
        draw("void shade() { id = 1u; }", {"id": "uint"}, blend="min")


def test_other_devices_say_that_opengl_is_needed(cl: Any) -> None:
    with pytest.raises(DeviceError, match="needs OpenGL"):
        Rasteriser(cl)
