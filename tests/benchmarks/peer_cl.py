"""A ray-caster written by hand in pyopencl, as one would without this framework."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from tests.benchmarks.scene import SIZE, STEP, Scene, table

KERNEL = """
float sample(global const short *v, float3 p, int3 n) {
    float3 low = floor(p), f = p - low;
    int3 last = n - 1;
    int3 a = clamp(convert_int3(low), (int3)(0), last), b = clamp(convert_int3(low) + 1, (int3)(0), last);
    global const short *y00 = v + n.x * (a.y + n.y * a.z), *y10 = v + n.x * (b.y + n.y * a.z);
    global const short *y01 = v + n.x * (a.y + n.y * b.z), *y11 = v + n.x * (b.y + n.y * b.z);
    float x00 = mix((float)y00[a.x], (float)y00[b.x], f.x), x10 = mix((float)y10[a.x], (float)y10[b.x], f.x);
    float x01 = mix((float)y01[a.x], (float)y01[b.x], f.x), x11 = mix((float)y11[a.x], (float)y11[b.x], f.x);
    return mix(mix(x00, x10, f.y), mix(x01, x11, f.y), f.z);
}
kernel void raycast(global const short *volume, int3 n, global const float4 *colors, int entries, float2 domain,
                    float3 eye, float3 right, float3 up, float3 forward, float2 half_size, float2 pixels, float step,
                    global float4 *color, global float *depth) {
    int i = get_global_id(0), j = get_global_id(1);
    float sx = ((i + 0.5f) / pixels.x * 2.0f - 1.0f) * half_size.x;
    float sy = (1.0f - (j + 0.5f) / pixels.y * 2.0f) * half_size.y;
    float stretch = rsqrt(1.0f + sx * sx + sy * sy);
    float3 direction = (forward + sx * right + sy * up) * stretch;
    float3 a = (-0.5f - eye) / direction, b = (convert_float3(n) - 0.5f - eye) / direction;
    float3 near = fmin(a, b), far = fmax(a, b);
    float t0 = fmax(fmax(near.x, near.y), fmax(near.z, 0.0f)), t1 = fmin(far.x, fmin(far.y, far.z));
    float4 sum = 0.0f;
    float seen = INFINITY;
    if (t0 < t1) {
        int first = (int)floor(t0 / step), last = (int)floor(t1 / step);
        for (int k = first; k <= last; k++) {
            float t = (k + 0.5f) * step;
            float span = fmin(t1, (k + 1) * step) - fmax(t0, k * step);
            float value = sample(volume, eye + t * direction, n);
            float at = clamp((value - domain.x) / (domain.y - domain.x), 0.0f, 1.0f) * (entries - 1);
            int entry = min((int)at, entries - 2);
            float4 optics = mix(colors[entry], colors[entry + 1], at - entry);
            if (optics.w > 0.0f) {
                float alpha = 1.0f - exp(-optics.w * span);
                sum += (1.0f - sum.w) * alpha * (float4)(optics.xyz, 1.0f);
                if (isinf(seen) && sum.w >= 0.5f) seen = t * stretch;
                if (sum.w > 254.0f / 255.0f) break;
            }
        }
    }
    color[i + j * get_global_size(0)] = sum;
    depth[i + j * get_global_size(0)] = seen;
}
"""


class PeerCL:
    """Volume as a buffer of int16 read in place, interpolated by hand, as samplers are slow on processors."""

    def __init__(self, scene: Scene, device: Any, options: list[str]) -> None:
        self.context = cl.Context([device])
        self.queue = cl.CommandQueue(self.context)
        flags = cl.mem_flags
        self.stored = np.ascontiguousarray(scene.volume.data)
        in_place = flags.READ_ONLY | flags.USE_HOST_PTR
        # Setting a kernel's argument does not keep a buffer alive; this list does.
        volume = cl.Buffer(self.context, in_place, hostbuf=self.stored)
        self.entries, low, high = table(scene.transfer_function)
        colors = cl.Buffer(self.context, in_place, hostbuf=self.entries)
        width, height = SIZE
        self.color = np.empty((height, width, 4), np.float32)
        self.depth = np.empty((height, width), np.float32)
        self.outputs = [cl.Buffer(self.context, flags.WRITE_ONLY, array.nbytes) for array in (self.color, self.depth)]
        self.inputs = [volume, colors]
        rays = scene.camera.rays(SIZE, scene.volume.world_to_index)

        def vector(name: str, kind: str) -> Any:
            return getattr(cl.cltypes, f"make_{kind}")(*np.asarray(rays[name], float).tolist())

        self.kernel = cl.Program(self.context, KERNEL).build(options=options).raycast
        self.kernel.set_args(
            volume,
            cl.cltypes.make_int3(*scene.volume.dims),
            colors,
            np.int32(len(self.entries)),
            cl.cltypes.make_float2(low, high),
            *(vector(name, "float3") for name in ("eye", "right", "up", "forward")),
            vector("half_size", "float2"),
            vector("pixels", "float2"),
            np.float32(STEP),
            *self.outputs,
        )

    def render(self) -> NDArray[np.float32]:
        """Run, wait, read both outputs; return the colour (h, w, 4)."""
        cl.enqueue_nd_range_kernel(self.queue, self.kernel, SIZE, None)
        for array, buffer in zip((self.color, self.depth), self.outputs, strict=True):
            cl.enqueue_copy(self.queue, array, buffer)
        self.queue.finish()
        return self.color

    def close(self) -> None:
        """Let go of the buffers."""
        for buffer in (*self.inputs, *self.outputs):
            buffer.release()
