"""Find the nearest cell to a point, for any kind of cells."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .._types import Floats, Ints
from .._validate import checked_number, checked_queries, checked_threads
from ..adapters.convert import CloudLike, MeshLike, as_cloud, as_mesh
from .kinds import kind_of


class NearestFaces(NamedTuple):
    """For each of M points, the nearest face of a mesh.

    Attributes
    ----------
    faces : ndarray of int32, shape (M,)
        The nearest face; ties go to the lowest face. -1 if all faces are farther than
        `max_distance`.
    distances : ndarray of float64, shape (M,)
        Distance to the nearest face, in the unit of the mesh; infinite for face -1.
    points : ndarray of float64, shape (M, 3)
        The nearest point of the nearest face; NaN for face -1.
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
    """Return the nearest face of a mesh to each point, its distance, and its nearest point.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        As for `segment`. Degenerate faces count, too. A polygon is represented by the triangles of
        ``PolygonMesh.triangulate()``.
    points : array_like, shape (M, 3), or PointCloud or cloud-like
        Finite positions, possibly none.
    max_distance : float, optional
        Largest distance, >= 0, in the unit of the mesh.
    n_threads : int, optional
        As for `segment`. The result does not depend on it.

    Returns
    -------
    NearestFaces
        If the nearest point is on an edge or at a vertex, the result is the lowest face there.

    Raises
    ------
    MeshError
        If the mesh is not valid or has no faces, or the points are not finite or not of shape
        (M, 3).
    ValueError, TypeError
        If another parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(F log F) to build a box tree, and O(log F) per point near the surface.

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
    """Return a distance >= 0; infinity for None."""
    if max_distance is None:
        return math.inf
    return checked_number(max_distance, "max_distance", zero=True)


def query_points(points: Any) -> Floats:
    """Return the valid positions, shape (M, 3), of an array or a cloud; else a MeshError."""
    if isinstance(points, (np.ndarray, list, tuple)):
        return checked_queries(points)
    return checked_queries(as_cloud(points).points)
