"""Stage 1 for clouds on tiles: who is a neighbor of whom, and the area of each point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ... import _core
from ..scratch import Scratch
from ..store import Job, Run, TileStore
from ..sums import BlockedSum
from .nearest import find_neighbors
from .normals import turn_normals
from .reading import CloudPieces
from .sorting import NOT_COPIED, SortedCloud, sort_cloud

__all__ = ["make_cloud_tiles"]

Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]

LEFTOVERS = ("near", "areas", "lowest", "place_of_lowest", "out_sources", "out_targets")
"""Arrays that nothing needs when the lists are made."""


def make_cloud_tiles(
    pieces: CloudPieces, scratch: Scratch, tile_cells: int, *, run: Run, n_threads: int
) -> TileStore:
    """Write a cloud as tiles with all that `build_point_graph` finds out, to the bit.

    Beside ``cells``, ``numbers`` and ``positions`` (see `SortedCloud`) there are, per tile,

    ========= =============== =========================================================
    measures  (n,) float64    areas
    normals   (n, 3) float64  of length 1, or zero
    neighbors lists           the places ``targets`` of all neighbors, ascending
    ========= =============== =========================================================

    Parameters
    ----------
    pieces : CloudPieces
    scratch : Scratch
    tile_cells : int
        Points in a tile, at most; rounded up to a multiple of `RANGE`.
    run : Run
    n_threads : int
        Of the core, where a piece is worked on.

    Raises
    ------
    MeshError
        As `sort_cloud`.
    """
    cloud = sort_cloud(pieces, scratch, tile_cells, run=run, n_threads=n_threads)
    store = cloud.store
    find_neighbors(cloud, tile_cells, run, n_threads)
    if not cloud.has_normals:
        turn_normals(store)
    has_copies = cloud.n_apart < store.n_cells
    if has_copies:
        _find_lowest(store, run)
    tiles = range(store.n_tiles)
    leaving = run(_write_leaving, store, [(tile,) for tile in tiles])
    jobs: list[Job] = [
        (tile, [(other, *found[tile]) for other, found in enumerate(leaving) if tile in found])
        for tile in tiles
    ]
    run(_join, store, jobs)
    run(_share_areas, store, [(tile,) for tile in tiles])
    if has_copies:
        names = ("measures",) if cloud.has_normals else ("measures", "normals")
        run(_follow_lowest, store, [(tile, names) for tile in tiles])
        for tile in tiles:  # while others read an array, Windows does not replace it
            for name in names:
                store.rename(tile, f"followed_{name}", name)
    for tile in tiles:
        for name in LEFTOVERS:
            store.remove(tile, name)
    return replace(store, total_measure=_total(store, cloud))


def _find_lowest(store: TileStore, run: Run) -> None:
    """Write ``place_of_lowest``: of each copy the place of the lowest point at its position."""
    tiles = range(store.n_tiles)
    wanted = np.unique(np.concatenate(run(_missing, store, [(tile,) for tile in tiles])))
    places = np.full(len(wanted), -1, np.int32)
    if len(wanted):
        for which, found in run(_find, store, [(tile, wanted) for tile in tiles]):
            places[which] = found
    run(_write_lowest, store, [(tile, wanted, places) for tile in tiles])


def _apart(store: TileStore, tile: int) -> tuple[Ints, Longs]:
    """Numbers of the points that are no copies, ascending, and their places in the tile."""
    at = np.flatnonzero(store.read(tile, "lowest") == NOT_COPIED)
    numbers = store.read(tile, "numbers")[at]
    order = np.argsort(numbers)
    return numbers[order], at[order]


def _missing(store: TileStore, tile: int) -> Ints:
    """Numbers of the lowest points of copies in a tile that are in other tiles."""
    lowest = store.read(tile, "lowest")
    return np.setdiff1d(lowest[lowest != NOT_COPIED], _apart(store, tile)[0])


def _find(store: TileStore, tile: int, wanted: Ints) -> tuple[Longs, Longs]:
    """Which of some points are in a tile, and their places."""
    numbers, at = _apart(store, tile)
    _, which, found = np.intersect1d(wanted, numbers, assume_unique=True, return_indices=True)
    return which, at[found] + store.starts[tile]


def _write_lowest(store: TileStore, tile: int, elsewhere: Ints, places: Ints) -> None:
    lowest = store.read(tile, "lowest")
    lowest = lowest[lowest != NOT_COPIED]
    numbers, at = _apart(store, tile)
    every = np.concatenate([numbers, elsewhere])
    order = np.argsort(every)
    places = np.concatenate([at + store.starts[tile], places])[order]
    found = places[np.searchsorted(every, lowest, sorter=order)]
    store.write(tile, "place_of_lowest", found.astype(np.int32))


def _pairs(store: TileStore, tile: int) -> tuple[Ints, Ints]:
    """Points of a tile, and the places that they lead to: the nearest, and of copies the lowest."""
    near, first = store.read(tile, "near"), store.starts[tile]
    rows, columns = np.nonzero(near >= 0)
    sources, targets = rows.astype(np.int32), near[rows, columns]
    if store.has(tile, "place_of_lowest"):
        copies = np.flatnonzero(store.read(tile, "lowest") != NOT_COPIED).astype(np.int32)
        sources = np.concatenate([sources, copies])
        targets = np.concatenate([targets, store.read(tile, "place_of_lowest")])
    return sources + np.int32(first), targets


def _write_leaving(store: TileStore, tile: int) -> dict[int, tuple[int, int]]:
    """Write the pairs that lead to other tiles, by tile; where those of each begin and end."""
    sources, targets = _pairs(store, tile)
    tiles = store.tiles_of(targets)
    leaves = np.flatnonzero(tiles != tile)
    leaves = leaves[np.argsort(tiles[leaves], kind="stable")]
    store.write(tile, "out_sources", sources[leaves])
    store.write(tile, "out_targets", targets[leaves])
    others, first = np.unique(tiles[leaves], return_index=True)
    ends = np.append(first, len(leaves))[1:]
    ranges = zip(first.tolist(), ends.tolist(), strict=True)
    return dict(zip(others.tolist(), ranges, strict=True))


def _join(store: TileStore, tile: int, entering: list[tuple[int, int, int]]) -> None:
    """Write the lists of a tile; `entering` tells where pairs of other tiles lead here."""
    sources, targets = _pairs(store, tile)
    first = store.starts[tile]
    is_own = store.is_in(tile, targets)
    parts = [(sources, targets), (targets[is_own], sources[is_own])]
    for other, begin, end in entering:
        found = [
            store.scratch.load(f"tile{other}/{name}", begin, end)
            for name in ("out_targets", "out_sources")
        ]
        parts.append((found[0], found[1]))
    sources, targets = (np.concatenate(column) for column in zip(*parts, strict=True))
    offsets, joined = _core.sorted_lists(store.size(tile), sources - np.int32(first), targets)
    store.write(tile, "neighbors/offsets", offsets)
    store.write(tile, "neighbors/targets", joined)


def _share_areas(store: TileStore, tile: int) -> None:
    """Write the area of each point, which it shares with its copies."""
    areas = store.read(tile, "areas")
    if store.has(tile, "place_of_lowest"):
        offsets = store.read(tile, "neighbors/offsets")
        targets = store.read(tile, "neighbors/targets")
        is_own = store.is_in(tile, targets)
        is_copy = np.zeros(len(targets), bool)
        at = targets[is_own] - store.starts[tile]
        is_copy[is_own] = store.read(tile, "lowest")[at] != NOT_COPIED
        ghosts, which = np.unique(targets[~is_own], return_inverse=True)
        is_copy[~is_own] = (store.read_at("lowest", ghosts) != NOT_COPIED)[which.reshape(-1)]
        before = np.append(0, np.cumsum(is_copy))
        areas = areas / (1 + before[offsets[1:]] - before[offsets[:-1]])
    store.write(tile, "measures", areas)


def _follow_lowest(store: TileStore, tile: int, names: tuple[str, ...]) -> None:
    """Write anew what copies have from the lowest at their position: area, an estimated normal."""
    at = np.flatnonzero(store.read(tile, "lowest") != NOT_COPIED)
    places, which = np.unique(store.read(tile, "place_of_lowest"), return_inverse=True)
    for name in names:
        values = store.read(tile, name).copy()
        values[at] = store.read_at(name, places)[which.reshape(-1)]
        store.write(tile, f"followed_{name}", values)


def _total(store: TileStore, cloud: SortedCloud) -> float:
    """The sum of all areas, in the order that the cells have in memory: copies are the last."""
    total = BlockedSum()
    of_copies = np.empty(store.n_cells - cloud.n_apart)
    for tile in range(store.n_tiles):
        cells, measures = store.read(tile, "cells"), store.read(tile, "measures")
        is_apart = cells < cloud.n_apart
        total.add(measures[is_apart])
        of_copies[cells[~is_apart] - cloud.n_apart] = measures[~is_apart]
    total.add(of_copies)
    return total.total
