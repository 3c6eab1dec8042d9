"""Halted expansions on tiles: each tile with all cells that paths to it can lead through."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from .faces import rows
from .paths import UNREACHED, central_cells, labels_of, own_labels, paths_of, write_paths
from .store import Run, TileStore

__all__ = ["HaltedRegions"]

Ints = npt.NDArray[np.int32]
Floats = npt.NDArray[np.float64]
Places = npt.NDArray[np.int64]
Lengths = npt.NDArray[np.uint64]


class HaltedRegions:
    """What the loop takes in the place of a `_core.Clustering` with a finite reach.

    A center expands through the cells within its reach, and labels these and their neighbors. So
    the centers that label a cell of a tile are within reach of the box around the tile and its
    ghosts, and their expansions within twice the reach of it: the *window* of the tile. The kernel
    for halted expansions is run in each window, and right for the tile in its middle.
    """

    def __init__(
        self,
        store: TileStore,
        run: Run,
        centers: Ints,
        reach: float,
        n_threads: int,
        islands: _core.Islands,
    ) -> None:
        self._store = store
        self._run = run
        self._reach = reach
        self._n_threads = n_threads
        self._islands = islands
        self._versions = [(tile, 0) for tile in range(store.n_tiles)]
        boxes = run(_box, store, [(tile,) for tile in range(store.n_tiles)])
        self._boxes = np.array(boxes)
        jobs = [(tile, self._boxes, reach) for tile in range(store.n_tiles)]
        run(_write_window, store, jobs)
        self.classify(centers)

    def classify(self, centers: Ints) -> None:
        """Classify all cells by these centers."""
        self._centers = centers
        jobs = [
            (tile, self._boxes[tile], centers, self._reach, self._n_threads)
            for tile, _ in self._versions
        ]
        self._run(_classify, self._store, jobs)
        if self._islands == _core.Islands.KEEP:
            self._adopt_orphans()

    def centers(self) -> Ints:
        """Return the centers, followed by those made of cells that none reached."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, in the order of the input."""
        return labels_of(self._store, self._versions)

    def update(self) -> Ints:
        """Return for each region the cell nearest to its mean."""
        return central_cells(self._store, self._run, self._versions, len(self._centers))

    def _adopt_orphans(self) -> None:
        """Make the lowest unreached cell a center that expands likewise, until all are reached."""
        found = self._run(_orphans, self._store, self._versions)
        cells, places = (np.concatenate(column) for column in zip(*found, strict=True))
        is_left = dict(zip(cells.tolist(), places.tolist(), strict=True))
        for cell in sorted(is_left):
            if cell not in is_left:
                continue
            label = len(self._centers)
            self._centers = np.append(self._centers, np.int32(cell))
            for reached in self._expand(cell, is_left[cell], label):
                is_left.pop(reached, None)

    def _expand(self, cell: int, place: int, label: int) -> list[int]:
        """Expand from one cell; return the cells that it reaches."""
        tile = int(self._store.tiles_of(np.array([place]))[0])
        job = (tile, self._boxes[tile], np.array([cell], np.int32), self._reach, self._n_threads)
        places, lengths = self._run(_reach_from, self._store, [job])[0]
        tiles = self._store.tiles_of(places)
        jobs = [
            (other, places[tiles == other], lengths[tiles == other], label)
            for other in np.unique(tiles).tolist()
        ]
        reached: list[int] = np.concatenate(self._run(_improve, self._store, jobs)).tolist()
        return reached


def _box(store: TileStore, tile: int) -> Floats:
    """The box around the cells of a tile and its ghosts."""
    around = store.read_at("positions", store.read(tile, "ghosts"))
    positions = np.concatenate([store.read(tile, "positions"), around])
    return np.array([positions.min(axis=0), positions.max(axis=0)])


def _gaps(box: Floats, positions: Floats) -> Floats:
    """The distance of each position from a box."""
    gaps = np.maximum(np.maximum(box[0] - positions, positions - box[1]), 0.0)
    distances: Floats = np.sqrt(np.sum(gaps * gaps, axis=-1))
    return distances


MARGIN = 1.0 + 1e-9
"""Factor for distances, against rounding."""

WINDOW = ("places", "cells", "positions", "offsets", "targets", "lengths")


def _write_window(store: TileStore, tile: int, boxes: Floats, reach: float) -> None:
    """Write the graph of all cells within twice the reach of the box of a tile.

    They are in the order of places, and followed by cells that their arcs lead to, without arcs.
    """
    limit = 2.0 * reach * MARGIN
    parts = []
    for other in range(store.n_tiles):
        apart = np.maximum(boxes[other, 0] - boxes[tile, 1], boxes[tile, 0] - boxes[other, 1])
        if np.linalg.norm(np.maximum(apart, 0.0)) <= limit:
            positions = store.read(other, "positions")
            is_near = (_gaps(boxes[tile], positions) <= limit) | (other == tile)
            parts.append(_part(store, other, np.flatnonzero(is_near)))
    places, counts, targets, lengths = (np.concatenate(part) for part in zip(*parts, strict=True))
    at = np.minimum(np.searchsorted(places, targets), len(places) - 1)
    is_outside = places[at] != targets
    ghosts = np.unique(targets[is_outside])
    at[is_outside] = len(places) + np.searchsorted(ghosts, targets[is_outside])
    ends = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts), np.zeros_like(ghosts)])
    ends[len(places) + 1 :] = ends[len(places)]
    arrays = (
        np.concatenate([places, ghosts]),
        np.concatenate([store.read_at("cells", places), store.read_at("cells", ghosts)]),
        np.concatenate([store.read_at("positions", places), store.read_at("positions", ghosts)]),
        ends,
        at.astype(np.int32),
        lengths,
    )
    for name, array in zip(WINDOW, arrays, strict=True):
        store.write(tile, f"window_{name}", array)


def _part(
    store: TileStore, tile: int, chosen: Places
) -> tuple[Places, Places, Places, npt.NDArray[np.float32]]:
    """The places of some cells of a tile, their numbers of arcs, and where these lead."""
    offsets, arcs = rows(store.read(tile, "arc_offsets"), chosen)
    own = np.arange(store.starts[tile], store.starts[tile + 1])
    around = np.concatenate([own, store.read(tile, "ghosts")])
    targets = around[store.read(tile, "arc_targets")[arcs]]
    return own[chosen], np.diff(offsets), targets, store.read(tile, "lengths")[arcs]


def _classify(
    store: TileStore, tile: int, box: Floats, centers: Ints, reach: float, n_threads: int
) -> None:
    """Write the halted paths to a tile."""
    places, lengths, labels = _halted_paths(store, tile, box, centers, reach, n_threads)
    first, end = np.searchsorted(places, store.starts[tile : tile + 2])
    write_paths(store, tile, 0, lengths[first:end], labels[first:end])


def _halted_paths(
    store: TileStore, tile: int, box: Floats, centers: Ints, reach: float, n_threads: int
) -> tuple[Places, Lengths, Ints]:
    """The places in a window, and the paths to them, which are right for those of the tile."""
    places, cells, positions, offsets, targets, arc_lengths = (
        store.read(tile, f"window_{name}") for name in WINDOW
    )
    n_inside = len(places)
    order = np.argsort(cells)
    at = np.minimum(np.searchsorted(cells, centers, sorter=order), n_inside - 1)
    which = np.flatnonzero(cells[order[at]] == centers)
    which = which[_gaps(box, positions[order[at[which]]]) <= reach * MARGIN]
    inside = np.argsort(places, kind="stable")
    if not len(which):
        return (
            places[inside],
            np.full(n_inside, UNREACHED, np.uint64),
            np.full(n_inside, -1, np.int32),
        )
    graph = _core.graph_in_place(
        positions, np.ones(n_inside), offsets, targets, arc_lengths, n_threads
    )
    starts = order[at[which]].astype(np.int32)
    nearest = _core.Islands.NEAREST  # unreached cells stay so
    regions = _core.Clustering(graph, starts, reach, n_threads, nearest)
    labels = regions.labels()
    found = np.where(labels >= 0, which[labels], -1).astype(np.int32)
    return places[inside], regions.lengths()[inside], found[inside]


def _reach_from(
    store: TileStore, tile: int, box: Floats, cell: Ints, reach: float, n_threads: int
) -> tuple[Places, Lengths]:
    """The places that a cell of the tile reaches, and the lengths of the paths."""
    places, lengths, labels = _halted_paths(store, tile, box, cell, reach, n_threads)
    return places[labels == 0], lengths[labels == 0]


def _orphans(store: TileStore, tile: int, version: int) -> tuple[Ints, Places]:
    """The cells of a tile that no center reaches, and their places."""
    at = np.flatnonzero(own_labels(store, tile, version) < 0)
    return store.read(tile, "cells")[at], store.starts[tile] + at


def _improve(store: TileStore, tile: int, places: Places, lengths: Lengths, label: int) -> Ints:
    """Take paths from a new center; return the cells that they lead to."""
    at = places - store.starts[tile]
    before = paths_of(store, tile, 0)
    known, labels = before[0].copy(), before[1].copy()
    is_better = lengths < known[at]  # of equal ones that with the lower label stays
    known[at[is_better]] = lengths[is_better]
    labels[at[is_better]] = label
    write_paths(store, tile, 0, known, labels)
    return store.read(tile, "cells")[at]
