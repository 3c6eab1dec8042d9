"""Stages 3 and 4 on disk: cluster the cells of a graph that is read tile by tile."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .. import _core
from .._types import Array, Bools, Floats, Ints, Longs, Singles
from ..batches.mapping import Run
from ..cells.constraints import NO_GROUPS
from .arrays import rows
from .part import Lists, Part
from .store import TileStore, find_cells


@dataclass(frozen=True, eq=False)
class TiledGraph:
    """Graph of all cells on disk, with the methods of `_core.OrderedGraph`."""

    store: TileStore  # tiles with arcs from `find_arcs`
    run: Run
    n_threads: int  # number of threads used for each tile
    is_parallel: bool = False  # True if several tiles are processed simultaneously
    straight_unit: float = 0.0  # see `LargeGraph.straight_unit`
    crease_limit: float = np.inf  # coarse cells do not cross arcs with at least this crease cost

    is_symmetric = True
    """Whether the arcs a -> b and b -> a always have the same length."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return self.store.n_cells

    def coarsened(self, cell_size: int, n_threads: int) -> TiledCoarseGraph:
        """Divide each tile into coarse cells, and return the graph of coarse cells."""
        store, run, unit = self.store, self.run, self.straight_unit
        steps = (unit, self.crease_limit)
        found = run.all(_divide, store, store.n_tiles, cell_size, steps, self.n_threads)
        positions, measures = map(list, zip(*found, strict=True))
        firsts = np.append(0, np.cumsum([len(some) for some in measures]))
        found = run.all(_connect, store, store.n_tiles, firsts, unit, self.n_threads)
        counts, targets, lengths = map(list, zip(*found, strict=True))
        del found  # so that `_in_a_row` can free each array after copying it
        graph = _core.graph_in_place(
            _in_a_row(positions), _in_a_row(measures), np.append(0, np.cumsum(_in_a_row(counts))),
            _in_a_row(targets), _in_a_row(lengths), unit, n_threads,
        )  # fmt: skip
        graph.crease_limit = self.crease_limit
        return TiledCoarseGraph(graph, self, firsts)

    def assignment(
        self, centers: Ints, reach: float, n_threads: int, islands: _core.Islands
    ) -> TiledRegions:
        """Assign all cells to their nearest centers; the maximum distance `reach` must be inf."""
        assert np.isinf(reach)
        regions = TiledRegions(self, centers)
        if islands == _core.Islands.KEEP:
            regions.adopt_orphans()
        return regions

    def join_islands(self, labels: Ints, groups: Ints, n_threads: int) -> tuple[Ints, int, Ints]:
        """Label all islands. An island is a connected component of cells labeled -1.

        An island gets the label of the labeled cell that is nearest to any cell of the island. Of
        equally near cells, the lowest is used. The cells of all islands are in memory. Returns the
        labels of all cells, the number of islands, and an empty array, because no island becomes a
        region.
        """
        assert not len(groups)
        store, n_islands = self.store, 0
        if labels.min() < 0:
            cells, positions, islands = _find_islands(store, labels, self.run)
            squared, nearest = np.full(len(cells), np.inf), np.full(len(cells), -1, np.int32)
            for tile in range(store.n_tiles):
                job = (tile, labels[store.read(tile, "cells")], positions, self.n_threads)
                gaps, found = self.run(_nearest_labeled, store, [job])[0]
                is_better = (gaps < squared) | ((gaps == squared) & (found < nearest))
                squared[is_better], nearest[is_better] = gaps[is_better], found[is_better]
            firsts, n_islands = _first_of_each(islands, squared, nearest), int(islands.max()) + 1
            labels = labels.copy()
            labels[cells] = labels[nearest[firsts]][islands]
        return labels, n_islands, np.empty(0, np.int32)

    def join_loose_pieces(self, labels: Ints, centers: Ints) -> Ints:
        """Return the same as `_core.join_loose_pieces`, with only loose cells in memory.

        A cell is loose if no path within its region connects it to the center of the region.
        """
        store, run = self.store, self.run
        own = [store.read(tile, "cells") for tile in range(store.n_tiles)]
        jobs = [
            (tile, labels[cells], labels[store.read(tile, "ghost_cells")])
            for tile, cells in enumerate(own)
        ]
        firsts = np.append(0, np.cumsum(run(_find_pieces, store, jobs)))
        found = run.all(_link_pieces, store, store.n_tiles, firsts, centers)
        with_center, pairs = zip(*found, strict=True)
        pieces = _components(np.concatenate(pairs, axis=1), firsts[-1])
        is_loose = ~np.isin(pieces, pieces[np.concatenate(with_center)])
        if not is_loose.any():
            return labels
        parts = np.split(is_loose, firsts[1:-1])
        found = run(_loose_cells, store, list(enumerate(parts)))
        arcs = Part.joined(found, "cells")
        loose = arcs.columns["cells"][labels[arcs.columns["cells"]] >= 0]
        arcs = arcs.take(np.searchsorted(arcs.columns["cells"], loose))
        entries = arcs.lists["arcs"].entries
        around = np.setdiff1d(entries["neighbors"], loose)
        cells = np.concatenate([loose, around])
        order = np.argsort(cells)
        neighbors = order[np.searchsorted(cells, entries["neighbors"], sorter=order)]
        offsets = np.append(arcs.lists["arcs"].offsets, np.full(len(around), len(neighbors)))
        joined = _core.join_loose_cells(
            offsets, neighbors.astype(np.int32), entries["lengths"], self.crease_limit,
            labels[cells], np.arange(len(loose), dtype=np.int32),
        )  # fmt: skip
        labels = labels.copy()
        labels[loose] = joined[: len(loose)]
        return labels

    def gathered(self, n_threads: int) -> _core.OrderedGraph:
        """Load this graph into memory, as a `_core.OrderedGraph`."""
        store, tiles = self.store, range(self.store.n_tiles)
        cells = [store.read(tile, "cells") for tile in tiles]
        positions, measures = np.empty((store.n_cells, 3)), np.empty(store.n_cells)
        offsets = np.zeros(store.n_cells + 1, np.int64)
        for tile in tiles:
            positions[cells[tile]] = store.read(tile, "positions")
            measures[cells[tile]] = store.read(tile, "measures")
            offsets[1:][cells[tile]] = np.diff(store.read(tile, "arcs/offsets"))
        np.cumsum(offsets, out=offsets)
        neighbors, lengths = np.empty(offsets[-1], np.int32), np.empty(offsets[-1], np.float32)
        for tile in tiles:
            _, at = rows(offsets, cells[tile])
            _, targets, lengths[at] = store.arcs(tile)
            neighbors[at] = store.cells_and_ghosts(tile)[targets]
        placed = _core.PlacedCells(positions, measures, n_threads)
        graph = _core.OrderedGraph(
            placed, offsets, neighbors, lengths, n_threads, True, self.straight_unit
        )
        graph.crease_limit = self.crease_limit
        return graph


@dataclass(eq=False)
class TiledCoarseGraph:
    """Graph of the coarse cells of all tiles, with the methods of `_core.CoarseGraph`."""

    graph: _core.OrderedGraph  # graph of all coarse cells, in memory
    # Graph of all cells. Array ``coarse`` of tile t contains the coarse cell of each cell, minus
    # firsts[t].
    fine: TiledGraph
    firsts: Longs  # (T + 1,) index of the first coarse cell of each tile

    def add_far_arcs(self, n_threads: int) -> None:
        """Add far arcs between coarse cells, as `_core.OrderedGraph.add_far_arcs` does."""
        self.graph.add_far_arcs(n_threads)

    def add_part_costs(self, rows: Singles, factor: float, n_threads: int) -> None:
        """Add costs between parts to arc lengths, as `_core.OrderedGraph.add_part_costs` does."""
        self.graph.add_part_costs(NO_GROUPS, rows, factor, n_threads)

    def coarse_cells(self, n_threads: int) -> Ints:
        """Return the numbers of all coarse cells, 0 to n - 1.

        `_core.CoarseGraph` returns the coarse cell of each cell instead. Here, costs between parts
        are stored for coarse cells (see `BorderRule.firsts`), which need no conversion.
        """
        return np.arange(self.graph.n_cells, dtype=np.int32)

    def spread(
        self,
        lengths: Array,
        labels: Ints,
        centers: Ints,
        n_threads: int,
        *,
        needs_lengths: bool = False,
    ) -> tuple[Array, Ints]:
        """Extend the labels and path lengths of coarse cells to labels of all cells.

        Returns no path lengths (an empty array), and the labels. Frees `graph` to save memory.
        """
        del self.graph
        store, waiting = self.fine.store, {}
        for tile, (begin, end) in enumerate(itertools.pairwise(self.firsts.tolist())):
            places = store.starts[tile] + store.read(tile, "coarse_centers").astype(np.int64)
            every = _proposals(places, lengths[begin:end], labels[begin:end])
            waiting[tile] = [every.take(np.flatnonzero(labels[begin:end] >= 0))]
        return lengths[:0], TiledRegions(self.fine, centers, waiting).labels()

    def refine(self, labels: Ints, centers: Ints, n_threads: int) -> Ints:
        """Return, for each region of coarse cells, its cell nearest to its mean position.

        Of equally near cells, the lowest is returned.
        """
        means = _core.region_means(self.graph, labels, len(centers))
        parts = np.split(labels, self.firsts[1:-1])
        jobs = [(tile, part, means) for tile, part in enumerate(parts)]
        found = self.fine.run(_nearest_to_means, self.fine.store, jobs)
        squared, cells = (np.array(column) for column in zip(*found, strict=True))
        is_least = (squared == squared.min(axis=0)) & (cells >= 0)
        lowest = np.where(is_least, cells, np.iinfo(np.int32).max).min(axis=0)
        return np.asarray(lowest, np.int32)


def _in_a_row(parts: list[Array]) -> Array:
    """Concatenate arrays; to save memory, remove each array from `parts` once it is copied."""
    end = sum(len(part) for part in parts)
    whole = np.empty((end, *parts[0].shape[1:]), parts[0].dtype)
    while parts:
        part = parts.pop()
        whole[end - len(part) : end] = part
        end -= len(part)
    return whole


def _divide(
    store: TileStore, tile: int, cell_size: int, steps: tuple[float, float], n_threads: int
) -> tuple[Floats, Floats]:
    """Divide a tile into coarse cells, and write them; return their positions and areas.

    `steps` contains `straight_unit` and `crease_limit` of `TiledGraph`. In the graph of the tile,
    ghosts follow the cells of the tile. Ghosts have no arcs, and their positions are not used.
    """
    straight_unit, crease_limit = steps
    n_ghosts = len(store.read(tile, "ghosts"))
    offsets, targets, lengths = store.arcs(tile)
    graph = _core.graph_in_place(
        np.concatenate([store.read(tile, "positions"), np.zeros((n_ghosts, 3))]),
        np.concatenate([store.read(tile, "measures"), np.zeros(n_ghosts)]),
        np.concatenate([offsets, np.full(n_ghosts, offsets[-1])]),
        targets, lengths, straight_unit, n_threads,
    )  # fmt: skip
    graph.crease_limit = crease_limit
    centers, positions, measures, coarse, lengths = _core.divide_tile(
        graph, store.size(tile), cell_size, n_threads
    )
    store.write(tile, "coarse", coarse)
    store.write(tile, "coarse_lengths", lengths)
    if straight_unit:
        store.write(tile, "coarse_centers", centers)
        store.write(tile, "coarse_positions", positions)
    return positions, measures


def _connect(
    store: TileStore, tile: int, firsts: Longs, straight_unit: float, n_threads: int
) -> tuple[Longs, Ints, Array]:
    """Return the arcs of the coarse cells of a tile: number of arcs per cell, targets, lengths."""
    ghosts = store.read(tile, "ghosts")
    tiles = store.tiles_of(ghosts)
    around = store.read_at("coarse", ghosts) + firsts[tiles]
    every = np.concatenate([store.read(tile, "coarse") + firsts[tile], around])
    lengths = [store.read(tile, "coarse_lengths"), store.read_at("coarse_lengths", ghosts)]
    # All coarse cells in this tile or next to it, in ascending order.
    used, coarse = np.unique(every, return_inverse=True)
    positions, of_coarse = np.empty((0, 3)), np.empty((0, 3))
    if straight_unit:
        positions = np.concatenate(
            [store.read(tile, "positions"), store.read_at("positions", ghosts)]
        )
        owners = np.searchsorted(firsts, used, side="right") - 1
        of_coarse = np.empty((len(used), 3))
        for other in np.unique(owners).tolist():
            is_its = owners == other
            of_coarse[is_its] = store.read(other, "coarse_positions")[used[is_its] - firsts[other]]
    offsets, targets, rounded = _core.connect_tile(
        *store.arcs(tile), coarse.reshape(-1).astype(np.int32), np.concatenate(lengths), positions,
        of_coarse, straight_unit, n_threads,
    )  # fmt: skip
    return np.diff(offsets), used[targets].astype(np.int32), rounded


def _nearest_to_means(
    store: TileStore, tile: int, labels: Ints, means: Floats
) -> tuple[Floats, Ints]:
    """Return, for each region, its cell in a tile that is nearest to its mean.

    `means` contains the mean position of each region. Returns squared distances, then cells. If a
    region has no cell in the tile, the distance is infinite and the cell is -1.
    """
    positions, cells = store.read(tile, "positions"), store.read(tile, "cells")
    return _core.nearest_of_regions(positions, cells, labels[store.read(tile, "coarse")], means)


UNREACHED = np.iinfo(np.uint64).max
"""Value of the path length for cells that no path has reached yet."""


class TiledRegions:
    """Assignment of all cells on disk to their nearest centers.

    The methods are the same as in `_core.Clustering`. Shortest paths are computed tile by tile. A
    path that leaves a tile is proposed to the tile in which it ends. When no proposals are left, no
    arc can shorten a path. Then each cell has its shortest path, or, of equally short paths, the
    path with the lowest label. The result does not depend on how cells are split into tiles.
    """

    def __init__(
        self, graph: TiledGraph, centers: Ints, waiting: dict[int, list[Part]] | None = None
    ) -> None:
        """Expand paths from the centers, and from the paths in `waiting`.

        `waiting` contains, for each tile, proposed paths (see `_proposals`).
        """
        self._graph = graph
        self._store = graph.store
        # Version number of each tile's paths on disk, or -1 if the tile has no paths yet.
        self._versions = dict.fromkeys(range(graph.store.n_tiles), -1)
        self._centers = centers
        self._expand(centers, 0, waiting or {})

    def centers(self) -> Ints:
        """Return the centers given by the caller, followed by the centers added for islands."""
        return self._centers

    def labels(self) -> Ints:
        """Return the label of each cell, by cell number; -1 for cells that no path has reached."""
        labels = np.empty(self._store.n_cells, np.int32)
        for tile, version in self._versions.items():
            cells = self._store.read(tile, "cells")
            labels[cells] = _paths_of(self._store, tile, version)[1][: len(cells)]
        return labels

    def adopt_orphans(self) -> None:
        """Make the lowest cell of each island a center.

        An island is a connected component without a center.
        """
        labels = self.labels()
        if labels.min() < 0:
            cells, _, islands = _find_islands(self._store, labels, self._graph.run)
            orphans = np.sort(cells[_first_of_each(islands, cells)])
            self._expand(orphans, len(self._centers), {})
            self._centers = np.concatenate([self._centers, orphans])

    def _expand(self, cells: Ints, first_label: int, waiting: dict[int, list[Part]]) -> None:
        """Add `cells` as centers with labels from `first_label` on, and expand all paths.

        `waiting` contains further proposed paths. The expansion ends when no path gets shorter.
        """
        labels = np.arange(first_label, first_label + len(cells), dtype=np.int32)
        places = np.empty(len(cells), np.int64)
        found = self._graph.run.all(find_cells, self._store, self._store.n_tiles, cells)
        for tile, (which, at) in enumerate(found):
            places[which] = self._store.starts[tile] + at
        self._add(waiting, _proposals(places, np.zeros(len(cells), np.uint64), labels))
        n_visits = 0
        for version in itertools.count(max(self._versions.values()) + 1):
            if not waiting:
                break
            # Serial runs process the tile that has waited longest. It has collected many proposals,
            # so the total number of visits is small.
            tiles = sorted(waiting) if self._graph.is_parallel else [next(iter(waiting))]
            jobs = []
            for tile in tiles:
                here = Part.joined(waiting.pop(tile))
                jobs.append((tile, self._versions[tile], version, here, self._graph.n_threads))
            found = self._graph.run(
                _improve, self._store, jobs, n_before=n_visits, n_after=len(waiting)
            )
            n_visits += len(jobs)
            for tile, proposals in zip(tiles, found, strict=True):
                self._store.remove(tile, f"paths{self._versions[tile]}")
                self._versions[tile] = version
                self._add(waiting, proposals)

    def _add(self, waiting: dict[int, list[Part]], proposals: Part) -> None:
        tiles = self._store.tiles_of(proposals.columns["places"])
        for tile in np.unique(tiles).tolist():
            waiting.setdefault(tile, []).append(proposals.take(np.flatnonzero(tiles == tile)))


def _proposals(places: Longs, lengths: Array, labels: Ints) -> Part:
    """Return a table of proposed paths: curve index of the last cell, length (uint64), label."""
    return Part({"places": places, "lengths": lengths, "labels": labels})


def _paths_of(store: TileStore, tile: int, version: int) -> tuple[Array, Ints]:
    """Return the lengths and labels of the paths to the cells of a tile and to its ghosts.

    `version` is the number of the version on disk, or -1 if there are no paths yet.
    """
    if version < 0:
        n_cells = store.size(tile) + len(store.read(tile, "ghosts"))
        return np.full(n_cells, UNREACHED, np.uint64), np.full(n_cells, -1, np.int32)
    packed = store.read(tile, f"paths{version}")
    lengths, labels = np.split(packed, [2 * len(packed) // 3])
    return lengths.view(np.uint64), labels


def _improve(
    store: TileStore, tile: int, version: int, next_version: int, proposals: Part, n_threads: int
) -> Part:
    """Apply proposed paths to a tile, expand them, and return proposed paths to other tiles.

    Paths are written as a new version, so that the job can be repeated if its worker is killed.
    """
    n_own, ghosts = store.size(tile), store.read(tile, "ghosts")
    known, found = _paths_of(store, tile, version), proposals.columns
    lengths, labels = _core.improve_paths(
        *store.arcs(tile), *known, (found["places"] - store.starts[tile]).astype(np.int32),
        found["lengths"], found["labels"], n_threads,
    )  # fmt: skip
    # Lengths and labels form one array, so that a killed worker cannot write only one of them.
    store.write(tile, f"paths{next_version}", np.concatenate([lengths.view(np.int32), labels]))
    is_better = (lengths[n_own:] != known[0][n_own:]) | (labels[n_own:] != known[1][n_own:])
    every = _proposals(ghosts, lengths[n_own:], labels[n_own:])
    return every.take(np.flatnonzero(is_better))


def _first_of_each(islands: Ints, *keys: Array) -> Longs:
    """Return, for each island, the index of its first cell in the order of `keys`."""
    order = np.lexsort([*reversed(keys), islands])
    return order[np.flatnonzero(np.diff(islands[order], prepend=-1))]


def _find_islands(store: TileStore, labels: Ints, run: Run) -> tuple[Ints, Floats, Ints]:
    """Return all cells labeled -1, their positions, and the island of each of these cells."""
    jobs = [(tile, labels[store.read(tile, "cells")]) for tile in range(store.n_tiles)]
    parts = run(_unlabeled, store, jobs)
    cells, positions = (np.concatenate([part[i] for part in parts]) for i in range(2))
    order = np.argsort(cells)
    pairs = np.concatenate([part[2] for part in parts], axis=1)
    pairs = order[np.searchsorted(cells, pairs, sorter=order)]
    return cells, positions, _components(pairs, len(cells))


def _components(pairs: Longs, n_nodes: int) -> Ints:
    """Return the connected component of each node of a graph; `pairs`, (2, P), are its edges."""
    sources, targets = pairs[:, np.argsort(pairs[0], kind="stable")]
    offsets = np.searchsorted(sources, np.arange(n_nodes + 1)).astype(np.int64)
    same = np.zeros(n_nodes, np.int32)
    return _core.find_components(offsets, targets.astype(np.int32), same)[0]


def _find_pieces(store: TileStore, tile: int, labels: Ints, of_ghosts: Ints) -> int:
    """Divide the regions in a tile into pieces that are connected in the tile.

    Writes the piece of each cell and ghost. Returns the number of pieces with cells of the tile.
    """
    offsets, targets = store.read(tile, "arcs/offsets"), store.read(tile, "arcs/targets")
    offsets = np.append(offsets, np.full(len(of_ghosts), offsets[-1]))  # ghosts have no arcs
    pieces = _core.find_components(offsets, targets, np.concatenate([labels, of_ghosts]))[0]
    n_own = int(pieces[: len(labels)].max()) + 1  # pieces without cells of the tile come last
    store.write(tile, "pieces", pieces)
    return n_own


def _link_pieces(store: TileStore, tile: int, firsts: Longs, centers: Ints) -> tuple[Longs, Longs]:
    """Return the pieces of a tile that contain centers, and pairs of pieces in different tiles.

    The pieces of a pair belong to one region, and an arc between the two tiles connects them.
    """
    ghosts, pieces = store.read(tile, "ghosts"), store.read(tile, "pieces").astype(np.int64)
    own, at_ghosts = np.split(firsts[tile] + pieces, [store.size(tile)])
    shared = np.flatnonzero(at_ghosts < firsts[tile + 1])
    found = store.read_at("pieces", ghosts[shared]) + firsts[store.tiles_of(ghosts[shared])]
    pairs = np.unique(np.stack([at_ghosts[shared], found]), axis=1)
    return own[find_cells(store, tile, centers)[1]], pairs


def _loose_cells(store: TileStore, tile: int, is_loose: Bools) -> Part:
    n_own = store.size(tile)
    chosen = np.flatnonzero(is_loose[store.read(tile, "pieces")[:n_own]])
    around, (offsets, targets, lengths) = store.cells_and_ghosts(tile), store.arcs(tile)
    offsets, at = rows(offsets, chosen)
    arcs = Lists(offsets, {"neighbors": around[targets[at]], "lengths": lengths[at]})
    return Part({"cells": around[chosen]}, {"arcs": arcs})


def _unlabeled(store: TileStore, tile: int, labels: Ints) -> tuple[Ints, Floats, Longs]:
    """Return the unlabeled cells of a tile, their positions, and their arcs as pairs of cells."""
    at = np.flatnonzero(labels < 0)
    around, (offsets, targets, _) = store.cells_and_ghosts(tile), store.arcs(tile)
    sources = np.repeat(np.arange(len(labels)), np.diff(offsets))
    is_inside = labels[sources] < 0  # then their targets are unlabeled, too
    pairs = np.stack([around[sources[is_inside]], around[targets[is_inside]]])
    return around[at], store.read(tile, "positions")[at], pairs.astype(np.int64)


def _nearest_labeled(
    store: TileStore, tile: int, labels: Ints, points: Floats, n_threads: int
) -> tuple[Floats, Ints]:
    """Return squared distances from points to the nearest labeled cell of a tile, and these cells.

    If the tile has no labeled cell, distances are infinite and cells -1.
    """
    cells = store.read(tile, "cells")
    at = np.flatnonzero(labels >= 0)
    if not len(at):
        return np.full(len(points), np.inf), np.full(len(points), -1, np.int32)
    at = at[np.argsort(cells[at])]  # sorted, because the first of equally near cells is used
    positions = store.read(tile, "positions")[at]
    found, _, _ = _core.nearest_points(positions, points, np.inf, n_threads)
    x, y, z = (positions[found] - points).T
    return x * x + y * y + z * z, cells[at[found]]
