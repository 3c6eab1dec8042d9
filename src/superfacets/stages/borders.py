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
from ..weights.parts import BORDER_COEFFICIENTS, conducting_graph, embedding, strength_of_parts
from .prepare import Prepared
from .weigh import Lengths, Weighed

BORDER_FACTOR = 8.5
"""Cost of an arc across which people draw a border, as a multiple of the expected radius. With 10
and 50 regions, the undersegmentation error is 0.002 lower, and the compactness 0.02 higher."""

MIN_RATED_IN_GROUPS, N_GROUPS = 24_000, 12_000
"""If there are at least as many cells as the first number, rates of borders are computed for at
least as many groups of cells as the second number. With 8,000 groups, the undersegmentation error
at k = 300 is 0.0009 higher."""


def normals_at_borders(prepared: Prepared, weighed: Weighed, clock: Clock) -> Singles | None:
    """Return normals of cells inside the mask for `add_borders`, (n, 3), or None without costs."""
    if not weighed.has_part_costs or weighed.of_made_thing:
        return None
    with clock.timed("weights", begins=False):
        normals = prepared.kind.normals(weighed.surface, prepared.graph, prepared.shapes)
        inside, n_threads = weighed.plan.inside, weighed.surface.n_threads
        normals = normals if inside is None else normals[inside.cells]
        return _core.narrowed(normals.reshape(-1), n_threads).reshape(-1, 3)


class Grouped(NamedTuple):
    """Groups of cells for `add_borders`: the cells of the last of `levels`, or all cells."""

    normals: Singles | None  # mean normal of each group; None if there are no costs of borders
    levels: Sequence[_core.CoarseGraph] = ()
    begun: Sequence[_core.CoarseGraph] = ()  # the finest coarse graph of the loop, if in `levels`


def grouped_for_borders(
    ordered: _core.OrderedGraph, normals: Singles | None, weighed: Weighed, clock: Clock
) -> Grouped:
    """Group the cells of a large graph for `add_borders`, if possible from cells of the loop."""
    if normals is None:
        return Grouped(None)
    n_threads = weighed.surface.n_threads
    begun = finest_coarse(ordered, weighed.plan, weighed.options.loop, N_GROUPS, clock.timings)
    with clock.timed("weights", begins=False):
        levels, graph = [*begun], begun[-1].graph if begun else ordered
        if graph.n_cells >= MIN_RATED_IN_GROUPS:
            levels.append(_core.CoarseGraph(graph, graph.n_cells // N_GROUPS, n_threads))
        for level in levels:
            normals = level.means_of(normals, EACH_ALONE, n_threads).reshape(-1, 3)
    return Grouped(normals, levels, begun)


def add_borders(
    ordered: _core.OrderedGraph, grouped: Grouped, arcs: ArcLengths, lengths: Lengths,
    weighed: Weighed, clock: Clock,
) -> tuple[ArcLengths, Lengths]:  # fmt: skip
    """Add a cost to arcs across which people probably draw borders, except on made things.

    `ordered` and `grouped.begun` get new lengths of arcs. Returns `arcs`, which are inside the
    mask, with these lengths, and the lengths of all arcs.
    """
    levels, begun, inside = grouped.levels, grouped.begun, weighed.plan.inside
    if grouped.normals is None:
        return arcs, lengths
    n_threads = weighed.surface.n_threads
    with clock.timed("weights", begins=False):
        between, costs = _costs_between(levels, (ordered, arcs), grouped.normals, weighed)
        group_of = groups_of_cells(levels, n_threads)
        values = _core.add_group_costs(*arcs, group_of, *between, costs, n_threads)
        arcs = arcs._replace(lengths=values)
        ordered.set_lengths(*arcs, n_threads)
        for level in begun:  # empty, or only the first of `levels`
            coarse, group_of_coarse = level.arcs(), groups_of_cells(levels[1:], n_threads)
            values = _core.add_group_costs(*coarse, group_of_coarse, *between, costs, n_threads)
            level.set_lengths(values, n_threads)
        if inside is not None:
            values = lengths.values.copy()
            values[inside.arcs] = arcs.lengths
        return arcs, lengths._replace(values=arcs.lengths if inside is None else values)


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
    cost = strength_of_parts(base) * BORDER_FACTOR * plan.size.radius / graph.straight_unit
    return between, np.float32(cost) * rates
