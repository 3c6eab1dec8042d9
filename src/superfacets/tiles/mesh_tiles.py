"""Stages 0 and 1 of meshes on disk: sort faces along the space-filling curve, and form tiles."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Array, Floats, Ints
from .._validate import check_extent, raise_index_error
from ..batches.mapping import Run
from ..io.tables import take_rows
from ..workers.scratch import Scratch
from .arrays import box_of, compacted, joined_boxes
from .chunks import Chunks, find_cuts, read_cut
from .part import Lists, Part
from .store import Kind, TileStore, tile_starts

BLOCK = 4096
"""Number of values per block in blocked sums; it must equal ``kSumBlock`` in the C++ core."""

OF_RUN = ("cells", "corners", "points", "corners/vertices", "corners/points")
"""Names of the arrays of a run (a sorted chunk) of faces: numbers of faces, vertex numbers and
positions of corners."""


def _read_chunk(chunks: Chunks, chunk: int) -> Part:
    """Return the faces of a chunk: numbers of their welded vertices, and positions of corners.

    Raises a MeshError for the first vertex index that is out of range.
    """
    begin, end = chunks.range(chunk)
    corners, offsets = chunks.pieces.corners_of(begin, end)
    n_vertices = chunks.pieces.points.n_rows
    if corners.min() < 0 or corners.max() >= n_vertices:
        place = int(np.argmax((corners < 0) | (corners >= n_vertices)))
        face = place // 3 if offsets is None else np.searchsorted(offsets, place, "right") - 1
        raise_index_error(begin + int(face), int(corners[place]), n_vertices)
    if chunks.lowest is not None:
        corners = take_rows(chunks.lowest, corners, 2 * chunks.size)
    points = take_rows(chunks.pieces.points, corners, 2 * chunks.size)
    corners = corners.astype(np.int32 if n_vertices < 1 << 31 else np.int64)
    cells = {"cells": np.arange(begin, end, dtype=np.int32)}
    if offsets is None:
        shaped = {"corners": corners.reshape(-1, 3), "points": points.reshape(-1, 3, 3)}
        return Part(cells | shaped)
    return Part(cells, {"corners": Lists(offsets, {"vertices": corners, "points": points})})


def tiles_of_chunks(chunks: Chunks, scratch: Scratch, run: Run) -> TileStore:
    """Sort the faces of a mesh along the space-filling curve, and write them tile by tile.

    This is an external merge sort with about one chunk in memory at a time. A first pass over the
    input finds the bounding box of all centroids. A second pass writes each chunk as a run sorted
    by Morton code. Chunks that are in the cache are not read again. The row at which each tile
    begins in each run follows from histograms of the codes. Finally, the runs are merged tile by
    tile.
    """
    pieces = chunks.pieces
    found = run.all(_measure_chunk, scratch, chunks.n_chunks, chunks)
    boxes, curves, areas = zip(*found, strict=True)
    bounds, curve = joined_boxes(boxes), joined_boxes(curves)
    check_extent(*bounds)
    counts = np.stack(run.all(_sort_chunk, scratch, chunks.n_chunks, chunks, curve))
    starts = tile_starts(pieces.n_cells, chunks.n_chunks)
    scratch.save("cuts", find_cuts(scratch, counts, np.array(starts)))
    total = 0.0
    for area in np.concatenate(areas).tolist():
        total += area
    kind: Kind = "triangles" if pieces.offsets is None else "polygons"
    store = TileStore(scratch, kind, starts, bounds, total)
    run.all(_write_tile, store, store.n_tiles, chunks.n_threads)
    scratch.remove_folder("runs")
    return store


def _measured(faces: Part, n_threads: int) -> tuple[Floats, Floats]:
    points = _points(faces).astype(np.float64)
    corners = np.arange(len(points), dtype=np.int32)
    if not faces.lists:
        return _core.measure_faces(points, corners.reshape(-1, 3), n_threads)[:2]
    return _core.measure_polygons(points, faces.corners()[0], corners, n_threads)[:2]


def _points(faces: Part) -> Array:
    if faces.lists:
        return faces.lists["corners"].entries["points"]
    return faces.columns["points"].reshape(-1, 3)


def _measure_chunk(scratch: Scratch, chunk: int, chunks: Chunks) -> tuple[Floats, Floats, Floats]:
    """Return the boxes of the vertices and of the centroids of a chunk, and the area of each block.

    A block has `BLOCK` faces. The faces of the chunk are stored in the cache if they fit.
    """
    faces = _read_chunk(chunks, chunk)
    centroids, areas = _measured(faces, chunks.n_threads)
    firsts = range(0, len(areas), BLOCK)
    sums = [_core.sum_of(areas[first : first + BLOCK], 1) for first in firsts]
    bounds = box_of(_points(faces).astype(np.float64))
    if not faces.keep(scratch, f"chunks/{chunk}"):
        scratch.remove_folder(f"chunks/{chunk}")
    return bounds, box_of(centroids), np.array(sums)


def _sort_chunk(scratch: Scratch, chunk: int, chunks: Chunks, curve: Floats) -> Ints:
    """Write a chunk as a run sorted by Morton code; return the histogram of the upper code bits."""
    folder = f"chunks/{chunk}"
    is_kept = scratch.has(f"{folder}/cells")
    faces = Part.load(scratch, folder, OF_RUN) if is_kept else _read_chunk(chunks, chunk)
    scratch.remove_folder(folder)
    return chunks.save_run(scratch, chunk, faces, _measured(faces, chunks.n_threads)[0], curve)


def _write_tile(store: TileStore, tile: int, n_threads: int) -> None:
    faces = read_cut(store.scratch, store.scratch.load("cuts", tile, tile + 2), OF_RUN)
    centroids, areas = _measured(faces, n_threads)
    ids, corners = compacted(faces.corners()[1])
    last = np.empty(len(ids), np.int64)
    last[corners] = np.arange(len(corners))  # index of the last corner at each vertex
    columns = {"cells": faces.columns["cells"], "positions": centroids, "measures": areas}
    vertices = {"ids": ids, "points": _points(faces).take(last, axis=0).astype(np.float64)}
    tiled = Part(columns, faces.lists).with_corners(corners, vertices)
    tiled.save(store.scratch, f"tile{tile}")
