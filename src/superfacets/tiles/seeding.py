"""Stage 3 on tiles, where the loop runs on all cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .paths import Frame, TiledPaths, frame_of, own_labels, paths_of
from .store import Run, TileStore

__all__ = ["geodesic_seeds"]

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]


class _Found(NamedTuple):
    """A cell, where it is, and a distance, or the length of a path in units."""

    distance: float
    cell: int
    place: int


def _central_cell(store: TileStore, run: Run) -> _Found:
    """The cell nearest to the mean of all, the lowest among equals; there must be some area."""
    jobs = [(tile, frame_of(store)) for tile in range(store.n_tiles)]
    means, _ = _core.fixed_means(np.sum(run(_sum, store, jobs), axis=0), *frame_of(store))
    found: list[_Found] = run(_nearest, store, [(tile, means) for tile, _ in jobs])
    return min(found, key=lambda one: (one.distance, one.cell))


def geodesic_seeds(store: TileStore, run: Run, n_seeds: int, paths: TiledPaths) -> Ints | None:
    """A first cell, then again and again the one farthest from all before by path length.

    The lowest among equals. None where no path leads from the first cell to some other.
    """
    first = _central_cell(store, run)
    farthest = [first for _ in range(store.n_tiles)]
    seeds = [first]
    while True:
        path = np.zeros(1, np.uint64), np.array([len(seeds) - 1], np.int32)
        changed = set(paths.propose((np.array([seeds[-1].place]), *path)))
        jobs = [job for job in paths.versions if job[0] in changed]
        found = run(_longest, store, jobs)
        if None in found or (len(seeds) == 1 and len(jobs) < store.n_tiles):
            return None
        for (tile, _), longest in zip(jobs, found, strict=True):
            farthest[tile] = longest
        if len(seeds) == n_seeds:
            paths.clear()
            return np.array([seed.cell for seed in seeds], np.int32)
        seeds.append(_best(farthest))


def _best(farthest: list[_Found]) -> _Found:
    """The farthest cell, the lowest among equals."""
    return max(farthest, key=lambda one: (one.distance, -one.cell))


def _sum(store: TileStore, tile: int, frame: Frame) -> npt.NDArray[np.int64]:
    positions, measures = store.read(tile, "positions"), store.read(tile, "measures")
    labels = np.zeros(store.size(tile), np.int32)
    return _core.fixed_sums(positions, measures, labels, 1, *frame)


def _nearest(store: TileStore, tile: int, means: Floats) -> _Found:
    cells = store.read(tile, "cells")
    labels = np.zeros(len(cells), np.int32)
    positions = store.read(tile, "positions")
    squared, found = _core.nearest_of_regions(positions, cells, labels, means)
    place = store.starts[tile] + int(np.flatnonzero(cells == found[0])[0])
    return _Found(float(squared[0]), int(found[0]), place)


def _longest(store: TileStore, tile: int, version: int) -> _Found | None:
    """The longest path to a cell of a tile; None where one is unreached."""
    if own_labels(store, tile, version).min() < 0:
        return None
    lengths = paths_of(store, tile, version)[0][: store.size(tile)]
    return _lowest_of_highest(store, tile, lengths, store.read(tile, "cells"))


def _lowest_of_highest(
    store: TileStore, tile: int, distances: npt.NDArray[np.float64 | np.uint64], cells: Ints
) -> _Found:
    at = np.flatnonzero(distances == distances.max())
    lowest = at[cells[at].argmin()]
    return _Found(distances[lowest].item(), int(cells[lowest]), store.starts[tile] + int(lowest))
