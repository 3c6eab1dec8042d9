"""Stage 5 on tiles: straight borders, in a mesh of the faces around them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..cells.cell_graph import box_diagonal
from ..cells.surface import Surface
from ..mesh.faces import FaceMesh
from ..mesh.polygon_mesh import PolygonMesh
from ..regions.edit import BorderCosts
from ..regions.smooth import MAX_CHAIN, MAX_DISTANCE, MAX_SWEEPS
from .arcs import ArcFacts
from .faces import is_among, mesh_of, read_corners, rows
from .sorting import stable_order
from .store import Run, TileStore, find_cells

__all__ = ["smooth_tiled", "with_labels"]

Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]

RINGS = 5
"""Rings of faces around borders, and again around every face that needs more."""


def smooth_tiled(
    store: TileStore, facts: ArcFacts, labels: Ints, centers: Ints, scale: float, run: Run,
    n_threads: int,
) -> None:  # fmt: skip
    """Change labels to straight borders, as `straighten` makes them of all faces at once.

    Moves are considered for faces at borders, and next to faces that have moved. All that is read
    for one is around its corners. So it suffices to have the faces some rings around the borders;
    where moves of a face at the rim of these were considered, more rings are added around it, and
    all is done again.
    """
    marks = _Marks(store, run)
    marks.take(with_labels(_mark_borders, store, labels, run))
    while True:
        band = _Band.gathered(store, facts, run, n_threads)
        if not len(band.cells):
            return
        moved, examined = band.smoothed(facts, labels[band.cells], centers, scale)
        if not len(examined):
            break
        more = band.cells[examined]
        del band  # or there would be two of them
        jobs = [(tile, more) for tile in range(store.n_tiles)]
        marks.take(run(_mark_more, store, jobs))
    labels[band.cells] = moved


def with_labels(work: Callable[..., Any], store: TileStore, labels: Ints, run: Run) -> list[Any]:
    """What work on each tile returns, which finds in ``labels`` those of places and ghosts."""
    tiles = range(store.n_tiles)
    for tile in tiles:
        around = np.concatenate([store.read(tile, "cells"), store.read(tile, "ghost_cells")])
        store.write(tile, "labels", labels[around])
    results = run(work, store, [(tile,) for tile in tiles])
    store.remove_from_all("labels")
    return results


class _Marks:
    """How many rings each vertex that several tiles share stands for.

    A vertex marked with n > 0 brings in all faces that have it, whose other vertices are then
    marked with n - 1 at least. Each tile keeps the marks of its vertices as ``rings``.
    """

    def __init__(self, store: TileStore, run: Run) -> None:
        self._store = store
        self._run = run
        ids = [store.read(tile, "shared_ids") for tile in range(store.n_tiles)]
        every = np.unique(np.concatenate(ids))
        self._at = [np.searchsorted(every, some) for some in ids]
        self._rings = np.zeros(len(every), np.uint8)

    def take(self, marks: list[Bytes]) -> None:
        """Take the marks of all tiles, and spread them until tiles agree."""
        known = dict(enumerate(marks))
        changed = list(known)
        while changed:
            for tile in changed:
                at = self._at[tile]
                self._rings[at] = np.maximum(self._rings[at], known[tile])
            wanted = [(tile, self._rings[at]) for tile, at in enumerate(self._at)]
            jobs = [(tile, rings) for tile, rings in wanted if (rings != known[tile]).any()]
            changed = [tile for tile, _ in jobs]
            known.update(zip(changed, self._run(_mark_shared, self._store, jobs), strict=True))


def _mark_borders(store: TileStore, tile: int) -> Bytes:
    """Mark the vertices around the faces of a tile that have a neighbor of another label."""
    arcs = store.read(tile, "arc_offsets"), store.read(tile, "arc_targets")
    is_at_border = _core.cells_at_borders(*arcs, store.read(tile, "labels"))
    rings = np.zeros(len(store.read(tile, "vertex_ids")), np.uint8)
    return _mark_faces(store, tile, rings, np.flatnonzero(is_at_border))


def _mark_more(store: TileStore, tile: int, cells: Ints) -> Bytes:
    """Mark the vertices around some faces."""
    rings = store.read(tile, "rings").copy()
    return _mark_faces(store, tile, rings, find_cells(store, tile, cells)[1])


def _mark_faces(store: TileStore, tile: int, rings: Bytes, faces: Longs) -> Bytes:
    offsets, corners = read_corners(store, tile)
    rings[corners[rows(offsets, faces)[1]]] = RINGS
    return _spread(store, tile, offsets, corners, rings)


def _mark_shared(store: TileStore, tile: int, marks: Bytes) -> Bytes:
    """Take the marks of shared vertices."""
    rings = store.read(tile, "rings").copy()
    rings[store.read(tile, "shared")] = marks
    return _spread(store, tile, *read_corners(store, tile), rings)


def _spread(store: TileStore, tile: int, offsets: Longs, corners: Ints, rings: Bytes) -> Bytes:
    """Write the marks of a tile; return those of the vertices that it shares."""
    rings = _core.spread_rings(offsets, corners, rings)
    store.write(tile, "rings", rings)
    marks: Bytes = rings[store.read(tile, "shared")]
    return marks


@dataclass(frozen=True, eq=False)
class _Band:
    """The faces that have a marked vertex.

    Those at the rim have a vertex that is not marked: there faces may be missing, and arcs are.

    Attributes
    ----------
    cells, rim : ndarray of int32
        Numbers in the input, ascending, and which are at the rim.
    surface : Surface
    lengths : ndarray of float32
        Of the arcs, as borders take them.
    """

    cells: Ints
    rim: Ints
    surface: Surface
    lengths: npt.NDArray[np.float32]

    @classmethod
    def gathered(cls, store: TileStore, facts: ArcFacts, run: Run, n_threads: int) -> _Band:
        """Bring the faces of all tiles together."""
        lengths = "border_lengths" if facts.rule.has_prices else "lengths"
        tiles = range(store.n_tiles)
        sizes = _Sizes(*np.array(run(_write_band, store, [(tile, lengths) for tile in tiles])).T)
        return _Gathering(store, sizes).band(n_threads)

    def smoothed(
        self, facts: ArcFacts, labels: Ints, centers: Ints, scale: float
    ) -> tuple[Ints, Ints]:
        """Labels of the band, and the faces of its rim for which moves were considered."""
        unit = facts.price_unit if facts.rule.has_prices else facts.unit
        costs = BorderCosts(self.surface, self.lengths, unit, scale)
        at = np.minimum(np.searchsorted(self.cells, centers), len(self.cells) - 1)
        fixed = at[self.cells[at] == centers].astype(np.int32)
        limits = (MAX_DISTANCE * costs.radius, MAX_CHAIN, MAX_SWEEPS, self.surface.n_threads)
        return _core.smooth_part(*costs.args, labels, fixed, *limits, self.rim)


@dataclass(frozen=True, eq=False)
class _Sizes:
    """What each tile adds to the band."""

    corners: Longs
    vertices: Longs
    arcs: Longs


def _write_band(store: TileStore, tile: int, lengths: str) -> tuple[int, int, int]:
    """Write what the band takes of a tile; return the numbers of its corners, vertices, arcs.

    Corners are rows of the vertices that are used, of which some are shared; arcs lead to places
    of the tile and its ghosts.
    """
    sides = store.read(tile, "arc_sides")
    chosen, rim, corner_counts, corners, used, arc_counts, arcs = _core.cut_band(
        *read_corners(store, tile),
        store.read(tile, "rings"),
        store.read(tile, "arc_offsets"),
        sides.astype(np.int32),
    )
    numbers = np.full(len(store.read(tile, "rings")), -1, np.int32)
    numbers[used] = np.arange(len(used))
    arrays = {
        "chosen": chosen,
        "rim": rim,
        "corner_counts": corner_counts,
        "corners": corners,
        "vertices": store.read(tile, "vertices").take(used, axis=0),
        "shared": numbers[store.read(tile, "shared")],
        "arc_counts": arc_counts,
        "targets": store.read(tile, "arc_targets")[arcs],
        "sides": sides[arcs],
        "lengths": store.read(tile, lengths)[arcs],
    }
    for name, array in arrays.items():
        store.write(tile, f"band_{name}", array)
    return len(corners), len(used), len(arcs)


class _Gathering:
    """Puts faces in the order of the input, one tile after the other."""

    def __init__(self, store: TileStore, sizes: _Sizes) -> None:
        self._store = store
        self._sizes = sizes
        tiles = range(store.n_tiles)
        cells = [store.read(tile, "cells")[self._read(tile, "chosen")] for tile in tiles]
        ends = np.cumsum([len(some) for some in cells])
        every = np.concatenate(cells)
        order = stable_order(every.view(np.uint32))
        self._cells = every[order]
        numbers = np.empty(len(every), np.int32)
        numbers[order] = np.arange(len(every), dtype=np.int32)
        self._at = np.split(numbers, ends[:-1])  # the faces of each tile
        self._ghosts = [self._numbers_of(store.read(tile, "ghost_cells")) for tile in tiles]

    def _numbers_of(self, cells: Ints) -> Ints:
        """The faces of the band that some cells are; -1 for others."""
        at = np.searchsorted(self._cells, cells).astype(np.int32)
        at[~is_among(cells, self._cells)] = -1
        return at

    def band(self, n_threads: int) -> _Band:
        """The band."""
        offsets, neighbors, sides, lengths = self._arcs()
        surface = _surface_of(self._mesh(), offsets, neighbors, sides, n_threads)
        rims = [at[self._read(tile, "rim")] for tile, at in enumerate(self._at)]
        return _Band(self._cells, np.concatenate(rims), surface, lengths)

    def _mesh(self) -> FaceMesh:
        """The faces, with vertices that tiles share first, then those of each tile."""
        store = self._store
        ids = [store.read(tile, "shared_ids") for tile in range(store.n_tiles)]
        every = np.unique(np.concatenate(ids))
        begin = len(every)
        vertices = np.zeros((begin + self._sizes.vertices.sum(), 3))
        offsets = self._offsets("corner_counts")
        corners = np.empty(self._sizes.corners.sum(), np.int32)
        for tile, at in enumerate(self._at):
            points, shared = self._read(tile, "vertices"), self._read(tile, "shared")
            numbers = np.arange(begin, begin + len(points), dtype=np.int32)
            numbers[shared[shared >= 0]] = np.searchsorted(every, ids[tile][shared >= 0])
            vertices[numbers] = points
            corners[rows(offsets, at)[1]] = numbers[self._read(tile, "corners")]
            begin += len(points)
        return mesh_of(store, vertices, offsets, corners)

    def _arcs(self) -> tuple[Longs, Ints, npt.NDArray[Any], npt.NDArray[np.float32]]:
        """Offsets, neighbors, sides and lengths of the arcs."""
        n_arcs = self._sizes.arcs.sum()
        offsets = self._offsets("arc_counts")
        neighbors, lengths = np.empty(n_arcs, np.int32), np.empty(n_arcs, np.float32)
        sides = np.empty(n_arcs, self._read(0, "sides").dtype)
        for tile, at in enumerate(self._at):
            arcs = rows(offsets, at)[1]
            numbers = np.full(self._store.size(tile), -1, np.int32)
            numbers[self._read(tile, "chosen")] = at
            numbers = np.concatenate([numbers, self._ghosts[tile]])
            neighbors[arcs] = numbers[self._read(tile, "targets")]
            sides[arcs] = self._read(tile, "sides")
            lengths[arcs] = self._read(tile, "lengths")
        return offsets, neighbors, sides, lengths

    def _offsets(self, name: str) -> Longs:
        """Where the rows of each face begin, of some number of entries."""
        offsets = np.zeros(len(self._cells) + 1, np.int64)
        for tile, at in enumerate(self._at):
            offsets[1:][at] = self._read(tile, name)
        return np.cumsum(offsets, out=offsets)

    def _read(self, tile: int, name: str) -> npt.NDArray[Any]:
        return self._store.read(tile, f"band_{name}")


def _surface_of(
    mesh: FaceMesh,
    offsets: Longs,
    neighbors: Ints,
    sides: npt.NDArray[Any],
    n_threads: int,
) -> Surface:
    """A surface of which lengths are asked for, and no angles."""
    handle: _core.Surface
    if isinstance(mesh, PolygonMesh):
        faces = mesh.vertices, mesh.offsets, mesh.indices
        turns = np.zeros(len(neighbors), np.uint8)
        handle = _core.PolygonSurface(*faces, offsets, neighbors, sides, turns, False, n_threads)
    else:
        turns = np.empty(0, np.uint8)
        handle = _core.TriangleSurface(
            mesh.vertices, mesh.faces, offsets, neighbors, sides, turns, False
        )
    diagonal = box_diagonal(mesh.bounds)
    return Surface(handle, offsets, neighbors, mesh.bounds, diagonal, n_threads)
