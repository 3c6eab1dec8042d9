"""Stage 1 for clouds on tiles: the nearest neighbors of all points, areas and directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ... import _core
from ...cells.point_graph import CUTOFF, N_AROUND, N_NEIGHBORS
from ..arrays import is_among
from ..store import RANGE, Run, TileStore
from .sorting import NOT_COPIED, SortedCloud

__all__ = ["find_neighbors"]

Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


ROWS_AT_ONCE = 1 << 16
"""Lists of neighbors that are merged at a time, 1 KB each."""


def find_neighbors(cloud: SortedCloud, tile_cells: int, run: Run, n_threads: int) -> None:
    """Write the nearest neighbors of the points of all tiles, as in memory.

    Per tile: ``near`` (n, 6) int32, places of the nearest points, nearest first, -1 where one is
    too far away or there is none; ``areas`` (n,) float64; and, if normals are not given,
    ``normals`` (n, 3), of either sign. Copies have none of these.
    """
    store = cloud.store
    tiles = range(store.n_tiles)
    wants_normals = not cloud.has_normals
    jobs = [(tile, cloud.boxes, tile_cells, wants_normals, n_threads) for tile in tiles]
    run(_find_nearest, store, jobs)
    run(_cut_off, store, [(tile,) for tile in tiles])
    for tile in tiles:
        for name in ("found", "squared", "all_areas"):
            store.remove(tile, name)


@dataclass(eq=False)
class _Lists:
    """The nearest points found so far, row by row: nearest first, the lowest among equals.

    Attributes
    ----------
    squared : ndarray of float64, shape (n, k)
        Distances; infinite where there is none.
    numbers, places : ndarray of int32, shape (n, k)
        In the input, and on the curve; -1 where there is none.
    """

    squared: Floats
    numbers: Ints
    places: Ints

    def take(self, rows: slice) -> _Lists:
        """Some rows."""
        return _Lists(self.squared[rows], self.numbers[rows], self.places[rows])

    def merge(self, rows: Longs, others: _Lists) -> None:
        """Take the nearest of some rows and of others; a point may be in both."""
        squared = np.concatenate([self.squared[rows], others.squared], axis=1)
        numbers = np.concatenate([self.numbers[rows], others.numbers], axis=1)
        places = np.concatenate([self.places[rows], others.places], axis=1)
        order = np.lexsort((numbers, squared), axis=1)
        squared, numbers, places = (
            np.take_along_axis(column, order, axis=1) for column in (squared, numbers, places)
        )
        is_again = np.zeros(numbers.shape, bool)
        is_again[:, 1:] = numbers[:, 1:] == numbers[:, :-1]
        first = np.argsort(is_again | (numbers < 0), axis=1, kind="stable")
        first = first[:, : self.numbers.shape[1]]
        is_none = np.take_along_axis(is_again | (numbers < 0), first, axis=1)
        self.squared[rows] = np.where(is_none, np.inf, np.take_along_axis(squared, first, axis=1))
        self.numbers[rows] = np.where(is_none, -1, np.take_along_axis(numbers, first, axis=1))
        self.places[rows] = np.where(is_none, -1, np.take_along_axis(places, first, axis=1))


@dataclass(frozen=True, eq=False)
class _Points:
    """Points at different positions, in the order of their numbers."""

    numbers: Ints
    places: Ints
    positions: Floats

    @classmethod
    def read(cls, store: TileStore, tile: int, begin: int, end: int) -> _Points:
        """Those at some places of a tile."""
        numbers, lowest, positions = (
            store.scratch.load(f"tile{tile}/{name}", begin, end)
            for name in ("numbers", "lowest", "positions")
        )
        at = np.flatnonzero(lowest == NOT_COPIED)
        places = (at + (store.starts[tile] + begin)).astype(np.int32)
        return cls.joined([cls(numbers[at], places, positions[at])])

    @classmethod
    def joined(cls, parts: list[_Points]) -> _Points:
        """All points of some parts."""
        numbers = np.concatenate([part.numbers for part in parts])
        order = np.argsort(numbers)
        return cls(
            numbers[order],
            np.concatenate([part.places for part in parts])[order],
            np.concatenate([part.positions for part in parts])[order],
        )

    def take(self, at: Longs) -> _Points:
        """Some of them, ascending."""
        return _Points(self.numbers[at], self.places[at], self.positions[at])

    def nearest(self, is_wanted: npt.NDArray[np.bool_], n_nearest: int, n_threads: int) -> _Lists:
        """The nearest of all for each that is wanted."""
        if not is_wanted.any():
            none = np.empty((0, n_nearest), np.int32)
            return _Lists(np.empty((0, n_nearest)), none, none)
        rows, squared = _core.nearest_in_part(
            self.positions, is_wanted.astype(np.uint8), n_nearest, n_threads
        )
        is_none = rows < 0
        numbers, places = self.numbers[rows], self.places[rows]
        numbers[is_none], places[is_none] = -1, -1
        shape = (-1, n_nearest)
        return _Lists(squared.reshape(shape), numbers.reshape(shape), places.reshape(shape))


def _find_nearest(
    store: TileStore, tile: int, boxes: Floats, most: int, wants_normals: bool, n_threads: int
) -> None:
    """Write the nearest points of those of a tile, their distances, areas, and directions."""
    n_nearest = N_AROUND if wants_normals else N_NEIGHBORS
    own = _Points.read(store, tile, 0, store.size(tile))
    lists = own.nearest(np.ones(len(own.numbers), bool), n_nearest, n_threads)
    foreign = [own.take(np.empty(0, np.int64))]
    members = _members(store, tile, own)
    ranges = _ranges_in_reach(store, tile, members, lists, boxes)
    while len(ranges):
        # The nearest ones lower the distances, so that others are out of reach.
        batch, ranges = ranges[: max(1, most // RANGE)], ranges[max(1, most // RANGE) :]
        is_open = _is_in_reach(own, members, lists, boxes[batch])
        if is_open.any():
            others = _Points.joined(
                [_read_range(store, place) for place in np.sort(batch).tolist()]
            )
            rows = np.flatnonzero(is_open)
            both = _Points.joined([own.take(rows), others])
            nearer = both.nearest(store.is_in(tile, both.places), n_nearest, n_threads)
            for begin in range(0, len(rows), ROWS_AT_ONCE):
                some = slice(begin, begin + ROWS_AT_ONCE)
                lists.merge(rows[some], nearer.take(some))
            found = lists.places[rows]
            found = np.unique(found[~store.is_in(tile, found)])
            foreign.append(others.take(np.flatnonzero(is_among(others.places, found))))
    _write_lists(store, tile, own, lists)
    if wants_normals:
        _write_directions(store, tile, own, lists, _Points.joined(foreign), n_threads)


def _write_directions(
    store: TileStore, tile: int, own: _Points, lists: _Lists, foreign: _Points, n_threads: int
) -> None:
    """Write the direction in which the points around each vary least, as a normal."""
    first, n_own = store.starts[tile], store.size(tile)
    order = np.argsort(foreign.places)
    rows = lists.places - np.int32(first)
    is_foreign = (lists.places >= 0) & ~store.is_in(tile, lists.places)
    rows[lists.places < 0] = -1
    rows[is_foreign] = n_own + np.searchsorted(
        foreign.places, lists.places[is_foreign], sorter=order
    )
    positions = np.concatenate([store.read(tile, "positions"), foreign.positions[order]])
    at = own.places - np.int32(first)
    normals = np.zeros((n_own, 3))
    normals[at] = _core.directions_around(positions, at, rows.reshape(-1), n_threads)
    store.write(tile, "normals", normals)


def _write_lists(store: TileStore, tile: int, own: _Points, lists: _Lists) -> None:
    n_points, at = store.size(tile), own.places - store.starts[tile]
    found = np.full((n_points, N_NEIGHBORS), -1, np.int32)
    squared = np.full((n_points, N_NEIGHBORS), np.inf)
    found[at] = lists.places[:, :N_NEIGHBORS]
    squared[at] = lists.squared[:, :N_NEIGHBORS]
    store.write(tile, "found", found)
    store.write(tile, "squared", squared)
    store.write(tile, "all_areas", _areas_around(squared))


def _areas_around(squared: Floats) -> Floats:
    """The area around each point, from squared distances in rising order; infinite ones are none.

    The same bits as `area_around` of the core.
    """
    sums = np.zeros(len(squared))
    for column in squared.T:
        sums += np.where(np.isinf(column), 0.0, column)
    counts = np.count_nonzero(~np.isinf(squared), axis=1).astype(np.float64)
    areas = np.zeros(len(squared))
    np.divide(2.0 * np.pi * sums, counts * (counts + 1.0), out=areas, where=counts > 0)
    return areas


def _members(store: TileStore, tile: int, own: _Points) -> list[Longs]:
    """The points of each range of a tile, as indices."""
    ranges = (own.places - store.starts[tile]) // RANGE
    order = np.argsort(ranges, kind="stable")
    n_ranges = -(-store.size(tile) // RANGE)
    return np.split(order, np.searchsorted(ranges[order], np.arange(1, n_ranges)))


def _gaps(a: Floats, b: Floats) -> Floats:
    """Squared distances of boxes (..., 2, 3): never more than that of two points in them."""
    gaps = np.maximum(np.maximum(b[..., 0, :] - a[..., 1, :], a[..., 0, :] - b[..., 1, :]), 0.0)
    x, y, z = gaps[..., 0], gaps[..., 1], gaps[..., 2]
    return np.asarray(x * x + y * y + z * z)


def _ranges_in_reach(
    store: TileStore, tile: int, members: list[Longs], lists: _Lists, boxes: Floats
) -> Longs:
    """Ranges of other tiles that may have a point nearer than those found, the nearest first."""
    first = store.starts[tile] // RANGE
    nearest = np.full(len(boxes), np.inf)
    for place, rows in enumerate(members, first):
        if len(rows):
            gaps = _gaps(boxes[place], boxes)
            is_near = gaps <= lists.squared[rows, -1].max()
            nearest[is_near] = np.minimum(nearest[is_near], gaps[is_near])
    nearest[first : first + len(members)] = np.inf
    return np.argsort(nearest, kind="stable")[: np.count_nonzero(np.isfinite(nearest))]


def _is_in_reach(
    own: _Points, members: list[Longs], lists: _Lists, boxes: Floats
) -> npt.NDArray[np.bool_]:
    """Whether one of some boxes may have a point nearer to each than those found."""
    points = np.stack([own.positions, own.positions], axis=1)
    is_open = np.zeros(len(points), bool)
    for rows in members:
        if not len(rows):
            continue
        reach = lists.squared[rows, -1]
        whole = np.array([points[rows, 0].min(axis=0), points[rows, 0].max(axis=0)])
        for box in boxes[_gaps(whole, boxes) <= reach.max()]:
            is_open[rows] |= _gaps(points[rows], box) <= reach
    return is_open


def _read_range(store: TileStore, place: int) -> _Points:
    """The points of a range of the curve."""
    first = place * RANGE
    tile = int(store.tiles_of(np.array([first]))[0])
    begin = first - store.starts[tile]
    return _Points.read(store, tile, begin, min(begin + RANGE, store.size(tile)))


def _cut_off(store: TileStore, tile: int) -> None:
    """Drop neighbors that are too far away, and write areas without them."""
    found, squared = (store.read(tile, name).copy() for name in ("found", "squared"))
    areas = store.read(tile, "all_areas")
    others = np.zeros(found.shape)
    is_own = store.is_in(tile, found)
    others[is_own] = areas[found[is_own] - store.starts[tile]]
    is_ghost = (found >= 0) & ~is_own
    ghosts = np.unique(found[is_ghost])
    of_ghosts = store.read_at("all_areas", ghosts)
    others[is_ghost] = of_ghosts[np.searchsorted(ghosts, found[is_ghost])]
    is_dropped = squared > CUTOFF * CUTOFF * np.minimum(areas[:, None], others)
    found[is_dropped] = -1
    squared[is_dropped] = np.inf
    store.write(tile, "near", found)
    store.write(tile, "areas", _areas_around(squared))
