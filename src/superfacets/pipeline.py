"""From a mesh to its superfacets: all stages in a row."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _core
from ._options import (
    INITS,
    CleanupOptions,
    Init,
    Islands,
    LoopOptions,
    Progress,
    SizeOptions,
    WeightName,
    WeightOptions,
    Weights,
)
from ._timing import OnStage, timed
from ._validate import checked_choice
from .adapters.clouds import CloudLike
from .adapters.convert import MeshLike, as_cells
from .cells.cell_graph import checked_weights
from .cells.constraints import ConstraintOptions
from .cells.features import FEATURE_WEIGHT, FeatureOptions, FeatureSteps
from .cells.kinds import Kind, kind_of
from .cells.slivers import EDGE_PER_RADIUS, sliver_note
from .cells.surface import Surface
from .cells.weights import creases_of
from .clustering.loop import segment_cells
from .clustering.parts import SMOOTH_DISTANCE, with_parts
from .clustering.plan import Plan
from .clustering.segmentation import Segmentation
from .clustering.warm_start import Start
from .errors import IslandWarning, SliverWarning
from .mesh.faces import AnyCells
from .regions.cleaning import clean
from .regions.edit import BorderCosts
from .regions.smooth import MAX_DISTANCE

__all__ = [
    "PAPER",
    "PARTS",
    "PreparedCells",
    "segment",
    "sliver_advice",
    "stages_in_order",
    "warn_of_islands",
]

PAPER: Mapping[str, Any] = MappingProxyType(
    {
        "weights": "superfacets",
        "init": "farthest",
        "radius_factor": 2.0,
        "tol": 0.0,
        "smooth": False,
    }
)
"""Keywords for the paper's algorithm exactly as published: ``segment(mesh, 150, **PAPER)``.

Weights are those of eq. 1-3, seeds are the farthest from each other in space, expansions halt at
2 r, the loop ends when no center changes, and borders are not smoothed.
"""

PARTS: Mapping[str, Any] = MappingProxyType({"weights": "parts", "relocate": True})
"""Keywords for regions that stay within the parts of a shape: ``segment(mesh, 150, **PARTS)``.

Weights know of parts, and centers relocate to where regions are large and uneven. On the benchmark
models borders that people drew are followed far better than by default, at the same compactness;
see the page on quality. It takes a tenth of a second longer on meshes of up to 100,000 faces, and
less than twice as long on a million.
"""


class PreparedCells(NamedTuple):
    """What `segment` makes of a mesh whatever its options are, so that it is made once.

    `segment` takes it in place of the mesh; `weld` then says nothing, and weights go by name. The
    labels are the same.
    """

    source: AnyCells
    kind: Kind
    graph: Any
    shapes: Any
    order: npt.NDArray[np.int32] | None  # numbers in the source; None: 0 to N - 1

    @classmethod
    def of(
        cls, source: AnyCells, *, weld: bool, n_threads: int, is_sorted: bool = True
    ) -> PreparedCells:
        """Find the graph of what `as_cells` returns: stage 1, by far the longest that is kept."""
        kind = kind_of(source)
        graph = kind.sorted_graph(source, n_threads) if is_sorted else None
        if graph is not None:
            return cls(source, kind, graph, None, graph.points)
        return cls(source, kind, *kind.build_graph(source, weld, n_threads), None)


def segment(
    mesh: MeshLike | CloudLike | PreparedCells,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    alpha: float | None = None,
    eta_convex: float | None = None,
    ridges: float | None = None,
    weights: WeightName | Weights = "creases",
    init: Init | Start = "geodesic",
    mask: npt.ArrayLike | None = None,
    barriers: npt.ArrayLike | None = None,
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    relocate: bool = False,
    enforce_connectivity: bool = False,
    min_size: float = 0.0,
    islands: Islands = "keep",
    smooth: bool = True,
    features: npt.ArrayLike | None = None,
    feature_weight: float = FEATURE_WEIGHT,
    scale_features: bool = True,
    weld: bool = True,
    n_threads: int | None = None,
    progress: Progress | None = None,
    on_stage: OnStage | None = None,
) -> Segmentation:
    """Label every face of a mesh with one of k compact regions that follow its concave creases.

    Of a point cloud, every point; see `build_point_graph` for its neighbors and areas.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any mesh of triangles or polygons: open, non-manifold, inconsistently oriented, degenerate,
        in many components, or soup. Or a point cloud: a PointCloud, an (N, 3) array, the path of a
        file without faces, or a cloud of trimesh, PyVista or Open3D.
    n_segments : int, optional
        Number of regions k, 1 to the number of faces. 150 (or the number of faces, if that is
        less) if neither this nor `radius` is given. The result has exactly k regions with
        ``islands="nearest"`` (about as many with ``init="flood"`` and ``"grid"``); otherwise one
        more for each component that gets no seed and, with
        `radius_factor`, for faces that no center reaches.
    radius : float, optional
        Expected radius r of a region instead, as a fraction of the diagonal of the bounding box.
    alpha : float, optional
        How much borders follow creases; 0 gives the most compact regions. >= 0, by default 20 with
        ``weights="creases"`` and 200 with ``"superfacets"``; 0 to 1, by default 0.5, with
        ``"stk02"``; 25 with ``"parts"``.
    eta_convex : float, optional
        Weight of convex creases (ridges) relative to concave ones (grooves), >= 0. By default 0
        with ``"creases"`` and ``"parts"``, 0.2 with ``"superfacets"``; not used with ``"stk02"``.
    ridges : float, optional
        Weight of sharp edges between flat faces, as machine parts have them, relative to concave
        ones, >= 0, by default 0.35: it replaces `eta_convex` there, where it is more. 0 turns it
        off. See `crease_weights` for which edges these are. Used with ``"creases"`` and ``"parts"``
        on triangles and polygons; points and tetrahedra have no such edges.
    weights : {"creases", "parts", "superfacets", "stk02"} or array_like, shape (M,)
        Arc weights by name. ``"creases"`` (`crease_weights`): a crease costs the same to cross at
        every resolution of the mesh. ``"parts"``: in addition, a step from one part of the shape
        to another, as from a finger to the palm, costs its distance in the `spectral_embedding`,
        which counts 2.4 times as much as the way along the surface; steps are longer where the
        body is thick, by the fourth root of the thickness (`shape_diameter`), so that thin parts
        get smaller regions. Cells without a thickness, as points, count as of mean thickness; and
        of a mesh with `mask` or `barriers`, parts are those of the whole.
        ``"superfacets"`` (`superfacet_weights`): those of the paper.
        ``"stk02"`` (`stk02_weights`): those that the paper compares with. Or one weight per arc of
        ``build_face_graph(mesh, weld=weld)``, in units of the diagonal of the bounding box;
        `alpha`, `eta_convex` and `ridges` are then not used.
    init : {"geodesic", "farthest", "flood", "grid"}, array_like of int, or Segmentation
        How seeds are placed, or the faces that are the seeds; see `place_seeds`. By default they
        are the farthest from each other by path length. ``"flood"`` and ``"grid"`` give k regions
        only approximately. A Segmentation of the same mesh: the run begins with its centers. One
        label per face, shape (N,): with the central face of each label 0..K-1, each at least once
        (-1 for faces of no label), or of what a mask leaves of it. An array of N different faces
        is one of seeds.
    mask : array_like of bool, shape (N,), optional
        Faces where it is False are left out: they get the label -1, no path leads through them, and
        they count for no area, so that k regions share the area of the others. What creases cost is
        measured on the whole mesh.
    barriers : array_like of int, shape (N,) or (E, 2), optional
        Borders that no region crosses, whatever else is asked for. One number per face: no region
        has faces of different numbers. Or edges of a mesh, as pairs of vertices: no path leads
        across these edges, and a region has faces on both sides only where it leads around their
        ends. There are then more components; if k is less than their number, those that get no
        seed become regions as with ``islands="keep"``. With ``"nearest"`` they join the nearest
        region of the same number, if there is one; a part of a component that edges cut in several
        joins none, and is a region of its own.
    radius_factor : float, optional
        If not given, each face belongs to the center with the shortest path to it, and regions
        are connected. If given, expansions halt at this many r from their center (2 in the paper),
        and regions may be disconnected.
    max_num_iter : int, default 50
        Maximum number of iterations, on each level. With 0, faces are labeled by the first centers,
        which do not move. Each labels all faces once, or all coarse
        cells: where regions have about a hundred faces or more, the loop runs on connected groups
        of 4 to 16 faces (on groups of those where they have thousands), and all faces are labeled
        once after it. It does not with given seeds, `radius_factor`, ``tol=0``,
        ``max_num_iter`` 0 or 1, and weights that are not the same both ways.
    tol : float, default 0.02
        Stop when the root mean square of the centers' moves is at most this fraction of r. With 0,
        stop when no center changes, as in the paper; all iterations are then on all faces.
    relocate : bool, default False
        When the loop has ended on its first level, let centers of regions that are hardly needed
        jump to where regions are large and uneven, and iterate again (up to 8 times), in up to four
        rounds. A region is hardly needed if its faces are as near to the next center as to their
        own; both are measured by path length. The number of regions stays, and a component keeps a
        center if it has one. Given seeds may move, too. Not with `radius_factor`.
    enforce_connectivity : bool, default False
        If regions are disconnected (with `radius_factor`), each keeps the piece with its center,
        and its other pieces join a neighbor; see `enforce_connectivity`.
    min_size : float, default 0.0
        Regions smaller than this fraction of the mean region area join a neighbor, after which
        there are fewer than k; see `merge_small_regions`.
    islands : {"keep", "nearest"}
        What to do with components without a seed, with faces that no center reaches and, with
        `min_size`, with small regions that have no neighbor. ``"keep"``: they are regions of their
        own, in addition to the k asked for. ``"nearest"``: each joins the region with the face
        nearest (Euclidean, by centroids) to any of its faces, among equals that with the lowest
        index (of a cloud the first along a space-filling curve); there are then exactly k regions,
        which may extend over several components. A component gets a seed if it has at least half of
        the area expected of a region, A / k, or if all larger components together have fewer than k
        faces; at most the k largest do. (With ``"keep"``, ``"farthest"`` and ``"flood"`` place
        seeds in islands, too. ``"grid"`` and given seeds do not follow this rule.)
    smooth : bool, default True
        Make borders straight where the surface is smooth; see `smooth_borders`. Centers stay in
        their regions, and connected regions stay connected.
    features : array_like, shape (N, F) or (V, F), optional
        Numbers that borders are to follow, such as colors: F of each face or point, or of each
        vertex (faces then have the mean of their corners). Finite. Crossing from one cell to the
        next costs more where they differ.
    feature_weight : float, default 5.0
        How much, >= 0. The distance of the features of two cells, times this, is added to the
        length of the step between them, in expected radii r, so that it means the same at every
        resolution. With 0, features change nothing.
    scale_features : bool, default True
        Divide each feature by its standard deviation over the area first.
    weld : bool, default True
        Treat vertices at exactly the same position as one.
    n_threads : int, optional
        Number of threads. By default the environment variable ``SUPERFACETS_NUM_THREADS``, or one
        per core. The labels do not depend on it. (The checks of a new mesh or graph use the default
        in any case.)
    progress : callable, optional
        Called after each iteration, on coarse cells or on faces, with its number (from 1) and how
        many centers it moved;
        if it returns False, the loop ends with ``stop_reason="cancelled"``.
    on_stage : callable, optional
        Called with the name of each stage when it begins: ``"mesh"``, ``"face_graph"``,
        ``"weights"``, ``"order"``, ``"coarsen"`` (not with options that rule it out, see
        `max_num_iter`), ``"seeding"``, ``"classify"`` (once, for the whole loop), and ``"regions"``
        if regions are cleaned up. An exception that it raises ends the run.

    Returns
    -------
    Segmentation
        Labels are int32, 0..K-1, one per face in the order of the input, and the same each time;
        -1 where the mask is False.

    Warns
    -----
    SliverWarning
        If more than a tenth of the area is in faces so long and thin that regions become stripes,
        as in CAD meshes; see `subdivide`. ``sliver_share`` of the result is that share.
    IslandWarning
        If there are more regions than `n_segments`, for components that got no seed.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014.

    Examples
    --------
    >>> import superfacets
    >>> mesh = superfacets.sample_mesh(5_000)
    >>> segmentation = superfacets.segment(mesh, 20)
    >>> segmentation.n_segments, segmentation.labels.dtype, int(segmentation.labels.max())
    (20, dtype('int32'), 19)
    """
    # Wrong parameters are found before the mesh is read.
    size = SizeOptions.checked(n_segments, radius, init)
    if isinstance(init, str):
        checked_choice(init, "init", INITS)
    loop = LoopOptions.checked(
        max_num_iter, tol, radius_factor, islands, n_threads, progress, on_stage,
        relocate=relocate,
    )  # fmt: skip
    options = _Options(
        weld,
        init,
        size,
        WeightOptions.checked(weights, alpha, eta_convex, ridges),
        FeatureOptions.checked(features, feature_weight, scale_features),
        loop,
        CleanupOptions.checked(smooth, enforce_connectivity, min_size, islands),
        ConstraintOptions(mask, barriers),
    )
    with _core.Workspace():  # threads for all that follows
        return _run(mesh, options)


@dataclass(frozen=True)
class _Options:
    """The checked options of all stages."""

    weld: bool
    init: Init | Start
    size: SizeOptions
    weights: WeightOptions
    features: FeatureOptions
    loop: LoopOptions
    cleanup: CleanupOptions
    constraints: ConstraintOptions

    @property
    def params(self) -> dict[str, Any]:
        """As they are reported, but for those that `segment_cells` reports."""
        return {
            "weld": self.weld,
            **self.weights.params,
            **self.features.params,
            **self.constraints.params,
        }


def _run(mesh: MeshLike | CloudLike | PreparedCells, options: _Options) -> Segmentation:
    """Run all stages; the caller of `segment` is warned."""
    timings: dict[str, float] = {}
    cells, surface, plan, share, ordered, lengths, unit, steps = _build_cells(
        mesh, options, timings
    )
    radius = plan.size.radius
    note = sliver_note(share, sliver_advice(radius))
    if note is not None:
        warnings.warn(note, SliverWarning, stacklevel=3)
    result = segment_cells(ordered, surface.bounds, plan, options.loop)
    warn_of_islands(result)
    del ordered  # makes room
    if options.cleanup.is_needed:
        with timed(timings, "regions", options.loop.on_stage):
            costs = _border_costs(surface, radius, options.weights, steps, lengths, unit)
            del lengths  # makes room
            costs = costs if plan.cut is None else costs.of_part(plan.cut)
            reach = SMOOTH_DISTANCE if options.weights.are_parts else MAX_DISTANCE
            result = clean(costs, result, options.cleanup, plan.groups, reach)
    result = plan.whole(result)
    if surface.order is not None:
        result = _in_input_order(result, surface.order)
    params = {**options.params, **result.params, **options.cleanup.params}
    timings = stages_in_order(timings | result.timings)
    return replace(result, sliver_share=share, timings=timings, params=params, cells=cells)


def _in_input_order(result: Segmentation, order: npt.NDArray[np.int32]) -> Segmentation:
    """The result for cells in the order of the input, of which `order` holds the numbers."""
    labels = np.empty_like(result.labels)
    labels[order] = result.labels
    return replace(result, labels=labels, centers=order[result.centers])


def sliver_advice(radius: float) -> str:
    """What to call instead, for regions of this radius."""
    max_edge = EDGE_PER_RADIUS * radius
    return f"segment superfacets.subdivide(mesh, max_edge={max_edge:.3g}).mesh instead"


def _prepared(
    mesh: MeshLike | CloudLike | PreparedCells, options: _Options, timings: dict[str, float]
) -> PreparedCells:
    """Run stages 0 and 1, or take what they have given before."""
    loop, is_given = options.loop, options.weights.given is not None
    if isinstance(mesh, PreparedCells):
        if is_given and mesh.order is not None:
            raise ValueError("the cells are prepared in an order of their own: name the weights")
        return mesh
    with timed(timings, "mesh", loop.on_stage):
        source = as_cells(mesh)
    with timed(timings, "face_graph", loop.on_stage):
        # Given weights are numbered as the arcs of the graph that is not sorted.
        return PreparedCells.of(
            source, weld=options.weld, n_threads=loop.n_threads, is_sorted=not is_given
        )


def _build_cells(
    mesh: MeshLike | CloudLike | PreparedCells, options: _Options, timings: dict[str, float]
) -> tuple[
    AnyCells, Surface, Plan, float, _core.OrderedGraph, npt.NDArray[np.float32], float,
    FeatureSteps | None,
]:  # fmt: skip
    """Run stages 0 to 2, order the cells, and return what later stages need, and no more.

    That is the mesh; its faces as cells, all of them; which are left, and the size of regions; the
    share of slivers, the cells that are left as stages 3 and 4 take them, the weights of all as
    paths are measured by them, with their unit, and the features.
    """
    n_threads, on_stage = options.loop.n_threads, options.loop.on_stage
    source, kind, graph, shapes, order = _prepared(mesh, options, timings)
    with timed(timings, "face_graph"):
        plan = Plan.of(
            source, graph, (options.size, options.init), options.constraints, n_threads,
            kind.dimension, weld=options.weld, order=order,
        )  # fmt: skip
        radius = plan.size.radius
        share = kind.sliver_share(source, graph, shapes, radius, n_threads)
    with timed(timings, "weights", on_stage):
        surface = kind.surface(source, graph, n_threads)
        weights = kind.weights(surface, graph, shapes, radius, options.weights)
        del shapes  # makes room
        placed = None
        if options.weights.are_parts:
            weights, placed = with_parts(source, graph, surface, weights, radius, options.weights)
        if not options.weights.has_other_unit:
            surface = kind.bare_surface(surface, source, graph, n_threads)
        steps = options.features.steps(source, graph.measures, n_threads, surface.order)
        if steps is not None:
            checked = checked_weights(weights, surface.n_arcs, n_threads)
            weights = steps.added(checked, surface.arcs, radius / graph.diagonal)
        lengths, unit = graph.quantized(weights, n_threads)
        del weights  # makes room
    with timed(timings, "order", on_stage):
        placed, arcs = plan.placed_cells(graph, lengths, n_threads, placed)
        del graph  # a surface works centroids and areas out when asked for
        is_symmetric = options.weights.given is None  # by the formulas
        ordered = _core.OrderedGraph(placed, *arcs, n_threads, is_symmetric)
        return source, surface, plan, share, ordered, lengths, unit, steps


def _border_costs(
    surface: Surface,
    radius: float,
    options: WeightOptions,
    steps: FeatureSteps | None,
    lengths: npt.NDArray[np.float32],
    unit: float,
) -> BorderCosts:
    """What borders cost: by the weights that paths were measured by, if these are of that kind."""
    scale = radius or surface.diagonal
    if not options.has_other_unit:
        return BorderCosts(surface, lengths, unit, scale)
    # Others have other units, or other prices at other resolutions.
    prices = creases_of(surface, radius, ridges=0.0)  # which these weights do not know
    if steps is not None:
        prices = steps.added(prices, surface.arcs, radius / surface.diagonal)
    return BorderCosts.of_weights(surface, prices, scale)


def warn_of_islands(result: Segmentation, stacklevel: int = 4) -> None:
    """Say where there are more regions than asked for; in the halted mode that is usual."""
    params = result.params
    asked = params["n_segments"]  # None: a radius was asked for
    if asked is None or params["init"] == "given" or params["radius_factor"] is not None:
        return
    n_more = result.n_segments - asked
    if params["islands"] == "keep" and result.n_unreached:
        note = (
            f"{result.n_unreached} components of the mesh got no seed; islands='nearest' lets them"
            " join the nearest region"
        )
    elif params["islands"] == "nearest" and n_more > 0 and params["init"] not in ("flood", "grid"):
        note = f"{n_more} between barriers got no seed, and may join no other"
    else:
        return
    message = f"{result.n_segments} regions in place of {asked}: {note}"
    warnings.warn(message, IslandWarning, stacklevel=stacklevel)


def stages_in_order(timings: dict[str, float]) -> dict[str, float]:
    """The stages in the order in which they run."""
    last = {"regions": timings.pop("regions")} if "regions" in timings else {}
    return timings | last
