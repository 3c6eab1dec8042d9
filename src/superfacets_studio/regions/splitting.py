"""Split a region between two brush strokes by a minimum cut, preferably along creases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from superfacets.kit import Bools, Floats, Ints, Longs, Surface

from ..labels.coding import CellNumbers

SHARPNESS = 12.5
"""Rate at which creases reduce the cost of a border. In a crease with angle t, the cost is
multiplied by exp(-12.5 t / pi): by 0.002 for a right angle. `hierarchy` uses a similar rate."""

CONVEX = 0.5  # factor on the angle t of convex creases; the factor of concave creases is 1
NEARNESS = 6.0
"""Strength of the attraction of cells to the nearer stroke. Without attraction, the border would be
the shortest closed curve around the smaller stroke. On a flat square with strokes as long as a
tenth of its side, a value of 3 is too small to prevent this. With 6, the border is midway between
the strokes, but still moves to a crease at a quarter of the distance between them."""

CAPACITY = 1 << 30  # sum of the capacities of all arcs that may be cut; fits into int32

UNCUT = (1 << 31) - 1  # capacity of arcs that must not be cut: the largest 32-bit integer


def split_cells(
    surface: Surface, cells: CellNumbers, red: CellNumbers, blue: CellNumbers
) -> CellNumbers:
    """Split a region, and return the cells on the side of the blue stroke.

    The border is a minimum cut. Its cost is its length, reduced in creases, plus a term that
    attracts each cell to the nearer stroke. A connected component of one side that contains no cell
    of this side's stroke moves to the other side. `cells` (the region), `red` and `blue` (the
    strokes) are cell indices in ascending order. Cells of strokes outside the region are ignored.
    Raises ValueError if a stroke has no cell in the region, or if the strokes share a cell.
    """
    strokes = [_indices_in(cells, stroke) for stroke in (red, blue)]
    for name, found in zip(("red", "blue"), strokes, strict=True):
        if not len(found):
            raise ValueError(f"the {name} stroke is outside the region to split")
    if len(np.intersect1d(strokes[0], strokes[1])):
        raise ValueError("the strokes cross: a cell cannot be on both sides")
    part = _region_graph(surface, cells)
    is_blue = _cut(part, *strokes)
    is_blue |= _without_stroke(part, ~is_blue, strokes[0])
    is_blue &= ~_without_stroke(part, is_blue, strokes[1])
    return cells[is_blue]


@dataclass(frozen=True)
class _RegionGraph:
    """Graph of a region: its cells, renumbered from 0, and the arcs between neighboring cells."""

    areas: Floats
    sources: Ints  # first cell of each arc; int32, because maximum_flow of old SciPy rejects int64
    targets: Ints  # second cell of each arc
    costs: Floats  # cost of cutting each arc: length of the border crossed, reduced in creases
    lengths: Floats  # distance between the centroids of the two cells of each arc

    @property
    def n(self) -> int:
        return len(self.areas)

    def matrix(self, values: Any) -> Any:
        """Return the graph as a sparse matrix with the given value of each arc."""
        from scipy.sparse import csr_array

        return csr_array((values, (self.sources, self.targets)), shape=(self.n, self.n))


def _indices_in(cells: CellNumbers, stroke: CellNumbers) -> Longs:
    """Return the index in `cells` of each cell of a stroke; cells not in `cells` are left out."""
    indices = np.minimum(np.searchsorted(cells, stroke), len(cells) - 1)
    return np.asarray(indices[cells[indices] == stroke])


def _region_graph(surface: Surface, cells: CellNumbers) -> _RegionGraph:
    """Extract the graph of a region; time and memory are proportional to the region's size."""
    starts = surface.offsets[cells]
    counts = surface.offsets[cells.astype(np.int64) + 1] - starts
    ends = np.cumsum(counts)
    arcs = np.arange(int(ends[-1])) + np.repeat(starts - ends + counts, counts)
    sources = np.repeat(np.arange(len(cells), dtype=np.int32), counts)
    neighbors = surface.neighbors[arcs].astype(np.uint32)
    targets = np.minimum(np.searchsorted(cells, neighbors), len(cells) - 1).astype(np.int32)
    kept = cells[targets] == neighbors
    arcs, sources, targets = arcs[kept], sources[kept], targets[kept]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=len(cells)))])
    part = surface.part(cells.astype(np.int32), arcs, offsets, targets)
    found = part.arc_measures()
    assert found.angles is not None
    assert found.step_lengths is not None
    turns = np.where(found.angles > 0, found.angles, -CONVEX * found.angles)
    costs = found.border_lengths * np.exp(-SHARPNESS / np.pi * turns)
    return _RegionGraph(part.measures, sources, targets, costs, found.step_lengths)


def _cut(part: _RegionGraph, red: Any, blue: Any) -> Bools:
    """Return whether each cell is on the blue side of the minimum cut."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    pulls = _pulls(part, red, blue)
    total = part.costs.sum() / 2 + np.abs(pulls).sum() or 1.0
    to_red, to_blue = (np.maximum(sign * pulls, 0.0) / total * CAPACITY for sign in (1, -1))
    to_red[red] = to_blue[blue] = UNCUT
    to_red[blue] = to_blue[red] = 0
    n = part.n
    all_cells = np.arange(n, dtype=np.int32)
    source, sink = np.full_like(all_cells, n), np.full_like(all_cells, n + 1)
    values = np.concatenate([part.costs / total * CAPACITY, to_red, to_blue]).astype(np.int32)
    rows = np.concatenate([part.sources, source, all_cells])
    columns = np.concatenate([part.targets, all_cells, sink])
    capacities = csr_array((values, (rows, columns)), shape=(n + 2, n + 2), dtype=np.int32)
    residual = capacities - maximum_flow(capacities, n, n + 1).flow
    residual.eliminate_zeros()
    is_blue = np.ones(n + 2, bool)
    is_blue[breadth_first_order(residual, n, return_predecessors=False)] = False
    return is_blue[:n]


def _pulls(part: _RegionGraph, red: Any, blue: Any) -> Floats:
    """Return the attraction of each cell to the red (> 0) or blue (< 0) stroke, as a length."""
    from scipy.sparse.csgraph import dijkstra

    steps = part.matrix(np.maximum(part.lengths, 1e-12 * part.lengths.max(initial=1.0)))
    far = [dijkstra(steps, indices=stroke, min_only=True) for stroke in (red, blue)]
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = (far[1] - far[0]) / (far[1] + far[0])
    total = part.areas.sum()
    scale = NEARNESS / np.sqrt(total) if total > 0 else 0.0
    return np.asarray(np.nan_to_num(shares, nan=0.0) * part.areas * scale)


def _without_stroke(part: _RegionGraph, is_side: Bools, stroke: Longs) -> Bools:
    """Return a mask of the cells of a side whose connected component has no cell of `stroke`."""
    from scipy.sparse.csgraph import connected_components

    is_within = is_side[part.sources] == is_side[part.targets]
    n_pieces, pieces = connected_components(part.matrix(is_within.astype(np.int8)), directed=False)
    is_held = np.zeros(n_pieces, bool)
    is_held[pieces[stroke]] = is_held[pieces[~is_side]] = True
    return np.asarray(~is_held[pieces])
