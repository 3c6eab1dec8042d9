"""The graph of a point cloud, one point at a time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .._types import Floats, Ints, Longs


class PointArcs(NamedTuple):
    """Points as cells, with arcs in CSR form."""

    measures: Floats
    offsets: Longs
    neighbors: Ints
    border_lengths: Floats


def build_point_graph(points: npt.ArrayLike, n_neighbors: int, *, cutoff: float) -> PointArcs:
    """Return what `superfacets.build_point_graph` does, but for weights and normals."""
    positions = np.asarray(points, dtype=np.float64)
    first, together = _places(positions)
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
    """Return the direction in which the nearest neighbors of each point vary least, of any sign."""
    positions = np.asarray(points, dtype=np.float64)
    first, together = _places(positions)
    normals = np.zeros_like(positions)
    for i in first:
        around = positions[[i, *_nearest(positions, first, i, n_neighbors)]]
        values, vectors = np.linalg.eigh(np.cov(around.T, bias=True))
        low, middle, high = values / max(values.sum(), 1e-300)
        if (middle - low) * (high - low) > 1e-6:
            normals[together[i]] = vectors[:, 0]
    return normals


def _places(positions: Floats) -> tuple[list[int], dict[int, list[int]]]:
    """The lowest point at each position, and all points there."""
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
    """2 pi mean(d^2) / (n + 1)."""
    if not near:
        return 0.0
    squares = [_squared(positions, i, j) for j in near]
    return float(2 * np.pi * np.mean(squares) / (len(near) + 1))


def _borders(positions: Floats, measures: Floats, rows: list[list[int]]) -> Floats:
    """Pi a / (sum of the lengths of arcs), the mean of both ends."""
    sums = [sum(_squared(positions, i, j) ** 0.5 for j in row) for i, row in enumerate(rows)]
    per_arc = [np.pi * a / s if s > 0 else 0.0 for a, s in zip(measures, sums, strict=True)]
    return np.array([(per_arc[i] + per_arc[j]) / 2 for i, row in enumerate(rows) for j in row])
