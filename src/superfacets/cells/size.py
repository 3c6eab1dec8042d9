"""The expected number and radius of regions, computed once after stage 1."""

from __future__ import annotations

import math
from typing import NamedTuple

from .. import _core
from .._options import SizeOptions
from .._types import Floats
from .._validate import checked_count, checked_seeds

DEFAULT_N_SEGMENTS = 150
"""The paper's k, used if neither a number of regions nor a radius is given."""


class RegionSize(NamedTuple):
    """The expected number and radius of regions."""

    n_segments: int
    """k: as given, or the number of disks of the radius that have the area of all cells."""
    radius: float
    """r in the unit of the positions: as given, or `radius_of`."""


def region_size(
    options: SizeOptions, measures: Floats, diagonal: float, n_threads: int, dimension: int = 2
) -> RegionSize:
    """Return the size of the regions that cells with these measures are to be divided into.

    Measures are areas, of regions like disks, or volumes, of regions like balls.
    """
    total = _core.sum_of(measures, n_threads)
    return size_of_total(options, len(measures), total, diagonal, dimension)


def size_of_total(
    options: SizeOptions, n_cells: int, total: float, diagonal: float, dimension: int = 2
) -> RegionSize:
    """Return the same for so many cells with measures of this sum."""
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
    """The number of regions given, or the paper's, or the number of cells if that is less."""
    if n_segments is None:
        return min(DEFAULT_N_SEGMENTS, n_cells)
    return checked_count(n_segments, "n_segments", n_cells, noun)


def radius_of(measures: Floats, n_regions: int, n_threads: int, dimension: int = 2) -> float:
    """Return the radius of a disk with the mean area of k regions, sqrt(A / (pi k)).

    In a volume that of a ball, the cube root of 3 V / (4 pi k).
    """
    return _radius_of_total(_core.sum_of(measures, n_threads), n_regions, dimension)


def _radius_of_total(total: float, n_regions: int, dimension: int) -> float:
    if dimension == 3:
        return math.cbrt(3.0 * total / (4.0 * math.pi * n_regions))
    return math.sqrt(total / (math.pi * n_regions))
