"""Stage 5: derive labels of vertices from labels of cells, and labels of cells from vertices."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Ints, Longs
from .._validate import (
    checked_choice,
    checked_classes,
    checked_count,
    checked_threads,
    ranked_labels,
)
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..cells.kinds import kind_of, measures_of
from ..cells.sums import weighted_majority
from .crease_labels import corners_in, crease_labels

METHODS = ("majority", "creases")
"""Methods of `vertex_labels`."""

LEAST_IN_FILES = 20
"""Minimum number of vertices of a region in files for networks. It is the default (segMinVerts) of
ScanNet's segmenter, whose output these networks are trained on."""


def vertex_labels(
    mesh: MeshLike | CloudLike,
    labels: npt.ArrayLike,
    *,
    method: str = "majority",
    min_vertices: int = 1,
    n_threads: int | None = None,
) -> Ints:
    """Return one label per vertex, by majority of its cells or with borders along creases.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        As for `segment`. For a point cloud the result equals `labels`.
    labels : array_like of int, shape (N,)
        One label per face or tetrahedron, or -1 for no label. Gaps are allowed.
    method : {"majority", "creases"}, default "majority"
        ``"majority"``: the label with the largest total area (volume) of the cells at the vertex;
        ties go to the lowest label. A region may have no vertices, or several pieces. Vertices are
        not welded. A polygon that contains a vertex twice counts twice.

        ``"creases"``: borders follow creases. A vertex gets the label of its cells if they have the
        same label. Other vertices are labeled in the order of edge weights (see Notes). Each region
        has at least one vertex if there are enough vertices. A region of connected cells stays
        connected along the edges of the mesh: only its largest piece keeps the label. Unconnected
        cells with the same label are treated as separate regions. Vertices at the same position are
        welded, and share a label.
    min_vertices : int, default 1
        With ``"creases"``, smaller regions grow to this number of vertices. They take vertices
        across the edges with the lowest weights, from regions that stay connected and keep
        `min_vertices`. If there are no such regions, as in a small component, the region stays
        small.
    n_threads : int, optional
        As for `segment`; labels do not depend on it.

    Returns
    -------
    ndarray of int32, shape (V,)
        -1 if no labeled cell contains the vertex.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If labels are not integers >= -1, one per cell, or another parameter is out of range or of
        the wrong type.

    Notes
    -----
    The normal n_i of a vertex is the mean of the unit normals of its faces. The weight of an edge
    is max(0, 1 - n_i . n_j), squared if the edge is convex: n_j . (x_j - x_i) > 0 or n_i . (x_i -
    x_j) > 0. Edges are visited in ascending order of weight; in a tie, edges inside a majority
    region come first. Each edge gives both ends the same label, unless both ends already have a
    label. So borders are at the edges of highest weight, which are the concave creases. In a volume
    all weights are equal.

    Time is linear in the number of corners. ``"creases"`` takes less than 0.2 s per million faces
    on two cores.

    References
    ----------
    Kruskal, "On the shortest spanning subtree of a graph and the traveling salesman problem", 1956;
    weights as in Karpathy, Miller and Fei-Fei, "Object Discovery in 3D Scenes via Shape Analysis",
    2013.

    Examples
    --------
    Two triangles of a square, and an unused vertex:

    >>> from superfacets import Mesh
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]]
    >>> vertex_labels(Mesh(corners, [[0, 1, 2], [0, 2, 3]]), [7, 4])
    array([ 4,  7,  4,  4, -1], dtype=int32)
    """
    cells: Any = as_cells(mesh)
    array = checked_classes(labels, cells.n_cells, "labels")
    checked_choice(method, "method", METHODS)
    least = checked_count(min_vertices, "min_vertices")
    threads = checked_threads(n_threads)
    if method == "majority" and least > 1:
        raise ValueError('min_vertices needs method="creases"')
    if kind_of(cells).are_points:
        return array
    if method == "creases":
        ranks, names = ranked_labels(array)
        found = crease_labels(cells, ranks, len(names), threads, least=least)
        return np.append(names, -1).astype(np.int32)[found]
    vertices, sizes = corner_groups(cells)
    weights = np.repeat(measures_of(cells, threads), sizes)
    of_corners = np.repeat(array, sizes)
    if array.min() < 0:
        kept = of_corners >= 0
        vertices, of_corners, weights = vertices[kept], of_corners[kept], weights[kept]
    return weighted_majority(vertices, of_corners, weights, cells.n_vertices).winners


def vertex_ids(cells: Any, labels: npt.NDArray[np.integer[Any]]) -> Longs:
    """Return an id for each vertex, with borders along creases, for files of networks.

    Regions grow to `LEAST_IN_FILES` vertices if possible. Labels are >= 0, and gaps are allowed.
    Each unused vertex gets its own id, above all labels.
    """
    if kind_of(cells).are_points:
        return labels.astype(np.int64)
    ranks, names = ranked_labels(labels)
    threads = checked_threads(None)
    found = crease_labels(cells, ranks, len(names), threads, least=LEAST_IN_FILES)
    return with_unused(found, names)


def with_unused(labels: Ints, names: npt.NDArray[np.integer[Any]]) -> Longs:
    """Map labels 0..K-1 to names. Each vertex labeled -1 gets its own id, above all names."""
    ids = names.astype(np.int64)[labels]
    unused = np.flatnonzero(labels < 0)
    ids[unused] = int(names[-1]) + 1 + np.arange(len(unused))
    return ids


def labels_of_corners(cells: Any, of_vertices: npt.NDArray[np.integer[Any]]) -> Longs:
    """Return the most frequent label of the corners of each cell; ties go to the lowest label.

    `of_vertices` has one label per vertex. For a point cloud, it is returned as int64.
    """
    if kind_of(cells).are_points:
        return of_vertices.astype(np.int64)
    names, ranks = np.unique(of_vertices, return_inverse=True)
    vertices, sizes = corner_groups(cells)
    groups = np.repeat(np.arange(cells.n_cells), sizes)
    voters = ranks[vertices].astype(np.int32)
    winners = weighted_majority(groups, voters, np.ones(len(voters)), cells.n_cells).winners
    return np.asarray(names[winners], dtype=np.int64)


def corner_groups(cells: Any) -> tuple[Ints, Longs | int]:
    """Return the vertices of all corners, cell by cell, and the number of corners of each cell."""
    corners = corners_in(cells)
    return corners.vertices, corners.sizes
