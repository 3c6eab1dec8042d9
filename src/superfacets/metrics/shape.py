"""Metrics of labels without ground truth: shape and flatness of regions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Floats, Ints
from .._validate import compact_complete
from ..adapters.convert import MeshLike, as_mesh
from ..cells.cell_graph import CellGraph
from ..cells.kinds import as_surface
from ..cells.sums import positive_total, sums_by_label
from ..cells.surface import Surface
from ..mesh.faces import area_vectors

_NORMAL_NOISE = 1e-12
"""Fraction of the area up to which the variation of normals is a rounding error."""


def compactness(mesh: MeshLike | CellGraph, labels: npt.ArrayLike, *, weld: bool = True) -> float:
    """Return the mean over regions of perimeter / sqrt(area), which is lower for rounder regions.

    A disk has 3.54, a hexagon 3.72, and a square 4. The boundary of an open mesh counts as
    perimeter. A region that surrounds a limb has two borders, and a region that covers a tip has a
    short border. Regions without area are ignored. For tetrahedra, the result is the mean of
    surface / volume^(2/3): 4.84 for a ball, 6 for a cube.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        A mesh as for `segment`, or a graph of cells of any kind.
    labels : array_like of integers, shape (F,)
        Region of each face, >= 0.
    weld : bool, default True
        Count vertices at exactly the same position as one.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If there is not one label >= 0 per face, or no face has an area.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, eq. 5.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> compactness(square, [0, 0])
    4.0
    """
    surface = as_surface(mesh, weld=weld, n_threads=None)
    return compactness_of(surface, *compact_complete(labels, surface.n_cells))


def compactness_of(surface: Surface, labels: Ints, n_regions: int) -> float:
    """Return the compactness of labels without gaps."""
    perimeters = _core.region_perimeters(surface.handle, labels, n_regions, surface.n_threads)
    areas = sums_by_label(labels, surface.measures, n_regions)
    positive_total(areas)
    has_area = areas > 0
    scale = np.sqrt(areas[has_area]) if surface.dimension == 2 else areas[has_area] ** (2 / 3)
    return float(np.mean(perimeters[has_area] / scale))


def explained_variation(mesh: MeshLike, labels: npt.ArrayLike) -> float:
    """Return the fraction of the variation of normals that is between regions; 1 is best.

    The unit normal of each face is compared with the mean normal of its region and with the mean
    normal of the whole surface, weighted by area. The result is 1 if all regions are flat, and 0 if
    regions are as bent as the whole surface. A flat surface has 1. Faces without a normal have no
    area and do not count. Neighboring faces of opposite orientation count as bent.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    labels : array_like of integers, shape (F,)
        Region of each face, >= 0.

    Raises
    ------
    MeshError
        If the mesh is not a valid mesh of faces.
    ValueError, TypeError
        If there is not one label >= 0 per face, or no face has an area.

    References
    ----------
    Moore, Prince, Warrell, Mohammed and Jones, "Superpixel lattices", 2008, for colors.

    Examples
    --------
    A square folded by 90 degrees along its diagonal:

    >>> fold = ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> explained_variation(fold, [0, 1]), explained_variation(fold, [0, 0])
    (1.0, 0.0)
    """
    surface = as_surface(as_mesh(mesh), weld=False, n_threads=None)
    return explained_variation_of(surface, *compact_complete(labels, surface.n_cells))


def explained_variation_of(surface: Surface, labels: Ints, n_regions: int) -> float:
    """Return the explained variation of normals for labels without gaps.

    For a set of faces, S is the sum of area times (normal - mean normal of the surface), and A is
    the area. The variation between regions is the sum of |S|^2 / A over regions, and the total
    variation is this sum over faces. The formula avoids differences of large numbers.
    """
    mesh, areas = surface.mesh, surface.measures
    assert mesh is not None  # cells of other kinds have no normals
    vectors = area_vectors(mesh, surface.n_threads)
    total = positive_total(areas)
    vectors -= areas[:, np.newaxis] * (vectors.sum(axis=0) / total)
    variation = _squares_over(vectors, areas)
    if variation <= _NORMAL_NOISE * total:
        return 1.0
    sums = [sums_by_label(labels, vectors[:, axis], n_regions) for axis in range(3)]
    between = _squares_over(np.stack(sums, axis=1), sums_by_label(labels, areas, n_regions))
    return min(1.0, between / variation)


def _squares_over(vectors: Floats, areas: Floats) -> float:
    """Return the sum of |vector|^2 / area over all rows with an area."""
    squared = np.einsum("ij,ij->i", vectors, vectors)
    has_area = areas > 0
    return float((squared[has_area] / areas[has_area]).sum())
