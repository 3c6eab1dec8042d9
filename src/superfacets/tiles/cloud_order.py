"""Stages 0 and 1 for clouds on disk: sort points along the space-filling curve, and form tiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from .. import _core
from .._types import Floats, Ints, Longs
from .._validate import check_spread
from ..batches.mapping import Run
from ..io.readers.pieces import Pieces
from ..workers.scratch import Scratch
from .arrays import box_of, index_in, joined_boxes
from .chunks import Chunks, find_cuts, read_cut
from .part import Part
from .store import RANGE, TileStore, tile_starts

NOT_COPIED = -1
"""Value in the array ``lowest`` for points that are not copies of other points."""

COLUMNS = ("numbers", "lowest", "cells", "positions", "normals", "axes")
"""Names of the arrays of points in a run, a block or a tile; the last two arrays are optional."""


class _Ordered(NamedTuple):
    """Consecutive points in their final order, stored in the folder ``ordered/{name}``."""

    name: str
    n_points: int
    n_distinct: int  # number of points that are not copies of other points


def sort_cloud(
    pieces: Pieces, scratch: Scratch, tile_cells: int, run: Run, n_threads: int
) -> tuple[TileStore, Floats]:
    """Sort the points of a cloud along a space-filling curve, and write them tile by tile.

    The order is the same as in `segment`. A *copy* is a point at exactly the position of a point
    with a lower number. Points are sorted by the Morton code of their position, and copies come
    last among points of equal code. The other points of equal code are ordered by repeatedly
    halving their bounding box, which needs all of these points in memory. Therefore, the sorted
    points are first split into blocks, and all points of equal code are in one block. Each block is
    ordered, and the blocks are split into tiles. Tiles get the arrays ``cells``, ``numbers`` and
    ``positions``, and ``normals`` and ``axes`` if the input has them. The array ``lowest``
    contains, for each copy, the curve index of the lowest point at its position.

    Returns the tiles, whose total measure is still 0, and the bounding box of the points (copies
    excluded) in each `RANGE` of the curve, (R, 2, 3).

    Raises a MeshError, like `PointCloud`, if a coordinate is not finite, if there are too many
    points, or if all points are at one position.
    """
    chunks = Chunks.welded(pieces, scratch, tile_cells, run, n_threads)
    n_points, size = pieces.n_cells, chunks.size
    bounds = joined_boxes(run.all(_box_of_chunk, scratch, chunks.n_chunks, chunks))
    check_spread(bounds)
    found = run.all(_sort_chunk, scratch, chunks.n_chunks, chunks, bounds)
    scratch.remove_folder("representatives")
    starts = tile_starts(n_points, chunks.n_chunks)
    cuts = _block_cuts(scratch, np.stack([some for some, _ in found]), np.array(starts), size)
    scratch.save("blocks", cuts)
    copies_before = np.append(0, np.cumsum([n_copies for _, n_copies in found]))
    n_copies = int(copies_before[-1])
    first_copies = (n_points - n_copies + copies_before).astype(np.int32)
    blocks = run.all(_order_block, scratch, len(cuts) - 1, chunks, first_copies)
    scratch.remove_folder("runs")
    store = TileStore(scratch, "points", starts, bounds, 0.0)
    parts = [part for block in blocks for part in block]
    if n_copies:
        _find_lowest(scratch, blocks)
    boxes = run.all(_write_tile, store, store.n_tiles, parts)
    scratch.remove_folder("ordered")
    return store, np.concatenate(boxes)


def _box_of_chunk(scratch: Scratch, chunk: int, chunks: Chunks) -> Floats:
    return box_of(chunks.pieces.points.read(*chunks.range(chunk)))


def _sort_chunk(scratch: Scratch, chunk: int, chunks: Chunks, bounds: Floats) -> tuple[Ints, int]:
    """Write the points of a chunk, sorted by Morton code.

    Returns the histogram of the upper bits of the codes, and the number of copies. In the column
    ``cells``, copies get their rank among the copies of the chunk.
    """
    begin, end = chunks.range(chunk)
    positions = np.ascontiguousarray(chunks.pieces.points.read(begin, end))
    numbers = np.arange(begin, end, dtype=np.int32)
    lowest = np.full(end - begin, NOT_COPIED, np.int32)
    if chunks.lowest is not None:
        lowest[:] = chunks.lowest.read(begin, end)
        lowest[lowest == numbers] = NOT_COPIED
    is_copy = lowest != NOT_COPIED
    ranks = np.cumsum(is_copy, dtype=np.int32) - 1
    columns = {"numbers": numbers, "lowest": lowest, "cells": ranks, "positions": positions}
    if chunks.pieces.normals is not None:
        columns["normals"] = chunks.pieces.normals.read(begin, end)
    if chunks.pieces.axes is not None:
        columns["axes"] = chunks.pieces.axes.read(begin, end)
    counts = chunks.save_run(scratch, chunk, Part(columns), positions, bounds)
    return counts, int(np.count_nonzero(is_copy))


def _block_cuts(scratch: Scratch, counts: Ints, starts: Longs, size: int) -> Longs:
    """Return the first row of each block in each sorted run, (blocks + 1, chunks).

    `starts` contains the curve index at which each tile begins. All points with the same code as
    the first point of a tile are a separate block. Adjacent blocks are joined if the result has at
    most `size` points.
    """
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
    firsts, at = np.unique(found.sum(axis=1), return_index=True)  # removes empty blocks
    kept = [0]
    for cut in range(1, len(firsts) - 1):
        if firsts[cut + 1] - firsts[kept[-1]] > size:
            kept.append(cut)
    return found[at[[*kept, len(firsts) - 1]]]


def _order_block(
    scratch: Scratch, block: int, chunks: Chunks, first_copies: Ints
) -> list[_Ordered]:
    """Write the points of a block in their final order; a large block is written in several parts.

    `first_copies` contains the cell number of the first copy of each chunk.
    """
    cuts = scratch.load("blocks", block, block + 2)
    if int((cuts[1] - cuts[0]).sum()) > 2 * chunks.size:  # possible only if all codes are equal
        return _order_in_parts(scratch, block, cuts, chunks, first_copies)
    points = read_cut(scratch, cuts, COLUMNS)
    codes, is_copy = points.columns.pop("codes"), points.columns["lowest"] != NOT_COPIED
    apart, copies = np.flatnonzero(~is_copy), np.flatnonzero(is_copy)
    positions = points.columns["positions"][apart]
    refined = _core.order_within_steps(positions, codes[apart], chunks.n_threads)
    order = np.concatenate([apart[refined], copies])
    if len(copies):
        order = order[np.argsort(codes[order], kind="stable")]
    points = points.take(order)
    return [_write_ordered(scratch, f"{block}", points, chunks.size, first_copies)]


def _order_in_parts(
    scratch: Scratch, block: int, cuts: Longs, chunks: Chunks, first_copies: Ints
) -> list[_Ordered]:
    """Order a block of points with equal codes, with about `size` points in memory at a time."""
    copies, apart, size = list[_Ordered](), list[str](), chunks.size
    for chunk in np.flatnonzero(cuts[0] < cuts[1]).tolist():
        begin, end = cuts[:, chunk].tolist()
        points = Part.load(scratch, f"runs/{chunk}", COLUMNS, begin=begin, end=end)
        is_copy = points.columns["lowest"] != NOT_COPIED
        if is_copy.any():
            some = points.take(np.flatnonzero(is_copy))
            name = f"{block}-copies{chunk}"
            copies.append(_write_ordered(scratch, name, some, size, first_copies))
        if not is_copy.all():
            apart.append(f"halves/{block}-{chunk}")
            points.take(np.flatnonzero(~is_copy)).save(scratch, apart[-1])
    parts = []
    for place, points in enumerate(in_halves(scratch, apart, size)):
        codes = np.zeros(len(points), np.uint32)
        order = _core.order_within_steps(points.columns["positions"], codes, chunks.n_threads)
        some = points.take(order)
        parts.append(_write_ordered(scratch, f"{block}-{place}", some, size, first_copies))
    return parts + copies


def _find_lowest(scratch: Scratch, blocks: Sequence[Sequence[_Ordered]]) -> None:
    """Convert ``lowest`` from input indices to curve indices.

    A copy and the lowest point at its position have the same code, so they are in the same block.
    """
    begin = 0
    for block in blocks:
        starts = begin + np.append(0, np.cumsum([part.n_points for part in block]))
        for part in block:
            if part.n_distinct == part.n_points:
                continue
            lowest = scratch.load(f"ordered/{part.name}/lowest").copy()
            at_copies = np.flatnonzero(lowest != NOT_COPIED)
            wanted = lowest[at_copies]
            for other, start in zip(block, starts.tolist(), strict=False):
                numbers = scratch.load(f"ordered/{other.name}/numbers")
                at = index_in(wanted, numbers, np.argsort(numbers))
                lowest[at_copies[at >= 0]] = start + at[at >= 0]
            scratch.save(f"ordered/{part.name}/lowest", lowest)
        begin = int(starts[-1])


def _write_ordered(
    scratch: Scratch, name: str, points: Part, size: int, first_copies: Ints
) -> _Ordered:
    """Write points in final order.

    Copies get their final ``cells``. Other points get numbers from 0, to which `_write_tile` adds
    the number of such points in earlier parts.
    """
    is_copy, cells = points.columns["lowest"] != NOT_COPIED, points.columns["cells"]
    n_distinct = int(np.count_nonzero(~is_copy))
    cells[is_copy] += first_copies[points.columns["numbers"][is_copy] // size]
    cells[~is_copy] = np.arange(n_distinct)
    points.save(scratch, f"ordered/{name}")
    return _Ordered(name, len(points), n_distinct)


def _write_tile(store: TileStore, tile: int, parts: Sequence[_Ordered]) -> Floats:
    """Write the points of a tile, taken from `parts`; return the bounding boxes of its ranges."""
    begin, end = store.starts[tile], store.starts[tile + 1]
    found, first, n_before = [], 0, 0
    for part in parts:
        last = first + part.n_points
        if first < end and begin < last:
            rows = max(begin - first, 0), min(end, last) - first
            some = Part.load(store.scratch, f"ordered/{part.name}", COLUMNS, *rows)
            is_apart = some.columns["lowest"] == NOT_COPIED
            cells = some.columns["cells"] + n_before * is_apart
            found.append(Part(some.columns | {"cells": cells.astype(np.int32)}))
        first, n_before = last, n_before + part.n_distinct
    points = Part.joined(found)
    points.save(store.scratch, f"tile{tile}")
    boxes = []
    for at in range(0, end - begin, RANGE):
        is_apart = points.columns["lowest"][at : at + RANGE] == NOT_COPIED
        positions = points.columns["positions"][at : at + RANGE][is_apart]
        nowhere = np.array([[np.inf] * 3, [-np.inf] * 3])  # empty box, if all points are copies
        boxes.append(box_of(positions) if len(positions) else nowhere)
    return np.stack(boxes)


def in_halves(scratch: Scratch, names: Sequence[str], most: int) -> Iterator[Part]:
    """Split points by repeated halving, like C++ `refined_morton_order`, and yield the parts.

    The points are in the folders `names`, which are removed. Parts have at most `most` points, and
    are yielded in the final order of points. The points within a part are sorted by number.
    """
    n_points = sum(len(scratch.load(f"{name}/numbers")) for name in names)
    if n_points <= most:
        if names:
            parts = [Part.load(scratch, name, COLUMNS) for name in names]
            for name in names:
                scratch.remove_folder(name)
            yield Part.joined(parts, "numbers")
        return
    box = joined_boxes([box_of(scratch.load(f"{name}/positions")) for name in names])
    axis = int(np.argmax(box[1] - box[0]))  # longest side; of equal sides, the first
    middle, number = _middle(scratch, names, axis, n_points)
    halves: tuple[list[str], list[str]] = ([], [])
    for name in names:
        points = Part.load(scratch, name, COLUMNS)
        along, numbers = points.columns["positions"][:, axis], points.columns["numbers"]
        is_low = (along < middle) | ((along == middle) & (numbers < number))
        for half, chosen in enumerate((is_low, ~is_low)):
            if chosen.any():
                halves[half].append(f"{name}.{half}")
                points.take(np.flatnonzero(chosen)).save(scratch, halves[half][-1])
        scratch.remove_folder(name)
    for part in halves:
        yield from in_halves(scratch, part, most)


def _middle(scratch: Scratch, names: Sequence[str], axis: int, n_points: int) -> tuple[float, int]:
    """Return the coordinate and number of the median of points sorted by (coordinate, number).

    The coordinates of all points along `axis` are in memory, which takes 8 bytes per point.
    """
    along, first, rank = np.empty(n_points), 0, n_points // 2
    for name in names:
        some = scratch.load(f"{name}/positions")[:, axis]
        along[first : first + len(some)] = some
        first += len(some)
    along.partition(rank)
    middle = float(along[rank])
    equal = [
        scratch.load(f"{name}/numbers")[scratch.load(f"{name}/positions")[:, axis] == middle]
        for name in names
    ]
    n_below = int(np.count_nonzero(along[:rank] < middle))
    return middle, int(np.partition(np.concatenate(equal), rank - n_below)[rank - n_below])
