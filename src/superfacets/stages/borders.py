"""Stage 2: add costs of arcs across which people probably draw borders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.timing import Clock
from ..base.types import ArcLists, Singles
from ..clustering.coarsening import EACH_ALONE, finest_coarse, groups_of_cells
from ..clustering.plan import ArcLengths
from ..graph.cell_graph import BaseGraph
from ..graph.kinds import Kind
from ..weights.formulas import Lengths
from ..weights.parts import BORDER_COEFFICIENTS, conducting_graph, embedding, strength_of_parts
from .weigh import Weighed

BORDER_FACTOR = 8.5
"""Cost of an arc across which people draw a border, as a multiple of the expected radius."""

MIN_RATED_IN_GROUPS, N_GROUPS = 24_000, 12_000
"""If there are at least as many cells as the first number, rates of borders are computed for at
least as many groups of cells as the second number. With 8,000 groups, the undersegmentation error
at k = 300 is 0.0009 higher."""


class Grouped(NamedTuple):
    """Groups of cells for `add_borders`: the cells of the last of `levels`, or all cells."""

    normals: Singles | None  # mean normal of each group; None if there are no costs of borders
    levels: Sequence[_core.CoarseGraph] = ()
    begun: Sequence[_core.CoarseGraph] = ()  # the finest coarse graph of the loop, if in `levels`


def grouped_for_borders(
    ordered: _core.OrderedGraph, kind: Kind, graph: BaseGraph, weighed: Weighed, clock: Clock
) -> Grouped:
    """Group the cells of a large graph for `add_borders`, if possible from cells of the loop."""
    if not weighed.has_part_costs or weighed.of_made_thing:
        return Grouped(None)
    n_threads, inside = weighed.surface.n_threads, weighed.plan.inside
    begun = finest_coarse(ordered, weighed.plan, weighed.options.loop, N_GROUPS, clock.timings)
    with clock.timed("weights", begins=False):
        levels, grouped = [*begun], begun[-1].graph if begun else ordered
        if grouped.n_cells >= MIN_RATED_IN_GROUPS:
            levels.append(_core.CoarseGraph(grouped, grouped.n_cells // N_GROUPS, n_threads))
        normals = kind.normals(weighed.surface, graph)  # not earlier, to save memory
        normals = normals if inside is None else normals[inside.cells]
        for level in levels:
            normals = level.means_of(normals, EACH_ALONE, n_threads).reshape(-1, 3)
    return Grouped(normals, levels, begun)


def add_borders(
    ordered: _core.OrderedGraph, grouped: Grouped, arcs: ArcLengths, lengths: Lengths,
    weighed: Weighed, clock: Clock,
) -> None:  # fmt: skip
    """Add a cost to arcs across which people probably draw borders, except on made things.

    Costs are added in place to two arrays: `lengths` of all arcs, and the lengths in `arcs`, which
    has the arcs inside the mask. The graphs `ordered` and `grouped.begun` get new lengths, too.
    """
    levels, begun, inside = grouped.levels, grouped.begun, weighed.plan.inside
    if grouped.normals is None:
        return
    n_threads = weighed.surface.n_threads
    with clock.timed("weights", begins=False):
        between, costs = _costs_between(levels, (ordered, arcs), grouped.normals, weighed)
        group_of = groups_of_cells(levels, n_threads)
        _core.add_group_costs(*arcs, group_of, *between, costs, n_threads)  # in place
        ordered.set_lengths(*arcs, n_threads)
        for level in begun:  # empty, or only the first of `levels`
            coarse, group_of_coarse = level.arcs(), groups_of_cells(levels[1:], n_threads)
            _core.add_group_costs(*coarse, group_of_coarse, *between, costs, n_threads)
            level.set_lengths(coarse[2], n_threads)
        if inside is not None:
            lengths.values[inside.arcs] = arcs.lengths


def _costs_between(
    levels: Sequence[_core.CoarseGraph], cells: tuple[_core.OrderedGraph, ArcLengths],
    normals: Singles, weighed: Weighed,
) -> tuple[ArcLists, Singles]:  # fmt: skip
    """Return arcs of the last graph in `levels`, or of `cells` if empty, and the cost of each."""
    plan, surface, (graph, arcs) = weighed.plan, weighed.surface, cells
    inside, n_threads = plan.inside, surface.n_threads
    if levels:
        graph, between = levels[-1].graph, levels[-1].arcs()[:2]
        widths = np.empty(0)  # `_core` estimates the widths of arcs between groups
    else:
        between, widths = arcs[:2], surface.arc_measures().border_lengths
        widths = widths if inside is None else widths[inside.arcs]
    base = conducting_graph(graph, weighed.options.weights.crease_cost(plan.size.radius), n_threads)
    rates = _core.border_rates(
        graph, *between, widths, normals, embedding(base, graph, n_threads), BORDER_COEFFICIENTS,
        n_threads,
    )  # fmt: skip
    # A radius beyond the whole surface would make sums of lengths overflow.
    scale = BORDER_FACTOR * min(plan.size.radius, plan.size.total**0.5) / graph.straight_unit
    return between, np.float32(strength_of_parts(base) * scale) * rates
