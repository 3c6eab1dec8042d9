"""Stage 0: triangle meshes, as two arrays, from anything that looks like one."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ._validate import checked_mesh, freeze
from .errors import MeshError

__all__ = ["Mesh", "as_mesh"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh: checked, and safe to hand to every stage.

    Open, non-manifold, inconsistently oriented, degenerate and disconnected meshes and soups of
    triangles are all accepted. Faces are kept as they are, in their order.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Positions, finite; kept as float64, read-only. Faces need not use every vertex.
    faces : array_like of integers, shape (F, 3)
        Vertex indices, 0 to V - 1, counterclockwise seen from outside; kept as int32, read-only.
        F >= 1.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Low and high corner of the bounding box of the vertices that faces use.

    Raises
    ------
    MeshError
        If a shape, an index or a coordinate is wrong (the first offender is named), if there is
        no face, or if all faces lie at one point.

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> square.n_faces
    2
    """

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int32]
    bounds: npt.NDArray[np.float64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices, faces, bounds = checked_mesh(self.vertices, self.faces)
        freeze(self, vertices=vertices, faces=faces, bounds=bounds)

    @property
    def n_faces(self) -> int:
        """Number of faces, F."""
        return len(self.faces)

    @property
    def n_vertices(self) -> int:
        """Number of vertices, V, used or not."""
        return len(self.vertices)

    def __repr__(self) -> str:
        return f"Mesh({self.n_vertices} vertices, {self.n_faces} faces)"


def as_mesh(source: object) -> Mesh:
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
        from .io import read_mesh

        return read_mesh(source)
    if isinstance(source, (tuple, list)):
        if len(source) != 2:
            raise TypeError(f"expected a (vertices, faces) pair, got {len(source)} items")
        return Mesh(source[0], source[1])
    return Mesh(*_arrays_of_foreign(source))


def _arrays_of_foreign(source: Any) -> tuple[Any, Any]:
    """Vertices and faces of a mesh object of another library."""
    if hasattr(source, "vertices") and hasattr(source, "faces"):  # trimesh
        return np.asarray(source.vertices), np.asarray(source.faces)
    if hasattr(source, "vertices") and hasattr(source, "triangles"):  # Open3D, legacy
        return np.asarray(source.vertices), np.asarray(source.triangles)
    if hasattr(source, "vertex") and hasattr(source, "triangle"):  # Open3D, tensor
        return _arrays_of_tensor_mesh(source)
    if hasattr(source, "points") and hasattr(source, "faces"):  # PyVista PolyData
        return np.asarray(source.points), _triangles_of_polydata(source)
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
