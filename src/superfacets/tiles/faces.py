"""Some faces of a tiled mesh: what is needed to make a small mesh of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import freeze
from ..mesh.faces import FaceMesh
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.triangle_mesh import Mesh
from .store import TileStore

__all__ = ["Faces", "is_among", "merged", "mesh_of", "read_corners", "read_faces", "rows"]

Longs = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces with their corners and vertices.

    Attributes
    ----------
    places, cells : ndarray, shape (n,)
        Where they are on the curve, and their numbers in the input.
    offsets, corners : ndarray, shape (n + 1,) and (c,)
        Corners as rows of `vertices`.
    vertex_ids, vertices : ndarray, shape (m,) and (m, 3)
        Numbers of vertices, ascending, and their positions.
    """

    places: Longs
    cells: npt.NDArray[np.int32]
    offsets: Longs
    corners: npt.NDArray[np.int32]
    vertex_ids: Longs
    vertices: npt.NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.places)

    def take(self, chosen: npt.NDArray[np.integer]) -> Faces:
        """The faces of these indices, in this order, without the vertices of others."""
        offsets, at = rows(self.offsets, chosen)
        is_used = np.zeros(len(self.vertex_ids), bool)
        is_used[self.corners[at]] = True
        numbers = np.cumsum(is_used, dtype=np.int32) - 1
        return Faces(
            self.places[chosen],
            self.cells[chosen],
            offsets,
            numbers[self.corners[at]],
            self.vertex_ids[is_used],
            self.vertices[is_used],
        )

    def touching(self, vertex_ids: Longs) -> npt.NDArray[np.int64]:
        """Indices of the faces that have one of these vertices (ascending numbers)."""
        is_hit = is_among(self.vertex_ids, vertex_ids)
        if not is_hit.any():
            return np.empty(0, np.int64)
        return np.flatnonzero(np.logical_or.reduceat(is_hit[self.corners], self.offsets[:-1]))

    @classmethod
    def joined(cls, parts: Sequence[Faces]) -> Faces:
        """All faces of some parts, in the order of their numbers in the input."""
        vertex_ids = merged([part.vertex_ids for part in parts])
        vertices = np.empty((len(vertex_ids), 3))
        corners = []
        for part in parts:
            numbers = np.searchsorted(vertex_ids, part.vertex_ids).astype(np.int32)
            vertices[numbers] = part.vertices
            corners.append(numbers[part.corners])
        sizes = np.concatenate([np.diff(part.offsets) for part in parts])
        cells = np.concatenate([part.cells for part in parts])
        order = np.argsort(cells, kind="stable")
        offsets, at = rows(np.concatenate([[0], np.cumsum(sizes)]), order)
        return cls(
            np.concatenate([part.places for part in parts])[order],
            cells[order],
            offsets,
            np.concatenate(corners)[at],
            vertex_ids,
            vertices,
        )

    def mesh(self, store: TileStore) -> FaceMesh:
        """A mesh of them, with the bounds of the whole; nothing is checked again."""
        return mesh_of(store, np.ascontiguousarray(self.vertices), self.offsets, self.corners)


def mesh_of(
    store: TileStore,
    vertices: npt.NDArray[np.float64],
    offsets: Longs,
    corners: npt.NDArray[np.int32],
) -> FaceMesh:
    """A mesh of some faces of the store, with the bounds of the whole; nothing is checked."""
    if store.kind == "polygons":
        polygons = object.__new__(PolygonMesh)
        freeze(polygons, vertices=vertices, offsets=offsets, indices=corners)
        freeze(polygons, bounds=store.bounds.copy())
        return polygons
    mesh = object.__new__(Mesh)
    freeze(mesh, vertices=vertices, faces=corners.reshape(-1, 3), bounds=store.bounds.copy())
    return mesh


def read_faces(store: TileStore, tile: int) -> Faces:
    """The faces of a tile, in the order of places."""
    offsets, corners = read_corners(store, tile)
    return Faces(
        np.arange(store.starts[tile], store.starts[tile + 1]),
        store.read(tile, "cells"),
        offsets,
        corners,
        store.read(tile, "vertex_ids"),
        store.read(tile, "vertices"),
    )


def read_corners(store: TileStore, tile: int) -> tuple[Longs, npt.NDArray[np.int32]]:
    """Offsets and corners of the faces of a tile, as in `Faces`."""
    if store.kind == "polygons":
        return store.read(tile, "offsets"), store.read(tile, "corners")
    return np.arange(0, 3 * store.size(tile) + 1, 3), store.read(tile, "faces").reshape(-1)


def rows(offsets: Longs, chosen: npt.NDArray[np.integer]) -> tuple[Longs, Longs]:
    """Offsets of the rows chosen from an array in CSR form, and where their entries are in it."""
    return _core.choose_lists(offsets, np.asarray(chosen, np.int64))


def merged(lists: Sequence[Longs]) -> Longs:
    """All numbers of some ascending lists, ascending, each once."""
    numbers = np.sort(np.concatenate(lists), kind="stable")  # fast, as it finds what ascends
    is_new = np.ones(len(numbers), bool)
    is_new[1:] = numbers[1:] != numbers[:-1]
    different: Longs = numbers[is_new]
    return different


def is_among(
    values: npt.NDArray[np.integer], wanted: npt.NDArray[np.integer]
) -> npt.NDArray[np.bool_]:
    """Whether each value is among those wanted, which ascend."""
    at = np.searchsorted(wanted, values)
    is_hit = at < len(wanted)
    is_hit[is_hit] = wanted[at[is_hit]] == values[is_hit]
    return is_hit
