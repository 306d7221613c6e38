"""Every built-in function, on every device, against numpy."""

# ruff: noqa: E501

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from batch import Case, Results

from nodegraph.compute.language.builtins import ACCESSORS, SIGNATURES


def mod(x: Any, y: Any) -> Any:
    return x - y * np.floor(x / y)


def smoothstep(a: Any, b: Any, x: Any) -> Any:
    t = np.clip((x - a) / (b - a), 0, 1)
    return t * t * (3 - 2 * t)


def dot(a: Any, b: Any) -> Any:
    return (a * b).sum(axis=0)


def reflect(v: Any, n: Any) -> Any:
    return v - 2 * dot(v, n) * n


def refract(v: Any, n: Any, eta: float) -> Any:
    d = dot(v, n)
    k = 1 - eta * eta * (1 - d * d)
    return np.where(k < 0, 0.0, eta * v - (eta * d + np.sqrt(np.maximum(k, 0))) * n)


def unit(v: Any) -> Any:
    return v / np.sqrt(dot(v, v))


def as_float(bits: Any) -> Any:
    return np.asarray(bits, np.uint32).view(np.float32).astype(np.float64)


def as_bits(x: Any) -> Any:
    return np.asarray(x, np.float32).view(np.uint32)


def one(name: str, fn: Any, argument: str = "v", change: Any = None, tolerance: float = 4e-6) -> Case:
    """A case for a function of one argument: on a vector, and on a scalar."""
    change = change or (lambda v: v)
    body = f"vec3 r = {name}(({argument}).xyz); return vec4(r, {name}(({argument}).w));"
    return Case(name, body, lambda v, w, i: fn(change(v)), tolerance)


POSITIVE = ("abs(v) + 0.25", lambda v: np.abs(v) + 0.25)
UNIT = ("v * 0.24", lambda v: v * 0.24)

CASES = [
    one("radians", np.radians),
    one("degrees", np.degrees),
    one("sin", np.sin),
    one("cos", np.cos),
    one("tan", np.tan, *UNIT),
    one("asin", np.arcsin, *UNIT, tolerance=4e-4),
    one("acos", np.arccos, *UNIT, tolerance=4e-4),
    one("atan", np.arctan, tolerance=2e-5),
    one("sinh", np.sinh, tolerance=2e-5),
    one("cosh", np.cosh, tolerance=2e-5),
    one("tanh", np.tanh, tolerance=2e-5),
    one("exp", np.exp, tolerance=2e-5),
    one("log", np.log, *POSITIVE, tolerance=1e-5),
    one("exp2", np.exp2, tolerance=1e-5),
    one("log2", np.log2, *POSITIVE, tolerance=1e-5),
    one("sqrt", np.sqrt, *POSITIVE),
    one("inversesqrt", lambda v: 1 / np.sqrt(v), *POSITIVE),
    one("abs", np.abs),
    one("sign", np.sign),
    one("floor", np.floor),
    one("ceil", np.ceil),
    one("trunc", np.trunc),
    one("round", np.round),
    one("fract", lambda v: v - np.floor(v)),
    Case("atan of two", "return vec4(atan(v.xy, w.xy), atan(v.z, w.z), 0.0);", lambda v, w, i: np.arctan2(v, w)[:3], 2e-5),
    Case("pow", "return pow(abs(v) + 0.25, w);", lambda v, w, i: (np.abs(v) + 0.25) ** w, 4e-5),
    Case("abs of int", "return vec4(abs(ivec4(v * 100.0)));", lambda v, w, i: np.abs(np.trunc(v * np.float32(100)))),
    Case("sign of int", "return vec4(sign(i - 3), sign(ivec3(v.xyz)));", lambda v, w, i: (np.sign(i - 3), *np.sign(np.trunc(v[:3])))),
    Case("mod", "return vec4(mod(v.xyz, 0.75), mod(v.w, 1.25));", lambda v, w, i: (*mod(v[:3], 0.75), mod(v[3], 1.25))),
    Case("mod of vectors", "return mod(v, vec4(0.5, -0.5, 1.75, -1.75));",
         lambda v, w, i: [mod(v[k], m) for k, m in enumerate((0.5, -0.5, 1.75, -1.75))]),
    Case("min", "return vec4(min(v.xy, w.xy), min(v.z, 0.25), min(i, 7));",
         lambda v, w, i: (*np.minimum(v, w)[:2], np.minimum(v[2], 0.25), np.minimum(i, 7))),
    Case("max", "return vec4(max(v.xy, 0.5), max(v.z, w.z), max(uint(i), 3u));",
         lambda v, w, i: (*np.maximum(v, 0.5)[:2], np.maximum(v, w)[2], np.maximum(i, 3))),
    Case("min and max of ints", "return vec4(min(ivec2(v.xy * 9.0), ivec2(w.xy)), max(ivec2(v.zw), 1));",
         lambda v, w, i: (*np.minimum(np.trunc(v * 9), np.trunc(w))[:2], *np.maximum(np.trunc(v), 1)[2:])),
    Case("clamp", "return vec4(clamp(v.xy, -0.5, 0.75), clamp(v.z, w.z, w.z + 1.0), clamp(i, 3, 9));",
         lambda v, w, i: (*np.clip(v, -0.5, 0.75)[:2], np.clip(v[2], w[2], w[2] + 1), np.clip(i, 3, 9))),
    Case("clamp of vectors", "return clamp(v, min(w, vec4(0.0)), max(w, 0.0));",
         lambda v, w, i: np.clip(v, np.minimum(w, 0), np.maximum(w, 0))),
    Case("mix", "return vec4(mix(v.xy, w.xy, 0.25), mix(v.zw, w.zw, vec2(0.5, 1.0)));",
         lambda v, w, i: (*(v * 0.75 + w * 0.25)[:2], v[2] * 0.5 + w[2] * 0.5, w[3])),
    Case("mix by bools", "return vec4(mix(v.xyz, w.xyz, lessThan(v.xyz, w.xyz)), mix(v.w, w.w, v.w < w.w));",
         lambda v, w, i: np.where(v < w, w, v)),
    Case("step", "return vec4(step(0.0, v.xyz), step(v.w, w.w));", lambda v, w, i: (*(v[:3] >= 0), w[3] >= v[3])),
    Case("step of vectors", "return step(w, v);", lambda v, w, i: v >= w),
    Case("smoothstep", "return vec4(smoothstep(-1.0, 2.0, v.xyz), smoothstep(2.0, 0.0, v.w));",
         lambda v, w, i: (*smoothstep(-1, 2, v[:3]), smoothstep(2, 0, v[3]))),
    Case("smoothstep of vectors", "return smoothstep(vec4(-1.0, 0.0, -2.0, 0.0), vec4(1.0, 2.0, 3.0, 4.0), v);",
         lambda v, w, i: [smoothstep(a, b, v[k]) for k, (a, b) in enumerate(((-1, 1), (0, 2), (-2, 3), (0, 4)))]),
    Case("length", "return vec4(length(v), length(v.xyz), length(v.xy), length(v.x));",
         lambda v, w, i: [np.sqrt((v[:n] ** 2).sum(axis=0)) for n in (4, 3, 2, 1)]),
    Case("distance", "return vec4(distance(v, w), distance(v.xyz, w.xyz), distance(v.xy, w.xy), distance(v.x, w.x));",
         lambda v, w, i: [np.sqrt(((v - w)[:n] ** 2).sum(axis=0)) for n in (4, 3, 2, 1)]),
    Case("dot", "return vec4(dot(v, w), dot(v.xyz, w.xyz), dot(v.xy, w.xy), dot(v.x, w.x));",
         lambda v, w, i: [dot(v[:n], w[:n]) for n in (4, 3, 2, 1)]),
    Case("cross", "return vec4(cross(v.xyz, w.xyz), 0.0);", lambda v, w, i: np.cross(v[:3], w[:3], axis=0)),
    Case("normalize", "return vec4(normalize(v.xyz), normalize(v.w));", lambda v, w, i: (*unit(v[:3]), np.sign(v[3]))),
    Case("normalize of 2 and 4", "return vec4(normalize(v.xy), normalize(v).xy);",
         lambda v, w, i: (*unit(v[:2]), *unit(v)[:2])),
    Case("normalize of nothing", "return vec4(normalize(vec3(0.0)), normalize(vec2(0.0)).x);", lambda v, w, i: (0, 0, 0, 0)),
    Case("normalize of extremes", "return vec4(normalize(v.xyz * 1.0e-30), normalize(v * 1.0e25).x);",
         lambda v, w, i: (*unit(v[:3]), unit(v)[0])),
    Case("reflect", "return vec4(reflect(v.xyz, normalize(w.xyz)), reflect(v.w, 0.5));",
         lambda v, w, i: (*reflect(v[:3], unit(w[:3])), v[3] * 0.5)),
    Case("refract", "return vec4(refract(normalize(v.xyz), normalize(w.xyz), 0.7), 0.0);",
         lambda v, w, i: refract(unit(v[:3]), unit(w[:3]), 0.7)),
    Case("total reflection", "return vec4(refract(vec3(0.0, 1.0, 0.0), vec3(1.0, 0.0, 0.0), 1.5), 0.0);", lambda v, w, i: (0, 0, 0)),
    Case("any and all", "bvec3 b = lessThan(v.xyz, vec3(0.0)); return vec4(any(b), all(b), any(not(b)), all(not(b)));",
         lambda v, w, i: ((v[:3] < 0).any(0), (v[:3] < 0).all(0), (v[:3] >= 0).any(0), (v[:3] >= 0).all(0))),
    Case("comparisons",
         "return vec4(all(lessThan(v, w)), any(lessThanEqual(v.xy, v.xy)), any(greaterThan(v, w)),"
         " all(greaterThanEqual(v.xyz, w.xyz)));",
         lambda v, w, i: ((v < w).all(0), 1, (v > w).any(0), (v[:3] >= w[:3]).all(0))),
    Case("comparisons of ints",
         "ivec2 a = ivec2(v.xy); uvec2 b = uvec2(abs(w.xy));"
         " return vec4(any(lessThan(a, ivec2(0))), all(greaterThan(b, uvec2(1u))), any(equal(a, ivec2(1))), all(notEqual(a, ivec2(w.xy))));",
         lambda v, w, i: ((np.trunc(v[:2]) < 0).any(0), (np.trunc(np.abs(w[:2])) > 1).all(0), (np.trunc(v[:2]) == 1).any(0),
                          (np.trunc(v[:2]) != np.trunc(w[:2])).all(0))),
    Case("equal", "return vec4(all(equal(v, v)), any(equal(v, w)), any(notEqual(v, w)), any(equal(lessThan(v, w), greaterThan(w, v))));",
         lambda v, w, i: (1, (v == w).any(0), (v != w).any(0), 1)),
    Case("isnan", "float zero = v.x - v.x; float nan = zero / zero; return vec4(isnan(nan), isnan(v.x), any(isnan(vec3(0.0, nan, 1.0))), isnan(1.0 / zero));",
         lambda v, w, i: (1, 0, 1, 0)),
    Case("isinf", "float zero = v.x - v.x; return vec4(isinf(1.0 / zero), isinf(-1.0 / zero), any(isinf(v)), isinf(zero / zero));",
         lambda v, w, i: (1, 1, 0, 0)),
    Case("isnan from bits", "float nan = uintBitsToFloat(0x7fc00000u + uint(i)); return vec4(isnan(nan), isnan(nan + 1.0), isinf(nan), isinf(uintBitsToFloat(0xff800000u)));",
         lambda v, w, i: (1, 1, 0, 1)),
    Case("floatBitsToUint", "uvec2 b = floatBitsToUint(v.xy); return vec4(b.x >> 16u, b.y & 0xffffu, floatBitsToUint(v.z) >> 20u, 0.0);",
         lambda v, w, i: (as_bits(v[0]) >> 16, as_bits(v[1]) & 0xFFFF, as_bits(v[2]) >> 20)),
    Case("uintBitsToFloat", "uint m = uint(i) * 77777u; return vec4(uintBitsToFloat(0x3f800000u + m), uintBitsToFloat(uvec2(0x40000000u, m + 0x3e000000u)), 0.0);",
         lambda v, w, i: (as_float(0x3F800000 + i * 77777), 2.0, as_float(0x3E000000 + i * 77777))),
    Case("expm1", "return vec4(expm1(v.x), expm1(v.y * 1.0e-3), expm1(v.z * 20.0), expm1(-abs(v.w) * 1.0e-6));",
         lambda v, w, i: (np.expm1(v[0]), np.expm1(v[1] * 1e-3), np.expm1(v[2] * 20), np.expm1(-np.abs(v[3]) * 1e-6)), 2e-5),
    Case("log1p", "return vec4(log1p(abs(v.x)), log1p(v.y * 1.0e-3), log1p(abs(v.z) * 1.0e6), log1p(v.w * 0.2));",
         lambda v, w, i: (np.log1p(np.abs(v[0])), np.log1p(v[1] * 1e-3), np.log1p(np.abs(v[2]) * 1e6), np.log1p(v[3] * 0.2)), 2e-6),
    Case("transform",
         "mat3 a = mat3(v.xyz, w.xyz, vec3(1.0, 2.0, 3.0)); mat4 b = mat4(v, w, v + w, vec4(1.0));"
         " return vec4(transform(a, vec3(1.0, -2.0, 0.5)).xy, transform(b, vec4(0.5, 2.0, -1.0, 3.0)).zw);",
         lambda v, w, i: (*(v[:2] - 2 * w[:2] + np.array([[0.5], [1.0]])), *(0.5 * v + 2 * w - (v + w) + 3)[2:])),
]  # fmt: skip

RESULTS = Results(CASES)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_builtin_agrees_with_numpy(case: Case, device: Any) -> None:
    RESULTS.check(device, case)


def test_every_builtin_has_a_case() -> None:
    text = " ".join(case.body for case in CASES)
    assert [name for name in SIGNATURES if f"{name}(" not in text] == []
    assert len(ACCESSORS) == 13, "a new accessor needs a test in test_fields.py"


ACCURATE = """
field2 x;
vec2 pixel(ivec2 at) {
    float a = fetch2(x, at).r;
    return vec2(expm1(a), log1p(a));
}
"""


def test_expm1_and_log1p_keep_their_digits_near_zero(device: Any) -> None:
    from nodegraph.shaders import Source

    rng = np.random.default_rng(4)
    small = np.exp(rng.uniform(-30, 4.4, 6000)) * rng.choice((-1, 1), 6000)
    x = np.concatenate([small, rng.uniform(-1, 1, 2000), [0.0, -1.0, -50.0, 88.5, 1e30]]).astype(np.float32)
    x = x[: x.size // 5 * 5].reshape(5, -1)
    got = device.run(Source.of(ACCURATE), x.shape[::-1], x=x[..., None]).array
    with np.errstate(all="ignore"):
        exact = np.stack([np.expm1(x.astype(np.float64)), np.log1p(x.astype(np.float64))], axis=-1)
    with np.errstate(over="ignore"):
        rounded = exact.astype(device.real)
    fine = np.isfinite(rounded) & (np.abs(exact) > 1e-30)
    np.testing.assert_array_equal(np.isnan(got), np.isnan(exact))
    np.testing.assert_array_equal(np.isposinf(got), np.isposinf(rounded))
    np.testing.assert_array_equal(np.isneginf(got), np.isneginf(rounded))
    ulps = np.zeros(exact.shape)
    ulps[fine] = np.abs(got[fine] - exact[fine]) / np.spacing(np.abs(rounded[fine])).astype(np.float64)
    assert ulps[..., 1].max() <= 4.0
    if device.name != "gl":
        assert ulps[..., 0].max() <= 4.0
        return
    # On OpenGL expm1 is the driver's exp but near 0, to the relative errors that docs/kernel-language.md states.
    relative = ulps[..., 0] * np.finfo(np.float32).eps
    assert relative[np.abs(x) < 0.0625].max() <= 5e-7
    assert relative[x < 0.0].max() <= 6e-6
    assert relative.max() <= 1e-5
