"""Metrics that need no ground truth: the compactness and the flatness of regions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.types import Floats, Ints
from ..graph.cell_graph import CellGraph
from ..graph.kinds import as_surface
from ..graph.sums import positive_total, sums_by_label
from ..graph.surface import Surface
from ..mesh.convert import MeshLike
from ..mesh.faces import area_vectors
from .overlap import compact_labels

_NORMAL_NOISE = 1e-12
"""A surface is treated as flat if the variation of normals is at most this fraction of the area."""


def compactness(mesh: MeshLike | CellGraph, labels: npt.ArrayLike, *, weld: float = True) -> float:
    """Return the mean of perimeter / sqrt(area) over all regions; round regions have low values.

    The value is 3.54 for a disk, 3.72 for a hexagon and 4 for a square. The boundary of an open
    mesh is part of the perimeter. Regions with area 0 are ignored. For tetrahedra, the result is
    the mean of surface area / volume^(2/3), which is 4.84 for a ball and 6 for a cube.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        Same as in `segment`, or a graph of any cells.
    labels : array_like of integers, shape (F,)
        Region of each cell, >= 0, or -1 for cells in no region, which are left out.
    weld : bool, default True
        Whether vertices at exactly the same position are treated as one vertex.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if labels are not one integer >= -1 per cell or are all -1, or if
        all cells in regions have area 0.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, equation 5.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> compactness(square, [0, 0])
    4.0
    """
    surface = as_surface(mesh, weld=weld, n_threads=None)
    return compactness_of(surface, *compact_labels(labels, surface.n_cells))


def compactness_of(surface: Surface, labels: Ints, n_regions: int) -> float:
    """Return the result of `compactness` for labels that are consecutive integers from 0, or -1."""
    labels = np.where(labels < 0, np.int32(n_regions), labels)  # the rest is one more region
    found = _core.region_perimeters(surface.handle, labels, n_regions + 1, surface.n_threads)
    perimeters = found[:n_regions]
    areas = sums_by_label(labels, surface.measures, n_regions + 1)[:n_regions]
    positive_total(areas)
    has_area = areas > 0
    scale = np.sqrt(areas[has_area]) if surface.dimension == 2 else areas[has_area] ** (2 / 3)
    return float(np.mean(perimeters[has_area] / scale))


def explained_variation(surface: Surface, labels: Ints, n_regions: int) -> float:
    """Return the fraction of the variance of face normals that the regions explain; 1 is best.

    Moore, Prince, Warrell, Mohammed and Jones, "Superpixel lattices", 2008, for normals instead of
    colors. The result is also 1 if the whole surface is flat. For a set of faces, S is the sum of
    area * (normal - mean normal of the surface), and A is its area. The variance between regions is
    the sum of |S|^2 / A over regions, and the total variance is the same sum over faces. These
    formulas avoid differences of large numbers.
    """
    mesh, areas = surface.mesh, surface.measures
    assert mesh is not None
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
    """Return the sum of |vector|^2 / area over all rows with an area above 0."""
    squared = np.einsum("ij,ij->i", vectors, vectors)
    has_area = areas > 0
    return float((squared[has_area] / areas[has_area]).sum())
