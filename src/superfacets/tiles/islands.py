"""Islands on tiles: components without a center join the nearest region."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from .store import Run, TileStore

__all__ = ["find_islands", "join_islands"]

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]


def join_islands(store: TileStore, labels: Ints, run: Run, n_threads: int) -> tuple[Ints, int]:
    """Return labels without -1, and the number of islands.

    An island gets the label of the cell nearest to any of its cells, the lowest among equals.
    Islands are held in memory, all of them.
    """
    tiles = range(store.n_tiles)
    if labels.min() >= 0:
        return labels, 0
    cells, positions, islands, by_tile = find_islands(store, labels, run)
    squared, nearest = np.full(len(cells), np.inf), np.full(len(cells), -1, np.int32)
    for tile in tiles:
        found = run(_nearest_labeled, store, [(tile, by_tile[tile], positions, n_threads)])[0]
        is_better = (found[0] < squared) | ((found[0] == squared) & (found[1] < nearest))
        squared[is_better], nearest[is_better] = found[0][is_better], found[1][is_better]
    order = np.lexsort([nearest, squared, islands])
    firsts = np.flatnonzero(np.diff(islands[order], prepend=-1))
    joined = labels.copy()
    joined[cells] = labels[nearest[order[firsts]]][islands]
    return joined, len(firsts)


def find_islands(store: TileStore, labels: Ints, run: Run) -> tuple[Ints, Floats, Ints, list[Ints]]:
    """The cells with -1, their positions and islands, and all labels by place, tile by tile."""
    tiles = range(store.n_tiles)
    by_tile = [labels[store.read(tile, "cells")] for tile in tiles]
    parts = run(_unlabeled, store, [(tile, by_tile[tile]) for tile in tiles])
    cells, positions, pairs = (list(column) for column in zip(*parts, strict=True))
    every = np.concatenate(cells)
    return every, np.concatenate(positions), _islands_of(every, pairs), by_tile


def _unlabeled(
    store: TileStore, tile: int, labels: Ints
) -> tuple[Ints, Floats, npt.NDArray[np.int64]]:
    """The cells without a label, their positions, and arcs between them, as pairs of cells."""
    at = np.flatnonzero(labels < 0)
    own = store.read(tile, "cells")
    around = np.concatenate([own, store.read(tile, "ghost_cells")])
    offsets = store.read(tile, "arcs/offsets")
    sources = np.repeat(np.arange(len(own)), np.diff(offsets))
    is_inside = labels[sources] < 0  # and so is the other end: a path leads there
    pairs = np.stack([own[sources[is_inside]], around[store.read(tile, "arcs/targets")[is_inside]]])
    return own[at], store.read(tile, "positions")[at], pairs.astype(np.int64)


def _islands_of(cells: Ints, pairs: list[npt.NDArray[np.int64]]) -> Ints:
    """The island of each cell, 0 to n - 1."""
    order = np.argsort(cells)
    sources, targets = np.searchsorted(cells, np.concatenate(pairs, axis=1), sorter=order)
    sources, targets = order[sources], order[targets]
    by_source = np.argsort(sources, kind="stable")
    offsets = np.searchsorted(sources[by_source], np.arange(len(cells) + 1))
    same = np.zeros(len(cells), np.int32)
    neighbors = targets[by_source].astype(np.int32)
    return _core.find_components(offsets.astype(np.int64), neighbors, same)[0]


def _nearest_labeled(
    store: TileStore, tile: int, labels: Ints, points: Floats, n_threads: int
) -> tuple[Floats, Ints]:
    """For each point the squared distance of the nearest labeled cell of a tile, and that cell."""
    cells = store.read(tile, "cells")
    at = np.flatnonzero(labels >= 0)
    if not len(at):
        return np.full(len(points), np.inf), np.full(len(points), -1, np.int32)
    at = at[np.argsort(cells[at])]  # the lowest of equally near ones is found
    positions = store.read(tile, "positions")[at]
    found, _, _ = _core.nearest_points(positions, points, np.inf, n_threads)
    x, y, z = (positions[found] - points).T
    return x * x + y * y + z * z, cells[at[found]]
