"""Stage 1 for clouds on tiles: nearest neighbors of all points, areas, and raw normals."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Bools, Floats, Ints, Longs
from ..cells.point_graph import CUTOFF, N_AROUND, N_NEIGHBORS
from .arrays import box_of, is_among
from .cloud_order import NOT_COPIED, SortedCloud
from .mapping import run_all
from .part import Part
from .store import RANGE, Run, TileStore


def find_neighbors(cloud: SortedCloud, tile_cells: int, run: Run, n_threads: int) -> None:
    """Write the nearest neighbors of all points, tile by tile: the neighbors found by `segment`.

    Per tile: ``near`` (n, 6) int32, places of the nearest points, nearest first, -1 where there is
    none or it is too far away; ``areas`` (n,) float64; and, if the cloud has no normals,
    ``estimated`` normals (n, 3) of either sign. Rows of copies are empty: -1 or 0.
    """
    store, at_once = cloud.store, max(1, tile_cells // RANGE)
    args = cloud.boxes, at_once, not cloud.has_normals, n_threads
    run_all(run, _find_nearest, store, store.n_tiles, *args)
    run_all(run, _cut_off, store, store.n_tiles)
    store.remove_from_all("found", "squared", "all_areas")


def _find_nearest(
    store: TileStore, tile: int, boxes: Floats, at_once: int, wants_normals: bool, n_threads: int
) -> None:
    """Write the nearest points of the points of a tile, their distances, areas, and directions.

    The search begins in the tile. It goes on in ranges of the curve whose boxes may hold nearer
    points, nearest boxes first: points found there shorten the reach, and rule out farther boxes.
    """
    n_nearest = N_AROUND if wants_normals else N_NEIGHBORS
    own = _read_apart(store, tile)
    places, squared = _nearest(own, np.ones(len(own), bool), n_nearest, n_threads)
    known = own  # and the points of other tiles found so far
    members = _by_range(store, tile, own)
    ranges = _ranges_in_reach(store, tile, members, squared[:, -1], boxes)
    while len(ranges):
        batch, ranges = ranges[:at_once], ranges[at_once:]
        is_open = _is_in_reach(own, members, squared[:, -1], boxes[batch])
        if not is_open.any():
            continue
        others = [_read_range(store, place) for place in np.sort(batch).tolist()]
        every = Part.joined([known, *others], "numbers")
        is_wanted = is_among(every.columns["numbers"], own.columns["numbers"][is_open])
        places[is_open], squared[is_open] = _nearest(every, is_wanted, n_nearest, n_threads)
        found = np.unique(places[~store.is_in(tile, places)])
        all_places = every.columns["places"]
        is_known = store.is_in(tile, all_places) | is_among(all_places, found)
        known = every.take(np.flatnonzero(is_known))
    _write_lists(store, tile, own, places, squared)
    if wants_normals:
        _write_directions(store, tile, own, places, known, n_threads)


def _read_apart(store: TileStore, tile: int, begin: int = 0, end: int | None = None) -> Part:
    """Points of a tile that are no copies, in the order of their numbers."""
    names = ("numbers", "lowest", "positions")
    points = Part.of_tile(store, tile, names, begin=begin, end=end)
    is_apart = points.columns.pop("lowest") == NOT_COPIED
    return Part.joined([points.take(np.flatnonzero(is_apart))], "numbers")


def _read_range(store: TileStore, place: int) -> Part:
    """Points of a range of the curve that are no copies, in the order of their numbers."""
    first = place * RANGE
    tile = int(store.tiles_of(np.array([first]))[0])
    begin = first - store.starts[tile]
    return _read_apart(store, tile, begin, min(begin + RANGE, store.size(tile)))


def _nearest(points: Part, is_wanted: Bools, n: int, n_threads: int) -> tuple[Ints, Floats]:
    """Places of the n nearest points of each wanted point, and their squared distances.

    Sorted by distance, then by number; -1 and infinity where there are fewer than n.
    """
    if not is_wanted.any():
        return np.empty((0, n), np.int32), np.empty((0, n))
    rows, squared = _core.nearest_in_part(
        points.columns["positions"], is_wanted.view(np.uint8), n, n_threads
    )
    places = np.append(points.columns["places"], np.int32(-1))[rows]
    return places.reshape(-1, n), squared.reshape(-1, n)


def _write_lists(store: TileStore, tile: int, own: Part, places: Ints, squared: Floats) -> None:
    n_points, at = store.size(tile), own.columns["places"] - store.starts[tile]
    found = np.full((n_points, N_NEIGHBORS), -1, np.int32)
    all_squared = np.full((n_points, N_NEIGHBORS), np.inf)
    found[at] = places[:, :N_NEIGHBORS]
    all_squared[at] = squared[:, :N_NEIGHBORS]
    store.write(tile, "found", found)
    store.write(tile, "squared", all_squared)
    store.write(tile, "all_areas", _areas_around(all_squared))


def _write_directions(
    store: TileStore, tile: int, own: Part, places: Ints, known: Part, n_threads: int
) -> None:
    """Write raw normals: the direction in which the nearest points of each point vary least."""
    rows, ghosts = store.rows_of(tile, places)
    foreign = Part.joined([known], "places").at(ghosts)
    positions = np.concatenate([store.read(tile, "positions"), foreign.columns["positions"]])
    at = own.columns["places"] - np.int32(store.starts[tile])
    normals = np.zeros((store.size(tile), 3))
    normals[at] = _core.directions_around(positions, at, rows.reshape(-1), n_threads)
    store.write(tile, "estimated", normals)


def _areas_around(squared: Floats) -> Floats:
    """The area around each point from squared distances, bit for bit as `area_around` of the core.

    Distances ascend in each row, and are infinite where there is no neighbor.
    """
    sums, is_none = np.zeros(len(squared)), np.isinf(squared)
    for column in np.where(is_none, 0.0, squared).T:
        sums += column
    counts = np.count_nonzero(~is_none, axis=1).astype(np.float64)
    areas = np.zeros(len(squared))
    np.divide(2.0 * np.pi * sums, counts * (counts + 1.0), out=areas, where=counts > 0)
    return areas


def _by_range(store: TileStore, tile: int, own: Part) -> list[Longs]:
    """Indices of the points of each range of a tile."""
    ranges = (own.columns["places"] - store.starts[tile]) // RANGE
    order = np.argsort(ranges, kind="stable")
    n_ranges = -(-store.size(tile) // RANGE)
    return np.split(order, np.searchsorted(ranges[order], np.arange(1, n_ranges)))


def _gaps(a: Floats, b: Floats) -> Floats:
    """Squared distances of boxes (..., 2, 3) or points (..., 1, 3)."""
    gaps = np.maximum(np.maximum(b[..., 0, :] - a[..., -1, :], a[..., 0, :] - b[..., -1, :]), 0.0)
    x, y, z = gaps[..., 0], gaps[..., 1], gaps[..., 2]
    return np.asarray(x * x + y * y + z * z)


def _ranges_in_reach(
    store: TileStore, tile: int, members: list[Longs], reach: Floats, boxes: Floats
) -> Longs:
    """Ranges of other tiles that may hold a point within reach, sorted by distance."""
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
    """Whether any of the boxes may hold a point within reach of each point."""
    positions, is_open = own.columns["positions"], np.zeros(len(own), bool)
    for rows in (some for some in members if len(some)):
        points = positions[rows]
        for box in boxes[_gaps(box_of(points), boxes) <= reach[rows].max()]:
            is_open[rows] |= _gaps(points[:, np.newaxis], box) <= reach[rows]
    return is_open


def _cut_off(store: TileStore, tile: int) -> None:
    """Drop neighbors too far away for the areas of both ends; write the areas of the rest."""
    found, squared = (store.read(tile, name).copy() for name in ("found", "squared"))
    areas = store.read(tile, "all_areas")
    others = np.zeros(found.shape)
    others[found >= 0] = store.read_around(tile, "all_areas", found[found >= 0])
    is_dropped = squared > CUTOFF * CUTOFF * np.minimum(areas[:, None], others)
    found[is_dropped] = -1
    squared[is_dropped] = np.inf
    store.write(tile, "near", found)
    store.write(tile, "areas", _areas_around(squared))
