"""Place the seeds of regions on a graph of cells, and run the clustering loop from these seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .. import _core
from .._core import OrderedGraph
from ..base.options import AnyInit, CountOptions, Islands, LoopOptions
from ..base.timing import Callback, timed
from ..base.types import Floats
from ..graph.cell_graph import CellGraph, checked_graph
from ..graph.constraints import ConstraintOptions
from ..weights.features import Features
from .balance import Balancer, shared_seeds
from .coarsening import Coarsening, coarsened
from .loop import Loop
from .plan import ArcLengths, Plan, Start
from .result import Segmentation
from .seeding import run_seeding


def segment_graph(
    graph: CellGraph, n_segments: int | None = None, *, radius: float | None = None,
    features: npt.ArrayLike | Features | None = None, init: AnyInit | Start | None = None,
    mask: npt.ArrayLike | None = None, barriers: npt.ArrayLike | None = None,
    islands: Islands = "keep", max_num_iter: int = 50, tol: float = 0.02,
    n_threads: int | None = None, callback: Callback | None = None,
) -> Segmentation:  # fmt: skip
    """Divide the cells of a graph into k compact regions.

    `segment` uses the same clustering for meshes and point clouds. This function accepts cells of
    any kind that have positions, measures (such as areas) and weighted arcs.

    Parameters
    ----------
    graph : CellGraph
    n_segments, radius, init, islands, max_num_iter, tol, n_threads, callback
        Same as in `segment`. If arcs are one-way, cells without a path from any center are treated
        like components without a seed.
    features, mask, barriers
        Same as in `segment`, with one row or number per cell, because the graph has neither
        vertices nor mesh edges.

    Returns
    -------
    Segmentation

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Examples
    --------
    >>> line = CellGraph([[x, 0, 0] for x in range(5)], [1] * 5, [0, 1, 3, 5, 7, 8],
    ...                  [1, 0, 2, 1, 3, 2, 4, 3], [1] * 8)
    >>> segment_graph(line, 2)
    Segmentation(5 cells, 2 regions, 1 iteration, converged)

    A graph with two components, a pair of cells and a single cell:

    >>> apart = CellGraph([[0, 0, 0], [1, 0, 0], [5, 0, 0]], [1, 1, 1], [0, 1, 2, 2], [1, 0],
    ...                   [1, 1])
    >>> segment_graph(apart, 1).labels, segment_graph(apart, 1, islands="nearest").labels
    (array([0, 0, 1], dtype=int32), array([0, 0, 0], dtype=int32))
    """
    checked_graph(graph)
    return segment_checked(
        graph, (CountOptions.checked(n_segments, radius, init), init),
        LoopOptions.checked(max_num_iter, tol, islands, n_threads, callback), Features.of(features),
        ConstraintOptions(mask, barriers),
    )  # fmt: skip


def segment_checked(
    graph: CellGraph, start: tuple[CountOptions, AnyInit | Start | None], loop: LoopOptions,
    features: Features, constraints: ConstraintOptions,
) -> Segmentation:  # fmt: skip
    """Return the result of `segment_graph` for checked options; `start` is as in `Plan.of`."""
    given = graph
    inside = constraints.kept_cells(graph, graph, weld=False, n_threads=loop.n_threads)
    plan = Plan.of(graph, inside, start, loop, dimension=graph.dimension)
    costs = features.costs(graph, graph.measures, loop.n_threads, constraints)
    if costs is not None:
        graph = replace(graph, weights=costs.added(graph.weights, graph, plan.size.radius))
    if plan.inside is None:
        ordered = graph.ordered(loop.n_threads)
    else:
        placed, arcs = plan.placed_cells(graph, graph.lengths, loop.n_threads)
        ordered = _core.OrderedGraph(placed, *arcs, loop.n_threads)
    timings: dict[str, float] = {}
    coarsening = coarsened(ordered, plan, loop, timings, [])
    result = plan.whole(segment_cells(ordered, coarsening, graph.bounds, plan, loop))
    params = {**result.params, **features.params, **constraints.params}
    return replace(result, timings=timings | result.timings, params=params, cells=given)


def segment_cells(
    graph: OrderedGraph, coarsening: Coarsening, bounds: Floats, plan: Plan, loop: LoopOptions,
    joining_arcs: ArcLengths | None = None, balancer: Balancer | None = None,
) -> Segmentation:  # fmt: skip
    """Place seeds and run the loop on a graph of the cells inside the mask, without checks.

    Coarse graphs are removed after their last use. Paths along far arcs and coarse cells skip
    cells, so regions may have loose pieces without a center. These pieces join other regions along
    `joining_arcs`, if possible along arcs shorter than ``graph.crease_limit``.
    """
    size, count, init = plan.size, plan.count_options, plan.init
    if init is None:
        init = "curve" if coarsening.is_short else "geodesic"
    timings: dict[str, float] = {}
    with timed(timings, "seeding", loop.report):
        coarse = coarsening.graphs
        first = coarse[-1].graph if coarse else graph
        seeds, paths = run_seeding(first, bounds, size, count, init, loop.islands, loop.n_threads)
        components = None
        if plan.is_divided and not plan.has_seeds:
            components = plan.components(coarse)
            seeds = shared_seeds(first, seeds, components, size.n_segments, loop)
            paths = None
        del first  # this reference would keep the graph in memory during the loop
    is_short = coarsening.is_short and loop.relocates  # research turns relocation off
    cycle = Loop(
        size.radius, loop, timings, balancer=balancer, components=components, is_short=is_short
    )
    labels, centers = cycle.run(coarsening, graph, seeds, paths)
    # There can be fewer centers than seeds, because the balancer may remove centers.
    n_placed = len(seeds) if components is None else min(len(seeds), size.n_segments)
    n_unreached = max(0, len(centers) - n_placed)
    if joining_arcs is not None and loop.radius_factor is None:
        with timed(timings, "classify"):
            labels = _core.join_loose_pieces(
                *joining_arcs, graph.crease_limit, labels, centers, loop.n_threads
            )
    if loop.islands == "nearest":
        with timed(timings, "classify"):
            labels, n_joined, more = _core.join_islands(graph, labels, plan.groups, loop.n_threads)
            centers, n_unreached = np.concatenate([centers, more]), n_joined + len(more)
    params = {
        "n_segments": None if count.radius is not None else size.n_segments, "radius": size.radius,
        "init": init if isinstance(init, str) else "given", **loop.params,
    }  # fmt: skip
    n_iter = sum(level.n_iter for level in cycle.levels)
    facts = (n_iter, cycle.stop_reason, timings, params, n_unreached)
    return Segmentation(labels, centers, *facts, levels=tuple(cycle.levels))
