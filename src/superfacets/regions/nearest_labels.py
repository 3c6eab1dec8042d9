"""Stage 5: transfer labels to another mesh, to a cloud, or to points."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.checks import checked_classes, checked_threads
from ..base.errors import MismatchWarning
from ..base.types import Floats, Ints
from ..graph.cell_graph import CellGraph
from ..graph.kinds import as_known, kind_of
from ..graph.sums import weighted_majority
from ..mesh.convert import CloudLike, MeshLike
from ..mesh.faces import sample_surface
from ..mesh.queries import checked_distance, query_points

_ROUNDING = 8 * np.finfo(np.float64).eps
"""Upper bound of the rounding error of centroids, relative to the largest absolute coordinate."""

_FAR = 0.05
"""A point of the target is far if its distance from the mesh is larger than this fraction of the
diagonal of the mesh."""

_MAX_FAR = 0.1
"""`transfer` warns if more than this fraction of the points of the target are far from the mesh."""


def transfer(
    mesh: MeshLike | CloudLike | CellGraph,
    labels: npt.ArrayLike,
    target: MeshLike | CloudLike | CellGraph,
    *,
    max_distance: float | None = None,
    n_threads: int | None = None,
) -> Ints:
    """Transfer labels from the cells of a mesh to points, or to the cells of another mesh.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, CellGraph or mesh-like
        The labeled cells, as for `segment`. The distance to a face is the distance to its nearest
        point, not to its centroid. The distance to a tetrahedron is 0 inside. The distance to a
        cell of a graph is the distance to its position.
    labels : array_like of int, shape (N,)
        Label of each cell, which may be any integer >= 0, or -1 for cells without a label.
    target : array_like, shape (M, 3), or mesh or cloud like `mesh`
        Points with finite coordinates (M may be 0), or another mesh or cloud of the same object.
        Points, tetrahedra and cells of a graph get the label of the cell nearest to their position
        or centroid. A face gets the label with the largest area in the face. To estimate areas,
        each triangle is sampled at 1 to 64 points, depending on its size.
    max_distance : float, optional
        Maximum distance, >= 0, in the unit of the meshes. Points of the target that are farther
        away from all cells of `mesh` get the label -1. By default, there is no maximum.
    n_threads : int, optional
        Same as in `segment`. The labels do not depend on the number of threads.

    Returns
    -------
    ndarray of int32, shape (M,)
        Label of each point or cell of the target. The label is -1 if the nearest cell is farther
        away than `max_distance` or is labeled -1. If several cells are equally near, the cell with
        the lowest index is used. If several labels have the same area in a face, the lowest label
        is used.

    Warns
    -----
    MismatchWarning
        If `target` is a mesh, cloud or graph, `max_distance` is not given, and more than a tenth of
        the points of the target are farther from `mesh` than 5 % of the diagonal of `mesh`.

    Raises
    ------
    MeshError
        If a mesh is not valid, or if points are not finite or do not have shape (M, 3).
    ValueError, TypeError
        If labels are not one integer >= -1 per cell, or if another parameter is not valid.

    See Also
    --------
    nearest_faces : indices and distances of the nearest faces.
    vertex_labels : labels of the vertices of the same mesh.

    Notes
    -----
    Building a bounding volume hierarchy takes O(N log N). The search for the cell nearest to a
    point near the surface takes O(log N). A target of M faces is sampled at about N + M + 2 sqrt(N
    M) points.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> transfer(square, [7, 4], [[0.9, 0.1, 0.01], [0.1, 0.9, 0], [0, 5, 0]], max_distance=1)
    array([ 7,  4, -1], dtype=int32)
    """
    threads = checked_threads(n_threads)
    limit = checked_distance(max_distance)
    source = as_known(mesh)
    given = checked_classes(labels, source.n_cells, "labels")

    goal = _as_target(target)
    limit += _ROUNDING * float(np.abs(source.bounds).max())

    samples = (
        None if isinstance(goal, np.ndarray) else sample_surface(goal, source.n_cells, threads)
    )
    points: Floats = goal if samples is None else samples.points
    nearest, distances, _ = kind_of(source).nearest(source, points, limit, threads)
    if max_distance is None and not _are_points(target):
        _warn_if_far(distances, source.bounds)
    found = np.append(given, np.int32(-1))[nearest]  # -1 (no cell) selects the appended label
    if samples is None:
        return found
    return weighted_majority(samples.faces, found, samples.areas, goal.n_faces).winners


def _warn_if_far(distances: Floats, bounds: Floats) -> None:
    """Warn the caller of `transfer` if many points of the target are far from the mesh."""
    limit = _FAR * float(np.linalg.norm(bounds[1] - bounds[0]))
    limit += _ROUNDING * float(np.abs(bounds).max())
    fraction = float(np.mean(distances > limit)) if len(distances) else 0.0
    if fraction > _MAX_FAR:
        note = (
            f"{fraction:.0%} of the target is farther from the mesh than {limit:.3g} (5% of the"
            " diagonal of the mesh): check that both use the same coordinates and unit, or set"
            " max_distance"
        )
        warnings.warn(note, MismatchWarning, stacklevel=3)


def _as_target(target: Any) -> Any:
    """Return a target with faces as a mesh, and any other target as one point per cell, (M, 3)."""
    if _are_points(target):
        return query_points(target)
    cells = as_known(target)
    kind = kind_of(cells)
    return cells if kind.has_faces else query_points(kind.positions(cells))


def _are_points(target: Any) -> bool:
    """Return whether the target is an array or list of points, not a pair (vertices, faces)."""
    if not isinstance(target, (list, tuple)):
        return isinstance(target, np.ndarray)
    return len(target) != 2 or np.ndim(target[0]) == 1
