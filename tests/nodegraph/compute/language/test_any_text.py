"""Whatever the text: a module or a ShaderError, in reasonable time, and what compiles can be printed."""

# ruff: noqa: E501

from __future__ import annotations

import random
import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nodegraph.compute import language
from nodegraph.compute.language import Storage
from nodegraph.errors import ShaderError

KERNEL = """
#ifndef LIT
#define LIT 1
#endif
#define STEPS 4
struct Light { vec3 direction; float power[2]; };
uniform Light lights[3];
uniform float gain = 2.0;
const float TABLE[3] = float[](1.0, 2.0, 3.0);
field3 volumes[2];
field1 table;
float f(field3 v, vec3 p) { return sample3(v, p) * gain + TABLE[STEPS - 2]; }
vec4 pixel(ivec2 at) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < STEPS; ++i) {
        if (i == 2 && at.x > 3) continue;
        float x = f(volumes[i], vec3(at, float(i))) / (1.0 + lights[i].power[1]);
#if LIT
        sum.rgb += sample1(table, x).bgr * max(dot(lights[0].direction, vec3(x)), 0.0);
#else
        sum += fetch1(table, i);
#endif
        do { sum.a = i % 2 == 0 ? sum.a + 1.0 : -sum.a; } while (sum.a > 10.0);
    }
    return sum;
}
"""
PIECES = re.findall(r"\w+|[^\w\s]+|\s+", KERNEL)
WORDS = [
    *dict.fromkeys(PIECES),
    "uniform",
    "discard",
    "out",
    "[",
    "]",
    "((",
    "#if",
    "#define X X\n",
    "/*",
    "*/",
    "\\",
    "é",
    "0x",
    "1e",
    "\0",
]


def must_translate_or_refuse(text: str) -> None:
    refusal = ""
    try:
        module = language.compile(text)
    except ShaderError as error:
        refusal = str(error)
    if refusal:
        assert re.match(r"kernel.glsl(:\d+)?: .+", refusal)
        return
    storages = {field.name: (Storage("u1"),) * max(field.count, 1) for field in module.fields}
    assert language.print_glsl(module, storages)[0].startswith("#version 330")
    assert "__kernel" in language.print_opencl(module, storages)[0]


def test_the_kernel_itself_compiles() -> None:
    assert language.compile(KERNEL).entry == "pixel"


@pytest.mark.slow
@settings(max_examples=250, deadline=2000, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 2**32 - 1))
def test_mutated_kernels(seed: int) -> None:
    """Delete, double, swap and replace tokens."""
    rng = random.Random(seed)
    pieces = list(PIECES)
    for _ in range(rng.choice((1, 1, 1, 2, 5, 40))):
        at = rng.randrange(len(pieces))
        change = rng.randrange(5)
        if change == 0:
            del pieces[at]
        elif change == 1:
            pieces.insert(at, rng.choice(WORDS))
        elif change == 2:
            pieces[at] = rng.choice(WORDS)
        elif change == 3:
            other = rng.randrange(len(pieces))
            pieces[at], pieces[other] = pieces[other], pieces[at]
        else:
            pieces[at:at] = pieces[at : at + rng.randrange(12)] * rng.choice((1, 2, 60))
    must_translate_or_refuse("".join(pieces))


@pytest.mark.slow
@settings(max_examples=100, deadline=2000, derandomize=True)
@given(st.text(max_size=60))
def test_any_characters(text: str) -> None:
    must_translate_or_refuse(text)
    must_translate_or_refuse(KERNEL.replace("gain = 2.0", text))


def test_deep_and_long_texts_end_soon() -> None:
    for text in (
        "#define A0 1\n" + "".join(f"#define A{i + 1} A{i}\n" for i in range(500)) + "float pixel(ivec2 at) { return A500; }",
        "#define A B\n#define B A\nfloat pixel(ivec2 at) { return A; }",
        "#if " + "(" * 5000,
        "#if " + "!" * 5000 + "1\n#endif",
        "float pixel(ivec2 at) { " + "{" * 5000,
        "float pixel(ivec2 at) { " + "if (true) " * 5000,
        "float pixel(ivec2 at) { return " + "-" * 5000 + "1.0; }",
        "float pixel(ivec2 at) { return " + "true ? 1.0 : " * 3000 + "1.0; }",
        "float pixel(ivec2 at) { return at" + ".x" * 5000 + "; }",
        "float pixel(ivec2 at) { return at" + "[0]" * 5000 + "; }",
        "float pixel(ivec2 at) { return " + "sin(" * 5000 + "1.0; }",
        "uniform float a[99999999999999999999];",
        "const int A = 1 << 31; const int B = A * A * A; uniform float x[B];",
        "struct A { float x[60000]; }; " + "".join(f"struct {b} {{ {a} x[60000]; }}; " for a, b in zip("ABCDEF", "BCDEFG", strict=True)),
    ):  # fmt: skip
        must_translate_or_refuse(text)
