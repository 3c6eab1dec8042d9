"""The function `segment`, which runs all stages of the segmentation of a mesh or a cloud."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy.typing as npt

from . import _core
from .base.checks import explains_parameters
from .base.options import Init, Islands, Progress
from .base.timing import Clock, OnStage
from .clustering.coarsening import coarsened
from .clustering.plan import Start
from .clustering.result import Segmentation
from .mesh.convert import MeshLike
from .mesh.denoising import Denoise
from .stages.cluster import clean, cluster, finish
from .stages.options import SegmentOptions
from .stages.part_costs import add_parts
from .stages.prepare import Prepared, plan_regions, prepare
from .stages.presets import OTHER_NAMES
from .stages.weigh import add_features, ordered_graph, place, round_weights, weigh
from .weights.features import FEATURE_WEIGHT
from .weights.formulas import WEIGHTS, WeightName, Weights


@explains_parameters(OTHER_NAMES)
def segment(
    mesh: MeshLike | Prepared,
    n_segments: int | None = None,
    *,
    alpha: float | None = None,
    features: npt.ArrayLike | str | Sequence[str] | None = None,
    denoise: Denoise = "auto",
    n_threads: int | None = None,
    radius: float | None = None,
    expected_radius: float | None = None,
    weights: WeightName | Weights = "parts",
    eta_convex: float | None = None,
    ridges: float | None = None,
    init: Init | Start | None = None,
    relocate: bool | None = None,
    smooth: bool = True,
    max_num_iter: int = 50,
    tol: float = 0.02,
    radius_factor: float | None = None,
    islands: Islands = "keep",
    min_size: float = 0.0,
    enforce_connectivity: bool = False,
    balance: float = 0.0,
    max_measure: float | None = None,
    min_measure: float | None = None,
    cell_weights: npt.ArrayLike | None = None,
    cells_per_region: int | None = None,
    mask: npt.ArrayLike | None = None,
    barriers: npt.ArrayLike | None = None,
    feature_weight: float = FEATURE_WEIGHT,
    scale_features: bool = True,
    weld: bool = True,
    progress: Progress | None = None,
    on_stage: OnStage | None = None,
) -> Segmentation:
    """Label every face of a mesh with one of k compact regions; borders follow concave creases.

    In a point cloud, every point gets a label; in a tetrahedral mesh, every tetrahedron. The page
    "Parameters" of the documentation explains each parameter in detail.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any mesh of triangles, polygons or tetrahedra. It may be open, non-manifold, degenerate or
        disconnected. A point cloud is a PointCloud, an (N, 3) array, or a file of points.
    n_segments : int, optional
        Number of regions k, from 1 to the number of faces N. The default is 150, or N if N < 150,
        unless seeds, a radius or `cells_per_region` are given.
    alpha : float, optional
        How strongly borders follow creases, >= 0. With 0, regions are most compact. The default
        depends on `weights`.
    features : array_like, shape (N, F) or (V, F), or str, or list of str, optional
        Data that borders follow in addition to creases: F numbers per face or per vertex, or names
        of features: ``"color"``, ``"texture"`` (see `texture_colors`), ``"texture_spread"``,
        ``"normals"``, ``"height"``, and all properties of faces or vertices in the file.
    denoise : int or "auto", default "auto"
        Number of smoothing steps before creases are measured. The input mesh is not changed.
        ``"auto"`` estimates the noise, and takes 0 steps if the mesh is smooth.
    n_threads : int, optional
        Number of threads. The default is ``SUPERFACETS_NUM_THREADS`` from the environment, or one
        thread per core. Labels do not depend on the number of threads.

    Other Parameters
    ----------------
    radius : float, optional
        Expected radius r of a region, as a fraction of the diagonal of the bounding box. If a cloud
        has a mask, this is the bounding box of the points inside the mask.
    expected_radius : float, optional
        Expected radius r of a region, in the unit of the vertices. Only one of `n_segments`,
        `radius` and `expected_radius` can be given.
    weights : str, or array_like of shape (M,)
        One weight per arc of `build_face_graph`, or the name of a formula:
    {weights}
    eta_convex, ridges : float, optional
        Costs of convex edges, relative to concave edges with the same angle. `ridges` is the cost
        of ridges: sharp convex edges between flat areas, as on machine parts. `eta_convex` is the
        cost of all other convex edges.
    init : {"geodesic", "curve", "farthest", "flood", "grid"}, array_like, or Segmentation, optional
        Seeding method; see `place_seeds`. The default is ``"geodesic"``. With the weights
        ``"parts"``, it is ``"curve"`` for 10,000 or more regions of fewer than 100 faces each.
        `init` may also be an array of seed faces, an array of one initial label per face, or an
        earlier result of `segment`.
    relocate : bool, optional
        Whether centers of small regions may move into large regions. The default is True for the
        weights ``"parts"``, unless seeds or `radius_factor` are given, and False for other weights.
    smooth : bool, default True
        Whether borders are straightened where the surface is smooth; see `smooth_borders`.
    max_num_iter, tol : int, float
        The loop stops when the root mean square of the moves of centers is at most `tol` * r, when
        the centers return to an earlier state, or after `max_num_iter` iterations. On large meshes,
        it runs on several levels of coarse cells, and these limits apply to each level.
    radius_factor : float, optional
        Distance from the center, in units of r, at which paths of a region end. By default, there
        is no limit. The paper uses 2.
    islands : {"keep", "nearest"}
        Whether each connected component without a seed becomes a region (``"keep"``) or joins the
        nearest region (``"nearest"``).
    min_size : float
        Regions with less than this fraction of the mean area are merged into a neighbor; see
        `merge_small_regions`.
    enforce_connectivity : bool
        Whether each region keeps only the connected piece that contains its center, and all other
        pieces join a neighbor; see `enforce_connectivity`. This has an effect only if
        `radius_factor` is given.
    balance : float
        How equal the areas (volumes) of regions become, from 0 (not balanced) to 1 (equal).
    max_measure, min_measure : float, optional
        Limits on the area (volume) of each region. If no regions can satisfy the limits, an error
        is raised.
    cell_weights : array_like of float, shape (N,), optional
        Sizes of cells, >= 0, that `balance`, `max_measure` and `min_measure` use instead of areas.
    cells_per_region : int, optional
        Exact number of cells in each region. It cannot be combined with `n_segments`. One region of
        each connected component may be smaller: it contains the remaining cells. See
        `Segmentation.patches`.
    mask : array_like of bool, shape (N,) or (V,), optional
        Faces where the mask is False are left out and get the label -1. In a cloud, points inside
        the mask are segmented as if the cloud had no other points. From values of vertices, a face
        gets the most frequent value of its corners.
    barriers : array_like of int, shape (N,), (V,) or (E, 2), optional
        Either one number per face or vertex, so that all faces of a region have the same number; or
        edges as pairs of vertices, so that no region extends across these edges.
    feature_weight, scale_features : float, bool
        `feature_weight` is the cost of a feature difference of 1, in units of r. If
        `scale_features` is True, each feature is first divided by its standard deviation.
    weld : bool
        Whether vertices at exactly the same position are treated as one vertex.
    progress : callable, optional
        Called after each iteration with the number of the iteration and the number of centers that
        moved. If it returns False, the loop stops with ``stop_reason="cancelled"``.
    on_stage : callable, optional
        Called with the name of each stage when the stage begins. An exception stops `segment`.

    Returns
    -------
    Segmentation
        Labels are int32 from 0 to K - 1, one per face in input order, and -1 where the mask is
        False. Labels are the same on every run. With ``islands="nearest"``, K equals k, but
        barriers can make K larger. With ``islands="keep"``, each component without a seed adds one
        region. With ``init="flood"``, ``init="grid"`` or `radius_factor`, K may differ more from k.
        `min_size` and `min_measure` can make K smaller than k.

    Warns
    -----
    BalanceWarning
        If some regions are disconnected, because of `cells_per_region`.
    FeatureWarning
        If a feature is the same for all cells, for example a texture of one color.
    RadiusWarning
        If regions of the given radius have fewer than four cells on average.
    SliverWarning
        If faces that are too long and thin for good regions cover more than a tenth of the area,
        or of the area inside `mask`, if it is given; see `subdivide`.
    IslandWarning
        If there are more regions than `n_segments`, because components have no seed, or fewer,
        because of `min_measure`. There is no warning if barriers are given and `n_segments` is 1,
        which is the way to get one region per component.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.
    OSError
        If a file cannot be read.

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
    options = SegmentOptions.checked(  # checks parameters before the mesh is read
        n_segments=n_segments, alpha=alpha, features=features, denoise=denoise,
        n_threads=n_threads, radius=radius, expected_radius=expected_radius, weights=weights,
        eta_convex=eta_convex, ridges=ridges, init=init, relocate=relocate, smooth=smooth,
        max_num_iter=max_num_iter, tol=tol, radius_factor=radius_factor, islands=islands,
        min_size=min_size, enforce_connectivity=enforce_connectivity, balance=balance,
        max_measure=max_measure, min_measure=min_measure, cell_weights=cell_weights,
        cells_per_region=cells_per_region, mask=mask, barriers=barriers,
        feature_weight=feature_weight, scale_features=scale_features, weld=weld,
        progress=progress, on_stage=on_stage,
    )  # fmt: skip
    with _core.Workspace():  # all stages share the threads of the workspace
        return _run(mesh, options)


def _list_of_weights() -> str:
    """Return text that lists all formulas for weights, for the docstring of `segment`."""
    items = []
    for name, weight in WEIGHTS.items():
        values = [f"{key} {value:g}" for key, value in weight.defaults.items() if key != "gamma"]
        text = f"- ``{name!r}``: {weight.about}. Defaults: {', '.join(values)}."
        items.append(textwrap.fill(text, 100, initial_indent=" " * 8, subsequent_indent=" " * 10))
    return "\n" + "\n".join(items) + "\n"


if segment.__doc__ is not None:  # python -OO removes docstrings
    segment.__doc__ = segment.__doc__.replace("{weights}", _list_of_weights())


def _run(mesh: MeshLike | Prepared, options: SegmentOptions) -> Segmentation:
    """Run all stages of `segment`.

    The comments give the number of each stage in docs/pipeline.md, if it has one, and its keys in
    `timings`. Coarse graphs are built before `add_parts`, because costs between parts are also
    added to them. Large arrays are deleted after their last use, to save memory. The `stacklevel`
    of warnings in stages refers to the caller of `segment`.
    """
    clock = Clock(options.loop.on_stage)
    prepared, options = prepare(mesh, options, clock)  # 0 mesh, 1 face_graph
    planned = plan_regions(prepared, options, clock)  # 1 face_graph
    weighed, weights = weigh(prepared, planned.plan, options, clock)  # 2 weights
    weights, steps = add_features(weights, weighed, prepared, clock)  # 2 weights
    graph, source, order = prepared.graph, prepared.source, prepared.order
    del mesh, prepared
    lengths = round_weights(weights, graph, weighed, clock)  # 2 weights
    del weights
    placed = place(graph, lengths, weighed, clock)  # order
    del graph
    ordered = ordered_graph(placed, lengths.unit, weighed, clock)  # order
    coarsening = coarsened(ordered, planned.plan, weighed.options.loop, clock.timings)  # coarsen
    part_costs = add_parts(ordered, coarsening, weighed, clock)  # 2 weights
    clustered = cluster(  # 3 seeding, 4a classify, 4b update, balance
        ordered, coarsening, placed.arcs, weighed, planned, part_costs
    )
    del ordered, coarsening, placed
    result = clean(clustered, lengths, steps, weighed, clock)  # 5 regions
    return finish(result, source, order, weighed, planned, clock)  # not timed
