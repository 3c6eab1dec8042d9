"""Stage 3 left out: the first centers are those of a segmentation, or of labels, made before."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from .._options import Init, Seeds, SizeOptions
from .._validate import checked_partial_labels, checked_seeds, refuse_mask
from .segmentation import Segmentation

__all__ = ["Start", "first_centers", "with_seeds"]

Start: TypeAlias = Seeds | Segmentation
"""Centers, one label per cell, or a segmentation."""


def first_centers(
    init: Init | Start,
    positions: npt.NDArray[np.float64],
    measures: npt.NDArray[np.float64],
    n_threads: int,
) -> Init | Seeds:
    """Return the name of a way to place seeds, or the cells that are to be the first centers.

    Those of a segmentation are its centers. Those of labels, one per cell, are the cells nearest to
    the centroids of their regions. Other arrays are centers already.
    """
    if isinstance(init, str):
        return init
    if isinstance(init, Segmentation):
        if len(init.labels) != len(positions):
            raise ValueError(
                f"init is a segmentation of {len(init.labels)} cells, not of {len(positions)}"
            )
        return init.centers
    refuse_mask(init, "init")
    given = np.asarray(init)
    if given.shape != (len(positions),) or _are_all_different(given):
        return checked_seeds(given, len(positions), "init")
    labels, n_regions = _checked_labels(given, len(positions))
    return _centers_of(labels, n_regions, positions, measures, n_threads)


def _are_all_different(given: npt.NDArray[Any]) -> bool:
    """Whether each of 0..N-1 occurs once: then each cell is a center."""
    return bool(np.array_equal(np.sort(given), np.arange(len(given))))


def with_seeds(size: SizeOptions, init: Init | Seeds) -> SizeOptions:
    """Return the size of regions with these seeds, unless init is a name."""
    seeds = None if isinstance(init, str) else init
    return SizeOptions(size.n_segments, size.radius, seeds)


def _checked_labels(given: npt.NDArray[Any], n_cells: int) -> tuple[npt.NDArray[np.int32], int]:
    try:
        return checked_partial_labels(given, n_cells)
    except ValueError as error:
        raise ValueError(f"init has a label per cell, but {error}") from None


def _centers_of(
    labels: npt.NDArray[np.int32],
    n_regions: int,
    positions: npt.NDArray[np.float64],
    measures: npt.NDArray[np.float64],
    n_threads: int,
) -> npt.NDArray[np.int32]:
    """The center of each region, whatever became of the cells with -1."""
    if n_regions == 0:
        raise ValueError("init has a label per cell, but all are -1")
    kept = np.flatnonzero(labels >= 0)
    placed = _core.PlacedCells(positions[kept], measures[kept], n_threads)
    no_arcs = (np.zeros(len(kept) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))
    cells = _core.OrderedGraph(placed, *no_arcs, n_threads)
    found = _core.update_centers(cells, labels[kept], n_regions, n_threads)
    return kept[found].astype(np.int32)
