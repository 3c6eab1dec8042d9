"""Tetrahedral meshes, stored as checked arrays of vertices and tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets import Mesh
from superfacets.kit import Floats, Ints, Longs, TetCells, counted

# Row i lists the three corners opposite to corner i of a tetrahedron. The three corners are
# counterclockwise seen from outside if the signed volume of the tetrahedron is positive.
_SIDES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


class TetBoundary(NamedTuple):
    """Result of `TetMesh.boundary`.

    Attributes
    ----------
    mesh : Mesh
        Triangles, counterclockwise seen from outside, with the vertices of the `TetMesh`.
    sources : ndarray of int32, shape (F,)
        Tetrahedron of each triangle. If ``labels`` are labels of the tetrahedra,
        ``labels[sources]`` are labels of the triangles.
    """

    mesh: Mesh
    sources: Ints

    def __repr__(self) -> str:
        return f"TetBoundary({self.mesh!r}, .sources)"


@dataclass(frozen=True, eq=False)
class TetMesh(TetCells):
    """A tetrahedral mesh with checked, read-only arrays.

    Tetrahedra keep their order, and each tetrahedron gets one label. Tetrahedra may be inverted,
    flat, duplicates of others, or have repeated vertices.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Same as in `Mesh`.
    tets : array_like of integers, shape (N, 4)
        Vertex indices from 0 to V - 1, copied to a read-only int32 array. N is at least 1.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Minimum and maximum corner of the bounding box of all vertices of tetrahedra.

    Raises
    ------
    MeshError
        If an array is not valid (the message names the first invalid entry), if there are no
        tetrahedra, or if all tetrahedra are at one point.

    Examples
    --------
    >>> corner = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    >>> corner, corner.boundary().mesh
    (TetMesh(4 vertices, 1 tet), Mesh(4 vertices, 4 faces))
    """

    sides: ClassVar[Longs | None] = _SIDES

    vertices: Floats
    tets: Ints
    bounds: Floats = field(init=False, repr=False)

    @property
    def n_tets(self) -> int:
        """Number of tetrahedra, N."""
        return len(self.tets)

    def boundary(self, keep: npt.ArrayLike | None = None, *, weld: float = True) -> TetBoundary:
        """Return the boundary: all triangles that belong to exactly one of the kept tetrahedra.

        Parameters
        ----------
        keep : array_like of bool, shape (N,), optional
            Whether each tetrahedron is kept. By default, all tetrahedra are kept. For a cross
            section, use for example ``positions[:, 0] < 0.5``, where ``positions`` are the
            centroids of the tetrahedra.
        weld : bool, default True
            Whether vertices at exactly the same position are treated as one vertex.

        Raises
        ------
        MeshError
            If no triangle belongs to exactly one kept tetrahedron, for example because every
            tetrahedron has a duplicate, or because no tetrahedron is kept.
        ValueError, TypeError
            If `keep` is not an array with one bool per tetrahedron.
        """
        tets, opposite = self.boundary_sides(keep, weld)
        triangles = self.tets[tets[:, np.newaxis], _SIDES[opposite]]
        is_inverted = signed_volumes(self)[tets] < 0
        triangles[is_inverted] = triangles[is_inverted][:, ::-1]
        return TetBoundary(Mesh(self.vertices, triangles), tets.astype(np.int32))

    def __repr__(self) -> str:
        return f"TetMesh({counted(self.n_vertices, 'vertex')}, {counted(self.n_tets, 'tet')})"


def signed_volumes(mesh: TetMesh) -> Floats:
    """Return volumes (N,), negative if corners 0 to 2 are clockwise as seen from corner 3."""
    a, b, c, d = (mesh.vertices[corner] for corner in mesh.tets.T)
    volumes: Floats = np.einsum("ij,ij->i", d - a, np.cross(b - a, c - a)) / 6.0
    return volumes
