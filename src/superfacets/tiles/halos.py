"""Find the halo of each tile: cells of other tiles that affect the arc weights of the tile."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Longs
from ..batches.mapping import Run
from .arrays import is_among, merged
from .part import Lists, Part
from .store import TileStore

VERTICES_AT_ONCE = 1 << 22
"""Number of consecutive vertices that are searched at a time for vertices shared by tiles."""

STEPS = 12
"""Maximum number of arcs from a point to other points that affect the weights of its arcs: 1 to the
other end of the arc, 1 to its neighbors, which may be on a ridge, 8 to the sides of the ridge, 1 to
the neighbors used to fit the curvature, and 1 to the neighbors used to average normals."""

OF_FACES = ("cells", "corners", "corners/vertices")
OF_POINTS = ("cells", "positions", "measures", "normals", "neighbors/targets")
"""Names of the arrays that are read for the faces or points of a tile and its halo."""


def find_halos(store: TileStore, run: Run) -> list[list[int]]:
    """Write the ``outer`` cells of all tiles; return, for each tile, the tiles with its halo.

    Two tiles of faces *meet* if they share a vertex. The outer faces of a tile are the faces at
    vertices that it shares, and all faces that share a vertex with these faces. The halo of a tile
    is the two rings of faces around it, which are outer faces of other tiles. The returned list of
    a tile contains the tiles that meet it, and the tiles that meet those. For points, the lists are
    empty, because halos of points are found by following arcs.
    """
    tiles = range(store.n_tiles)
    if store.kind == "points":
        run.all(_write_outer_points, store, store.n_tiles)
        return [[] for _ in tiles]
    found = run.all(_write_outer_faces, store, store.n_tiles, _shared_vertices(store))
    meeting = _meeting(found)
    return [
        sorted(meeting[tile].union(*(meeting[other] for other in meeting[tile])) - {tile})
        for tile in tiles
    ]


def faces_with_halo(store: TileStore, own: Part, others: list[int]) -> Part:
    """Return the faces `own` of a tile, and its halo from the tiles `others`, sorted by number."""
    names = (*OF_FACES, "places")
    outer = [Part.load(store.scratch, f"tile{other}/outer", names) for other in others]
    ids = own.vertices["ids"]
    ids = merged([ids[:0], *(_touching(faces, ids).vertices["ids"] for faces in outer)])
    return Part.joined([own, *(_touching(faces, ids) for faces in outer)], "cells")


def _touching(faces: Part, vertex_ids: Longs) -> Part:
    """Return the faces with at least one vertex in `vertex_ids`, which must be ascending."""
    offsets, corners = faces.corners()
    is_hit = is_among(faces.vertices["ids"], vertex_ids)[corners]
    is_touching = np.logical_or.reduceat(is_hit, offsets[:-1]) if len(faces) else np.empty(0, bool)
    return faces.take(np.flatnonzero(is_touching))


def _shared_vertices(store: TileStore) -> Longs:
    tiles = range(store.n_tiles)
    ends = np.array([store.read(tile, "vertices/ids")[[0, -1]] for tile in tiles])
    shared = []
    for first in range(int(ends[:, 0].min()), int(ends[:, 1].max()) + 1, VERTICES_AT_ONCE):
        parts = []
        for tile in tiles:
            ids = store.read(tile, "vertices/ids")
            begin, end = np.searchsorted(ids, [first, first + VERTICES_AT_ONCE])
            parts.append(ids[begin:end])
        every = np.sort(np.concatenate(parts), kind="stable")  # fast, because each part is sorted
        shared.append(merged([every[1:][every[1:] == every[:-1]]]))
    return np.concatenate(shared)


def _write_outer_faces(store: TileStore, tile: int, shared: Longs) -> Longs:
    """Write the outer faces of a tile; return the vertices that it shares with other tiles."""
    faces = Part.of_tile(store, tile, OF_FACES)
    offsets, corners = faces.corners()
    is_shared = is_among(faces.vertices["ids"], shared)
    rings = _core.spread_rings(offsets, corners, 2 * is_shared.astype(np.uint8))
    is_outer = np.maximum.reduceat(rings[corners], offsets[:-1]) > 0
    faces.take(np.flatnonzero(is_outer)).save(store.scratch, f"tile{tile}/outer")
    return np.asarray(faces.vertices["ids"][is_shared])


def _meeting(vertices_of: list[Longs]) -> list[set[int]]:
    """Return, for each tile, the set of other tiles that share a vertex with the tile."""
    n_tiles = len(vertices_of)
    ids = np.concatenate(vertices_of)
    tiles = np.repeat(np.arange(n_tiles), [len(some) for some in vertices_of])
    order = np.lexsort([tiles, ids])
    ids, tiles = ids[order], tiles[order]
    meeting: list[set[int]] = [set() for _ in range(n_tiles)]
    for step in range(1, n_tiles):
        is_same = ids[step:] == ids[:-step]
        if not is_same.any():
            break
        pairs = np.unique(np.stack([tiles[:-step][is_same], tiles[step:][is_same]], 1), axis=0)
        for one, other in pairs.tolist():
            meeting[one].add(other)
            meeting[other].add(one)
    return meeting


def _write_outer_points(store: TileStore, tile: int) -> None:
    """Write the outer points of a tile: all points within `STEPS` arcs of another tile."""
    points = Part.of_tile(store, tile, OF_POINTS)
    near = points.lists["neighbors"]
    targets = near.entries["targets"]
    sources = np.repeat(np.arange(len(points)), np.diff(near.offsets))
    is_own = store.is_in(tile, targets)
    is_outer = np.zeros(len(points), bool)
    is_outer[sources[~is_own]] = True
    sources, targets = sources[is_own], targets[is_own] - store.starts[tile]
    for _ in range(STEPS - 1):
        is_outer[targets[is_outer[sources]]] = True  # arcs go in both directions
    points.take(np.flatnonzero(is_outer)).save(store.scratch, f"tile{tile}/outer")


def points_with_halo(store: TileStore, tile: int) -> Part:
    """Return the points of a tile and of its halo, in curve order.

    The outermost points of the halo, `STEPS` arcs from the tile, have no neighbors in the result.
    """
    parts = [Part.of_tile(store, tile, OF_POINTS)]
    known = np.empty(0, np.int32)  # curve indices of points in the halo
    for step in range(STEPS):
        targets = parts[-1].lists["neighbors"].entries["targets"]
        places = np.setdiff1d(targets[~store.is_in(tile, targets)], known)
        if not len(places):
            break
        tiles, found = store.tiles_of(places), []
        for other in np.unique(tiles).tolist():
            outer = Part.load(store.scratch, f"tile{other}/outer", (*OF_POINTS, "places"))
            found.append(outer.at(places[tiles == other]))
        points = Part.joined(found, "places")
        if step == STEPS - 1:
            none = Lists(np.zeros(len(points) + 1, np.int64), {"targets": np.empty(0, np.int32)})
            points = Part(points.columns, {"neighbors": none})
        parts.append(points)
        known = np.concatenate([known, places])
    return Part.joined(parts, "places")
