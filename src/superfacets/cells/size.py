"""The expected number and radius of regions, and slivers: faces too long and thin for regions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .. import _core
from .._options import SizeOptions
from .._types import Floats
from .._validate import checked_count, checked_seeds, checked_threads
from ..mesh.faces import FaceMesh, measure_faces, measure_shapes, sliver_area
from .face_graph import FaceGraph

DEFAULT_N_SEGMENTS = 150
"""Default number of regions, from the paper, if neither a number nor a radius is given."""


class RegionSize(NamedTuple):
    """The expected number and radius of regions."""

    n_segments: int
    """k: as given, or the total area divided by the area of a disk of radius r."""
    radius: float
    """r in the unit of the positions: as given, or from `radius_of`."""


def region_size(
    options: SizeOptions, measures: Floats, diagonal: float, n_threads: int, dimension: int = 2
) -> RegionSize:
    """Return the expected number and radius of regions of cells with these measures.

    Regions are modeled as disks if measures are areas, and as balls if measures are volumes.
    """
    total = _core.sum_of(measures, n_threads)
    return size_of_total(options, len(measures), total, diagonal, dimension)


def size_of_total(
    options: SizeOptions, n_cells: int, total: float, diagonal: float, dimension: int = 2
) -> RegionSize:
    """Do the work of `region_size` with the number of cells and the sum of their measures."""
    if options.radius is not None:
        r = options.radius * diagonal
        k = _regions_of_radius(total, r, dimension)
        return RegionSize(max(1, round(min(k, n_cells))), r)
    if options.n_segments is None and options.seeds is not None:
        n_segments = len(checked_seeds(options.seeds, n_cells, "init"))
    else:
        noun = "faces" if dimension == 2 else "cells"
        n_segments = checked_n_segments(options.n_segments, n_cells, noun)
    return RegionSize(n_segments, _radius_of_total(total, n_segments, dimension))


def _regions_of_radius(total: float, r: float, dimension: int) -> float:
    if r <= 0:
        return math.inf
    return total / math.pi / r / r if dimension == 2 else 0.75 * total / math.pi / r / r / r


def checked_n_segments(n_segments: int | None, n_cells: int, noun: str = "faces") -> int:
    """Return the given number of regions, or the default number, at most the number of cells."""
    if n_segments is None:
        return min(DEFAULT_N_SEGMENTS, n_cells)
    return checked_count(n_segments, "n_segments", n_cells, noun)


def radius_of(measures: Floats, n_regions: int, n_threads: int, dimension: int = 2) -> float:
    """Return the radius of a disk with the mean area of k regions, sqrt(A / (pi k)).

    In a volume, return the radius of a ball, the cube root of 3 V / (4 pi k).
    """
    return _radius_of_total(_core.sum_of(measures, n_threads), n_regions, dimension)


def _radius_of_total(total: float, n_regions: int, dimension: int) -> float:
    if dimension == 3:
        return math.cbrt(3.0 * total / (4.0 * math.pi * n_regions))
    return math.sqrt(total / (math.pi * n_regions))


MIN_LENGTH = 2.0
"""Length above which a face is long, in r. The value is the diameter of a region."""

MAX_HEIGHT = 0.5
"""Height over the longest side up to which a face is thin, in r. Higher faces make regions coarse,
but not stripes. Slivers are at least four times as long as high."""

MAX_SHARE = 0.1
"""Fraction of the area in slivers above which `segment` warns.

The value was chosen on 189 cases: 95 models of the Princeton benchmark with 150 regions (14 of them
also with 50 and 500), and 12 CAD parts and 15 other meshes with 50 to 500 regions. In 31 cases,
subdivision at r / 4 lowers the compactness by a factor of 1.2 or more. The warning finds 26 of
these cases, including all CAD parts; the largest factor of a missed case is 1.4. The warning also
appears in seven of the other 158 cases, whose factors are 1.09 to 1.18."""

EDGE_PER_RADIUS = 0.25
"""Longest recommended edge, in r.

The median compactness of 11 CAD parts with 150 regions is 10.7, and after subdivision at r, r / 2
and r / 4 it is 8.1, 7.5 and 6.6. Each halving triples the number of faces: 1,000 become about
100,000 at r / 4."""


def sliver_share(
    mesh: FaceMesh, faces: FaceGraph, longest: Floats | None, radius: float, n_threads: int
) -> float:
    """Return the fraction of the area in faces longer than 2 r and thinner than r / 2, 0 to 1.

    The result is 0 if no face has an area. `longest` of `FaceShapes` serves to skip blocks without
    long sides.
    """
    total = _core.sum_of(faces.measures, n_threads)
    if total <= 0.0:
        return 0.0
    limits = (MIN_LENGTH * radius, MAX_HEIGHT * radius)
    area = sliver_area(mesh, faces.measures, longest, *limits, n_threads)
    return min(area / total, 1.0)


def area_of_slivers(mesh: FaceMesh, radius: float, n_threads: int) -> float:
    """Return the area of the faces that `sliver_share` counts."""
    _, areas, _, longest = measure_shapes(mesh, n_threads)
    limits = (MIN_LENGTH * radius, MAX_HEIGHT * radius)
    return sliver_area(mesh, areas, longest, *limits, n_threads)


def advised_max_edge(mesh: FaceMesh, n_segments: int | None, radius: float | None) -> float:
    """Return the longest recommended edge for regions of this number or radius."""
    threads = checked_threads(None)
    if radius is not None:
        low, high = mesh.bounds
        return EDGE_PER_RADIUS * radius * float(np.linalg.norm(high - low))
    _, areas = measure_faces(mesh, threads)
    return EDGE_PER_RADIUS * radius_of(areas, n_segments or DEFAULT_N_SEGMENTS, threads)


def sliver_note(share: float, advice: str) -> str | None:
    """Return one line about the effect of slivers on regions; None if there are few."""
    if share <= MAX_SHARE:
        return None
    return (
        f"{share:.0%} of the area is in faces that are long and thin compared with the regions, so"
        f" regions will be stripes: {advice}"
    )
