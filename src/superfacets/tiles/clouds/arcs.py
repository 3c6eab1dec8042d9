"""Stage 2 for clouds on tiles: the weights of arcs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ... import _core
from ...cells.weights import arc_weights
from ..arcs import ArcFacts, WeightRule, prices_of, round_all, write_arcs
from ..faces import rows
from ..store import Run, TileStore
from .nearest import is_in
from .points import PointCells, Points

__all__ = ["find_point_arcs"]

RINGS = 3
"""Steps from a point to those that weights of its arcs depend on: curvature is fitted to the
normals of neighbors, averaged with theirs, and that of both ends counts."""

NAMES = ("places", "cells", "positions", "measures", "normals")


class _Sums(NamedTuple):
    weights: float
    prices: float


def find_point_arcs(store: TileStore, rule: WeightRule, run: Run) -> ArcFacts:
    """As `find_arcs`, for the lists of a cloud; there are also ``border_lengths``, if needed."""
    tiles = range(store.n_tiles)
    run(_write_rim, store, [(tile,) for tile in tiles])
    sums: list[_Sums] = run(_weigh_tile, store, [(tile, rule) for tile in tiles])
    unit, price_unit = round_all(store, rule, sums, run)
    for tile in tiles:
        for name in ("rim", "list_offsets", "list_targets", "normals"):
            store.remove(tile, name)
    return ArcFacts(rule, unit, price_unit, 0.0)


def _read_points(store: TileStore, tile: int) -> Points:
    """All points of a tile."""
    begin, end = store.starts[tile], store.starts[tile + 1]
    columns = {name: store.read(tile, name) for name in NAMES[1:]}
    columns["places"] = np.arange(begin, end, dtype=np.int32)
    return Points(
        columns, store.read(tile, "list_offsets"), {"targets": store.read(tile, "list_targets")}
    )


def _write_rim(store: TileStore, tile: int) -> None:
    """Write the points of a tile that are within so many steps of another tile."""
    points = _read_points(store, tile)
    first, n_own = store.starts[tile], len(points)
    targets = points.arcs["targets"] - first
    sources = np.repeat(np.arange(n_own), np.diff(points.offsets))
    is_own = (targets >= 0) & (targets < n_own)
    is_rim = np.zeros(n_own, bool)
    is_rim[sources[~is_own]] = True
    sources, targets = sources[is_own], targets[is_own]
    for _ in range(RINGS - 1):
        is_rim[targets[is_rim[sources]]] = True  # arcs lead both ways
    points.take(np.flatnonzero(is_rim)).save(store, tile, "rim")


def _with_rings(store: TileStore, tile: int) -> Points:
    """The points of a tile, and those around it; the outermost without arcs."""
    parts = [_read_points(store, tile)]
    known = np.empty(0, np.int32)  # of other tiles
    for ring in range(RINGS):
        targets = parts[-1].arcs["targets"]
        places = np.setdiff1d(targets[~is_in(store, tile, targets)], known)
        if not len(places):
            break
        tiles = store.tiles_of(places)
        found = [
            Points.load(store, other, "rim", NAMES).at(places[tiles == other])
            for other in np.unique(tiles).tolist()
        ]
        points = Points.joined(found)
        if ring == RINGS - 1:
            points = Points(points.columns, np.zeros_like(points.offsets), _NO_ARCS)
        parts.append(points)
        known = np.concatenate([known, places])
    return Points.joined(parts)


_NO_ARCS = {"targets": np.empty(0, np.int32)}


def _weigh_tile(store: TileStore, tile: int, rule: WeightRule) -> _Sums:
    points = _with_rings(store, tile)
    cells = PointCells.of(store, points, rule.n_threads)
    surface = cells.surface
    weights = np.asarray(arc_weights(surface, surface, rule.radius, rule.options))
    at = np.empty(len(points), np.int64)  # the cell of each point
    at[cells.order] = np.arange(len(points))
    places, numbers = points.columns["places"], points.columns["cells"]
    own = at[is_in(store, tile, places)]
    offsets, arcs = rows(surface.offsets, own)
    write_arcs(store, tile, offsets, places, numbers, cells.order[surface.neighbors[arcs]])
    store.write(tile, "weights", weights[arcs])
    prices = 0.0
    if rule.has_prices:
        default = prices_of(surface, rule)[arcs]
        store.write(tile, "prices", default)
        prices = _core.sum_of(default, rule.n_threads)
    return _Sums(_core.sum_of(weights[arcs], rule.n_threads), prices)
