"""Tiles of a mesh in memory: the expected result for a mesh that is read in pieces."""

from __future__ import annotations

import numpy as np

from superfacets import _core
from superfacets._validate import checked_threads
from superfacets.batches.mapping import Run
from superfacets.mesh.faces import FaceMesh, corners_in_a_row, face_sizes, measure_faces
from superfacets.mesh.polygon_mesh import PolygonMesh
from superfacets.tiles.arrays import rows
from superfacets.tiles.store import TileStore, tile_starts
from superfacets.workers.scratch import Scratch
from superfacets.workers.threads import in_turn

run_serially = Run(in_turn)
"""Run one job after another, in this process."""


def cut_mesh(
    mesh: FaceMesh, scratch: Scratch, n_tiles: int, *, weld: bool, n_threads: int | None = None
) -> TileStore:
    """Write a mesh as at most `n_tiles` tiles; meshes read from files are cut in the same way."""
    threads = checked_threads(n_threads)
    positions, measures = measure_faces(mesh, threads)
    order = _core.OrderedGraph(
        _core.PlacedCells(positions, measures, threads),
        np.zeros(mesh.n_faces + 1, np.int64),
        np.empty(0, np.int32),
        np.empty(0, np.float32),
        threads,
    ).order()
    store = TileStore(
        scratch,
        "polygons" if isinstance(mesh, PolygonMesh) else "triangles",
        tile_starts(mesh.n_faces, n_tiles),
        mesh.bounds,
        _core.sum_of(measures, threads),
    )
    corners = corners_in_a_row(mesh)
    if weld:
        corners = _core.weld_vertices(mesh.vertices, threads)[corners]
    all_offsets = np.concatenate([[0], np.cumsum(face_sizes(mesh))])
    for tile in range(store.n_tiles):
        cells = order[store.starts[tile] : store.starts[tile + 1]]
        store.write(tile, "cells", cells)
        store.write(tile, "positions", positions[cells])
        store.write(tile, "measures", measures[cells])
        offsets, at = rows(all_offsets, cells)
        vertex_ids, local = np.unique(corners[at], return_inverse=True)
        store.write(tile, "vertices/ids", vertex_ids.astype(np.int64))
        store.write(tile, "vertices/points", mesh.vertices[vertex_ids])
        if store.kind == "polygons":
            store.write(tile, "corners/offsets", offsets)
            store.write(tile, "corners/vertices", local.astype(np.int32))
        else:
            store.write(tile, "corners", local.astype(np.int32).reshape(-1, 3))
    return store
