"""Stage 4a on tiles: shortest paths from all centers, and islands that no path reaches."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints, Longs
from .mapping import Run
from .store import TileStore, find_cells

UNREACHED = np.iinfo(np.uint64).max


class Proposals(NamedTuple):
    """Paths that end at cells of other tiles: places, lengths and labels."""

    places: Longs
    lengths: Array  # of uint64
    labels: Ints

    def take(self, chosen: Array) -> Proposals:
        """The chosen proposals."""
        return Proposals(self.places[chosen], self.lengths[chosen], self.labels[chosen])


class TiledRegions:
    """Stands in for `_core.Clustering` in the loop, for one classification.

    Each tile expands the paths within it, and proposes paths that leave it to the tiles where they
    end. When no proposals are left, no arc can improve a path: so each place has its shortest path,
    and the lowest label among equals, for any choice of tiles.
    """

    def __init__(
        self, store: TileStore, run: Run, n_threads: int, is_parallel: bool, centers: Ints
    ) -> None:
        self._store = store
        self._run = run
        self._n_threads = n_threads
        self._is_parallel = is_parallel
        self._versions = dict.fromkeys(range(store.n_tiles), -1)  # of each tile's paths
        self._centers = centers
        self._expand(centers, 0)

    def centers(self) -> Ints:
        """Return the centers, followed by the centers added for islands."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, in the order of the input."""
        labels = np.empty(self._store.n_cells, np.int32)
        for tile, version in self._versions.items():
            cells = self._store.read(tile, "cells")
            labels[cells] = _paths_of(self._store, tile, version)[1][: len(cells)]
        return labels

    def adopt_orphans(self) -> None:
        """Make the lowest cell of each island a center, in ascending order."""
        labels = self.labels()
        if labels.min() < 0:
            cells, _, islands = _find_islands(self._store, labels, self._run)
            orphans = np.sort(cells[_first_of_each(islands, cells)])
            self._expand(orphans, len(self._centers))
            self._centers = np.concatenate([self._centers, orphans])

    def _expand(self, cells: Ints, first_label: int) -> None:
        """Add centers, labeled from `first_label` on, and expand until no path gets shorter."""
        labels = np.arange(first_label, first_label + len(cells), dtype=np.int32)
        places = np.empty(len(cells), np.int64)
        found = self._run.all(find_cells, self._store, self._store.n_tiles, cells)
        for tile, (which, at) in enumerate(found):
            places[which] = self._store.starts[tile] + at
        waiting: dict[int, list[Proposals]] = {}
        self._add(waiting, Proposals(places, np.zeros(len(cells), np.uint64), labels))
        n_visits = 0
        for version in itertools.count(max(self._versions.values()) + 1):
            if not waiting:
                break
            # In series, the tile that has waited longest comes next: the more proposals a visit
            # takes, the fewer visits there are.
            tiles = sorted(waiting) if self._is_parallel else [next(iter(waiting))]
            jobs = []
            for tile in tiles:
                here = Proposals(*map(np.concatenate, zip(*waiting.pop(tile), strict=True)))
                jobs.append((tile, self._versions[tile], version, here, self._n_threads))
            found = self._run(_improve, self._store, jobs, n_before=n_visits, n_after=len(waiting))
            n_visits += len(jobs)
            for tile, proposals in zip(tiles, found, strict=True):
                self._store.remove(tile, f"paths{self._versions[tile]}")
                self._versions[tile] = version
                self._add(waiting, proposals)

    def _add(self, waiting: dict[int, list[Proposals]], proposals: Proposals) -> None:
        """Group proposals by tile."""
        tiles = self._store.tiles_of(proposals.places)
        for tile in np.unique(tiles).tolist():
            waiting.setdefault(tile, []).append(proposals.take(tiles == tile))


def _paths_of(store: TileStore, tile: int, version: int) -> tuple[Array, Ints]:
    """Lengths and labels of the paths to the cells of a tile and to its ghosts."""
    if version < 0:
        n_cells = store.size(tile) + len(store.read(tile, "ghosts"))
        return np.full(n_cells, UNREACHED, np.uint64), np.full(n_cells, -1, np.int32)
    packed = store.read(tile, f"paths{version}")
    lengths, labels = np.split(packed, [2 * len(packed) // 3])
    return lengths.view(np.uint64), labels


def _improve(
    store: TileStore, tile: int, version: int, next_version: int, proposals: Proposals,
    n_threads: int,
) -> Proposals:  # fmt: skip
    """Apply proposals to a tile, expand, and return its proposals to other tiles.

    Paths are written under a new name, so that the job can be repeated if its worker is killed.
    """
    n_own, ghosts = store.size(tile), store.read(tile, "ghosts")
    known = _paths_of(store, tile, version)
    lengths, labels = _core.improve_paths(
        *store.arcs(tile),
        *known,
        (proposals.places - store.starts[tile]).astype(np.int32),
        *proposals[1:],
        n_threads,
    )
    # One array, so that it is written whole or not at all.
    store.write(tile, f"paths{next_version}", np.concatenate([lengths.view(np.int32), labels]))
    is_better = (lengths[n_own:] != known[0][n_own:]) | (labels[n_own:] != known[1][n_own:])
    return Proposals(ghosts, lengths[n_own:], labels[n_own:]).take(is_better)


def join_islands(store: TileStore, labels: Ints, run: Run, n_threads: int) -> tuple[Ints, int]:
    """Label the cells with -1, and return all labels and the number of islands.

    An island gets the label of the cell nearest to any of its cells, the lowest among equals. The
    cells of all islands are in memory.
    """
    if labels.min() >= 0:
        return labels, 0
    cells, positions, islands = _find_islands(store, labels, run)
    squared, nearest = np.full(len(cells), np.inf), np.full(len(cells), -1, np.int32)
    for tile in range(store.n_tiles):
        job = (tile, labels[store.read(tile, "cells")], positions, n_threads)
        found = run(_nearest_labeled, store, [job])[0]
        is_better = (found[0] < squared) | ((found[0] == squared) & (found[1] < nearest))
        squared[is_better], nearest[is_better] = found[0][is_better], found[1][is_better]
    firsts = _first_of_each(islands, squared, nearest)
    joined = labels.copy()
    joined[cells] = labels[nearest[firsts]][islands]
    return joined, len(firsts)


def _first_of_each(islands: Ints, *keys: Array) -> Longs:
    """Index of the cell of each island that is lowest by the keys, the first key first."""
    order = np.lexsort([*reversed(keys), islands])
    return order[np.flatnonzero(np.diff(islands[order], prepend=-1))]


def _find_islands(store: TileStore, labels: Ints, run: Run) -> tuple[Ints, Floats, Ints]:
    """The cells with label -1, their positions, and the island of each, 0 to n - 1."""
    jobs = [(tile, labels[store.read(tile, "cells")]) for tile in range(store.n_tiles)]
    parts = run(_unlabeled, store, jobs)
    cells, positions = (np.concatenate([part[i] for part in parts]) for i in range(2))
    order = np.argsort(cells)
    pairs = np.concatenate([part[2] for part in parts], axis=1)
    sources, targets = order[np.searchsorted(cells, pairs, sorter=order)]
    by_source = np.argsort(sources, kind="stable")
    offsets = np.searchsorted(sources[by_source], np.arange(len(cells) + 1)).astype(np.int64)
    neighbors, same = targets[by_source].astype(np.int32), np.zeros(len(cells), np.int32)
    return cells, positions, _core.find_components(offsets, neighbors, same)[0]


def _unlabeled(store: TileStore, tile: int, labels: Ints) -> tuple[Ints, Floats, Longs]:
    """The cells without a label, their positions, and arcs between them, as pairs of cells."""
    at = np.flatnonzero(labels < 0)
    own = store.read(tile, "cells")
    around = np.concatenate([own, store.read(tile, "ghost_cells")])
    sources = np.repeat(np.arange(len(own)), np.diff(store.read(tile, "arcs/offsets")))
    is_inside = labels[sources] < 0  # then the target has no label either
    pairs = np.stack([own[sources[is_inside]], around[store.read(tile, "arcs/targets")[is_inside]]])
    return own[at], store.read(tile, "positions")[at], pairs.astype(np.int64)


def _nearest_labeled(
    store: TileStore, tile: int, labels: Ints, points: Floats, n_threads: int
) -> tuple[Floats, Ints]:
    """For each point the squared distance of the nearest labeled cell of a tile, and that cell."""
    cells = store.read(tile, "cells")
    at = np.flatnonzero(labels >= 0)
    if not len(at):
        return np.full(len(points), np.inf), np.full(len(points), -1, np.int32)
    at = at[np.argsort(cells[at])]  # so that the lowest of equally near cells is found
    positions = store.read(tile, "positions")[at]
    found, _, _ = _core.nearest_points(positions, points, np.inf, n_threads)
    x, y, z = (positions[found] - points).T
    return x * x + y * y + z * z, cells[at[found]]
