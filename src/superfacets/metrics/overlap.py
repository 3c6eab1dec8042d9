"""Metrics that are computed from the overlaps of regions with true segments.

Overlaps are areas of faces, volumes of tetrahedra, or numbers of points or vertices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..base.checks import (
    checked_any_labels,
    checked_fraction,
    checked_nonnegative_array,
    checked_threads,
    ranked_labels,
    refuse_first,
)
from ..base.errors import MeshError
from ..base.types import Floats, Ints
from ..graph.cell_graph import CellGraph
from ..graph.kinds import as_known, kind_of
from ..graph.sums import positive_total, sums_by_label
from ..mesh.base import Cells
from ..mesh.convert import MeshLike

_DENSE_PAIRS_PER_FACE = 4
"""Overlaps are summed in a dense table of regions and segments if the table has at most this many
entries per face."""

_TIE = 1e-9
"""Relative difference below which two sums of areas are treated as equal. It is larger than the
rounding error of a sum of a million areas."""


@dataclass(frozen=True, eq=False)
class Overlap:
    """Area of the overlap of each region with each true segment, as a sparse table.

    Points and vertices are counted: each has the area 1.

    Attributes
    ----------
    regions, segments : ndarray of int32, shape (P,)
        Region and true segment of each of the P pairs that have common faces.
    areas : ndarray of float64, shape (P,)
        Area of the overlap of each pair.
    region_areas : ndarray of float64, shape (K,)
        Area of each region.
    segment_areas : ndarray of float64, shape (G,)
        Area of each true segment.
    """

    regions: Ints
    segments: Ints
    areas: Floats
    region_areas: Floats
    segment_areas: Floats

    @property
    def total(self) -> float:
        """Total area of all annotated faces."""
        return float(self.segment_areas.sum())


Labeled: TypeAlias = MeshLike | CellGraph | Overlap
Labels: TypeAlias = npt.ArrayLike | None


def compact_labels(
    labels: Any, n_cells: int, n_vertices: int | None = None, name: str = "labels"
) -> tuple[Ints, int]:
    """Return `ranked_labels` and K; raise a MeshError if a label is below -1, or all are -1."""
    if n_vertices not in (None, n_cells) and getattr(labels, "shape", ()) == (n_vertices,):
        raise MeshError(
            f"{name} must have one value per cell ({n_cells}), got one per vertex ({n_vertices}):"
            f" use evaluate_vertices, or face_labels(mesh, {name})"
        )
    array = checked_any_labels(labels, n_cells, n_vertices)
    refuse_first(array < -1, name, array, "at least -1", MeshError)
    ranks, names = ranked_labels(array)
    if not len(names):
        raise MeshError(f"{name} must be 0 or greater for at least one cell, but all are -1")
    return ranks, len(names)


def area_overlap(labels: npt.ArrayLike, truth: npt.ArrayLike, areas: npt.ArrayLike) -> Overlap:
    """Return the area of the overlap of each region with each true segment.

    Parameters
    ----------
    labels, truth : array_like of integers, shape (F,)
        Region (>= 0) and true segment (>= 0) of each face, or -1 for faces in no region and for
        unannotated faces, which are ignored.
    areas : array_like, shape (F,)
        Area of each face, finite and >= 0, for example ``build_face_graph(mesh).measures``. At
        least one area must be above 0.

    Returns
    -------
    Overlap
        Regions and segments are numbered from 0 in the order of their labels. Time is O(F), or
        O(F log F) if there are thousands of regions and thousands of segments.

    Raises
    ------
    ValueError, TypeError
        If the numbers of labels and areas differ, if labels or truth are not valid integers, if all
        faces are ignored, or if all other faces have area 0.

    Examples
    --------
    >>> overlap = area_overlap([0, 0, 1, 1], [5, 5, 5, 7], [1, 1, 1, 1])
    >>> overlap.regions, overlap.segments, overlap.areas
    (array([0, 1, 1], dtype=int32), array([0, 0, 1], dtype=int32), array([2., 1., 1.]))
    """
    values = checked_nonnegative_array(
        areas, np.asarray(areas).size, "areas", "face", checked_threads(None)
    )
    positive_total(values)
    regions, n_regions = compact_labels(labels, len(values))
    segments, n_segments = compact_labels(truth, len(values), name="truth")
    return overlap_of(regions, n_regions, segments, n_segments, values)


def overlap_of(
    regions: Ints, n_regions: int, segments: Ints, n_segments: int, areas: Floats
) -> Overlap:
    """Return the result of `area_overlap` for labels that are -1 or consecutive integers from 0."""
    is_rated = (segments >= 0) & (regions >= 0)
    if not is_rated.all():
        regions, segments, areas = regions[is_rated], segments[is_rated], areas[is_rated]
        positive_total(areas)
    pairs = regions.astype(np.int64) * n_segments + segments
    if n_regions * n_segments <= _DENSE_PAIRS_PER_FACE * len(areas):
        found = np.flatnonzero(np.bincount(pairs))
        shared = sums_by_label(pairs, areas, 0)[found]
    else:
        found, indices = np.unique(pairs, return_inverse=True)
        shared = sums_by_label(indices, areas, 0)
    return Overlap(
        (found // n_segments).astype(np.int32), (found % n_segments).astype(np.int32), shared,
        sums_by_label(regions, areas, n_regions), sums_by_label(segments, areas, n_segments),
    )  # fmt: skip


def undersegmentation_error(
    mesh: Labeled, labels: Labels = None, truth: Labels = None, *, tolerance: float = 0.05
) -> float:
    """Return the undersegmentation error, the fraction of area beyond true borders; 0 is best.

    A region and a true segment form a pair if the segment contains more than the fraction
    `tolerance` of the area of the region. The result is the sum, over all pairs, of the area of the
    region outside the segment, divided by the area of the surface. For example, if a true border
    cuts a region into two halves, there are two pairs, and both halves are added.

    Parameters
    ----------
    mesh : Mesh, mesh-like or CellGraph; or Overlap
        The labeled cells, or an `Overlap`, which replaces `labels` and `truth`.
    labels, truth : array_like of integers, shape (F,)
        Same as in `area_overlap`.
    tolerance : float, default 0.05
        Fraction of the area of a region, from 0 to 1, that an overlap must exceed. It is called tau
        in the paper. Overlaps that equal this fraction up to rounding errors are ignored.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, equation 4.

    Examples
    --------
    >>> undersegmentation_error(area_overlap([0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1]))
    0.5
    """
    overlap = _prepared(mesh, labels, truth)
    tolerance = checked_fraction(tolerance, "tolerance")
    whole = overlap.region_areas[overlap.regions]
    is_included = overlap.areas > (1.0 + _TIE) * tolerance * whole
    return float((whole - overlap.areas)[is_included].sum() / overlap.total)


def achievable_accuracy(mesh: Labeled, labels: Labels = None, truth: Labels = None) -> float:
    """Return the achievable segmentation accuracy (ASA): the best accuracy of labels per region.

    The accuracy is the fraction of the area with the correct label. The result is the accuracy if
    each region gets the label of the true segment with which it has the largest overlap. It is 1 if
    no region crosses a true border.

    Parameters
    ----------
    mesh, labels, truth
        Same as in `undersegmentation_error`.

    References
    ----------
    Liu, Tuzel, Ramalingam and Chellappa, "Entropy rate superpixel segmentation", 2011.

    Examples
    --------
    >>> achievable_accuracy(area_overlap([0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1]))
    0.75
    """
    overlap = _prepared(mesh, labels, truth)
    return _best_shared(overlap.regions, overlap.areas, len(overlap.region_areas)) / overlap.total


def achievable_iou(mesh: Labeled, labels: Labels = None, truth: Labels = None) -> float:
    """Return the mean intersection over union (IoU) of true segments, with one label per region.

    Each region gets the label of the true segment with which it has the largest overlap. The IoU of
    a segment is the area in it that gets its label, divided by the area that is in it or gets its
    label. The result is the mean over all segments with an area above 0; 1 is best. For
    superpoints, this is the oracle mIoU: the best that a classifier of superpoints can achieve.

    Parameters
    ----------
    mesh, labels, truth
        Same as in `undersegmentation_error`.

    Examples
    --------
    >>> achievable_iou(area_overlap([0, 0, 1, 1, 2], [0, 0, 0, 1, 1], [1, 1, 1, 2, 1]))
    0.7083333333333333
    """
    overlap = _prepared(mesh, labels, truth)
    by_region = np.lexsort((overlap.segments, -overlap.areas, overlap.regions))
    regions, first = np.unique(overlap.regions[by_region], return_index=True)
    pairs = by_region[first]  # largest overlap of each region; the lowest segment if two are equal
    winners, n_segments = overlap.segments[pairs], len(overlap.segment_areas)
    labeled = np.bincount(winners, overlap.region_areas[regions], n_segments)
    shared = np.bincount(winners, overlap.areas[pairs], n_segments)
    counts = overlap.segment_areas > 0
    unions = (labeled + overlap.segment_areas - shared)[counts]
    return min(1.0, float(np.mean(shared[counts] / unions)))  # rounding can exceed 1


def hamming_distance(overlap: Overlap) -> tuple[float, float, float]:
    """Return the Hamming distance, the missing rate and the false alarm rate; 0 is best.

    Chen, Golovinskiy and Funkhouser, "A Benchmark for 3D Mesh Segmentation", 2009. The missing rate
    is the total area of each segment outside the region that overlaps it most, as a fraction; the
    false alarm rate exchanges the roles. The distance is their mean.
    """
    best = _best_shared(overlap.segments, overlap.areas, len(overlap.segment_areas))
    missing = max(0.0, 1.0 - best / overlap.total)
    false_alarm = max(0.0, 1.0 - achievable_accuracy(overlap))
    return 0.5 * (missing + false_alarm), missing, false_alarm


def rand_index(overlap: Overlap) -> float:
    """Return the probability that labels and truth agree on a pair of points; 1 is best.

    Rand, "Objective criteria for the evaluation of clustering methods", 1971. Labels and truth
    agree if both are equal at the two points, or if both differ. Points are random, and may be in
    the same face. The Princeton benchmark plots one minus this number.
    """
    together = [
        float(np.square(areas / overlap.total).sum())
        for areas in (overlap.region_areas, overlap.segment_areas, overlap.areas)
    ]
    return min(1.0, 1.0 - together[0] - together[1] + 2.0 * together[2])


def consistency_error(overlap: Overlap) -> tuple[float, float]:
    """Return the global and the local consistency error of labels and truth; 0 is best.

    Martin, Fowlkes, Tal and Malik, "A database of human segmented natural images", 2001. Each point
    has two refinement errors: the fraction of its region outside its segment, and the reverse. The
    global error is the smaller of their means; the local error is the mean of the smaller error.
    """
    has_area = overlap.areas > 0
    areas = overlap.areas[has_area]
    of_region = 1.0 - areas / overlap.region_areas[overlap.regions[has_area]]
    of_segment = 1.0 - areas / overlap.segment_areas[overlap.segments[has_area]]
    errors = [float(areas @ error) / overlap.total for error in (of_region, of_segment)]
    local = float(areas @ np.minimum(of_region, of_segment)) / overlap.total
    return min(errors), local


def _prepared(source: Labeled, labels: Labels, truth: Labels) -> Overlap:
    """Return `source` if it is an Overlap; otherwise compute the overlap of labels and truth."""
    if isinstance(source, Overlap):
        if labels is not None or truth is not None:
            raise TypeError("an Overlap replaces labels and truth: pass the Overlap alone")
        return source
    if labels is None or truth is None:
        raise TypeError("labels and truth are required if a mesh or graph is given")
    cells = as_known(source)
    n_vertices = getattr(cells, "n_vertices", None)
    regions, n_regions = compact_labels(labels, cells.n_cells, n_vertices)
    segments, n_segments = compact_labels(truth, cells.n_cells, n_vertices, "truth")
    values = weights_of_cells(cells)
    positive_total(values)
    return overlap_of(regions, n_regions, segments, n_segments, values)


def weights_of_cells(cells: Cells | CellGraph) -> Floats:
    """Return the weight of each cell in an `Overlap`: its area or volume, but 1 for each point."""
    if kind_of(cells).are_points:
        return np.ones(cells.n_cells)
    return kind_of(cells).measures(cells, checked_threads(None))


def _best_shared(groups: Ints, areas: Floats, n_groups: int) -> float:
    """Return the sum over all groups (regions or segments) of the largest area in each group."""
    best = np.zeros(n_groups)
    np.maximum.at(best, groups, areas)
    return float(best.sum())
