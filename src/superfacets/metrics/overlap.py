"""Metrics of the area that regions share with true segments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .._types import Floats, Ints
from .._validate import checked_nonnegative_array, checked_share, checked_threads, compact_complete
from ..adapters.convert import MeshLike
from ..cells.cell_graph import CellGraph
from ..cells.kinds import as_known, measures_of
from ..cells.sums import positive_total, sums_by_label

_DENSE_PAIRS_PER_FACE = 4
"""Largest size of a dense table of label pairs, in entries per face. Above it, pairs are sorted."""

_TIE = 1e-9
"""Upper bound of the relative error of a sum of a million areas."""


@dataclass(frozen=True, eq=False)
class Overlap:
    """Area shared by each region and each segment of the ground truth: a sparse table.

    Attributes
    ----------
    regions, segments : ndarray of int32, shape (P,)
        The pairs of a region and a segment that have a face in common.
    areas : ndarray of float64, shape (P,)
        Area that each pair has in common.
    region_areas : ndarray of float64, shape (K,)
        Area of each region.
    segment_areas : ndarray of float64, shape (G,)
        Area of each segment of the ground truth.
    """

    regions: Ints
    segments: Ints
    areas: Floats
    region_areas: Floats
    segment_areas: Floats

    @property
    def total(self) -> float:
        """Area of the surface."""
        return float(self.segment_areas.sum())


Labeled: TypeAlias = MeshLike | CellGraph | Overlap
Labels: TypeAlias = npt.ArrayLike | None


def area_overlap(labels: npt.ArrayLike, truth: npt.ArrayLike, areas: npt.ArrayLike) -> Overlap:
    """Return the area shared by each region and each segment of the ground truth.

    Parameters
    ----------
    labels, truth : array_like of integers, shape (F,)
        Region and true segment of each face, 0 and up.
    areas : array_like, shape (F,)
        Area of each face, finite, >= 0 and not all 0; ``build_face_graph(mesh).measures``.

    Returns
    -------
    Overlap
        Regions and segments are numbered in the order of their labels. Time is O(F), or O(F log F)
        if both have thousands of labels.

    Raises
    ------
    ValueError, TypeError
        If there are not as many labels as areas, labels are not integers, or there is no area.

    Examples
    --------
    >>> overlap = area_overlap([0, 0, 1, 1], [5, 5, 5, 7], [1, 1, 1, 1])
    >>> overlap.regions, overlap.segments, overlap.areas
    (array([0, 1, 1], dtype=int32), array([0, 0, 1], dtype=int32), array([2., 1., 1.]))
    """
    values = checked_nonnegative_array(
        areas, np.size(areas), "areas", "face", checked_threads(None)
    )
    positive_total(values)
    regions, n_regions = compact_complete(labels, len(values))
    segments, n_segments = compact_complete(truth, len(values), "truth")
    return overlap_of(regions, n_regions, segments, n_segments, values)


def overlap_of(
    regions: Ints, n_regions: int, segments: Ints, n_segments: int, areas: Floats
) -> Overlap:
    """Return `area_overlap` for labels without gaps."""
    pairs = regions.astype(np.int64) * n_segments + segments
    if n_regions * n_segments <= _DENSE_PAIRS_PER_FACE * len(areas):
        found = np.flatnonzero(np.bincount(pairs))
        shared = sums_by_label(pairs, areas, 0)[found]
    else:
        found, places = np.unique(pairs, return_inverse=True)
        shared = sums_by_label(places, areas, 0)
    return Overlap(
        (found // n_segments).astype(np.int32),
        (found % n_segments).astype(np.int32),
        shared,
        sums_by_label(regions, areas, n_regions),
        sums_by_label(segments, areas, n_segments),
    )


def undersegmentation_error(
    mesh: Labeled, labels: Labels = None, truth: Labels = None, *, tolerance: float = 0.05
) -> float:
    """Return the area by which regions leak out of the segments that they overlap; 0 is best.

    Each segment adds the area outside of it of all regions that overlap it by more than `tolerance`
    of their own area. The sum over all segments is divided by the area of the surface. A region
    that a true border cuts into equal halves counts with all of its area.

    Parameters
    ----------
    mesh : Mesh, mesh-like or CellGraph; or Overlap
        The labeled cells; or an `Overlap`, then without `labels` and `truth`.
    labels, truth : array_like of integers, shape (F,)
        Region and true segment of each face, 0 and up.
    tolerance : float, default 0.05
        Share of a region's area that an overlap has to exceed to count, 0 to 1; tau in the paper.
        An overlap of exactly this share does not count. It has to exceed the share by a billionth
        of the share, because rounding depends on the unit of length.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, eq. 4.

    Examples
    --------
    >>> undersegmentation_error(area_overlap([0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1]))
    0.5
    """
    overlap = _prepared(mesh, labels, truth)
    tolerance = checked_share(tolerance, "tolerance")
    whole = overlap.region_areas[overlap.regions]
    counts = overlap.areas > (1.0 + _TIE) * tolerance * whole
    return float((whole - overlap.areas)[counts].sum() / overlap.total)


def achievable_accuracy(mesh: Labeled, labels: Labels = None, truth: Labels = None) -> float:
    """Return the share of the area that is right if each region gets its best true label.

    1 is best: no region crosses a true border. Known as achievable segmentation accuracy (ASA).

    Parameters
    ----------
    mesh : Mesh, mesh-like or CellGraph; or Overlap
        The labeled cells; or an `Overlap`, then without `labels` and `truth`.
    labels, truth : array_like of integers, shape (F,)
        Region and true segment of each face, 0 and up.

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


class Hamming(NamedTuple):
    """Hamming distance and its two directions, each a share of the area, 0 is best."""

    distance: float
    """Mean of the two rates."""
    missing_rate: float
    """Area of true segments outside the regions that overlap each of them most, as a share."""
    false_alarm_rate: float
    """Area of regions outside the true segments that overlap each of them most, as a share."""


def hamming_distance(mesh: Labeled, labels: Labels = None, truth: Labels = None) -> Hamming:
    """Return the Hamming distance of the Princeton benchmark, with both directions.

    An oversegmentation has a high missing rate by design. Its false alarm rate is the share of the
    area by which regions leak over true borders.

    Parameters
    ----------
    mesh : Mesh, mesh-like or CellGraph; or Overlap
        The labeled cells; or an `Overlap`, then without `labels` and `truth`.
    labels, truth : array_like of integers, shape (F,)
        Region and true segment of each face, 0 and up.

    References
    ----------
    Chen, Golovinskiy and Funkhouser, "A Benchmark for 3D Mesh Segmentation", 2009.

    Examples
    --------
    >>> hamming_distance(area_overlap([0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1]))
    Hamming(distance=0.25, missing_rate=0.25, false_alarm_rate=0.25)
    """
    overlap = _prepared(mesh, labels, truth)
    best = _best_shared(overlap.segments, overlap.areas, len(overlap.segment_areas))
    missing = max(0.0, 1.0 - best / overlap.total)
    false_alarm = max(0.0, 1.0 - achievable_accuracy(overlap))
    return Hamming(0.5 * (missing + false_alarm), missing, false_alarm)


def rand_index(mesh: Labeled, labels: Labels = None, truth: Labels = None) -> float:
    """Return the probability that labels and truth agree on a pair of points; 1 is best.

    They agree if both put the two points together, or both apart. Points are drawn by area, so a
    pair may fall into one face. (The Princeton benchmark plots one minus this number.)

    Parameters
    ----------
    mesh : Mesh, mesh-like or CellGraph; or Overlap
        The labeled cells; or an `Overlap`, then without `labels` and `truth`.
    labels, truth : array_like of integers, shape (F,)
        Region and true segment of each face, 0 and up.

    References
    ----------
    Rand, "Objective criteria for the evaluation of clustering methods", 1971; as used by Chen,
    Golovinskiy and Funkhouser, 2009.

    Examples
    --------
    >>> rand_index(area_overlap([0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1]))
    0.625
    """
    overlap = _prepared(mesh, labels, truth)
    together = [
        float(np.square(areas / overlap.total).sum())
        for areas in (overlap.region_areas, overlap.segment_areas, overlap.areas)
    ]
    return min(1.0, 1.0 - together[0] - together[1] + 2.0 * together[2])


class Consistency(NamedTuple):
    """Consistency errors; 0 is best: one of the two refines the other."""

    global_error: float
    """Error if the same one has to refine the other everywhere."""
    local_error: float
    """Error if either one may refine the other at each point."""


def consistency_error(mesh: Labeled, labels: Labels = None, truth: Labels = None) -> Consistency:
    """Return the global and the local consistency error: how far neither refines the other.

    Each point has two refinement errors: the share of its region that is outside of its segment,
    and the share of its segment that is outside of its region. The global error is the smaller one
    of their means over the surface. The local error is the mean of the smaller one at each point.
    An oversegmentation without leaks has 0 in both.

    Parameters
    ----------
    mesh : Mesh, mesh-like or CellGraph; or Overlap
        The labeled cells; or an `Overlap`, then without `labels` and `truth`.
    labels, truth : array_like of integers, shape (F,)
        Region and true segment of each face, 0 and up.

    References
    ----------
    Martin, Fowlkes, Tal and Malik, "A database of human segmented natural images", 2001; as used
    by Chen, Golovinskiy and Funkhouser, 2009.

    Examples
    --------
    >>> error = consistency_error(area_overlap([0, 0, 1, 1], [0, 0, 0, 1], [1, 1, 1, 1]))
    >>> round(error.global_error, 6), round(error.local_error, 6)
    (0.25, 0.125)
    """
    overlap = _prepared(mesh, labels, truth)
    has_area = overlap.areas > 0
    areas = overlap.areas[has_area]
    of_region = 1.0 - areas / overlap.region_areas[overlap.regions[has_area]]
    of_segment = 1.0 - areas / overlap.segment_areas[overlap.segments[has_area]]
    errors = [float(areas @ error) / overlap.total for error in (of_region, of_segment)]
    local = float(areas @ np.minimum(of_region, of_segment)) / overlap.total
    return Consistency(min(errors), local)


def _prepared(source: Labeled, labels: Labels, truth: Labels) -> Overlap:
    """Return the given overlap, or make one of the labels of a mesh."""
    if isinstance(source, Overlap):
        if labels is not None or truth is not None:
            raise TypeError("an Overlap already holds labels and truth: pass nothing else")
        return source
    if labels is None or truth is None:
        raise TypeError("pass labels and truth together with a mesh")
    cells = as_known(source)
    n_vertices = getattr(cells, "n_vertices", None)
    regions, n_regions = compact_complete(labels, cells.n_cells, n_vertices=n_vertices)
    segments, n_segments = compact_complete(truth, cells.n_cells, "truth", n_vertices)
    values = measures_of(cells, checked_threads(None))
    positive_total(values)
    return overlap_of(regions, n_regions, segments, n_segments, values)


def _best_shared(groups: Ints, areas: Floats, n_groups: int) -> float:
    """Sum over groups of the largest area shared with a single member of the other side."""
    best = np.zeros(n_groups)
    np.maximum.at(best, groups, areas)
    return float(best.sum())
