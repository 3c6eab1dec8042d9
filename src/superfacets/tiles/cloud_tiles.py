"""Stage 1 for tiled point clouds: find the neighbors, area and normal of each point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import _core
from .._types import Bools, Floats, Ints, Longs
from ..batches.mapping import Run
from ..cells.point_graph import CUTOFF, N_AROUND, N_NEIGHBORS
from ..cells.weights import NO_NORMALS
from ..io.readers.pieces import Pieces
from ..workers.scratch import Scratch
from ..workers.threads import Job
from .arrays import box_of, is_among
from .cloud_normals import turn_normals
from .cloud_order import NOT_COPIED, sort_cloud
from .part import Part
from .store import RANGE, TileStore

LEFTOVERS = ("axes", "near", "areas", "shared", "estimated", "lowest", "out_sources", "out_targets")
"""Names of temporary arrays, which `make_cloud_tiles` finally removes."""


def make_cloud_tiles(
    pieces: Pieces, scratch: Scratch, tile_cells: int, *, run: Run, n_threads: int
) -> TileStore:
    """Write a cloud as tiles, with the same neighbors, areas and normals as `build_point_graph`.

    Tiles have at most `tile_cells` points, rounded up to a multiple of `RANGE`. `n_threads` is the
    number of threads used for each tile. Raises the errors of `sort_cloud`.
    """
    store, boxes = sort_cloud(pieces, scratch, tile_cells, run, n_threads)
    at_once, wants_normals = max(1, tile_cells // RANGE), pieces.normals is None
    run.all(_find_nearest, store, store.n_tiles, boxes, at_once, wants_normals, n_threads)
    run.all(_cut_off, store, store.n_tiles)
    store.remove_from_all("found", "squared", "all_areas")
    if wants_normals:
        turn_normals(store, pieces.viewpoint)
    tiles = range(store.n_tiles)
    leaving = run.all(_write_leaving, store, store.n_tiles)
    jobs: list[Job] = [
        (tile, [(other, *found[tile]) for other, found in enumerate(leaving) if tile in found])
        for tile in tiles
    ]
    run(_join, store, jobs)
    run.all(_share_areas, store, store.n_tiles)
    run.all(_follow_lowest, store, store.n_tiles)
    store.remove_from_all(*LEFTOVERS)
    measures = np.empty(store.n_cells)  # by cell number, because sums are computed in this order
    for tile in tiles:
        measures[store.read(tile, "cells")] = store.read(tile, "measures")
    return replace(store, total_measure=_core.sum_of(measures, n_threads))


def _pairs(store: TileStore, tile: int) -> tuple[Ints, Ints]:
    """Return the pairs (point, neighbor) and (copy, lowest point at its position) of a tile.

    The result is two arrays of curve indices: the first points of the pairs, which are in the tile,
    and the second points, which may be in any tile.
    """
    near, lowest = store.read(tile, "near"), store.read(tile, "lowest")
    rows, columns = np.nonzero(near >= 0)
    copies = np.flatnonzero(lowest != NOT_COPIED)
    sources = np.concatenate([rows, copies]).astype(np.int32)
    targets = np.concatenate([near[rows, columns], lowest[copies]])
    return sources + np.int32(store.starts[tile]), targets


def _write_leaving(store: TileStore, tile: int) -> dict[int, tuple[int, int]]:
    """Write the pairs whose second point is in another tile, sorted by this tile.

    Returns, for each other tile, the first row of its pairs, and the row after the last.
    """
    sources, targets = _pairs(store, tile)
    tiles = store.tiles_of(targets)
    leaves = np.flatnonzero(tiles != tile)
    leaves = leaves[np.argsort(tiles[leaves], kind="stable")]
    store.write(tile, "out_sources", sources[leaves])
    store.write(tile, "out_targets", targets[leaves])
    others, firsts, counts = np.unique(tiles[leaves], return_index=True, return_counts=True)
    found = zip(others.tolist(), firsts.tolist(), counts.tolist(), strict=True)
    return {other: (first, first + count) for other, first, count in found}


def _join(store: TileStore, tile: int, entering: list[tuple[int, int, int]]) -> None:
    """Write the neighbors of the points of a tile, from all pairs with a point in the tile.

    `entering` lists (tile, first row, end) of the pairs that other tiles wrote for this tile.
    """
    sources, targets = _pairs(store, tile)
    is_own = store.is_in(tile, targets)
    parts = [(sources, targets), (targets[is_own], sources[is_own])]
    for other, *ends in entering:
        names = "out_targets", "out_sources"
        columns = Part.load(store.scratch, f"tile{other}", names, *ends).columns
        parts.append((columns["out_targets"], columns["out_sources"]))
    sources, targets = (np.concatenate(column) for column in zip(*parts, strict=True))
    first = np.int32(store.starts[tile])
    offsets, joined = _core.sorted_lists(store.size(tile), sources - first, targets)
    store.write(tile, "neighbors/offsets", offsets)
    store.write(tile, "neighbors/targets", joined)


def _share_areas(store: TileStore, tile: int) -> None:
    """Write the area of each point, divided by the number of points at its position."""
    offsets, targets = store.read(tile, "neighbors/offsets"), store.read(tile, "neighbors/targets")
    is_copy = store.read_around(tile, "lowest", targets) != NOT_COPIED
    before = np.append(0, np.cumsum(is_copy))
    n_copies = before[offsets[1:]] - before[offsets[:-1]]
    store.write(tile, "shared", store.read(tile, "areas") / (1 + n_copies))


def _follow_lowest(store: TileStore, tile: int) -> None:
    """Write areas and normals. A copy gets the values of the lowest point at its position."""
    lowest = store.read(tile, "lowest")
    at = np.flatnonzero(lowest != NOT_COPIED)
    for name, followed in (("shared", "measures"), ("estimated", "normals")):
        if store.has(tile, name):
            values = store.read(tile, name).copy()
            values[at] = store.read_around(tile, name, lowest[at])
            store.write(tile, followed, values)


def _find_nearest(
    store: TileStore, tile: int, boxes: Floats, at_once: int, wants_normals: bool, n_threads: int
) -> None:
    """Write nearest points of a tile's points, squared distances, areas and, if wanted, normals.

    The search starts in the tile. It continues in ranges of other tiles, in the order of distance
    of their bounding boxes in `boxes`, with `at_once` ranges at a time. The search radius of a
    point shrinks when nearer points are found, so distant boxes are skipped.
    """
    n_nearest = N_AROUND if wants_normals else N_NEIGHBORS
    own = _read_distinct(store, *store.starts[tile : tile + 2])
    places, squared = _nearest(own, np.ones(len(own), bool), n_nearest, n_threads)
    known = own  # points of the tile, and nearest points found in other tiles
    members = _by_range(store, tile, own)
    ranges = _ranges_in_reach(store, tile, members, squared[:, -1], boxes)
    while len(ranges):
        batch, ranges = ranges[:at_once], ranges[at_once:]
        is_open = _is_in_reach(own, members, squared[:, -1], boxes[batch])
        if not is_open.any():
            continue
        begins = (RANGE * np.sort(batch)).tolist()
        others = [_read_distinct(store, at, min(at + RANGE, store.n_cells)) for at in begins]
        every = Part.joined([known, *others], "numbers")
        is_wanted = is_among(every.columns["numbers"], own.columns["numbers"][is_open])
        places[is_open], squared[is_open] = _nearest(every, is_wanted, n_nearest, n_threads)
        nearest = np.unique(places[~store.is_in(tile, places)])
        all_places = every.columns["places"]
        is_known = store.is_in(tile, all_places) | is_among(all_places, nearest)
        known = every.take(np.flatnonzero(is_known))
    at = own.columns["places"] - store.starts[tile]
    found = np.full((store.size(tile), N_NEIGHBORS), -1, np.int32)
    all_squared = np.full((store.size(tile), N_NEIGHBORS), np.inf)
    found[at], all_squared[at] = places[:, :N_NEIGHBORS], squared[:, :N_NEIGHBORS]
    columns = {"found": found, "squared": all_squared, "all_areas": _areas_around(all_squared)}
    Part(columns).save(store.scratch, f"tile{tile}")
    if wants_normals:
        _write_directions(store, tile, own, places, known, n_threads)


def _read_distinct(store: TileStore, begin: int, end: int) -> Part:
    """Return points with curve indices `begin` to `end` - 1, without copies, sorted by number."""
    tile = int(store.tiles_of(np.array([begin]))[0])
    names, first = ("numbers", "lowest", "positions"), store.starts[tile]
    points = Part.of_tile(store, tile, names, begin - first, end - first)
    is_apart = points.columns.pop("lowest") == NOT_COPIED
    return Part.joined([points.take(np.flatnonzero(is_apart))], "numbers")


def _nearest(points: Part, is_wanted: Bools, n: int, n_threads: int) -> tuple[Ints, Floats]:
    """Return the curve indices and squared distances of the n nearest points of each wanted point.

    Each row is sorted by distance, then by number. If there are fewer than n points, the row is
    filled with index -1 and distance infinity.
    """
    if not is_wanted.any():
        return np.empty((0, n), np.int32), np.empty((0, n))
    rows, squared = _core.nearest_in_part(
        points.columns["positions"], is_wanted.view(np.uint8), n, n_threads
    )
    places = np.append(points.columns["places"], np.int32(-1))[rows]
    return places.reshape(-1, n), squared.reshape(-1, n)


def _write_directions(
    store: TileStore, tile: int, own: Part, places: Ints, known: Part, n_threads: int
) -> None:
    """Write normals with arbitrary sign: the direction in which nearest points vary least.

    If the input has ``axes`` (normals with unknown sign), the normal is the mean of the axes of the
    nearest points instead.
    """
    rows, ghosts = store.rows_of(tile, places)
    foreign = Part.joined([known], "places").at(ghosts)
    positions = np.concatenate([store.read(tile, "positions"), foreign.columns["positions"]])
    at = own.columns["places"] - np.int32(store.starts[tile])
    normals = np.zeros((store.size(tile), 3))
    axes = NO_NORMALS
    if store.has(tile, "axes"):
        axes = np.concatenate([store.read(tile, "axes"), store.read_at("axes", ghosts)])
    normals[at] = _core.directions_around(positions, axes, at, rows.reshape(-1), n_threads)
    store.write(tile, "estimated", normals)


def _areas_around(squared: Floats) -> Floats:
    """Return the area of each point, computed from squared distances like C++ `area_around`.

    Each row contains the distances of the neighbors of a point, in ascending order. Missing
    neighbors have an infinite distance.
    """
    sums, is_none = np.zeros(len(squared)), np.isinf(squared)
    for column in np.where(is_none, 0.0, squared).T:
        sums += column
    counts = np.count_nonzero(~is_none, axis=1).astype(np.float64)
    areas = np.zeros(len(squared))
    np.divide(2.0 * np.pi * sums, counts * (counts + 1.0), out=areas, where=counts > 0)
    return areas


def _by_range(store: TileStore, tile: int, own: Part) -> list[Longs]:
    """Return the rows of `own` that are in each range of the tile, as one array per range."""
    ranges = (own.columns["places"] - store.starts[tile]) // RANGE
    order = np.argsort(ranges, kind="stable")
    n_ranges = -(-store.size(tile) // RANGE)
    return np.split(order, np.searchsorted(ranges[order], np.arange(1, n_ranges)))


def _gaps(a: Floats, b: Floats) -> Floats:
    """Return squared distances between boxes, (..., 2, 3), or points, (..., 1, 3), in a and b."""
    gaps = np.maximum(np.maximum(b[..., 0, :] - a[..., -1, :], a[..., 0, :] - b[..., -1, :]), 0.0)
    x, y, z = gaps[..., 0], gaps[..., 1], gaps[..., 2]
    return np.asarray(x * x + y * y + z * z)


def _ranges_in_reach(
    store: TileStore, tile: int, members: list[Longs], reach: Floats, boxes: Floats
) -> Longs:
    """Return the ranges of other tiles that are within reach of a point of the tile, nearest first.

    `reach` contains the squared search radius of each point, and `members` the points per range.
    """
    first = store.starts[tile] // RANGE
    nearest = np.full(len(boxes), np.inf)
    for place, rows in enumerate(members, first):
        if len(rows):
            gaps = _gaps(boxes[place], boxes)
            is_near = gaps <= reach[rows].max()
            nearest[is_near] = np.minimum(nearest[is_near], gaps[is_near])
    nearest[first : first + len(members)] = np.inf
    return np.argsort(nearest, kind="stable")[: np.count_nonzero(np.isfinite(nearest))]


def _is_in_reach(own: Part, members: list[Longs], reach: Floats, boxes: Floats) -> Bools:
    """Return, for each point in `own`, whether any of the boxes is within its search radius.

    `reach` contains squared search radii.
    """
    positions, is_open = own.columns["positions"], np.zeros(len(own), bool)
    for rows in (some for some in members if len(some)):
        points = positions[rows]
        for box in boxes[_gaps(box_of(points), boxes) <= reach[rows].max()]:
            is_open[rows] |= _gaps(points[:, np.newaxis], box) <= reach[rows]
    return is_open


def _cut_off(store: TileStore, tile: int) -> None:
    """Drop neighbors that are farther away than the cutoff.

    The cutoff is `CUTOFF` times the square root of the smaller of the two areas. Writes ``near``,
    (n, 6): the curve indices of neighbors, nearest first, with -1 for dropped neighbors. Also
    writes ``areas``, computed without dropped neighbors. Copies have no neighbors and area 0.
    """
    found, squared = (store.read(tile, name).copy() for name in ("found", "squared"))
    areas = store.read(tile, "all_areas")
    others = np.zeros(found.shape)
    others[found >= 0] = store.read_around(tile, "all_areas", found[found >= 0])
    is_dropped = squared > CUTOFF * CUTOFF * np.minimum(areas[:, None], others)
    found[is_dropped] = -1
    squared[is_dropped] = np.inf
    store.write(tile, "near", found)
    store.write(tile, "areas", _areas_around(squared))
