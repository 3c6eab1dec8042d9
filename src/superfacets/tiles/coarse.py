"""Coarse cells: made tile by tile, with the arcs between them in one graph in memory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

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


def coarse_graph(
    store: TileStore, cell_size: int, n_threads: int, tile_threads: int, run: Run
) -> TiledCoarseGraph:
    """Write the coarse cell of each place, and return the graph of these."""
    tiles = range(store.n_tiles)
    positions, measures = _columns(
        run(_divide, store, [(tile, cell_size, tile_threads) for tile in tiles])
    )
    firsts = np.concatenate([[0], np.cumsum([len(some) for some in measures])])
    counts, targets, lengths = _columns(
        run(_connect, store, [(tile, firsts, tile_threads) for tile in tiles])
    )
    graph = _core.graph_in_place(
        _in_a_row(positions),
        _in_a_row(measures),
        np.append(0, np.cumsum(_in_a_row(counts))),
        _in_a_row(targets),
        _in_a_row(lengths),
        n_threads,
    )
    return TiledCoarseGraph(graph, store, firsts, run)


def _columns(rows: list[tuple[Any, ...]]) -> list[list[npt.NDArray[Any]]]:
    """The first array of each row, the second, and so on."""
    return [list(column) for column in zip(*rows, strict=True)]


def _in_a_row(parts: list[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Arrays one after the other. Each is dropped once it is copied: there are many cells."""
    end = sum(len(part) for part in parts)
    whole = np.empty((end, *parts[0].shape[1:]), parts[0].dtype)
    while parts:
        part = parts.pop()
        whole[end - len(part) : end] = part
        end -= len(part)
    return whole


def tile_graph(store: TileStore, tile: int, n_threads: int) -> _core.OrderedGraph:
    """The graph of a tile, followed by its ghosts, which have no arcs and no positions."""
    n_ghosts = len(store.read(tile, "ghosts"))
    offsets = store.read(tile, "arcs/offsets")
    return _core.graph_in_place(
        np.concatenate([store.read(tile, "positions"), np.zeros((n_ghosts, 3))]),
        np.concatenate([store.read(tile, "measures"), np.zeros(n_ghosts)]),
        np.concatenate([offsets, np.full(n_ghosts, offsets[-1])]),
        store.read(tile, "arcs/targets"),
        store.read(tile, "arcs/lengths"),
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
    """Return the arcs of the coarse cells of a tile: how many each has, targets and lengths."""
    ghosts = store.read(tile, "ghosts")
    around = store.read_at("coarse", ghosts) + firsts[store.tiles_of(ghosts)]
    coarse = np.concatenate([store.read(tile, "coarse") + firsts[tile], around])
    lengths = [store.read(tile, "coarse_lengths"), store.read_at("coarse_lengths", ghosts)]
    offsets, targets, rounded = _core.connect_tile(
        store.read(tile, "arcs/offsets"),
        store.read(tile, "arcs/targets"),
        store.read(tile, "arcs/lengths"),
        coarse.astype(np.int32),
        np.concatenate(lengths),
        n_threads,
    )
    return np.diff(offsets), targets, rounded


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
