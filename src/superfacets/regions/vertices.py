"""Stage 5: convert labels of cells to labels of vertices, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.checks import (
    checked_choice,
    checked_classes,
    checked_count,
    checked_threads,
    ranked_labels,
)
from ..base.types import Ints, Longs
from ..graph.kinds import fit_vertices, kind_of, labels_of_corners
from ..graph.sums import weighted_majority
from ..mesh.convert import MeshLike, as_cells
from .crease_labels import corners_in, crease_labels, own_corners

MIN_IN_FILES = 20
"""Minimum number of vertices of a region in files for neural networks. The training data of these
networks was made by ScanNet's Segmentator with the same minimum (its option segMinVerts)."""

METHODS = ("creases", "majority")
"""Names of the methods of `vertex_labels`."""


def vertex_labels(
    mesh: MeshLike, labels: npt.ArrayLike, *, method: str = "creases",
    min_vertices: int | None = None, barriers: npt.ArrayLike | None = None,
    n_threads: int | None = None,
) -> Ints:  # fmt: skip
    """Convert labels of cells to labels of vertices.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        Same as in `segment`. For a point cloud, the result equals `labels`.
    labels : array_like of int, shape (N,)
        Label of each face or tetrahedron, or -1 for cells without a label. Labels may have gaps.
    method : {"creases", "majority"}
        ``"majority"``: A vertex gets the label with the largest total area (volume for tetrahedra)
        around it; if areas are equal, the lowest label. Vertices of a region may be unconnected,
        and a region may have no vertices. Vertices are not welded.

        ``"creases"``: Borders follow creases. A vertex gets the label of its cells if they all have
        the same label; other vertices get a label of their cells (see Notes). Each region has at
        least one vertex if there are enough vertices. The vertices of a connected region are
        connected along edges of the mesh: only the largest connected set of vertices keeps the
        label. Disconnected cells with the same label are separate regions. Vertices at the same
        position get the same label.
    min_vertices : int, optional
        Minimum number of vertices of a region, by default 20, for ``"creases"`` only. Smaller
        regions take vertices from neighbors across the edges with the lowest weights, if these
        neighbors stay connected and keep `min_vertices` vertices. Otherwise they do not change.
    barriers : array_like of int or bool, shape (V,), optional
        One number per vertex >= -1, as in `segment`, with -1 outside a mask. A vertex gets only
        labels of cells with its number (the most frequent number of their corners), and -1 if it is
        not connected with such a cell. The default is the mask and the barriers of vertices that
        were given to `segment`, if `labels` are its result.
    n_threads : int, optional
        Same as in `segment`. The labels do not depend on the number of threads.

    Returns
    -------
    ndarray of int32, shape (V,)
        Label of each vertex, or -1 if no labeled cell contains the vertex.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if labels are not one integer >= -1 per cell, or if another
        parameter is not valid.

    Notes
    -----
    The normal n_i of a vertex is the mean of the unit normals of its faces. The weight of an edge
    is max(0, 1 - n_i . n_j), squared if the edge is convex: n_j . (x_j - x_i) > 0 or n_i . (x_i -
    x_j) > 0. In a volume, all weights are equal. Of all edges from labeled to unlabeled vertices,
    the one with the lowest weight passes its label on next, if a cell of the unlabeled vertex has
    this label. If weights are equal, edges whose ends have one label by ``"majority"`` come first.
    So borders are in concave creases. Afterwards, only disconnected and small regions change.

    References
    ----------
    Prim, "Shortest connection networks and some generalizations", 1957; weights as in Karpathy,
    Miller and Fei-Fei, "Object Discovery in 3D Scenes via Shape Analysis", 2013.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]]  # the last is unused
    >>> vertex_labels((corners, [[0, 1, 2], [0, 2, 3]]), [7, 4], method="majority")
    array([ 4,  7,  4,  4, -1], dtype=int32)
    """
    cells: Any = as_cells(mesh)
    array = checked_classes(labels, cells.n_cells, "labels")
    checked_choice(method, "method", METHODS)
    usual = MIN_IN_FILES if method == "creases" else 1
    least = usual if min_vertices is None else checked_count(min_vertices, "min_vertices")
    threads = checked_threads(n_threads)
    if method == "majority" and least > 1:
        raise ValueError(
            f"min_vertices must be 1 with method='majority', got {least}: use method='creases'"
        )
    if kind_of(cells).are_points:
        return array
    corners, groups = corners_in(cells), None
    barriers = groups_of_result(labels, cells) if barriers is None else np.asanyarray(barriers)
    if barriers is not None:
        numbers = barriers.view(np.int8) if barriers.dtype == bool else barriers
        groups = checked_classes(numbers, cells.n_vertices, "barriers", "vertex") + np.int32(1)
    if method == "creases":
        ranks, names = ranked_labels(array)
        found = crease_labels(cells, ranks, len(names), threads, least=least, groups=groups)
        return np.append(names, -1).astype(np.int32)[found]
    weights = np.repeat(kind_of(cells).measures(cells, threads), corners.sizes)
    of_corners = np.repeat(array, corners.sizes)
    votes = own_corners(cells, corners, groups) & (of_corners >= 0)
    return weighted_majority(
        corners.vertices[votes], of_corners[votes], weights[votes], cells.n_vertices
    ).winners


def groups_of_result(labels: Any, cells: Any) -> Ints | None:
    """Return `Segmentation.vertex_groups` of a result of `segment` for these cells, or None."""
    groups: Ints | None = getattr(labels, "vertex_groups", None)
    return groups if fit_vertices(groups, cells) else None


def face_labels(mesh: MeshLike, vertex_labels: npt.ArrayLike) -> Ints:
    """Convert labels of vertices to labels of cells.

    A cell gets the most frequent label of its corners, or the lowest of several. Cells of a region
    may be unconnected even if its vertices are connected, and a thin region may have no cells.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        Same as in `segment`. For a point cloud, the result equals `vertex_labels`.
    vertex_labels : array_like of int, shape (V,)
        Label of each vertex, >= -1; -1 is treated like any other label. Labels may have gaps.

    Returns
    -------
    ndarray of int32, shape (F,)
        Label of each face or tetrahedron. Time is linear in the number of corners.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, or if labels are not one integer >= -1 per vertex.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> face_labels(square, [5, 2, 2, 4])
    array([2, 2], dtype=int32)
    """
    cells: Any = as_cells(mesh)
    n_vertices = cells.n_cells if kind_of(cells).are_points else cells.n_vertices
    array = checked_classes(vertex_labels, n_vertices, "vertex_labels", "vertex")
    return labels_of_corners(cells, array).astype(np.int32)


def superpoint_cells(cells: Any, superpoints: Ints) -> tuple[Any, Ints]:
    """Label cells as in `face_labels`, but so that each label >= 0 of the vertices has a cell.

    A superpoint without a cell takes the first cell at its vertices whose label has other cells; if
    there is none, each of its vertices gets a cell without area. Returns the cells and labels.
    """
    labels, corners = labels_of_corners(cells, superpoints), corners_in(cells)
    counts = np.bincount(labels + 1, minlength=int(superpoints.max()) + 2)
    counts[0] += 2  # cells without a label may be taken
    of_corners = superpoints[corners.vertices]
    places = np.flatnonzero((counts[1:] == 0)[of_corners] & (of_corners >= 0))
    taken = np.searchsorted(corners.starts, places, side="right") - 1
    for label, cell in zip(of_corners[places].tolist(), taken.tolist(), strict=True):
        owner = labels[cell]
        if counts[label + 1] == 0 and counts[owner + 1] > 1:
            counts[owner + 1] -= 1
            counts[label + 1] = 1
            labels[cell] = label
    lost = np.flatnonzero((counts[1:] == 0)[superpoints] & (superpoints >= 0)).astype(np.int32)
    if not len(lost):
        return cells, labels
    size = corners.size or 3
    vertices = np.concatenate([corners.vertices, np.repeat(lost, size)])
    offsets = np.append(corners.starts, len(corners.vertices) + size * np.arange(1, len(lost) + 1))
    whole = kind_of(cells).with_corners(cells, cells.vertices, vertices, offsets)
    return whole, np.append(labels, superpoints[lost])


def parents_of(finer: Ints, labels: Any) -> Ints:
    """Return the label of each region of `finer`, labels of the same cells on a finer level.

    The result has one more element at the end, -1, for cells of label -1.
    """
    parents = np.full(int(finer.max()) + 2, -1, np.int32)
    parents[finer] = labels
    return parents


def nested_labels(cells: Any, labels: Any, finer: Ints | None, **options: Any) -> Ints:
    """Convert labels as in `vertex_labels`, or so that they are unions of converted `finer` labels.

    With `finer`, as in `parents_of`, labels of vertices are nested on all levels.
    """
    if finer is None:
        return vertex_labels(cells, labels, **options)
    return parents_of(finer, labels)[vertex_labels(cells, finer, **options)]


def vertex_ids(
    cells: Any, labels: npt.NDArray[np.integer[Any]], barriers: Ints | None = None,
    finer: Ints | None = None,
) -> Longs:  # fmt: skip
    """Convert labels of cells to ids of vertices, for files that neural networks read.

    A vertex that gets no label gets a unique id above all labels, because these files have no -1;
    but -1 if some cells have the label -1, which only graphs store. `finer` as in `nested_labels`.
    """
    if kind_of(cells).are_points:
        return labels.astype(np.int64)
    ids = nested_labels(cells, labels, finer, barriers=barriers).astype(np.int64)
    unused = np.flatnonzero((ids < 0) & (labels.min() >= 0))
    ids[unused] = int(labels.max()) + 1 + np.arange(len(unused))
    return ids
