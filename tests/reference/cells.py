"""Stage 1: build the graphs of faces, tetrahedra and points, and measure faces."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets import TetMesh
from superfacets.base.types import Floats, Ints, Longs
from superfacets.mesh.faces import FaceMesh, corners_of
from superfacets.mesh.meshes import Mesh, PolygonMesh

from .arithmetic import norm


class Arc(NamedTuple):
    """An arc from a cell (face or tetrahedron) to a neighbor, across a side of the cell."""

    face: int
    side: int
    neighbor: int
    same_turn: bool  # True if both faces traverse their common edge in the same direction


def build_face_graph(mesh: FaceMesh, *, weld: bool = True) -> list[Arc]:
    """Return all arcs between faces, sorted by face, side and neighbor."""
    corners = corners_of(mesh)
    ends = np.cumsum(np.broadcast_to(corners.sizes, mesh.n_faces))
    faces = np.split(corners.vertices, ends[:-1])
    sides_on_edge: Sides = defaultdict(dict)
    for face, ring in enumerate(_welded(mesh.vertices, faces, weld)):
        for side, (start, end) in enumerate(zip(ring, ring[1:] + ring[:1], strict=True)):
            if start != end:
                edge = (min(start, end), max(start, end))
                sides_on_edge[edge].setdefault(face, (side, start < end))
    return _arcs_over(sides_on_edge)


def build_tet_graph(mesh: TetMesh, *, weld: bool = True) -> list[Arc]:
    """Return all arcs between tetrahedra, sorted like arcs of faces. `same_turn` has no meaning."""
    tets_on_triangle: Sides = defaultdict(dict)
    for tet, lowest in enumerate(_welded(mesh.vertices, mesh.tets, weld)):
        for side in range(4):
            triangle = tuple(sorted(lowest[:side] + lowest[side + 1 :]))
            if len(set(triangle)) == 3:
                tets_on_triangle[triangle].setdefault(tet, (side, True))
    return _arcs_over(tets_on_triangle)


Sides = dict[tuple[int, ...], dict[int, tuple[int, bool]]]
"""Dict from the sorted vertices of each side to the cells with this side. The inner dict maps each
cell to (index of the side in the cell, whether the side runs from the lower to the higher vertex).
"""


def _welded(vertices: Floats, cells: Iterable[Ints], weld: bool) -> list[list[int]]:
    """Return the corners of each cell.

    If `weld` is true, a corner is replaced by the first vertex found at the same position.
    """
    first: dict[tuple[float, ...], int] = {}
    lists = [cell.tolist() for cell in cells]
    if not weld:
        return lists
    return [[first.setdefault(tuple(vertices[v].tolist()), v) for v in cell] for cell in lists]


MAX_PAIRED = 64
"""Maximum number of cells on a side of which all pairs are neighbors."""


def _arcs_over(sides: Sides) -> list[Arc]:
    """Return sorted arcs in both directions between neighbors among the cells with a common side.

    All pairs of cells are neighbors. Of more than `MAX_PAIRED` cells, pairs are neighbors whose
    numbers differ by a power of two. The last cell is followed by the first.
    """
    arcs = []
    for cells in map(list, (of_side.items() for of_side in sides.values())):
        n = len(cells)
        powers = [1 << power for power in range(n.bit_length()) if 2 << power < n]
        steps = {*powers, *(-step for step in powers)} if n > MAX_PAIRED else range(1, n)
        for number, (cell, (side, ascending)) in enumerate(cells):
            for neighbor, (_, neighbor_ascending) in (cells[(number + step) % n] for step in steps):
                arcs.append(Arc(cell, side, neighbor, ascending == neighbor_ascending))
    return sorted(arcs)


def measure_faces(mesh: Mesh) -> tuple[Floats, Floats]:
    """Return the centroids (F, 3) and the areas (F,) of all faces."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return (a + b + c) / 3.0, 0.5 * norm(np.cross(b - a, c - a))


def measure_polygons(mesh: PolygonMesh) -> tuple[Floats, Floats]:
    """Return the centroids (F, 3) and areas (F,) of simple polygons, whose areas must be > 0."""
    centroids, areas = np.empty((mesh.n_faces, 3)), np.empty(mesh.n_faces)
    for face in range(mesh.n_faces):
        origin, *others = mesh.vertices[mesh.face(face)]
        steps = [corner - origin for corner in others]
        doubled = [np.cross(u, v) for u, v in pairwise(steps)]
        total = np.sum(doubled, axis=0)
        weights = [vector @ total / (total @ total) for vector in doubled]
        thirds = [(u + v) / 3.0 for u, v in pairwise(steps)]
        centroids[face] = origin + sum(w * t for w, t in zip(weights, thirds, strict=True))
        areas[face] = 0.5 * np.linalg.norm(total)
    return centroids, areas


class PointArcs(NamedTuple):
    """Graph of points, with arcs in CSR form."""

    measures: Floats  # (N,) area around each point
    offsets: Longs  # (N + 1,) index of the first arc of each point, then the number of arcs
    neighbors: Ints  # (M,) target of each arc
    border_lengths: Floats  # (M,) length of the border that each arc crosses


def build_point_graph(points: npt.ArrayLike, n_neighbors: int, *, cutoff: float) -> PointArcs:
    """Return the same graph as `superfacets.build_point_graph`, without weights and normals."""
    positions = np.asarray(points, dtype=np.float64)
    first, together = _duplicates(positions)
    nearest = {i: _nearest(positions, first, i, n_neighbors) for i in first}
    areas = {i: _area(positions, i, near) for i, near in nearest.items()}
    kept = {
        i: [j for j in near if _squared(positions, i, j) <= cutoff**2 * min(areas[i], areas[j])]
        for i, near in nearest.items()
    }
    joined: list[set[int]] = [set() for _ in positions]
    pairs = [(i, j) for i, near in kept.items() for j in near]
    pairs += [(i, other) for i, others in together.items() for other in others if other != i]
    for i, j in pairs:
        joined[i].add(j)
        joined[j].add(i)
    measures = np.zeros(len(positions))
    for i, others in together.items():
        measures[others] = _area(positions, i, kept[i]) / len(others)
    rows = [sorted(row) for row in joined]
    offsets = np.cumsum([0, *map(len, rows)], dtype=np.int64)
    return PointArcs(
        measures,
        offsets,
        np.array([j for row in rows for j in row], dtype=np.int32),
        _borders(positions, measures, rows),
    )


def point_normals(points: npt.ArrayLike, n_neighbors: int) -> Floats:
    """Return, for each point, the direction in which it and its neighbors vary least, (N, 3).

    The direction is 0 if it is not unique. The signs of directions are arbitrary.
    """
    positions = np.asarray(points, dtype=np.float64)
    first, together = _duplicates(positions)
    normals = np.zeros_like(positions)
    for i in first:
        around = positions[[i, *_nearest(positions, first, i, n_neighbors)]]
        values, vectors = np.linalg.eigh(np.cov(around.T, bias=True))
        low, middle, high = values / max(values.sum(), 1e-300)
        if (middle - low) * (high - low) > 1e-6:
            normals[together[i]] = vectors[:, 0]
    return normals


def _duplicates(positions: Floats) -> tuple[list[int], dict[int, list[int]]]:
    """Return the lowest point at each position, and a dict from this point to all points there."""
    together: dict[tuple[float, ...], list[int]] = {}
    for i, position in enumerate((positions + 0.0).tolist()):
        together.setdefault(tuple(position), []).append(i)
    return [group[0] for group in together.values()], {g[0]: g for g in together.values()}


def _squared(positions: Floats, i: int, j: int) -> float:
    x, y, z = (positions[j] - positions[i]).tolist()
    return float(x * x + y * y + z * z)


def _nearest(positions: Floats, first: list[int], i: int, n: int) -> list[int]:
    others = [j for j in first if j != i]
    return sorted(others, key=lambda j: (_squared(positions, i, j), j))[:n]


def _area(positions: Floats, i: int, near: list[int]) -> float:
    """Return the area 2 pi mean(d^2) / (n + 1) around a point with n neighbors at distances d."""
    if not near:
        return 0.0
    squares = [_squared(positions, i, j) for j in near]
    return float(2 * np.pi * np.mean(squares) / (len(near) + 1))


def _borders(positions: Floats, measures: Floats, rows: list[list[int]]) -> Floats:
    """Return the border length of each arc: mean of pi * area / sum(arc lengths) at its ends."""
    sums = [sum(_squared(positions, i, j) ** 0.5 for j in row) for i, row in enumerate(rows)]
    per_arc = [np.pi * a / s if s > 0 else 0.0 for a, s in zip(measures, sums, strict=True)]
    return np.array([(per_arc[i] + per_arc[j]) / 2 for i, row in enumerate(rows) for j in row])
