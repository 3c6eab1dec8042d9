"""Triangle meshes, and a function that splits every triangle into four."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base.checks import checked_mesh, counted, freeze
from ..base.types import Array, Floats, Ints
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

    def __post_init__(self) -> None:
        vertices, faces, bounds = checked_mesh(self.vertices, self.faces)
        freeze(self, vertices=vertices, faces=faces, bounds=bounds)

    @classmethod
    def _of_new(cls, vertices: Array, faces: Array) -> Mesh:
        """Make a mesh from new arrays. They are not copied, because no other code uses them."""
        mesh = object.__new__(cls)
        vertices, faces, bounds = checked_mesh(vertices, faces, are_new=True)
        freeze(mesh, vertices=vertices, faces=faces, bounds=bounds)
        return mesh

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


def split_in_four(vertices: Floats, faces: Array) -> tuple[Floats, Ints]:
    """Split each face into four at the midpoints of its sides; return vertices and faces.

    Neighboring faces share the midpoint of their common edge. Orientation, area and shape are
    preserved, and so are boundary edges and non-manifold edges. Time is O(F log F).

    Parameters
    ----------
    vertices : ndarray of float64, shape (V, 3)
    faces : ndarray of int, shape (F, 3)

    Returns
    -------
    vertices : ndarray of float64, shape (V + E, 3)
        The vertices of the input, followed by the midpoint of each edge.
    faces : ndarray of int32, shape (4 F, 3)
        Face f becomes four faces: 4 f, 4 f + 1 and 4 f + 2 at its corners, and 4 f + 3 in the
        middle.

    Examples
    --------
    >>> vertices, faces = split_in_four(np.eye(3), np.array([[0, 1, 2]]))
    >>> faces.tolist()
    [[0, 3, 4], [3, 1, 5], [4, 5, 2], [3, 5, 4]]
    """
    corners = faces.astype(np.int64)
    ends = np.stack([corners, np.roll(corners, -1, axis=1)])  # (2, F, 3) start, end of each side
    key_of_side = (ends.min(axis=0) * len(vertices) + ends.max(axis=0)).ravel()
    order = np.argsort(key_of_side)
    sorted_keys = key_of_side[order]
    is_first = np.diff(sorted_keys, prepend=-1) != 0
    edge_of_side = np.empty(len(order), dtype=np.int64)
    edge_of_side[order] = np.cumsum(is_first) - 1
    low, high = np.divmod(sorted_keys[is_first], len(vertices))
    middles = 0.5 * (vertices[low] + vertices[high])
    a, b, c = corners.T
    ab, bc, ca = len(vertices) + edge_of_side.reshape(-1, 3).T
    quarters = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return np.concatenate([vertices, middles]), quarters.reshape(-1, 3).astype(np.int32)
