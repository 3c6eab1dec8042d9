"""Stage 2: add costs of arcs across which people probably draw borders."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base.timing import Clock
from ..base.types import Ints, Singles
from ..clustering.plan import ArcLengths
from ..weights.parts import BORDER_COEFFICIENTS, conducting_graph, embedding, strength_of_parts
from .prepare import Prepared
from .weigh import Lengths, Weighed

BORDER_FACTOR = 8.0
"""Cost of an arc across which people draw a border, as a multiple of the expected radius. With 10,
the undersegmentation error at k = 50, 150 and 300 changes by 0.0006, 0.0002 and -0.0006, and the
compactness rises by 0.01."""

MIN_GROUPED, N_GROUPS = 24_000, 12_000
"""If there are at least as many cells as the first number, rates of borders are computed for at
least as many groups of cells as the second number. With 8,000 groups, the undersegmentation error
at k = 300 is 0.0009 higher."""

NO_GROUPS: Ints = np.empty(0, np.int32)


def normals_at_borders(prepared: Prepared, weighed: Weighed, clock: Clock) -> Singles | None:
    """Return normals of cells inside the mask for `add_borders`, (n, 3), or None without costs."""
    if not weighed.has_part_costs or weighed.of_made_thing:
        return None
    with clock.timed("weights", begins=False):
        normals = prepared.kind.normals(weighed.surface, prepared.graph, prepared.shapes)
        inside = weighed.plan.inside
        return (normals if inside is None else normals[inside.cells]).astype(np.float32)


def add_borders(
    ordered: _core.OrderedGraph, arcs: ArcLengths, lengths: Lengths, normals: Singles | None,
    weighed: Weighed, clock: Clock,
) -> tuple[ArcLengths, Lengths]:  # fmt: skip
    """Add a cost to arcs across which people probably draw borders, except on made things.

    `normals` are those of `normals_at_borders`. `ordered` gets the new lengths of `arcs`, which are
    inside the mask. Returns these arcs, and the lengths of all arcs.
    """
    if normals is None:
        return arcs, lengths
    plan, surface, graph = weighed.plan, weighed.surface, ordered
    inside, n_threads = plan.inside, surface.n_threads
    with clock.timed("weights", begins=False):
        widths = np.empty(0)  # of arcs between groups: `_core` estimates them
        if graph.n_cells >= MIN_GROUPED:
            groups = _core.CoarseGraph(graph, graph.n_cells // N_GROUPS, n_threads)
            group_of, graph = groups.coarse_cells(n_threads), groups.graph
            normals = groups.means_of(normals, NO_GROUPS, n_threads).reshape(-1, 3)
            between = groups.arcs()[:2]
        else:
            group_of, between = NO_GROUPS, arcs[:2]
            widths = surface.arc_measures().border_lengths
            widths = widths if inside is None else widths[inside.arcs]
        crease_cost = weighed.options.weights.crease_cost(plan.size.radius)
        base = conducting_graph(graph, crease_cost, n_threads)
        vectors = embedding(base, graph, n_threads)
        rates = _core.border_rates(
            graph, *between, widths, normals, vectors, BORDER_COEFFICIENTS, n_threads
        )
        cost = strength_of_parts(base) * BORDER_FACTOR * plan.size.radius / graph.straight_unit
        values = _core.add_group_costs(
            *arcs, group_of, *between, np.float32(cost) * rates, n_threads
        )
        arcs = (*arcs[:2], values)
        ordered.set_lengths(*arcs, n_threads)
        if inside is not None:
            values = lengths.values.copy()
            values[inside.arcs] = arcs[2]
        return arcs, lengths._replace(values=values)
