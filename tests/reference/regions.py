"""Stage 5: compute shapes and borders of regions, bridges between cells, and the merge tree."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets.base.types import Floats, Ints, Longs
from superfacets.graph.cell_graph import ArcMeasures
from superfacets.graph.kinds import kind_of
from superfacets.mesh.faces import AnyMesh, corners_of

from .arithmetic import norm


class RegionShape(NamedTuple):
    """Size, position and shape of a region, as in `RegionGraph`."""

    measure: float
    centroid: Floats
    covariance: Floats  # (3, 3) covariance matrix of positions in the region
    area_vector: Floats  # (3,) sum over faces of area times unit normal
    box: Floats  # (2, 3) minimum and maximum corner of the bounding box
    center: int  # cell nearest to the centroid of the region


class RegionArc(NamedTuple):
    """Length and angles of the border between two regions, as in `RegionGraph`."""

    low: int  # lower index of the two regions
    high: int  # higher index of the two regions
    border_length: float
    mean_angle: float
    concavity: float
    max_angle: float
    edge_count: int


class _Simplex(NamedTuple):
    """A triangle or tetrahedron. Triangles of concave polygons may have a negative area."""

    corners: Floats  # (3, 3) or (4, 3) position of each corner
    measure: float


def region_shapes(mesh: AnyMesh, labels: npt.ArrayLike) -> list[RegionShape]:
    """Return the shape of each region, computed from the triangles or tetrahedra of its cells."""
    cells = _simplices(mesh)
    regions = np.asarray(labels)
    return [
        _shape_of({int(cell): cells[cell] for cell in np.flatnonzero(regions == region)})
        for region in range(int(regions.max()) + 1)
    ]


def _simplices(mesh: AnyMesh) -> list[list[_Simplex]]:
    """Return the simplices of each cell. A polygon is cut into a fan around its first corner."""
    corners_of_cells = corners_of(mesh)
    ends = np.cumsum(np.broadcast_to(corners_of_cells.sizes, mesh.n_cells))
    table = np.split(mesh.vertices[corners_of_cells.vertices], ends[:-1])
    if kind_of(mesh).dimension == 3:
        return [[_Simplex(corners, _volume(corners))] for corners in table]
    cells = []
    for first, *others in table:
        fan = [np.array([first, second, third]) for second, third in pairwise(others)]
        total = np.sum([_area_vector(corners) for corners in fan], axis=0)
        normal = total / _length(total)
        cells.append([_Simplex(c, float(_area_vector(c) @ normal)) for c in fan])
    return cells


def _volume(corners: Floats) -> float:
    a, b, c, d = corners
    return abs(float(np.dot(np.cross(b - a, c - a), d - a))) / 6


def _area_vector(corners: Floats) -> Floats:
    a, b, c = corners
    return np.asarray(np.cross(b - a, c - a) / 2)


def _length(vector: Floats) -> float:
    return float(np.linalg.norm(vector))


def _shape_of(cells: dict[int, list[_Simplex]]) -> RegionShape:
    simplices = [simplex for parts in cells.values() for simplex in parts]
    measure = sum(simplex.measure for simplex in simplices)
    centroid = _mean(simplices)
    moment = np.zeros((3, 3))
    for simplex in simplices:
        # The added term is the integral of p p^T over a simplex with n corners, where p is the
        # position relative to the centroid.
        steps = simplex.corners - centroid
        n, total = len(steps), steps.sum(axis=0)
        moment += simplex.measure / (n * (n + 1)) * (steps.T @ steps + np.outer(total, total))
    is_flat = len(simplices[0].corners) == 3
    vectors = [_area_vector(simplex.corners) for simplex in simplices] if is_flat else [np.zeros(3)]
    corners = np.concatenate([simplex.corners for simplex in simplices])
    box = np.array([corners.min(axis=0), corners.max(axis=0)])
    distances = {cell: _length(_mean(parts) - centroid) for cell, parts in cells.items()}
    center = min(distances, key=lambda cell: (distances[cell], cell))
    return RegionShape(
        measure, centroid, moment / measure, np.sum(vectors, axis=0), box, center
    )  # fmt: skip


def _mean(simplices: list[_Simplex]) -> Floats:
    total = sum(simplex.measure for simplex in simplices)
    moments = [simplex.measure * simplex.corners.mean(axis=0) for simplex in simplices]
    return np.asarray(np.sum(moments, axis=0) / total)


def region_arcs(
    offsets: Longs, neighbors: Ints, measures: ArcMeasures, labels: npt.ArrayLike
) -> list[RegionArc]:
    """Return all borders between regions, sorted by the two regions.

    An arc and its reverse arc are counted once. Cells with the label -1 are ignored.
    """
    regions = np.asarray(labels).tolist()
    targets = neighbors.tolist()
    arcs_of = [range(a, b) for a, b in pairwise(offsets.tolist())]
    sides = list(range(len(targets))) if measures.sides is None else measures.sides.tolist()
    crossed: dict[tuple[int, int], list[tuple[float, int]]] = defaultdict(list)
    for cell, arcs in enumerate(arcs_of):
        for arc in arcs:
            own, other = regions[cell], regions[targets[arc]]
            leads_back = cell in [targets[back] for back in arcs_of[targets[arc]]]
            if -1 in (own, other) or own == other or (own > other and leads_back):
                continue
            on_side = [own] + [regions[targets[a]] for a in arcs if sides[a] == sides[arc]]
            fraction = 1 / (on_side.count(own) * on_side.count(other))
            crossed[min(own, other), max(own, other)].append((fraction, arc))
    angles = np.zeros(len(targets)) if measures.angles is None else measures.angles
    return [
        _border_of(pair, arcs, measures.border_lengths, angles)
        for pair, arcs in sorted(crossed.items())
    ]


def _border_of(
    pair: tuple[int, int], arcs: list[tuple[float, int]], lengths: Floats, angles: Floats
) -> RegionArc:
    """Return the border between two regions. `arcs` are pairs (fraction of an edge, arc index)."""
    length = math.fsum(fraction * lengths[arc] for fraction, arc in arcs)
    edges = math.fsum(fraction for fraction, _ in arcs)
    weights = {arc: fraction * lengths[arc] / length for fraction, arc in arcs} if length else {
        arc: fraction / edges for fraction, arc in arcs
    }  # fmt: skip
    return RegionArc(
        *pair,
        length,
        math.fsum(weight * abs(angles[arc]) for arc, weight in weights.items()),
        math.fsum(weight * angles[arc] for arc, weight in weights.items()),
        max((float(angles[arc]) for arc in weights), key=lambda angle: (abs(angle), angle)),
        round(edges),
    )


def find_bridges(positions: Floats, ranks: list[int]) -> list[tuple[int, int]]:
    """Return, for each rank > 0, the nearest cells (a, b): a has this rank and b a lower rank."""
    found = []
    for rank in range(1, max(ranks) + 1):
        pairs = [
            (float(np.sum((positions[b] - positions[a]) ** 2)), a, b)
            for a in range(len(ranks))
            for b in range(len(ranks))
            if ranks[a] == rank and ranks[b] < rank
        ]
        _, a, b = min(pairs)
        found.append((a, b))
    return found


def merge_tree(
    areas: list[float],
    positions: list[Floats],
    features: list[Floats] | None,
    borders: dict[tuple[int, int], tuple[float, float]],
    *,
    crease_weight: float,
    dimension: int,
) -> tuple[list[tuple[int, int]], list[float]]:
    """Repeatedly merge the pair of lowest cost; return all merged pairs of nodes, and costs.

    `borders` maps pairs of regions, the lower first, to (length, open length). Edges in creases add
    less to the open length. If `features` are given, costs depend on areas and features. Then the
    cost without features only decides between pairs of equal cost.
    """
    areas, positions, borders = list(areas), list(positions), dict(borders)
    features = None if features is None else list(features)

    def cost_of(a: int, b: int) -> float:
        factor = _ward_factor(areas[a], areas[b])
        if not factor > 0:
            return 0.0
        length, cost = borders[a, b]
        radius = _radius_of(areas[a] + areas[b], dimension)
        openness = cost / length if length > 0 else 0.0
        if not length > 0:  # the regions are separated by a gap
            length = radius if dimension == 2 else radius * radius
        distance = float(norm(positions[a] - positions[b]))
        return factor * (distance + crease_weight * radius * (1.0 - openness)) / length

    def key_of(pair: tuple[int, int]) -> tuple[float, float]:
        if features is None:
            return cost_of(*pair), 0.0
        squared = 0.0
        for step in features[pair[0]] - features[pair[1]]:
            squared += float(step) * float(step)
        return _ward_factor(*(areas[node] for node in pair)) * squared, cost_of(*pair)

    children, costs = [], []
    while borders:
        key, (a, b) = min((key_of(pair), pair) for pair in borders)
        children.append((a, b))
        costs.append(key[0])
        area = areas[a] + areas[b]
        fraction = areas[b] / area if area > 0 else 0.5
        for values in (positions, features):
            if values is not None:
                values.append(values[a] + fraction * (values[b] - values[a]))
        borders = _merged(borders, (a, b), len(areas))
        areas.append(area)
    return children, costs


def _ward_factor(a: float, b: float) -> float:
    """Return a b / (a + b) for two areas a and b, or 0 if both areas are 0."""
    area = a + b
    return a / area * b if area > 0 else 0.0


def _radius_of(measure: float, dimension: int) -> float:
    """Return the radius of the disk (dimension 2) or ball (3) with this area or volume."""
    if dimension == 2:
        return math.sqrt(measure / math.pi)
    return math.cbrt(0.75 * measure / math.pi)


def _merged(
    borders: dict[tuple[int, int], tuple[float, float]], pair: tuple[int, int], node: int
) -> dict[tuple[int, int], tuple[float, float]]:
    """Return the borders after merging the two nodes `pair` into the new node `node`."""
    merged: dict[tuple[int, int], tuple[float, float]] = {}
    for (one, other), border in borders.items():
        if (one, other) != pair:
            low, high = sorted(node if end in pair else end for end in (one, other))
            before = merged.get((low, high), (0.0, 0.0))
            merged[low, high] = (before[0] + border[0], before[1] + border[1])
    return merged
