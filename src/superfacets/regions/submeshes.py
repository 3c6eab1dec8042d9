"""Stage 5: one submesh per region, with maps to the whole mesh."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._types import Ints, Longs
from .._validate import checked_regions, is_extent_valid
from ..adapters.convert import CloudLike, MeshLike, as_cells
from ..cells.kinds import kind_of
from ..errors import MeshError
from ..mesh.cells import Cells


class Submesh(NamedTuple):
    """A part of a mesh, with maps to the whole.

    Attributes
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or PointCloud
        The part, of the same class as the whole. Cells and vertices keep their order, and unused
        vertices are removed. Points keep their normals and colors.
    cells : ndarray of int32
        Index in the whole of each face (tetrahedron, point) of the part, ascending.
    vertices : ndarray of int32
        Index in the whole of each vertex of the part, ascending. Equal to ``cells`` for a cloud.
    """

    mesh: Cells
    cells: Ints
    vertices: Ints


def submesh(cells: MeshLike | CloudLike, labels: npt.ArrayLike, region: int) -> Submesh:
    """Return the mesh of one region, with maps to the whole mesh.

    Parameters
    ----------
    cells : Mesh, PolygonMesh, TetMesh, PointCloud, or mesh-like or cloud-like
        As for `segment`.
    labels : array_like of int, shape (N,)
        0..K-1, each at least once; -1 for cells in no region.
    region : int
        0 to K - 1.

    Returns
    -------
    Submesh

    Raises
    ------
    MeshError
        If the mesh is not valid, or if all faces of the region lie at one point.
    ValueError, TypeError
        If labels are not integers >= -1, one per cell, a label 0..K-1 is missing, or `region` does
        not exist.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> part = submesh(square, [0, 1], 1)
    >>> part.mesh, part.cells.tolist(), part.vertices.tolist()
    (Mesh(3 vertices, 1 faces), [1], [0, 2, 3])
    """
    whole = as_cells(cells)
    array, n_regions = checked_regions(labels, whole.n_cells, getattr(whole, "n_vertices", None))
    number = operator.index(region)
    if not 0 <= number < n_regions:
        raise ValueError(f"there is no region {number}: there are {n_regions}")
    return Splitter(whole).named_part(np.flatnonzero(array == number).astype(np.int32), number)


def split_regions(cells: MeshLike | CloudLike, labels: npt.ArrayLike) -> Iterator[Submesh]:
    """Yield the mesh of each region 0..K-1, with maps to the whole mesh.

    Parameters
    ----------
    cells, labels
        As for `submesh`.

    Yields
    ------
    Submesh
        In the order of the labels, made one at a time. Total time O(N log N).

    Raises
    ------
    MeshError, ValueError, TypeError
        As for `submesh`. Errors in cells or labels are raised by the call, before iteration.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> [part.vertices.tolist() for part in split_regions(square, [0, 1])]
    [[0, 1, 2], [0, 2, 3]]
    """
    whole = as_cells(cells)
    array, n_regions = checked_regions(labels, whole.n_cells, getattr(whole, "n_vertices", None))
    order = np.argsort(array, kind="stable").astype(np.int32)
    starts = np.searchsorted(array[order], np.arange(n_regions + 1))
    if kind_of(whole).corners(whole) is None:
        splitter = Splitter(whole)
        return (splitter.part(order[a:b]) for a, b in pairwise(starts))
    return _all_parts(whole, order[starts[0] :], starts - starts[0])


def _all_parts(whole: Any, order: Ints, starts: Longs) -> Iterator[Submesh]:
    """Yield all parts; vertices are numbered and extents checked once for all of them.

    The cells of part i are ``order[starts[i]:starts[i + 1]]``.
    """
    kind = kind_of(whole)
    corners, offsets = kind.corners(whole).of(order)  # type: ignore[union-attr]  # it has some
    part_of_corner = np.repeat(np.arange(len(starts) - 1), np.diff(offsets[starts]))
    keys, numbers = np.unique(part_of_corner * whole.n_vertices + corners, return_inverse=True)
    part_of_vertex, vertices = np.divmod(keys, whole.n_vertices)
    firsts = np.searchsorted(part_of_vertex, np.arange(len(starts)))
    corners = (numbers - firsts[part_of_corner]).astype(np.int32)
    vertices = vertices.astype(np.int32)
    points = whole.vertices[vertices]
    bounds = np.stack(
        [operation.reduceat(points, firsts[:-1]) for operation in (np.minimum, np.maximum)], axis=1
    )
    has_extent = is_extent_valid(bounds)
    splitter = Splitter(whole)
    for part, ((a, b), (low, high)) in enumerate(
        zip(pairwise(starts.tolist()), pairwise(firsts.tolist()), strict=True)
    ):
        if not has_extent[part]:
            yield splitter.named_part(order[a:b], part)  # raises a MeshError
            continue
        ends = offsets[a : b + 1]
        mesh = kind.with_corners(
            whole, points[low:high].copy(), corners[ends[0] : ends[-1]].copy(), ends - ends[0],
            bounds[part].copy(),
        )  # fmt: skip
        yield Submesh(mesh, order[a:b].copy(), vertices[low:high].copy())


class Splitter:
    """Extracts parts of a mesh, each in time and memory linear in the part."""

    def __init__(self, whole: Any) -> None:
        self._whole = whole
        self._corners = kind_of(whole).corners(whole)
        n_vertices = 0 if self._corners is None else whole.n_vertices
        # Number in the current part of each of its vertices; other entries are undefined.
        self._numbers = np.empty(n_vertices, dtype=np.int32)

    def part(self, cells: Ints) -> Submesh:
        """Return the mesh of these cells."""
        whole = self._whole
        kind = kind_of(whole)
        if self._corners is None:
            return Submesh(kind.part(whole, cells), cells, cells)
        corners, offsets = self._corners.of(cells)
        vertices = self._renumber(corners)
        points, numbers = whole.vertices[vertices], self._numbers[corners]
        return Submesh(kind.with_corners(whole, points, numbers, offsets), cells, vertices)

    def named_part(self, cells: Ints, region: int) -> Submesh:
        """Return the mesh of these cells; errors name the region."""
        try:
            return self.part(cells)
        except MeshError as error:  # all vertices have the same position
            raise MeshError(f"region {region}: {error}") from None

    def _renumber(self, corners: Ints) -> Ints:
        """Number the vertices of a part in ascending order, and return them."""
        vertices = np.unique(corners)
        self._numbers[vertices] = np.arange(len(vertices), dtype=np.int32)
        return vertices
