"""Make a volume from a formula."""

from __future__ import annotations

import numpy as np

from nodegraph import Choice, Float, Int, Output, Processor, Seed, Vector
from nodegraph.data import Volume
from nodegraph.data.space import centred
from nodegraph.errors import ParameterError

MOST_VOXELS = 2**31
SLAB_VOXELS = 1 << 18
FREQUENCY = ("marschner_lobb", "shells", "checker", "noise")


class Synthetic(Processor):
    """Make a scalar volume of float32 in 0..1 whose values, gradients and surfaces are known exactly.

    The formulas are in p = (x, y, z), which runs from -1 to 1 over the extent, with r = |p| and f the frequency. Voxel
    i of n lies at p = (2 i + 1) / n - 1, so the physical size does not depend on the number of voxels: another
    resolution samples the same field. The middle of the volume is the origin of the world.

    - marschner_lobb: (1 - sin(pi z / 2) + a (1 + cos(2 pi f cos(pi sqrt(x x + y y) / 2)))) / (2 (1 + a)), with f = 6
      and a = 0.25 in the original test, of 40 voxels a side. Source: Marschner and Lobb 1994.
    - sphere: 1 - r, at least 0; the iso value v is a sphere of radius 1 - v.
    - gaussian_ball: exp(-r r / (2 w w)), w the width; smooth everywhere.
    - cube: 1 - max(|x|, |y|, |z|); iso values are cubes.
    - torus: 1 - d / 0.4, at least 0, where d is the distance to the circle of radius 0.6 in the plane z = 0.
    - shells: (1 + cos(2 pi f r)) / 2; concentric.
    - checker: 0 and 1 in f boxes along each axis.
    - linear: (1 + p . n / |n|) / 2, n the direction and |n| the sum of its absolute parts; its gradient is constant,
      and trilinear interpolation is exact.
    - noise: random values at f + 1 points along each axis, made from their integer coordinates and the seed, and
      between them interpolated with the weight 6 t^5 - 15 t^4 + 10 t^3.
    - constant: one value.
    """

    volume = Output(Volume, doc="Scalar field, float32, 0..1.")

    kind = Choice(
        "marschner_lobb",
        "sphere",
        "gaussian_ball",
        "cube",
        "torus",
        "shells",
        "checker",
        "linear",
        "noise",
        "constant",
        doc="The formula.",
    )
    voxels = Vector(
        (64, 64, 64), integer=True, min=1, max=65536, soft_max=512, unit="voxel", doc="How many along x, y and z."
    )
    extent = Vector(
        (100.0, 100.0, 100.0), min=1e-9, max=1e9, soft_min=1.0, soft_max=1000.0, unit="mm", doc="Size along x, y and z."
    )
    frequency = Int(
        6, min=1, max=1024, soft_max=32, visible_if={"kind": FREQUENCY}, doc="How fine the pattern is: f above."
    )
    amplitude = Float(
        0.25, min=0.0, max=1.0, visible_if={"kind": "marschner_lobb"}, doc="Share of the ripples: a above."
    )
    width = Float(
        0.35, min=0.01, max=10.0, soft_max=1.0, visible_if={"kind": "gaussian_ball"}, doc="Width of the ball: w above."
    )
    direction = Vector(
        (1.0, 0.0, 0.0), visible_if={"kind": "linear"}, doc="Where the values rise; its length has no effect."
    )
    seed = Seed(0, visible_if={"kind": "noise"}, doc="Which noise.")
    value = Float(0.5, visible_if={"kind": "constant"}, doc="The value everywhere.")

    def process(self, kind, voxels, extent, frequency, amplitude, width, direction, seed, value, *, progress):
        nx, ny, nz = voxels
        if nx * ny * nz > MOST_VOXELS:
            raise ParameterError(f"voxels: {nx}x{ny}x{nz} are more than {MOST_VOXELS}; ask for fewer")
        if kind == "linear" and not any(direction):
            raise ParameterError("direction: expected a direction other than 0 0 0")
        formulas = {
            "marschner_lobb": lambda x, y, z: marschner_lobb(x, y, z, frequency, amplitude),
            "sphere": lambda x, y, z: np.maximum(1.0 - np.sqrt(x * x + y * y + z * z), 0.0),
            "gaussian_ball": lambda x, y, z: np.exp(-(x * x + y * y + z * z) / (2.0 * width * width)),
            "cube": lambda x, y, z: 1.0 - np.maximum(np.maximum(abs(x), abs(y)), abs(z)),
            "torus": torus,
            "shells": lambda x, y, z: 0.5 + 0.5 * np.cos(2.0 * np.pi * frequency * np.sqrt(x * x + y * y + z * z)),
            "checker": lambda x, y, z: (_box(x, frequency) + _box(y, frequency) + _box(z, frequency)) % 2.0,
            "linear": lambda x, y, z: 0.5 + 0.5 * _dot(x, y, z, direction),
            "noise": lambda x, y, z: noise(x, y, z, frequency, seed),
            "constant": lambda x, y, z: np.float64(value),
        }
        try:
            data = np.empty((nz, ny, nx), np.float32)
        except MemoryError:
            raise ParameterError(f"voxels: {nx}x{ny}x{nz} do not fit into memory; ask for fewer") from None
        x, y, z = (_positions(n) for n in voxels)
        rows = max(1, SLAB_VOXELS // (nx * ny))
        for start in range(0, nz, rows):
            stop = min(nz, start + rows)
            data[start:stop] = formulas[kind](x[None, None, :], y[None, :, None], z[start:stop, None, None])
            progress(stop / nz)
        return Volume(data, centred(voxels, np.asarray(extent) / np.asarray(voxels)))


def _positions(count):
    """Where voxel centres lie in -1..1."""
    return (2.0 * np.arange(count) + 1.0) / count - 1.0


def marschner_lobb(x, y, z, frequency=6, amplitude=0.25):
    """The test signal of Marschner and Lobb, 0..1, nearly all of it below the Nyquist limit of 40 voxels a side."""
    ripples = np.cos(2.0 * np.pi * frequency * np.cos(np.pi * np.sqrt(x * x + y * y) / 2.0))
    return (1.0 - np.sin(np.pi * z / 2.0) + amplitude * (1.0 + ripples)) / (2.0 * (1.0 + amplitude))


def torus(x, y, z):
    """1 on the circle of radius 0.6 about the z axis, 0 from 0.4 away from it."""
    ring = np.sqrt(x * x + y * y) - 0.6
    return np.maximum(1.0 - np.sqrt(ring * ring + z * z) / 0.4, 0.0)


def noise(x, y, z, frequency, seed):
    """Values at lattice points, smoothly interpolated, 0..1."""
    cells, weights = [], []
    for p in (x, y, z):
        at = (p + 1.0) / 2.0 * frequency
        cell = np.clip(np.floor(at), 0, frequency - 1)
        t = at - cell
        cells.append(cell.astype(np.uint32))
        weights.append(t * t * t * (t * (t * 6.0 - 15.0) + 10.0))
    total = 0.0
    for corner in range(8):
        steps = [corner >> axis & 1 for axis in range(3)]
        weight = 1.0
        for axis in range(3):
            weight = weight * (weights[axis] if steps[axis] else 1.0 - weights[axis])
        i, j, k = (cells[axis] + np.uint32(steps[axis]) for axis in range(3))
        total = total + weight * lattice_value(i, j, k, seed)
    return total


def lattice_value(i, j, k, seed):
    """A number in 0..1 from unsigned 32-bit coordinates and a seed, the same on every machine.

    The mix is pcg3d: Jarzynski and Olano, Hash Functions for GPU Rendering, 2020.
    """
    a, b = np.uint32(1664525), np.uint32(1013904223)
    with np.errstate(over="ignore"):  # wrapping around is the point
        x, y, z = (np.asarray(v, np.uint32) * a + b for v in (i, j, k))
        x = x + np.uint32(seed) * np.uint32(2654435761)
        x = x + y * z
        y = y + z * x
        z = z + x * y
        x, y, z = x ^ (x >> np.uint32(16)), y ^ (y >> np.uint32(16)), z ^ (z >> np.uint32(16))
        return (x + y * z) / 4294967295.0


def _box(p, frequency):
    return np.minimum(np.floor((p + 1.0) / 2.0 * frequency), frequency - 1)


def _dot(x, y, z, direction):
    n = np.asarray(direction) / np.abs(direction).sum()
    return x * n[0] + y * n[1] + z * n[2]
