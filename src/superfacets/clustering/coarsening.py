"""Group cells into coarse cells, and build the graphs of coarse cells for the clustering loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import _core
from .._core import CoarseGraph, OrderedGraph
from ..base.options import LoopOptions
from ..base.timing import timed
from ..base.types import Ints
from .plan import Plan

CELL_SIZES: tuple[int, ...] = (16, 8, 4)
"""Possible numbers of cells per coarse cell on the finest coarse level, in order of preference. The
first number with which there are enough coarse cells is used (see `CELLS_PER_REGION`)."""

NEXT_CELL_SIZE = 4
"""Number of coarse cells that are grouped into one cell of the next coarser level."""

CELLS_PER_REGION = 24
"""Minimum mean number of coarse cells per region. On the 95 benchmark models, regions are as good
with values of 16 to 32 as without coarse levels."""

FINEST_PER_REGION, MIN_FINEST = 48, 8_000
"""Value that replaces CELLS_PER_REGION on the finest coarse level, if paths on coarse cells
determine the labels of all cells (see `Coarsening.loops_on_all`), and minimum number of its cells.
With a value of 24, the undersegmentation error is 0.003 to 0.006 higher; with 96, 0.001 to 0.003
lower. Without the minimum, it is 0.006 higher at k = 50, and the compactness 0.04 lower."""

COARSEST_PER_REGION = 12
"""Value that replaces CELLS_PER_REGION on all coarse levels except the finest, if
`gets_part_costs(graph)`."""

MANY_REGIONS = 10_000
"""Minimum number of regions for a short loop, if regions are small; see `Coarsening.is_short`. On
14 meshes of 43,000 to 420,000 faces, with 17 or 40 faces per region, the short loop raises the
undersegmentation error from 0.0259 to 0.0261 and lowers the compactness by 0.5 %."""

ENOUGH_OF_SEEDED = 0.75
"""A coarse graph is used only if its components with seeds together have at least this fraction of
the required number of coarse cells."""

MIN_SHARED = 100_000
"""Minimum number of cells of a graph that refers to given arcs (see `may_share_arcs`). In smaller
graphs, copied arcs, with target and length side by side, make the loop faster."""

MIN_REDUCTION = 2
"""Minimum factor by which the number of cells must decrease from level to level."""

EACH_ALONE: Ints = np.empty(0, np.int32)
"""Value of `PartCosts.group_of` if each cell is its own group."""


def can_be_coarse(is_symmetric: bool, plan: Plan, loop: LoopOptions) -> bool:
    """Return whether the loop may start on coarse cells.

    Exceptions: given seeds, `radius_factor`, ``tol=0``, one iteration, and an asymmetric graph.
    """
    is_exact = loop.radius_factor is None and loop.tol > 0 and loop.max_num_iter > 1
    return not plan.has_seeds and is_exact and is_symmetric


def may_share_arcs(n_cells: int, is_symmetric: bool, plan: Plan, loop: LoopOptions) -> bool:
    """Return whether the graph may refer to given arcs, as few searches visit all its cells."""
    least = max(MIN_SHARED, CELL_SIZES[-1] * _enough(plan.size.n_segments))
    return n_cells >= least and plan.is_sorted and can_be_coarse(is_symmetric, plan, loop)


@dataclass
class Coarsening:
    """The graphs of coarse cells, and how the clustering loop uses them."""

    graphs: list[CoarseGraph]
    """Coarse graphs, from finest to coarsest. The loop removes each graph after its last use."""
    n_without_loop: int = 0
    """Number of graphs at the start of `graphs` on which the loop does not run. After the loop,
    paths are extended from coarser cells to the cells of these graphs."""
    loops_on_all: bool = True
    """Whether the loop runs on all cells after the coarse graphs. If False, all cells are labeled
    once at the end: by `Loop._spread` if there are costs between parts, else by classification."""
    is_short: bool = False
    """Whether the loop may have only a few iterations, because there are many small regions. In
    this case, the default seeding method is ``"curve"``."""

    @classmethod
    def of(
        cls, graph: OrderedGraph, plan: Plan, n_threads: int, begun: list[CoarseGraph]
    ) -> Coarsening:
        """Build coarser graphs after those in `begun`, as long as regions have enough cells."""
        n_segments = plan.size.n_segments
        coarse = _coarser(graph, plan, n_threads, begun)
        if not gets_part_costs(graph):
            return cls(coarse, loops_on_all=not coarse)
        if has_small_regions(graph, n_segments):
            is_default = not plan.has_seeds and plan.init in (None, "curve")
            return cls(coarse, is_short=not coarse and n_segments >= MANY_REGIONS and is_default)
        # The loop ends on the coarsest of the graphs with enough cells; paths spread to the finer.
        n_fine = sum(level.graph.n_cells >= _enough(n_segments) for level in coarse)
        return cls(coarse, max(n_fine - 1, 0), loops_on_all=not coarse)


def finest_coarse(
    graph: OrderedGraph, plan: Plan, loop: LoopOptions, n_least: int, timings: dict[str, float]
) -> list[CoarseGraph]:
    """Build the finest coarse graph, if it has about `n_least` cells; return it in a list."""
    size, _, _ = _rules(graph, plan)
    may_be = can_be_coarse(graph.is_symmetric, plan, loop)
    if not size or graph.n_cells < size * n_least or not may_be:
        return []
    with timed(timings, "coarsen", loop.report):
        return _coarser(graph, plan, loop.n_threads, [], most=1)


def coarsened(
    graph: OrderedGraph, plan: Plan, loop: LoopOptions, timings: dict[str, float],
    begun: list[CoarseGraph],
) -> Coarsening:  # fmt: skip
    """Build the coarse graphs after those of `begun`, if `can_be_coarse`; record the run time."""
    if not can_be_coarse(graph.is_symmetric, plan, loop):
        return Coarsening([])
    with timed(timings, "coarsen", None if begun else loop.report):
        return Coarsening.of(graph, plan, loop.n_threads, begun)


def has_small_regions(graph: OrderedGraph, n_segments: int) -> bool:
    """Return whether regions have too few cells for paths on coarse cells to determine labels."""
    return graph.n_cells < CELL_SIZES[-1] * _enough(n_segments)


def _enough(n_segments: int) -> int:
    """Return the minimum number of coarse cells whose paths determine the labels of all cells."""
    return max(FINEST_PER_REGION * n_segments, MIN_FINEST)


def gets_part_costs(graph: OrderedGraph) -> bool:
    """Return whether the graph gets costs between parts, as `stages.weigh` has decided."""
    return graph.straight_unit > 0.0


def groups_of_cells(levels: Sequence[_core.CoarseGraph], n_threads: int) -> Ints:
    """Return, for each cell, its cell in the last graph of `levels`; empty if there is none."""
    if not levels:
        return EACH_ALONE
    found = levels[-1].coarse_cells(n_threads)
    for level in reversed(levels[:-1]):
        found = level.groups_of_cells(found, n_threads)
    return found


def _rules(graph: OrderedGraph, plan: Plan) -> tuple[int, int, int]:
    """Return the size of the finest coarse cells, or 0; minimum counts on this and other levels."""
    n_segments, sizes = plan.size.n_segments, CELL_SIZES
    n_coarser, n_finest = COARSEST_PER_REGION * n_segments, _enough(n_segments)
    if not gets_part_costs(graph):
        n_coarser = n_finest = CELLS_PER_REGION * n_segments
    elif has_small_regions(graph, n_segments):
        sizes, n_finest = (NEXT_CELL_SIZE,), CELLS_PER_REGION * n_segments
    return next((s for s in sizes if graph.n_cells >= s * n_finest), 0), n_finest, n_coarser


def _coarser(
    graph: OrderedGraph, plan: Plan, n_threads: int, coarse: list[CoarseGraph], most: int = 64
) -> list[CoarseGraph]:
    """Append up to `most` coarser graphs to `coarse`, from fine to coarse, and return `coarse`."""
    size, n_enough, n_next = _rules(graph, plan)
    while len(coarse) < most:
        if coarse:
            graph, size, n_enough = coarse[-1].graph, NEXT_CELL_SIZE, n_next
        if not size or graph.n_cells < size * n_enough:
            break  # regions would have too few coarse cells
        larger = CoarseGraph(graph, size, n_threads)
        if larger.graph.n_cells > graph.n_cells / MIN_REDUCTION:
            break  # most cells have no neighbors with which they can be grouped
        n_seeded = _core.n_cells_of_large_components(larger.graph, plan.size.n_segments, n_threads)
        if n_seeded < ENOUGH_OF_SEEDED * n_enough:
            break  # most cells are in small components, which get no seeds
        coarse.append(larger)
    return coarse
