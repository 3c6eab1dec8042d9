"""Triangle meshes, stored as checked arrays of vertices and faces."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..base.checks import checked_simplices, counted, freeze
from ..base.types import Floats, Ints
from .base import CellsOfVertices


@dataclass(frozen=True, eq=False)
class Mesh(CellsOfVertices):
    """A triangle mesh with checked, read-only arrays.

    The mesh may be open, non-manifold, inconsistently oriented, degenerate, disconnected, or a
    triangle soup. Faces keep their order.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Finite positions, stored as read-only float64. Faces need not use every vertex. A contiguous
        float64 array is not copied (unless it is a memory map), so do not change the array while
        the mesh is in use.
    faces : array_like of integers, shape (F, 3)
        Vertex indices from 0 to V - 1, counterclockwise seen from outside. Copied to a read-only
        int32 array. F is at least 1.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Minimum and maximum corner of the bounding box of all vertices of faces.

    Raises
    ------
    MeshError
        If an array is not valid (the message names the first invalid entry), if there are no faces,
        or if all faces are at one point.

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> square.n_faces
    2
    """

    vertices: Floats
    faces: Ints
    bounds: Floats = field(init=False, repr=False)

    def _check(self, *, are_new: bool = False) -> None:
        given = self.vertices, self.faces
        vertices, faces, bounds = checked_simplices(*given, "faces", 3, are_new=are_new)
        freeze(self, vertices=vertices, faces=faces, bounds=bounds)

    @property
    def n_cells(self) -> int:
        """Number of cells. The cells of this mesh are its faces."""
        return len(self.faces)

    @property
    def n_faces(self) -> int:
        """Number of faces, F."""
        return len(self.faces)

    def __repr__(self) -> str:
        return f"Mesh({counted(self.n_vertices, 'vertex')}, {counted(self.n_faces, 'face')})"
