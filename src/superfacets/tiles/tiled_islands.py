"""Islands on tiles: connected components without a center."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Floats, Ints, Longs
from .store import Run, TileStore


def join_islands(store: TileStore, labels: Ints, run: Run, n_threads: int) -> tuple[Ints, int]:
    """Label the cells with -1, and return all labels and the number of islands.

    An island gets the label of the cell nearest to any of its cells, the lowest among equals. The
    cells of all islands are in memory.
    """
    if labels.min() >= 0:
        return labels, 0
    cells, positions, islands = find_islands(store, labels, run)
    squared, nearest = np.full(len(cells), np.inf), np.full(len(cells), -1, np.int32)
    for tile in range(store.n_tiles):
        job = (tile, labels[store.read(tile, "cells")], positions, n_threads)
        found = run(_nearest_labeled, store, [job])[0]
        is_better = (found[0] < squared) | ((found[0] == squared) & (found[1] < nearest))
        squared[is_better], nearest[is_better] = found[0][is_better], found[1][is_better]
    order = np.lexsort([nearest, squared, islands])
    firsts = np.flatnonzero(np.diff(islands[order], prepend=-1))
    joined = labels.copy()
    joined[cells] = labels[nearest[order[firsts]]][islands]
    return joined, len(firsts)


def find_islands(store: TileStore, labels: Ints, run: Run) -> tuple[Ints, Floats, Ints]:
    """The cells with label -1, their positions, and the island of each, 0 to n - 1."""
    jobs = [(tile, labels[store.read(tile, "cells")]) for tile in range(store.n_tiles)]
    parts = run(_unlabeled, store, jobs)
    cells, positions = (np.concatenate([part[i] for part in parts]) for i in range(2))
    order = np.argsort(cells)
    pairs = np.concatenate([part[2] for part in parts], axis=1)
    sources, targets = order[np.searchsorted(cells, pairs, sorter=order)]
    by_source = np.argsort(sources, kind="stable")
    offsets = np.searchsorted(sources[by_source], np.arange(len(cells) + 1)).astype(np.int64)
    neighbors, same = targets[by_source].astype(np.int32), np.zeros(len(cells), np.int32)
    return cells, positions, _core.find_components(offsets, neighbors, same)[0]


def _unlabeled(store: TileStore, tile: int, labels: Ints) -> tuple[Ints, Floats, Longs]:
    """The cells without a label, their positions, and arcs between them, as pairs of cells."""
    at = np.flatnonzero(labels < 0)
    own = store.read(tile, "cells")
    around = np.concatenate([own, store.read(tile, "ghost_cells")])
    sources = np.repeat(np.arange(len(own)), np.diff(store.read(tile, "arcs/offsets")))
    is_inside = labels[sources] < 0  # then the target has no label either
    pairs = np.stack([own[sources[is_inside]], around[store.read(tile, "arcs/targets")[is_inside]]])
    return own[at], store.read(tile, "positions")[at], pairs.astype(np.int64)


def _nearest_labeled(
    store: TileStore, tile: int, labels: Ints, points: Floats, n_threads: int
) -> tuple[Floats, Ints]:
    """For each point the squared distance of the nearest labeled cell of a tile, and that cell."""
    cells = store.read(tile, "cells")
    at = np.flatnonzero(labels >= 0)
    if not len(at):
        return np.full(len(points), np.inf), np.full(len(points), -1, np.int32)
    at = at[np.argsort(cells[at])]  # so that the lowest of equally near cells is found
    positions = store.read(tile, "positions")[at]
    found, _, _ = _core.nearest_points(positions, points, np.inf, n_threads)
    x, y, z = (positions[found] - points).T
    return x * x + y * y + z * z, cells[at[found]]
