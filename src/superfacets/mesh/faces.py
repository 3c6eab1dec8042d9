"""What is asked of the faces of a mesh, of triangles or of polygons: the one place that tells."""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from .point_cloud import PointCloud
from .polygon_mesh import PolygonMesh
from .tet_mesh import TetMesh
from .triangle_mesh import Mesh

__all__ = [
    "AnyCells",
    "AnyMesh",
    "FaceMesh",
    "VertexGraph",
    "area_vectors",
    "corners_in_a_row",
    "count_degenerate",
    "cut_into_triangles",
    "ends_of_sides",
    "face_sizes",
    "is_same_mesh",
    "measure_faces",
    "n_cells_of",
    "noun_of",
    "signed_volume",
    "sliver_area",
    "vertex_graph",
]

FaceMesh: TypeAlias = Mesh | PolygonMesh
AnyMesh: TypeAlias = FaceMesh | TetMesh
AnyCells: TypeAlias = AnyMesh | PointCloud

Floats = npt.NDArray[np.float64]


class VertexGraph(NamedTuple):
    """Which vertices share an edge, in CSR form, and the lengths of the edges."""

    offsets: npt.NDArray[np.int64]
    neighbors: npt.NDArray[np.int32]
    lengths: Floats


def n_cells_of(mesh: AnyCells) -> int:
    """Return the number of faces, tetrahedra or points, which is that of labels."""
    if isinstance(mesh, PointCloud):
        return mesh.n_points
    return mesh.n_tets if isinstance(mesh, TetMesh) else mesh.n_faces


def noun_of(mesh: AnyCells) -> str:
    """What messages call a cell of a mesh."""
    if isinstance(mesh, PointCloud):
        return "point"
    return "tet" if isinstance(mesh, TetMesh) else "face"


def corners_in_a_row(mesh: FaceMesh) -> npt.NDArray[np.int32]:
    """Vertices of the corners of all faces, shape (C,)."""
    return mesh.indices if isinstance(mesh, PolygonMesh) else mesh.faces.ravel()


def face_sizes(mesh: FaceMesh) -> npt.NDArray[np.int64]:
    """Number of corners of each face, shape (F,)."""
    if isinstance(mesh, PolygonMesh):
        return mesh.sizes
    return np.full(mesh.n_faces, 3, dtype=np.int64)


def cut_into_triangles(mesh: FaceMesh) -> tuple[npt.NDArray[np.int32], npt.NDArray[Any] | None]:
    """Triangles, (T, 3), and the face that each is a part of; None where those are the faces."""
    if isinstance(mesh, Mesh):
        return mesh.faces, None
    triangulation = mesh.triangulate()
    return triangulation.mesh.faces, triangulation.sources


def ends_of_sides(
    mesh: FaceMesh, faces: npt.NDArray[Any], sides: npt.NDArray[Any]
) -> npt.NDArray[np.int32]:
    """Vertices that sides of faces begin and end at, shape (n, 2)."""
    if isinstance(mesh, Mesh):
        return np.stack([mesh.faces[faces, sides], mesh.faces[faces, (sides + 1) % 3]], axis=1)
    starts, nexts = mesh.offsets[faces], sides + 1
    nexts = np.where(starts + nexts == mesh.offsets[faces + 1], 0, nexts)
    return np.stack([mesh.indices[starts + sides], mesh.indices[starts + nexts]], axis=1)


def is_same_mesh(one: FaceMesh, other: FaceMesh) -> bool:
    """Whether two meshes have the same vertices and faces."""
    if one is other:
        return True
    is_alike = type(one) is type(other) and np.array_equal(one.vertices, other.vertices)
    if isinstance(one, PolygonMesh) and isinstance(other, PolygonMesh):
        is_alike = is_alike and np.array_equal(one.offsets, other.offsets)
    return is_alike and np.array_equal(corners_in_a_row(one), corners_in_a_row(other))


def measure_faces(mesh: FaceMesh, n_threads: int) -> tuple[Floats, Floats]:
    """Centroids, shape (F, 3), and areas, shape (F,)."""
    if isinstance(mesh, Mesh):
        return _core.measure_faces(mesh.vertices, mesh.faces, n_threads)
    centroids, areas, _ = _measure_polygons(mesh, n_threads)
    return centroids, areas


def area_vectors(mesh: FaceMesh, n_threads: int) -> Floats:
    """Area times unit normal of each face, shape (F, 3)."""
    if isinstance(mesh, Mesh):
        return _core.area_vectors(mesh.vertices, mesh.faces, n_threads)
    _, areas, normals = _measure_polygons(mesh, n_threads)
    return areas[:, np.newaxis] * normals


def count_degenerate(mesh: FaceMesh, n_threads: int) -> int:
    """Return the number of faces that have no normal."""
    if isinstance(mesh, Mesh):
        return _core.count_degenerate(mesh.vertices, mesh.faces)
    return int(np.count_nonzero(~_measure_polygons(mesh, n_threads)[2].any(axis=1)))


def signed_volume(mesh: FaceMesh, origin: tuple[float, float, float], n_threads: int) -> float:
    """Volume that a closed mesh encloses, negative where normals point inwards."""
    triangles, _ = cut_into_triangles(mesh)
    return _core.signed_volume(mesh.vertices, triangles, origin, n_threads)


def sliver_area(
    mesh: FaceMesh,
    areas: Floats,
    longest: Floats | None,
    min_length: float,
    max_height: float,
    n_threads: int,
) -> float:
    """Area of the faces that are longer than the one and thinner than the other.

    `longest`, for triangles, is what the core's `measure_shapes` returns.
    """
    limits = (min_length, max_height, n_threads)
    if isinstance(mesh, Mesh):
        assert longest is not None
        return _core.sliver_area(mesh.vertices, mesh.faces, areas, longest, *limits)
    return _core.polygon_sliver_area(mesh.vertices, mesh.offsets, mesh.indices, areas, *limits)


def vertex_graph(
    mesh: FaceMesh, representative: npt.NDArray[np.int32], n_threads: int
) -> VertexGraph:
    """Return the graph of the vertices that are the lowest of their position."""
    if isinstance(mesh, Mesh):
        arrays = _core.build_vertex_graph(mesh.vertices, mesh.faces, representative, n_threads)
    else:
        arrays = _core.build_polygon_vertex_graph(
            mesh.vertices, mesh.offsets, mesh.indices, representative, n_threads
        )
    return VertexGraph(*arrays)


def _measure_polygons(mesh: PolygonMesh, n_threads: int) -> tuple[Floats, Floats, Floats]:
    """Centroids, areas, and normals, which are zero where there are none."""
    return _core.measure_polygons(mesh.vertices, mesh.offsets, mesh.indices, n_threads)
