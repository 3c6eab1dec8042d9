"""Some faces of a tiled mesh: what is needed to make a small mesh of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._validate import freeze
from ..mesh.faces import FaceMesh
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.triangle_mesh import Mesh
from .store import TileStore

__all__ = ["NO_FACES", "Faces", "is_among", "read_faces", "rows"]

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
        used, corners = np.unique(self.corners[at], return_inverse=True)
        return Faces(
            self.places[chosen],
            self.cells[chosen],
            offsets,
            corners.astype(np.int32),
            self.vertex_ids[used],
            self.vertices[used],
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
        vertex_ids, first = np.unique(
            np.concatenate([part.vertex_ids for part in parts]), return_index=True
        )
        corners = np.concatenate(
            [np.searchsorted(vertex_ids, part.vertex_ids)[part.corners] for part in parts]
        )
        sizes = np.concatenate([np.diff(part.offsets) for part in parts])
        cells = np.concatenate([part.cells for part in parts])
        order = np.argsort(cells, kind="stable")
        offsets, at = rows(np.concatenate([[0], np.cumsum(sizes)]), order)
        return cls(
            np.concatenate([part.places for part in parts])[order],
            cells[order],
            offsets,
            corners[at].astype(np.int32),
            vertex_ids,
            np.concatenate([part.vertices for part in parts])[first],
        )

    def mesh(self, store: TileStore) -> FaceMesh:
        """A mesh of them, with the bounds of the whole; nothing is checked again."""
        vertices = np.ascontiguousarray(self.vertices)
        if store.kind == "polygons":
            polygons = object.__new__(PolygonMesh)
            freeze(polygons, vertices=vertices, offsets=self.offsets, indices=self.corners)
            freeze(polygons, bounds=store.bounds.copy())
            return polygons
        mesh = object.__new__(Mesh)
        faces = self.corners.reshape(-1, 3)
        freeze(mesh, vertices=vertices, faces=faces, bounds=store.bounds.copy())
        return mesh


NO_FACES = Faces(
    np.empty(0, np.int64),
    np.empty(0, np.int32),
    np.zeros(1, np.int64),
    np.empty(0, np.int32),
    np.empty(0, np.int64),
    np.empty((0, 3)),
)


def read_faces(store: TileStore, tile: int) -> Faces:
    """The faces of a tile, in the order of places."""
    n_cells = store.size(tile)
    if store.kind == "polygons":
        offsets, corners = store.read(tile, "offsets"), store.read(tile, "corners")
    else:
        corners = store.read(tile, "faces").reshape(-1)
        offsets = np.arange(0, 3 * n_cells + 1, 3)
    return Faces(
        np.arange(store.starts[tile], store.starts[tile + 1]),
        store.read(tile, "cells"),
        offsets,
        corners,
        store.read(tile, "vertex_ids"),
        store.read(tile, "vertices"),
    )


def rows(offsets: Longs, chosen: npt.NDArray[np.integer]) -> tuple[Longs, Longs]:
    """Offsets of the rows chosen from an array in CSR form, and where their entries are in it."""
    starts, sizes = offsets[chosen], np.diff(offsets)[chosen]
    ends = np.cumsum(sizes)
    at = np.arange(ends[-1] if len(ends) else 0) + np.repeat(starts - ends + sizes, sizes)
    return np.concatenate([[0], ends]).astype(np.int64), at


def is_among(
    values: npt.NDArray[np.integer], wanted: npt.NDArray[np.integer]
) -> npt.NDArray[np.bool_]:
    """Whether each value is among those wanted, which ascend."""
    at = np.searchsorted(wanted, values)
    is_hit = at < len(wanted)
    is_hit[is_hit] = wanted[at[is_hit]] == values[is_hit]
    return is_hit
