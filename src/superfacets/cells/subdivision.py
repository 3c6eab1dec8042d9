"""Stage 0, optional: bisect the faces of a mesh until no edge is too long."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Bytes, Floats, Ints, Longs
from .._validate import (
    MAX_CELLS,
    checked_any_labels,
    checked_count,
    checked_number,
    checked_threads,
    freeze,
)
from ..adapters.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, cut_into_triangles
from ..mesh.triangle_mesh import Mesh
from .sums import weighted_majority

MAX_FACES = 10_000_000
"""Default limit of the number of new faces. Ten million faces take about 600 MB."""

MAX_GROWTH = 4
"""Default limit of the number of new faces of larger meshes, in multiples of the old number."""

RESOLUTION = 1e-12
"""Smallest `max_edge`, as a fraction of the largest coordinate. This is 4,500 steps of float64.
Midpoints of shorter edges have such large rounding errors that bisection may not end."""


@dataclass(frozen=True, eq=False)
class Subdivision:
    """A subdivided mesh, with the old face of each new face.

    Attributes
    ----------
    mesh : Mesh
        Vertices are the old vertices, in their order, then midpoints. Faces are the parts of old
        face 0, of old face 1, and so on, with the orientation of the old face.
    sources : ndarray of int32, shape (F,)
        The old face that contains each new face, ascending.
    depths : ndarray of uint8, shape (F,)
        Number of bisections. A new face has ``2.0**-depth`` of the area of its old face. Polygons
        are triangulated first, and the depth counts from the triangle.
    cut_areas : ndarray of float64, shape (F,), optional
        Area of the triangle that contains each new face, if the old mesh has polygons.
    """

    mesh: Mesh
    sources: Ints
    depths: Bytes
    cut_areas: Floats | None = None

    def __post_init__(self) -> None:
        freeze(self, sources=self.sources, depths=self.depths)
        if self.cut_areas is not None:
            freeze(self, cut_areas=self.cut_areas)

    @property
    def n_sources(self) -> int:
        """Number of faces of the old mesh."""
        return int(self.sources[-1]) + 1

    def labels_back(self, labels: npt.ArrayLike) -> Longs:
        """Return the label of each old face: the label with the largest area in it.

        Ties go to the lower label; areas of parts of a triangle are compared exactly. A label
        without the largest area in any old face is missing in the result. For the other direction,
        ``labels[subdivision.sources]`` maps labels, or any values, of old faces to new faces.

        Parameters
        ----------
        labels : array_like of integers, shape (F,)
            Label of each new face: any integers.

        Returns
        -------
        ndarray of int64, shape (number of old faces,)

        Raises
        ------
        ValueError, TypeError
            If there is not one integer label per new face.

        Examples
        --------
        The two halves of a triangle have the same area:

        >>> halves = subdivide(([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]]), 2.1)
        >>> halves.mesh.n_faces, halves.labels_back([7, 3])
        (2, array([3]))
        """
        given = checked_any_labels(labels, len(self.sources))
        starts = np.flatnonzero(np.diff(self.sources, prepend=-1))
        back = given[starts]
        is_mixed = np.minimum.reduceat(given, starts) != np.maximum.reduceat(given, starts)
        if is_mixed.any():
            chosen = is_mixed[self.sources]
            shares = np.exp2(-self.depths[chosen].astype(np.float64))
            if self.cut_areas is not None:
                shares *= self.cut_areas[chosen]
            groups = (np.cumsum(is_mixed) - 1)[self.sources[chosen]]
            names, codes = np.unique(given[chosen], return_inverse=True)
            # Sums of powers of two are exact, so ties are detected.
            winners = weighted_majority(
                groups, codes.astype(np.int32), shares, int(np.count_nonzero(is_mixed))
            ).winners
            back[is_mixed] = names[winners]
        return back

    def __repr__(self) -> str:
        return f"Subdivision({self.n_sources} faces into {len(self.sources)})"


def subdivide(
    mesh: MeshLike, max_edge: float, *, max_faces: int | None = None, n_threads: int | None = None
) -> Subdivision:
    """Bisect faces by their longest edge until no edge is longer than `max_edge`.

    Use `subdivide` for meshes with long thin triangles, which CAD programs make for flat faces and
    cylinders. A region cannot be rounder than its faces.

    An edge that is too long is bisected at its midpoint in all of its faces. So there are no
    T-junctions, closed meshes stay closed, and non-manifold edges keep their faces. The choice of
    edges depends only on positions, so seams of duplicate vertices get no gaps. The angles of new
    faces are at least half the smallest angle of the old face, and the areas of new faces sum to
    the area of the old face. Boundary edges and degenerate faces are bisected, too. The result does
    not depend on the number of threads. Subdividing the result again changes nothing.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        As for `segment`. Polygons are triangulated first.
    max_edge : float
        Longest edge in the unit of the vertices, > 0, and at least 1e-12 of the largest coordinate.
        With infinity the mesh does not change.
    max_faces : int, optional
        Largest number of new faces. The default is ten million, or four times the number of old
        faces if that is more.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    Subdivision
        The new mesh, with the old face of each new face, and `labels_back` for labels.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type, or there would be more than `max_faces`
        faces (checked before memory is allocated).

    Notes
    -----
    Time is linear in the number of new faces. A fat triangle becomes about
    ``3 * area / max_edge**2`` faces, a thin one about ``2 * length / max_edge``.

    References
    ----------
    Rivara, "Algorithms for refining triangular grids suitable for adaptive and multigrid
    techniques", 1984. The bound on angles is from Rosenberg and Stenger, 1975.

    Examples
    --------
    >>> plank = ([[0, 0, 0], [8, 0, 0], [8, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> pieces = subdivide(plank, 2.5)
    >>> pieces
    Subdivision(2 faces into 18)
    >>> labels = pieces.mesh.vertices[pieces.mesh.faces].mean(axis=1)[:, 0] > 5
    >>> pieces.labels_back(labels.astype(int))
    array([1, 0])
    """
    length = _checked_length(max_edge)
    surface = as_mesh(mesh)
    if max_faces is None:
        most = min(max(MAX_FACES, MAX_GROWTH * surface.n_faces), MAX_CELLS)
    else:
        most = checked_count(max_faces, "max_faces")
    _check_resolution(surface, length)
    threads = checked_threads(n_threads)
    triangles, polygons = cut_into_triangles(surface)
    try:
        vertices, faces, sources, depths = _core.subdivide(
            surface.vertices, triangles, length, min(most, MAX_CELLS), threads
        )
    except ValueError:  # std::length_error
        raise ValueError(
            f"max_edge={length:g} would make more than {most} faces: use a larger max_edge (or, in"
            " Python, a larger max_faces)"
        ) from None
    if polygons is None:
        return Subdivision(Mesh(vertices, faces), sources, depths)
    areas = _core.measure_faces(surface.vertices, triangles, threads)[1]
    return Subdivision(Mesh(vertices, faces), polygons[sources], depths, areas[sources])


def _checked_length(max_edge: float) -> float:
    is_real = isinstance(max_edge, numbers.Real) and not isinstance(max_edge, (bool, np.bool_))
    if is_real and max_edge == math.inf:
        return math.inf
    return checked_number(max_edge, "max_edge", zero=False)


def _check_resolution(mesh: FaceMesh, max_edge: float) -> None:
    largest = float(np.abs(mesh.bounds).max())
    if max_edge < RESOLUTION * largest:
        raise ValueError(
            f"max_edge={max_edge:g} is too small for coordinates of {largest:g}:"
            " use a larger one, or move the mesh to the origin"
        )
