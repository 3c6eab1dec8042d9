"""The nearest point of a segment, a triangle, a tetrahedron; the nearest of many, one by one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Floats, Ints
from .vectors import cross, dot

FLAT = 1e-20
"""Squared sine of the angle at the first corner below which a triangle is as good as flat."""


def nearest_on_segment(p: Floats, a: Floats, b: Floats) -> Floats:
    """The point of the segment from a to b that is nearest to p."""
    along = b - a
    squared = dot(along, along)
    if squared == 0:
        return a
    t = dot(p - a, along) / squared
    if t <= 0 or t >= 1:
        return a if t <= 0 else b
    between: Floats = a + t * along
    return between.clip(np.minimum(a, b), np.maximum(a, b))


def nearest_on_triangle(p: Floats, corners: Floats) -> Floats:
    """The point of a triangle, corners (3, 3), that is nearest to p.

    Barycentric coordinates tell whether the nearest point of the plane is inside; if it is not, or
    the triangle is flat, the nearest point is on a side. Corners in sorted order: triangles that
    share a side find the same point on it.
    """
    a, b, c = np.array(sorted(corners.tolist()))
    ab, ac, ap = b - a, c - a, p - a
    normal = cross(ab, ac)
    squared = dot(normal, normal)
    if squared > FLAT * dot(ab, ab) * dot(ac, ac):
        of_b = dot(cross(ap, ac), normal) / squared
        of_c = dot(cross(ab, ap), normal) / squared
        if of_b >= 0 and of_c >= 0 and of_b + of_c <= 1:
            inside: Floats = a + of_b * ab + of_c * ac
            return inside.clip(corners.min(axis=0), corners.max(axis=0))
    return _nearest_of(p, [nearest_on_segment(p, *ends) for ends in combinations((a, b, c), 2)])


def nearest_in_tet(p: Floats, corners: Floats) -> Floats:
    """The point of a tetrahedron, corners (4, 3), that is nearest to p: p itself inside of it."""
    is_in_box = (corners.min(axis=0) <= p).all() and (p <= corners.max(axis=0)).all()
    whole = _volume(corners)
    if is_in_box and whole != 0:
        parts = []
        for corner in range(4):
            replaced = corners.copy()
            replaced[corner] = p
            parts.append(_volume(replaced) * math.copysign(1, whole))
        if min(parts) >= 0:
            return p
    sides = combinations(range(4), 3)
    return _nearest_of(p, [nearest_on_triangle(p, corners[list(side)]) for side in sides])


def nearest_faces(
    vertices: npt.ArrayLike, faces: npt.ArrayLike, points: npt.ArrayLike
) -> tuple[Ints, Floats, Floats]:
    """Return what `superfacets.nearest_faces` does for triangles, without a limit."""
    return _nearest_shapes(nearest_on_triangle, vertices, faces, points)


def nearest_tets(
    vertices: npt.ArrayLike, tets: npt.ArrayLike, points: npt.ArrayLike
) -> tuple[Ints, Floats, Floats]:
    """Return the same for tetrahedra."""
    return _nearest_shapes(nearest_in_tet, vertices, tets, points)


def _nearest_shapes(
    nearest_of: Callable[[Floats, Floats], Floats],
    vertices: npt.ArrayLike,
    cells: npt.ArrayLike,
    points: npt.ArrayLike,
) -> tuple[Ints, Floats, Floats]:
    """Compare all cells for each point; the first of equals wins."""
    corners = np.asarray(vertices, np.float64)[np.asarray(cells)]
    queries = np.asarray(points, np.float64)
    found = [_first_nearest(p, [nearest_of(p, cell) for cell in corners]) for p in queries]
    cell_of_point = np.array([place for place, _ in found], dtype=np.int32)
    nearest = np.array([point for _, point in found]).reshape(-1, 3)
    apart = queries - nearest
    return cell_of_point, np.sqrt(dot(apart, apart)), nearest


def _nearest_of(p: Floats, candidates: list[Floats]) -> Floats:
    return _first_nearest(p, candidates)[1]


def _first_nearest(p: Floats, candidates: Iterable[Floats]) -> tuple[int, Floats]:
    """Place and position of the candidate nearest to p, the first of equals."""

    def squared(item: tuple[int, Floats]) -> Any:
        return dot(p - item[1], p - item[1])

    return min(enumerate(candidates), key=squared)


def _volume(corners: Floats) -> Any:
    """Six times the signed volume of a tetrahedron."""
    a, b, c, d = corners
    return dot(cross(b - a, c - a), d - a)
