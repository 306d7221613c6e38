"""A ray-caster in numpy, double precision, written apart from the kernels: a shared bug would hide from itself."""

from __future__ import annotations

import numpy as np
from scipy import ndimage


def sample(volume, points):
    """Trilinear interpolation of real values at index-space points (..., 3) as (x, y, z), clamped to the edge."""
    data = volume.real(np.float64)
    last = np.array(volume.dims) - 1
    p = np.clip(points, 0, last)[..., ::-1]
    return ndimage.map_coordinates(data, np.moveaxis(p, -1, 0), order=1, mode="nearest")


def slope(volume, points):
    """Gradient in the world, per mm, at index-space points (..., 3), from central differences over two voxels."""
    gradient = np.stack([sample(volume, points + a) - sample(volume, points - a) for a in np.eye(3)], -1) / 2
    return gradient @ volume.world_to_index[:3, :3]


def bounds(volume, camera, size):
    """Index-space origins and directions (h, w, 3), and entry and exit distances in mm (h, w), of all rays."""
    origins = np.empty((size[1], size[0], 3))
    directions = np.empty_like(origins)
    for y in range(size[1]):
        for x in range(size[0]):
            origins[y, x], directions[y, x] = camera.ray(size, x, y)
    linear = volume.world_to_index[:3, :3]
    o = origins @ linear.T + volume.world_to_index[:3, 3]
    d = directions @ linear.T
    with np.errstate(divide="ignore", invalid="ignore"):
        a = (-0.5 - o) / d
        b = (np.array(volume.dims) - 0.5 - o) / d
    entry = np.maximum(np.nanmax(np.minimum(a, b), axis=-1), 0.0)
    exit = np.nanmin(np.maximum(a, b), axis=-1)
    return o, d, directions, entry, exit


def composite(volume, transfer_function, camera, size, step, shade=None, depth_opacity=0.5, slopes=False):
    """Emission and absorption on the lattice of the eye; returns RGBA (h, w, 4) and depth (h, w). ``step`` in mm.

    With ``slopes`` the transfer function is evaluated at value and gradient magnitude.
    ``shade(points, directions, colors)`` may change the colours (n, 3) at index-space points (n, 3).
    """
    o, d, world, entry, exit = bounds(volume, camera, size)
    cosine = world @ camera.basis[2]
    rgba = np.zeros((size[1], size[0], 4))
    depth = np.full((size[1], size[0]), np.inf)
    hit = exit > entry
    if not hit.any():
        return rgba, depth
    first = int(np.floor(entry[hit].min() / step))
    last = int(np.ceil(exit[hit].max() / step))
    for k in range(first, last):
        start = np.maximum(k * step, entry)
        length = np.minimum((k + 1) * step, exit) - start
        on = hit & (length > 0)
        if not on.any():
            continue
        points = o[on] + d[on] * ((k + 0.5) * step)
        more = (np.linalg.norm(slope(volume, points), axis=-1),) if slopes else ()
        matter = transfer_function.evaluate(sample(volume, points), *more)
        color = matter[:, :3] if shade is None else shade(points, world[on], matter[:, :3])
        share = (1 - rgba[on][:, 3]) * -np.expm1(-matter[:, 3] * length[on])
        before = rgba[on][:, 3]
        after = before + share
        crossing = (before < depth_opacity) & (after >= depth_opacity)
        if crossing.any():
            reach = np.log((1 - before[crossing]) / (1 - depth_opacity)) / matter[crossing, 3]
            new = depth[on]
            new[crossing] = (start[on][crossing] + reach) * cosine[on][crossing]
            depth[on] = new
        rgba[on] = np.concatenate([rgba[on][:, :3] + share[:, None] * color, after[:, None]], axis=1)
    return rgba, depth


def maximum(volume, camera, size, step):
    """Greatest sample of each ray (h, w), -inf where the ray misses. ``step`` in mm."""
    o, d, _, entry, exit = bounds(volume, camera, size)
    best = np.full((size[1], size[0]), -np.inf)
    hit = exit > entry
    if not hit.any():
        return best
    for k in range(int(np.floor(entry[hit].min() / step)), int(np.ceil(exit[hit].max() / step))):
        on = hit & (k >= np.floor(entry / step)) & (k < np.ceil(exit / step))
        best[on] = np.maximum(best[on], sample(volume, o[on] + d[on] * ((k + 0.5) * step)))
    return best


def phong(volume, camera, light, ambient, diffuse, specular, shininess):
    """A shading function for `composite`, from central differences over two voxels."""
    lamp = light.in_eye_space(camera)
    rotation = camera.eye_to_world[:3, :3].T
    eye = np.asarray(camera.eye)

    def shade(points, directions, colors):
        normal = slope(volume, points) @ rotation.T
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        flat = length[:, 0] == 0
        normal = normal / np.where(length == 0, 1, length)
        view = directions @ rotation.T
        normal = np.where((normal * view).sum(-1, keepdims=True) > 0, -normal, normal)
        world = points @ volume.index_to_world[:3, :3].T + volume.index_to_world[:3, 3]
        place = (world - eye) @ rotation.T
        to_light = np.broadcast_to(lamp["position"], place.shape) if lamp["directional"] else lamp["position"] - place
        to_light = to_light / np.linalg.norm(to_light, axis=-1, keepdims=True)
        cosine = (normal * to_light).sum(-1, keepdims=True)
        mirrored = 2 * cosine * normal - to_light
        gloss = np.maximum(-(mirrored * view).sum(-1, keepdims=True), 0) ** shininess
        lit = colors * ambient + np.where(cosine > 0, lamp["color"] * (diffuse * cosine * colors + specular * gloss), 0)
        return np.where(flat[:, None], colors * (ambient + diffuse * lamp["color"]), lit)

    return shade
