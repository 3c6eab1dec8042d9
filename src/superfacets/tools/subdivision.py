"""Bisect faces until no edge is too long, because long and thin faces make bad regions."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import (
    MAX_CELLS,
    checked_any_labels,
    checked_count,
    checked_number,
    checked_threads,
    counted,
    freeze,
)
from ..base.types import Bytes, Floats, Ints, Longs
from ..graph.sums import weighted_majority
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, cut_into_triangles
from ..mesh.meshes import Mesh

MAX_FACES = 10_000_000
"""Default maximum number of new faces. Ten million faces take about 600 MB of memory."""

MAX_GROWTH = 4
"""Default maximum number of new faces per old face. It replaces `MAX_FACES` for large meshes, for
which it allows more new faces."""

RESOLUTION = 1e-12
"""Minimum of `max_edge`, as a fraction of the largest absolute coordinate. This is 4,500 times the
float64 epsilon. Midpoints of shorter edges have large rounding errors, so bisection might not
end."""


@dataclass(frozen=True, eq=False)
class Subdivision:
    """Result of `superfacets.subdivide`: a subdivided mesh, and the old face of each new face.

    Attributes
    ----------
    mesh : Mesh
        Vertices are the old vertices in their order, followed by midpoints. Faces are the parts of
        old face 0, of old face 1, and so on, with the orientation of the old face.
    sources : ndarray of int32, shape (F,)
        Index of the old face that contains each new face. These indices are in ascending order.
    depths : ndarray of uint8, shape (F,)
        Number of bisections that made each new face. The area of a new face is ``2.0**-depth``
        times the area of its old face. Polygons are first cut into triangles; the area of a new
        face is then ``2.0**-depth`` times the area of the triangle that contains it.
    cut_areas : ndarray of float64, shape (F,), optional
        If the old mesh has polygons, area of the triangle that contains each new face. None if the
        old mesh is a ``Mesh``.
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
        """Convert labels of new faces to labels of old faces.

        For the opposite direction, use ``values[subdivision.sources]``.

        Parameters
        ----------
        labels : array_like of integers, shape (F,)
            Label of each new face, any integer. Others raise a ValueError or TypeError.

        Returns
        -------
        ndarray of int64, shape (number of old faces,)
            The label that covers the largest area of each old face; if areas are equal, the
            lowest label. Some labels may not occur.

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
            areas = np.exp2(-self.depths[chosen].astype(np.float64))
            if self.cut_areas is not None:
                areas *= self.cut_areas[chosen]
            groups = (np.cumsum(is_mixed) - 1)[self.sources[chosen]]
            names, codes = np.unique(given[chosen], return_inverse=True)
            # For triangles, areas are powers of two, so sums are exact and ties are detected.
            winners = weighted_majority(
                groups, codes.astype(np.int32), areas, int(np.count_nonzero(is_mixed))
            ).winners
            back[is_mixed] = names[winners]
        return back

    def __repr__(self) -> str:
        return f"Subdivision({counted(self.n_sources, 'face')} into {len(self.sources)})"


def subdivide(
    mesh: MeshLike, max_edge: float, *, max_faces: int | None = None, n_threads: int | None = None
) -> Subdivision:
    """Bisect faces by their longest edge until no edge is longer than `max_edge`.

    Regions of long and thin triangles, as CAD programs make them, cannot be compact.

    An edge that is too long is bisected at its midpoint in all faces at the edge, so closed meshes
    stay closed, without T-junctions, and non-manifold edges keep their faces. Seams of duplicate
    vertices get no gaps, because only positions count. The angles of new faces are at least half
    the smallest angle of the old face. Boundary edges and degenerate faces are also bisected. The
    result does not depend on the number of threads, and subdividing it again changes nothing.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`. Polygons are triangulated first.
    max_edge : float
        Maximum edge length in the unit of the vertices, > 0, and at least 1e-12 times the largest
        absolute coordinate. With infinity, no edge is bisected.
    max_faces : int, optional
        Maximum number of new faces, by default ten million or four times the old faces, if more.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    Subdivision
        The new mesh, the old face of each new face, and `labels_back` for labels of old faces.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid or has no faces, if a parameter is out of range or of the wrong
        type, or if there would be more than `max_faces` faces, which is checked before memory for
        them is allocated.

    Notes
    -----
    A triangle with three sides of similar length becomes about ``3 * area / max_edge**2`` faces,
    and a thin triangle about ``2 * length / max_edge``.

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
    """
    length = math.inf
    if not isinstance(max_edge, numbers.Real) or max_edge != math.inf:
        length = checked_number(max_edge, "max_edge", zero=False)
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
    except ValueError:  # `_core` raises this error for too many faces
        raise ValueError(
            f"max_edge={length:g} would make more than {counted(most, 'face')}: use a larger"
            " max_edge or, in Python, a larger max_faces"
        ) from None
    if polygons is None:
        return Subdivision(Mesh(vertices, faces), sources, depths)
    areas = _core.measure_faces(surface.vertices, triangles, threads)[1]
    return Subdivision(Mesh(vertices, faces), polygons[sources], depths, areas[sources])


def _check_resolution(mesh: FaceMesh, max_edge: float) -> None:
    largest = float(np.abs(mesh.bounds).max())
    if max_edge < RESOLUTION * largest:
        raise ValueError(
            f"max_edge must be at least {RESOLUTION * largest:g} for coordinates of {largest:g},"
            f" got {max_edge:g}: use a larger max_edge, or move the mesh to the origin"
        )
