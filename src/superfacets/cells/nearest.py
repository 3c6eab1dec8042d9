"""The cell that is nearest to a point, for any kind of cells."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .._types import Floats, Ints
from .._validate import checked_number, checked_queries, checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cloud, as_mesh
from .kinds import kind_of


class NearestFaces(NamedTuple):
    """For each of M points, the face of a mesh that is nearest to it.

    Attributes
    ----------
    faces : ndarray of int32, shape (M,)
        The lowest of equally near ones; -1 where all are farther than `max_distance`.
    distances : ndarray of float64, shape (M,)
        To that face, in the unit of the mesh; infinite where there is none.
    points : ndarray of float64, shape (M, 3)
        The nearest point of that face; NaN where there is none.
    """

    faces: Ints
    distances: Floats
    points: Floats


def nearest_faces(
    mesh: MeshLike,
    points: CloudLike,
    *,
    max_distance: float | None = None,
    n_threads: int | None = None,
) -> NearestFaces:
    """Return the nearest face of a mesh to each point, its distance, and the nearest point of it.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        As for `segment`. Faces without an area count, too. A polygon is represented by the
        triangles of ``PolygonMesh.triangulate()``.
    points : array_like, shape (M, 3), or PointCloud or cloud-like
        Positions, finite; there may be none.
    max_distance : float, optional
        Faces beyond this distance are not found, >= 0, in the unit of the mesh.
    n_threads : int, optional
        As for `segment`. The result does not depend on it.

    Returns
    -------
    NearestFaces
        For points whose nearest point is on an edge or at a vertex, the lowest of its faces.

    Raises
    ------
    MeshError
        If the mesh is not valid or has no faces, or the points are not finite or not of shape
        (M, 3).
    ValueError, TypeError
        If another parameter is out of range or of the wrong type.

    Notes
    -----
    O(F log F) to build a tree of boxes, and O(log F) for a point near the surface.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> found = nearest_faces(square, [[0.2, 0.8, 1], [0.5, 0.5, 0], [1, -2, 0]])
    >>> found.faces.tolist(), found.distances.tolist(), found.points[2].tolist()
    ([1, 0, 0], [1.0, 0.0, 2.0], [1.0, 0.0, 0.0])
    """
    surface = as_mesh(mesh)
    queries = query_points(points)
    limit = checked_distance(max_distance)
    found = kind_of(surface).nearest(surface, queries, limit, checked_threads(n_threads))
    return NearestFaces(*found)


def checked_distance(max_distance: Any) -> float:
    """A distance >= 0, infinite where None is given."""
    if max_distance is None:
        return math.inf
    return checked_number(max_distance, "max_distance", zero=True)


def query_points(points: Any) -> Floats:
    """Positions, shape (M, 3), of an array or of anything like a cloud; a MeshError if wrong."""
    if isinstance(points, (np.ndarray, list, tuple)):
        return checked_queries(points)
    return checked_queries(as_cloud(points).points)
