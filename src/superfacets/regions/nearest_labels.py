"""Stage 5: transfer labels to another mesh, to a cloud, or to points."""

from __future__ import annotations

import math
import warnings
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import (
    VALUE_RANGE,
    checked_classes,
    checked_number,
    checked_threads,
    exact_doubles,
    refuse_infinite,
    rows_of_three,
)
from ..base.errors import MeshError, MismatchWarning
from ..base.types import Array, Floats, Ints
from ..graph.cell_graph import CellGraph
from ..graph.kinds import as_known, fit_vertices, kind_of
from ..graph.sums import weighted_majority
from ..mesh.convert import MeshLike
from ..mesh.faces import FaceMesh, cut_into_triangles
from ..mesh.point_cloud import PointCloud

_ROUNDING = 8 * np.finfo(np.float64).eps
"""Upper bound of the rounding error of centroids, relative to the largest absolute coordinate."""

_FAR = 0.05
"""A point of the target is far if its distance from the mesh is larger than this fraction of the
diagonal of the mesh."""

_MAX_FAR = 0.1
"""`transfer` warns if more than this fraction of the points of the target are far from the mesh."""

MAX_STEPS = 8
"""Maximum number of equal parts into which `sample_surface` divides each side of a triangle. Eight
parts make 64 samples per triangle, which suffice for a label."""


def transfer(
    mesh: MeshLike | CellGraph, labels: npt.ArrayLike, target: MeshLike | CellGraph, *,
    max_distance: float | None = None, n_threads: int | None = None,
) -> Ints:  # fmt: skip
    """Transfer labels from the cells of a mesh to points, or to the cells of another mesh.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, CellGraph or mesh-like
        The labeled cells. The distance to a face is the distance to its nearest point. The distance
        to a tetrahedron is 0 inside. The distance to a cell of a graph is the one to its position.
    labels : array_like of int, shape (N,) or (V,)
        Label of each cell, any integer >= -1 (-1: no label). With the labels ``range(N)``, the
        results are indices of cells. With one label per vertex, a mesh is the cloud of its
        vertices.
    target : array_like, shape (M, 3), or mesh or cloud like `mesh`
        Points with finite coordinates (M may be 0), or another mesh or cloud of the same object.
        Points, tetrahedra and cells of a graph get the label of the cell nearest to their position
        or centroid. A face gets the label with the largest area in it, estimated from 1 to 64
        points per triangle, depending on its size.
    max_distance : float, optional
        Maximum distance, >= 0, in the unit of the meshes. Points of the target farther away from
        all cells get the label -1. By default, there is no maximum.
    n_threads : int, optional
        Same as in `segment`. The labels do not depend on the number of threads.

    Returns
    -------
    ndarray of int32, shape (M,)
        Label of each point or cell of the target; -1 if the nearest cell is labeled -1 or farther
        away than `max_distance`. If several cells are equally near, the lowest index is used; if
        labels have equal areas in a face, the lowest label.

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
        If labels are not one integer >= -1 per cell or vertex, or another parameter is not valid.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> transfer(square, [7, 4], [[0.9, 0.1, 0.01], [0.1, 0.9, 0], [0, 5, 0]], max_distance=1)
    array([ 7,  4, -1], dtype=int32)
    """
    threads = checked_threads(n_threads)
    limit = math.inf
    if max_distance is not None:
        limit = checked_number(max_distance, "max_distance", zero=True)
    source = as_known(mesh)
    are_of_vertices = fit_vertices(labels, source)
    source = PointCloud(source.vertices) if are_of_vertices else source
    given = checked_classes(labels, source.n_cells, "labels")

    goal: Any = target  # a mesh of faces, or points
    if not _are_points(target):
        goal = as_known(target)
        kind = kind_of(goal)
        goal = goal if kind.has_faces else kind.positions(goal)
    if _are_points(goal):
        goal = _checked_points(goal)
    limit += _ROUNDING * float(np.abs(source.bounds).max())

    samples = (
        None if isinstance(goal, np.ndarray) else sample_surface(goal, source.n_cells, threads)
    )
    points: Floats = goal if samples is None else samples.points
    nearest, distances = kind_of(source).nearest(source, points, limit, threads)
    if max_distance is None and not are_of_vertices and not _are_points(target):
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


def _checked_points(points: Any) -> Floats:
    array = exact_doubles(rows_of_three(points, "points"))
    refuse_infinite(array, "points")
    largest = float(np.abs(array).max(initial=0.0))
    if largest > VALUE_RANGE[1]:
        raise MeshError(
            f"coordinates of points must be at most {VALUE_RANGE[1]:g}, got {largest:.3g}: rescale"
            " the points"
        )
    return array


def _are_points(target: Any) -> bool:
    """Return whether the target is an array or list of points, not a pair (vertices, faces)."""
    if not isinstance(target, (list, tuple)):
        return isinstance(target, np.ndarray)
    return len(target) != 2 or np.ndim(target[0]) == 1


class Samples(NamedTuple):
    """Sample points on the faces of a mesh."""

    points: Floats  # (S, 3) position of each sample point
    faces: Array  # (S,) face that contains each sample point
    areas: Floats  # (S,) area of the part of the face around each sample point


def sample_surface(mesh: FaceMesh, n_samples: int, n_threads: int) -> Samples:
    """Return about `n_samples` points, spread evenly over the surface, at least one per face.

    Each triangle is cut into n^2 equal triangles. The number n, from 1 to `MAX_STEPS`, depends on
    the area of the triangle. The samples are the centroids of the small triangles.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> triangle = Mesh([[0, 0, 0], [6, 0, 0], [0, 6, 0]], [[0, 1, 2]])
    >>> sample_surface(triangle, 1, 1).points.tolist()
    [[2.0, 2.0, 0.0]]
    >>> sample_surface(triangle, 4, 1).points[:, :2].tolist()
    [[1.0, 1.0], [1.0, 4.0], [4.0, 1.0], [2.0, 2.0]]
    """
    triangles, sources = cut_into_triangles(mesh)
    areas = _core.measure_faces(mesh.vertices, triangles, n_threads)[1]
    total = float(areas.sum())
    expected = areas / total * n_samples if total > 0 else np.zeros(len(areas))
    n_steps = np.clip(np.rint(np.sqrt(expected)), 1, MAX_STEPS).astype(int)
    parts = []
    for n in np.unique(n_steps).tolist():
        chosen = np.flatnonzero(n_steps == n)
        faces = chosen if sources is None else sources[chosen]
        points = _centroids_of_parts(mesh.vertices[triangles[chosen]], n)
        parts.append((points, np.repeat(faces, n * n), np.repeat(areas[chosen] / n**2, n * n)))
    return Samples(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _centroids_of_parts(corners: Floats, n: int) -> Floats:
    """Return the centroids of the n^2 equal parts of each triangle, grouped by triangle."""
    i, j = np.mgrid[:n, :n].reshape(2, -1)
    upright = np.stack([i, j])[:, i + j < n] + 1 / 3
    upside_down = np.stack([i, j])[:, i + j < n - 1] + 2 / 3
    of_second, of_third = np.concatenate([upright, upside_down], axis=1)[..., np.newaxis] / n
    a, b, c = (corners[:, np.newaxis, corner] for corner in range(3))
    centroids = a + of_second * (b - a) + of_third * (c - a)
    return np.ascontiguousarray(centroids.reshape(-1, 3))
