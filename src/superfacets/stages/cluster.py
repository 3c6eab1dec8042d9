"""Stages 3 to 5: run the clustering loop, clean up regions, and make the result."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from .._core import OrderedGraph
from ..base.checks import counted
from ..base.errors import BalanceWarning, RadiusWarning, SliverWarning
from ..base.timing import Clock
from ..base.types import Ints
from ..cleanup.edit import BorderCosts
from ..cleanup.region_sizes import Goals, settle
from ..cleanup.smooth import OF_PARTS, SmoothOptions, straighten
from ..clustering.balance import Balancer
from ..clustering.coarsening import Coarsening
from ..clustering.plan import ArcLengths
from ..clustering.result import Segmentation
from ..clustering.run import segment_cells
from ..mesh.base import Cells
from ..weights.features import FeatureCosts
from ..weights.formulas import Lengths, creases_of
from .notes import radius_note, sliver_advice, warn_of_islands
from .part_costs import PART_CREASE_SCALE, PartCosts
from .prepare import Planned
from .weigh import Weighed

MAX_SPREAD = 0.15
"""Maximum coefficient of variation of the target sizes of equal regions without a warning."""


@dataclass(frozen=True, eq=False)
class Clustered:
    """Regions of the cells inside the mask, and the data that determine their borders."""

    result: Segmentation
    goals: Goals | None  # target sizes of regions; None if sizes are not restricted
    part_costs: PartCosts | None


def cluster(
    ordered: OrderedGraph, coarsening: Coarsening, arcs: ArcLengths, weighed: Weighed,
    planned: Planned, part_costs: PartCosts | None,
) -> Clustered:  # fmt: skip
    """Place seeds, and run the clustering loop, which labels cells and moves centers."""
    options, plan = weighed.options, weighed.plan
    if note := SliverWarning.text(planned.sliver_share, sliver_advice(plan.size.radius)):
        warnings.warn(note, SliverWarning, stacklevel=5)
    balancer = None
    if planned.sizes is not None:
        balancer = Balancer.of(planned.sizes, coarsening.graphs, plan, options.loop)
    result = segment_cells(
        ordered, coarsening, weighed.surface.bounds, plan, options.loop,
        arcs if weighed.has_part_costs else None, balancer,
    )  # fmt: skip
    if balancer is not None and plan.is_divided and options.sizes.balance == 1:
        spread = float(balancer.targets.std() / balancer.targets.mean())
        if spread > MAX_SPREAD:
            n_small = np.count_nonzero(balancer.targets < balancer.targets.mean() / 2)
            note = (
                f"sizes of regions vary by {spread:.0%}, because some areas between barriers are"
                f" smaller than a region: with about {n_small} more regions, sizes vary less"
            )
            warnings.warn(note, BalanceWarning, stacklevel=5)
    goals = None if balancer is None else balancer.region_goals(result.labels, result.n_segments)
    return Clustered(result, goals, part_costs)


def clean(
    clustered: Clustered, lengths: Lengths, feature_costs: FeatureCosts | None, weighed: Weighed,
    clock: Clock,
) -> Segmentation:  # fmt: skip
    """Straighten borders and adjust sizes of regions, as requested."""
    options, plan, part_costs = weighed.options, weighed.plan, clustered.part_costs
    if not (options.smooth or options.sizes.is_used):
        return clustered.result
    with clock.timed("regions"):
        costs = _border_costs(lengths, feature_costs, weighed)
        costs = costs if plan.inside is None else costs.of_kept(plan.inside)
        smoothing = SmoothOptions()
        if part_costs is not None:  # `lengths` have costs of borders, but not between parts
            arcs, n_threads = costs.surface.arcs, weighed.surface.n_threads
            on_borders = part_costs.with_part_costs(arcs, costs.lengths, n_threads)
            costs = replace(costs, lengths=on_borders, crease_scale=PART_CREASE_SCALE)
            smoothing = OF_PARTS
        result, goals = clustered.result, clustered.goals
        if options.smooth:
            targets = None if goals is None else (goals.sizes, goals.targets)
            labels = straighten(costs, result.labels, result.centers, smoothing, targets)
            result = replace(result, labels=labels)
        if goals is not None:
            result = _sized(costs, result, goals, smoothing if options.smooth else None)
    return result


def _sized(
    costs: BorderCosts, result: Segmentation, goals: Goals, smoothing: SmoothOptions | None
) -> Segmentation:
    """Move cells until sizes are within their limits; warn if exact regions are disconnected."""
    labels, centers = settle(costs, result.labels, result.centers, goals, smoothing)
    n_extra = 0
    if goals.is_exact:
        n_extra = int(costs.surface.components(labels).max()) + 1 - len(centers)
    if n_extra > 0:
        note = (
            f"some regions are disconnected, with {counted(n_extra, 'extra piece')}: no connected"
            " regions of the requested sizes were found"
        )
        warnings.warn(note, BalanceWarning, stacklevel=6)
    return replace(result, labels=labels, centers=centers, n_extra_pieces=n_extra)


def _border_costs(
    lengths: Lengths, feature_costs: FeatureCosts | None, weighed: Weighed
) -> BorderCosts:
    """Return the costs of borders between regions, from weights if their unit allows it."""
    surface, radius = weighed.surface, weighed.plan.size.radius
    border_radius = radius or surface.diagonal
    if not weighed.options.weights.has_other_unit:
        return BorderCosts(surface, lengths.values, lengths.unit, border_radius)
    weights = creases_of(surface, radius, ridges=0.0)  # weights in other units have no ridge costs
    if feature_costs is not None:
        weights = feature_costs.added(weights, surface, radius)
    return BorderCosts.of_weights(surface, weights, border_radius)


def finish(
    result: Segmentation, source: Cells, input_index: Ints | None, weighed: Weighed,
    planned: Planned, clock: Clock,
) -> Segmentation:  # fmt: skip
    """Restore the input order of cells, and add timings and parameters to the result."""
    result = weighed.plan.whole(result)
    if input_index is not None:  # input_index[i] is the input index of cell i
        labels = np.empty_like(result.labels)
        labels[input_index] = result.labels
        result = replace(result, labels=labels, centers=input_index[result.centers])
    timings = clock.timings | result.timings
    if "regions" in timings:
        timings["regions"] = timings.pop("regions")  # moved to the end: this stage runs last
    result = replace(
        result, sliver_share=planned.sliver_share, timings=timings,
        params=weighed.options.params(result), cells=source,
        vertex_groups=weighed.options.constraints.groups_of_vertices(source),
    )  # fmt: skip
    warn_of_islands(result, source)
    if (note := radius_note(result)) is not None:
        warnings.warn(note, RadiusWarning, stacklevel=5)
    return result
