"""Stage 0: a mesh from anything that looks like one."""

from __future__ import annotations

import os
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from ..mesh.triangle_mesh import Mesh

__all__ = ["MeshLike", "as_mesh"]


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


MeshLike: TypeAlias = (
    Mesh
    | str
    | os.PathLike[str]
    | tuple[npt.ArrayLike, npt.ArrayLike]
    | list[npt.ArrayLike]
    | _Faces
    | _Triangles
    | _Tensors
    | _PolyData
)
"""What functions accept as a mesh: a `Mesh`, a path, a (vertices, faces) pair, or a mesh of
trimesh, PyVista or Open3D."""


def as_mesh(source: MeshLike) -> Mesh:
    """Return `source` as a `Mesh`.

    Parameters
    ----------
    source : Mesh, (vertices, faces) pair, path, or mesh of another library
        A path is read by `read_mesh`. Meshes of trimesh, PyVista (``PolyData``) and Open3D
        (legacy and tensor) are recognized by their attributes; none of these is imported.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    TypeError
        If `source` does not look like a mesh.
    """
    if isinstance(source, Mesh):
        return source
    if isinstance(source, (str, os.PathLike)):
        from ..io.readers.read import read_mesh

        return read_mesh(source)
    if isinstance(source, (tuple, list)):
        if len(source) != 2:
            raise TypeError(f"expected a (vertices, faces) pair, got {len(source)} items")
        return _mesh_of(source[0], source[1])
    return _mesh_of(*_arrays_of_foreign(source))


def _mesh_of(vertices: Any, faces: Any) -> Mesh:
    return Mesh(vertices, faces)


def _arrays_of_foreign(source: Any) -> tuple[Any, Any]:
    """Vertices and faces of a mesh object of another library."""
    if hasattr(source, "vertices") and hasattr(source, "faces"):  # trimesh
        return source.vertices, source.faces
    if hasattr(source, "vertices") and hasattr(source, "triangles"):  # Open3D, legacy
        return source.vertices, source.triangles
    if hasattr(source, "vertex") and hasattr(source, "triangle"):  # Open3D, tensor
        return _arrays_of_tensor_mesh(source)
    if hasattr(source, "points") and hasattr(source, "faces"):  # PyVista PolyData
        return source.points, _triangles_of_polydata(source)
    raise TypeError(
        f"{type(source).__name__} does not look like a triangle mesh: expected a superfacets.Mesh,"
        " a (vertices, faces) pair, a path, or a mesh of trimesh, PyVista (PolyData) or Open3D;"
        " of a Scene pass .to_mesh(), of a grid .extract_surface().triangulate()"
    )


def _arrays_of_tensor_mesh(source: Any) -> tuple[Any, Any]:
    """Arrays of an Open3D tensor mesh, brought to the CPU."""
    if "indices" not in source.triangle:
        raise MeshError("the mesh has no faces")
    return source.vertex.positions.cpu().numpy(), source.triangle.indices.cpu().numpy()


def _triangles_of_polydata(source: Any) -> npt.NDArray[Any]:
    """Faces of a PyVista PolyData, whose `faces` are flat: a count, then that many indices."""
    if getattr(source, "n_strips", 0):
        raise MeshError("the PolyData holds triangle strips: call .triangulate() first")
    flat = np.asarray(source.faces)
    if flat.ndim != 1:
        raise MeshError(f"expected flat faces (count, indices, ...), got shape {flat.shape}")
    if len(flat) % 4 or np.any(flat[::4] != 3):
        raise MeshError("the PolyData has faces that are not triangles: call .triangulate() first")
    return flat.reshape(-1, 4)[:, 1:]
