"""Compute corners, areas, normals, vertex graphs and sample points of meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_threads, freeze
from ..base.types import Array, Bools, Floats, Ints, Longs, Singles
from .base import CellsOfVertices
from .meshes import Mesh, PolygonMesh

if TYPE_CHECKING:
    from .. import TetMesh

FaceMesh: TypeAlias = Mesh | PolygonMesh
"""Mesh of faces, the result of `as_mesh`."""
AnyMesh: TypeAlias = "FaceMesh | TetMesh"


class VertexGraph(NamedTuple):
    """Graph of the vertices of a mesh, in CSR form. Each edge of the mesh has two opposite arcs."""

    offsets: Longs  # (V + 1,) index of the first arc of each vertex
    neighbors: Ints  # (A,) vertex at the end of each arc
    lengths: Floats  # (A,) length of each arc


@dataclass(frozen=True, eq=False)
class Corners:
    """Vertices at the corners of all cells (faces or tetrahedra) of a mesh, grouped by cell."""

    vertices: Ints  # (C,) vertex of each corner
    size: int | None  # number of corners of every cell; None for a `PolygonMesh`
    offsets: Longs | None = None  # (N + 1,) first corner of each cell; None if `size` is not None

    @property
    def n_cells(self) -> int:
        """Number of cells (faces or tetrahedra), N."""
        if self.offsets is not None:
            return len(self.offsets) - 1
        return len(self.vertices) // (self.size or 1)

    @property
    def sizes(self) -> Longs | int:
        """Number of corners of each cell, (N,), or one number for all cells if `size` is given."""
        return np.diff(self.offsets) if self.offsets is not None else self.size or 0

    @property
    def starts(self) -> Longs:
        """Index of the first corner of each cell, and the number of corners, (N + 1,)."""
        return np.arange(self.n_cells + 1) * self.size if self.size else self.lists[1]

    @property
    def lists(self) -> tuple[Ints, Longs, int]:
        """Arguments for `_core`: vertices, offsets (empty if None), and size (0 if None)."""
        offsets = np.empty(0, np.int64) if self.offsets is None else self.offsets
        return self.vertices, offsets, self.size or 0

    def of(self, cells: npt.NDArray[np.integer]) -> tuple[Ints, Longs]:
        """Return the vertices at the corners of `cells`, and the CSR offsets of these cells."""
        if self.offsets is None:
            table = self.vertices.reshape(-1, self.size or 0)[cells]
            return table.ravel(), np.arange(len(cells) + 1) * table.shape[1]
        sizes = self.offsets[cells + 1] - self.offsets[cells]
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        firsts = np.repeat(self.offsets[cells] - offsets[:-1], sizes)
        return self.vertices[firsts + np.arange(offsets[-1])], offsets

    def means(self, table: Floats, is_kept: Bools | None = None) -> Floats:
        """Return, for each cell, the mean row of `table` (one row per vertex) over its corners.

        If `is_kept` is given, (V,), corners that are not kept do not count: NaN if none is kept.
        """
        if is_kept is not None:
            kept = is_kept[:, np.newaxis]
            with np.errstate(invalid="ignore"):
                return self.means(np.where(kept, table, 0.0)) / self.means(kept.astype(np.float64))
        if self.offsets is None:
            return np.asarray(table[self.vertices.reshape(-1, self.size or 0)].mean(axis=1))
        sums = np.add.reduceat(table[self.vertices], self.offsets[:-1], axis=0)
        return np.asarray(sums / np.diff(self.offsets)[:, np.newaxis])

    def ends_of_sides(self, faces: Array, sides: Array) -> Ints:
        """Return both end vertices, (n, 2), of sides of faces; side s starts at corner s."""
        if self.offsets is None:
            size = self.size or 0
            table = self.vertices.reshape(-1, size)
            return np.stack([table[faces, sides], table[faces, (sides + 1) % size]], axis=1)
        starts, nexts = self.offsets[faces], sides + 1
        nexts = np.where(starts + nexts == self.offsets[faces + 1], 0, nexts)
        return np.stack([self.vertices[starts + sides], self.vertices[starts + nexts]], axis=1)


def corners_of(mesh: CellsOfVertices) -> Corners:
    """Return the corners of the faces or tetrahedra of a mesh, as views of its arrays."""
    if isinstance(mesh, PolygonMesh):
        return Corners(mesh.indices, None, mesh.offsets)
    cells = getattr(mesh, mesh.corners_name)
    return Corners(cells.reshape(-1), cells.shape[1])


def mesh_like(
    mesh: AnyMesh, vertices: Floats, corners: Ints, offsets: Longs, bounds: Floats | None = None
) -> AnyMesh:
    """Make a mesh of the same class as `mesh`; arrays are not checked if `bounds` is their box.

    `offsets` is the first corner of each cell, and is only used for a `PolygonMesh`.
    """
    arrays: dict[str, Array] = {"vertices": vertices}
    if isinstance(mesh, PolygonMesh):
        arrays |= {"offsets": offsets, "indices": corners}
    else:
        arrays[mesh.corners_name] = corners.reshape(-1, getattr(mesh, mesh.corners_name).shape[1])
    if bounds is None:
        return type(mesh)(**arrays)
    made: AnyMesh = object.__new__(type(mesh))
    freeze(made, **arrays, bounds=bounds)
    return made


def cut_into_triangles(mesh: FaceMesh) -> tuple[Ints, Array | None]:
    """Return triangles (T, 3) to draw or store faces, and the face of each (None for a `Mesh`)."""
    if isinstance(mesh, Mesh):
        return mesh.faces, None
    triangulation = mesh.triangulate()
    return triangulation.mesh.faces, triangulation.sources


def corner_triangles(mesh: FaceMesh) -> tuple[Ints, Array | None]:
    """Do the same as `cut_into_triangles`, but return indices of corners instead of vertices.

    The corners are indices in ``corners_of(mesh).vertices``, for data such as texture coordinates.
    """
    corners = corners_of(mesh)
    indices = np.arange(len(corners.vertices), dtype=np.int32)
    if corners.offsets is None:
        return indices.reshape(-1, 3), None
    at_corners = mesh.vertices[corners.vertices]
    triangles = _core.triangulate(at_corners, corners.offsets, indices, checked_threads(None))
    return triangles, np.repeat(np.arange(mesh.n_faces, dtype=np.int32), corners.sizes - 2)


def is_same_mesh(one: FaceMesh, other: FaceMesh) -> bool:
    """Return whether two meshes have the same class, vertices and faces."""
    if one is other:
        return True
    is_alike = type(one) is type(other) and np.array_equal(one.vertices, other.vertices)
    if isinstance(one, PolygonMesh) and isinstance(other, PolygonMesh):
        is_alike = is_alike and np.array_equal(one.offsets, other.offsets)
    return is_alike and np.array_equal(corners_of(one).vertices, corners_of(other).vertices)


def measure_faces(mesh: FaceMesh, n_threads: int) -> tuple[Floats, Floats]:
    """Return the centroids (F, 3) and the areas (F,) of all faces."""
    return measure_shapes(mesh, n_threads)[:2]


def measure_shapes(mesh: FaceMesh, n_threads: int) -> tuple[Floats, Floats, Floats | None]:
    """Return centroids, areas, and the squared longest side in each block of faces.

    For polygons, the third result is None.
    """
    if isinstance(mesh, Mesh):
        return _core.measure_faces(mesh.vertices, mesh.faces, n_threads)
    return *_measure_polygons(mesh, n_threads)[:2], None


def unit_normals(mesh: FaceMesh, n_threads: int) -> Floats:
    """Return the unit normal of each face, (F, 3); 0 if it is undefined."""
    if isinstance(mesh, Mesh):
        return _core.unit_normals(mesh.vertices, mesh.faces, n_threads)
    return _measure_polygons(mesh, n_threads)[2]


def single_normals(mesh: FaceMesh, n_threads: int) -> Singles:
    """Return the result of `unit_normals` in single precision."""
    if isinstance(mesh, Mesh):
        return _core.single_normals(mesh.vertices, mesh.faces, n_threads).reshape(-1, 3)
    return unit_normals(mesh, n_threads).astype(np.float32)


def area_vectors(mesh: FaceMesh, n_threads: int) -> Floats:
    """Return the area times the unit normal of each face, shape (F, 3)."""
    if isinstance(mesh, Mesh):
        return _core.area_vectors(mesh.vertices, mesh.faces, n_threads)
    _, areas, normals = _measure_polygons(mesh, n_threads)
    return areas[:, np.newaxis] * normals


def count_degenerate(mesh: FaceMesh, n_threads: int) -> int:
    """Return the number of faces whose normal is undefined, such as faces without area."""
    if isinstance(mesh, Mesh):
        return _core.count_degenerate(mesh.vertices, mesh.faces)
    return int(np.count_nonzero(~_measure_polygons(mesh, n_threads)[2].any(axis=1)))


def signed_volume(mesh: FaceMesh, origin: tuple[float, float, float], n_threads: int) -> float:
    """Return the volume of a closed mesh, negative if normals point inward; `origin` is near it."""
    triangles, _ = cut_into_triangles(mesh)
    return _core.signed_volume(mesh.vertices, triangles, origin, n_threads)


def sliver_area(
    mesh: FaceMesh, areas: Floats, longest: Floats | None, min_length: float, max_height: float,
    n_threads: int,
) -> float:  # fmt: skip
    """Return the total area of faces with length > `min_length` and height < `max_height`.

    Triangles are measured at their longest side. Other faces count as rectangles with the longest
    side or diagonal from corner 0 as length. `longest` is the third result of `measure_shapes`.
    """
    limits = (min_length, max_height, n_threads)
    if isinstance(mesh, Mesh):
        assert longest is not None
        return _core.sliver_area(mesh.vertices, mesh.faces, areas, longest, *limits)
    return _core.polygon_sliver_area(mesh.vertices, mesh.offsets, mesh.indices, areas, *limits)


def vertex_graph(mesh: AnyMesh, representative: Ints, n_threads: int) -> VertexGraph:
    """Return the graph of vertices that share an edge, all replaced by their `representative`."""
    corners = corners_of(mesh)
    if mesh.sides is not None:
        of_sides = corners.vertices.reshape(-1, corners.size or 0)[:, mesh.sides]
        corners = Corners(of_sides.reshape(-1), mesh.sides.shape[1])
    lists = corners.lists
    return VertexGraph(*_core.build_vertex_graph(mesh.vertices, *lists, representative, n_threads))


def mean_normals(mesh: AnyMesh, representative: Ints) -> Floats:
    """Return mean unit normals of the faces around vertices, (V, 3); 0 at welded duplicates."""
    if mesh.sides is not None:
        return np.zeros_like(mesh.vertices)
    return _core.mean_normals(mesh.vertices, *corners_of(mesh).lists, representative)


def _measure_polygons(mesh: PolygonMesh, n_threads: int) -> tuple[Floats, Floats, Floats]:
    """Return the centroids, areas and unit normals of polygons; undefined normals are 0."""
    return _core.measure_polygons(mesh.vertices, mesh.offsets, mesh.indices, n_threads)


GOLDEN = 0.6180339887498949
"""Golden ratio minus 1. Its multiples modulo 1 are spread evenly from 0 to 1 without a period."""


def spread_indices(n_samples: int, n: int) -> Longs:
    """Return indices spread evenly from 0 to n - 1; a larger `n_samples` only appends indices."""
    return (np.arange(n_samples) * GOLDEN % 1.0 * n).astype(np.int64)


def inverse_of(order: Ints) -> Ints:
    """Return the index after sorting of each element; `order` has the indices before sorting."""
    inverse = np.empty_like(order)
    inverse[order] = np.arange(len(order), dtype=order.dtype)
    return inverse
