"""Stages 0 and 1 of meshes on disk: write tiles of a mesh, with optional denoising."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, NamedTuple, cast

import numpy as np

from .. import _core
from .._types import Array, Bools, Floats, Longs
from ..batches.mapping import Run
from ..io.readers.pieces import Pieces
from ..io.tables import Rows, take_rows
from ..mesh.denoising import AUTO_STEPS, NOISE_LIMIT, Denoise, estimated_noise, noise_products
from ..mesh.faces import FaceMesh, VertexGraph, corners_in_a_row, mesh_like, vertex_graph
from ..workers.scratch import Scratch
from .arrays import index_in
from .chunks import BlockRows, Chunks
from .halos import OF_FACES, faces_with_halo, find_halos
from .mesh_tiles import tiles_of_chunks
from .part import Part
from .store import TileStore


class _Noise(NamedTuple):
    """Sums over the vertices of a tile that are in no tile of lower index."""

    products: Floats  # result of `noise_products`, one value per vertex
    length: float  # sum over vertices of the lengths of all edges at the vertex
    n_ends: int  # number of edge lengths in this sum


def make_mesh_tiles(
    pieces: Pieces, scratch: Scratch, tile_cells: int, denoise: Denoise = None, *,
    welds: bool, run: Run, n_threads: int,
) -> tuple[TileStore, int | None]:  # fmt: skip
    """Write a mesh as tiles; return the tiles, and the number of denoising steps.

    Tiles have at most `tile_cells` faces, rounded up to a multiple of `RANGE`. `n_threads` is the
    number of threads used for each tile. Smoothed positions are bit-identical to the result of
    `mesh.denoising.denoised`. The input mesh is first split into tiles to smooth it. Smoothing
    changes the order of faces along the curve, so the smoothed mesh is then split again.

    Raises a MeshError that reports the first wrong coordinate or index, as `Mesh` does, or if there
    are too many faces.
    """
    make = scratch, tile_cells, run, n_threads, welds
    chunks = Chunks.welded(pieces, *make)
    store = tiles_of_chunks(chunks, scratch, run)
    n_steps = None if denoise is None else _smooth_all(store, denoise, run, n_threads)
    if n_steps:
        smooth = replace(pieces, points=_table(chunks, store, n_steps, run))
        for tile in range(store.n_tiles):
            scratch.remove_folder(f"tile{tile}")
        store = tiles_of_chunks(Chunks.welded(smooth, *make), scratch, run)
    scratch.remove_folder("representatives")
    return store, n_steps


def _smooth_all(store: TileStore, denoise: int | Literal["auto"], run: Run, n_threads: int) -> int:
    """Write the positions of all vertices after the last step; return the number of steps.

    Each step processes every tile with its halo of two rings of faces.
    """
    halos = find_halos(store, run)
    tiles, n_steps = range(store.n_tiles), 1 if denoise == "auto" else denoise
    if n_steps:
        run(_link_vertices, store, [(tile, halos[tile], n_threads) for tile in tiles])
    step = 0
    while step < n_steps:
        run(_smooth, store, [(tile, halos[tile], step, n_threads) for tile in tiles])
        if step:
            store.remove_from_all(f"smoothed{step}", f"outer/smoothed{step}")
        step += 1
        if denoise == "auto" and step == 1:
            found = run(_measure_noise, store, [(tile, halos[tile], n_threads) for tile in tiles])
            n_steps = AUTO_STEPS if _noise_of(found) >= NOISE_LIMIT else 0
    return n_steps


def _noise_of(found: list[_Noise]) -> float:
    """Noise of the mesh, as a multiple of the mean edge length."""
    n_ends = sum(some.n_ends for some in found)
    if not n_ends:
        return 0.0
    mean_length = sum(some.length for some in found) / n_ends
    return estimated_noise(np.concatenate([some.products for some in found]), mean_length)


def _link_vertices(store: TileStore, tile: int, others: list[int], n_threads: int) -> None:
    faces, graph = _faces_around(store, tile, others, n_threads)
    store.write(tile, "around/ids", faces.vertices["ids"])
    store.write(tile, "around/offsets", graph.offsets)
    store.write(tile, "around/neighbors", graph.neighbors)


def _faces_around(
    store: TileStore, tile: int, others: list[int], n_threads: int
) -> tuple[Part, VertexGraph]:
    faces = faces_with_halo(store, Part.of_tile(store, tile, OF_FACES), others)
    own_numbers = np.arange(len(faces.vertices["ids"]), dtype=np.int32)
    return faces, vertex_graph(faces.mesh(store), own_numbers, n_threads)


def _smooth(store: TileStore, tile: int, others: list[int], step: int, n_threads: int) -> None:
    """Write the positions of the vertices of a tile after one more step.

    Each step moves vertices twice, so a step depends on vertices up to two edges away.
    """
    ids = store.read(tile, "around/ids")
    points = _points_after(store, tile, others, step, ids)
    graph = store.read(tile, "around/offsets"), store.read(tile, "around/neighbors")
    smoothed = _core.taubin_smooth(points, *graph, 1, n_threads)
    for folder, vertices in (("", "vertices/ids"), ("outer/", "outer/vertices/ids")):
        chosen = smoothed[np.searchsorted(ids, store.read(tile, vertices))]
        store.write(tile, f"{folder}smoothed{step + 1}", chosen)


def _points_after(store: TileStore, tile: int, others: list[int], step: int, ids: Longs) -> Floats:
    """Positions of the vertices `ids`, in a tile and its halo, after `step` smoothing steps."""
    name = f"smoothed{step}" if step else "vertices/points"
    points = np.empty((len(ids), 3))
    for other in others:
        at = index_in(store.read(other, "outer/vertices/ids"), ids)
        points[at[at >= 0]] = store.read(other, f"outer/{name}")[at >= 0]
    points[np.searchsorted(ids, store.read(tile, "vertices/ids"))] = store.read(tile, name)
    return points


def _measure_noise(store: TileStore, tile: int, others: list[int], n_threads: int) -> _Noise:
    """Measure the noise of a tile by comparing the mesh before and after the first step."""
    faces, graph = _faces_around(store, tile, others, n_threads)
    mesh, ids = faces.mesh(store), faces.vertices["ids"]
    points = _points_after(store, tile, others, 1, ids)
    made = mesh_like(mesh, points, corners_in_a_row(mesh), faces.corners()[0], store.bounds)
    own_numbers = np.arange(len(ids), dtype=np.int32)
    products = noise_products(mesh.vertices, cast(FaceMesh, made), graph, own_numbers)
    is_own = _is_first(store, tile, others, ids) & (np.diff(graph.offsets) > 0)
    is_end = np.repeat(is_own, np.diff(graph.offsets))
    lengths = graph.lengths[is_end]
    return _Noise(products[is_own], _core.sum_of(lengths, n_threads), len(lengths))


def _is_first(store: TileStore, tile: int, others: list[int], ids: Longs) -> Bools:
    """Whether each vertex is in this tile, and in no tile of lower index."""
    is_first = np.zeros(len(ids), bool)
    is_first[np.searchsorted(ids, store.read(tile, "vertices/ids"))] = True
    for other in others:
        if other < tile:
            at = index_in(store.read(other, "outer/vertices/ids"), ids)
            is_first[at[at >= 0]] = False
    return is_first


def _table(chunks: Chunks, store: TileStore, step: int, run: Run) -> Rows:
    """Smoothed positions of all input vertices; vertices used by no face keep their position."""
    vertices, size, scratch = chunks.pieces.points, chunks.size, store.scratch
    n_blocks = -(-vertices.n_rows // size)
    ends = np.arange(0, (n_blocks + 1) * size, size)
    cuts = np.array(run.all(_cut, store, store.n_tiles, ends))
    jobs = [(block, vertices, size, cuts[:, block : block + 2], step) for block in range(n_blocks)]
    run(_write_block, store, jobs)
    table = BlockRows(scratch, "smoothed", size, vertices.n_rows)
    if chunks.lowest is not None:
        run.all(_copy_lowest, scratch, n_blocks, table, chunks.lowest)
        scratch.remove_folder("smoothed")
        table = replace(table, name="welded_smoothed")
    return table


def _cut(store: TileStore, tile: int, ends: Longs) -> Longs:
    return np.searchsorted(store.read(tile, "vertices/ids"), ends)


def _write_block(
    store: TileStore, block: int, vertices: Rows, size: int, cuts: Array, step: int
) -> None:
    """Write the positions of a block of vertices; `cuts` has the block's rows in each tile."""
    begin = block * size
    points = vertices.read(begin, min(begin + size, vertices.n_rows)).astype(np.float64)
    for tile in np.flatnonzero(cuts[:, 0] < cuts[:, 1]).tolist():
        ids, found = (
            store.scratch.load(f"tile{tile}/{name}", *cuts[tile].tolist())
            for name in ("vertices/ids", f"smoothed{step}")
        )
        points[ids - begin] = found
    store.scratch.save(f"smoothed/{block}", points)


def _copy_lowest(scratch: Scratch, block: int, table: BlockRows, lowest: Rows) -> None:
    """Write, for each vertex of a block, the position of the lowest vertex it is welded to."""
    begin = block * table.size
    vertices = lowest.read(begin, min(begin + table.size, table.n_rows))
    scratch.save(f"welded_smoothed/{block}", take_rows(table, vertices, 2 * table.size))
