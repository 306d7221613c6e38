"""One kernel function per construct of the language, on every device, against numpy."""

# ruff: noqa: E501

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from batch import Case, Results

SHARED = """
#define STEPS 5
#define NEGATIVE -2.5
const float PI = 3.14159265358979;
const float TWO_PI = 2.0 * PI;
const vec3 AXIS = normalize(vec3(0.0, 3.0, 4.0));
const int COUNT = 2 + STEPS / 2;
const float WEIGHTS[COUNT] = float[](0.25, -0.5, TWO_PI, 8.0);
const ivec2 PLACES[2] = ivec2[2](ivec2(1, 2), ivec2(3, -COUNT));

struct Inner { vec2 place; float weights[3]; };
struct Outer { Inner inner; int count; bool flag; vec3 direction; uint bits; mat3 turn; };
struct kernel { float half; float _x; };

float below(float x) { return above(x) * 2.0; }
float above(float x) { return x + 1.0; }
float changed(float x) { x *= 2.0; x += 1.0; return x; }
float array_changed(float values[3]) { values[1] = 100.0; return values[0] + values[1]; }
float[3] filled(float x) { return float[3](x, x * 2.0, x * 3.0); }
Inner made(vec2 p) { Inner r; r.place = p.yx; r.weights = filled(p.x); return r; }
float summed(Outer o) { o.inner.weights[0] += 1.0; return o.inner.weights[0] + o.inner.place.y + float(o.count) + float(o.bits); }
vec3 turned(mat3 m, vec3 p) { return transform(m, p); }
float first_above(float limit) {
    for (int k = 0; k < 100; k++) { if (float(k * k) > limit) { return float(k); } }
    return -1.0;
}
bool is_odd(int n) { return (n & 1) == 1; }
uint hashed(uint x) { x ^= x >> 16u; x *= 0x7feb352du; x ^= x >> 15u; x *= 0x846ca68bu; x ^= x >> 16u; return x; }
"""


def hashed(x: Any) -> Any:
    x = np.asarray(x, np.uint32)
    with np.errstate(over="ignore"):
        x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7FEB352D)
        x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846CA68B)
    return x ^ (x >> np.uint32(16))


def c_mod(a: Any, b: int) -> Any:
    return np.sign(a) * (np.abs(a) % abs(b))


WEIGHTS = np.array([0.25, -0.5, 2 * np.pi, 8.0])

CASES = [
    Case("declarations", "float a = v.x, b = a * 2.0; const float c = b + 1.0; return vec4(a, b, c, NEGATIVE);",
         lambda v, w, i: (v[0], 2 * v[0], 2 * v[0] + 1, -2.5)),
    Case("variables start at zero", "float a; vec3 b; int c; float d[4]; Outer e; a += v.x; b.y += 1.0; d[i & 3] += 1.0;"
         " return vec4(a, b.x + b.y, d[0] + d[1] + d[2] + d[3] + float(c), e.inner.weights[2] + e.direction.z + float(e.flag));",
         lambda v, w, i: (v[0], 1, 1, 0)),
    Case("compound assignment", "float a = v.x; a += 2.0; a *= 3.0; a -= v.y; a /= 4.0; vec2 b = v.xy; b *= 2.0; b += w.xy;"
         " int n = i; n %= 5; n <<= 2; n |= 1; n ^= 8; return vec4(a, b, n);",
         lambda v, w, i: (((v[0] + 2) * 3 - v[1]) / 4, *(v[:2] * 2 + w[:2]), ((i % 5 << 2) | 1) ^ 8)),
    Case("count up and down", "int n = i; n++; ++n; n--; float x = v.x; x++; --x; x--; uint u = 5u; u--; ivec2 k = ivec2(i); k++;"
         " return vec4(n, x, u, k.y);", lambda v, w, i: (i + 1, v[0] - 1, 4, i + 1)),
    Case("if and else", "float r; if (v.x < -1.0) r = 1.0; else if (v.x < 0.0) { r = 2.0; } else if (v.x < 1.0) r = 3.0; else { r = 4.0; }"
         " if (i == 3) return vec4(9.0); return vec4(r);",
         lambda v, w, i: [np.where(i == 3, 9, np.select([v[0] < -1, v[0] < 0, v[0] < 1], [1, 2, 3], 4))] * 4),
    Case("for, continue, break", "float s = 0.0; for (int k = 0; k < 10; ++k) { if (k == i) continue; if (k > 7) break;"
         " for (int m = k; m > 0; m -= 2) s += 1.0; } return vec4(s);",
         lambda v, w, i: [sum(np.where(i == k, 0, (k + 1) // 2) for k in range(8))]),
    Case("for with two counters", "float s = 0.0; int last = 4; for (int a = 0, b = 9; a < b; a++) { s += float(b - a); b--; } for (;;) { if (s > 100.0) break; s *= 2.0; }"
         " return vec4(s);", lambda v, w, i: [200]),
    Case("while and do", "int a = i, n = 0; while (a > 0) { a /= 2; n++; } int k = 0; do { k++; if (k == 3) continue; } while (k < i);"
         " return vec4(n, k, 0.0, 0.0);", lambda v, w, i: ([int(x).bit_length() for x in i], np.maximum(i, 1))),
    Case("endless while", "int k = 0; while (true) { k += 3; if (k > i) return vec4(k); }", lambda v, w, i: [(i // 3 + 1) * 3]),
    Case("shadowing", "float a = 1.0; { float a = 2.0; { float b = a; float a = b + v.x; a += 1.0; w.x = a; } w.y = a; } for (int a = 0; a < 1; a++) w.z = float(a);"
         " return vec4(w.xyz, a);", lambda v, w, i: (v[0] + 3, 2, 0, 1)),
    Case("ternary", "vec3 a = v.x > 0.0 ? v.xyz : -w.xyz; int n = i > 5 ? (i > 10 ? 2 : 1) : 0; return vec4(a, n);",
         lambda v, w, i: (*np.where(v[0] > 0, v[:3], -w[:3]), (i > 5) * 1 + (i > 10) * 1)),
    Case("ternary of structs", "kernel a = i > 4 ? kernel(v.x, 1.0) : kernel(v.y, 2.0); float b[2] = is_odd(i) ? float[2](1.0, v.z) : float[2](2.0, v.w); return vec4(a.half, a._x, b[0], b[1]);",
         lambda v, w, i: (np.where(i > 4, v[0], v[1]), np.where(i > 4, 1, 2), np.where(i & 1, 1, 2), np.where(i & 1, v[2], v[3]))),
    Case("swizzles", "vec4 a = v.wzyx; vec3 b = a.rgb; return vec4(b.st, v.bgra.y, (v + w).zzz.x);",
         lambda v, w, i: (v[3], v[2], v[1], v[2] + w[2])),
    Case("swizzles assigned", "vec4 a = v; a.xz = a.zx; a.yw *= 2.0; a.rgb += vec3(1.0, 2.0, 3.0); a.w = a.x; return a;",
         lambda v, w, i: (v[2] + 1, v[1] * 2 + 2, v[0] + 3, v[2] + 1)),
    Case("ivec swizzles", "ivec3 a = ivec3(i, i + 1, i + 2); a.xy = a.yx; a.z += a.x; return vec4(a, a.zyx.y);",
         lambda v, w, i: (i + 1, i, 2 * i + 3, i)),
    Case("index of a vector", "vec4 a = v; a[1] = 5.0; a[i & 3] += 1.0; ivec3 n = ivec3(1, 2, 3); return vec4(a[0], a[i & 3], n[i % 3], v[9 - i]);",
         lambda v, w, i: (v[0] + (i & 3 == 0), np.choose(i & 3, [v[0], np.full(v[0].shape, 5.0), v[2], v[3]]) + 1, i % 3 + 1,
                          np.choose(np.clip(9 - i, 0, 3), list(v)))),
    Case("arrays", "float a[4]; for (int k = 0; k < 4; k++) a[k] = v[k] * float(k); float b[4] = a; b[2] = 50.0; vec2[2] c = vec2[2](v.xy, w.xy); c[1].y = 7.0;"
         " return vec4(a[2], b[2], a[3] + b[1], c[1].y + c[0].y);", lambda v, w, i: (2 * v[2], 50, 3 * v[3] + v[1], 7 + v[1])),
    Case("arrays are copied into functions", "float a[3] = float[3](v.x, v.y, v.z); float s = array_changed(a); return vec4(s, a[1], filled(v.w)[2], 0.0);",
         lambda v, w, i: (v[0] + 100, v[1], 3 * v[3])),
    Case("indices are clamped", "float a[3] = float[3](1.0, 2.0, 3.0); a[i - 5] += 10.0; return vec4(a[i * 100], a[-i], a[i - 5], WEIGHTS[i + 2]);",
         lambda v, w, i: (np.where(i == 0, 11.0, np.where(i >= 7, 13, 3)), np.where(i <= 5, 11, 1), np.clip(i - 5, 0, 2) + 11, np.where(i == 0, WEIGHTS[2], 8))),
    Case("arrays of constants", "float s = 0.0; for (int k = 0; k < COUNT; k++) s += WEIGHTS[k]; float c[COUNT] = WEIGHTS; c[0] = 1.0; return vec4(s, WEIGHTS[i], c[0] + c[1], PLACES[i % 2].y);",
         lambda v, w, i: (WEIGHTS.sum(), WEIGHTS[np.clip(i, 0, 3)], 0.5, np.where(i % 2, -4, 2))),
    Case("global constants", "float PI = PI + 1.0; return vec4(PI, TWO_PI, AXIS.z, COUNT);", lambda v, w, i: (np.pi + 1, 2 * np.pi, 0.8, 4)),
    Case("structs", "Outer o; o.inner = made(v.xy); o.count = i; o.bits = 3u; o.flag = true; Outer p = o; p.inner.weights[2] = 0.5;"
         " return vec4(summed(o), o.inner.weights[0], o.inner.weights[2], p.inner.weights[2] + float(p.flag));",
         lambda v, w, i: (v[0] + 1 + v[0] + i + 3, v[0], 3 * v[0], 1.5)),
    Case("struct constructors", "Outer o = Outer(Inner(v.zw, float[3](1.0, 2.0, 3.0)), 4, false, vec3(5.0), 6u, mat3(2.0)); Inner two[2] = Inner[2](o.inner, made(v.xy)); two[i & 1].weights[1] = -1.0;"
         " return vec4(two[0].weights[1], two[1].place.x, transform(o.turn, v.xyz).y, float(o.count) + o.direction.x);",
         lambda v, w, i: (np.where(i & 1, 2, -1), v[1], 2 * v[1], 9)),
    Case("matrices", "mat3 m = mat3(1.0); m[1] = v.xyz; m[2][0] = 4.0; mat4 n = mat4(3.0); n[i & 3].x += 1.0; return vec4(turned(m, vec3(1.0, 2.0, 3.0)).xy, m[1][2], transform(n, vec4(1.0)).x);",
         lambda v, w, i: (1 + 2 * v[0] + 12, 2 * v[1], v[2], 4)),
    Case("vector constructors", "vec3 a = vec3(v); vec4 b = vec4(v.xy, w); vec4 c = vec4(1.0, v.yz, w.x); return vec4(a.z, b.w, c.z, vec2(i).y);",
         lambda v, w, i: (v[2], w[1], v[2], i)),
    Case("conversions", "ivec3 a = ivec3(v.xyz); uvec2 b = uvec2(abs(w.xy)); vec3 c = vec3(a) + vec3(uvec3(1u)); bool d = bool(i); return vec4(c.x, float(b.y), float(d) + float(bool(v.x)), uint(i) + uint(true));",
         lambda v, w, i: (np.trunc(v[0]) + 1, np.trunc(np.abs(w[1])), (i != 0) * 1 + (v[0] != 0), i + 1)),
    Case("signs of integers", "int a = int(0xfffffffeu); uint b = uint(-i); return vec4(a, float(b + 30u), ivec2(uvec2(0xffffffffu, 7u)));",
         lambda v, w, i: (-2, (30 - i) % 2**32, -1, 7)),
    Case("vector and scalar", "vec3 a = 2.0 * v.xyz - 1.0; vec3 b = 1.0 / (a + 20.0); ivec2 n = 3 - ivec2(i) * 2; return vec4(a.x, b.y, -n);",
         lambda v, w, i: (2 * v[0] - 1, 1 / (2 * v[1] + 19), 2 * i - 3, 2 * i - 3)),
    Case("integer division", "int a = i - 12; return vec4(a / 5, a % 5, a / (i - i), a % (i - i));", lambda v, w, i: (np.trunc((i - 12) / 5), c_mod(i - 12, 5), 0, 0)),
    Case("integer division of vectors", "ivec2 a = ivec2(i - 12, 7) / ivec2(-1, i - 3); uvec2 b = uvec2(uint(i), 9u) % uvec2(4u, uint(i)); return vec4(a, b);",
         lambda v, w, i: (12 - i, np.where(i == 3, 0, np.trunc(7 / np.where(i == 3, 1, i - 3))), i % 4, np.where(i == 0, 0, 9 % np.maximum(i, 1)))),
    Case("smallest int", "int a = -2147483647 - 1; int b = a / -1; int c = a / min(i - 30, -1); return vec4(float(a), b == a || b == 2147483647, a % -1, c != 0);",
         lambda v, w, i: (-(2.0**31), 1, 0, 1)),
    Case("unsigned division", "uint a = uint(i) + 4000000000u; return vec4(a / 1000000000u, a % 10u, a / uint(i), a % uint(i));",
         lambda v, w, i: (4, i % 10, np.where(i == 0, 0, (i + 4000000000) // np.maximum(i, 1)), np.where(i == 0, 0, (i + 4000000000) % np.maximum(i, 1)))),
    Case("bits", "uint a = uint(i) << 28u; int b = -16 >> 2; return vec4(float(a >> 28u), b, (i & 6) | (i ^ 3), ~i);",
         lambda v, w, i: (i % 16, -4, (i & 6) | (i ^ 3), ~i)),
    Case("bits of vectors", "uvec3 a = uvec3(1u, 2u, 3u) << uint(i & 7); ivec2 b = ivec2(-8, 64) >> ivec2(1, 2); return vec4(a.xz ^ uvec2(1u), b);",
         lambda v, w, i: ((1 << (i & 7)) ^ 1, (3 << (i & 7)) ^ 1, -4, 16)),
    Case("integer hash", "uint h = hashed(uint(i) * 0x9e3779b9u); return vec4(h >> 16u, h & 0xffffu, 0.0, 0.0);",
         lambda v, w, i: (hashed(i.astype(np.uint32) * np.uint32(0x9E3779B9)) >> 16, hashed(i.astype(np.uint32) * np.uint32(0x9E3779B9)) & 0xFFFF)),
    Case("logic", "bool a = v.x > 0.0, b = v.y > 0.0; return vec4(a && b, a || b, a ^^ b, !a == b);",
         lambda v, w, i: ((v[0] > 0) & (v[1] > 0), (v[0] > 0) | (v[1] > 0), (v[0] > 0) ^ (v[1] > 0), ~(v[0] > 0) == (v[1] > 0))),
    Case("comparison", "return vec4(float(v.x < w.x) + float(v.x <= w.x) * 2.0, v.x > w.x, i != 4, (i >= 2) == true);",
         lambda v, w, i: ((v[0] < w[0]) * 3.0, v[0] > w[0], i != 4, i >= 2)),
    Case("bool vectors", "bvec3 a = lessThan(v.xyz, w.xyz); bvec3 b = not(a); bvec3 c = i > 3 ? a : b; return vec4(any(a), all(b), any(c), all(a));",
         lambda v, w, i: ((v[:3] < w[:3]).any(0), (v[:3] >= w[:3]).all(0), np.where(i > 3, (v[:3] < w[:3]).any(0), (v[:3] >= w[:3]).any(0)), (v[:3] < w[:3]).all(0))),
    Case("any name", "float half = 1.0, local = 2.0, input = 3.0, global = 4.0, float4 = 5.0, real = 6.0, main = 7.0, sin = 8.0, r = 9.0, _ = 0.5, at = 0.25, reals = 0.125, convert_int = 1.0, sampler = 2.0, y0 = 0.0, step = 1.0, NULL = 3.0; "
         "return vec4(half + local + input + global, float4 + real + main + sin(0.0), sin + r + _ + at, reals + sampler + step + NULL);",
         lambda v, w, i: (10, 18, 17.75, 6.125)),
    Case("order of functions", "return vec4(below(v.x), changed(v.y), v.y, first_above(float(i)));",
         lambda v, w, i: (2 * v[0] + 2, 2 * v[1] + 1, v[1], np.floor(np.sqrt(i)) + 1)),
    Case("long literals", "return vec4(1.5e-3f, .5, 2., 16777217.0 - 16777216.0 > 2.0);", lambda v, w, i: (1.5e-3, 0.5, 2, 0)),
]  # fmt: skip

RESULTS = Results(CASES, SHARED)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_construct_agrees_with_numpy(case: Case, device: Any) -> None:
    RESULTS.check(device, case)
