"""Which tiles meet at vertices, and the faces there that one tile needs of another."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from .faces import Faces, is_among, merged, read_faces
from .store import Run, TileStore

__all__ = ["find_rims", "halo_of"]

Longs = npt.NDArray[np.int64]

VERTICES_AT_ONCE = 1 << 22
"""Numbers of vertices that are looked for at once: most of them are in one tile."""

RIM = ("places", "cells", "offsets", "corners", "vertex_ids", "vertices")


def find_rims(store: TileStore, run: Run) -> list[list[int]]:
    """Write the faces at the rim of each tile, and return the tiles whose rims each one needs.

    Tiles meet where they share a vertex. At the rim are the faces that have such a vertex, and
    those that share a vertex with these. The halo of a tile, the faces that share a vertex with it,
    and those that share one with the halo, are at the rims of the tiles that it meets, and of those
    that these meet.
    """
    shared = _shared_vertices(store)
    tiles = range(store.n_tiles)
    found = run(_write_rim, store, [(tile, shared) for tile in tiles])
    meeting = _meeting(found, store.n_tiles)
    return [
        sorted(meeting[tile].union(*(meeting[other] for other in meeting[tile])) - {tile})
        for tile in tiles
    ]


def halo_of(store: TileStore, own: Faces, others: list[int]) -> list[Faces]:
    """The faces of other tiles that share a vertex with a tile, and those next to them."""
    rims = [Faces(*(store.read(other, f"rim_{name}") for name in RIM)) for other in others]
    halos = [rim.take(rim.touching(own.vertex_ids)) for rim in rims]
    ids = merged([own.vertex_ids[:0], *(halo.vertex_ids for halo in halos)])
    return [rim.take(rim.touching(ids)) for rim in rims]


def _shared_vertices(store: TileStore) -> Longs:
    """The vertices of more than one tile, ascending."""
    ends = np.array([store.read(tile, "vertex_ids")[[0, -1]] for tile in range(store.n_tiles)])
    low, high = ends[:, 0].min(), ends[:, 1].max()
    shared = []
    for first in range(int(low), int(high) + 1, VERTICES_AT_ONCE):
        end = first + VERTICES_AT_ONCE
        parts = [_between(store, tile, first, end) for tile in range(store.n_tiles)]
        ids = np.sort(np.concatenate(parts), kind="stable")  # each part ascends
        shared.append(merged([ids[1:][ids[1:] == ids[:-1]]]))
    return np.concatenate(shared)


def _between(store: TileStore, tile: int, first: int, end: int) -> Longs:
    ids = store.read(tile, "vertex_ids")
    begin, stop = np.searchsorted(ids, [first, end])
    return ids[begin:stop]


def _write_rim(store: TileStore, tile: int, shared: Longs) -> Longs:
    """Write the faces with a shared vertex, and which vertices are; return the numbers of these."""
    faces = read_faces(store, tile)
    at = np.flatnonzero(is_among(faces.vertex_ids, shared))
    rings = np.zeros(len(faces.vertex_ids), np.uint8)
    rings[at] = 2
    rings = _core.spread_rings(faces.offsets, faces.corners, rings)
    is_at_rim = np.maximum.reduceat(rings[faces.corners], faces.offsets[:-1]) > 0
    rim = faces.take(np.flatnonzero(is_at_rim))
    for name in RIM:
        store.write(tile, f"rim_{name}", getattr(rim, name))
    store.write(tile, "shared", at.astype(np.int32))
    store.write(tile, "shared_ids", faces.vertex_ids[at])
    return faces.vertex_ids[at]


def _meeting(vertices_of: list[Longs], n_tiles: int) -> list[set[int]]:
    """The other tiles that have one of the vertices of each."""
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
