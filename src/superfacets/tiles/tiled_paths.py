"""Stage 4a on tiles: shortest paths from all centers."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Array, Ints, Longs
from .mapping import run_all
from .store import Run, TileStore, find_cells
from .tiled_islands import find_islands

UNREACHED = np.iinfo(np.uint64).max


class Proposals(NamedTuple):
    """Paths that end at cells of other tiles: places, lengths and labels."""

    places: Longs
    lengths: Array  # of uint64
    labels: Ints

    def take(self, chosen: Array) -> Proposals:
        """The chosen proposals."""
        return Proposals(self.places[chosen], self.lengths[chosen], self.labels[chosen])


class TiledPaths:
    """Shortest paths to all places from the centers proposed so far.

    Each tile expands the paths within it, and proposes paths that leave it to the tiles where they
    end. When no proposals are left, no arc can improve a path: so each place has its shortest path,
    and the lowest label among equals, for any choice of tiles.
    """

    def __init__(self, store: TileStore, run: Run, n_threads: int, is_parallel: bool) -> None:
        self.store = store
        self.run = run
        self._is_parallel = is_parallel
        self._n_threads = n_threads
        self._versions = dict.fromkeys(range(store.n_tiles), -1)  # of each tile's paths

    def labels(self) -> Ints:
        """The label of each cell, in the order of the input."""
        labels = np.empty(self.store.n_cells, np.int32)
        for tile, version in self._versions.items():
            cells = self.store.read(tile, "cells")
            labels[cells] = _paths_of(self.store, tile, version)[1][: len(cells)]
        return labels

    def start(self, cells: Ints, first_label: int) -> None:
        """Add centers, labeled from `first_label` on, and expand until no path gets shorter."""
        labels = np.arange(first_label, first_label + len(cells), dtype=np.int32)
        places = np.empty(len(cells), np.int64)
        found = run_all(self.run, find_cells, self.store, self.store.n_tiles, cells)
        for tile, (which, at) in enumerate(found):
            places[which] = self.store.starts[tile] + at
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
            found = self.run(_improve, self.store, jobs, n_before=n_visits, n_after=len(waiting))
            n_visits += len(jobs)
            for tile, proposals in zip(tiles, found, strict=True):
                self.store.remove(tile, f"paths{self._versions[tile]}")
                self._versions[tile] = version
                self._add(waiting, proposals)

    def _add(self, waiting: dict[int, list[Proposals]], proposals: Proposals) -> None:
        """Group proposals by tile."""
        tiles = self.store.tiles_of(proposals.places)
        for tile in np.unique(tiles).tolist():
            waiting.setdefault(tile, []).append(proposals.take(tiles == tile))


class TiledRegions:
    """Stands in for `_core.Clustering` in the loop, for one classification."""

    def __init__(self, paths: TiledPaths, centers: Ints, islands: _core.Islands) -> None:
        self._paths = paths
        self._centers = centers
        paths.start(centers, 0)
        if islands == _core.Islands.KEEP:
            self._adopt_orphans()

    def centers(self) -> Ints:
        """Return the centers, followed by the centers added for islands."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, in the order of the input."""
        return self._paths.labels()

    def _adopt_orphans(self) -> None:
        """Make the lowest cell of each island a center, in ascending order."""
        labels = self.labels()
        if labels.min() >= 0:
            return
        cells, _, islands = find_islands(self._paths.store, labels, self._paths.run)
        order = np.lexsort([cells, islands])
        orphans = np.sort(cells[order[np.flatnonzero(np.diff(islands[order], prepend=-1))]])
        self._paths.start(orphans, len(self._centers))
        self._centers = np.concatenate([self._centers, orphans])


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
