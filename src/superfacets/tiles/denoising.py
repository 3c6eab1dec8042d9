"""Stages 0 and 1 of meshes on disk: write a mesh as tiles, and optionally denoise it."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from .. import _core
from .._types import Array, Floats, Longs
from ..batches.mapping import Run
from ..cells.face_graph import arcs_of_faces
from ..io.readers.pieces import Pieces
from ..io.tables import Rows
from ..mesh.denoising import STEPS_WITH_SLACK, Denoise, Roughness, sampled_faces, slack_of
from ..mesh.faces import VertexGraph, vertex_graph
from ..workers.scratch import Scratch
from .arrays import index_in, rows
from .chunks import BlockRows, Chunks
from .halos import OF_FACES, faces_with_halo, find_halos
from .mesh_tiles import tiles_of_chunks
from .part import Part
from .store import TileStore


def make_mesh_tiles(
    pieces: Pieces, scratch: Scratch, tile_cells: int, denoise: Denoise = None, *,
    welds: bool, run: Run, n_threads: int,
) -> tuple[TileStore, int, float]:  # fmt: skip
    """Write a mesh as tiles; return tiles, number of smoothing steps, and slack (see `slack_of`).

    Tiles have at most `tile_cells` faces, rounded up to a multiple of `RANGE`. `n_threads` is the
    number of threads used for each tile. Smoothed positions are bit-identical to the result of
    `mesh.denoising.smoothed`. If the mesh is smoothed, it is split into tiles twice, because
    smoothing changes the order of faces along the space-filling curve.

    Raises a MeshError, like `Mesh`, for invalid coordinates or indices, and for too many faces.
    """
    chunks = Chunks.welded(pieces, scratch, tile_cells, run, n_threads, welds)
    store = tiles_of_chunks(chunks, scratch, run)
    n_steps, slack = 0, 0.0
    if denoise:
        store = replace(store, halos=find_halos(store, run))
        n_steps, slack = _smooth_all(store, denoise, run, n_threads)
    if n_steps:
        smooth = replace(pieces, points=_table(chunks, store, n_steps, run))
        for tile in range(store.n_tiles):
            scratch.remove_folder(f"tile{tile}")
        store = tiles_of_chunks(replace(chunks, pieces=smooth), scratch, run)
    scratch.remove_folder("representatives")
    return store, n_steps, slack


def _smooth_all(
    store: TileStore, denoise: int | Literal["auto"], run: Run, n_threads: int
) -> tuple[int, float]:
    """Smooth all tiles, and write the new positions; return the number of steps, and the slack.

    Each step processes every tile together with its halo: the two rings of faces around the tile.
    """
    assert store.halos is not None
    halos = store.halos
    tiles, n_steps, slack = range(store.n_tiles), 0 if denoise == "auto" else denoise, 0.0
    if denoise == "auto" or n_steps >= STEPS_WITH_SLACK:
        found = run(_measure, store, [(tile, halos[tile], n_threads) for tile in tiles])
        samples, parts = zip(*found, strict=True)
        roughness = Roughness.joined(list(parts), np.concatenate(samples))
        n_steps = roughness.n_steps if denoise == "auto" else n_steps
        slack = slack_of(n_steps, is_regular=roughness.is_regular)
    if n_steps:
        run(_link_vertices, store, [(tile, halos[tile], n_threads) for tile in tiles])
    for step in range(n_steps):
        run(_smooth, store, [(tile, halos[tile], step, n_threads) for tile in tiles])
        if step:
            store.remove_from_all(f"smoothed{step}", f"outer/smoothed{step}")
    return n_steps, slack


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
    """Smooth the vertices of a tile by one step, after `step` earlier steps; write positions.

    A step moves all vertices twice, so new positions depend on vertices up to two edges away. These
    are vertices of the halo, in the tiles `others`.
    """
    ids = store.read(tile, "around/ids")
    points = _points_after(store, tile, others, step, ids)
    graph = store.read(tile, "around/offsets"), store.read(tile, "around/neighbors")
    smoothed = _core.taubin_smooth(points, *graph, 1, n_threads)
    for folder, vertices in (("", "vertices/ids"), ("outer/", "outer/vertices/ids")):
        chosen = smoothed[np.searchsorted(ids, store.read(tile, vertices))]
        store.write(tile, f"{folder}smoothed{step + 1}", chosen)


def _points_after(store: TileStore, tile: int, others: list[int], step: int, ids: Longs) -> Floats:
    """Return the positions, after `step` steps, of the vertices `ids` of a tile and its halo."""
    name = f"smoothed{step}" if step else "vertices/points"
    points = np.empty((len(ids), 3))
    for other in others:
        at = index_in(store.read(other, "outer/vertices/ids"), ids)
        points[at[at >= 0]] = store.read(other, f"outer/{name}")[at >= 0]
    points[np.searchsorted(ids, store.read(tile, "vertices/ids"))] = store.read(tile, name)
    return points


def _measure(
    store: TileStore, tile: int, others: list[int], n_threads: int
) -> tuple[Longs, Roughness]:
    """Return the sampled faces in a tile, and the roughness at these faces.

    Faces are returned as indices in the result of `sampled_faces`.
    """
    own = Part.of_tile(store, tile, OF_FACES)
    faces = sampled_faces(store.n_cells)
    samples = np.flatnonzero(np.isin(faces, own.columns["cells"]))
    part = faces_with_halo(store, own, others)
    offsets, corners = part.corners()
    rings = np.zeros(len(part.vertices["ids"]), np.uint8)
    rings[corners[rows(offsets, index_in(faces[samples], part.columns["cells"]))[1]]] = 2
    rings = _core.spread_rings(offsets, corners, rings)
    part = part.take(np.flatnonzero(np.maximum.reduceat(rings[corners], offsets[:-1]) > 0))
    mesh = part.mesh(store)
    arcs = arcs_of_faces(mesh, np.arange(len(mesh.vertices), dtype=np.int32), n_threads)
    at = index_in(faces[samples], part.columns["cells"]).astype(np.int32)
    return samples, Roughness.of(mesh, arcs, at, n_threads)


def _table(chunks: Chunks, store: TileStore, step: int, run: Run) -> Rows:
    """Return a table of all vertex positions after `step` steps.

    Of several welded vertices, only the position of the lowest changes, because faces use only it.
    """
    vertices, size, scratch = chunks.pieces.points, chunks.size, store.scratch
    n_blocks = -(-vertices.n_rows // size)
    ends = np.arange(0, (n_blocks + 1) * size, size)
    cuts = np.array(run.all(_cut, store, store.n_tiles, ends))
    jobs = [(block, vertices, size, cuts[:, block : block + 2], step) for block in range(n_blocks)]
    run(_write_block, store, jobs)
    return BlockRows(scratch, "smoothed", size, vertices.n_rows)


def _cut(store: TileStore, tile: int, ends: Longs) -> Longs:
    return np.searchsorted(store.read(tile, "vertices/ids"), ends)


def _write_block(
    store: TileStore, block: int, vertices: Rows, size: int, cuts: Array, step: int
) -> None:
    """Write a block of vertex positions.

    `cuts` contains, for each tile, the first row of the block's vertices and the row after the
    last, in the vertices of the tile.
    """
    begin = block * size
    points = vertices.read(begin, min(begin + size, vertices.n_rows)).astype(np.float64)
    for tile in np.flatnonzero(cuts[:, 0] < cuts[:, 1]).tolist():
        ids, found = (
            store.scratch.load(f"tile{tile}/{name}", *cuts[tile].tolist())
            for name in ("vertices/ids", f"smoothed{step}")
        )
        points[ids - begin] = found
    store.scratch.save(f"smoothed/{block}", points)
