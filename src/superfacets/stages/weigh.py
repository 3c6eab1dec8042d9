"""Stage 2: compute the weights of arcs, and build the graphs on which the loop runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy.typing as npt

from .. import _core
from ..base.timing import Clock
from ..clustering.coarsening import may_share_arcs
from ..clustering.plan import ArcLengths, Plan
from ..graph.cell_graph import BaseGraph, checked_weights
from ..graph.surface import Surface
from ..weights.features import FeatureCosts
from ..weights.formulas import Lengths, weights_of_kind
from .options import SegmentOptions
from .prepare import Prepared

UNIT_FACTOR = 4.0
"""Factor by which the unit of integer path lengths is increased if there are costs between parts.
These costs increase the total length of all arcs by a factor of up to 1 + gamma. With the larger
unit, path lengths stay within the range of integers."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """Facts about the weights of arcs between cells."""

    options: SegmentOptions  # options whose defaults fit the cells
    plan: Plan
    surface: Surface  # lengths and angles of the arcs between all cells
    of_made_thing: bool  # see `ArcWeights.of_made_thing`
    has_part_costs: bool
    """Whether arcs have costs of likely borders and between parts. This is the case for the
    weights ``"parts"``, except for volumes, for graphs that have weights of their own, and if the
    expected radius of regions or the total area is 0."""


class Placed(NamedTuple):
    """Cells inside the mask. They are sorted only in `_core`: arrays in Python keep their order."""

    cells: _core.PlacedCells
    arcs: ArcLengths  # offsets, neighbors and lengths of the arcs between these cells


def weigh(
    prepared: Prepared, plan: Plan, options: SegmentOptions, clock: Clock
) -> tuple[Weighed, npt.ArrayLike | Lengths]:
    """Compute the weight of each arc, (M,), for the expected radius of regions."""
    kind, graph, (_, radius, total) = prepared.kind, prepared.graph, plan.size
    if not kind.tells_concave(graph):
        options = replace(options, weights=options.weights.with_convex_costs())
    with clock.timed("weights"):
        surface = kind.surface(prepared.cells, graph, options.loop.n_threads)
        is_graph = surface.weights is not None  # its arcs have weights of their own
        has_creases = not is_graph and surface.dimension == 2
        has_part_costs = options.weights.has_part_costs and has_creases and min(radius, total) > 0.0
        unit_factor = UNIT_FACTOR if has_part_costs else 1.0
        if options.features.table is not None:  # weights change before they are rounded
            unit_factor = 0.0
        arc_weights = weights_of_kind(kind, surface, graph, radius, options.weights, unit_factor)
        if not options.weights.has_other_unit:  # otherwise, `clean` needs normals
            surface = kind.bare_surface(surface, prepared.cells, graph, surface.n_threads)
    relocates = options.may_relocate and has_part_costs and not plan.has_seeds
    options = replace(options, loop=replace(options.loop, relocates=relocates))
    return Weighed(
        options, plan, surface, arc_weights.of_made_thing, has_part_costs
    ), arc_weights.weights


def add_features(
    weights: npt.ArrayLike | Lengths, weighed: Weighed, prepared: Prepared, clock: Clock
) -> tuple[npt.ArrayLike | Lengths, FeatureCosts | None]:
    """Return weights plus costs of features, and the `FeatureCosts`, or None without features."""
    surface, measures = weighed.surface, prepared.graph.measures
    with clock.timed("weights", begins=False):
        costs = weighed.options.features.costs(
            prepared.source, measures, surface.n_threads, weighed.options.constraints,
            prepared.input_index,
        )  # fmt: skip
        if costs is None or isinstance(weights, Lengths):  # `Lengths` only without features
            return weights, None
        checked = checked_weights(weights, surface.n_arcs, surface.n_threads)
        return costs.added(checked, surface, weighed.plan.size.radius), costs


def round_weights(
    weights: npt.ArrayLike | Lengths, graph: BaseGraph, weighed: Weighed, clock: Clock
) -> Lengths:
    """Round weights to integer multiples of a unit, if they are not rounded yet."""
    if isinstance(weights, Lengths):
        return weights
    with clock.timed("weights", begins=False):
        unit_factor = UNIT_FACTOR if weighed.has_part_costs else 1.0
        return Lengths(*graph.quantized(weights, weighed.surface.n_threads, unit_factor))


def place(graph: BaseGraph, lengths: Lengths, weighed: Weighed, clock: Clock) -> Placed:
    """Sort cells inside the mask along a curve, if this was not done when the graph was built."""
    with clock.timed("order"):
        n_threads = weighed.surface.n_threads
        return Placed(*weighed.plan.placed_cells(graph, lengths.values, n_threads))


def ordered_graph(
    placed: Placed, unit: float, weighed: Weighed, clock: Clock
) -> _core.OrderedGraph:
    """Build the graph for the loop. The arrays of `placed.cells` are moved to the graph."""
    options = weighed.options.weights
    with clock.timed("order", begins=False):
        is_symmetric = options.given is None  # formulas give symmetric weights
        # Length of an integer step in the unit of positions; 0 without costs between parts.
        straight_unit = unit * weighed.surface.weight_unit if weighed.has_part_costs else 0.0
        n_cells = len(placed.arcs.offsets) - 1
        ordered = _core.OrderedGraph(
            placed.cells, *placed.arcs, weighed.surface.n_threads, is_symmetric, straight_unit,
            may_share_arcs(n_cells, is_symmetric, weighed.plan, weighed.options.loop),
        )  # fmt: skip
        if weighed.of_made_thing:  # made things have costs between parts, so the unit is above 0
            ordered.crease_limit = options.crease_limit(weighed.plan.size.radius) / straight_unit
    return ordered
