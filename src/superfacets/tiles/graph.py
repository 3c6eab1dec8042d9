"""The graph of all cells, of which one tile at a time is in memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..clustering.levels import are_few
from .coarse import TiledCoarseGraph, coarse_graph
from .islands import join_islands
from .paths import TiledPaths, TiledRegions
from .seeding import geodesic_seeds
from .store import Run, TileStore, find_cells

__all__ = ["TiledGraph"]

Ints = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class TiledGraph:
    """What the loop takes in the place of an `_core.OrderedGraph`.

    Attributes
    ----------
    store : TileStore
        With arcs and their lengths, as `find_arcs` writes them.
    run : callable
        Works on tiles, here or elsewhere.
    n_threads : int
        Of the core, for a tile; methods are told how many there are for what is done here.
    is_parallel : bool
        Whether several tiles are worked on at the same time.
    """

    store: TileStore
    run: Run
    n_threads: int
    is_parallel: bool = False

    is_symmetric = True
    """All weights come from formulas that are the same both ways."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return self.store.n_cells

    def coarsened(self, cell_size: int, n_threads: int) -> TiledCoarseGraph:
        """Return coarse cells of about so many cells."""
        return coarse_graph(self.store, cell_size, n_threads, self.n_threads, self.run)

    def regions(
        self, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
    ) -> TiledRegions:
        """Return the regions around centers, which are cells; expansions do not halt here."""
        assert np.isinf(reach)
        return TiledRegions(self.store, self.run, centers, self._paths, islands)

    @property
    def _paths(self) -> TiledPaths:
        return TiledPaths(self.store, self.run, self.n_threads, self.is_parallel)

    def seeds(self, n_segments: int, init: str, islands: str) -> Ints | None:
        """Return seeds among all cells; None where they can be placed in memory only."""
        if self.store.total_measure <= 0.0 or are_few(self.n_cells, n_segments):
            return None
        return geodesic_seeds(self.store, self.run, n_segments, self._paths)

    def join_islands(self, labels: Ints, groups: Ints, n_threads: int) -> tuple[Ints, int, Ints]:
        """Return labels of all cells, with those of islands, and the number of these."""
        assert not len(groups)
        joined, n_joined = join_islands(self.store, labels, self.run, self.n_threads)
        return joined, n_joined, np.empty(0, np.int32)

    def positions_of(self, cells: Ints) -> npt.NDArray[np.float64]:
        """Return the positions of some cells."""
        found = self.run(_positions, self.store, [(t, cells) for t in range(self.store.n_tiles)])
        positions = np.empty((len(cells), 3))
        for at, values in found:
            positions[at] = values
        return positions

    def gathered(self, n_threads: int) -> _core.OrderedGraph:
        """Return the graph with all cells in memory."""
        store = self.store
        cells = np.concatenate([store.read(tile, "cells") for tile in range(store.n_tiles)])
        n_arcs = [np.diff(store.read(tile, "arcs/offsets")) for tile in range(store.n_tiles)]
        positions, measures = np.empty((store.n_cells, 3)), np.empty(store.n_cells)
        counts = np.empty(store.n_cells, np.int64)
        counts[cells] = np.concatenate(n_arcs)
        offsets = np.concatenate([[0], np.cumsum(counts)])
        neighbors = np.empty(offsets[-1], np.int32)
        lengths = np.empty(offsets[-1], np.float32)
        for tile in range(store.n_tiles):
            first, end = store.starts[tile : tile + 2]
            own = cells[first:end]
            positions[own] = store.read(tile, "positions")
            measures[own] = store.read(tile, "measures")
            ends = np.cumsum(counts[own])
            at = np.arange(ends[-1]) + np.repeat(offsets[own] - ends + counts[own], counts[own])
            around = np.concatenate([own, store.read(tile, "ghost_cells")])
            neighbors[at] = around[store.read(tile, "arcs/targets")]
            lengths[at] = store.read(tile, "arcs/lengths")
        placed = _core.PlacedCells(positions, measures, n_threads)
        return _core.OrderedGraph(placed, offsets, neighbors, lengths, n_threads, True)


def _positions(
    store: TileStore, tile: int, wanted: Ints
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Which of the cells are in a tile, and their positions."""
    which, at = find_cells(store, tile, wanted)
    return which, store.read(tile, "positions")[at]
