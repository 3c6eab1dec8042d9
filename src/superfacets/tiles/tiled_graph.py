"""The graph of all cells, with one tile at a time in memory, and the graph of coarse cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints, Longs
from .mapping import Run
from .store import TileStore
from .tiled_paths import TiledRegions, join_islands


@dataclass(frozen=True, eq=False)
class TiledGraph:
    """Stands in for `_core.OrderedGraph` in the loop."""

    store: TileStore  # with arcs and their lengths, as `find_arcs` writes them
    run: Run
    n_threads: int  # of the core, for a tile; `n_threads` of methods is for all else
    is_parallel: bool = False  # whether several tiles are worked on at the same time

    is_symmetric = True
    """Both arcs of a pair of neighbors have the same weight."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return self.store.n_cells

    def coarsened(self, cell_size: int, n_threads: int) -> TiledCoarseGraph:
        """Write the coarse cell of each place, and return the graph of coarse cells."""
        store, run = self.store, self.run
        found = run.all(_divide, store, store.n_tiles, cell_size, self.n_threads)
        positions, measures = _columns(found)
        firsts = np.append(0, np.cumsum([len(some) for some in measures]))
        found = run.all(_connect, store, store.n_tiles, firsts, self.n_threads)
        counts, targets, lengths = _columns(found)
        graph = _core.graph_in_place(
            _in_a_row(positions),
            _in_a_row(measures),
            np.append(0, np.cumsum(_in_a_row(counts))),
            _in_a_row(targets),
            _in_a_row(lengths),
            n_threads,
        )
        return TiledCoarseGraph(graph, store, firsts, run)

    def regions(
        self, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
    ) -> TiledRegions:
        """Return the regions around the cells `centers`. Halted expansion is not supported."""
        assert np.isinf(reach)
        regions = TiledRegions(self.store, self.run, self.n_threads, self.is_parallel, centers)
        if islands == _core.Islands.KEEP:
            regions.adopt_orphans()
        return regions

    def join_islands(self, labels: Ints, groups: Ints, n_threads: int) -> tuple[Ints, int, Ints]:
        """Return labels with islands joined, the number of islands, and no new centers."""
        assert not len(groups)
        joined, n_joined = join_islands(self.store, labels, self.run, self.n_threads)
        return joined, n_joined, np.empty(0, np.int32)

    def gathered(self, n_threads: int) -> _core.OrderedGraph:
        """Return the graph with all cells in memory."""
        store = self.store
        tiles = range(store.n_tiles)
        cells = [store.read(tile, "cells") for tile in tiles]
        positions, measures = np.empty((store.n_cells, 3)), np.empty(store.n_cells)
        offsets = np.zeros(store.n_cells + 1, np.int64)
        for tile in tiles:
            positions[cells[tile]] = store.read(tile, "positions")
            measures[cells[tile]] = store.read(tile, "measures")
            offsets[1:][cells[tile]] = np.diff(store.read(tile, "arcs/offsets"))
        np.cumsum(offsets, out=offsets)
        neighbors, lengths = np.empty(offsets[-1], np.int32), np.empty(offsets[-1], np.float32)
        for tile in tiles:
            _, at = _core.choose_lists(offsets, cells[tile].astype(np.int64))
            around = np.concatenate([cells[tile], store.read(tile, "ghost_cells")])
            neighbors[at] = around[store.read(tile, "arcs/targets")]
            lengths[at] = store.read(tile, "arcs/lengths")
        placed = _core.PlacedCells(positions, measures, n_threads)
        return _core.OrderedGraph(placed, offsets, neighbors, lengths, n_threads, True)


@dataclass(frozen=True, eq=False)
class TiledCoarseGraph:
    """Stands in for `_core.CoarseGraph` in the loop."""

    graph: _core.OrderedGraph  # of all coarse cells
    store: TileStore  # ``coarse``: coarse cell of each place, relative to the first of its tile
    firsts: Longs  # the first coarse cell of each tile
    run: Run

    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints:
        """Return for each region of coarse cells the cell nearest to its mean."""
        means = _core.region_means(self.graph, labels, len(centers))
        parts = np.split(labels, self.firsts[1:-1])
        jobs = [(tile, part, means) for tile, part in enumerate(parts)]
        found = self.run(_nearest_to_means, self.store, jobs)
        squared, cells = (np.array(column) for column in zip(*found, strict=True))
        is_least = (squared == squared.min(axis=0)) & (cells >= 0)
        lowest = np.where(is_least, cells, np.iinfo(np.int32).max).min(axis=0)
        return np.asarray(lowest, np.int32)


def _columns(rows: list[tuple[Any, ...]]) -> list[list[Array]]:
    """Transpose rows of arrays into columns."""
    return [list(column) for column in zip(*rows, strict=True)]


def _in_a_row(parts: list[Array]) -> Array:
    """Concatenate arrays, and empty the list on the way, to save memory."""
    end = sum(len(part) for part in parts)
    whole = np.empty((end, *parts[0].shape[1:]), parts[0].dtype)
    while parts:
        part = parts.pop()
        whole[end - len(part) : end] = part
        end -= len(part)
    return whole


def _divide(store: TileStore, tile: int, cell_size: int, n_threads: int) -> tuple[Floats, Floats]:
    """Write the coarse cells of a tile; return their positions and measures.

    Ghosts follow the cells in the graph; they have no arcs and no positions.
    """
    n_ghosts = len(store.read(tile, "ghosts"))
    offsets = store.read(tile, "arcs/offsets")
    graph = _core.graph_in_place(
        np.concatenate([store.read(tile, "positions"), np.zeros((n_ghosts, 3))]),
        np.concatenate([store.read(tile, "measures"), np.zeros(n_ghosts)]),
        np.concatenate([offsets, np.full(n_ghosts, offsets[-1])]),
        store.read(tile, "arcs/targets"),
        store.read(tile, "arcs/lengths"),
        n_threads,
    )
    _, positions, measures, coarse, lengths = _core.divide_tile(
        graph, store.size(tile), cell_size, n_threads
    )
    store.write(tile, "coarse", coarse)
    store.write(tile, "coarse_lengths", lengths)
    return positions, measures


def _connect(
    store: TileStore, tile: int, firsts: Longs, n_threads: int
) -> tuple[Longs, Ints, Array]:
    """Return the arcs of the coarse cells of a tile: number per cell, targets, lengths."""
    ghosts = store.read(tile, "ghosts")
    around = store.read_at("coarse", ghosts) + firsts[store.tiles_of(ghosts)]
    coarse = np.concatenate([store.read(tile, "coarse") + firsts[tile], around])
    lengths = [store.read(tile, "coarse_lengths"), store.read_at("coarse_lengths", ghosts)]
    offsets, targets, rounded = _core.connect_tile(
        *store.arcs(tile), coarse.astype(np.int32), np.concatenate(lengths), n_threads
    )
    return np.diff(offsets), targets, rounded


def _nearest_to_means(
    store: TileStore, tile: int, labels: Ints, means: Floats
) -> tuple[Floats, Ints]:
    """The cell of a tile nearest to the mean of each region: squared distances, and cells."""
    positions, cells = store.read(tile, "positions"), store.read(tile, "cells")
    return _core.nearest_of_regions(positions, cells, labels[store.read(tile, "coarse")], means)
