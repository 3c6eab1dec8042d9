"""Join all but one of the pieces of each region to other regions. `segment` does not use it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_region_centers
from ..graph.cell_graph import CellGraph
from ..graph.sums import sums_by_label
from ..mesh.convert import MeshLike
from .edit import LabeledPart, RegionEdit


def enforce_connectivity(
    mesh: MeshLike | CellGraph, labels: npt.ArrayLike, *, centers: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None, weld: float = True, n_threads: int | None = None,
) -> RegionEdit:  # fmt: skip
    """Change labels so that all regions are connected.

    A piece is a connected component of the cells with one label. A region keeps the piece that
    contains its center or, if `centers` is None, its largest piece. All other pieces, in ascending
    order of area, join the neighboring piece with the longest common border. Borders in creases
    count as shorter, as in `smooth_borders`. Joined pieces get the same label. A piece without
    neighbors becomes a new region.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        Same as in `segment`, or a graph of any cells.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur. Cells labeled -1 keep this label.
    centers : array_like of int, shape (K,), optional
        Index of the center of each region, which must be a cell of the region.
    weights : array_like, shape (M,), optional
        Same as in `smooth_borders`.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    RegionEdit
        Regions keep their labels. New ones get labels from K on, usually by their lowest cells.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if labels are not one integer >= -1 per cell, if a label from 0 to
        K - 1 is missing or all labels are -1, if a center is not in its region, or if another
        parameter is not valid.

    Notes
    -----
    Time is O(N + M + B log^2 B) for N cells, M arcs, and B pairs of neighboring pieces.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> vertices = [[x // 2, x % 2, 0] for x in range(8)]
    >>> strip = Mesh(vertices, [[f, f + 1, f + 2] for f in range(6)])
    >>> enforce_connectivity(strip, [0, 0, 0, 1, 1, 0]).labels
    array([0, 0, 0, 1, 1, 1], dtype=int32)
    """
    part = LabeledPart.read(mesh, labels, weights, weld, n_threads)
    surface, n_regions = part.costs.surface, part.n_regions
    pieces, n_pieces = _core.find_components(*surface.arcs, part.labels, surface.n_threads)
    region_of_piece = np.empty(n_pieces, np.int32)
    region_of_piece[pieces] = part.labels
    areas = sums_by_label(pieces, surface.measures, n_pieces)
    if centers is None:
        # Pieces are sorted by area, so the last one assigned to a region is its largest piece. Of
        # equally large pieces, it is the one with the lowest number.
        order = np.lexsort((-np.arange(n_pieces), areas))
        kept = np.empty(n_regions, np.int32)
        kept[region_of_piece[order]] = order
    else:
        cells = checked_region_centers(centers, part.whole, n_regions)
        kept = pieces[part.numbers_of(cells)]
    stays = np.zeros(n_pieces, np.uint8)
    stays[kept] = 1
    roots = _core.join_regions(*part.costs.args, pieces, areas, stays, np.inf, surface.n_threads)
    islands = np.setdiff1d(roots, kept)
    label_of_piece = np.empty(n_pieces, np.int32)
    label_of_piece[kept] = np.arange(n_regions)
    label_of_piece[islands] = n_regions + np.arange(len(islands))
    return RegionEdit(
        part.whole_labels(label_of_piece[roots][pieces]),
        np.concatenate([np.arange(n_regions, dtype=np.int32), region_of_piece[islands]]),
        n_pieces - n_regions - len(islands),
        len(islands),
    )
