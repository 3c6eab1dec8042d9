"""Find the nearest face of a mesh to each query point."""

from __future__ import annotations

from typing import NamedTuple

from ..base.checks import checked_threads
from ..base.types import Floats, Ints
from ..graph.kinds import kind_of
from ..mesh.convert import CloudLike, MeshLike, as_mesh
from ..mesh.queries import checked_distance, query_points


class NearestFaces(NamedTuple):
    """Result of `superfacets.nearest_faces`: nearest faces and points for M query points.

    Attributes
    ----------
    faces : ndarray of int32, shape (M,)
        Nearest face to each query point, or -1 if all faces are farther than `max_distance`. If
        several faces are equally near, the face with the lowest index is returned.
    distances : ndarray of float64, shape (M,)
        Distance to the nearest face, in the unit of the mesh; infinite if the face is -1.
    points : ndarray of float64, shape (M, 3)
        Nearest point of the nearest face; NaN if the face is -1.
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
    """Return, for each query point, the nearest face, its distance, and the nearest point on it.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`. Degenerate faces are included. A polygon is replaced by its triangles
        from ``PolygonMesh.triangulate()``.
    points : array_like, shape (M, 3), or PointCloud or cloud-like
        Query points with finite coordinates. M may be 0.
    max_distance : float, optional
        Maximum distance between a query point and its nearest face, >= 0, in the unit of the mesh.
        By default, there is no limit.
    n_threads : int, optional
        Same as in `segment`. The result does not depend on the number of threads.

    Returns
    -------
    NearestFaces
        The nearest face, its distance and the nearest point, for each query point. If the nearest
        point is on an edge or at a vertex, the face with the lowest index at this point is
        returned.

    Raises
    ------
    MeshError
        If the mesh is not valid or has no faces, or if the points are not finite or do not have
        shape (M, 3).
    ValueError, TypeError
        If `max_distance` or `n_threads` is out of range or of the wrong type.

    Notes
    -----
    Building a bounding volume hierarchy takes O(F log F). A query near the surface takes O(log F).

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
