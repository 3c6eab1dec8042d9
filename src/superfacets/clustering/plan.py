"""Define `Plan`: the cells to segment, the expected size of regions, and the initial centers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from .. import _core
from .._core import CoarseGraph
from ..base.checks import checked_partial_labels, checked_seeds, counted, refuse_mask
from ..base.options import AnyInit, CountOptions, LoopOptions, Seeds
from ..base.types import Array, Floats, Ints, Longs, Singles
from ..graph.cell_graph import BaseGraph
from ..graph.constraints import NO_GROUPS, KeptCells, in_order
from ..graph.size import RegionSize, region_size
from ..mesh.faces import inverse_of
from .result import Segmentation

Start: TypeAlias = Seeds | Segmentation
"""Initial state of the loop: the initial centers, the label of each cell, or an earlier result."""


class ArcLengths(NamedTuple):
    """Arcs in CSR form, and their lengths."""

    offsets: Longs  # (N + 1,)
    neighbors: Ints  # (M,)
    lengths: Singles  # (M,)


@dataclass(frozen=True)
class Plan:
    """The cells to segment, the expected size of regions, and the initial centers."""

    inside: KeptCells | None  # cells that mask and barriers keep; None if neither is given
    size: RegionSize
    count_options: CountOptions  # as given; but `seeds` are indices of cells inside the mask
    init: AnyInit | Seeds | None
    """Name of the seeding method, initial centers (the same as `count_options.seeds`), or None for
    the default method."""
    is_sorted: bool = False  # whether the cells of the graph are sorted along a curve

    @classmethod
    def of(
        cls, graph: BaseGraph, inside: KeptCells | None,
        start: tuple[CountOptions, AnyInit | Start | None], loop: LoopOptions,
        *, dimension: int, plural: str = "cells", order: Ints | None = None,
    ) -> Plan:  # fmt: skip
        """Make the plan for a graph from the size options and the initial centers.

        `init` uses the indices of cells before sorting, which `order` contains if they were sorted.
        """
        (count_options, given), n_threads = start, loop.n_threads
        kept, kept_measures = None, graph.measures
        if inside is not None:
            kept, kept_measures = inside.cells, kept_measures[inside.cells]
        init = _first_centers(given, graph.positions, graph.measures, kept, n_threads, order)
        seeds = None if init is None or isinstance(init, str) else init
        if inside is not None and seeds is not None:
            init = seeds = inside.new_cells(seeds, order)
        count_options = replace(count_options, seeds=seeds)
        size = region_size(count_options, kept_measures, n_threads, dimension, plural)
        plan = cls(inside, size, count_options, init, order is not None)
        if count_options.radius and size.total and plan.is_divided:  # divide each area
            shares = np.bincount(plan.components([]), kept_measures) * (
                size.n_segments / size.total
            )
            shares = np.maximum(shares.round(), loop.islands == "keep")
            plan = replace(plan, size=size._replace(n_segments=max(1, int(shares.sum()))))
        return plan

    @property
    def has_seeds(self) -> bool:
        """Whether the caller gave initial centers, labels, or an earlier result."""
        return self.init is not None and not isinstance(self.init, str)

    @property
    def groups(self) -> Ints:
        """Group of each cell in the mask (see `KeptCells.groups`); empty without barriers."""
        return NO_GROUPS if self.inside is None else self.inside.groups

    @property
    def is_divided(self) -> bool:
        """Whether barriers divide the cells inside the mask."""
        return bool((self.groups[1:] != self.groups[:-1]).any())

    def components(self, coarse: list[CoarseGraph]) -> Ints:
        """Return the component of each cell inside the mask, or of the last graph in `coarse`."""
        assert self.inside is not None
        one_label = np.zeros(len(self.inside.cells), np.int32)
        arcs = (self.inside.offsets, self.inside.neighbors)
        components, _ = _core.find_components(*arcs, one_label)
        for level in coarse:
            components = components[level.centers()]
        return components

    def placed_cells(
        self, graph: BaseGraph, lengths: Singles, n_threads: int
    ) -> tuple[_core.PlacedCells, ArcLengths]:
        """Return the cells inside the mask, sorted along a curve, and their arcs with `lengths`."""
        inside = self.inside
        if inside is None:
            placed = _core.PlacedCells(graph.positions, graph.measures, n_threads, self.is_sorted)
            return placed, ArcLengths(graph.offsets, graph.neighbors, lengths)
        cells = (graph.positions[inside.cells], graph.measures[inside.cells])
        arcs = ArcLengths(inside.offsets, inside.neighbors, lengths[inside.arcs])
        return _core.PlacedCells(*cells, n_threads, self.is_sorted), arcs

    def whole(self, result: Segmentation) -> Segmentation:
        """Extend a result for cells inside the mask to all cells; cells outside are labeled -1."""
        if self.inside is None:
            return result
        labels, centers = self.inside.whole_labels(result.labels), self.inside.cells[result.centers]
        return replace(result, labels=labels, centers=centers)


def _first_centers(
    init: AnyInit | Start | None, positions: Floats, measures: Floats, kept: Ints | None,
    n_threads: int, order: Ints | None,
) -> AnyInit | Seeds | None:  # fmt: skip
    """Return the initial centers as indices into `positions`, or `init` if it is a method or None.

    An array with one number per cell is read as labels, unless it contains each cell once. The
    center of a labeled region is the cell nearest to its centroid.
    """
    if init is None or isinstance(init, str):
        return init
    n_cells = len(positions)
    given = _centers_or_labels(init, n_cells)
    is_result = isinstance(init, Segmentation)
    if (
        is_result
        or given.shape != (n_cells,)
        or np.array_equal(np.sort(given), np.arange(n_cells))  # each cell is a center
    ):
        centers = checked_seeds(given, n_cells, "init")
        return centers if order is None else inverse_of(order)[centers]
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
        raise ValueError(
            f"init must be a segmentation of {counted(n_cells, 'cell')}, got one of"
            f" {counted(len(init.labels), 'cell')}"
        )
    return init.centers


def _labels_of(given: Array, n_cells: int) -> Ints:
    try:
        return checked_partial_labels(given, n_cells)[0]
    except ValueError as error:
        raise ValueError(f"init must be seeds, or valid labels of all cells: {error}") from None


def _centers_of(labels: Ints, positions: Floats, measures: Floats, n_threads: int) -> Ints:
    """Return the cell nearest to the centroid of each region, (K,); raise ValueError if K is 0."""
    kept = np.flatnonzero(labels >= 0)
    if not len(kept):
        raise ValueError("init must have a label >= 0 for a cell inside the mask, got only -1")
    values, compact = np.unique(labels[kept], return_inverse=True)
    placed = _core.PlacedCells(positions[kept], measures[kept], n_threads)
    no_arcs = (np.zeros(len(kept) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))
    cells = _core.OrderedGraph(placed, *no_arcs, n_threads)
    found = _core.update_centers(cells, compact.astype(np.int32), len(values), n_threads)
    return kept[found].astype(np.int32)
