"""Stage 5 on tiles: smooth the borders of regions, with only the cells near borders in memory."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from .. import _core
from .._types import Array, Bools, Bytes, Floats, Ints, Longs
from ..batches.mapping import Run
from ..clustering.parts import PartCosts
from ..regions.edit import CREASE_SCALE, BorderCosts
from ..regions.smooth import SmoothOptions
from .arrays import is_among, rows
from .part import Part, surface_of, with_neighbors
from .store import TileStore, find_cells

STEPS = {"triangles": 14, "polygons": 10, "points": 8}
"""Initial width of the band, which contains the cells near borders and is in memory. The width is
the number of arcs from a border to the outer edge of the band. It is larger for triangles, because
a path across triangles takes about two arcs per edge length."""

MAX_STEPS = 160
"""Maximum number of arcs by which the band grows each time that smoothing starts again."""

SUM_BLOCK = 1 << 14
"""Number of cells per block in sums over the cells of regions. It must equal ``kBlock`` in the C++
file ``stiffness.cpp``, so that sums are equal to the last bit."""


def _names(store: TileStore, *arcs: str) -> tuple[str, ...]:
    """Return the names of all arrays that smoothing needs, including `arcs`, arrays of arcs."""
    of_faces, of_points = ("corners", "corners/vertices"), ("positions", "measures")
    columns = of_points if store.kind == "points" else of_faces
    return "cells", "coarse", *columns, *(f"arcs/{name}" for name in arcs)


@dataclass(frozen=True, eq=False)
class BorderRule:
    """Parameters of the cost of region borders, and of the smoothing that minimizes this cost."""

    lengths: str  # name of the array that contains the lengths of arcs
    unit: float  # weight that corresponds to a length of 1
    scale: float  # expected radius of a region, or the diagonal of the bounding box if it is 0
    n_threads: int
    crease_scale: float = CREASE_SCALE  # see `BorderCosts`
    smoothing: SmoothOptions = field(default_factory=SmoothOptions)
    part_costs: PartCosts | None = None  # for cells or, if `firsts` is given, for coarse cells
    firsts: Longs | None = None  # (T + 1,) index of the first coarse cell of each tile

    def costs(self, store: TileStore, part: Part) -> BorderCosts:
        """Return the border costs of a part, and remove its array ``lengths`` to save memory."""
        surface = surface_of(store, part, self.n_threads)
        lengths = part.lists["arcs"].entries.pop("lengths")
        if (costs := self.part_costs) is not None:
            cells = part.columns["cells" if self.firsts is None else "coarse"]
            if len(costs.group_of):
                costs = replace(costs, group_of=costs.group_of[cells])
            else:
                costs = replace(costs, vectors=costs.vectors[cells])
            lengths = costs.border_lengths(surface.arcs, lengths, self.n_threads)
        return BorderCosts(surface, lengths, self.unit, self.scale, self.crease_scale)


def straighten_tiled(
    store: TileStore, rule: BorderRule, labels: Ints, centers: Ints, run: Run
) -> None:
    """Smooth borders by changing labels in place, like `smooth_borders` on the whole mesh or cloud.

    Only the *band* is in memory: all cells within `STEPS` arcs of a border. C++ code tries to move
    cells at borders, and each trial reads only nearby cells. Cells at the outer edge of the band
    lack neighbors. If the code tries to move one of them, the band grows around this cell, and
    smoothing starts again.
    """
    sums = np.empty(0), np.empty((0, 3))
    if rule.smoothing.stiffness:
        sums = region_sums(store, labels, len(centers), run)
    marks = _Marks(store, run)
    marks.begin(labels)
    while True:
        band = _Band.gathered(store, rule, run)
        if not len(band.part):
            return
        cells = band.part.columns["cells"]
        moved, growing = band.straightened(rule, labels[cells], centers, sums)
        if not len(growing):
            break
        more = cells[growing]
        del band  # to free memory before the next band is loaded
        marks.add(more)
    labels[cells] = moved


def region_sums(store: TileStore, labels: Ints, n_regions: int, run: Run) -> tuple[Floats, Floats]:
    """Return, for each region, its area, and the area-weighted sum of the positions of its cells.

    The order of additions is the same as in the C++ function `sums_of_regions`: first, consecutive
    cells of a block with equal labels are summed, then these sums are added in the order of cells.
    """
    cuts = np.stack(run.all(_sort_by_cell, store, store.n_tiles))
    sums = np.zeros((4, n_regions))
    for block in range(cuts.shape[1] - 1):
        found = [
            Part.load(store.scratch, f"tile{tile}/by_cell", _BY_CELL, begin, end)
            for tile, (begin, end) in enumerate(cuts[:, block : block + 2].tolist())
            if begin < end
        ]
        _add_block(sums, Part.joined(found, "cells"), labels)
    store.remove_from_all(*(f"by_cell/{name}" for name in _BY_CELL))
    return sums[0], np.ascontiguousarray(sums[1:].T)


_BY_CELL = ("cells", "measures", "positions")


def _sort_by_cell(store: TileStore, tile: int) -> Longs:
    """Write the cells of a tile sorted by number; return rows that split the cells into groups.

    A group has cells with up to 16 * `SUM_BLOCK` consecutive numbers. The rows are the first row of
    each group, and the number of cells in the tile.
    """
    part = Part({name: store.read(tile, name) for name in _BY_CELL})
    part = part.take(np.argsort(part.columns["cells"]))
    part.save(store.scratch, f"tile{tile}/by_cell")
    size = 16 * SUM_BLOCK
    return np.searchsorted(part.columns["cells"], np.arange(0, store.n_cells + size, size))


def _add_block(sums: Floats, part: Part, labels: Ints) -> None:
    """Add the area, and the area times the position, of each cell in `part` to `sums`."""
    cells, measures = part.columns["cells"], part.columns["measures"]
    of_cells = labels[cells]
    begins = (np.diff(of_cells, prepend=-1) != 0) | (cells % SUM_BLOCK == 0)
    rows, firsts = np.cumsum(begins) - 1, of_cells[begins]
    regions = np.concatenate([np.arange(sums.shape[1]), firsts])
    # np.bincount adds values in the order of the array, as the C++ core does.
    for axis, some in enumerate((measures, *(measures * x for x in part.columns["positions"].T))):
        runs = np.bincount(rows, some)
        sums[axis] = np.bincount(regions, np.concatenate([sums[axis], runs]))


class _Marks:
    """Marks of all cells: 0 outside the band, 1 at its outer edge, and higher values near borders.

    The array ``steps`` of a tile contains the marks of its cells, and after them the marks of its
    ghosts, which are neighbors of its cells in other tiles.
    """

    def __init__(self, store: TileStore, run: Run) -> None:
        self._store = store
        self._run = run
        self._n_steps = STEPS[store.kind]
        self._known: dict[int, Bytes] = {}  # latest marks of the ghosts of each tile

    def begin(self, labels: Ints) -> None:
        """Mark all cells that have a neighbor with another label, and the cells around them."""
        store = self._store
        for tile in range(store.n_tiles):
            store.write(tile, "labels", labels[store.cells_and_ghosts(tile)])
        self._spread(self._run.all(_mark_borders, store, store.n_tiles, self._n_steps))
        store.remove_from_all("labels")

    def add(self, cells: Ints) -> None:
        """Double the width, and mark the cells within this number of arcs of `cells`.

        The width is at most `MAX_STEPS`.
        """
        self._n_steps = min(2 * self._n_steps, MAX_STEPS)
        store = self._store
        self._spread(self._run.all(_mark_cells, store, store.n_tiles, cells, self._n_steps))

    def _spread(self, found: list[Bytes]) -> None:
        """Send the marks of ghosts to the tiles that contain these cells, until no mark changes."""
        store, news = self._store, dict(enumerate(found))
        while news:
            places, steps = [np.empty(0, np.int64)], [np.empty(0, np.uint8)]
            for tile, marks in news.items():
                at = np.flatnonzero(marks > self._known.get(tile, 0))
                places.append(store.read(tile, "ghosts")[at])
                steps.append(marks[at])
                self._known[tile] = marks
            every, marked = np.concatenate(places), np.concatenate(steps)
            tiles = store.tiles_of(every)
            chosen = {tile: tiles == tile for tile in np.unique(tiles).tolist()}
            jobs = [(tile, every[some], marked[some]) for tile, some in chosen.items()]
            news = dict(zip(chosen, self._run(_mark_places, store, jobs), strict=True))


def _mark_borders(store: TileStore, tile: int, n_steps: int) -> Bytes:
    """Mark cells of a tile near borders of regions; return the marks of the ghosts of the tile."""
    arcs = store.read(tile, "arcs/offsets"), store.read(tile, "arcs/targets")
    labels = store.read(tile, "labels")
    steps = np.zeros(len(labels), np.uint8)
    front = np.flatnonzero(_core.cells_at_borders(*arcs, labels))
    return _spread(store, tile, steps, front, np.uint8(n_steps))


def _mark_cells(store: TileStore, tile: int, cells: Ints, n_steps: int) -> Bytes:
    """Mark the cells of a tile in and near `cells`; return the marks of the ghosts of the tile."""
    places = store.starts[tile] + find_cells(store, tile, cells)[1]
    return _mark_places(store, tile, places, np.uint8(n_steps))


def _mark_places(store: TileStore, tile: int, places: Array, marks: Bytes | np.uint8) -> Bytes:
    """Raise the marks of a tile at the curve indices `places`, and marks nearby; see `_spread`."""
    steps = store.read(tile, "steps").copy()
    return _spread(store, tile, steps, places - store.starts[tile], marks)


def _spread(
    store: TileStore, tile: int, steps: Bytes, front: Longs, marks: Bytes | np.uint8
) -> Bytes:
    """Raise the marks of the cells `front` to `marks`, and write all marks of the tile.

    The raised marks spread to nearby cells of the tile, and decrease by 1 per arc. No mark is
    lowered. Returns the marks of the ghosts.
    """
    offsets, targets = store.read(tile, "arcs/offsets"), store.read(tile, "arcs/targets")
    n_own, is_new = store.size(tile), np.zeros(len(steps), bool)
    is_raised = steps[front] < marks
    np.maximum.at(steps, front, marks)
    front = front[is_raised]
    for left in range(int(steps[front].max(initial=0)), 1, -1):
        is_new[front[steps[front] == left]] = True
        near = targets[rows(offsets, np.flatnonzero(is_new[:n_own]))[1]]
        is_new[:] = False
        near = near[steps[near] < left - 1]
        steps[near] = left - 1
        is_new[near] = True
    store.write(tile, "steps", steps)
    return steps[n_own:]


def _write_band(
    store: TileStore, tile: int, lengths: str, firsts: Longs | None
) -> tuple[Ints, Ints]:
    """Write the marked cells of a tile and their arcs; return their curve indices and numbers."""
    n_own = store.size(tile)
    chosen = np.flatnonzero(store.read(tile, "steps")[:n_own])
    part = Part.of_tile(store, tile, _names(store, "targets", "sides", lengths)).take(chosen)
    entries = part.lists["arcs"].entries
    own = np.arange(store.starts[tile], store.starts[tile] + n_own, dtype=np.int32)
    around = np.concatenate([own, store.read(tile, "ghosts").astype(np.int32)])
    entries["targets"] = around[entries["targets"]]
    entries["lengths"] = entries.pop(lengths)
    if firsts is not None:  # numbers that are unique among all tiles
        part.columns["coarse"] = part.columns["coarse"] + np.int32(firsts[tile])
    part.save(store.scratch, f"tile{tile}/band")
    return part.columns["places"], part.columns["cells"]


def _load_band(store: TileStore, ends: str, tile: int) -> Part:
    names = "places", *_names(store, ends, "sides", "lengths")
    return Part.load(store.scratch, f"tile{tile}/band", names)


def _connect(store: TileStore, tile: int, places: Ints, ranks: Ints) -> Array:
    """Replace the targets of arcs by ranks of cells in the band; return the *ends* of the band.

    The rank of a cell is its index in the band, which is sorted by cell number. `places` contains
    the curve indices of all cells of the band, and `ranks` their ranks. For faces, ends are the
    vertices of all sides across which an arc leaves the band. For points, ends are the ranks of the
    points with an arc to a point outside the band.
    """
    part, is_cloud = _load_band(store, "targets", tile), store.kind == "points"
    connected, left_out = with_neighbors(part, places, ranks, sorts=is_cloud)
    connected.save(store.scratch, f"tile{tile}/band")
    store.remove(tile, "band/arcs/targets")
    arcs = part.lists["arcs"]
    cells = np.searchsorted(arcs.offsets, left_out, side="right") - 1
    if is_cloud:
        return ranks[np.searchsorted(places, part.columns["places"][cells])]
    offsets, corners = part.corners()
    first = offsets[cells] + arcs.entries["sides"][left_out]
    next_one = np.where(first + 1 == offsets[cells + 1], offsets[cells], first + 1)
    return np.unique(part.vertices["ids"][corners[np.concatenate([first, next_one])]])


@dataclass(frozen=True, eq=False)
class _Band:
    """The cells of all tiles that are near borders of regions, sorted by cell number."""

    store: TileStore
    part: Part
    ends: Array  # vertices (or ranks of points) where arcs leave the band, see `_connect`

    @classmethod
    def gathered(cls, store: TileStore, rule: BorderRule, run: Run) -> _Band:
        """Collect the marked cells of all tiles in a band."""
        found = run.all(_write_band, store, store.n_tiles, rule.lengths, rule.firsts)
        places, cells = (np.concatenate(column) for column in zip(*found, strict=True))
        ranks = np.empty(len(cells), np.int32)
        ranks[np.argsort(cells)] = np.arange(len(cells))
        ends = [_connect(store, tile, places, ranks) for tile in range(store.n_tiles)]
        part = Part.joined_from(partial(_load_band, store, "neighbors"), store.n_tiles, "cells")
        return cls(store, part, np.unique(np.concatenate(ends)))

    def straightened(
        self, rule: BorderRule, labels: Ints, centers: Ints, sums: tuple[Floats, Floats]
    ) -> tuple[Ints, Ints | Longs]:
        """Return new labels of the cells of the band, and the cells around which it must grow.

        The labels are final only if there are no cells around which the band must grow.
        """
        costs, cells = rule.costs(self.store, self.part), self.part.columns["cells"]
        at = np.minimum(np.searchsorted(cells, centers), len(cells) - 1)
        fixed = at[cells[at] == centers].astype(np.int32)
        edge = np.flatnonzero(self._is_at_edge()).astype(np.int32)
        options = rule.smoothing.for_core(costs.radius)
        moved, examined = _core.smooth_part(
            *costs.args, labels, fixed, edge, *sums, options, rule.n_threads
        )
        return moved, self._at_ends_of(examined)

    def _at_ends_of(self, cells: Ints) -> Ints | Longs:
        """Return all faces that have a vertex of `ends` in common with a face in `cells`.

        If holes in a mesh meet at a vertex, a path between two faces at the vertex may have many
        arcs. The band must also grow around the face that lacks a neighbor. Points are returned
        unchanged.
        """
        if self.store.kind == "points":
            return cells
        offsets, corners = self.part.corners()
        is_touched = np.zeros(len(self.part.vertices["ids"]), bool)
        is_touched[corners[rows(offsets, cells)[1]]] = True
        return np.flatnonzero(self._have_end(is_touched))

    def _have_end(self, is_chosen: bool | Bools = True) -> Bools:
        """Return, for each face, whether one of its vertices is in both `ends` and `is_chosen`."""
        offsets, corners = self.part.corners()
        is_end = is_among(self.part.vertices["ids"], self.ends) & is_chosen
        return np.logical_or.reduceat(is_end[corners], offsets[:-1])

    def _is_at_edge(self) -> Bools:
        """Return, for each cell, whether moving it to another region reads cells outside the band.

        Moving a face reads the faces at its corners. Moving a point reads neighbors of neighbors.
        """
        if self.store.kind != "points":
            return self._have_end()
        arcs = self.part.lists["arcs"]
        is_at_edge = np.zeros(len(self.part), bool)
        is_at_edge[self.ends] = True
        is_at_edge[arcs.entries["neighbors"][rows(arcs.offsets, self.ends)[1]]] = True
        return is_at_edge
