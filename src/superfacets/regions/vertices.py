"""Stage 5: labels of vertices from labels of cells."""

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
"""Ways from labels of cells to labels of vertices."""

LEAST_IN_FILES = 20
"""Vertices that regions get in files for networks, where others have vertices to spare: the minimum
of ScanNet's segmenter (segMinVerts), which these networks were trained with."""


def vertex_labels(
    mesh: MeshLike | CloudLike,
    labels: npt.ArrayLike,
    *,
    method: str = "majority",
    min_vertices: int = 1,
    n_threads: int | None = None,
) -> Ints:
    """Return one label per vertex: that of most of the area around it, or one that follows creases.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        As for `segment`. The vertices of a point cloud are its cells: they keep their labels.
    labels : array_like of int, shape (N,)
        One per face or tetrahedron; -1 where a cell has none. Gaps are allowed.
    method : {"majority", "creases"}, default "majority"
        ``"majority"``: the label with the largest sum of the areas (volumes of tetrahedra) of the
        vertex's cells; the lowest of equals, also where all areas are 0. A region may lose all
        vertices, or be left in pieces. Vertices are not welded, and a polygon that passes through a
        vertex twice counts twice.

        ``"creases"``: borders run along creases. Vertices whose cells all have one label keep it,
        and those between regions get labels in the order of the weights of edges (see Notes). No
        region is lost as long as there are vertices for all. A region whose cells are connected
        over edges is connected over the edges of the mesh: if it has several pieces, the largest
        stays, and the vertices of others get the labels beside them. Cells with one label that are
        not connected are regions of their own here. Vertices at one position are one vertex, and
        get the same label.
    min_vertices : int, default 1
        Size to which smaller regions grow, with ``"creases"``. They take vertices over the edges
        with the lowest weights, from regions that stay connected and have `min_vertices` left.
        Where there are not enough of these, as in a small component, a region stays as it is.
    n_threads : int, optional
        As for `segment`; labels do not depend on it.

    Returns
    -------
    ndarray of int32, shape (V,)
        -1 if no labeled cell has the vertex.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If the labels are not integers of -1 and up, one per cell, or another parameter is out of
        range or of the wrong type.

    Notes
    -----
    The weight of an edge between vertices with normals n_i and n_j, the means of the unit normals
    of their faces, is 1 - n_i . n_j, at least 0. It is squared where the edge is convex: the normal
    at one end points away from the other, n_j . (x_j - x_i) > 0 or n_i . (x_i - x_j) > 0. In
    ascending order of weight (of equal weights, edges within a region of the majority come first),
    an edge unites the labels at its ends, unless both have one. So a border ends in the edges with
    the highest weights around it: in concave creases. In a volume all weights are equal.

    Time linear in the number of corners: with ``"creases"`` less than 0.2 s per million faces on
    two cores.

    References
    ----------
    Kruskal, "On the shortest spanning subtree of a graph and the traveling salesman problem", 1956;
    weights as in Karpathy, Miller and Fei-Fei, "Object Discovery in 3D Scenes via Shape Analysis",
    2013.

    Examples
    --------
    Two triangles of one square, and a vertex that no face has:

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
    """Return an id for each vertex, for files of networks: labels that follow creases.

    They have at least `LEAST_IN_FILES` vertices where others have vertices to spare. Each vertex
    that no cell uses gets an id of its own, above all labels. Labels are 0 and up, gaps allowed.
    """
    if kind_of(cells).are_points:
        return labels.astype(np.int64)
    ranks, names = ranked_labels(labels)
    threads = checked_threads(None)
    found = crease_labels(cells, ranks, len(names), threads, least=LEAST_IN_FILES)
    return with_unused(found, names)


def with_unused(labels: Ints, names: npt.NDArray[np.integer[Any]]) -> Longs:
    """Names of labels 0 to K - 1; each vertex labeled -1 gets an id of its own, above all names."""
    ids = names.astype(np.int64)[labels]
    unused = np.flatnonzero(labels < 0)
    ids[unused] = int(names[-1]) + 1 + np.arange(len(unused))
    return ids


def corner_groups(cells: Any) -> tuple[Ints, Longs | int]:
    """Vertices of the corners of all cells in a row, and the number of corners of each cell."""
    corners = corners_in(cells)
    return corners.vertices, corners.sizes
