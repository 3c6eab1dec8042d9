"""Stages 0 and 1 on disk, for clouds: points sorted along the space-filling curve, and cut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ... import _core
from ..._validate import MAX_CELLS, check_spread
from ...errors import MeshError
from ..arrays import box_of, joined_boxes, stable_order
from ..mapping import run_all
from ..part import Columns, load_columns, save_columns, taken
from ..reading import Rows
from ..scratch import Scratch
from ..sorting import LOW_BITS, find_cuts
from ..store import RANGE, Run, TileStore, tile_starts
from ..welding import weld
from .halves import in_halves, joined_columns
from .reading import CloudPieces

__all__ = ["NOT_COPIED", "SortedCloud", "sort_cloud"]

NOT_COPIED = -1
"""In the place of the number of the lowest point at the same position, for that one itself."""

Ints = npt.NDArray[np.int32]
Longs = npt.NDArray[np.int64]
Codes = npt.NDArray[np.uint32]

COLUMNS = ("numbers", "lowest", "cells", "positions", "normals")
"""Arrays of the points of a run, a block or a tile; the last only where normals are given."""


@dataclass(frozen=True, eq=False)
class SortedCloud:
    """A cloud as tiles, of which nothing but the points is known.

    Points are sorted by the code of their position on the curve, those at the position of a lower
    one behind the others of their code; the others as in memory: where many have the same code, by
    halving the box around them. Per tile there are

    ========= =============== =====================================================
    cells     (n,) int32      number in the order that `segment` works in: that of
                              places, with all copies at the end
    numbers   (n,) int32      number in the input
    lowest    (n,) int32      of copies: number of the lowest point at the position
    positions (n, 3) float64
    normals   (n, 3) float64  if they are given
    ========= =============== =====================================================

    Attributes
    ----------
    store : TileStore
        Without a total measure.
    n_apart : int
        Number of different positions.
    boxes : ndarray of float64, shape (R, 2, 3)
        Around each range of `RANGE` places, in the order of places; without copies.
    has_normals : bool
    """

    store: TileStore
    n_apart: int
    boxes: npt.NDArray[np.float64]
    has_normals: bool


class Part(NamedTuple):
    """Points in their final order, in arrays ``ordered/{name}``."""

    name: str
    n_points: int
    n_apart: int


@dataclass(frozen=True)
class _Chunks:
    """Points in the order of the input, of which `size` are read at a time."""

    pieces: CloudPieces
    lowest: Rows | None
    size: int

    @property
    def n_chunks(self) -> int:
        return -(-self.pieces.n_points // self.size)

    def range(self, chunk: int) -> tuple[int, int]:
        """The first point of a chunk, and the first of the next."""
        begin = chunk * self.size
        return begin, min(begin + self.size, self.pieces.n_points)


def sort_cloud(
    pieces: CloudPieces, scratch: Scratch, tile_cells: int, *, run: Run, n_threads: int
) -> SortedCloud:
    """Sort the points of a cloud along the curve, as in memory, and write them tile by tile.

    Points whose code is at the border of two tiles are in one block with one of them; blocks are
    ordered, and then cut into tiles.

    Raises
    ------
    MeshError
        As `PointCloud`: the first wrong coordinate is named; or if there are too many points, or
        all are at one position.
    """
    if pieces.n_points > MAX_CELLS:
        raise MeshError(
            f"the cloud has {pieces.n_points} points; at most {MAX_CELLS} are supported"
        )
    size = -(-tile_cells // RANGE) * RANGE
    lowest = weld(run, scratch, pieces.points, size, n_threads, "points")
    chunks = _Chunks(pieces, lowest, size)
    bounds = joined_boxes(run_all(run, _box_of_chunk, scratch, chunks.n_chunks, chunks))
    check_spread(bounds)
    found = run_all(run, _sort_chunk, scratch, chunks.n_chunks, chunks, bounds, n_threads)
    counts = np.stack([count for count, _ in found])
    copies_before = np.append(0, np.cumsum([n_copies for _, n_copies in found]))
    scratch.remove_folder("representatives")
    starts = tile_starts(pieces.n_points, -(-pieces.n_points // size))
    cuts = _block_cuts(scratch, counts, np.array(starts), size)
    scratch.save("blocks", cuts)
    n_apart = pieces.n_points - int(copies_before[-1])
    jobs = [(block, size, n_apart, copies_before, n_threads) for block in range(len(cuts) - 1)]
    parts = [part for block in run(_order_block, scratch, jobs) for part in block]
    scratch.remove_folder("runs")
    store = TileStore(scratch, "points", starts, bounds, bounds, 0.0)
    boxes = run_all(run, _write_tile, store, store.n_tiles, parts)
    scratch.remove_folder("ordered")
    return SortedCloud(store, n_apart, np.concatenate(boxes), pieces.normals is not None)


def _box_of_chunk(scratch: Scratch, chunk: int, chunks: _Chunks) -> npt.NDArray[np.float64]:
    return box_of(chunks.pieces.points.read(*chunks.range(chunk)))


def _sort_chunk(
    scratch: Scratch, chunk: int, chunks: _Chunks, bounds: npt.NDArray[np.float64], n_threads: int
) -> tuple[Ints, int]:
    """Write the points of a chunk in the order of codes; counts of upper bits, and of copies."""
    begin, end = chunks.range(chunk)
    positions = chunks.pieces.points.read(begin, end)
    low, high = map(tuple, bounds)
    codes = _core.morton_codes(np.ascontiguousarray(positions), low, high, n_threads)
    order = stable_order(codes)
    codes = codes[order]
    numbers = np.arange(begin, end, dtype=np.int32)
    lowest = np.full(end - begin, NOT_COPIED, np.int32)
    if chunks.lowest is not None:
        lowest[:] = chunks.lowest.read(begin, end)
        lowest[lowest == numbers] = NOT_COPIED
    is_copy = lowest != NOT_COPIED
    ranks = np.cumsum(is_copy, dtype=np.int32) - 1  # of the copies, in the order of the input
    columns = [numbers, lowest, ranks, positions]
    if chunks.pieces.normals is not None:
        columns.append(chunks.pieces.normals.read(begin, end))
    named = dict(zip(COLUMNS, columns, strict=False))
    save_columns(scratch, f"runs/{chunk}", {"codes": codes, **taken(named, order)})
    counts = np.bincount(codes >> LOW_BITS, minlength=1 << LOW_BITS).astype(np.int32)
    return counts, int(np.count_nonzero(is_copy))


def _block_cuts(scratch: Scratch, counts: Ints, starts: Longs, size: int) -> Longs:
    """Where each block begins in each sorted run, shape (blocks + 1, chunks): at new codes."""
    n_chunks = len(counts)
    cuts = find_cuts(scratch, counts, starts)
    codes = []
    for cut in cuts[1:-1]:
        following = [
            int(scratch.load(f"runs/{chunk}/codes", at, at + 1)[0])
            for chunk, at in enumerate(cut.tolist())
            if at < cuts[-1, chunk]
        ]
        codes += [min(following), min(following) + 1]
    wanted = np.unique(np.array([0, *codes], np.uint32))
    found = np.empty((len(wanted) + 1, n_chunks), np.int64)
    for chunk in range(n_chunks):
        found[:-1, chunk] = np.searchsorted(scratch.load(f"runs/{chunk}/codes"), wanted)
    found[-1] = cuts[-1]
    return _without_small_blocks(found, size)


def _without_small_blocks(cuts: Longs, size: int) -> Longs:
    """The same without cuts between blocks that fit together."""
    firsts, at = np.unique(cuts.sum(axis=1), return_index=True)  # without empty blocks
    kept = [0]
    for cut in range(1, len(firsts) - 1):
        if firsts[cut + 1] - firsts[kept[-1]] > size:
            kept.append(cut)
    return cuts[at[[*kept, len(firsts) - 1]]]


def _order_block(
    scratch: Scratch, block: int, size: int, n_apart: int, copies_before: Longs, n_threads: int
) -> list[Part]:
    """Write the points of a block in their final order; in several parts where they are many."""
    cuts = scratch.load("blocks", block, block + 2)
    chunks = np.flatnonzero(cuts[0] < cuts[1]).tolist()
    if int((cuts[1] - cuts[0]).sum()) > 2 * size:  # all have the same code
        ranges = [(chunk, *cuts[:, chunk].tolist()) for chunk in chunks]
        return _order_in_parts(scratch, block, ranges, (size, n_apart, copies_before), n_threads)
    found = [_read_run(scratch, chunk, *cuts[:, chunk].tolist()) for chunk in chunks]
    codes = np.concatenate([part.pop("codes") for part in found])
    columns = joined_columns(found)
    order = stable_order(codes)
    codes, columns = codes[order], taken(columns, order)
    is_copy = columns["lowest"] != NOT_COPIED
    order = _final_order(codes, is_copy, columns["positions"], n_threads)
    return [_write_part(scratch, f"{block}", taken(columns, order), (size, n_apart, copies_before))]


def _order_in_parts(
    scratch: Scratch,
    block: int,
    ranges: list[tuple[int, int, int]],
    frame: tuple[int, int, Longs],
    n_threads: int,
) -> list[Part]:
    """The same where all points have one code; no more than `size` are in memory at a time."""
    parts: list[Part] = []
    copies: list[Part] = []
    apart = []
    for chunk, begin, end in ranges:
        columns = _read_run(scratch, chunk, begin, end)
        del columns["codes"]
        is_copy = columns["lowest"] != NOT_COPIED
        if is_copy.any():
            part = taken(columns, np.flatnonzero(is_copy))
            copies.append(_write_part(scratch, f"{block}-copies{chunk}", part, frame))
        if not is_copy.all():
            name = f"halves/{block}-{chunk}"
            save_columns(scratch, name, taken(columns, np.flatnonzero(~is_copy)))
            apart.append(name)
    for place, columns in enumerate(in_halves(scratch, apart, frame[0])):
        codes = np.zeros(len(columns["numbers"]), np.uint32)
        order = _core.order_within_steps(columns["positions"], codes, n_threads)
        parts.append(_write_part(scratch, f"{block}-{place}", taken(columns, order), frame))
    return parts + copies


def _write_part(
    scratch: Scratch, name: str, columns: Columns, frame: tuple[int, int, Longs]
) -> Part:
    size, n_apart, copies_before = frame
    is_copy = columns["lowest"] != NOT_COPIED
    n_kept = int(np.count_nonzero(~is_copy))
    cells = columns["cells"]
    behind = copies_before[columns["numbers"][is_copy] // size]
    cells[is_copy] += (n_apart + behind).astype(np.int32)
    cells[~is_copy] = np.arange(n_kept)  # until it is known how many are before
    save_columns(scratch, f"ordered/{name}", columns)
    return Part(name, len(cells), n_kept)


def _read_run(scratch: Scratch, chunk: int, begin: int, end: int) -> Columns:
    return load_columns(scratch, f"runs/{chunk}", ("codes", *COLUMNS), begin, end)


def _final_order(
    codes: Codes, is_copy: npt.NDArray[np.bool_], positions: npt.NDArray[np.float64], n_threads: int
) -> Longs:
    """The order of points that are sorted by code and number."""
    apart, copies = np.flatnonzero(~is_copy), np.flatnonzero(is_copy)
    refined = _core.order_within_steps(positions[apart], codes[apart], n_threads)
    order = np.concatenate([apart[refined], copies])
    return order[np.argsort(codes[order], kind="stable")] if len(copies) else order


def _write_tile(store: TileStore, tile: int, parts: list[Part]) -> npt.NDArray[np.float64]:
    """Write what a tile takes of each part in turn; the box around each range."""
    begin, end = store.starts[tile], store.starts[tile + 1]
    found, first, n_before = [], 0, 0
    for part in parts:
        last = first + part.n_points
        if first < end and begin < last:
            rows = max(begin - first, 0), min(end, last) - first
            columns = load_columns(store.scratch, f"ordered/{part.name}", COLUMNS, *rows)
            columns["cells"] = columns["cells"].copy()
            columns["cells"][columns["lowest"] == NOT_COPIED] += np.int32(n_before)
            found.append(columns)
        first, n_before = last, n_before + part.n_apart
    columns = joined_columns(found)
    for name, column in columns.items():
        store.write(tile, name, column)
    return np.stack([_box_of_range(columns, at) for at in range(0, end - begin, RANGE)])


def _box_of_range(columns: Columns, first: int) -> npt.NDArray[np.float64]:
    """The box around the points of a range that are no copies; infinitely far if there are none."""
    is_apart = columns["lowest"][first : first + RANGE] == NOT_COPIED
    positions = columns["positions"][first : first + RANGE][is_apart]
    return box_of(positions) if len(positions) else np.array([[np.inf] * 3, [-np.inf] * 3])
