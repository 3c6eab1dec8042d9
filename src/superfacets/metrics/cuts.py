"""Metrics that compare the borders of regions with the borders of true segments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import Floats, Ints
from .edges import Borders, MeshEdges, find_borders

DEFAULT_TOLERANCE = 0.01
"""Default tolerance, as a fraction of the diagonal of the bounding box. This is about a third of
the radius of a region if a compact object has 150 regions."""


@dataclass(frozen=True, eq=False)
class Cuts:
    """Borders between labels, and the distance of each vertex from the nearest border.

    Distances are infinite where no path leads to a border, and except at
    `MeshEdges.representative`.
    """

    borders: Borders
    distances: Floats  # (V,) length of the shortest path along edges to a border

    @classmethod
    def of(cls, mesh: MeshEdges, labels: Ints) -> Cuts:
        """Find the borders between labels, and compute the distances of all vertices from them."""
        borders = find_borders(mesh, labels)
        return cls(borders, mesh.paths.distances(borders.vertices))


def boundary_agreement(
    mesh: MeshEdges, found: Cuts, true: Cuts, tolerance: float
) -> tuple[float, float]:
    """Return the recall and the precision of the borders of regions; 1 is best.

    Martin, Fowlkes and Malik, "Learning to detect natural image boundaries", 2004. The recall is
    the fraction of true borders within `tolerance`, a fraction of the diagonal, of borders of
    regions, or 1 if there are none; the precision exchanges the roles. Distances are measured along
    edges, so they exceed geodesic distances, and from both ends of each border edge.
    """
    within = tolerance * mesh.graph.diagonal
    recall = _fraction_near(true.borders, found.distances, within)
    return recall, _fraction_near(found.borders, true.distances, within)


def cut_discrepancy(mesh: MeshEdges, found: Cuts, true: Cuts) -> float:
    """Return the relative distance between borders of regions and true borders; 0 is best.

    Chen, Golovinskiy and Funkhouser, "A Benchmark for 3D Mesh Segmentation", 2009: the mean
    distance from borders of regions to true borders, plus the reverse, as a multiple of
    `MeshEdges.mean_radius`. Where no path leads to a border, the distance is the diagonal of the
    bounding box. If there are no borders to measure from, a mean distance is 0.
    """
    farthest = mesh.graph.diagonal
    there = _mean_distance(found.borders, true.distances, farthest)
    back = _mean_distance(true.borders, found.distances, farthest)
    return (there + back) / mesh.mean_radius


def _fraction_near(borders: Borders, distances: Floats, within: float) -> float:
    total = float(borders.lengths.sum())
    if not total > 0:
        return 1.0
    return float(borders.lengths[distances[borders.vertices] <= within].sum()) / total


def _mean_distance(borders: Borders, distances: Floats, farthest: float) -> float:
    total = float(borders.lengths.sum())
    if not total > 0:
        return 0.0
    reached = distances[borders.vertices]
    return float(borders.lengths @ np.where(np.isinf(reached), farthest, reached)) / total
