"""Stage 3 left out: the first centers are those of a segmentation, or of labels, made before."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from .. import _core
from .._options import Init, Seeds, SizeOptions
from .._types import Array, Floats, Ints
from .._validate import checked_partial_labels, checked_seeds, refuse_mask
from ..cells.constraints import in_order
from .segmentation import Segmentation

__all__ = ["Start", "first_centers", "with_seeds"]

Start: TypeAlias = Seeds | Segmentation
"""Centers, one label per cell, or a segmentation."""


def first_centers(
    init: Init | Start,
    positions: Floats,
    measures: Floats,
    kept: Ints | None,
    n_threads: int,
    order: Ints | None = None,
) -> Init | Seeds:
    """Return the name of a way to place seeds, or the cells that are to be the first centers.

    Those of a segmentation are its centers. Those of labels, one per cell, are the cells nearest to
    the centroids of what is left of their regions: all cells, or those that are kept. Other arrays
    are centers already. Where positions and measures are in another order than the labels and
    centers given, that holds the numbers which cells have in these; those returned are by place.
    """
    if isinstance(init, str):
        return init
    n_cells = len(positions)
    given = _centers_or_labels(init, n_cells)
    is_result = isinstance(init, Segmentation)
    if is_result or given.shape != (n_cells,) or _are_all_different(given):
        centers = checked_seeds(given, n_cells, "init")
        return centers if order is None else _places_of(centers, order)
    labels = in_order(_labels_of(given, n_cells), order)
    if kept is not None:
        named = np.full(len(labels), -1, np.int32)
        named[kept] = labels[kept]
        labels = named
    return _centers_of(labels, positions, measures, n_threads)


def _centers_or_labels(init: Seeds | Segmentation, n_cells: int) -> Array:
    if not isinstance(init, Segmentation):
        refuse_mask(init, "init")
        return np.asarray(init)
    if len(init.labels) != n_cells:
        raise ValueError(f"init is a segmentation of {len(init.labels)} cells, not of {n_cells}")
    return init.centers


def _places_of(cells: Ints, order: Ints) -> Ints:
    """The places in an order at which these cells stand."""
    places = np.empty_like(order)
    places[order] = np.arange(len(order), dtype=order.dtype)
    return places[cells]


def _are_all_different(given: Array) -> bool:
    """Whether each of 0..N-1 occurs once: then each cell is a center."""
    return bool(np.array_equal(np.sort(given), np.arange(len(given))))


def with_seeds(size: SizeOptions, init: Init | Seeds) -> SizeOptions:
    """Return the size of regions with these seeds, unless init is a name."""
    seeds = None if isinstance(init, str) else init
    return SizeOptions(size.n_segments, size.radius, seeds)


def _labels_of(given: Array, n_cells: int) -> Ints:
    try:
        return checked_partial_labels(given, n_cells)[0]
    except ValueError as error:
        raise ValueError(f"init has a label per cell, but {error}") from None


def _centers_of(labels: Ints, positions: Floats, measures: Floats, n_threads: int) -> Ints:
    """The center of each region, in the order of labels; cells with -1 are in none."""
    kept = np.flatnonzero(labels >= 0)
    if not len(kept):
        raise ValueError("init has a label per cell, but all are -1 where cells are kept")
    values, compact = np.unique(labels[kept], return_inverse=True)
    placed = _core.PlacedCells(positions[kept], measures[kept], n_threads)
    no_arcs = (np.zeros(len(kept) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))
    cells = _core.OrderedGraph(placed, *no_arcs, n_threads)
    found = _core.update_centers(cells, compact.astype(np.int32), len(values), n_threads)
    return kept[found].astype(np.int32)
