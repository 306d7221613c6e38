"""The floor: what a sample costs on this OpenGL at the least, stage by stage, and so what a frame cannot go below.

Written by hand in moderngl, with nothing of ours in it: a fragment shader that walks through a volume and does a little
more in each stage. Told is processor time, of all threads together, so that a busy machine does not blur it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

SIDE, PIXELS, SAMPLES, ROWS, ROUNDS = 256, 256, 256, 2048, 3

VERTEX = """
#version 330
void main() { gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0); }
"""
FRAGMENT = """
#version 330
uniform sampler3D volume;
uniform sampler3D gradient;
uniform sampler2D colors;
uniform float samples;
uniform vec2 pixels;
out vec4 color;
void main() {
    vec3 start = vec3(gl_FragCoord.xy / pixels, 0.0);
    vec3 along = vec3(0.0005, 0.0003, 1.0 / samples);
    vec4 sum = vec4(0.0);
    for (float k = 0.0; k < samples && sum.a < 2.0; k += 1.0) {
        vec3 p = start + along * (k + 0.5);
        STAGE
    }
    color = sum;
}
"""
VALUE = "float value = texture(volume, p).r;"
OPTICS = VALUE + " vec4 optics = texture(colors, vec2(value, 0.5));"
NEXT = "value += texture(volume, p {} vec3({})).r;"
STAGES = {
    "the loop and a position": "sum.rgb += p;",
    "one voxel, not interpolated": "sum.r += texelFetch(volume, ivec3(p * 256.0), 0).r;",
    "the value, interpolated": VALUE + " sum.r += value;",
    "value and table": OPTICS + " sum.rgb += optics.rgb;",
    "value, table, opacity, blending: a sample": OPTICS
    + " float alpha = (1.0 - sum.a) * (1.0 - exp(-1e-4 * optics.a)); sum += vec4(optics.rgb, 1.0) * alpha;",
    "four channels of half floats, interpolated": "sum.rgb += texture(gradient, p).rgb;",
    "seven values: a value and its differences": VALUE
    + " ".join(NEXT.format(sign, axis) for axis in ("0.004, 0, 0", "0, 0.004, 0", "0, 0, 0.004") for sign in "+-")
    + " sum.r += value;",
}


@dataclass(frozen=True)
class Stage:
    """nanoseconds: of processor time a sample; divided by the number of cores, of time on an idle machine."""

    name: str
    nanoseconds: float


def stages() -> list[Stage]:
    """Measure all stages."""
    import moderngl

    context = moderngl.create_context(standalone=True, backend="egl", require=330)
    try:
        made = np.random.default_rng(1)
        shape = (SIDE, SIDE, SIDE)
        volume = context.texture3d(shape, 1, made.integers(0, 65536, shape, np.uint16), dtype="nu2", alignment=1)
        gradient = context.texture3d(shape, 4, made.random((*shape, 4), np.float32).astype(np.float16), dtype="f2")
        colors = context.texture((ROWS, 1), 4, made.random((ROWS, 4), np.float32), dtype="f4")
        for unit, texture in enumerate((volume, gradient, colors)):
            texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
            texture.use(unit)
        context.framebuffer([context.texture((PIXELS, PIXELS), 4, dtype="f4")]).use()
        return [Stage(name, _nanoseconds(context, text)) for name, text in STAGES.items()]
    finally:
        context.release()


def _nanoseconds(context: Any, stage: str) -> float:
    import moderngl

    program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT.replace("STAGE", stage))
    values = {"volume": 0, "gradient": 1, "colors": 2, "samples": float(SAMPLES), "pixels": (PIXELS, PIXELS)}
    for name in set(values) & set(program):
        program[name].value = values[name]
    vertices = context.vertex_array(program, [])
    taken = []
    for _ in range(ROUNDS + 1):  # the first one compiles
        start = time.process_time()
        vertices.render(moderngl.TRIANGLES, vertices=3)
        context.finish()
        taken.append(time.process_time() - start)
    return min(taken[1:]) / (PIXELS * PIXELS * SAMPLES) * 1e9
