"""Metrics that compare the borders of regions with the borders of true segments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.checks import checked_number
from ..base.types import Floats, Ints
from ..mesh.convert import MeshLike
from .edges import Borders, MeshEdges, find_borders
from .overlap import compact_complete, compact_labels

DEFAULT_TOLERANCE = 0.01
"""Default tolerance, as a fraction of the diagonal of the bounding box. This is about a third of
the radius of a region if a compact object has 150 regions."""


class BoundaryAgreement(NamedTuple):
    """Result of `boundary_agreement`: two fractions of the length of borders, where 1 is best."""

    recall: float
    """Fraction of true borders that are near borders of regions; 1 if there are no true borders."""
    precision: float
    """Fraction of borders of regions that are near true borders; 1 if regions have no borders."""


@dataclass(frozen=True, eq=False)
class Cuts:
    """Borders between labels, and the distance of each vertex from the nearest border.

    Distances are infinite where no path leads to a border. If several vertices are at one position,
    only the vertex in `MeshEdges.representative` has edges, so all others have infinite distances.
    """

    borders: Borders
    distances: Floats  # (V,) length of the shortest path along edges to a border

    @classmethod
    def of(cls, mesh: MeshEdges, labels: Ints) -> Cuts:
        """Find the borders between labels, and compute the distances of all vertices from them."""
        borders = find_borders(mesh, labels)
        return cls(borders, mesh.paths.distances(borders.vertices))


def boundary_agreement(
    mesh: MeshLike,
    labels: npt.ArrayLike,
    truth: npt.ArrayLike,
    *,
    tolerance: float = DEFAULT_TOLERANCE,
    weld: float = True,
) -> BoundaryAgreement:
    """Return the recall and the precision of the borders of regions, compared with true borders.

    An oversegmentation always has a low precision, because most of its borders are not true
    borders.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        Same as in `segment`.
    labels, truth : array_like of integers, shape (F,)
        Region (>= 0) and true segment (>= 0) of each face. In `truth`, -1 means that a face
        is unannotated. Unannotated faces are ignored.
    tolerance : float, default 0.01
        Maximum distance of matching borders, >= 0, as a fraction of the diagonal of the bounding
        box. Distances are lengths of shortest paths along edges, which are longer than geodesic
        distances. They are measured from both ends of each border edge, and each end stands for
        half of the edge.
    weld : bool, default True
        Whether vertices at exactly the same position are treated as one vertex.

    Returns
    -------
    BoundaryAgreement
        Recall and precision. The boundary of an open mesh is ignored. Time is O(F log F).

    Raises
    ------
    MeshError
        If the mesh is not a valid mesh of faces.
    ValueError, TypeError
        If labels or truth are not one valid integer per face, or if `tolerance` is negative.

    References
    ----------
    Martin, Fowlkes and Malik, "Learning to detect natural image boundaries", 2004; there, the
    metric is defined for images.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> boundary_agreement(square, [0, 1], [0, 0])
    BoundaryAgreement(recall=1.0, precision=0.0)
    """
    within = checked_number(tolerance, "tolerance", zero=True)
    edges = MeshEdges.of(mesh, weld=weld, n_threads=None)
    return boundary_agreement_of(edges, *_cuts_of_both(edges, labels, truth), within)


def cut_discrepancy(
    mesh: MeshLike, labels: npt.ArrayLike, truth: npt.ArrayLike, *, weld: float = True
) -> float:
    """Return the relative distance between borders of regions and true borders; 0 is best.

    The result is the mean distance from borders of regions to the nearest true border, plus the
    mean distance from true borders to the nearest border of a region. The sum is divided by the
    mean distance of the face centroids from the centroid of the mesh, weighted by area. If all face
    centroids are equal, it is divided by the diagonal of the bounding box instead.

    Parameters
    ----------
    mesh, labels, truth, weld
        Same as in `boundary_agreement`. Distances are measured in the same way.

    Returns
    -------
    float
        Discrepancy, >= 0. Where no path leads to a border, for example because the truth has no
        borders, the distance is the diagonal of the bounding box. If there are no borders of
        regions, the first mean distance is 0. If there are no true borders, the second is 0.

    Raises
    ------
    MeshError
        If the mesh is not a valid mesh of faces.
    ValueError, TypeError
        If labels or truth are not one valid integer per face, or if all faces have area 0.

    References
    ----------
    Chen, Golovinskiy and Funkhouser, "A Benchmark for 3D Mesh Segmentation", 2009.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> cut_discrepancy(square, [0, 1], [4, 7])
    0.0
    """
    edges = MeshEdges.of(mesh, weld=weld, n_threads=None)
    return cut_discrepancy_of(edges, *_cuts_of_both(edges, labels, truth))


def boundary_agreement_of(
    mesh: MeshEdges, found: Cuts, true: Cuts, tolerance: float
) -> BoundaryAgreement:
    """Return the result of `boundary_agreement`, given the borders of regions and true borders."""
    within = tolerance * mesh.graph.diagonal
    return BoundaryAgreement(
        _fraction_near(true.borders, found.distances, within),
        _fraction_near(found.borders, true.distances, within),
    )


def cut_discrepancy_of(mesh: MeshEdges, found: Cuts, true: Cuts) -> float:
    """Return the result of `cut_discrepancy`, given the borders of regions and true borders."""
    farthest = mesh.graph.diagonal
    there = _mean_distance(found.borders, true.distances, farthest)
    back = _mean_distance(true.borders, found.distances, farthest)
    return (there + back) / mesh.mean_radius


def _cuts_of_both(
    mesh: MeshEdges, labels: npt.ArrayLike, truth: npt.ArrayLike
) -> tuple[Cuts, Cuts]:
    regions, _ = compact_complete(labels, mesh.graph.n_cells)
    segments, _ = compact_labels(truth, mesh.graph.n_cells, name="truth")
    return Cuts.of(mesh, annotated(regions, segments)), Cuts.of(mesh, segments)


def annotated(regions: Ints, segments: Ints) -> Ints:
    """Return the regions with -1 for unannotated cells. Cells labeled -1 have no borders."""
    return np.where(segments < 0, segments, regions)


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
