"""Stage 5: split a mesh into one mesh per region."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.checks import checked_regions
from ..base.errors import MeshError
from ..base.types import Ints
from ..graph.kinds import kind_of
from ..mesh.base import Cells
from ..mesh.convert import MeshLike, as_cells


class Submesh(NamedTuple):
    """Part of a mesh, and the indices of its cells and vertices in the whole mesh.

    Attributes
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or PointCloud
        The part, of the same class as the whole mesh. Cells and vertices keep their order, and
        unused vertices are removed. Points keep their normals, colors, axes and viewpoints.
    cells : ndarray of int32
        Index, in the whole mesh, of each cell of the part, in ascending order.
    vertices : ndarray of int32
        Index, in the whole mesh, of each vertex of the part, in ascending order. For a cloud,
        ``vertices`` equals ``cells``.
    """

    mesh: Cells
    cells: Ints
    vertices: Ints

    def __repr__(self) -> str:
        return f"Submesh({self.mesh!r}, .cells, .vertices)"


def submesh(mesh: MeshLike, labels: npt.ArrayLike, region: int) -> Submesh:
    """Return one region as a mesh, and the indices of its cells and vertices in the whole mesh.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, or mesh-like or cloud-like
        Same as in `segment`.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur; -1 marks cells in no region.
    region : int
        Label of the region, from 0 to K - 1.

    Returns
    -------
    Submesh

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if all vertices of the region are at one position, if labels are
        not one integer >= -1 per cell, if a label from 0 to K - 1 is missing, or if `region` is out
        of range.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> part = submesh(square, [0, 1], 1)
    >>> part.mesh, part.cells.tolist(), part.vertices.tolist()
    (Mesh(3 vertices, 1 face), [1], [0, 2, 3])
    """
    whole = as_cells(mesh)
    array, n_regions = checked_regions(labels, whole.n_cells, getattr(whole, "n_vertices", None))
    if not hasattr(region, "__index__") or np.ndim(region):
        join = "np.where(np.isin(labels, regions), 0, -1)"
        raise TypeError(f"region must be one integer; for several regions, join labels: {join}")
    number = operator.index(region)
    if not 0 <= number < n_regions:
        raise ValueError(f"region must be 0 to {n_regions - 1}, got {number}")
    return part_of(whole, np.flatnonzero(array == number).astype(np.int32), number)


def split_regions(mesh: MeshLike, labels: npt.ArrayLike) -> Iterator[Submesh]:
    """Yield each region as a mesh, and the indices of its cells and vertices in the whole mesh.

    Parameters
    ----------
    mesh, labels
        Same as in `submesh`.

    Yields
    ------
    Submesh
        Parts for the regions 0 to K - 1, in this order. Each is made when the iterator reaches it.
        The total time is O(N log N).

    Raises
    ------
    MeshError, ValueError, TypeError
        Same as in `submesh`. Errors in mesh or labels are raised by the call, and a MeshError for a
        region whose vertices are at one position during the iteration.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> [part.vertices.tolist() for part in split_regions(square, [0, 1])]
    [[0, 1, 2], [0, 2, 3]]
    """
    whole = as_cells(mesh)
    array, n_regions = checked_regions(labels, whole.n_cells, getattr(whole, "n_vertices", None))
    order = np.argsort(array, kind="stable").astype(np.int32)
    starts = np.searchsorted(array[order], np.arange(n_regions + 1))
    return (part_of(whole, order[a:b], i) for i, (a, b) in enumerate(pairwise(starts)))


def part_of(whole: Any, cells: Ints, region: int) -> Submesh:
    """Return the part of a mesh or cloud with the ascending `cells`; errors name `region`."""
    kind = kind_of(whole)
    corners = kind.corners(whole)
    if corners is None:
        return Submesh(kind.part(whole, cells), cells, cells)
    of_cells, offsets = corners.of(cells)
    vertices, numbers = np.unique(of_cells, return_inverse=True)
    points = whole.vertices[vertices]
    try:
        part = kind.with_corners(whole, points, numbers.astype(np.int32), offsets)
    except MeshError as error:  # raised if all vertices have the same position
        raise MeshError(f"region {region}: {error}") from None
    return Submesh(part, cells, vertices)
