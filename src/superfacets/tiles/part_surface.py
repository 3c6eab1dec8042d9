"""The surface of a part: the argument of the kernels for weights and borders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import _core
from .._types import Ints, Longs
from ..cells.cell_graph import box_diagonal
from ..cells.surface import Surface
from .arrays import index_near
from .part import Lists, Part
from .store import TileStore


def in_order_of_cells(part: Part) -> Part:
    """Points, sorted by place, reordered by cell number, with ``neighbors`` as indices."""
    order = np.argsort(part.columns["cells"])
    ranks = np.empty(len(order), np.int32)
    ranks[order] = np.arange(len(order))
    lists = {"arcs": part.lists["neighbors"]}
    points = Part(part.columns, lists)
    return with_neighbors(points, points.columns["places"], ranks, sorts=True)[0].take(order)


def with_neighbors(part: Part, places: Ints, ranks: Ints, *, sorts: bool) -> tuple[Part, Longs]:
    """Replace the ``targets`` of arcs, which are places, by ``neighbors``, the ranks of places.

    `ranks` are those of `places`, ascending. Arcs that lead elsewhere are dropped; their indices
    are returned, too. With `sorts` the arcs of a cell are sorted by rank, as in a cloud.
    """
    arcs = part.lists["arcs"]
    at = index_near(arcs.entries["targets"], places, part.columns["places"])
    kept = np.flatnonzero(at >= 0)
    sources = np.repeat(np.arange(len(part), dtype=np.int32), np.diff(arcs.offsets))[kept]
    neighbors = ranks[at[kept]]
    if sorts and np.any(ranks[1:] < ranks[:-1]):  # there are copies
        order = np.lexsort((neighbors, sources))
        kept, neighbors = kept[order], neighbors[order]
    offsets = np.searchsorted(sources, np.arange(len(part) + 1)).astype(np.int64)
    entries = {name: column[kept] for name, column in arcs.entries.items() if name != "targets"}
    lists = part.lists | {"arcs": Lists(offsets, entries | {"neighbors": neighbors})}
    return replace(part, lists=lists), np.flatnonzero(at < 0)


def surface_of(store: TileStore, part: Part, n_threads: int) -> Surface:
    """The surface of cells with ``neighbors``; it has no angles between faces."""
    arcs = part.lists["arcs"]
    offsets, neighbors = arcs.offsets, arcs.entries["neighbors"]
    diagonal = box_diagonal(store.bounds)
    handle: _core.Surface
    if store.kind == "points":
        columns = part.columns
        handle = _core.PointSurface(
            columns["positions"], columns["measures"], columns.get("normals", np.empty((0, 3))),
            np.arange(len(part), dtype=np.int32), offsets, neighbors,
        )  # fmt: skip
        return Surface(handle, offsets, neighbors, store.bounds, diagonal, n_threads)
    points, (corner_offsets, corners) = part.vertices["points"], part.corners()
    sides = arcs.entries["sides"]
    if store.kind == "polygons":
        turns = np.zeros(len(neighbors), np.uint8)
        faces = points, corner_offsets, corners
        handle = _core.PolygonSurface(*faces, offsets, neighbors, sides, turns, False, n_threads)
    else:
        handle = _core.TriangleSurface(
            points, corners.reshape(-1, 3), offsets, neighbors, sides, np.empty(0, np.uint8), False
        )
    return Surface(handle, offsets, neighbors, store.bounds, diagonal, n_threads)
