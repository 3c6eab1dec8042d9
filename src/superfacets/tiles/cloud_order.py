"""Stages 0 and 1 on disk, of clouds: points sorted along the space-filling curve, and cut."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints, Longs
from .._validate import check_spread
from .arrays import box_of, joined_boxes
from .curve_sort import Chunks, find_cuts, read_cut, save_run
from .mapping import run_all
from .opening import Pieces
from .part import Columns, Part, load_columns, save_columns, taken
from .scratch import Scratch
from .store import RANGE, Run, TileStore, tile_starts

__all__ = ["NOT_COPIED", "SortedCloud", "in_halves", "sort_cloud"]

NOT_COPIED = -1
"""In the place of the lowest point at the same position, for that one itself."""

COLUMNS = ("numbers", "lowest", "cells", "positions", "normals")
"""Arrays of the points of a run, a block or a tile; the last only where normals are given."""

DIGIT = 16
"""Bits of a coordinate that are looked at in one pass."""


@dataclass(frozen=True, eq=False)
class SortedCloud:
    """A cloud as tiles, of which nothing but the points is known.

    Points are sorted by the code of their position on the curve, copies of a lower one at the same
    position behind the others of their code; the others as in memory: where many have the same
    code, by halving the box around them. Per tile there are

    ========= =============== =====================================================
    cells     (n,) int32      number in the order that `segment` works in: that of
                              places, with all copies at the end
    numbers   (n,) int32      number in the input
    lowest    (n,) int32      of copies: place of the lowest point at the position
    positions (n, 3) float64
    normals   (n, 3) float64  if they are given
    ========= =============== =====================================================

    The store has no total measure yet. There are `n_apart` different positions; `boxes`, (R, 2, 3),
    are around each range of `RANGE` places, in the order of places, without copies.
    """

    store: TileStore
    n_apart: int
    boxes: Floats
    has_normals: bool


class _Ordered(NamedTuple):
    """Points in their final order, in arrays ``ordered/{name}``."""

    name: str
    n_points: int
    n_apart: int


@dataclass(frozen=True)
class _Frame:
    """What the numbers of cells follow from: `copies_before` counts those of previous chunks."""

    size: int
    n_apart: int
    copies_before: Longs
    n_threads: int


def sort_cloud(
    pieces: Pieces, scratch: Scratch, tile_cells: int, run: Run, n_threads: int
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
    chunks = Chunks.welded(pieces, scratch, tile_cells, run, n_threads)
    n_points, size = pieces.n_cells, chunks.size
    bounds = joined_boxes(run_all(run, _box_of_chunk, scratch, chunks.n_chunks, chunks))
    check_spread(bounds)
    found = run_all(run, _sort_chunk, scratch, chunks.n_chunks, chunks, bounds)
    copies_before = np.append(0, np.cumsum([n_copies for _, n_copies in found]))
    scratch.remove_folder("representatives")
    starts = tile_starts(n_points, chunks.n_chunks)
    cuts = _block_cuts(scratch, np.stack([some for some, _ in found]), np.array(starts), size)
    scratch.save("blocks", cuts)
    frame = _Frame(size, n_points - int(copies_before[-1]), copies_before, n_threads)
    blocks = run_all(run, _order_block, scratch, len(cuts) - 1, frame)
    scratch.remove_folder("runs")
    store = TileStore(scratch, "points", starts, bounds, bounds, 0.0)
    parts = [part for block in blocks for part in block]
    if frame.n_apart < n_points:
        _find_lowest(scratch, blocks)
    boxes = run_all(run, _write_tile, store, store.n_tiles, parts)
    scratch.remove_folder("ordered")
    return SortedCloud(store, frame.n_apart, np.concatenate(boxes), pieces.normals is not None)


def _box_of_chunk(scratch: Scratch, chunk: int, chunks: Chunks) -> Floats:
    return box_of(chunks.pieces.points.read(*chunks.range(chunk)))


def _sort_chunk(scratch: Scratch, chunk: int, chunks: Chunks, bounds: Floats) -> tuple[Ints, int]:
    """Write the points of a chunk in the order of codes; counts of upper bits, and of copies."""
    begin, end = chunks.range(chunk)
    positions = np.ascontiguousarray(chunks.pieces.points.read(begin, end))
    low, high = map(tuple, bounds)
    codes = _core.morton_codes(positions, low, high, chunks.n_threads)
    numbers = np.arange(begin, end, dtype=np.int32)
    lowest = np.full(end - begin, NOT_COPIED, np.int32)
    if chunks.lowest is not None:
        lowest[:] = chunks.lowest.read(begin, end)
        lowest[lowest == numbers] = NOT_COPIED
    is_copy = lowest != NOT_COPIED
    ranks = np.cumsum(is_copy, dtype=np.int32) - 1  # of the copies, in the order of the input
    columns = {"numbers": numbers, "lowest": lowest, "cells": ranks, "positions": positions}
    if chunks.pieces.normals is not None:
        columns["normals"] = chunks.pieces.normals.read(begin, end)
    return save_run(scratch, chunk, Part(columns), codes), int(np.count_nonzero(is_copy))


def _block_cuts(scratch: Scratch, counts: Ints, starts: Longs, size: int) -> Longs:
    """Where each block begins in each sorted run, shape (blocks + 1, chunks): at new codes."""
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
    found = np.empty((len(wanted) + 1, len(counts)), np.int64)
    for chunk in range(len(counts)):
        found[:-1, chunk] = np.searchsorted(scratch.load(f"runs/{chunk}/codes"), wanted)
    found[-1] = cuts[-1]
    firsts, at = np.unique(found.sum(axis=1), return_index=True)  # without empty blocks
    kept = [0]  # without cuts between blocks that fit together
    for cut in range(1, len(firsts) - 1):
        if firsts[cut + 1] - firsts[kept[-1]] > size:
            kept.append(cut)
    return found[at[[*kept, len(firsts) - 1]]]


def _order_block(scratch: Scratch, block: int, frame: _Frame) -> list[_Ordered]:
    """Write the points of a block in their final order; in several parts where they are many."""
    cuts = scratch.load("blocks", block, block + 2)
    if int((cuts[1] - cuts[0]).sum()) > 2 * frame.size:  # all have the same code
        return _order_in_parts(scratch, block, cuts, frame)
    columns = read_cut(scratch, cuts, COLUMNS).columns
    codes, is_copy = columns.pop("codes"), columns["lowest"] != NOT_COPIED
    apart, copies = np.flatnonzero(~is_copy), np.flatnonzero(is_copy)
    positions = columns["positions"][apart]
    refined = _core.order_within_steps(positions, codes[apart], frame.n_threads)
    order = np.concatenate([apart[refined], copies])
    if len(copies):
        order = order[np.argsort(codes[order], kind="stable")]
    return [_write_ordered(scratch, f"{block}", taken(columns, order), frame)]


def _order_in_parts(scratch: Scratch, block: int, cuts: Longs, frame: _Frame) -> list[_Ordered]:
    """The same where all points have one code; no more than `size` are in memory at a time."""
    copies, apart = list[_Ordered](), list[str]()
    for chunk in np.flatnonzero(cuts[0] < cuts[1]).tolist():
        columns = load_columns(scratch, f"runs/{chunk}", COLUMNS, *cuts[:, chunk].tolist())
        is_copy = columns["lowest"] != NOT_COPIED
        if is_copy.any():
            some = taken(columns, np.flatnonzero(is_copy))
            copies.append(_write_ordered(scratch, f"{block}-copies{chunk}", some, frame))
        if not is_copy.all():
            apart.append(f"halves/{block}-{chunk}")
            save_columns(scratch, apart[-1], taken(columns, np.flatnonzero(~is_copy)))
    parts = []
    for place, columns in enumerate(in_halves(scratch, apart, frame.size)):
        codes = np.zeros(len(columns["numbers"]), np.uint32)
        order = _core.order_within_steps(columns["positions"], codes, frame.n_threads)
        parts.append(_write_ordered(scratch, f"{block}-{place}", taken(columns, order), frame))
    return parts + copies


def _find_lowest(scratch: Scratch, blocks: Sequence[Sequence[_Ordered]]) -> None:
    """Replace the numbers of lowest points by places. Copies are in the same block as these."""
    begin = 0
    for block in blocks:
        starts = begin + np.append(0, np.cumsum([part.n_points for part in block]))
        for part in block:
            lowest = scratch.load(f"ordered/{part.name}/lowest")
            wanted = lowest[lowest != NOT_COPIED]
            places = np.full(len(wanted), NOT_COPIED, np.int32)
            for other, start in zip(block, starts.tolist(), strict=False):
                if not len(wanted) or not other.n_apart:
                    continue
                numbers = scratch.load(f"ordered/{other.name}/numbers")
                order = np.argsort(numbers)
                at = np.minimum(np.searchsorted(numbers, wanted, sorter=order), len(numbers) - 1)
                is_here = numbers[order[at]] == wanted
                places[is_here] = start + order[at[is_here]]
            if len(wanted):
                lowest = lowest.copy()
                lowest[lowest != NOT_COPIED] = places
                scratch.save(f"ordered/{part.name}/lowest", lowest)
        begin = int(starts[-1])


def _write_ordered(scratch: Scratch, name: str, columns: Columns, frame: _Frame) -> _Ordered:
    """Write points in their final order; cells that are no copies are numbered from 0 here."""
    is_copy = columns["lowest"] != NOT_COPIED
    n_apart = int(np.count_nonzero(~is_copy))
    behind = frame.copies_before[columns["numbers"][is_copy] // frame.size]
    columns["cells"][is_copy] += (frame.n_apart + behind).astype(np.int32)
    columns["cells"][~is_copy] = np.arange(n_apart)
    save_columns(scratch, f"ordered/{name}", columns)
    return _Ordered(name, len(is_copy), n_apart)


def _write_tile(store: TileStore, tile: int, parts: Sequence[_Ordered]) -> Floats:
    """Write what a tile takes of each part in turn; the box around each range."""
    begin, end = store.starts[tile], store.starts[tile + 1]
    found, first, n_before = [], 0, 0
    for part in parts:
        last = first + part.n_points
        if first < end and begin < last:
            rows = max(begin - first, 0), min(end, last) - first
            columns = load_columns(store.scratch, f"ordered/{part.name}", COLUMNS, *rows)
            is_apart = columns["lowest"] == NOT_COPIED
            columns["cells"] = (columns["cells"] + n_before * is_apart).astype(np.int32)
            found.append(Part(columns))
        first, n_before = last, n_before + part.n_apart
    points = Part.joined(found)
    points.save(store.scratch, f"tile{tile}")
    return np.stack([_box_of_range(points.columns, at) for at in range(0, end - begin, RANGE)])


def _box_of_range(columns: Columns, first: int) -> Floats:
    """The box around the points of a range that are no copies; infinitely far if there are none."""
    is_apart = columns["lowest"][first : first + RANGE] == NOT_COPIED
    positions = columns["positions"][first : first + RANGE][is_apart]
    return box_of(positions) if len(positions) else np.array([[np.inf] * 3, [-np.inf] * 3])


def in_halves(scratch: Scratch, names: Sequence[str], most: int) -> Iterator[Columns]:
    """Divide points as the core's `refined_morton_order` does, until at most so many are together.

    The points are columns in these folders, which are removed. Each part is in the order of the
    numbers; one after the other they are in the final order.
    """
    n_points = sum(len(scratch.load(f"{name}/numbers")) for name in names)
    if n_points <= most:
        if names:
            parts = [Part.load(scratch, name, COLUMNS) for name in names]
            for name in names:
                scratch.remove_folder(name)
            yield Part.joined(parts, "numbers").columns
        return
    box = joined_boxes([box_of(scratch.load(f"{name}/positions")) for name in names])
    axis = int(np.argmax(box[1] - box[0]))  # the longest, the first among equals
    key, number = _middle(scratch, names, axis, n_points // 2)
    halves: tuple[list[str], list[str]] = ([], [])
    for name in names:
        columns = load_columns(scratch, name, COLUMNS)
        keys = _keys(columns["positions"][:, axis])
        is_low = (keys < key) | ((keys == key) & (columns["numbers"] < number))
        for half, chosen in enumerate((is_low, ~is_low)):
            if chosen.any():
                halves[half].append(f"{name}.{half}")  # no name that is given: after 1 comes 10
                save_columns(scratch, halves[half][-1], taken(columns, np.flatnonzero(chosen)))
        scratch.remove_folder(name)
    for part in halves:
        yield from in_halves(scratch, part, most)


def _keys(coordinates: Floats) -> Array:
    """Whole numbers in the order of the coordinates."""
    bits = (coordinates + 0.0).view(np.uint64)  # -0.0 becomes 0.0
    is_negative = bits >> np.uint64(63) != 0
    return np.where(is_negative, ~bits, bits | np.uint64(1 << 63))


def _middle(scratch: Scratch, names: Sequence[str], axis: int, n_low: int) -> tuple[int, int]:
    """The key and the number that the point with so many before it has, by both."""
    prefix, n_left = 0, n_low
    for shift in range(64 - DIGIT, -1, -DIGIT):
        counts = np.zeros(1 << DIGIT, np.int64)
        for name in names:
            keys = _keys(scratch.load(f"{name}/positions")[:, axis])
            if shift + DIGIT < 64:
                keys = keys[keys >> np.uint64(shift + DIGIT) == prefix]
            digits = keys >> np.uint64(shift) & np.uint64((1 << DIGIT) - 1)
            counts += np.bincount(digits.astype(np.int64), minlength=len(counts))
        digit = int(np.searchsorted(np.cumsum(counts), n_left, side="right"))
        n_left -= int(counts[:digit].sum())
        prefix = prefix << DIGIT | digit
    equal = []
    for name in names:
        is_equal = _keys(scratch.load(f"{name}/positions")[:, axis]) == prefix
        equal.append(scratch.load(f"{name}/numbers")[is_equal])
    return prefix, int(np.partition(np.concatenate(equal), n_left)[n_left])
