"""Stage 2: add costs of arcs across which people probably draw borders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from ..base.timing import Clock
from ..base.types import ArcLists, Ints, Longs, Singles
from ..weights.parts import BORDER_COEFFICIENTS, conducting_graph, embedding, strength_of_parts
from .weigh import Weighed

BORDER_FACTOR = 10.0
"""Cost of an arc across which people draw a border, as a multiple of the expected radius."""

MIN_GROUPED, N_GROUPS = 24_000, 12_000
"""If there are at least as many cells as the first number, rates of borders are computed for at least
as many groups of cells as the second number. Features of borders are means over 1 % of the square
root of the area or more, so more groups would hardly help."""

MAX_GROUP_SIZE = 16
"""Maximum number of cells per group."""

NO_GROUPS: Ints = np.empty(0, np.int32)
"""Value of `BorderCosts.group_of` if each cell is its own group."""

GROUP_SHARE = 0.5
"""Factor that reduces these costs in the costs of region borders if there are groups."""


@dataclass(frozen=True, eq=False)
class LikelyBorders:
    """Costs of arcs between groups of cells, in units of integer path lengths."""

    group_of: Ints  # (N,) group of each cell; empty if each cell is its own group
    between: tuple[Longs, Ints, Singles]  # offsets and neighbors of arcs between groups, and costs

    def added(self, arcs: ArcLists, lengths: Singles, n_threads: int) -> Singles:
        """Return the lengths of arcs plus these costs, for the computation of border costs."""
        share = GROUP_SHARE if len(self.group_of) else 1.0
        return _core.add_group_costs(*arcs, lengths, self.group_of, *self.between, share, n_threads)


def add_borders(
    graph: _core.OrderedGraph, arcs: ArcLists, weighed: Weighed, normals: Singles, clock: Clock
) -> LikelyBorders | None:
    """Add a cost to arcs across which people probably draw borders, except on made things.

    The cost is the rate of borders times `BORDER_FACTOR` times the expected radius of regions; see
    `_core.border_rates`. Rates of large graphs are those of groups of cells. `arcs` are the arcs of
    `graph`, and `normals` the unit normals of its cells, (N, 3).
    """
    if not weighed.has_part_costs or weighed.of_made_thing:
        return None
    radius, n_threads = weighed.plan.size.radius, weighed.surface.n_threads
    with clock.timed("weights", begins=False):
        group_of, grouped, widths = NO_GROUPS, graph, np.empty(0)
        groups = None
        if graph.n_cells >= MIN_GROUPED:
            size = min(graph.n_cells // N_GROUPS, MAX_GROUP_SIZE)
            groups = _core.CoarseGraph(graph, size, n_threads)
        if groups is not None and 2 * groups.graph.n_cells <= graph.n_cells:
            group_of, grouped = groups.coarse_cells(n_threads), groups.graph
            normals = groups.means_of(normals, NO_GROUPS, n_threads).reshape(-1, 3)
            arcs = groups.arcs()[:2]
        else:
            inside = weighed.plan.inside
            widths = weighed.surface.arc_measures().border_lengths
            widths = widths if inside is None else widths[inside.arcs]
        crease_cost = weighed.options.weights.crease_cost(radius)
        base = conducting_graph(grouped, crease_cost, n_threads)
        vectors = embedding(base, grouped, n_threads)
        strength = strength_of_parts(base)
        rates = _core.border_rates(
            grouped, *arcs, widths, normals, vectors, BORDER_COEFFICIENTS, n_threads
        )
        costs = np.float32(strength * BORDER_FACTOR * radius / graph.straight_unit) * rates
        borders = LikelyBorders(group_of, (*arcs, costs))
        graph.add_group_costs(group_of, *borders.between, 1.0, n_threads)
        return borders
