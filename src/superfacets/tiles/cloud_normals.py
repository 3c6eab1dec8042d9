"""Stage 1 for clouds on tiles: normals that agree with each other."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Array, Bools, Floats, Ints, Longs
from .cloud_order import NOT_COPIED
from .part import Part
from .store import TileStore

PAIRS_AT_ONCE = 1 << 21
"""Pairs that are read and sorted at a time, 25 bytes each; more only if they have one cost."""

OF_PAIRS = ("pair_costs", "pair_numbers", "pair_is_opposite")


def turn_normals(store: TileStore) -> None:
    """Turn the directions in ``estimated`` so that neighbors agree, as `segment` turns them.

    The result is a minimum spanning tree over one order of all pairs of neighbors: first pairs with
    similar normals, tile by tile; then all others by cost. The tree is held in this process, 5
    bytes a point. Sums over components are added in the order of places.
    """
    tiles = range(store.n_tiles)
    sets = _core.TurnedSets(store.n_cells)
    for tile in tiles:
        sets.join_alike(*_normal_tile(store, tile))
    _join_others(store, sets)
    components = _Components(store, sets)
    for step in (components.add_areas, components.add_volumes, components.turn_outwards):
        for tile in tiles:
            step(tile)


def _normal_tile(store: TileStore, tile: int) -> tuple[Ints, Ints, Ints, Floats]:
    """Arguments for methods of `_core.TurnedSets`: see `NormalTile` in the core."""
    rows, ghosts = store.rows_of(tile, store.read(tile, "near"))
    own = np.arange(*store.starts[tile : tile + 2], dtype=np.int32)
    numbers, normals = (
        np.concatenate([store.read(tile, name), store.read_at(name, ghosts)])
        for name in ("numbers", "estimated")
    )
    return rows, np.concatenate([own, ghosts]), numbers, normals


def _join_others(store: TileStore, sets: _core.TurnedSets) -> None:
    """Join the pairs whose normals differ, sorted by cost, then by numbers."""
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


class _Components:
    """Components of the tree: area, moment, and three times the enclosed volume of each."""

    def __init__(self, store: TileStore, sets: _core.TurnedSets) -> None:
        self._store = store
        self._sets = sets
        self._roots = np.concatenate([self._roots_of(tile) for tile in range(store.n_tiles)])
        self._areas = np.zeros(len(self._roots))
        self._moments = np.zeros((len(self._roots), 3))
        self._volumes = np.zeros(len(self._roots))

    def _roots_of(self, tile: int) -> Ints:
        begin, end = self._store.starts[tile : tile + 2]
        places = np.arange(begin, end, dtype=np.int32)
        is_root = self._sets.roots(begin, end)[0] == places
        return np.asarray(places[is_root & (self._store.read(tile, "lowest") == NOT_COPIED)])

    def _read(self, tile: int) -> tuple[Longs, Bools, list[Array]]:
        """Of each point that is no copy: component, turned or not; [area, position, normal]."""
        store = self._store
        roots, is_turned = self._sets.roots(*store.starts[tile : tile + 2])
        at = np.flatnonzero(store.read(tile, "lowest") == NOT_COPIED)
        components = np.searchsorted(self._roots, roots[at]).astype(np.int64)
        arrays = [store.read(tile, name)[at] for name in ("areas", "positions", "estimated")]
        return components, is_turned[at] != 0, arrays

    def add_areas(self, tile: int) -> None:
        """Add up areas and moments, and turn normals towards that of the root."""
        components, is_turned, (areas, positions, normals) = self._read(tile)
        np.add.at(self._areas, components, areas)
        for axis in range(3):
            np.add.at(self._moments[:, axis], components, areas * positions[:, axis])
        normals[is_turned] *= -1.0
        self._write(tile, normals)

    def add_volumes(self, tile: int) -> None:
        """Add up volumes of cones from the centroid of each component."""
        components, _, (areas, positions, normals) = self._read(tile)
        has_area = self._areas[components] > 0
        scales = np.divide(1.0, self._areas, out=np.zeros_like(self._areas), where=self._areas > 0)
        centers = scales[:, None] * self._moments
        x, y, z = (normals * (positions - centers[components])).T
        np.add.at(self._volumes, components[has_area], (areas * (x + y + z))[has_area])

    def turn_outwards(self, tile: int) -> None:
        """Turn the normals of components with a negative volume."""
        components, _, (_, _, normals) = self._read(tile)
        normals[self._volumes[components] < 0] *= -1.0
        self._write(tile, normals)

    def _write(self, tile: int, normals: Floats) -> None:
        every = np.zeros((self._store.size(tile), 3))
        every[self._store.read(tile, "lowest") == NOT_COPIED] = normals
        self._store.write(tile, "estimated", every)
