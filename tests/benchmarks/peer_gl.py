"""A ray-caster written by hand in moderngl, as one would without this framework."""

from __future__ import annotations

import moderngl
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.scene import SIZE, STEP, Scene, table

VERTEX = """
#version 330
void main() { gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0); }
"""

FRAGMENT = """
#version 330
uniform sampler3D volume;
uniform sampler2D colors;                 // one texel high: moderngl has no 1-D textures
uniform vec3 eye, right, up, forward;     // index space; distances stay in mm
uniform vec2 half_size, pixels;
uniform vec2 value_scale;                 // texel to HU
uniform vec2 domain;                      // first and last value of the table
uniform vec3 dims;
uniform float ray_step;
layout(location = 0) out vec4 color;
layout(location = 1) out float depth;

void main() {
    vec2 s = vec2(gl_FragCoord.x / pixels.x * 2.0 - 1.0, 1.0 - gl_FragCoord.y / pixels.y * 2.0) * half_size;
    float stretch = inversesqrt(1.0 + dot(s, s));
    vec3 direction = (forward + s.x * right + s.y * up) * stretch;
    vec3 a = (vec3(-0.5) - eye) / direction, b = (dims - 0.5 - eye) / direction;
    vec3 near = min(a, b), far = max(a, b);
    float t0 = max(max(near.x, near.y), max(near.z, 0.0)), t1 = min(far.x, min(far.y, far.z));
    vec4 sum = vec4(0.0);
    float seen = 1.0 / 0.0;
    if (t0 < t1) {
        int first = int(floor(t0 / ray_step)), last = int(floor(t1 / ray_step));
        float entries = float(textureSize(colors, 0).x);
        for (int k = first; k <= last; k++) {
            float t = (float(k) + 0.5) * ray_step;
            float span = min(t1, float(k + 1) * ray_step) - max(t0, float(k) * ray_step);
            float value = texture(volume, (eye + t * direction + 0.5) / dims).r * value_scale.x + value_scale.y;
            float at = clamp((value - domain.x) / (domain.y - domain.x), 0.0, 1.0);
            vec4 optics = texture(colors, vec2((at * (entries - 1.0) + 0.5) / entries, 0.5));
            if (optics.a > 0.0) {
                float alpha = 1.0 - exp(-optics.a * span);
                sum += (1.0 - sum.a) * alpha * vec4(optics.rgb, 1.0);
                if (isinf(seen) && sum.a >= 0.5) seen = t * stretch;
                if (sum.a > 254.0 / 255.0) break;
            }
        }
    }
    color = sum;
    depth = seen;
}
"""


class PeerGL:
    """Volume as R16 (int16 shifted), table as RGBA32F, colour and depth as 32-bit float targets."""

    def __init__(self, scene: Scene) -> None:
        self.context = context = moderngl.create_context(standalone=True, backend="egl", require=330)
        stored = (scene.volume.data.astype(np.int32) + 32768).astype(np.uint16)
        x, y, z = scene.volume.dims
        self.volume = context.texture3d((x, y, z), 1, stored, dtype="nu2", alignment=1)
        self.volume.filter = (moderngl.LINEAR, moderngl.LINEAR)  # a normalised integer texture is nearest by default
        self.volume.repeat_x = self.volume.repeat_y = self.volume.repeat_z = False
        entries, low, high = table(scene.transfer_function)
        self.table = context.texture((len(entries), 1), 4, entries, dtype="f4")
        self.table.repeat_x = self.table.repeat_y = False
        self.targets = [context.texture(SIZE, 4, dtype="f4"), context.texture(SIZE, 1, dtype="f4")]
        self.framebuffer = context.framebuffer(self.targets)
        self.program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self.vertices = context.vertex_array(self.program, [])
        rays = scene.camera.rays(SIZE, scene.volume.world_to_index)
        for name in ("eye", "right", "up", "forward", "half_size", "pixels"):
            self.program[name].value = tuple(np.atleast_1d(rays[name]).tolist())
        self.program["value_scale"].value = (65535.0, -32768.0)
        self.program["domain"].value = (low, high)
        self.program["dims"].value = (float(x), float(y), float(z))
        self.program["ray_step"].value = STEP
        self.program["volume"].value, self.program["colors"].value = 0, 1

    def render(self) -> NDArray[np.float32]:
        """Draw, wait, read both targets; return the colour (h, w, 4)."""
        self.framebuffer.use()
        self.volume.use(0)
        self.table.use(1)
        self.vertices.render(moderngl.TRIANGLES, vertices=3)
        self.context.finish()
        color, depth = (np.frombuffer(target.read(), np.float32) for target in self.targets)
        width, height = SIZE
        assert depth.size == width * height
        return color.reshape(height, width, 4)

    def close(self) -> None:
        self.context.release()
