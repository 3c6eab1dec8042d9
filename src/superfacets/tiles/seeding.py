"""Stage 3 on tiles, where the loop runs on all cells."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .paths import Frame, TiledPaths, frame_of, own_labels, paths_of
from .store import Run, TileStore

__all__ = ["Found", "central_cell", "farthest_seeds", "geodesic_seeds"]

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]


class Found(NamedTuple):
    """A cell, where it is, and a distance, or the length of a path in units."""

    distance: float
    cell: int
    place: int


def central_cell(store: TileStore, run: Run) -> Found:
    """The cell nearest to the mean of all, the lowest among equals; there must be some area."""
    jobs = [(tile, frame_of(store)) for tile in range(store.n_tiles)]
    means, _ = _core.fixed_means(np.sum(run(_sum, store, jobs), axis=0), *frame_of(store))
    found: list[Found] = run(_nearest, store, [(tile, means) for tile, _ in jobs])
    return min(found, key=lambda one: (one.distance, one.cell))


def farthest_seeds(store: TileStore, run: Run, first: Found, n_seeds: int) -> Ints:
    """A first cell, then again and again the cell farthest from all before, the lowest of equals.

    A tile whose box is farther from a new seed than its farthest cell is from those before is not
    looked at, as `FarthestPoints` does with smaller boxes.
    """
    tiles = range(store.n_tiles)
    boxes = np.array(run(_start, store, [(tile,) for tile in tiles]))
    farthest = [first._replace(distance=np.inf) for _ in tiles]
    seeds = [first]
    while True:
        position = store.read_at("positions", np.array([seeds[-1].place]))[0]
        gaps = np.maximum(np.maximum(boxes[:, 0] - position, position - boxes[:, 1]), 0.0)
        x, y, z = gaps.T
        near = np.flatnonzero(np.array([far.distance for far in farthest]) >= x * x + y * y + z * z)
        jobs = [(tile, position, seeds[-1].cell) for tile in near.tolist()]
        for (tile, *_), found in zip(jobs, run(_place, store, jobs), strict=True):
            farthest[tile] = found
        if len(seeds) == n_seeds:
            return np.array([seed.cell for seed in seeds], np.int32)
        seeds.append(_best(farthest))


def geodesic_seeds(
    store: TileStore, run: Run, first: Found, n_seeds: int, paths: TiledPaths
) -> Ints | None:
    """The same by path length; None where no path leads from the first cell to some other."""
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


def _best(farthest: list[Found]) -> Found:
    """The farthest cell, the lowest among equals."""
    return max(farthest, key=lambda one: (one.distance, -one.cell))


def _sum(store: TileStore, tile: int, frame: Frame) -> npt.NDArray[np.int64]:
    positions, measures = store.read(tile, "positions"), store.read(tile, "measures")
    labels = np.zeros(store.size(tile), np.int32)
    return _core.fixed_sums(positions, measures, labels, 1, *frame)


def _nearest(store: TileStore, tile: int, means: Floats) -> Found:
    cells = store.read(tile, "cells")
    labels = np.zeros(len(cells), np.int32)
    positions = store.read(tile, "positions")
    squared, found = _core.nearest_of_regions(positions, cells, labels, means)
    place = store.starts[tile] + int(np.flatnonzero(cells == found[0])[0])
    return Found(float(squared[0]), int(found[0]), place)


def _start(store: TileStore, tile: int) -> Floats:
    """Write infinite distances; return the box of the cells."""
    store.write(tile, "seed_distances", np.full(store.size(tile), np.inf))
    positions = store.read(tile, "positions")
    return np.array([positions.min(axis=0), positions.max(axis=0)])


def _place(store: TileStore, tile: int, position: Floats, seed: int) -> Found:
    """Take a seed; return the farthest cell of a tile, and its squared distance."""
    x, y, z = (store.read(tile, "positions") - position).T
    squared = np.minimum(store.read(tile, "seed_distances"), x * x + y * y + z * z)
    cells = store.read(tile, "cells")
    squared[cells == seed] = -1.0  # never the farthest again
    store.write(tile, "seed_distances", squared)
    return _lowest_of_highest(store, tile, squared, cells)


def _longest(store: TileStore, tile: int, version: int) -> Found | None:
    """The longest path to a cell of a tile; None where one is unreached."""
    if own_labels(store, tile, version).min() < 0:
        return None
    lengths = paths_of(store, tile, version)[0][: store.size(tile)]
    return _lowest_of_highest(store, tile, lengths, store.read(tile, "cells"))


def _lowest_of_highest(
    store: TileStore, tile: int, distances: npt.NDArray[np.float64 | np.uint64], cells: Ints
) -> Found:
    at = np.flatnonzero(distances == distances.max())
    lowest = at[cells[at].argmin()]
    return Found(distances[lowest].item(), int(cells[lowest]), store.starts[tile] + int(lowest))
