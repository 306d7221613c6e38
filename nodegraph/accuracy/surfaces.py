"""Exact distances of points to the surface of a triangle mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.mesh import Mesh

Points = NDArray[np.float64]

CHUNK = 4096
"""Points that are looked at together."""
PAIRS = 1 << 20
"""Pairs of a point and a triangle that are looked at together, so that memory stays small."""
GROWTH = 6
"""One triangle is tried at first about each point, then so many times as many in each turn."""


def vertices_of_surface(mesh: Mesh) -> Points:
    """The vertices (n, 3) that belong to a triangle, mm; one that no triangle uses lies on no surface."""
    return mesh.vertices[np.unique(mesh.triangles)]


def distances_to_surface(points: Points, mesh: Mesh) -> Points:
    """Distance, mm, of each of ``points`` (n, 3) to the nearest point of the surface; inf where it has no triangle.

    Exact: a triangle lies within a ball about its centroid, so triangles are tried in the order of their centroids'
    distances until no ball of the rest comes nearer than what was found. The balls are sorted by size, each size in a
    tree of its own, since one large triangle would else make the search about every small one long.
    """
    points = np.asarray(points, np.float64)
    nearest = np.full(len(points), np.inf)
    if not len(mesh.triangles) or not len(points):
        return nearest
    from scipy.spatial import cKDTree

    corners = mesh.vertices[mesh.triangles]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    # Rounding must not make a ball smaller than its triangle.
    radii = radii * (1 + 1e-12) + 1e-300
    sizes = np.floor(np.log2(radii)).astype(int)
    groups = [np.flatnonzero(sizes == size) for size in np.unique(sizes)]
    groups.sort(key=len, reverse=True)
    trees = [cKDTree(centres[group]) for group in groups]
    for start in range(0, len(points), CHUNK):
        here = points[start : start + CHUNK]
        best = nearest[start : start + CHUNK]
        for group, tree in zip(groups, trees, strict=True):
            _improve(best, here, corners[group], tree, float(radii[group].max()))
    return nearest


def _improve(best: Points, points: Points, corners: Points, tree: Any, radius: float) -> None:
    """Lower ``best`` in place to the distance of the nearest of these triangles, whose balls have at most ``radius``.

    Of each point its nearest centroids are tried, more of them in each turn, until the last one is so far away that
    no triangle beyond it can matter.
    """
    waiting = np.arange(len(points))
    tried, count = 0, 1
    while len(waiting):
        unsure = []
        # A point in the middle of a sphere is as far from all of it: few such points are looked at together.
        for part in np.array_split(waiting, -(-len(waiting) * count // PAIRS)):
            away, which = tree.query(points[part], k=np.arange(tried + 1, count + 1))
            # What is sure to be farther than what is known already needs no closer look.
            row, column = np.nonzero(away - radius <= best[part][:, None] * (1 + 1e-12))
            whose = part[row]
            np.minimum.at(best, whose, point_triangle_distances(points[whose], corners[which[row, column]]))
            unsure.append(part[away[:, -1] - radius <= best[part] * (1 + 1e-12)])
        if count == len(corners):
            return
        waiting = np.concatenate(unsure)
        tried, count = count, min(GROWTH * count, len(corners))


def point_triangle_distances(points: Points, corners: Points) -> Points:
    """Distance of point i (n, 3) to triangle i (n, 3, 3): to its plane where it projects inside, else to its edges.

    A triangle without area is its edges, one without length a point.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    edges = np.minimum.reduce([_segment(points, a, b), _segment(points, b, c), _segment(points, c, a)])
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    inside = length > 0.0
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= _dot(np.cross(end - start, points - start), normal) >= 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = np.abs(_dot(points - a, normal)) / length
    distances: Points = np.where(inside, np.minimum(plane, edges), edges)
    return distances


def _segment(points: Points, start: Points, end: Points) -> Points:
    along = end - start
    square = _dot(along, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(square > 0.0, _dot(points - start, along) / square, 0.0)
    found: Points = np.linalg.norm(points - (start + np.clip(t, 0.0, 1.0)[:, None] * along), axis=1)
    return found


def _dot(a: Points, b: Points) -> Points:
    product: Points = np.einsum("ij,ij->i", a, b)
    return product
