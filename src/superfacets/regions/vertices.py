"""Stage 5: labels of vertices from labels of cells."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Ints, Longs
from .._validate import checked_classes, checked_threads, ranked_labels
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..cells.kinds import kind_of, measures_of
from ..cells.sums import weighted_majority
from ..errors import MeshError


def vertex_labels(mesh: MeshLike | CloudLike, labels: npt.ArrayLike) -> Ints:
    """Return one label per vertex: that of most of the area around it.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        As for `segment`. The vertices of a point cloud are its cells: they keep their labels.
    labels : array_like of int, shape (N,)
        One per face or tetrahedron; -1 where a cell has none. Gaps are allowed.

    Returns
    -------
    ndarray of int32, shape (V,)
        For each vertex, the label with the largest sum of the areas (volumes of tetrahedra) of its
        cells; the lowest of equals, also where all areas are 0. Cells labeled -1 do not count. -1
        if no labeled cell has the vertex. Vertices are not welded, and a polygon that passes
        through a vertex twice counts twice.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If the labels are not integers of -1 and up, one per cell.

    Notes
    -----
    Linear in the number of corners but for a sort of those at borders between labels.

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
    if kind_of(cells).are_points:
        return array
    vertices, sizes = corner_groups(cells)
    weights = np.repeat(measures_of(cells, checked_threads(None)), sizes)
    of_corners = np.repeat(array, sizes)
    if array.min() < 0:
        kept = of_corners >= 0
        vertices, of_corners, weights = vertices[kept], of_corners[kept], weights[kept]
    return weighted_majority(vertices, of_corners, weights, cells.n_vertices)


def vertex_ids(cells: Any, labels: npt.NDArray[np.integer[Any]]) -> Longs:
    """Return an id for each vertex: its `vertex_labels`, changed so that every region has a vertex.

    A region without a vertex takes its first corner from a region that has several vertices; if
    there is no such corner, it stays without. Each vertex that no cell uses gets an id of its own,
    above all labels. Labels are 0 and up, gaps allowed.
    """
    if kind_of(cells).are_points:
        return labels.astype(np.int64)
    ranks, names = ranked_labels(labels)
    of_vertices = vertex_labels(cells, ranks)
    _give_vertices(of_vertices, cells, ranks, len(names))
    ids = names.astype(np.int64)[of_vertices]
    alone = np.flatnonzero(of_vertices < 0)
    ids[alone] = int(names[-1]) + 1 + np.arange(len(alone))
    return ids


def _give_vertices(of_vertices: Ints, cells: Any, labels: Ints, n: int) -> None:
    """Give a vertex to each of the n regions without one, from regions with several."""
    counts = np.bincount(of_vertices[of_vertices >= 0], minlength=n)
    lost = np.flatnonzero(counts == 0)
    if not len(lost):
        return
    vertices, sizes = corner_groups(cells)
    of_corners = np.repeat(labels, sizes)
    places = np.flatnonzero(np.isin(of_corners, lost))
    places = places[np.argsort(of_corners[places], kind="stable")]
    starts = np.searchsorted(of_corners[places], lost)
    for region, corners in zip(lost.tolist(), np.split(vertices[places], starts[1:]), strict=True):
        own = np.unique(corners)
        spare = own[counts[of_vertices[own]] > 1]
        if len(spare):
            counts[of_vertices[spare[0]]] -= 1
            counts[region] = 1
            of_vertices[spare[0]] = region


def corner_groups(cells: Any) -> tuple[Ints, Longs | int]:
    """Vertices of the corners of all cells in a row, and the number of corners of each cell."""
    kind = kind_of(cells)
    corners = kind.corners(cells)
    if corners is None:
        raise MeshError(f"{kind.plural} have no vertices to label")
    return corners.vertices, corners.sizes
