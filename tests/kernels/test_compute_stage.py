"""Voxel entries as compute shaders: the same values as slice by slice. Devices may choose either."""

from __future__ import annotations

from typing import Any

import numpy as np

from nodegraph.compute import language
from nodegraph.compute.language import Storage
from nodegraph.shaders import Source

KERNEL = """
struct Result { vec2 place; uint id; float value; int sum; vec4 color; };
field3 v;
Result voxel(ivec3 at) {
    float x = sample3(v, vec3(at) + 0.25);
    return Result(vec2(at.xy), uint(at.z) + 16777217u, x, at.x - at.y, vec4(x, vec3(at)));
}
"""
TYPES = {"place": (2, "f4"), "id": (1, "u4"), "value": (1, "f4"), "sum": (1, "i4"), "color": (4, "f4")}


def test_compute_shader_agrees_with_slices(gl: Any, rng: np.random.Generator) -> None:
    size = (5, 9, 11)
    data = rng.normal(size=size[::-1]).astype(np.float32)
    drawn = gl.run(Source.of(KERNEL), size, v=data)
    drawn = {name: getattr(drawn, name).array for name in TYPES}

    gl.make_current()
    context = gl.context
    text, layout = language.print_glsl(language.compile(KERNEL), {"v": (Storage("f4"),)}, "compute", 430)
    program = context.compute_shader(text)
    volume = context.texture3d(size, 1, data, dtype="f4")
    volume.use(0)
    slot = layout.slots[0]
    for name, value in ((slot.sampler, 0), (slot.size, size), (layout.origin, (0, 0, 0)), (layout.extent, size)):
        program[name].value = value
    targets = {name: context.texture3d(size, n, dtype=dtype) for name, (n, dtype) in TYPES.items()}
    for unit, output in enumerate(layout.outputs):
        targets[output.name].bind_to_image(unit, read=False, write=True)
    program.run(*(-(-n // g) for n, g in zip(size, layout.group, strict=True)))
    context.memory_barrier()
    context.finish()
    for name, (n, dtype) in TYPES.items():
        got = np.frombuffer(targets[name].read(), dtype).reshape(size[::-1] + ((n,) if n > 1 else ()))
        # Interpolated by hand here and by the texture unit there: their positions differ by a rounding.
        np.testing.assert_allclose(got, drawn[name], rtol=1e-6, atol=1e-5, err_msg=name)
    for made in (program, volume, *targets.values()):
        made.release()
