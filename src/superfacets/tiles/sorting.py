"""Stages 0 and 1 on disk: cells sorted along the space-filling curve, and cut into tiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import MAX_CELLS, check_extent, raise_index_error
from ..errors import MeshError
from ..io.readers.text import runs
from .arrays import box_of, joined_boxes, stable_order
from .mapping import run_all
from .reading import Faces, MeshPieces, Rows, take_rows
from .scratch import Scratch
from .store import RANGE, Run, TileStore, tile_starts
from .sums import BlockedSum
from .welding import check_vertices, weld

__all__ = ["LOW_BITS", "find_cuts", "make_tiles"]

LOW_BITS = 15
"""Codes have twice as many. They are counted by their upper bits first, then by the lower ones of
those on a border of tiles."""

MAX_SPAN = 1 << 26
"""Vertices of a tile are found in a table where their numbers are within such a range."""


class _Measured(NamedTuple):
    """What is known of a chunk of faces."""

    bounds: npt.NDArray[np.float64]  # (2, 3) box of the vertices that faces use
    curve: npt.NDArray[np.float64]  # (2, 3) box of the centroids
    areas: npt.NDArray[np.float64]  # sums of the blocks that the core sums by


class _Facts(NamedTuple):
    """The same of all faces."""

    bounds: npt.NDArray[np.float64]
    curve: npt.NDArray[np.float64]
    total_measure: float


@dataclass(frozen=True)
class _Chunks:
    """Faces in the order of the input, of which `size` are read at a time."""

    pieces: MeshPieces
    lowest: Rows | None
    """The vertex that stands for each; None where each stands for itself."""
    size: int
    n_threads: int

    @property
    def n_chunks(self) -> int:
        """How many there are."""
        return -(-self.pieces.n_faces // self.size)

    def begin(self, chunk: int) -> int:
        """The first face of a chunk."""
        return chunk * self.size

    def read(self, chunk: int) -> tuple[Faces, npt.NDArray[Any]]:
        """The faces of a chunk with welded vertices, and the position of each corner, (c, 3).

        A MeshError names the first corner that is no vertex.
        """
        begin = self.begin(chunk)
        faces = self.pieces.faces(begin, min(begin + self.size, self.pieces.n_faces))
        corners, n_vertices = faces.corners, self.pieces.vertices.n_rows
        if corners.min() < 0 or corners.max() >= n_vertices:
            place = int(np.argmax((corners < 0) | (corners >= n_vertices)))
            raise_index_error(begin + faces.face_of(place), int(corners[place]), n_vertices)
        if self.lowest is not None:
            corners = take_rows(self.lowest, corners, self.most)
        return Faces(corners, faces.offsets), take_rows(self.pieces.vertices, corners, self.most)

    @property
    def most(self) -> int:
        """Vertices to have in memory at a time."""
        return 2 * self.size


def make_tiles(
    pieces: MeshPieces, scratch: Scratch, tile_cells: int, *, welds: bool, run: Run, n_threads: int
) -> TileStore:
    """Sort the faces of a mesh along the curve, as in memory, and write them tile by tile.

    No more than about `tile_cells` faces, or as many vertices, are in memory at a time. The input
    is read three times: to weld its vertices, for the box of all centroids, and to write each chunk
    of faces sorted by code (once less where there is room for what was read). How much tiles take
    of each of these runs is found by counting codes; then each tile is merged. Each pass but the
    counting runs on all workers.

    Parameters
    ----------
    pieces : MeshPieces
    scratch : Scratch
    tile_cells : int
        Faces in a tile, at most; rounded up to a multiple of `RANGE`.
    welds : bool
        Whether vertices at the same position count as one.
    run : Run
    n_threads : int
        Of the core, where a piece is worked on.

    Raises
    ------
    MeshError
        As `Mesh`: the first wrong coordinate or index is named; or if there are too many faces.
    """
    if pieces.n_faces > MAX_CELLS:
        raise MeshError(f"the mesh has {pieces.n_faces} faces; at most {MAX_CELLS} are supported")
    size = -(-tile_cells // RANGE) * RANGE
    if welds:
        lowest: Rows | None = weld(run, scratch, pieces.vertices, size, n_threads)
    else:
        check_vertices(run, scratch, pieces.vertices, size)
        lowest = None
    chunks = _Chunks(pieces, lowest, size, n_threads)
    facts = _summed_up(run_all(run, _measure_chunk, scratch, chunks.n_chunks, chunks))
    counts = np.stack(run_all(run, _sort_chunk, scratch, chunks.n_chunks, chunks, *facts.curve))
    starts = tile_starts(pieces.n_faces, -(-pieces.n_faces // size))
    scratch.remove_folder("representatives")
    scratch.save("cuts", find_cuts(scratch, counts, np.array(starts)))
    kind: Literal["triangles", "polygons"] = "triangles" if pieces.offsets is None else "polygons"
    store = TileStore(scratch, kind, starts, facts.bounds, facts.curve, facts.total_measure)
    run_all(run, _write_tile, store, store.n_tiles, n_threads)
    scratch.remove_folder("runs")
    return store


def _summed_up(found: list[_Measured]) -> _Facts:
    areas = 0.0
    for partial in np.concatenate([part.areas for part in found]).tolist():
        areas += partial
    bounds = joined_boxes([part.bounds for part in found])
    check_extent(*bounds)
    return _Facts(bounds, joined_boxes([part.curve for part in found]), areas)


def _measure_chunk(scratch: Scratch, chunk: int, chunks: _Chunks) -> _Measured:
    faces, positions = chunks.read(chunk)
    _keep_chunk(scratch, chunk, faces, positions)
    corners = positions.astype(np.float64)
    every = np.arange(len(corners), dtype=np.int32)
    centroids, areas = _measured(corners, every, faces.offsets, chunks.n_threads)
    sums = [
        _core.sum_of(areas[first : first + BlockedSum.BLOCK], 1)
        for first in range(0, len(areas), BlockedSum.BLOCK)
    ]
    return _Measured(box_of(corners), box_of(centroids), np.array(sums))


def _keep_chunk(scratch: Scratch, chunk: int, faces: Faces, positions: npt.NDArray[Any]) -> None:
    """Leave what was read of a chunk in memory, if there is room for all of it."""
    arrays = positions, faces.corners, faces.offsets
    for name, array in zip(_names_in(chunk), arrays, strict=True):
        if array is not None and not scratch.keep(name, array):
            _forget_chunk(scratch, chunk)
            return


def _kept_chunk(scratch: Scratch, chunk: int) -> tuple[Faces, npt.NDArray[Any]] | None:
    """What was read of a chunk before, which is no longer kept then; None if it was not."""
    positions, corners, offsets = (
        scratch.load(name) if scratch.has(name) else None for name in _names_in(chunk)
    )
    _forget_chunk(scratch, chunk)
    return None if positions is None or corners is None else (Faces(corners, offsets), positions)


def _forget_chunk(scratch: Scratch, chunk: int) -> None:
    for name in _names_in(chunk):
        scratch.remove(name)


def _names_in(chunk: int) -> list[str]:
    return [f"chunks/{chunk}/{name}" for name in ("positions", "corners", "offsets")]


def _measured(
    points: npt.NDArray[np.float64],
    corners: npt.NDArray[np.int32],
    offsets: npt.NDArray[np.int64] | None,
    n_threads: int,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Centroids and areas of faces."""
    if offsets is None:
        return _core.measure_faces(points, corners.reshape(-1, 3), n_threads)
    centroids, areas, _ = _core.measure_polygons(points, offsets, corners, n_threads)
    return centroids, areas


def _sort_chunk(
    scratch: Scratch,
    chunk: int,
    chunks: _Chunks,
    low: npt.NDArray[np.float64],
    high: npt.NDArray[np.float64],
) -> npt.NDArray[np.int32]:
    """Write the faces of a chunk in the order of their codes; counts of the codes' upper bits."""
    faces, positions = _kept_chunk(scratch, chunk) or chunks.read(chunk)
    every = np.arange(len(positions), dtype=np.int32)
    points = positions.astype(np.float64)
    centroids, _ = _measured(points, every, faces.offsets, chunks.n_threads)
    codes = _core.morton_codes(centroids, tuple(low), tuple(high), chunks.n_threads)
    del centroids, points
    order = stable_order(codes)
    codes = codes[order]
    scratch.save(f"runs/{chunk}/codes", codes)
    scratch.save(f"runs/{chunk}/cells", (order + chunks.begin(chunk)).astype(np.int32))
    narrow = np.int32 if chunks.pieces.vertices.n_rows < 1 << 31 else np.int64
    vertices = faces.corners.astype(narrow)
    if faces.offsets is None:
        scratch.save(f"runs/{chunk}/vertices", vertices.reshape(-1, 3).take(order, axis=0))
        scratch.save(f"runs/{chunk}/positions", positions.reshape(-1, 3, 3).take(order, axis=0))
    else:
        places, offsets = _reordered(faces.offsets, order)
        scratch.save(f"runs/{chunk}/offsets", offsets)
        scratch.save(f"runs/{chunk}/vertices", vertices[places])
        scratch.save(f"runs/{chunk}/positions", positions[places])
    return np.bincount(codes >> LOW_BITS, minlength=1 << LOW_BITS).astype(np.int32)


def find_cuts(
    scratch: Scratch, counts: npt.NDArray[np.int32], starts: npt.NDArray[np.int64]
) -> npt.NDArray[np.int64]:
    """Where each tile begins in each sorted run, shape (T + 1, chunks).

    `counts`, (chunks, 2^15), are those of the upper bits of codes in each run.
    """
    before = np.zeros((len(counts), counts.shape[1] + 1), np.int32)
    np.cumsum(counts, axis=1, out=before[:, 1:])
    all_before = before.sum(axis=0, dtype=np.int64)
    cuts = np.zeros((len(starts), len(counts)), np.int64)
    cuts[-1] = before[:, -1]
    for tile in range(1, len(starts) - 1):
        upper = int(np.searchsorted(all_before, starts[tile], side="right")) - 1
        n_left = int(starts[tile] - all_before[upper])
        cuts[tile] = before[:, upper]
        if n_left:
            ranges = before[:, upper : upper + 2].astype(np.int64)
            cuts[tile] += _cut_within(scratch, ranges, n_left)
    return cuts


def _cut_within(
    scratch: Scratch, ranges: npt.NDArray[np.int64], n_left: int
) -> npt.NDArray[np.int64]:
    """How many of a range of each run belong to the first n_left by code, run and place.

    The codes in all ranges have the same upper bits.
    """

    def codes_of(chunk: int) -> npt.NDArray[np.uint32]:
        begin, end = ranges[chunk].tolist()
        codes: npt.NDArray[np.uint32] = scratch.load(f"runs/{chunk}/codes", begin, end)
        return codes & np.uint32((1 << LOW_BITS) - 1)

    chunks = np.flatnonzero(ranges[:, 0] < ranges[:, 1]).tolist()
    totals = np.zeros(1 << LOW_BITS, np.int64)
    for chunk in chunks:
        totals += np.bincount(codes_of(chunk), minlength=len(totals))
    ends = np.cumsum(totals)
    code = int(np.searchsorted(ends, n_left))  # the last that the first n_left reach
    n_equal = n_left - int(ends[code] - totals[code])
    taken = np.zeros(len(ranges), np.int64)
    for chunk in chunks:
        first, last = np.searchsorted(codes_of(chunk), [code, code + 1]).tolist()
        n_more = min(n_equal, last - first)
        n_equal -= n_more
        taken[chunk] = first + n_more
    return taken


def _reordered(
    offsets: npt.NDArray[np.int64], order: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """The places of corners when faces are put in another order, and their new offsets."""
    lengths = np.diff(offsets)[order]
    new = np.zeros(len(offsets), np.int64)
    np.cumsum(lengths, out=new[1:])
    return runs(offsets[order], lengths), new


def _write_tile(store: TileStore, tile: int, n_threads: int) -> None:
    """Merge what a tile takes of each run, and write it."""
    codes, numbers, offsets, vertices, positions = _unsorted_tile(store.scratch, tile)
    order = stable_order(codes)
    if offsets is None:
        places = (3 * order[:, None] + np.arange(3)).reshape(-1)
        vertices, positions = vertices.reshape(-1), positions.reshape(-1, 3)
    else:
        places, offsets = _reordered(offsets, order)
    ids, corners = _compact(vertices[places])
    last = np.empty(len(ids), np.int64)
    last[corners] = places  # of the corners at each vertex
    points = positions.take(last, axis=0).astype(np.float64)
    centroids, areas = _measured(points, corners, offsets, n_threads)
    store.write(tile, "cells", numbers[order])
    store.write(tile, "positions", centroids)
    store.write(tile, "measures", areas)
    store.write(tile, "vertices/ids", ids)
    store.write(tile, "vertices/points", points)
    if offsets is None:
        store.write(tile, "corners", corners.reshape(-1, 3))
    else:
        store.write(tile, "corners/offsets", offsets)
        store.write(tile, "corners/vertices", corners)


def _unsorted_tile(
    scratch: Scratch, tile: int
) -> tuple[
    npt.NDArray[np.uint32], npt.NDArray[np.int32], npt.NDArray[np.int64] | None,
    npt.NDArray[Any], npt.NDArray[Any],
]:  # fmt: skip
    """Codes, cells, offsets, vertices and positions of what a tile takes of each run in turn."""
    load = scratch.load
    cuts = load("cuts", tile, tile + 2)
    parts: list[list[npt.NDArray[Any]]] = []
    lengths = []
    for chunk in np.flatnonzero(cuts[0] < cuts[1]).tolist():
        begin, end = cuts[:, chunk].tolist()
        found = [load(f"runs/{chunk}/{name}", begin, end) for name in ("codes", "cells")]
        if scratch.has(f"runs/{chunk}/offsets"):
            offsets = load(f"runs/{chunk}/offsets", begin, end + 1)
            lengths.append(np.diff(offsets))
            begin, end = int(offsets[0]), int(offsets[-1])
        found += [load(f"runs/{chunk}/{name}", begin, end) for name in ("vertices", "positions")]
        parts.append(found)
    codes, numbers, vertices, positions = map(np.concatenate, zip(*parts, strict=True))
    if not lengths:
        return codes, numbers, None, vertices, positions
    ends = np.append(0, np.cumsum(np.concatenate(lengths), dtype=np.int64))
    return codes, numbers, ends, vertices, positions


def _compact(
    corners: npt.NDArray[np.integer[Any]],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
    """The different numbers, ascending, and the place of each among these."""
    low = int(corners.min())
    span = int(corners.max()) - low + 1
    if span > MAX_SPAN:
        ids, places = np.unique(corners, return_inverse=True)
        return ids.astype(np.int64), places.reshape(-1).astype(np.int32)
    is_used = np.zeros(span, bool)
    is_used[corners - low] = True
    table = np.cumsum(is_used, dtype=np.int32) - 1
    return np.flatnonzero(is_used) + low, table[corners - low].astype(np.int32)
