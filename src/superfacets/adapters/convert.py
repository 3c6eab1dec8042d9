"""Stage 0: a mesh from anything that looks like one."""

from __future__ import annotations

import os
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from .._types import Array
from ..errors import MeshError
from ..mesh.cells import Cells
from ..mesh.faces import FaceMesh
from ..mesh.point_cloud import PointCloud
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh
from ..mesh.triangle_mesh import Mesh
from .blocks import cell_blocks, has_blocks, mesh_of_blocks
from .clouds import CloudLike, as_cloud, is_foreign_cloud

_VTK_TETRA = 10
"""Number of the kind of cell in VTK."""


class _Faces(Protocol):
    """A mesh of trimesh: anything with vertices and faces."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class _Triangles(Protocol):
    """A legacy mesh of Open3D."""

    @property
    def vertices(self) -> Any: ...
    @property
    def triangles(self) -> Any: ...


class _Tensors(Protocol):
    """A tensor mesh of Open3D."""

    @property
    def vertex(self) -> Any: ...
    @property
    def triangle(self) -> Any: ...


class _PolyData(Protocol):
    """A surface of PyVista."""

    @property
    def points(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class _Blocks(Protocol):
    """A mesh of meshio."""

    @property
    def points(self) -> Any: ...
    @property
    def cells(self) -> Any: ...


MeshLike: TypeAlias = (
    Cells
    | str
    | os.PathLike[str]
    | tuple[npt.ArrayLike, npt.ArrayLike]
    | list[npt.ArrayLike]
    | _Faces
    | _Triangles
    | _Tensors
    | _PolyData
    | _Blocks
)
"""What functions accept as a mesh: a `Mesh` or `PolygonMesh`, a path, a (vertices, faces) pair, or
a mesh of trimesh, PyVista, Open3D or meshio."""


def as_cells(source: MeshLike | CloudLike) -> Cells:
    """Return `source` as one of the classes that `cells.kinds` knows, as `segment` takes it.

    Parameters
    ----------
    source : Mesh, PolygonMesh, TetMesh, (vertices, faces) pair, path, or mesh of another library
        None of the classes is made into another. A path is read by `read_mesh`. Faces of a pair
        are an (F, n) array, or lists of vertices that may differ in length: a `Mesh` if all are
        triangles, else a `PolygonMesh`. Meshes of trimesh, PyVista (``PolyData``, and
        ``UnstructuredGrid`` of tetrahedra), Open3D (legacy and tensor) and meshio (the tetrahedra,
        or the faces where there are none, of all blocks) are recognized by their attributes; none
        of these is imported. A `PointCloud`, an (N, 3) array, a file without faces and clouds of
        these libraries are point clouds; see `as_cloud`.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    TypeError
        If `source` does not look like a mesh.
    """
    if isinstance(source, Cells):
        return source
    if isinstance(source, (str, os.PathLike)):
        from ..io.readers.read import read_cells

        return read_cells(source)
    if isinstance(source, (tuple, list)):
        if len(source) != 2:
            raise TypeError(f"expected a (vertices, faces) pair, got {len(source)} items")
        return _mesh_of(source[0], source[1])
    if isinstance(source, np.ndarray):
        return as_cloud(source)
    return _cells_of_foreign(source)


def as_mesh(source: MeshLike | PointCloud) -> FaceMesh:
    """Return `source` as a mesh of faces, as `as_cells`; a MeshError if it has none."""
    if isinstance(source, (str, os.PathLike)):
        from ..io.readers.read import read_mesh

        source = read_mesh(source)
    cells = as_cells(source)
    if isinstance(cells, (Mesh, PolygonMesh)):
        return cells
    if isinstance(cells, PointCloud):
        raise MeshError("this needs a surface, and a point cloud has no faces")
    if isinstance(cells, TetMesh):
        raise MeshError(
            "this needs a surface, and the mesh has tetrahedra: TetMesh.boundary() is their outside"
        )
    raise MeshError(f"this needs a surface, and a {type(cells).__name__} has no faces")


def as_tets(source: MeshLike) -> TetMesh:
    """Return `source` as a mesh of tetrahedra, as `as_cells`; a MeshError if it has none."""
    cells = as_cells(source)
    if isinstance(cells, TetMesh):
        return cells
    raise MeshError("the mesh has faces, not tetrahedra")


def _cells_of_foreign(source: Any) -> Cells:
    """Cells of an object of another library."""
    if _is_grid_of_tets(source):
        return _tets_of_grid(source)
    if has_blocks(source) and cell_blocks(source):
        return mesh_of_blocks(source)
    if is_foreign_cloud(source):
        return as_cloud(source)
    return _mesh_of(*_arrays_of_foreign(source))


def _tets_of_grid(grid: Any) -> TetMesh:
    return TetMesh(grid.points, np.asarray(grid.cells).reshape(-1, 5)[:, 1:])


def _is_grid_of_tets(source: Any) -> bool:
    """Whether this is an UnstructuredGrid of PyVista that holds tetrahedra alone."""
    kinds = getattr(source, "celltypes", None)
    return kinds is not None and len(kinds) > 0 and bool(np.all(np.asarray(kinds) == _VTK_TETRA))


def as_triangles(source: MeshLike) -> Mesh:
    """Return `source` as a `Mesh`; a MeshError if it has faces that are no triangles."""
    mesh = as_mesh(source)
    if isinstance(mesh, Mesh):
        return mesh
    sizes = mesh.sizes
    if (sizes == 3).all():
        return Mesh._of_new(mesh.vertices, mesh.indices.reshape(-1, 3))
    first = int(np.argmax(sizes != 3))
    raise MeshError(
        f"faces[{first}] has {sizes[first]} corners, and this needs triangles: those of"
        " PolygonMesh.triangulate()"
    )


def _mesh_of(vertices: Any, faces: Any) -> FaceMesh:
    """Triangles where all faces are such, in a rectangular array or in lists."""
    shape = _shape_of(faces)
    if shape is None or (len(shape) == 2 and shape[1] > 3):
        return PolygonMesh.of_faces(vertices, faces)
    return Mesh(vertices, faces)


def _shape_of(faces: Any) -> tuple[int, ...] | None:
    """Shape of the array that faces are, or would make; None where they differ in length."""
    if isinstance(faces, np.ndarray):
        return None if faces.dtype == object and faces.ndim == 1 and len(faces) else faces.shape
    try:
        shape: tuple[int, ...] = np.shape(faces)
    except ValueError:
        return None
    return shape


def _arrays_of_foreign(source: Any) -> tuple[Any, Any]:
    """Vertices and faces of a mesh object of another library."""
    if hasattr(source, "vertices") and hasattr(source, "faces"):  # trimesh
        return source.vertices, source.faces
    if hasattr(source, "vertices") and hasattr(source, "triangles"):  # Open3D, legacy
        return source.vertices, source.triangles
    if hasattr(source, "vertex") and hasattr(source, "triangle"):  # Open3D, tensor
        return _arrays_of_tensor_mesh(source)
    if hasattr(source, "points") and hasattr(source, "faces"):  # PyVista PolyData
        return source.points, _faces_of_polydata(source)
    raise TypeError(
        f"{type(source).__name__} does not look like a mesh: expected a superfacets.Mesh or"
        " PolygonMesh, a (vertices, faces) pair, a path, or a mesh of trimesh, PyVista"
        " (PolyData), Open3D or meshio; of a Scene pass .to_mesh(), of a grid .extract_surface()"
    )


def _arrays_of_tensor_mesh(source: Any) -> tuple[Any, Any]:
    """Arrays of an Open3D tensor mesh, brought to the CPU."""
    if "indices" not in source.triangle:
        raise MeshError("the mesh has no faces")
    return source.vertex.positions.cpu().numpy(), source.triangle.indices.cpu().numpy()


def _faces_of_polydata(source: Any) -> Any:
    """Faces of a PyVista PolyData, whose `faces` are flat: a count, then that many indices."""
    if getattr(source, "n_strips", 0):
        raise MeshError("the PolyData holds triangle strips: call .triangulate() first")
    flat = np.asarray(source.faces)
    if flat.ndim != 1:
        raise MeshError(f"expected flat faces (count, indices, ...), got shape {flat.shape}")
    step = int(flat[0]) + 1 if len(flat) else 4
    if step > 0 and len(flat) % step == 0 and np.all(flat[::step] == step - 1):
        return flat.reshape(-1, step)[:, 1:]
    return _faces_in_turn(flat)


def _faces_in_turn(flat: Array) -> list[Array]:
    """Faces that differ in length; each begins where the one before it ends."""
    faces: list[Array] = []
    place = 0
    while place < len(flat):
        end = place + 1 + int(flat[place])
        if not place < end <= len(flat):
            raise MeshError(f"faces[{len(faces)}] runs beyond the end of the flat faces")
        faces.append(flat[place + 1 : end])
        place = end
    return faces
