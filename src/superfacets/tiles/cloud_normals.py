"""Stage 1 for tiled point clouds: orient the estimated normals consistently."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Array, Bools, Floats, Ints, Longs, Viewpoint
from .._validate import checked_normals
from ..batches.mapping import Run
from ..cells.point_graph import FacingSums, is_open
from .cloud_order import NOT_COPIED
from .part import Part
from .store import TileStore, weighted_sum

PAIRS_AT_ONCE = 1 << 21
"""Approximate number of point pairs, of 25 bytes each, that are in memory at a time. Pairs with the
same cost are always in memory together."""

OF_PAIRS = ("pair_costs", "pair_numbers", "pair_is_opposite")


def turn_normals(store: TileStore, viewpoint: Viewpoint | None) -> None:
    """Flip the normals in ``estimated`` so that normals of neighbors agree, as `segment` does.

    If there is a viewpoint, the normals of each connected component are then flipped to face it.

    Normals are compared along a minimum spanning tree of all pairs of neighbors. Pairs with similar
    normals are joined first, tile by tile. Then all other pairs are joined in the order of their
    costs. The tree takes 5 bytes of memory per point. Sums are computed in curve order.
    """
    sets = _core.TurnedSets(store.n_cells)
    for tile in range(store.n_tiles):
        sets.join_alike(*_normal_tile(store, tile))
    _join_others(store, sets)
    roots = np.concatenate([_roots_of(store, tile, sets) for tile in range(store.n_tiles)])
    _turn_outwards(store, sets, roots)
    if viewpoint is not None:
        _turn_to(store, sets, roots, viewpoint)


def has_open_cloud(store: TileStore, run: Run) -> bool:
    """Return whether the estimated normals indicate that the surface is open."""
    sums = run.all(weighted_sum, store, store.n_tiles, "normals")
    return is_open(np.sum(sums, axis=0), store.total_measure)


def _normal_tile(store: TileStore, tile: int) -> tuple[Ints, Ints, Ints, Floats]:
    """Return the arguments that `_core.TurnedSets` needs for a tile; see C++ `NormalTile`."""
    rows, ghosts = store.rows_of(tile, store.read(tile, "near"))
    own = np.arange(*store.starts[tile : tile + 2], dtype=np.int32)
    numbers, normals = (
        np.concatenate([store.read(tile, name), store.read_at(name, ghosts)])
        for name in ("numbers", "estimated")
    )
    return rows, np.concatenate([own, ghosts]), numbers, normals


def _join_others(store: TileStore, sets: _core.TurnedSets) -> None:
    """Join the pairs of points that `join_alike` has not joined, in the order of costs."""
    n_pairs, samples = [], []
    for tile in range(store.n_tiles):
        costs, numbers, is_opposite = sets.pairs_apart(*_normal_tile(store, tile))
        columns = costs, numbers.reshape(-1, 4), is_opposite
        Part(dict(zip(OF_PAIRS, columns, strict=True))).save(store.scratch, f"tile{tile}")
        n_pairs.append(len(costs))
        samples.append(costs[:: max(1, len(costs) >> 10)])
    n_bins = -(-sum(n_pairs) // PAIRS_AT_ONCE)
    shares = np.arange(1, n_bins) / max(n_bins, 1)
    edges = np.quantile(np.concatenate(samples), shares) if n_bins > 1 else np.empty(0)
    cuts = [
        [0, *np.searchsorted(store.read(tile, "pair_costs"), edges).tolist(), n_pairs[tile]]
        for tile in range(store.n_tiles)
    ]
    for step in range(n_bins):
        parts = [
            Part.load(store.scratch, f"tile{tile}", OF_PAIRS, *cut[step : step + 2])
            for tile, cut in enumerate(cuts)
        ]
        costs, numbers, is_opposite = Part.joined(parts).columns.values()
        order = np.lexsort((numbers[:, 1], numbers[:, 0], costs))
        ends = np.ascontiguousarray(numbers[order, 2:].T)
        sets.unite(ends[0], ends[1], is_opposite[order])
    store.remove_from_all(*OF_PAIRS)


def _turn_outwards(store: TileStore, sets: _core.TurnedSets, roots: Ints) -> None:
    """Flip normals so that they agree in each component, and point out of closed components."""
    tiles = range(store.n_tiles)
    areas, moments, volumes = np.zeros(len(roots)), np.zeros((len(roots), 3)), np.zeros(len(roots))
    for tile in tiles:
        own, is_turned, (measures, positions, normals) = _read_distinct(store, tile, sets, roots)
        np.add.at(areas, own, measures)
        for axis in range(3):
            np.add.at(moments[:, axis], own, measures * positions[:, axis])
        normals[is_turned] *= -1.0  # so that they agree with the normal of the root
        _write_normals(store, tile, normals)
    scales = np.divide(1.0, areas, out=np.zeros_like(areas), where=areas > 0)
    centers = scales[:, None] * moments
    for tile in tiles:  # sum of 3 x the volumes of cones with their apex at the center
        own, _, (measures, positions, normals) = _read_distinct(store, tile, sets, roots)
        has_area = areas[own] > 0
        x, y, z = (normals * (positions - centers[own])).T
        np.add.at(volumes, own[has_area], (measures * (x + y + z))[has_area])
    _flip(store, sets, roots, volumes < 0)


def _turn_to(store: TileStore, sets: _core.TurnedSets, roots: Ints, viewpoint: Viewpoint) -> None:
    """Flip the normals of each component to face the viewpoint, as `estimate_normals` does."""
    tiles = range(store.n_tiles)
    sums = FacingSums.zeros(len(roots))
    for tile in tiles:
        own, _, (measures, positions, normals) = _read_distinct(store, tile, sets, roots)
        sums.add(own, viewpoint, positions, normals, measures)
    _flip(store, sets, roots, sums.is_turned_away(has_one_viewpoint=True))
    for tile in tiles:  # normalized exactly like given normals of a `PointCloud`
        normals = store.read(tile, "estimated")
        store.write(tile, "estimated", checked_normals(normals, len(normals)))


def _flip(store: TileStore, sets: _core.TurnedSets, roots: Ints, is_flipped: Bools) -> None:
    for tile in range(store.n_tiles):
        own, _, (_, _, normals) = _read_distinct(store, tile, sets, roots)
        normals[is_flipped[own]] *= -1.0
        _write_normals(store, tile, normals)


def _roots_of(store: TileStore, tile: int, sets: _core.TurnedSets) -> Ints:
    """Return the curve indices of a tile's points that are roots of connected components."""
    begin, end = store.starts[tile : tile + 2]
    places = np.arange(begin, end, dtype=np.int32)
    is_root = sets.roots(begin, end)[0] == places
    return np.asarray(places[is_root & (store.read(tile, "lowest") == NOT_COPIED)])


def _read_distinct(
    store: TileStore, tile: int, sets: _core.TurnedSets, roots: Ints
) -> tuple[Longs, Bools, list[Array]]:
    """Return components, flip flags, and [areas, positions, normals] of a tile, without copies."""
    root_of, is_turned = sets.roots(*store.starts[tile : tile + 2])
    at = np.flatnonzero(store.read(tile, "lowest") == NOT_COPIED)
    components = np.searchsorted(roots, root_of[at]).astype(np.int64)
    arrays = [store.read(tile, name)[at] for name in ("areas", "positions", "estimated")]
    return components, is_turned[at] != 0, arrays


def _write_normals(store: TileStore, tile: int, normals: Floats) -> None:
    every = np.zeros((store.size(tile), 3))
    every[store.read(tile, "lowest") == NOT_COPIED] = normals
    store.write(tile, "estimated", every)
