"""Stage 2: add costs of arcs between parts of a shape, such as a finger and the palm of a hand.

The cost of an arc is proportional to the distance of its two cells in a spectral embedding, see
`weights.parts`.
"""

from __future__ import annotations

from dataclasses import dataclass

from .. import _core
from ..base.timing import Clock
from ..base.types import ArcLists, Ints, Singles
from ..clustering.coarsening import EACH_ALONE, Coarsening, groups_of_cells, has_small_regions
from ..weights import parts
from ..weights.parts import conducting_graph, embedding, scale, strength_of_parts
from .weigh import Weighed

PART_CREASE_SCALE = 17.0
"""Value that replaces `cleanup.edit.CREASE_SCALE` for weights ``"parts"``. With a lower
value, borders are more accurate and less compact: research/tune.py balances both."""

GROUP_SIZE = 8
"""Approximate number of cells per group in `groups_to_embed`."""

GROUP_STEP = 0.5
"""Factor that reduces the costs between parts in the costs of region borders, if the embedding has
one vector per group of cells. Arcs inside a group then have no costs between parts. Without the
reduction, borders of regions would therefore follow the borders of groups. On meshes of 200,000
faces, compactness would be 0.1 higher (worse)."""

FAR_STEPS, SHORT_STEPS = 3, 2
"""A far arc is an additional arc between faces that are not neighbors. These are the maximum
distances between two faces that are joined by a far arc, counted in arcs. SHORT_STEPS is used in a
short loop (see `Coarsening.is_short`), and for graphs with groups (see `groups_to_embed`). With
SHORT_STEPS, there are 9 instead of 20 far arcs per face. Regions are then 0.2 % to 0.4 % more
compact, but 5 % longer on regular grids."""


def add_parts(
    graph: _core.OrderedGraph, coarsening: Coarsening, weighed: Weighed, clock: Clock
) -> PartCosts | None:
    """Add costs between parts, and far arcs, to the graphs, if `Weighed.has_part_costs`."""
    if not weighed.has_part_costs:
        return None
    options, size, n_threads = weighed.options.weights, weighed.plan.size, weighed.surface.n_threads
    with clock.timed("weights", begins=False):
        # Barriers divide machine parts into faces, which have no parts.
        is_face = weighed.of_made_thing and weighed.plan.is_divided
        factors = (0.0 if is_face else options.params["gamma"], options.crease_cost(size.radius))
        if coarsening.loops_on_all:
            groups = groups_to_embed(graph, n_threads)
            costs = PartCosts.of(graph, groups, factors, n_threads)
            # With large regions, far arcs between all cells would dominate the run time. The limit
            # is then 1 step, which adds no far arcs.
            far_steps = FAR_STEPS if has_small_regions(graph, size.n_segments) else 1
            if coarsening.is_short or groups:
                far_steps = min(far_steps, SHORT_STEPS)
            graph.add_far_arcs(n_threads, far_steps)
            graph.add_part_costs(costs.group_of, costs.vectors, costs.factor, n_threads)
            costs.add_to(coarsening.graphs, costs.group_of, n_threads)
        else:
            # The last of these groups are the cells of the finest graph with a loop.
            groups = coarsening.graphs[: coarsening.n_without_loop + 1]
            costs = PartCosts.of(graph, groups, factors, n_threads)
            costs.add_to(coarsening.graphs[coarsening.n_without_loop :], None, n_threads)
        return costs


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

    @classmethod
    def of(
        cls, graph: _core.OrderedGraph, levels: list[_core.CoarseGraph],
        factors: tuple[float, float], n_threads: int,
    ) -> PartCosts:  # fmt: skip
        """Compute the spectral embedding of the last of `levels`, or of `graph` if it is empty.

        `factors` are gamma, and the cost of a concave crease of angle pi in the unit of the
        positions. The cost of an arc is gamma times the distance of its ends in the embedding,
        which is scaled so that distances sum to lengths. On shapes with few creases, gamma is
        reduced.
        """
        gamma, crease_cost = factors
        embedded = levels[-1].graph if levels else graph
        base = conducting_graph(embedded, crease_cost, n_threads)
        vectors = embedding(base, embedded, n_threads)
        strength = strength_of_parts(base)
        factor = strength * gamma * scale(base, vectors, n_threads) / graph.straight_unit
        return cls(vectors, groups_of_cells(levels, n_threads), factor)

    def add_to(
        self, coarse: list[_core.CoarseGraph], group_of: Ints | None, n_threads: int
    ) -> None:
        """Add far arcs, and the costs between parts, to the coarse graphs in `coarse`.

        `group_of` is the group of each cell of the graph that is one level finer than `coarse`, or
        None if the first graph in `coarse` was embedded itself.
        """
        rows = self.vectors
        for level in coarse:
            if group_of is not None:  # mean vector of the cells in each coarse cell
                rows = level.means_of(rows, group_of, n_threads).reshape(-1, rows.shape[1])
            group_of = EACH_ALONE
            level.add_far_arcs(n_threads)
            level.add_part_costs(rows, self.factor, n_threads)

    def with_part_costs(self, arcs: ArcLists, lengths: Singles, n_threads: int) -> Singles:
        """Return `lengths` plus costs between parts, which groups multiply by `GROUP_STEP`."""
        factor = self.factor * (GROUP_STEP if len(self.group_of) else 1.0)
        return _core.add_part_costs(*arcs, lengths, self.group_of, self.vectors, factor, n_threads)


def groups_to_embed(graph: _core.OrderedGraph, n_threads: int) -> list[_core.CoarseGraph]:
    """Group the cells of a large graph; return a list with the graph of groups, or no graph."""
    if graph.n_cells < parts.MIN_GROUPED:
        return []
    groups = _core.CoarseGraph(graph, GROUP_SIZE, n_threads)
    return [groups] if 2 * groups.graph.n_cells <= graph.n_cells else []
