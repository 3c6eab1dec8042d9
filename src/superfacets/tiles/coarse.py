"""Coarse cells: made tile by tile, with the arcs between them in one graph in memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from .store import Run, TileStore

__all__ = ["TiledCoarseGraph", "coarse_graph", "nearest_cells", "tile_graph"]

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TiledCoarseGraph:
    """What the loop takes in the place of a `_core.CoarseGraph`.

    Attributes
    ----------
    graph : _core.OrderedGraph
        Of all coarse cells.
    store : TileStore
        Its arrays ``coarse`` hold the coarse cell of each place, counted from the first one of
        the tile.
    firsts : ndarray of int64, shape (n_tiles + 1,)
        The first coarse cell of each tile.
    run : callable
    """

    graph: _core.OrderedGraph
    store: TileStore
    firsts: npt.NDArray[np.int64]
    run: Run

    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints:
        """Return centers among cells for regions of coarse cells."""
        means = _core.region_means(self.graph, labels, len(centers))
        jobs = [
            (tile, labels[self.firsts[tile] : self.firsts[tile + 1]], means)
            for tile in range(self.store.n_tiles)
        ]
        return nearest_cells(self.run(_nearest_to_means, self.store, jobs))


def nearest_cells(found: list[tuple[Floats, Ints]]) -> Ints:
    """The nearest cell of each region, of those in each tile; the lowest among equals."""
    squared = np.array([distances for distances, _ in found])
    cells = np.array([some for _, some in found])
    is_least = (squared == squared.min(axis=0)) & (cells >= 0)
    lowest = np.where(is_least, cells, np.iinfo(np.int32).max).min(axis=0)
    return np.asarray(lowest, np.int32)


def coarse_graph(store: TileStore, cell_size: int, n_threads: int, run: Run) -> TiledCoarseGraph:
    """Write the coarse cell of each place, and return the graph of these."""
    tiles = range(store.n_tiles)
    divided = run(_divide, store, [(tile, cell_size, n_threads) for tile in tiles])
    firsts = np.concatenate([[0], np.cumsum([len(measures) for _, measures in divided])])
    arcs = run(_connect, store, [(tile, firsts, n_threads) for tile in tiles])
    first_arcs = np.concatenate([[0], np.cumsum([len(targets) for _, targets, _ in arcs])])
    offsets = [some[1:] + first for (some, _, _), first in zip(arcs, first_arcs, strict=False)]
    graph = _core.graph_in_place(
        np.concatenate([positions for positions, _ in divided]),
        np.concatenate([measures for _, measures in divided]),
        np.concatenate([np.zeros(1, np.int64), *offsets]),
        np.concatenate([targets for _, targets, _ in arcs]),
        np.concatenate([lengths for _, _, lengths in arcs]),
        n_threads,
    )
    return TiledCoarseGraph(graph, store, firsts, run)


def tile_graph(store: TileStore, tile: int, n_threads: int) -> _core.OrderedGraph:
    """The graph of a tile, followed by its ghosts, which have no arcs and no positions."""
    n_ghosts = len(store.read(tile, "ghosts"))
    offsets = store.read(tile, "arc_offsets")
    return _core.graph_in_place(
        np.concatenate([store.read(tile, "positions"), np.zeros((n_ghosts, 3))]),
        np.concatenate([store.read(tile, "measures"), np.zeros(n_ghosts)]),
        np.concatenate([offsets, np.full(n_ghosts, offsets[-1])]),
        store.read(tile, "arc_targets"),
        store.read(tile, "lengths"),
        n_threads,
    )


def _divide(store: TileStore, tile: int, cell_size: int, n_threads: int) -> tuple[Floats, Floats]:
    """Write the coarse cells of a tile; return their positions and measures."""
    graph = tile_graph(store, tile, n_threads)
    _, positions, measures, coarse, lengths = _core.divide_tile(
        graph, store.size(tile), cell_size, n_threads
    )
    store.write(tile, "coarse", coarse)
    store.write(tile, "coarse_lengths", lengths)
    return positions, measures


def _connect(
    store: TileStore, tile: int, firsts: npt.NDArray[np.int64], n_threads: int
) -> tuple[npt.NDArray[np.int64], Ints, npt.NDArray[np.float32]]:
    """Return the arcs of the coarse cells of a tile."""
    ghosts = store.read(tile, "ghosts")
    around = store.read_at("coarse", ghosts) + firsts[store.tiles_of(ghosts)]
    coarse = np.concatenate([store.read(tile, "coarse") + firsts[tile], around])
    lengths = [store.read(tile, "coarse_lengths"), store.read_at("coarse_lengths", ghosts)]
    return _core.connect_tile(
        store.read(tile, "arc_offsets"),
        store.read(tile, "arc_targets"),
        store.read(tile, "lengths"),
        coarse.astype(np.int32),
        np.concatenate(lengths),
        n_threads,
    )


def _nearest_to_means(
    store: TileStore, tile: int, labels: Ints, means: Floats
) -> tuple[Floats, Ints]:
    """The cell of each region in a tile that is nearest to its mean; labels of its coarse cells."""
    return _core.nearest_of_regions(
        store.read(tile, "positions"),
        store.read(tile, "cells"),
        labels[store.read(tile, "coarse")],
        means,
    )
