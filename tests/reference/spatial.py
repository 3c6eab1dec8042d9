"""Find nearest cells, measure thickness along rays, and subdivide meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets.base.types import Floats, Ints
from superfacets.mesh.meshes import Mesh

from .arithmetic import dot

FLAT = 1e-20
"""A triangle has no normal if the squared sine of the angle at its first corner is at most FLAT."""


def nearest_on_segment(p: Floats, a: Floats, b: Floats) -> Floats:
    """Return the point of the segment from a to b that is nearest to p."""
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
    """Return the point of a triangle with corners (3, 3) that is nearest to p.

    If the projection of p onto the plane of the triangle is inside the triangle, it is returned.
    Otherwise, or if the triangle has no normal, the nearest point is on a side. Corners are sorted
    first, so that two triangles with a common side give the same point on this side.
    """
    a, b, c = np.array(sorted(corners.tolist()))
    ab, ac, ap = b - a, c - a, p - a
    normal = np.cross(ab, ac)
    squared = dot(normal, normal)
    if squared > FLAT * dot(ab, ab) * dot(ac, ac):
        of_b = dot(np.cross(ap, ac), normal) / squared
        of_c = dot(np.cross(ab, ap), normal) / squared
        if of_b >= 0 and of_c >= 0 and of_b + of_c <= 1:
            inside: Floats = a + of_b * ab + of_c * ac
            return inside.clip(corners.min(axis=0), corners.max(axis=0))
    return _nearest_of(p, [nearest_on_segment(p, *ends) for ends in combinations((a, b, c), 2)])


def nearest_in_tet(p: Floats, corners: Floats) -> Floats:
    """Return the point of a tetrahedron with corners (4, 3) that is nearest to p.

    If p is inside the tetrahedron, p is returned.
    """
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


def _nearest_shapes(
    nearest_of: Callable[[Floats, Floats], Floats],
    vertices: npt.ArrayLike,
    cells: npt.ArrayLike,
    points: npt.ArrayLike,
) -> tuple[Ints, Floats, Floats]:
    """Return the cell nearest to each point, its distance, and the nearest position in the cell.

    If several cells are equally near, the first cell is used.
    """
    corners = np.asarray(vertices, np.float64)[np.asarray(cells)]
    queries = np.asarray(points, np.float64)
    found = [_first_nearest(p, [nearest_of(p, cell) for cell in corners]) for p in queries]
    cell_of_point = np.array([cell for cell, _ in found], dtype=np.int32)
    nearest = np.array([point for _, point in found]).reshape(-1, 3)
    apart = queries - nearest
    return cell_of_point, np.sqrt(dot(apart, apart)), nearest


nearest_faces = partial(_nearest_shapes, nearest_on_triangle)
nearest_tets = partial(_nearest_shapes, nearest_in_tet)


def _nearest_of(p: Floats, candidates: list[Floats]) -> Floats:
    return _first_nearest(p, candidates)[1]


def _first_nearest(p: Floats, candidates: Iterable[Floats]) -> tuple[int, Floats]:
    """Return the index and the position of the candidate nearest to p, or the first of several."""

    def squared(item: tuple[int, Floats]) -> Any:
        return dot(p - item[1], p - item[1])

    return min(enumerate(candidates), key=squared)


def _volume(corners: Floats) -> Any:
    """Return six times the signed volume of a tetrahedron with corners (4, 3)."""
    a, b, c, d = corners
    return dot(np.cross(b - a, c - a), d - a)


COS_GOLDEN, SIN_GOLDEN = -0.7373688780783197, 0.6754902942615237
"""Cosine and sine of the golden angle, the rotation about the axis from each ray to the next."""


def cone_of_rays(n_rays: int) -> tuple[Floats, Floats]:
    """Return R ray directions (R, 3) at most 60 degrees from the z axis, and their weights (R,)."""
    directions, weights = [], []
    x, y = 1.0, 0.0
    for ray in range(n_rays):
        height = 1.0 - 0.5 * (ray + 0.5) / n_rays
        radius = math.sqrt(1.0 - height * height)
        directions.append([radius * x, radius * y, height])
        weights.append(1.0 / (math.atan2(radius, height) + 0.2))
        x, y = x * COS_GOLDEN - y * SIN_GOLDEN, x * SIN_GOLDEN + y * COS_GOLDEN
    return np.array(directions), np.array(weights)


def typical_length(lengths: Sequence[float], weights: Sequence[float]) -> float:
    """Return the weighted mean of all lengths within one standard deviation of their median."""
    given = np.array(lengths)
    median = float(np.median(given))
    is_kept = np.abs(given - median) <= given.std() + 1e-9 * median
    return float(np.average(given[is_kept], weights=np.array(weights)[is_kept]))


def ray_thickness(
    vertices: Floats,
    triangles: Ints,
    starts: Floats,
    axes: Floats,
    n_rays: int,
    least_distance: float = 0.0,
) -> Floats:
    """Return the thickness of a body at points `starts` of its surface.

    Rays are in a cone about each axis in `axes`, a unit vector that points inward. The thickness is
    the typical length of rays up to where they leave the body. It is NaN if less than a quarter of
    the rays leave the body. Hits at a distance of at most `least_distance` are ignored.
    """
    corners = vertices[triangles]
    spokes = list(zip(*cone_of_rays(n_rays), strict=True))
    result = np.full(len(starts), np.nan)
    for i, (start, axis) in enumerate(zip(starts, axes, strict=True)):
        right, up = frame_about(axis)
        hits = [
            (first_exit(corners, start, d[0] * right + d[1] * up + d[2] * axis, least_distance), w)
            for d, w in spokes
        ]
        kept = [(length, weight) for length, weight in hits if length is not None]
        if len(kept) >= n_rays / 4:
            result[i] = typical_length(*zip(*kept, strict=True))
    return result


def frame_about(axis: Floats) -> tuple[Floats, Floats]:
    """Return two unit vectors that form a right-handed frame with `axis` (Duff et al., 2017)."""
    x, y, z = axis.tolist()
    sign = -1.0 if z < 0 else 1.0
    a = -1.0 / (sign + z)
    b = x * y * a
    return (
        np.array([1.0 + sign * x * x * a, sign * b, -sign * x]),
        np.array([b, sign + y * y * a, -y]),
    )


def first_exit(corners: Floats, start: Floats, ray: Floats, least: float) -> float | None:
    """Return the distance at which a ray leaves a body with the triangles `corners`, (F, 3, 3).

    Returns None if the ray hits no triangle, or if the first hit is on the front of a triangle.
    Hits at a distance of at most `least` are ignored.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = normals @ ray
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = np.einsum("ij,ij->i", normals, corners[:, 0] - start) / along
        is_hit = (along != 0) & (distances > least)
    at = start + np.where(is_hit, distances, 0.0)[:, None] * ray
    for side in range(3):
        edge = corners[:, (side + 1) % 3] - corners[:, side]
        inside = np.einsum("ij,ij->i", np.cross(edge, at - corners[:, side]), normals)
        is_hit &= inside >= -1e-12 * np.einsum("ij,ij->i", normals, normals)
    distances = np.where(is_hit, distances, np.inf)
    first = int(np.argmin(distances))
    is_exit = np.isfinite(distances[first]) and along[first] > 0
    return float(distances[first]) if is_exit else None


class _Edge(NamedTuple):
    """An edge between two vertices, and its two halves if it was bisected."""

    start: int
    end: int
    halves: tuple[_Edge, _Edge] | None  # None if not bisected

    def reversed(self) -> _Edge:
        halves = self.halves and (self.halves[1].reversed(), self.halves[0].reversed())
        return _Edge(self.end, self.start, halves)


class Part(NamedTuple):
    """One of the triangles into which a face was cut, and the number of cuts that made it."""

    corners: tuple[int, ...]
    depth: int


def subdivide(mesh: Mesh, max_edge: float) -> tuple[Floats, list[list[Part]]]:
    """Cut faces until edges are at most `max_edge`; return all vertices, and the parts per face."""
    points = mesh.vertices.tolist()
    faces = mesh.faces.tolist()
    sides = {(min(e), max(e)) for a, b, c in faces for e in ((a, b), (b, c), (c, a))}
    edges = {ends: _bisected(points, *ends, max_edge) for ends in sorted(sides)}
    edges |= {(high, low): edge.reversed() for (low, high), edge in edges.items() if low != high}
    parts = [
        _cut(points, [edges[a, b], edges[b, c], edges[c, a]], max_edge, 0) for a, b, c in faces
    ]
    return np.array(points), parts


def _bisected(points: list[list[float]], start: int, end: int, max_edge: float) -> _Edge:
    """Bisect an edge recursively until halves are at most `max_edge`; add midpoints to `points`."""
    if _squared_length(points, start, end) <= max_edge * max_edge:
        return _Edge(start, end, None)
    middle = len(points)
    points.append([(a + b) / 2 for a, b in zip(points[start], points[end], strict=True)])
    first = _bisected(points, start, middle, max_edge)
    return _Edge(start, end, (first, _bisected(points, middle, end, max_edge)))


def _cut(points: list[list[float]], sides: list[_Edge], max_edge: float, depth: int) -> list[Part]:
    """Cut a face recursively, from the midpoint of its longest side to the opposite corner.

    Cutting ends when the longest side is not bisected.
    """
    lengths = [_squared_length(points, edge.start, edge.end) for edge in sides]
    side = lengths.index(max(lengths))
    halves = sides[side].halves
    if halves is None:
        return [Part(tuple(edge.start for edge in sides), depth)]
    second, third = (side + 1) % 3, (side + 2) % 3
    inner = _bisected(points, halves[0].end, sides[third].start, max_edge)
    one, other = list(sides), list(sides)
    one[side], one[second] = halves[0], inner
    other[side], other[third] = halves[1], inner.reversed()
    parts = _cut(points, one, max_edge, depth + 1)
    return parts + _cut(points, other, max_edge, depth + 1)


def _squared_length(points: list[list[float]], start: int, end: int) -> float:
    x, y, z = (b - a for a, b in zip(points[start], points[end], strict=True))
    return float(x * x + y * y + z * z)
