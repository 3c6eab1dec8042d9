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

__all__ = ["TiledPaths", "TiledRegions"]

UNREACHED = np.iinfo(np.uint64).max


class Proposals(NamedTuple):
    """Paths to places: their lengths and labels."""

    places: Longs
    lengths: Array  # of uint64
    labels: Ints

    def take(self, chosen: Array) -> Proposals:
        """Some of them."""
        return Proposals(self.places[chosen], self.lengths[chosen], self.labels[chosen])


class TiledPaths:
    """Shortest paths to all places from the centers proposed so far.

    A tile follows all paths within it, and proposes those that leave it to the tiles that they lead
    to. When there are no proposals left no arc can improve a path, so each place has the shortest
    of all paths, and the lowest label among equals, whatever tiles there are.
    """

    def __init__(self, store: TileStore, run: Run, n_threads: int, is_parallel: bool) -> None:
        self.store = store
        self.run = run
        self._is_parallel = is_parallel
        self._n_threads = n_threads
        self._versions = dict.fromkeys(range(store.n_tiles), -1)  # of the paths of each tile

    def labels(self) -> Ints:
        """The label of each cell, in the order of the input."""
        labels = np.empty(self.store.n_cells, np.int32)
        for tile, version in self._versions.items():
            cells = self.store.read(tile, "cells")
            labels[cells] = _paths_of(self.store, tile, version)[1][: len(cells)]
        return labels

    def start(self, cells: Ints, first_label: int) -> None:
        """Begin at some cells, with labels from this one on; take all paths that follow."""
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
            # One after the other, each takes all that was proposed before, and is visited less
            # often: the one that has waited longest comes next.
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
        """Sort proposals by the tiles that they are for."""
        tiles = self.store.tiles_of(proposals.places)
        for tile in np.unique(tiles).tolist():
            waiting.setdefault(tile, []).append(proposals.take(tiles == tile))


class TiledRegions:
    """What the loop takes in the place of a `_core.Clustering`, for one classification."""

    def __init__(self, paths: TiledPaths, centers: Ints, islands: _core.Islands) -> None:
        self._paths = paths
        self._centers = centers
        paths.start(centers, 0)
        if islands == _core.Islands.KEEP:
            self._adopt_orphans()

    def centers(self) -> Ints:
        """Return the centers, followed by those made of cells that none reached."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, in the order of the input."""
        return self._paths.labels()

    def _adopt_orphans(self) -> None:
        """Make the lowest cell of each component without a center one, in their order."""
        labels = self.labels()
        if labels.min() >= 0:
            return
        cells, _, islands = find_islands(self._paths.store, labels, self._paths.run)
        order = np.lexsort([cells, islands])
        orphans = np.sort(cells[order[np.flatnonzero(np.diff(islands[order], prepend=-1))]])
        self._paths.start(orphans, len(self._centers))
        self._centers = np.concatenate([self._centers, orphans])


def _paths_of(store: TileStore, tile: int, version: int) -> tuple[Array, Ints]:
    """Lengths and labels of the paths to a tile and its ghosts."""
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
    """Take proposals to a tile, and return those that it makes to others.

    Paths are written under a new name, so that work that was cut short can be done again.
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
    # In one array, which appears whole.
    store.write(tile, f"paths{next_version}", np.concatenate([lengths.view(np.int32), labels]))
    is_better = (lengths[n_own:] != known[0][n_own:]) | (labels[n_own:] != known[1][n_own:])
    return Proposals(ghosts, lengths[n_own:], labels[n_own:]).take(is_better)
