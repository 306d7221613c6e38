"""Exact distances of points to the surface of a triangle mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.mesh import Mesh

Points = NDArray[np.float64]

CHUNK = 4096
"""Points that are looked at together, so that the list of candidate triangles stays small."""


def vertices_of_surface(mesh: Mesh) -> Points:
    """The vertices (n, 3) that belong to a triangle, mm; one that no triangle uses lies on no surface."""
    return mesh.vertices[np.unique(mesh.triangles)]


def distances_to_surface(points: Points, mesh: Mesh) -> Points:
    """Distance, mm, of each of ``points`` (n, 3) to the nearest point of the surface; inf where it has no triangle.

    Exact: a triangle lies within a ball about its centroid, so with an upper bound of the distance at hand only
    triangles whose balls come nearer need to be looked at. The balls are sorted by size, each size in a tree of its
    own, since one large triangle would else make the search about every small one wide.
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
    groups = [np.flatnonzero(sizes == size) for size in np.unique(sizes)[::-1]]
    trees = [cKDTree(centres[group]) for group in groups]

    for start in range(0, len(points), CHUNK):
        here = points[start : start + CHUNK]
        best = np.full(len(here), np.inf)
        for group, tree in zip(groups, trees, strict=True):  # the triangle whose centroid is nearest: an upper bound
            _, found = tree.query(here)
            best = np.minimum(best, point_triangle_distances(here, corners[group[found]]))
        for group, tree in zip(groups, trees, strict=True):
            reach = best * (1 + 1e-12) + radii[group].max()
            lists = tree.query_ball_point(here, reach, return_sorted=False)
            counts = np.fromiter(map(len, lists), int, len(lists))
            if not counts.any():
                continue
            whose = np.repeat(np.arange(len(here)), counts)
            which = group[np.concatenate([found for found in lists if found]).astype(int)]
            near = np.linalg.norm(here[whose] - centres[which], axis=1) - radii[which] <= best[whose]
            whose, which = whose[near], which[near]
            np.minimum.at(best, whose, point_triangle_distances(here[whose], corners[which]))
        nearest[start : start + CHUNK] = best
    return nearest


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
