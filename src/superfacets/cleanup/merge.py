"""Merge small regions with their neighbors. `segment` does not use it."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_choice, checked_number
from ..base.options import ISLANDS, Islands
from ..base.types import Ints
from ..graph.cell_graph import CellGraph
from ..graph.sums import sums_by_label
from ..graph.surface import Surface
from ..mesh.convert import MeshLike
from .edit import LabeledPart, RegionEdit


def merge_small_regions(
    mesh: MeshLike | CellGraph, labels: npt.ArrayLike, min_size: float, *,
    islands: Islands = "keep", weights: npt.ArrayLike | None = None, weld: float = True,
    n_threads: int | None = None,
) -> RegionEdit:  # fmt: skip
    """Merge small regions with their neighbors.

    As long as a region is smaller than the minimum, the smallest region joins the neighbor with the
    longest common border. Borders in creases count as shorter, as in `smooth_borders`. Regions
    without a neighbor are skipped.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        Same as in `segment`, or a graph of any cells.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur. Cells labeled -1 keep this label.
    min_size : float
        Minimum area of a region, >= 0, as a fraction of the mean area of the given regions.
    islands : {"keep", "nearest"}
        With ``"keep"``, small regions without a neighbor remain. With ``"nearest"``, such a region
        joins the region of the nearest cell. Distances are Euclidean, and are measured from the
        center of the small region. The joined region is not connected. If all remaining regions are
        small and without a neighbor, they remain with ``"nearest"``, too.
    weights : array_like, shape (M,), optional
        Same as in `smooth_borders`.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    RegionEdit
        Remaining regions are renumbered in the same order. ``sources`` contains the old label of
        each remaining region. If `centers` are the centers of the old regions,
        ``centers[edit.sources]`` are the centers of the new regions.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if labels are not one integer >= -1 per cell, if a label from 0 to
        K - 1 is missing or all labels are -1, or if another parameter is not valid.

    Notes
    -----
    Time is O(N + M + B log^2 B) for N cells, M arcs, and B pairs of neighboring regions.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> vertices = [[x // 2, x % 2, 0] for x in range(8)]
    >>> strip = Mesh(vertices, [[f, f + 1, f + 2] for f in range(6)])
    >>> edit = merge_small_regions(strip, [0, 0, 0, 1, 1, 2], 0.6)
    >>> edit.labels, edit.sources, edit.n_joined
    (array([0, 0, 0, 1, 1, 1], dtype=int32), array([0, 1], dtype=int32), 1)
    """
    min_size = checked_number(min_size, "min_size", zero=True)
    checked_choice(islands, "islands", ISLANDS)
    part = LabeledPart.read(mesh, labels, weights, weld, n_threads)
    surface, n_regions = part.costs.surface, part.n_regions
    areas = sums_by_label(part.labels, surface.measures, n_regions)
    least = min_size * float(areas.sum()) / n_regions
    none_stays = np.empty(0, np.uint8)
    roots = _core.join_regions(
        *part.costs.args, part.labels, areas, none_stays, least, surface.n_threads
    )
    joined_areas = sums_by_label(roots, areas, n_regions)
    ends = np.unique(roots)
    small = ends[joined_areas[ends] < least]
    if islands == "nearest" and len(small):
        roots = _join_nearest(surface, part.labels, roots, small)
    sources, compact = np.unique(roots, return_inverse=True)
    return RegionEdit(
        part.whole_labels(compact.astype(np.int32)[part.labels]), sources.astype(np.int32),
        n_regions - len(sources), int(np.isin(small, sources).sum()),
    )  # fmt: skip


def _join_nearest(surface: Surface, labels: Ints, roots: Ints, islands: Ints) -> Ints:
    """Join each of `islands` to the region nearest to its center; return the changed `roots`."""
    region_of_cell = roots[labels]
    wanted = np.flatnonzero(~np.isin(region_of_cell, islands))
    if not len(wanted):
        return roots
    lengths = np.ones(surface.n_arcs, np.float32)  # unused, because no paths are computed
    placed = _core.PlacedCells(surface.positions, surface.measures, surface.n_threads)
    cells = _core.OrderedGraph(placed, *surface.arcs, lengths, surface.n_threads)
    regions, compact = np.unique(region_of_cell, return_inverse=True)
    centers = _core.update_centers(cells, compact.astype(np.int32), len(regions), surface.n_threads)
    queries = surface.positions[centers[np.searchsorted(regions, islands)]]
    nearest, _ = _core.nearest_points(
        surface.positions[wanted], queries, math.inf, surface.n_threads
    )
    joined_to = np.arange(len(roots), dtype=np.int32)
    joined_to[islands] = region_of_cell[wanted[nearest]]
    return joined_to[roots]
