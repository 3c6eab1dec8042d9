"""Stages 4a and 4b on tiles: shortest paths from all centers, and where centers should be."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from .. import _core
from .coarse import nearest_cells, tile_graph
from .store import Job, Run, TileStore, find_cells

__all__ = ["TiledRegions"]

Ints = npt.NDArray[np.int32]
Places = npt.NDArray[np.int64]
Lengths = npt.NDArray[np.uint64]

Floats = npt.NDArray[np.float64]
Frame = tuple[tuple[float, float, float], tuple[float, float, float], float]

Proposals = tuple[Places, Lengths, Ints]
"""Paths to places: their lengths and labels."""

UNREACHED = np.iinfo(np.uint64).max


class TiledRegions:
    """What the loop takes in the place of a `_core.Clustering`.

    A tile follows all paths within it, and proposes those that leave it to the tiles that they lead
    to. The classification is done when there are no proposals left. Then no arc can improve a path,
    so each place has the shortest of all paths, and the lowest label among equals, whatever tiles
    there are.
    """

    def __init__(
        self, store: TileStore, run: Run, centers: Ints, n_threads: int, islands: _core.Islands
    ) -> None:
        self._store = store
        self._run = run
        self._n_threads = n_threads
        self._islands = islands
        self._versions = dict.fromkeys(range(store.n_tiles), -1)  # of the paths of each tile
        self.classify(centers)

    def classify(self, centers: Ints) -> None:
        """Classify all cells by these centers."""
        self._centers = centers
        for tile, version in self._versions.items():
            self._store.remove(tile, _name(version))
            self._versions[tile] = -1  # no cell is reached
        labels = np.arange(len(centers), dtype=np.int32)
        self._expand((self._places_of(centers), np.zeros(len(centers), np.uint64), labels))
        if self._islands == _core.Islands.KEEP:
            self._adopt_orphans()

    def centers(self) -> Ints:
        """Return the centers, followed by those made of cells that none reached."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, in the order of the input."""
        labels = np.empty(self._store.n_cells, np.int32)
        for tile, version in self._versions.items():
            cells = self._store.read(tile, "cells")
            labels[cells] = _own_labels(self._store, tile, version)
        return labels

    def update(self) -> Ints:
        """Return for each region the cell nearest to its mean."""
        n_regions = len(self._centers)
        jobs = [(tile, version, n_regions) for tile, version in self._versions.items()]
        store = self._store
        frame = (*(tuple(corner) for corner in store.curve.tolist()), store.total_measure)
        sums = np.sum(self._run(_sums, store, [(*job, frame) for job in jobs]), axis=0)
        means, is_small = _core.fixed_means(sums, *frame)
        if is_small.any():
            parts = self._run(_members, store, [(*job[:2], is_small) for job in jobs])
            means[is_small != 0] = _means_of(parts, n_regions)[is_small != 0]
        return nearest_cells(self._run(_nearest, store, [(*job[:2], means) for job in jobs]))

    def _expand(self, proposals: Proposals) -> None:
        for round_number in itertools.count(max(self._versions.values()) + 1):
            if not len(proposals[0]):
                return
            found = self._run(_improve, self._store, self._jobs(proposals, round_number))
            proposals = tuple(np.concatenate(column) for column in zip(*found, strict=True))

    def _jobs(self, proposals: Proposals, version: int) -> list[Job]:
        """What each tile has to look at; the paths that it finds get this version."""
        tiles = self._store.tiles_of(proposals[0])
        jobs = []
        for tile in np.unique(tiles).tolist():
            here = tuple(column[tiles == tile] for column in proposals)
            jobs.append((tile, self._versions[tile], version, here, self._n_threads))
            self._versions[tile] = version
        return jobs

    def _places_of(self, cells: Ints) -> Places:
        jobs = [(tile, cells) for tile in range(self._store.n_tiles)]
        places = np.empty(len(cells), np.int64)
        for tile, (which, at) in enumerate(self._run(find_cells, self._store, jobs)):
            places[which] = self._store.starts[tile] + at
        return places

    def _adopt_orphans(self) -> None:
        """Make the lowest unreached cell a center, until all are reached."""
        while True:
            lowest = min(self._run(_lowest_orphan, self._store, list(self._versions.items())))
            if lowest[0] == self._store.n_cells:
                return
            label = np.array([len(self._centers)], np.int32)
            self._centers = np.append(self._centers, np.int32(lowest[0]))
            self._expand((np.array([lowest[1]]), np.zeros(1, np.uint64), label))


def _name(version: int) -> str:
    return f"paths{version}"


def _paths(store: TileStore, tile: int, version: int) -> tuple[Lengths, Ints]:
    """Lengths and labels of the paths to a tile and its ghosts."""
    if version < 0:
        n_cells = store.size(tile) + len(store.read(tile, "ghosts"))
        return np.full(n_cells, UNREACHED, np.uint64), np.full(n_cells, -1, np.int32)
    lengths, labels = store.read(tile, _name(version))
    return lengths, labels.view(np.int64).astype(np.int32)


def _own_labels(store: TileStore, tile: int, version: int) -> Ints:
    return _paths(store, tile, version)[1][: store.size(tile)]


def _improve(
    store: TileStore, tile: int, version: int, next_version: int, proposals: Proposals,
    n_threads: int,
) -> Proposals:  # fmt: skip
    """Take proposals to a tile, and return those that it makes to others.

    Paths are written under a new name, so that work that was cut short can be done again.
    """
    places, *paths = proposals
    n_own, ghosts = store.size(tile), store.read(tile, "ghosts")
    known = _paths(store, tile, version)
    at = (places - store.starts[tile]).astype(np.int32)
    graph = tile_graph(store, tile, n_threads)
    lengths, labels = _core.improve_paths(graph, *known, at, *paths, n_threads)
    store.write(
        tile, _name(next_version), np.stack([lengths, labels.astype(np.int64).view(np.uint64)])
    )
    is_better = (lengths[n_own:] != known[0][n_own:]) | (labels[n_own:] != known[1][n_own:])
    return ghosts[is_better], lengths[n_own:][is_better], labels[n_own:][is_better]


def _lowest_orphan(store: TileStore, tile: int, version: int) -> tuple[int, int]:
    """The lowest cell that has no label, and its place; N where there is none."""
    at = np.flatnonzero(_own_labels(store, tile, version) < 0)
    if not len(at):
        return store.n_cells, 0
    cells = store.read(tile, "cells")[at]
    return int(cells.min()), store.starts[tile] + int(at[cells.argmin()])


def _sums(
    store: TileStore, tile: int, version: int, n_regions: int, frame: Frame
) -> npt.NDArray[np.int64]:
    """Exact sums of the regions in a tile."""
    measured = store.read(tile, "positions"), store.read(tile, "measures")
    return _core.fixed_sums(*measured, _own_labels(store, tile, version), n_regions, *frame)


def _nearest(store: TileStore, tile: int, version: int, means: Floats) -> tuple[Floats, Ints]:
    cells = store.read(tile, "positions"), store.read(tile, "cells")
    return _core.nearest_of_regions(*cells, _own_labels(store, tile, version), means)


def _members(
    store: TileStore, tile: int, version: int, is_wanted: npt.NDArray[np.uint8]
) -> tuple[Ints, Ints, Floats, Floats]:
    """The cells of some regions, with their labels, positions and measures."""
    labels = _own_labels(store, tile, version)
    at = np.flatnonzero((labels >= 0) & (is_wanted[labels] != 0))
    arrays = [store.read(tile, name)[at] for name in ("cells", "positions", "measures")]
    return arrays[0], labels[at], arrays[1], arrays[2]


def _means_of(parts: list[tuple[Ints, Ints, Floats, Floats]], n_regions: int) -> Floats:
    """Means of regions whose share in the total is too small for exact sums."""
    cells, labels, positions, measures = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    order = np.argsort(cells)
    no_arcs = (np.zeros(len(cells) + 1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))
    graph = _core.graph_in_place(positions[order], measures[order], *no_arcs, 1)
    return _core.region_means(graph, labels[order], n_regions)
