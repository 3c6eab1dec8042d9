"""Meshes of triangles, and of polygons, stored as checked arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import (
    checked_polygons,
    checked_simplices,
    checked_threads,
    counted,
    freeze,
    polygon_arrays,
)
from ..base.types import Floats, Ints, Longs
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


class Triangulation(NamedTuple):
    """Result of `superfacets.PolygonMesh.triangulate`.

    Attributes
    ----------
    mesh : Mesh
        Triangles, with the vertices of the `PolygonMesh`. A polygon of n corners becomes n - 2
        triangles with the same orientation. Triangles are in the order of the polygons.
    sources : ndarray of int32, shape (T,)
        Polygon that contains each triangle. If ``labels`` are labels of the polygons,
        ``labels[sources]`` are labels of the triangles.
    """

    mesh: Mesh
    sources: Ints

    def __repr__(self) -> str:
        return f"Triangulation({self.mesh!r}, .sources)"


@dataclass(frozen=True, eq=False)
class PolygonMesh(CellsOfVertices):
    """A mesh of faces with any number of corners; its arrays are checked and read-only.

    Faces keep their order, and each face gets one label. Concave and non-planar faces are
    supported. Faces may have repeated corners, self-intersections or no area. The mesh may be
    non-manifold, open, inconsistently oriented or disconnected.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Same as in `Mesh`.
    offsets : array_like of integers, shape (F + 1,)
        The corners of face i are ``indices[offsets[i]:offsets[i + 1]]``. Each face has three or
        more corners, and F is at least 1. Copied to a read-only int64 array.
    indices : array_like of integers, shape (C,)
        Vertices, 0 to V - 1, at the corners of all faces, counterclockwise seen from outside.
        Copied to a read-only int32 array.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Minimum and maximum corner of the bounding box of all vertices of faces.

    Raises
    ------
    MeshError
        If an array is not valid (the message names the first invalid entry), if a face has fewer
        than three corners, if there are no faces, or if all faces are at one point.

    Examples
    --------
    A square and a triangle beside it:

    >>> house = PolygonMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]],
    ...                     [0, 4, 7], [0, 1, 2, 3, 3, 2, 4])
    >>> house, house.face(1)
    (PolygonMesh(5 vertices, 2 faces), array([3, 2, 4], dtype=int32))
    """

    vertices: Floats
    offsets: Longs
    indices: Ints
    bounds: Floats = field(init=False, repr=False)

    def _check(self, *, are_new: bool = False) -> None:
        vertices, offsets, indices, bounds = checked_polygons(
            self.vertices, self.offsets, self.indices, are_new=are_new
        )
        freeze(self, vertices=vertices, offsets=offsets, indices=indices, bounds=bounds)

    @classmethod
    def of_faces(cls, vertices: npt.ArrayLike, faces: Sequence[Any] | npt.ArrayLike) -> PolygonMesh:
        """Make a mesh from `faces`: lists of vertices, or an array with one face per row.

        Examples
        --------
        >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 2, 0]]
        >>> PolygonMesh.of_faces(corners, [[0, 1, 2, 3], [3, 2, 4]]).offsets
        array([0, 4, 7])
        """
        return cls(vertices, *polygon_arrays(faces))  # type: ignore[arg-type]

    @property
    def n_cells(self) -> int:
        """Number of cells. The cells of this mesh are its faces."""
        return len(self.offsets) - 1

    @property
    def n_faces(self) -> int:
        """Number of faces, F."""
        return len(self.offsets) - 1

    @property
    def sizes(self) -> Longs:
        """Number of corners of each face, shape (F,)."""
        return np.diff(self.offsets)

    def face(self, i: int) -> Ints:
        """Return the vertices at the corners of face i.

        Raises an IndexError if i is not from 0 to F - 1.
        """
        if not 0 <= i < self.n_faces:
            raise IndexError(f"there is no face {i}: the number of faces is {self.n_faces}")
        return self.indices[self.offsets[i] : self.offsets[i + 1]]

    def triangulate(self) -> Triangulation:
        """Cut the faces into triangles, without adding vertices.

        Faces are cut into a fan around their first corner if no triangle of the fan is flipped, as
        in convex faces, and otherwise by ear clipping. Faces with more than 4,096 corners are
        always cut into a fan. Use this method for programs and file formats that need triangles.

        Examples
        --------
        >>> square = PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        ...                               [[0, 1, 2, 3]])
        >>> square.triangulate().mesh.faces.tolist(), square.triangulate().sources.tolist()
        ([[0, 1, 2], [0, 2, 3]], [0, 0])
        """
        triangles = _core.triangulate(
            self.vertices, self.offsets, self.indices, checked_threads(None)
        )
        sources = np.repeat(np.arange(self.n_faces, dtype=np.int32), self.sizes - 2)
        return Triangulation(Mesh._of_new(self.vertices, triangles), sources)

    def __repr__(self) -> str:
        return f"PolygonMesh({counted(self.n_vertices, 'vertex')}, {counted(self.n_faces, 'face')})"
