"""Stage 0: bisection of long edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._types import Floats
from ..mesh.triangle_mesh import Mesh


class _Edge(NamedTuple):
    """A side of a face, or an edge within it, and its two halves once bisected."""

    start: int
    end: int
    halves: tuple[_Edge, _Edge] | None  # None: short enough

    def reversed(self) -> _Edge:
        halves = self.halves and (self.halves[1].reversed(), self.halves[0].reversed())
        return _Edge(self.end, self.start, halves)


class Part(NamedTuple):
    """A part of a face after `depth` bisections."""

    corners: tuple[int, ...]
    depth: int


def subdivide(mesh: Mesh, max_edge: float) -> tuple[Floats, list[list[Part]]]:
    """All vertices, and the parts of each face."""
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
    """Bisect an edge, and its halves, until they are short enough; add midpoints to `points`."""
    if _squared_length(points, start, end) <= max_edge * max_edge:
        return _Edge(start, end, None)
    middle = len(points)
    points.append([(a + b) / 2 for a, b in zip(points[start], points[end], strict=True)])
    first = _bisected(points, start, middle, max_edge)
    return _Edge(start, end, (first, _bisected(points, middle, end, max_edge)))


def _cut(points: list[list[float]], sides: list[_Edge], max_edge: float, depth: int) -> list[Part]:
    """Cut a face from the middle of its longest side to the opposite corner, and both parts."""
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
