"""Stages 4a and 4b on tiles: shortest paths from all centers, and where centers should be."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from .. import _core
from .coarse import nearest_cells
from .islands import find_islands
from .store import Job, Run, TileStore, find_cells

__all__ = [
    "UNREACHED", "Proposals", "TiledPaths", "TiledRegions", "central_cells", "frame_of",
    "labels_of", "name_of", "own_labels", "paths_of", "write_paths",
]  # fmt: skip

Ints = npt.NDArray[np.int32]
Places = npt.NDArray[np.int64]
Lengths = npt.NDArray[np.uint64]

Floats = npt.NDArray[np.float64]
Frame = tuple[tuple[float, float, float], tuple[float, float, float], float]

Proposals = tuple[Places, Lengths, Ints]
"""Paths to places: their lengths and labels."""

UNREACHED = np.iinfo(np.uint64).max


class TiledPaths:
    """Shortest paths to all places from the centers proposed so far.

    A tile follows all paths within it, and proposes those that leave it to the tiles that they lead
    to. When there are no proposals left no arc can improve a path, so each place has the shortest
    of all paths, and the lowest label among equals, whatever tiles there are.
    """

    def __init__(self, store: TileStore, run: Run, n_threads: int, is_parallel: bool) -> None:
        self._store = store
        self._is_parallel = is_parallel
        self._run = run
        self._n_threads = n_threads
        self._versions = dict.fromkeys(range(store.n_tiles), -1)  # of the paths of each tile

    @property
    def versions(self) -> list[tuple[int, int]]:
        """The tiles, and what tells the names of their paths."""
        return list(self._versions.items())

    def clear(self) -> None:
        """Forget all paths."""
        for tile, version in self.versions:
            self._store.remove(tile, name_of(version))
            self._versions[tile] = -1

    def start(self, cells: Ints, first_label: int) -> list[int]:
        """Begin at some cells, with labels from this one on; return the tiles that changed."""
        labels = np.arange(first_label, first_label + len(cells), dtype=np.int32)
        return self.propose((self._places_of(cells), np.zeros(len(cells), np.uint64), labels))

    def propose(self, proposals: Proposals) -> list[int]:
        """Take these paths and all that follow from them; return the tiles that changed."""
        waiting: dict[int, list[Proposals]] = {}
        self._add(waiting, proposals)
        changed: set[int] = set()
        n_visits = 0
        for version in itertools.count(max(self._versions.values()) + 1):
            if not waiting:
                break
            jobs = [self._job(tile, waiting, version) for tile in self._next(waiting)]
            found_by = self._run(
                _improve, self._store, jobs, n_before=n_visits, n_after=len(waiting)
            )
            n_visits += len(jobs)
            for (tile, before, *_), found in zip(jobs, found_by, strict=True):
                self._store.remove(tile, name_of(before))
                changed.add(tile)
                self._add(waiting, found)
        return sorted(changed)

    def _add(self, waiting: dict[int, list[Proposals]], proposals: Proposals) -> None:
        """Sort proposals by the tiles that they are for."""
        places, lengths, labels = proposals
        tiles = self._store.tiles_of(places)
        for tile in np.unique(tiles).tolist():
            is_for = tiles == tile
            some = places[is_for], lengths[is_for], labels[is_for]
            waiting.setdefault(tile, []).append(some)

    def _next(self, waiting: dict[int, list[Proposals]]) -> list[int]:
        """The tiles to work on: all at once, or the one that has waited longest.

        One after the other, each takes all that was proposed before, and is visited less often.
        """
        return sorted(waiting) if self._is_parallel else [next(iter(waiting))]

    def _job(self, tile: int, waiting: dict[int, list[Proposals]], version: int) -> Job:
        """What a tile has to look at; the paths that it finds get this version."""
        here = tuple(np.concatenate(part) for part in zip(*waiting.pop(tile), strict=True))
        before, self._versions[tile] = self._versions[tile], version
        return tile, before, version, here, self._n_threads

    def _places_of(self, cells: Ints) -> Places:
        jobs = [(tile, cells) for tile in range(self._store.n_tiles)]
        places = np.empty(len(cells), np.int64)
        for tile, (which, at) in enumerate(self._run(find_cells, self._store, jobs)):
            places[which] = self._store.starts[tile] + at
        return places


class TiledRegions:
    """What the loop takes in the place of a `_core.Clustering`, where expansions do not halt."""

    def __init__(
        self, store: TileStore, run: Run, centers: Ints, paths: TiledPaths, islands: _core.Islands
    ) -> None:
        self._store = store
        self._run = run
        self._islands = islands
        self._paths = paths
        self.classify(centers)

    def classify(self, centers: Ints) -> None:
        """Classify all cells by these centers."""
        self._centers = centers
        self._paths.clear()
        self._paths.start(centers, 0)
        if self._islands == _core.Islands.KEEP:
            self._adopt_orphans()

    def centers(self) -> Ints:
        """Return the centers, followed by those made of cells that none reached."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, in the order of the input."""
        return labels_of(self._store, self._paths.versions)

    def update(self) -> Ints:
        """Return for each region the cell nearest to its mean."""
        return central_cells(self._store, self._run, self._paths.versions, len(self._centers))

    def _adopt_orphans(self) -> None:
        """Make the lowest cell of each component without a center one, in their order."""
        labels = self.labels()
        if labels.min() >= 0:
            return
        cells, _, islands, _ = find_islands(self._store, labels, self._run)
        order = np.lexsort([cells, islands])
        firsts = order[np.flatnonzero(np.diff(islands[order], prepend=-1))]
        orphans = np.sort(cells[firsts])
        self._paths.start(orphans, len(self._centers))
        self._centers = np.concatenate([self._centers, orphans])


def labels_of(store: TileStore, versions: list[tuple[int, int]]) -> Ints:
    """The label of each cell, in the order of the input."""
    labels = np.empty(store.n_cells, np.int32)
    for tile, version in versions:
        labels[store.read(tile, "cells")] = own_labels(store, tile, version)
    return labels


def central_cells(
    store: TileStore, run: Run, versions: list[tuple[int, int]], n_regions: int
) -> Ints:
    """For each region the cell nearest to the mean of its cells, the lowest among equals."""
    jobs = [(tile, version, n_regions, frame_of(store)) for tile, version in versions]
    sums = np.sum(run(_sums, store, jobs), axis=0)
    means, is_small = _core.fixed_means(sums, *frame_of(store))
    if is_small.any():
        parts = run(_members, store, [(*version, is_small) for version in versions])
        means[is_small != 0] = _means_of(parts, n_regions)[is_small != 0]
    return nearest_cells(run(_nearest, store, [(*version, means) for version in versions]))


def frame_of(store: TileStore) -> Frame:
    """What exact sums are relative to."""
    low, high = (tuple(corner) for corner in store.curve.tolist())
    return low, high, store.total_measure


def name_of(version: int) -> str:
    """The array with the paths of a tile."""
    return f"paths{version}"


def paths_of(store: TileStore, tile: int, version: int) -> tuple[Lengths, Ints]:
    """Lengths and labels of the paths to a tile and its ghosts."""
    if version < 0:
        n_cells = store.size(tile) + len(store.read(tile, "ghosts"))
        return np.full(n_cells, UNREACHED, np.uint64), np.full(n_cells, -1, np.int32)
    packed = store.read(tile, name_of(version))
    lengths, labels = np.split(packed, [2 * len(packed) // 3])
    return lengths.view(np.uint64), labels


def write_paths(store: TileStore, tile: int, version: int, lengths: Lengths, labels: Ints) -> None:
    """Write what `paths_of` reads: in one array, which appears whole."""
    store.write(tile, name_of(version), np.concatenate([lengths.view(np.int32), labels]))


def own_labels(store: TileStore, tile: int, version: int) -> Ints:
    """Labels of the places of a tile."""
    return paths_of(store, tile, version)[1][: store.size(tile)]


def _improve(
    store: TileStore, tile: int, version: int, next_version: int, proposals: Proposals,
    n_threads: int,
) -> Proposals:  # fmt: skip
    """Take proposals to a tile, and return those that it makes to others.

    Paths are written under a new name, so that work that was cut short can be done again.
    """
    places, offered, offered_labels = proposals
    n_own, ghosts = store.size(tile), store.read(tile, "ghosts")
    known = paths_of(store, tile, version)
    at = (places - store.starts[tile]).astype(np.int32)
    lengths, labels = _core.improve_paths(
        store.read(tile, "arcs/offsets"),
        store.read(tile, "arcs/targets"),
        store.read(tile, "arcs/lengths"),
        *known,
        at,
        offered,
        offered_labels,
        n_threads,
    )
    write_paths(store, tile, next_version, lengths, labels)
    is_better = (lengths[n_own:] != known[0][n_own:]) | (labels[n_own:] != known[1][n_own:])
    return ghosts[is_better], lengths[n_own:][is_better], labels[n_own:][is_better]


def _sums(
    store: TileStore, tile: int, version: int, n_regions: int, frame: Frame
) -> npt.NDArray[np.int64]:
    """Exact sums of the regions in a tile."""
    labels = own_labels(store, tile, version)
    positions, measures = store.read(tile, "positions"), store.read(tile, "measures")
    return _core.fixed_sums(positions, measures, labels, n_regions, *frame)


def _nearest(store: TileStore, tile: int, version: int, means: Floats) -> tuple[Floats, Ints]:
    cells = store.read(tile, "positions"), store.read(tile, "cells")
    return _core.nearest_of_regions(*cells, own_labels(store, tile, version), means)


def _members(
    store: TileStore, tile: int, version: int, is_wanted: npt.NDArray[np.uint8]
) -> tuple[Ints, Ints, Floats, Floats]:
    """The cells of some regions, with their labels, positions and measures."""
    labels = own_labels(store, tile, version)
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
