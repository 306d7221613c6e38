"""Uniforms, fields, outputs and entries, on every device."""

# ruff: noqa: E501

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from nodegraph.shaders import Source

UNIFORMS = """
struct Light { vec3 direction; float power; };
struct Scene { int count; Light lights[2]; float weights[3]; mat3 turn; bool on; uvec2 bits; };
uniform float gain;
uniform vec2 pair = vec2(0.25, -4.0);
uniform ivec3 steps;
uniform uint id;
uniform bool flip = true;
uniform mat4 to_world;
uniform float ramp[4];
uniform vec3 planes[2];
uniform ivec2 places[2];
uniform Light sun;
uniform Scene scene;
uniform float step = 3.0; // a name that is also a built-in
uniform vec4 nowhere;
float power_of(Light light) { return light.power * dot(light.direction, vec3(1.0, 10.0, 100.0)); }
float all_of(Scene s) { s.count += 1; return float(s.count) + power_of(s.lights[1]) + s.weights[2] + float(s.bits.y); }
float summed(float values[4]) { return values[0] + values[1] + values[2] + values[3]; }
vec4 pixel(ivec2 at) {
    int i = at.x;
    if (at.y == 0) return vec4(gain, pair, step);
    if (at.y == 1) return vec4(steps, id >> 4u);
    if (at.y == 2) return transform(to_world, vec4(1.0, 2.0, 3.0, 1.0));
    if (at.y == 3) return vec4(ramp[i], planes[i].yz, flip ? 1.0 : 0.0);
    if (at.y == 4) return vec4(power_of(sun), power_of(scene.lights[i]), scene.lights[1].power, scene.weights[i + 1]);
    if (at.y == 5) return vec4(transform(scene.turn, vec3(1.0, 2.0, 3.0)), scene.on);
    if (at.y == 6) return vec4(all_of(scene), summed(ramp), scene.turn[i].y, places[i].y);
    return vec4(scene.bits, scene.count, to_world[3][i]);
}
"""


def test_uniforms_of_every_kind(device: Any) -> None:
    to_world = np.arange(16.0).reshape(4, 4)
    turn = np.arange(9.0).reshape(3, 3) * 0.5
    lights = [{"direction": (1, 2, 3), "power": 0.5}, {"direction": (4, 5, 6), "power": 2.0}]
    scene = {
        "count": 7,
        "lights": lights,
        "weights": (0.1, 0.2, 0.3),
        "turn": turn,
        "on": True,
        "bits": (5, 4294967295),
    }
    got = device.run(
        Source.of(UNIFORMS), (2, 8), gain=1.5, steps=(1, -2, 3), id=4294967280, to_world=to_world, ramp=[1, 2, 3, 4],
        planes=[(1, 2, 3), (4, 5, 6)], places=[(1, 2), (3, -4)], sun={"direction": (1, 1, 1), "power": 3.0}, scene=scene, flip=False,
    ).array  # fmt: skip
    p, q = 0.5 * 321, 2.0 * 654
    turned = turn @ (1, 2, 3)
    everything = 8 + q + 0.3 + 4294967295
    wanted = [
        [(1.5, 0.25, -4, 3)] * 2,
        [(1, -2, 3, 268435455)] * 2,
        [to_world @ (1, 2, 3, 1)] * 2,
        [(1, 2, 3, 0), (2, 5, 6, 0)],
        [(333, p, 2, 0.2), (333, q, 2, 0.3)],
        [(*turned, 1)] * 2,
        [(everything, 10, turn[1, 0], 2), (everything, 10, turn[1, 1], -4)],
        [(5, 4294967295, 7, to_world[0, 3]), (5, 4294967295, 7, to_world[1, 3])],
    ]
    np.testing.assert_allclose(got, np.array(wanted), rtol=1e-6)


OUTPUTS = """
struct Result { vec4 color; float depth; int count; uint id; vec2 interval; };
Result {entry}({type} at) {{
    Result r;
    r.color = vec4(float(at.x), float(at.y), {z}, 1.0);
    r.depth = float(at.x) * 0.5;
    r.count = -at.y;
    r.id = 16777217u + uint(at.x);
    r.interval = vec2(float(at.y), 9.0);
    return r;
}}
"""


@pytest.mark.parametrize("entry", ["pixel", "voxel"])
def test_several_outputs(device: Any, entry: str) -> None:
    z = "float(at.z)" if entry == "voxel" else "0.0"
    text = OUTPUTS.replace("{entry}", entry).replace("{z}", z).replace("{type}", "ivec3" if z != "0.0" else "ivec2")
    size = (5, 4, 3) if entry == "voxel" else (5, 4)
    got = device.run(Source.of(text.replace("{{", "{").replace("}}", "}")), size)
    grid = np.indices(size[::-1])[::-1]
    x, y = grid[0], grid[1]
    depth = grid[2] if entry == "voxel" else np.zeros_like(x)
    np.testing.assert_array_equal(got.color.array, np.stack([x, y, depth, np.ones_like(x)], axis=-1))
    np.testing.assert_array_equal(got.depth.array, x * 0.5)
    np.testing.assert_array_equal(got.count.array, -y)
    np.testing.assert_array_equal(got.id.array, 16777217 + x)
    np.testing.assert_array_equal(got.interval.array, np.stack([y, np.full_like(y, 9)], axis=-1))
    assert (got.color.array.dtype, got.count.array.dtype, got.id.array.dtype) == (device.real, np.int32, np.uint32)


FIELDS = """
field3 v;
field3v g;
field3u l;
field2 image;
field2u ids;
field1 table;
uniform vec3 at_points[6];
struct Result { vec4 a; vec4 b; vec4 c; vec4 d; vec4 e; uint f; uint g; vec4 h; };
float twice(field3 any, vec3 p) { return sample3(any, p) * 2.0; }
Result pixel(ivec2 at) {
    vec3 p = at_points[at.x];
    ivec3 n = ivec3(floor(p));
    Result r;
    r.a = vec4(sample3(v, p), fetch3(v, n), twice(v, p), size3(v).x);
    r.b = sample3v(g, p);
    r.c = fetch3v(g, n);
    r.d = sample2(image, p.xy);
    r.e = fetch2(image, n.xy);
    r.f = fetch3u(l, n);
    r.g = fetch2u(ids, n.xy) + uint(size1(table) * 1000 + size2(image).y * 100 + size3(l).z * 10 + size3(g).y);
    r.h = vec4(sample1(table, p.x).xy, fetch1(table, n.x).zw);
    return r;
}
"""

POINTS = np.array([(0, 0, 0), (1.25, 2.5, 0.75), (-3, 1.5, 9), (5, 3, 2), (99.5, -7, 1.1), (3.999, 2.001, 1.5)])


def interpolated(data: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Interpolate (z, y, x) data linearly at (x, y, z) points, clamped to the edge."""
    clamped = np.clip(points, 0, np.array(data.shape[::-1]) - 1.0)
    return ndimage.map_coordinates(data.astype(np.float64), clamped.T[::-1], order=1, mode="nearest")


def test_every_accessor(device: Any, rng: np.random.Generator) -> None:
    shape = (3, 4, 6)
    v = rng.normal(size=shape).astype(np.float32)
    g = rng.normal(size=(*shape, 3)).astype(np.float32)
    labels = rng.integers(0, 2**32, shape, np.uint32)
    image = rng.normal(size=(5, 7, 2)).astype(np.float32)
    ids = rng.integers(0, 2**24, (5, 7)).astype(np.uint32)
    table = rng.normal(size=(9, 4)).astype(np.float32)
    got = device.run(Source.of(FIELDS), (6, 1), v=v, g=g, l=labels, image=image, ids=ids, table=table, at_points=POINTS)
    n = np.clip(np.floor(POINTS).astype(int), 0, np.array(shape[::-1]) - 1)
    m = np.clip(np.floor(POINTS).astype(int)[:, :2], 0, (6, 4))
    t = np.clip(np.floor(POINTS).astype(int)[:, 0], 0, 8)
    values = interpolated(v, POINTS)
    zero = np.zeros(6)
    close = {"rtol": 1e-5, "atol": 1e-6}
    wanted_a = np.stack([values, v[n[:, 2], n[:, 1], n[:, 0]], 2 * values, zero + 6], axis=-1)
    np.testing.assert_allclose(got.a.array[0], wanted_a, **close)
    components = [interpolated(g[..., c], POINTS) for c in range(3)]
    np.testing.assert_allclose(got.b.array[0], np.stack([*components, zero], axis=-1), **close)
    np.testing.assert_array_equal(got.c.array[0, :, :3], g[n[:, 2], n[:, 1], n[:, 0]])
    assert (got.c.array[0, :, 3] == 0).all()
    planes = [interpolated(image[..., c], POINTS[:, :2]) for c in range(2)]
    np.testing.assert_allclose(got.d.array[0], np.stack([*planes, zero, zero], axis=-1), **close)
    np.testing.assert_array_equal(got.e.array[0, :, :2], image[m[:, 1], m[:, 0]])
    np.testing.assert_array_equal(got.f.array[0], labels[n[:, 2], n[:, 1], n[:, 0]])
    np.testing.assert_array_equal(got.g.array[0], ids[m[:, 1], m[:, 0]] + 9000 + 500 + 30 + 4)
    entries = np.clip(POINTS[:, 0], 0, 8)
    columns = [np.interp(entries, np.arange(9), table[:, c]) for c in range(2)]
    np.testing.assert_allclose(got.h.array[0, :, :2], np.stack(columns, axis=-1), **close)
    np.testing.assert_array_equal(got.h.array[0, :, 2:], table[t][:, 2:])


ARRAYS = """
#ifndef COUNT
#define COUNT 3
#endif
field3 volumes[COUNT];
field1 tables[2];
uniform vec3 p;
float peak(field3 v, vec3 q) { return max(sample3(v, q), fetch3(v, ivec3(q))); }
float through(field3 v, vec3 q) { return peak(v, q) + float(size3(v).x); }
float both(field3 a, field3 b) { return sample3(a, p) - sample3(b, p); }
vec4 pixel(ivec2 at) {
    int i = at.x - 1;
    return vec4(through(volumes[i], p), through(volumes[1], p), both(volumes[i], volumes[2]), sample1(tables[at.x & 1], 0.5).r);
}
"""


def test_field_arrays_and_specialised_functions(device: Any, rng: np.random.Generator) -> None:
    volumes = [
        rng.normal(size=(4, 5, 6)).astype(np.float32),
        rng.integers(-3000, 3000, (3, 4, 7)).astype(np.int16),
        rng.integers(0, 255, (5, 5, 5)).astype(np.uint8),
    ]
    tables = [np.full((2, 4), 1.0, np.float32), np.full((3, 4), 2.0, np.float32)]
    p = np.array([1.5, 2.25, 1.75])
    got = device.run(Source.of(ARRAYS), (5, 1), defines={"COUNT": 3}, volumes=volumes, tables=tables, p=p).array[0]
    sampled = [interpolated(v, p[None])[0] for v in volumes]
    peaks = [max(sample, float(v[1, 2, 1])) + v.shape[2] for sample, v in zip(sampled, volumes, strict=True)]
    for column in range(5):
        i = min(max(column - 1, 0), 2)
        wanted = (peaks[i], peaks[1], sampled[i] - sampled[2], 1.0 + (column & 1))
        np.testing.assert_allclose(got[column], wanted, rtol=2e-6, atol=2e-3)


STRANGE = """
field3 v;
field2 image;
field1 table;
vec4 pixel(ivec2 at) {
    float zero = float(at.x - at.x);
    float p = at.x == 0 ? zero / zero : (at.x == 1 ? 1.0 / zero : (at.x == 2 ? -1.0 / zero : 1.0e30));
    return vec4(sample3(v, vec3(p, 1.0, 1.0)), sample2(image, vec2(0.0, p)).r, sample1(table, p).r, fetch3(v, ivec3(-5, 900, 1)));
}
"""


def test_positions_that_are_not_numbers_stay_inside(device: Any) -> None:
    """A NaN position may give any voxel of its line (a table: entry 0), never memory outside."""
    v = np.arange(27, dtype=np.float32).reshape(3, 3, 3)
    image = np.arange(9, dtype=np.float32).reshape(3, 3, 1)
    table = np.arange(16, dtype=np.float32).reshape(4, 4)
    got = device.run(Source.of(STRANGE), (4, 1), v=v, image=image, table=table).array[0]
    assert 12 <= got[0, 0] <= 14
    assert 0 <= got[0, 1] <= 6
    assert got[0, 2] == 0
    np.testing.assert_allclose(got[1:, 0], (14, 12, 14), rtol=1e-6)
    np.testing.assert_allclose(got[1:, 1], (6, 0, 6), rtol=1e-6)
    np.testing.assert_allclose(got[1:, 2], (12, 0, 12), rtol=1e-6)
    assert (got[:, 3] == 15).all()


def test_one_voxel(device: Any) -> None:
    text = "field3 v; float voxel(ivec3 at) { return sample3(v, vec3(at) * 0.3 - 1.0) + fetch3(v, at); }"
    got = device.run(Source.of(text), (2, 3, 4), v=np.full((1, 1, 1), 21, np.int16)).array
    assert got.shape == (4, 3, 2)
    np.testing.assert_allclose(got, 42, rtol=1e-5)


def test_driver_errors_point_at_the_authors_line(device: Any) -> None:
    """The printed directives number files and lines as drivers count them."""
    from nodegraph.compute.device import BuildFailure

    text = "\n\nfloat f(float x) {\n    float y = x;\n\n    return\n        y;\n}\nfloat pixel(ivec2 at) {\n    return f(1.0);\n}"
    module = device.compile(Source.of(text), {})
    printed, layout = device.print(module, {})
    assert printed.count("return a_y;") == 1
    with pytest.raises(BuildFailure) as failure:
        device._build(printed.replace("return a_y;", "return nonsense;"), layout)
    assert failure.value.file in ("0", "kernel.glsl")
    assert failure.value.line == 6
