"""Stage 1 for clouds on tiles: the neighbors and the area of each point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import _core
from .._types import Ints
from .cloud_nearest import find_neighbors
from .cloud_normals import turn_normals
from .cloud_order import NOT_COPIED, sort_cloud
from .mapping import run_all
from .opening import Pieces
from .scratch import Scratch
from .store import Job, Run, TileStore

LEFTOVERS = ("near", "areas", "shared", "estimated", "lowest", "out_sources", "out_targets")
"""Arrays that only this stage needs."""


def make_cloud_tiles(
    pieces: Pieces, scratch: Scratch, tile_cells: int, *, run: Run, n_threads: int
) -> TileStore:
    """Write a cloud as tiles, with the results of `build_point_graph` bit for bit.

    Besides ``cells``, ``numbers`` and ``positions`` (see `SortedCloud`) there are, per tile,

    ========= =============== =========================================================
    measures  (n,) float64    areas
    normals   (n, 3) float64  of length 1, or zero
    neighbors lists           the places ``targets`` of all neighbors, ascending
    ========= =============== =========================================================

    Tiles have at most `tile_cells` points, rounded up to a multiple of `RANGE`. The core has
    `n_threads` for each. Errors are those of `sort_cloud`.
    """
    cloud = sort_cloud(pieces, scratch, tile_cells, run, n_threads)
    store = cloud.store
    find_neighbors(cloud, tile_cells, run, n_threads)
    if not cloud.has_normals:
        turn_normals(store)
    tiles = range(store.n_tiles)
    leaving = run_all(run, _write_leaving, store, store.n_tiles)
    jobs: list[Job] = [
        (tile, [(other, *found[tile]) for other, found in enumerate(leaving) if tile in found])
        for tile in tiles
    ]
    run(_join, store, jobs)
    run_all(run, _share_areas, store, store.n_tiles)
    run_all(run, _follow_lowest, store, store.n_tiles)
    store.remove_from_all(*LEFTOVERS)
    measures = np.empty(store.n_cells)  # by number, the order in which `segment` adds them
    for tile in tiles:
        measures[store.read(tile, "cells")] = store.read(tile, "measures")
    return replace(store, total_measure=_core.sum_of(measures, n_threads))


def _pairs(store: TileStore, tile: int) -> tuple[Ints, Ints]:
    """Pairs of places: each point of a tile with its nearest ones; a copy with the lowest point."""
    near, lowest = store.read(tile, "near"), store.read(tile, "lowest")
    rows, columns = np.nonzero(near >= 0)
    copies = np.flatnonzero(lowest != NOT_COPIED)
    sources = np.concatenate([rows, copies]).astype(np.int32)
    targets = np.concatenate([near[rows, columns], lowest[copies]])
    return sources + np.int32(store.starts[tile]), targets


def _write_leaving(store: TileStore, tile: int) -> dict[int, tuple[int, int]]:
    """Write the pairs that lead to other tiles, sorted by tile; first and last + 1 of each tile."""
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
    """Write the lists of a tile; `entering` has (tile, begin, end) of pairs that lead here."""
    sources, targets = _pairs(store, tile)
    is_own = store.is_in(tile, targets)
    parts = [(sources, targets), (targets[is_own], sources[is_own])]
    for other, begin, end in entering:
        load, folder = store.scratch.load, f"tile{other}"
        parts.append(
            (load(f"{folder}/out_targets", begin, end), load(f"{folder}/out_sources", begin, end))
        )
    sources, targets = (np.concatenate(column) for column in zip(*parts, strict=True))
    first = np.int32(store.starts[tile])
    offsets, joined = _core.sorted_lists(store.size(tile), sources - first, targets)
    store.write(tile, "neighbors/offsets", offsets)
    store.write(tile, "neighbors/targets", joined)


def _share_areas(store: TileStore, tile: int) -> None:
    """Write the area of each point, which it shares with its copies."""
    offsets, targets = store.read(tile, "neighbors/offsets"), store.read(tile, "neighbors/targets")
    is_copy = store.read_around(tile, "lowest", targets) != NOT_COPIED
    before = np.append(0, np.cumsum(is_copy))
    n_copies = before[offsets[1:]] - before[offsets[:-1]]
    store.write(tile, "shared", store.read(tile, "areas") / (1 + n_copies))


def _follow_lowest(store: TileStore, tile: int) -> None:
    """Copy area and estimated normal from the lowest point at a position to its copies."""
    lowest = store.read(tile, "lowest")
    at = np.flatnonzero(lowest != NOT_COPIED)
    for name, followed in (("shared", "measures"), ("estimated", "normals")):
        if store.has(tile, name):
            values = store.read(tile, name).copy()
            values[at] = store.read_around(tile, name, lowest[at])
            store.write(tile, followed, values)
