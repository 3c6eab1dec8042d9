"""What is decided when the graph is known: which cells are left, how large regions are to be."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from .. import _core
from .._options import Init, Seeds, SizeOptions
from .._types import Ints, Longs, Singles
from ..cells.constraints import NO_GROUPS, Cut
from ..cells.size import RegionSize, region_size
from .segmentation import Segmentation
from .warm_start import Start, first_centers, with_seeds

__all__ = ["ArcLengths", "Plan"]

ArcLengths: TypeAlias = tuple[Longs, Ints, Singles]
"""Offsets, neighbors and lengths of arcs."""


@dataclass(frozen=True)
class Plan:
    """The cells to segment, the size of regions, and how to begin.

    Attributes
    ----------
    cut : Cut or None
        The cells and arcs that are left; None for all.
    size : RegionSize
    asked : SizeOptions
        The size as asked for, with the seeds below.
    init : str or ndarray of int32
        A way to place seeds, or cells that are left.
    """

    cut: Cut | None
    size: RegionSize
    asked: SizeOptions
    init: Init | Seeds

    @classmethod
    def of(
        cls, graph: Any, cut: Cut | None, start: tuple[SizeOptions, Init | Start], n_threads: int,
        *, dimension: int, order: Ints | None = None,
    ) -> Plan:  # fmt: skip
        """Make the plan for a graph, of which some may be left; errors are those of `segment`.

        Where the graph has the cells in an order of their own, this holds their numbers in the
        source, by which seeds are given.
        """
        asked, given = start
        kept, measures = None, graph.measures
        if cut is not None:
            kept, measures = cut.cells, measures[cut.cells]
        init = first_centers(given, graph.positions, graph.measures, kept, n_threads, order)
        if cut is not None and not isinstance(init, str):
            init = cut.new_cells(init, "init", order)
        asked = with_seeds(asked, init)
        size = region_size(asked, measures, graph.diagonal, n_threads, dimension)
        return cls(cut, size, asked, init)

    @property
    def groups(self) -> Ints:
        """Groups of cells that must not come together in one region; empty if there are none."""
        return NO_GROUPS if self.cut is None else self.cut.groups

    def placed_cells(
        self, graph: Any, lengths: Singles, n_threads: int, placed: _core.PlacedCells | None = None
    ) -> tuple[_core.PlacedCells, ArcLengths]:
        """Return the cells that are left, in order, and their arcs.

        All cells may have been placed before.
        """
        cut = self.cut
        if cut is None:
            if placed is None:
                placed = _core.PlacedCells(graph.positions, graph.measures, n_threads)
            return placed, (graph.offsets, graph.neighbors, lengths)
        cells = (graph.positions[cut.cells], graph.measures[cut.cells])
        return _core.PlacedCells(*cells, n_threads), (cut.offsets, cut.neighbors, lengths[cut.arcs])

    def whole(self, result: Segmentation) -> Segmentation:
        """Return the result for all cells, with -1 for those that were left out."""
        if self.cut is None:
            return result
        labels, centers = self.cut.whole_labels(result.labels), self.cut.cells[result.centers]
        return replace(result, labels=labels, centers=centers)
