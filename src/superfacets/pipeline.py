"""The function `segment`, which runs all stages of the segmentation of a mesh or a cloud."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy.typing as npt

from . import _core
from .base.checks import explains_parameters
from .base.options import Init, Islands, Sizes
from .base.timing import Callback, Clock
from .clustering.coarsening import coarsened
from .clustering.plan import Start
from .clustering.result import Segmentation
from .mesh.convert import MeshLike
from .mesh.denoising import Denoise
from .stages.borders import add_borders, grouped_for_borders
from .stages.cluster import clean, cluster, finish
from .stages.options import SegmentOptions
from .stages.part_costs import add_parts
from .stages.prepare import Prepared, plan_regions, prepared_for
from .stages.presets import OTHER_NAMES
from .stages.weigh import add_features, ordered_graph, place, round_weights, weigh
from .weights.features import Features
from .weights.formulas import WEIGHTS, ArcValues, WeightName, Weights


@explains_parameters(OTHER_NAMES)
def segment(
    mesh: MeshLike | Prepared, n_segments: int | None = None, *, radius: float | None = None,
    weights: WeightName | Weights | ArcValues = "parts", alpha: float | None = None,
    features: npt.ArrayLike | str | Sequence[str] | Features | None = None,
    init: Init | Start | None = None, mask: npt.ArrayLike | None = None,
    barriers: npt.ArrayLike | None = None, sizes: Sizes | None = None, islands: Islands = "keep",
    smooth: bool = True, denoise: Denoise = "auto", max_num_iter: int = 50, tol: float = 0.02,
    n_threads: int | None = None, callback: Callback | None = None,
) -> Segmentation:  # fmt: skip
    """Label every face of a mesh with one of k compact regions; borders follow concave creases.

    In point clouds, points get labels; in tetrahedral meshes, tetrahedra.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any mesh of triangles, polygons or tetrahedra, or a cloud: a PointCloud, an (N, 3) array, or
        a file of points. For several calls with the same mesh, pass the result of `prepare`.
    n_segments : int, optional
        Number of regions k, from 1 to the number of faces N. The default is 150, or N if N < 150,
        unless seeds, a radius or ``Sizes(cells=...)`` are given.
    radius : float, optional
        Expected radius r of a region, in the unit of the vertices, instead of `n_segments`.
    weights : str, Weights, or array_like of shape (M,)
        How borders are drawn: the name of a formula, `Weights` with parameters of a formula, or one
        weight per arc of `build_face_graph`.
    {weights}
    alpha : float, optional
        How strongly borders follow creases, >= 0. With 0, regions are most compact. The default
        depends on `weights`.
    features : array_like, shape (N, F) or (V, F), or str, or list of str, or Features, optional
        Data that borders follow, too: F numbers per face or vertex, or names: ``"color"``,
        ``"texture"`` (see `texture_colors`), ``"texture_spread"``, ``"normals"``, ``"height"``, or
        properties of faces or vertices in the file. `Features` also sets their weight.
    init : {"geodesic", "curve", "farthest"}, array_like, or Segmentation, optional
        Seeding method (see `place_seeds`), seed faces, one initial label per face, or an earlier
        result. The default is ``"geodesic"``; with the weights ``"parts"``, it is ``"curve"`` for
        10,000 or more regions of fewer than 100 faces each.
    mask : array_like of bool, shape (N,) or (V,), optional
        Faces where the mask is False are left out and get the label -1. With a value per vertex, a
        face gets the most frequent value of its corners.
    barriers : array_like of int, shape (N,), (V,) or (E, 2), optional
        Either one number per face or vertex, so that all faces of a region have the same number; or
        edges as pairs of vertices, so that no region extends across these edges.
    sizes : Sizes, optional
        Balances or limits the areas of regions, or sets their number of cells.
    islands : {"keep", "nearest"}
        Whether each connected component without a seed becomes a region (``"keep"``) or joins the
        nearest region (``"nearest"``).
    smooth : bool, default True
        Whether borders are straightened where the surface is smooth; see `smooth_borders`.
    denoise : int, "auto" or "scan", default "auto"
        Smoothing steps before creases are measured. Words choose it by noise, "scan" at least 5.
    max_num_iter, tol : int, float
        The loop stops when the root mean square of the moves of centers is at most `tol` * r, when
        centers return to an earlier state, or after `max_num_iter` iterations on each level.
    n_threads : int, optional
        Number of threads. The default is ``SUPERFACETS_NUM_THREADS`` from the environment, or one
        thread per core. Labels do not depend on the number of threads.
    callback : callable, optional
        Called with (stage, n_iter, n_moved) when a stage begins, with two zeros, and after each
        iteration of the loop. If it returns False, the loop stops: `stop_reason` is "cancelled".

    Returns
    -------
    Segmentation
        Labels are int32 from 0 to K - 1, one per face in input order. They are the same on every
        run. K equals k, plus one region for each component without a seed (if ``islands="keep"``)
        and regions that barriers add, minus regions that a lower bound on sizes removes.

    Warns
    -----
    BalanceWarning, FeatureWarning, IslandWarning, RadiusWarning, SliverWarning
        If sizes cannot be equal, or regions are disconnected because of ``Sizes(cells=...)``; if a
        feature is constant; if there are more or fewer regions than `n_segments` or, with `radius`,
        most have no seed; if regions have under 4 cells on average; or if faces are long and thin.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError, OSError
        If a parameter is out of range or of the wrong type, or if a file cannot be read.

    Examples
    --------
    >>> import superfacets
    >>> mesh = superfacets.sample_mesh(5_000)
    >>> segmentation = superfacets.segment(mesh, 20)
    >>> segmentation.n_segments, segmentation.labels.dtype, int(segmentation.labels.max())
    (20, dtype('int32'), 19)
    """
    options = SegmentOptions.checked(  # checks parameters before the mesh is read
        n_segments=n_segments, radius=radius, weights=weights, alpha=alpha, features=features,
        init=init, mask=mask, barriers=barriers, sizes=sizes, islands=islands, smooth=smooth,
        denoise=denoise, max_num_iter=max_num_iter, tol=tol, n_threads=n_threads, callback=callback,
    )  # fmt: skip
    return run(mesh, options)


def run(mesh: MeshLike | Prepared, options: SegmentOptions) -> Segmentation:
    """Run all stages of `segment`. They share the threads of one workspace.

    The comments give the number of each stage in docs/pipeline.md, if it has one, and its keys in
    `timings`. `add_borders` stands before `coarsened`, so that coarse graphs have its costs, too;
    `add_parts` adds its costs to each graph. Large arrays are deleted after use, to save memory.
    `stacklevel` in stages refers to the caller of `segment` or `paper.segment`.
    """
    clock = Clock(options.loop.report)
    with _core.Workspace():
        prepared, options = prepared_for(mesh, options, clock)  # 0 mesh, 1 face_graph
        planned = plan_regions(prepared, options, clock)  # 1 face_graph
        weighed, weights = weigh(prepared, planned.plan, options, clock)  # 2 weights
        # From here on, `weighed.options` replaces `options`.
        weights, feature_costs = add_features(weights, weighed, prepared, clock)  # 2 weights
        graph, source, input_index = prepared.graph, prepared.source, prepared.input_index
        kind = prepared.kind
        lengths = round_weights(weights, graph, weighed, clock)  # 2 weights
        del mesh, weights, prepared
        placed = place(graph, lengths, weighed, clock)  # order
        ordered = ordered_graph(placed, lengths.unit, weighed, clock)  # order
        grouped = grouped_for_borders(ordered, kind, graph, weighed, clock)  # coarsen, 2 weights
        del graph
        arcs = placed.arcs
        add_borders(ordered, grouped, arcs, lengths, weighed, clock)  # 2 weights
        loop, begun = weighed.options.loop, [*grouped.begun]  # `coarsened` appends to this copy
        del placed, grouped
        coarsening = coarsened(ordered, weighed.plan, loop, clock.timings, begun)  # coarsen
        part_costs = add_parts(ordered, coarsening, weighed, clock)  # 2 weights
        clustered = cluster(  # 3 seeding, 4a classify, 4b update, balance
            ordered, coarsening, arcs, weighed, planned, part_costs
        )
        del ordered, coarsening, arcs
        result = clean(clustered, lengths, feature_costs, weighed, clock)  # 5 regions
        return finish(result, source, input_index, weighed, planned, clock)  # not timed


def _list_of_weights() -> str:
    """Return text that lists all formulas for weights, for the docstring of `segment`."""
    items = []
    for name, weight in WEIGHTS.items():
        values = [f"{key} {value:g}" for key, value in weight.defaults.items() if key != "gamma"]
        defaults = f" Defaults: {', '.join(values)}." if values else ""
        text = f"- ``{name!r}``: {weight.about}.{defaults}"
        items.append(textwrap.fill(text, 100, initial_indent=" " * 8, subsequent_indent=" " * 10))
    return "\n" + "\n".join(items) + "\n"


if segment.__doc__ is not None:  # python -OO removes docstrings
    segment.__doc__ = segment.__doc__.replace("{weights}", _list_of_weights())
