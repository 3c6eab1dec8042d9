"""Split a region between strokes: the cheapest border, preferably in creases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._types import Bools, Floats, Ints, Longs
from ..cells.constraints import NO_GROUPS, Cut
from ..cells.surface import Surface
from .coding import CellNumbers

SHARPNESS = 12.5
"""Steepness of the cost of creases: a turn of pi costs exp(-12.5), so a right angle exp(-12.5 / 2)
= 0.002. It corresponds to `hierarchy` (20 radii per turn, of which 1.6 count for 1/e)."""

RIDGE = 0.5  # weight of ridges: strokes on both sides of a ridge mean the ridge
NEARNESS = 6.0
"""Attraction of cells to the nearer stroke. Without it the border would be the shortest path around
the smaller stroke. With 3 this still happens on a flat square with strokes of a tenth of its side;
with 6 the sides meet in the middle, and a crease at a quarter of the way still wins."""

CAPACITY = 1 << 30  # sum of the capacities of arcs that can be cut; strokes have twice that

UNCUT = (1 << 31) - 1  # largest 32-bit flow


def split_cells(
    surface: Surface, cells: CellNumbers, red: CellNumbers, blue: CellNumbers
) -> CellNumbers:
    """Return the cells of a region on the blue side.

    The border is a minimum cut. Its cost is its length, which counts less in creases, plus a term
    that draws each cell to the nearer stroke. A piece of a side without a cell of its stroke is
    given to the other side. The cells of the region and of both strokes ascend; cells outside the
    region have no effect.

    Raises ValueError if a stroke has no cell in the region, or both have a cell in common.
    """
    places = [_places_in(cells, stroke) for stroke in (red, blue)]
    for name, found in zip(("red", "blue"), places, strict=True):
        if not len(found):
            raise ValueError(f"the {name} stroke is not in the region that is to be split")
    if len(np.intersect1d(places[0], places[1])):
        raise ValueError("the strokes cross: a cell cannot be on both sides")
    part = _part_of(surface, cells)
    is_blue = _cut(part, *places)
    is_blue |= _loose(part, ~is_blue, places[0])
    is_blue &= ~_loose(part, is_blue, places[1])
    return cells[is_blue]


@dataclass(frozen=True)
class _Part:
    """The cells of a region, renumbered from 0, and the arcs between them."""

    areas: Floats
    sources: Ints  # old SciPy needs 32-bit indices for flows
    targets: Ints
    costs: Floats  # cost of cutting each arc: length of its border, reduced in creases
    lengths: Floats  # length of each step

    @property
    def n(self) -> int:
        """Number of cells."""
        return len(self.areas)

    def matrix(self, values: Any) -> Any:
        """A sparse matrix of the arcs."""
        from scipy.sparse import csr_array

        return csr_array((values, (self.sources, self.targets)), shape=(self.n, self.n))


def _places_in(cells: CellNumbers, stroke: CellNumbers) -> Longs:
    """Indices in the region of the cells of a stroke, without cells outside."""
    places = np.searchsorted(cells, stroke)
    places = np.minimum(places, len(cells) - 1)
    return np.asarray(places[cells[places] == stroke])


def _part_of(surface: Surface, cells: CellNumbers) -> _Part:
    """Measure a region; time and memory are proportional to the region."""
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
    cut = Cut(surface.n_cells, cells.astype(np.int32), arcs, offsets, targets, NO_GROUPS)
    part = cut.surface_of(surface)
    borders, steps, angles, _, _ = part.handle.arc_measures(part.n_threads)
    turns = np.where(angles > 0, angles, -RIDGE * angles)
    costs = borders * np.exp(-SHARPNESS / np.pi * turns)
    return _Part(part.measures, sources, targets, costs, steps)


def _cut(part: _Part, red: Any, blue: Any) -> Bools:
    """Whether each cell is on the blue side of the minimum cut."""
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
    rest = capacities - maximum_flow(capacities, n, n + 1).flow
    rest.eliminate_zeros()
    is_blue = np.ones(n + 2, bool)
    is_blue[breadth_first_order(rest, n, return_predecessors=False)] = False
    return is_blue[:n]


def _pulls(part: _Part, red: Any, blue: Any) -> Floats:
    """Attraction of each cell to a stroke, in units of length; positive toward the red one."""
    from scipy.sparse.csgraph import dijkstra

    steps = part.matrix(np.maximum(part.lengths, 1e-12 * part.lengths.max(initial=1.0)))
    far = [dijkstra(steps, indices=stroke, min_only=True) for stroke in (red, blue)]
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = (far[1] - far[0]) / (far[1] + far[0])
    total = part.areas.sum()
    scale = NEARNESS / np.sqrt(total) if total > 0 else 0.0
    return np.asarray(np.nan_to_num(shares, nan=0.0) * part.areas * scale)


def _loose(part: _Part, is_side: Bools, stroke: Longs) -> Bools:
    """Cells of a side that are in connected pieces without a cell of its stroke."""
    from scipy.sparse.csgraph import connected_components

    is_within = is_side[part.sources] == is_side[part.targets]
    n_pieces, pieces = connected_components(part.matrix(is_within.astype(np.int8)), directed=False)
    is_held = np.zeros(n_pieces, bool)
    is_held[pieces[stroke]] = True
    is_held[pieces[~is_side]] = True
    return np.asarray(~is_held[pieces])
