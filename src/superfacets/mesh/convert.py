"""Convert files, arrays and objects of other libraries to meshes and point clouds."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ..base.checks import counted, polygon_arrays, refuse_order
from ..base.errors import MeshError
from ..base.lazy import load
from ..base.types import Array
from .base import Cells
from .faces import FaceMesh
from .meshes import Mesh, PolygonMesh
from .point_cloud import PointCloud

if TYPE_CHECKING:
    from .. import TetMesh

_VTK_TETRA = 10
"""Number that identifies tetrahedra among the cell types of VTK."""

_TETS = ("tetra", "tetra10")
"""Types of tetrahedra in meshio. The first four nodes of a tetrahedron are its corners; all other
nodes are on its edges."""

_FACES = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4, "polygon": None}
"""Number of corners for each type of face in meshio, or None if faces of this type may have any
number of corners. The corners are the first nodes of a face."""

_SKIPPED = ("vertex", "line", "line3")
"""Types of cells in meshio that are ignored."""


class _Vertices(Protocol):  # a mesh of trimesh or of Open3D's legacy API
    @property
    def vertices(self) -> Any: ...


class _Tensors(Protocol):  # an Open3D mesh of the tensor API
    @property
    def vertex(self) -> Any: ...


class _DataSet(Protocol):  # a PyVista surface or grid, or a meshio mesh
    @property
    def points(self) -> Any: ...


class _Points(Protocol):  # a point cloud of Open3D's tensor API
    @property
    def point(self) -> Any: ...


_ForeignMesh: TypeAlias = _Vertices | _Tensors | _DataSet
_Pair: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike] | list[npt.ArrayLike]

Rows: TypeAlias = npt.NDArray[np.floating[Any] | np.integer[Any]] | Sequence[Sequence[float]]
"""Array or nested sequence of points. `ArrayLike` is not used here, because it also accepts a
single number."""

CloudLike: TypeAlias = PointCloud | str | os.PathLike[str] | Rows | _Points
"""Types accepted as a point cloud: a `PointCloud`, a path, an (N, 3) array, or a cloud of trimesh,
PyVista, Open3D or meshio."""

MeshLike: TypeAlias = Cells | _Pair | _ForeignMesh | CloudLike
"""Types of the argument of `as_cells`: a mesh or a point cloud of this package, a path, a
(vertices, faces) pair, an (N, 3) array, or an object of trimesh, PyVista, Open3D or meshio. Apps
annotate parameters with it. Functions that need faces raise a MeshError for other cells."""


def as_cells(source: MeshLike) -> Cells:
    """Convert a parameter, any input of `segment`, to a mesh or a point cloud.

    A (vertices, faces) pair becomes a `Mesh` if all faces are triangles, else a `PolygonMesh`.
    Objects of other libraries, which are not imported, are recognized by their attributes: from
    PyVista, ``PolyData`` and ``UnstructuredGrid`` of tetrahedra; from Open3D, both APIs. Raises a
    MeshError if the mesh or the cloud is not valid, and a TypeError if `source` is not `MeshLike`.
    """
    if isinstance(source, Cells):
        return source
    if isinstance(source, (str, os.PathLike)):
        cells: Cells = load("superfacets.tools.cell_file:CellFile").read(source).cells()
        return cells
    refuse_order(source, "a mesh")
    if isinstance(source, (tuple, list)):
        if len(source) != 2:
            raise TypeError(
                f"a mesh must be a (vertices, faces) pair, got {counted(len(source), 'item')}"
            )
        return _mesh_of(source[0], source[1])
    if isinstance(source, np.ndarray):
        return as_cloud(source)
    return _cells_of_foreign(source)


def as_mesh(source: MeshLike) -> FaceMesh:
    """Convert a parameter to a mesh of faces; raise a MeshError for clouds and tetrahedra."""
    if isinstance(source, (str, os.PathLike)):
        source = load("superfacets.files.readers.read:read_mesh")(source)
    cells = as_cells(source)
    if isinstance(cells, (Mesh, PolygonMesh)):
        return cells
    name = type(cells).__name__
    if hasattr(cells, "boundary"):
        raise MeshError(f"expected a surface mesh, got a {name}: use {name}.boundary()")
    raise MeshError(f"expected a surface mesh, got a {name}, which has no faces")


def _cells_of_foreign(source: Any) -> Cells:
    """Convert an object of another library to a mesh or a point cloud."""
    kinds = getattr(source, "celltypes", None)
    if kinds is not None and len(kinds) and np.all(np.asarray(kinds) == _VTK_TETRA):
        return tet_mesh(source.points, np.asarray(source.cells).reshape(-1, 5)[:, 1:])
    if has_blocks(source) and cell_blocks(source):
        return mesh_of_blocks(source)
    return _cloud_of_foreign(source) or _mesh_of(*_arrays_of_foreign(source))


def _mesh_of(vertices: Any, faces: Any) -> FaceMesh:
    """Make a `Mesh` if all faces are triangles, and a `PolygonMesh` otherwise."""
    shape = _shape_of(faces)
    if shape is None or (len(shape) == 2 and shape[1] > 3):
        return PolygonMesh.of_faces(vertices, faces)
    return Mesh(vertices, faces)


def _shape_of(faces: Any) -> tuple[int, ...] | None:
    """Return the shape of an array of faces; None for a ragged list or an array of objects."""
    if isinstance(faces, np.ndarray):
        return None if faces.dtype == object and faces.ndim == 1 and len(faces) else faces.shape
    try:
        shape: tuple[int, ...] = np.shape(faces)
    except ValueError:
        return None
    return shape


def _arrays_of_foreign(source: Any) -> tuple[Any, Any]:
    """Return vertices and faces of a mesh of a supported library, or raise a TypeError."""
    if hasattr(source, "vertices") and hasattr(source, "faces"):  # trimesh
        return source.vertices, source.faces
    if hasattr(source, "vertices") and hasattr(source, "triangles"):  # Open3D, legacy API
        return source.vertices, source.triangles
    if hasattr(source, "vertex") and hasattr(source, "triangle"):  # Open3D, tensor API
        if "indices" not in source.triangle:
            raise MeshError("the mesh has no faces")
        return source.vertex.positions.cpu().numpy(), source.triangle.indices.cpu().numpy()
    if hasattr(source, "points") and hasattr(source, "faces"):  # PyVista PolyData
        return source.points, _faces_of_polydata(source)
    raise TypeError(
        "expected a mesh of superfacets, a (vertices, faces) pair, a path, or a mesh of trimesh,"
        f" PyVista (PolyData), Open3D or meshio, got {type(source).__name__}: convert a trimesh"
        " Scene with .to_mesh(), or a PyVista grid with .extract_surface()"
    )


def _faces_of_polydata(source: Any) -> Any:
    """Return the faces of a PolyData: (F, n) if all have n corners, or a list of arrays."""
    if getattr(source, "n_strips", 0):
        raise MeshError("a PolyData must not have triangle strips: call .triangulate() on it first")
    flat = np.asarray(source.faces)
    if flat.ndim != 1:
        raise MeshError(f"faces of a PolyData must have shape (n,), got shape {flat.shape}")
    step = int(flat[0]) + 1 if len(flat) else 4
    if step > 0 and len(flat) % step == 0 and np.all(flat[::step] == step - 1):
        return flat.reshape(-1, step)[:, 1:]
    return _faces_of_any_length(flat)


def _faces_of_any_length(flat: Array) -> list[Array]:
    """Split the flat array of a PolyData into faces with different numbers of corners."""
    faces: list[Array] = []
    start = 0
    while start < len(flat):
        end = start + 1 + int(flat[start])
        if not start < end <= len(flat):
            raise MeshError(
                f"faces[{len(faces)}] of a PolyData has {counted(int(flat[start]), 'corner')}, but"
                f" the array of faces has only {counted(len(flat) - start - 1, 'more value')}"
            )
        faces.append(flat[start + 1 : end])
        start = end
    return faces


def as_cloud(source: CloudLike) -> PointCloud:
    """Convert a cloud that `segment` accepts, as `as_cells` does; raise TypeError for others."""
    if isinstance(source, PointCloud):
        return source
    if isinstance(source, (str, os.PathLike)):
        cloud: PointCloud = load("superfacets.files.readers.read:read_cloud")(source)
        return cloud
    refuse_order(source, "a mesh")
    if isinstance(source, (np.ndarray, list, tuple)):
        return PointCloud(source)  # type: ignore[arg-type]
    found = _cloud_of_foreign(source)
    if found is None:
        raise TypeError(
            "expected a PointCloud, an array of points, a path, or a cloud of trimesh, PyVista,"
            f" Open3D or meshio, got {type(source).__name__}"
        )
    return found


def _cloud_of_foreign(source: Any) -> PointCloud | None:
    """Convert an object of another library that has points but no faces; None for other objects."""
    given: tuple[Any, ...] = ()  # points, normals and colors
    if has_blocks(source):
        given = () if cell_blocks(source) else (source.points,)
    elif hasattr(source, "n_points") and hasattr(source, "n_cells"):  # PyVista
        has_faces = np.size(getattr(source, "faces", 0)) or getattr(source, "n_strips", 0)
        if hasattr(source, "verts") and source.n_points > 0 and not has_faces:
            data = source.point_data
            given = source.points, data.get("Normals"), data.get("RGB", data.get("RGBA"))
    elif hasattr(source, "point") and not hasattr(source, "triangle"):  # Open3D, tensor API
        data = {name: tensor.cpu().numpy() for name, tensor in source.point.items()}
        if "positions" in data:
            given = data["positions"], data.get("normals"), data.get("colors")
    elif hasattr(source, "faces") or hasattr(source, "triangles"):
        pass
    elif hasattr(source, "points"):  # Open3D, legacy API
        normals = np.asarray(source.normals) if source.has_normals() else None
        colors = np.asarray(source.colors) if source.has_colors() else None
        given = np.asarray(source.points), normals, colors
    elif hasattr(source, "vertices"):  # trimesh
        colors = np.asarray(getattr(source, "colors", ()))
        given = source.vertices, None, colors if colors.size else None
    return PointCloud(*given) if given else None


def has_blocks(source: Any) -> bool:
    """Return whether an object looks like a meshio mesh; its list of blocks may be empty."""
    blocks = getattr(source, "cells", None)
    if not isinstance(blocks, list) or not hasattr(source, "points"):
        return False
    return all(hasattr(block, "type") and hasattr(block, "data") for block in blocks)


def cell_blocks(source: Any) -> list[int]:
    """Return the indices of the blocks of a meshio mesh that contain the cells to segment.

    The cells are tetrahedra if there are any, otherwise faces; a point cloud has none. Raises a
    MeshError if a block has other cells, such as hexahedra. Vertices and lines are ignored.
    """
    filled = [i for i, block in enumerate(source.cells) if len(block.data)]
    kinds = {i: source.cells[i].type for i in filled}
    known = (*_TETS, *_FACES, *_SKIPPED)
    others = sorted({kind for kind in kinds.values() if kind not in known})
    if others:
        raise MeshError(f"cells must be faces or tetrahedra, got {', '.join(others)}")
    tets = [i for i in filled if kinds[i] in _TETS]
    return tets or [i for i in filled if kinds[i] in _FACES]


def tet_mesh(vertices: Any, tets: Any) -> TetMesh:
    """Return a mesh of tetrahedra."""
    mesh: TetMesh = load("superfacets_formats.tet_mesh:TetMesh")(vertices, tets)
    return mesh


def mesh_of_blocks(source: Any) -> FaceMesh | TetMesh:
    """Return the cells in the blocks that `cell_blocks` finds, in the order of the blocks."""
    blocks = [source.cells[i] for i in cell_blocks(source)]
    if blocks[0].type in _TETS:
        tets = np.concatenate([np.asarray(block.data)[:, :4] for block in blocks])
        return tet_mesh(source.points, tets)
    parts = [_faces_of(block) for block in blocks]
    corners = np.concatenate([part[1] for part in parts])
    if all(_FACES[block.type] == 3 for block in blocks):
        return Mesh(source.points, corners.reshape(-1, 3))
    sizes = np.concatenate([np.diff(offsets) for offsets, _ in parts])
    return PolygonMesh(source.points, np.concatenate([[0], np.cumsum(sizes)]), corners)


def _faces_of(block: Any) -> tuple[Array, Array]:
    """Return CSR offsets and corners of the faces of a block; other nodes are left out."""
    n_corners = _FACES[block.type]
    if n_corners is None:
        return polygon_arrays(block.data)
    return polygon_arrays(np.asarray(block.data)[:, :n_corners])
