"""Stage 2: add costs of arcs between parts of a shape, such as a finger and the palm of a hand.

The cost of an arc is proportional to the distance of its two cells in a spectral embedding, see
`weights.parts`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.timing import Clock
from ..base.types import ArcLists, Ints, Longs, Singles
from ..clustering.coarsening import Coarsening, has_small_regions
from ..weights import parts
from ..weights.parts import ConductingGraph, border_rates, conducting_graph, embedding, scale
from .weigh import Weighed

PART_CREASE_SCALE = 7.0
"""Value that replaces `cleanup.edit.CREASE_SCALE` for weights ``"parts"``. With a value of 6, the
compactness is 0.01 higher (worse)."""

GROUP_SIZE = 8
"""Approximate number of cells per group in `groups_to_embed`."""

GROUP_STEP = 0.5
"""Factor that reduces the costs between parts in the costs of region borders, if the embedding has
one vector per group of cells. Arcs inside a group then have no costs between parts. Without the
reduction, borders of regions would therefore follow the borders of groups. On meshes of 200,000
faces, compactness would be 0.1 higher (worse)."""

MIN_BLOCKED, FULL_BLOCKED = 0.001, 0.03
"""Costs between parts are 0 if `ConductingGraph.blocked_fraction` is at most the first value, and
have their full value if it is at least the second. In between, they increase linearly. The fraction
is 0 for surfaces without concave edges and ridges, such as smooth convex bodies, which have no
parts. It is at least 0.037 for all benchmark models."""

FAR_STEPS, SHORT_STEPS = 3, 2
"""A far arc is an additional arc between faces that are not neighbors. These are the maximum
distances between two faces that are joined by a far arc, counted in arcs. SHORT_STEPS is used in a
short loop (see `Coarsening.is_short`), and for graphs with groups (see `groups_to_embed`). With
SHORT_STEPS, there are 9 instead of 20 far arcs per face. Regions are then 0.2 % to 0.4 % more
compact, but 5 % longer on regular grids."""


EACH_ALONE: Ints = np.empty(0, np.int32)
"""Value of `PartCosts.group_of` if each cell is its own group."""


BORDER_FACTOR = 10.0
"""Cost of an arc across which people draw a border, as a multiple of the expected radius."""


def add_parts(
    graph: _core.OrderedGraph, coarsening: Coarsening, weighed: Weighed, normals: Singles,
    clock: Clock,
) -> PartCosts | None:  # fmt: skip
    """Add costs between parts of the shape, and far arcs, if `Weighed.has_part_costs` is true.

    They are added to the graphs on which the loop runs. Far arcs join faces that are two or more
    arcs apart. `normals` are the unit normals of the cells, (N, 3).
    """
    if not weighed.has_part_costs:
        return None
    options, size, n_threads = weighed.options.weights, weighed.plan.size, weighed.surface.n_threads
    with clock.timed("weights", begins=False):
        factors = Factors(
            options.params["gamma"], options.crease_cost(size.radius), BORDER_FACTOR * size.radius
        )
        if coarsening.loops_on_all:
            groups = groups_to_embed(graph, n_threads)
            costs = PartCosts.of(graph, groups, normals, factors, n_threads)
            far_steps = FAR_STEPS if has_small_regions(graph, size.n_segments) else 1
            if coarsening.is_short or groups:
                far_steps = min(far_steps, SHORT_STEPS)
            # With large regions, far arcs between all cells would dominate the run time, so there
            # are none: `far_steps` is 1.
            if groups:
                graph.add_group_costs(costs.group_of, *costs.borders, 1.0, n_threads)
            graph.add_far_arcs(n_threads, far_steps)
            graph.add_part_costs(costs.group_of, costs.vectors, costs.factor, n_threads)
            costs.add_to(coarsening.graphs, costs.group_of, normals, factors, n_threads)
        else:
            n_groups = coarsening.n_without_loop + 1
            groups = coarsening.graphs[:n_groups]
            costs = PartCosts.of(graph, groups, normals, factors, n_threads)
            groups[-1].add_far_arcs(n_threads)
            groups[-1].add_part_costs(costs.vectors, costs.factor, n_threads)
            costs.add_to(
                coarsening.graphs[n_groups:], EACH_ALONE, _means(groups, normals, n_threads),
                factors, n_threads,
            )  # fmt: skip
        return costs


class Factors(NamedTuple):
    """Factors of costs, in the unit of the positions except gamma."""

    gamma: float  # cost of an arc as a multiple of the distance of its ends in the embedding
    crease: float  # cost of a concave crease with angle pi
    border: float  # cost of an arc across which people draw a border


@dataclass(frozen=True, eq=False)
class PartCosts:
    """Costs of arcs between parts of a shape, proportional to distances in a spectral embedding."""

    vectors: Singles
    """Coordinates of each group of cells in the embedding, (G, Q). Q is 0 if there are no costs."""
    group_of: Ints
    """Group of each cell, (N,); empty if each cell is its own group."""
    factor: float
    """Cost of an arc between cells at a distance of 1 in the embedding, in units of integer path
    lengths."""
    borders: tuple[Longs, Ints, Singles]
    """Arcs between groups, and their cost due to borders that people draw, in the same units."""

    @classmethod
    def of(
        cls, graph: _core.OrderedGraph, levels: list[_core.CoarseGraph], normals: Singles,
        factors: Factors, n_threads: int,
    ) -> PartCosts:  # fmt: skip
        """Compute the spectral embedding of a graph, and the factor of the costs.

        `levels` contains successively coarser graphs. The cells of the last graph are embedded, or
        the cells of `graph` if `levels` is empty. The cost of an arc is gamma times
        the distance of its ends in the embedding. Distances are scaled so that, over all arcs of
        the embedded graph, their sum equals the sum of the arc lengths without crease costs. On
        shapes with few creases, gamma is reduced (see `MIN_BLOCKED`).
        """
        embedded = levels[-1].graph if levels else graph
        base = conducting_graph(embedded, factors.crease, n_threads)
        vectors = embedding(base, embedded, n_threads)
        strength = (base.blocked_fraction - MIN_BLOCKED) / (FULL_BLOCKED - MIN_BLOCKED)
        strength = min(max(strength, 0.0), 1.0)
        rows = _means(levels, normals, n_threads)
        unit = graph.straight_unit
        border = factors.border / unit * strength
        borders = _borders(embedded, base, rows, vectors, border, n_threads)
        embedded.add_group_costs(EACH_ALONE, *borders, 1.0, n_threads)
        base = conducting_graph(embedded, factors.crease, n_threads)
        vectors = embedding(base, embedded, n_threads)
        factor = factors.gamma * strength * scale(base, vectors, n_threads) / unit
        return cls(vectors, _group_of(levels, n_threads), factor, borders)

    def add_to(
        self, coarse: list[_core.CoarseGraph], group_of: Ints, normals: Singles,
        factors: Factors, n_threads: int,
    ) -> None:  # fmt: skip
        """Add far arcs, and the costs between parts, to the coarse graphs in `coarse`.

        `group_of` is the group of each cell of the next finer graph (see `PartCosts.group_of`); it
        is None if the first graph in `coarse` is the embedded graph.
        """
        rows = self.vectors
        for level in coarse:
            normals = _means([level], normals, n_threads)
            rows = level.means_of(rows, group_of, n_threads).reshape(-1, rows.shape[1])
            group_of = EACH_ALONE
            base = conducting_graph(level.graph, factors.crease, n_threads)
            border = factors.border / level.graph.straight_unit
            borders = _borders(level.graph, base, normals, rows, border, n_threads)
            level.graph.add_group_costs(EACH_ALONE, *borders, 1.0, n_threads)
            level.add_far_arcs(n_threads)
            level.add_part_costs(rows, self.factor, n_threads)

    def with_part_costs(self, arcs: ArcLists, lengths: Singles, n_threads: int) -> Singles:
        """Return `lengths` plus costs between parts, for the computation of border costs.

        If there are groups, the costs between parts are reduced by `GROUP_STEP`.
        """
        share = GROUP_STEP if len(self.group_of) else 1.0
        factor = self.factor * share
        lengths = _core.add_group_costs(
            *arcs, lengths, self.group_of, *self.borders, share, n_threads
        )
        return _core.add_part_costs(*arcs, lengths, self.group_of, self.vectors, factor, n_threads)


def _borders(
    graph: _core.OrderedGraph, base: ConductingGraph, normals: Singles, vectors: Singles,
    border: float, n_threads: int,
) -> tuple[Longs, Ints, Singles]:  # fmt: skip
    rates = border_rates(base, graph, normals, vectors, n_threads)
    return (*base.arcs, np.float32(border) * rates)


def _means(levels: list[_core.CoarseGraph], rows: Singles, n_threads: int) -> Singles:
    """Return the mean row of the cells of each cell of the last graph, or the rows themselves."""
    for level in levels:
        rows = level.means_of(rows, EACH_ALONE, n_threads).reshape(-1, rows.shape[1])
    return rows


def _group_of(levels: list[_core.CoarseGraph], n_threads: int) -> Ints:
    """Return, for each cell, the cell of the last graph in `levels` that contains the cell.

    The result is empty if `levels` is empty.
    """
    if not levels:
        return EACH_ALONE
    found = levels[0].coarse_cells(n_threads)
    for level in levels[1:]:
        found = level.coarse_cells(n_threads)[found]
    return found


def groups_to_embed(graph: _core.OrderedGraph, n_threads: int) -> list[_core.CoarseGraph]:
    """Group the cells of a large graph; return the graph of the groups in a list of one graph.

    The list is empty if the graph has fewer than `parts.MIN_GROUPED` cells, and for triangle soup,
    in which most cells have no neighbors.
    """
    if graph.n_cells < parts.MIN_GROUPED:
        return []
    groups = _core.CoarseGraph(graph, GROUP_SIZE, n_threads)
    return [groups] if 2 * groups.graph.n_cells <= graph.n_cells else []
