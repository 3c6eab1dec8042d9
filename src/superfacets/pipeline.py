"""The function `segment`, which runs all stages of the segmentation of a mesh or a cloud."""

from __future__ import annotations

import os
import textwrap
import warnings
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from types import MappingProxyType, SimpleNamespace
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from . import _core
from .base.checks import checked_choice, counted, explains_parameters
from .base.errors import BalanceWarning, IslandWarning, MeshError, RadiusWarning, SliverWarning
from .base.options import (
    INITS,
    BalanceOptions,
    CleanupOptions,
    Init,
    Islands,
    LoopOptions,
    Progress,
    SizeOptions,
)
from .base.timing import OnStage, timed
from .base.types import Bools, Floats, Ints
from .cleanup.connect import connect_regions
from .cleanup.edit import BorderCosts
from .cleanup.merge import merge_regions
from .cleanup.region_sizes import Goals, settle
from .cleanup.smooth import OF_PARTS, SmoothOptions, straighten
from .clustering.balance import Balancer, SizeRules
from .clustering.coarsening import coarsened, has_small_regions
from .clustering.plan import Plan, Start
from .clustering.result import Segmentation
from .clustering.run import joiner_of, segment_cells
from .files.named_features import features_of
from .files.readers.read import read_cells_and_attributes
from .graph.cell_graph import checked_weights
from .graph.constraints import ConstraintOptions
from .graph.kinds import Kind, OrderedCells, kind_of
from .graph.size import EDGE_PER_RADIUS, RegionSize, sliver_note
from .mesh.base import Cells
from .mesh.convert import CloudLike, MeshLike, as_cells
from .mesh.denoising import (
    STEPS_WITH_SLACK,
    Denoise,
    Roughness,
    checked_denoise,
    slack_of,
    smoothed,
)
from .mesh.faces import FaceMesh
from .weights.features import FEATURE_WEIGHT, FeatureOptions, FeatureSteps
from .weights.formulas import WEIGHTS, WeightName, WeightOptions, Weights, creases_of
from .weights.parts import (
    FAR_STEPS,
    PART_CREASE_SCALE,
    SHORT_STEPS,
    UNIT_FACTOR,
    PartCosts,
    groups_to_embed,
)

PAPER: Mapping[str, Any] = MappingProxyType(
    {
        "weights": "superfacets",
        "init": "farthest",
        "radius_factor": 2.0,
        "tol": 0.0,
        "smooth": False,
        "denoise": 0,
    }
)
"""Keywords for the algorithm as published in the paper: ``segment(mesh, 150, **PAPER)``. Weights
are computed with equations 1 to 3 of the paper, and seeds are placed by farthest-point sampling.
Paths end at 2 r from the center, where r is the expected radius of a region. The loop stops when no
center moves, when the centers return to an earlier state, or after 50 iterations. Neither the mesh
nor the borders are smoothed."""

PARTS: Mapping[str, Any] = MappingProxyType({"weights": "parts", "relocate": True})
"""Keywords for regions that each stay within one part of a shape, such as a finger of a hand. They
are the defaults of `segment`."""

SCANS: Mapping[str, Any] = MappingProxyType({"denoise": 5, "alpha": 80.0})
"""Keywords for room scans that were fused from depth images: ``segment(mesh, 1000, **SCANS)``.
Noise is smoothed before creases are measured, and an `alpha` above the default makes borders follow
creases more closely."""

OTHER_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "compactness": "use alpha: with higher values, borders follow creases more; 0 gives the"
        " roundest regions",
        "sigma": "use denoise: steps of smoothing before creases are measured",
        "spacing": "scale the vertices instead; lengths are in the unit of the mesh",
        "convert2lab": "use features='color'",
        "channel_axis": "use features, an array with one row of numbers per face",
        "min_size_factor": "use min_size: a fraction of the mean area of regions",
        "start_label": "labels always start at 0",
        "max_iter": "use max_num_iter",
        "num_threads": "use n_threads",
        "n_jobs": "use n_threads",
        "k": "use n_segments",
        "n_superpoints": "use n_segments",
        "kThresh": "use n_segments, or superfacets.segmentator, which takes kThresh",
        "segMinVerts": "use min_size: a fraction of the mean area of regions",
        "voxel_size": "use expected_radius: the radius of a region in the unit of the file",
        "seed_resolution": "use expected_radius: the radius of a region in the unit of the file",
        "scans": "use **superfacets.SCANS",
        "n_clusters": "use n_segments",
        # Not "use": the command would then suggest its option --barriers, which takes a file.
        "barrier_angle": "pass barriers=superfacets.sharp_edges(mesh, 30)",
        "seed": "labels are the same on every run; init accepts the faces to start from",
    }
)
"""Advice for users of scikit-image's ``slic`` and of other tools, keyed by parameters that
`segment` does not have."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A mesh or cloud and the graph of its cells, prepared once for several calls of `segment`.

    `segment` accepts a `Prepared` in place of the mesh and returns the same labels. In this case,
    `weld` has no effect, `denoise` must be ``"auto"`` or `n_steps`, and `features` must be numbers.
    If the cells are sorted (`order` is not None), arrays of weights are not accepted, and
    `radius_factor` only for points. `cells`, `graph`, `shapes` and `order` have the same meaning as
    in `OrderedCells`.
    """

    source: Cells  # mesh or cloud given by the caller, in the order of the caller
    denoised: Cells  # smoothed copy of `source`, or `source` itself if it was not smoothed
    n_steps: int | None  # number of smoothing steps; None if cells are not faces
    slack: float  # radians that are subtracted from the angle of each edge, see `slack_of`
    kind: Kind
    cells: Any
    graph: Any
    shapes: Any
    order: Ints | None

    @classmethod
    def of(
        cls, source: Cells, *, weld: bool, n_threads: int, is_sorted: bool = True,
        denoise: Denoise = "auto", is_kept: Bools | None = None,
    ) -> Prepared:  # fmt: skip
        """Smooth a mesh as `denoise` requires, and build the graph of the mesh or cloud.

        Cells are sorted if `is_sorted` is true and sorting saves time. `is_kept` is the same as in
        `graph_and_surface`. Raises a ValueError if `denoise` is a number of steps > 0 and the cells
        are not faces.
        """
        kind = kind_of(source)

        def ordered(cells: Cells, weld: bool) -> OrderedCells:
            found = None
            if is_kept is not None:
                found = kind.kept_graph(cells, is_kept, n_threads, is_sorted=is_sorted)
            elif is_sorted:
                found = kind.sorted_graph(cells, weld, n_threads)
            if found is None:
                found = OrderedCells(cells, *kind.build_graph(cells, weld, n_threads), None)
            return found

        def smoothed_in(n_steps: int) -> tuple[Cells, OrderedCells]:
            denoised = smoothed(cast(FaceMesh, source), n_steps, weld=weld, n_threads=n_threads)
            return denoised, ordered(denoised, False)

        if not kind.has_faces:
            if denoise not in (None, 0, "auto"):
                raise ValueError(
                    f"denoise needs a mesh of faces, got {kind.plural}: leave denoise out"
                )
            return cls(source, source, None, 0.0, kind, *ordered(source, weld))
        is_auto, slack = denoise == "auto", 0.0
        n_steps = 0 if is_auto else int(denoise or 0)
        denoised, made = smoothed_in(n_steps) if n_steps else (source, ordered(source, weld))
        if is_auto or n_steps >= STEPS_WITH_SLACK:
            roughness = Roughness.of_mesh(made.cells, made.graph, made.order, n_threads)
            if is_auto and roughness.n_steps > 0:
                n_steps = roughness.n_steps
                denoised, made = smoothed_in(n_steps)
            slack = slack_of(n_steps, is_regular=roughness.is_regular)
        return cls(source, denoised, n_steps, slack, kind, *made)

    def given_measures(self, n_threads: int) -> Floats:
        """Return the areas or volumes of the cells before the mesh was smoothed, (N,)."""
        if not self.n_steps:
            return np.asarray(self.graph.measures)
        measures = self.kind.measures(self.source, n_threads)
        return measures if self.order is None else measures[self.order]


@explains_parameters(OTHER_NAMES)
def segment(
    mesh: MeshLike | CloudLike | Prepared,
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
    options = Options.checked(locals())  # checks parameters before the mesh is read
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


@dataclass(frozen=True)
class Options:
    """Checked arguments of `segment`, grouped by stage."""

    weld: bool
    init: Init | Start | None
    size: SizeOptions
    weights: WeightOptions
    loop: LoopOptions
    cleanup: CleanupOptions
    features: FeatureOptions = field(default_factory=FeatureOptions)
    constraints: ConstraintOptions = field(default_factory=ConstraintOptions)
    denoise: Denoise = "auto"  # argument of `segment`; after `smoothed`, the number of steps made
    balance: BalanceOptions = field(default_factory=BalanceOptions)

    @classmethod
    def checked(cls, arguments: Mapping[str, Any]) -> Options:
        """Check the arguments of `segment`, which are keyed by name, and return them as options."""
        given = SimpleNamespace(**arguments)
        size = SizeOptions.checked(
            given.n_segments, given.radius, given.expected_radius, given.init
        )
        if isinstance(given.init, str):
            checked_choice(given.init, "init", INITS)
        loop = LoopOptions.checked(
            given.max_num_iter, given.tol, given.radius_factor, given.islands, given.n_threads,
            given.progress, given.on_stage, relocate=given.relocate,
        )  # fmt: skip
        bounds = (given.min_measure, given.max_measure)
        sizes = BalanceOptions.checked(
            given.balance, bounds, given.cells_per_region, given.cell_weights
        )
        sizes.check_with(size, loop, given.min_size)
        return cls(
            given.weld, given.init, size,
            WeightOptions.checked(given.weights, given.alpha, given.eta_convex, given.ridges), loop,
            CleanupOptions.checked(
                given.smooth, given.enforce_connectivity, given.min_size, given.islands
            ),
            FeatureOptions.checked(given.features, given.feature_weight, given.scale_features),
            ConstraintOptions(given.mask, given.barriers), checked_denoise(given.denoise), sizes,
        )  # fmt: skip

    def smoothed(self, n_steps: int | None, slack: float) -> Options:
        """Return options for a mesh after `n_steps` smoothing steps; see `Prepared` for `slack`."""
        return replace(self, denoise=n_steps, weights=replace(self.weights, slack=slack))

    def needs_order(self, kind: Kind) -> bool:
        """Return whether cells must keep their input order, even if sorted cells would be faster.

        This is the case if the caller gave weights, which are in input order. It is also the case
        if `radius_factor` is given, except for points: then the lowest face that no center reaches
        becomes a center, so labels depend on the order.
        """
        is_halted = self.loop.radius_factor is not None and not kind.are_points
        return is_halted or self.weights.given is not None

    def params(self, result: Segmentation) -> dict[str, Any]:
        """Return `Segmentation.params`: these options, and the loop parameters in `result`."""
        return {
            "weld": self.weld,
            "denoise": self.denoise,
            **self.weights.params,
            **self.features.params,
            **self.constraints.params,
            **result.params,
            **self.cleanup.params,
            **self.balance.params,
        }


@dataclass(frozen=True, eq=False)
class _Work:
    """Data that each stage passes to the next stage.

    Most fields are None until a stage sets them. The last stage that needs a large array sets the
    field to None again, which frees the memory.
    """

    options: Options
    mesh: Any  # argument of `segment`; None after the first stage
    prepared: Any = None  # a `Prepared` object
    source: Any = None  # mesh or cloud in input order
    order: Any = None  # (N,) input index of each sorted cell; None if cells are in input order
    plan: Any = None  # a `Plan` object
    sizes: SizeRules | None = None
    balancer: Balancer | None = None
    sliver_share: float = 0.0  # fraction of the area in long and thin faces
    surface: Any = None  # `Surface` of all cells
    weights: Any = None  # (M,) weight of each arc
    steps: FeatureSteps | None = None
    lengths: Any = None  # (M,) weight of each arc as an integer multiple of `unit`
    unit: float = 0.0  # weight that corresponds to a value of 1 in `lengths`
    arcs: Any = None  # `ArcLengths` of the cells inside the mask
    ordered: Any = None  # `OrderedGraph` of the cells inside the mask
    coarsening: Any = None  # `Coarsening`: graphs of coarse cells, which are groups of cells
    of_machine_part: bool = False  # see `Weighed.of_machine_part`
    part_costs: PartCosts | None = None
    result: Any = None  # `Segmentation` of the cells inside the mask; at the end, of all cells
    timings: dict[str, float] = field(default_factory=dict)  # wall time in seconds, keyed by stage

    @property
    def has_parts(self) -> bool:
        """Whether arcs between parts of the shape have an additional cost.

        This is the case for the weights ``"parts"``, except for volumes, for graphs that have
        weights of their own, and if the expected radius of regions is 0.
        """
        surface, is_asked = self.surface, self.options.weights.has_parts
        has_creases = surface.weights is None and surface.dimension == 2
        return is_asked and has_creases and self.plan.size.radius > 0.0

    def relocating(self) -> _Work:
        """Return the same data, with the option `relocate` set to its default if it is None."""
        loop = self.options.loop
        if loop.relocate is not None:
            return self
        relocates = self.has_parts and not self.plan.has_seeds and loop.radius_factor is None
        loop = replace(loop, relocate=relocates)
        return replace(self, options=replace(self.options, loop=loop))

    def timed(self, stage: str, *, begins: bool = True) -> AbstractContextManager[None]:
        """Measure the time of a with block; if `begins` is true, also call `on_stage`."""
        return timed(self.timings, stage, self.options.loop.on_stage if begins else None)


def _run(mesh: MeshLike | CloudLike | Prepared, options: Options) -> Segmentation:
    """Run all stages of `segment`.

    The comments give the number of each stage in docs/pipeline.md, if it has one, and its keys in
    `timings`. `_coarsen` runs before `_add_parts`, because costs between parts are also added to
    coarse graphs. The `stacklevel` of warnings in stages refers to the caller of `segment`.
    """
    works = [_Work(options, mesh)]
    for stage in (
        _prepare,  # 0 mesh, 1 face_graph
        _plan,  # 1 face_graph
        _weigh,  # 2 weights
        _add_features,  # 2 weights
        _quantize,  # 2 weights
        _order,  # order
        _coarsen,  # coarsen
        _add_parts,  # 2 weights
        _cluster,  # 3 seeding, 4a classify, 4b update, balance
        _clean,  # 5 regions
        _finish,  # not timed
    ):
        works.append(stage(works.pop()))  # no other reference, so a stage can free memory
    result: Segmentation = works[0].result
    return result


def _prepare(work: _Work) -> _Work:
    """Read the mesh or cloud and build the graph of its cells, unless a `Prepared` is given."""
    options, mesh, constraints = work.options, work.mesh, work.options.constraints
    if isinstance(mesh, Prepared) and constraints.kept_points(mesh.source) is not None:
        mesh = mesh.source  # the mask changes the neighbors of points
    if isinstance(mesh, Prepared):
        if mesh.order is not None and options.needs_order(mesh.kind):
            raise ValueError(
                "prepared cells are sorted, but radius_factor and arrays of weights need the input"
                " order: pass the mesh instead, or leave these parameters out"
            )
        if options.denoise not in ("auto", mesh.n_steps):
            raise ValueError("denoise needs the mesh: pass the mesh instead of prepared cells")
        prepared = mesh
    else:
        with work.timed("mesh"):
            n_threads = options.loop.n_threads
            source, features = read_with_features(mesh, options.features, constraints, n_threads)
            options = replace(options, features=features)
        with work.timed("face_graph"):
            prepared = Prepared.of(
                source, weld=options.weld, n_threads=n_threads,
                is_sorted=not options.needs_order(kind_of(source)), denoise=options.denoise,
                is_kept=constraints.kept_points(source),
            )  # fmt: skip
    options = options.smoothed(prepared.n_steps, prepared.slack)
    return replace(
        work,
        options=options,
        mesh=None,
        source=prepared.source,
        prepared=prepared,
        order=prepared.order,
    )


def read_with_features(
    mesh: MeshLike | CloudLike, features: FeatureOptions, constraints: ConstraintOptions,
    n_threads: int,
) -> tuple[Cells, FeatureOptions]:  # fmt: skip
    """Read the mesh or cloud, and replace names of features by a table of their values."""
    names = features.names
    if not names:
        return as_cells(mesh), features
    if isinstance(mesh, (str, os.PathLike)):
        source, attributes = read_cells_and_attributes(mesh)
    else:
        source, attributes = as_cells(mesh), None
        if "color" in names and kind_of(source).has_faces:
            raise MeshError(
                "a Mesh has no colors, so features='color' is not available: pass the path of the"
                " file instead, or an array of colors as features"
            )
    table = features_of(names, source, attributes, n_threads, constraints.kept_points(source))
    return source, replace(features, given=table)


def _plan(work: _Work) -> _Work:
    """Determine the cells to segment, the expected size of regions, and the initial centers."""
    options, prepared, n_threads = work.options, work.prepared, work.options.loop.n_threads
    with work.timed("face_graph", begins=False):
        cut = options.constraints.cut(
            prepared.denoised,
            prepared.graph,
            weld=options.weld,
            n_threads=n_threads,
            order=prepared.order,
        )
        measures = prepared.given_measures(n_threads)
        sizes = SizeRules.of(options.balance, prepared.graph, cut, prepared.order, measures)
        size = options.size if sizes is None else sizes.asked(options.size)
        plan = Plan.of(
            prepared.graph, cut, (size, options.init), n_threads,
            dimension=prepared.kind.dimension, order=prepared.order,
        )  # fmt: skip
        if sizes is not None:
            sizes.check(plan.size.n_segments)
        areas = prepared.graph.measures
        if cut is not None:
            areas = np.zeros_like(areas)
            areas[cut.cells] = prepared.graph.measures[cut.cells]
        share = prepared.kind.sliver_share(
            prepared.cells, areas, prepared.shapes, plan.size.radius, n_threads
        )
    return replace(work, plan=plan, sizes=sizes, sliver_share=share)


def _weigh(work: _Work) -> _Work:
    """Compute the weights of all arcs for the expected radius of regions."""
    prepared = work.prepared
    adapted = prepared.kind.weight_options(prepared.graph, work.options.weights)
    options = replace(work.options, weights=adapted)
    with work.timed("weights"):
        surface = prepared.kind.surface(prepared.cells, prepared.graph, options.loop.n_threads)
        weights, of_machine_part = prepared.kind.weights(
            surface, prepared.graph, prepared.shapes, work.plan.size.radius, options.weights
        )
        if not options.weights.has_other_unit:  # otherwise `_border_costs` needs the full surface
            surface = prepared.kind.bare_surface(
                surface, prepared.cells, prepared.graph, surface.n_threads
            )
    prepared = replace(prepared, shapes=None)
    work = replace(work, options=options, surface=surface, weights=weights, prepared=prepared)
    return replace(work, of_machine_part=of_machine_part).relocating()


def _add_features(work: _Work) -> _Work:
    """Add the cost of feature differences to the weights, if there are features."""
    surface, measures = work.surface, work.prepared.graph.measures
    with work.timed("weights", begins=False):
        steps = work.options.features.steps(work.source, measures, surface.n_threads, work.order)
        if steps is None:
            return work
        checked = checked_weights(work.weights, surface.n_arcs, surface.n_threads)
        weights = steps.added(checked, surface, work.plan.size.radius)
    return replace(work, weights=weights, steps=steps)


def _quantize(work: _Work) -> _Work:
    """Round weights to integer multiples of a unit, so that sums of weights are exact."""
    with work.timed("weights", begins=False):
        unit_factor = UNIT_FACTOR if work.has_parts else 1.0
        lengths, unit = work.prepared.graph.quantized(
            work.weights, work.surface.n_threads, unit_factor
        )
    return replace(work, weights=None, lengths=lengths, unit=unit)


def _order(work: _Work) -> _Work:
    """Build the graph for the loop, with neighboring cells close together in memory.

    `Plan.placed_cells` sorts the cells inside the mask along a space-filling curve. The loop still
    returns labels in the order of `Prepared.cells`, which `_prepare` may already have sorted.
    """
    with work.timed("order"):
        n_threads = work.surface.n_threads
        placed, arcs = work.plan.placed_cells(work.prepared.graph, work.lengths, n_threads)
        offsets, neighbors, lengths = arcs
        work = replace(work, prepared=None, arcs=arcs)
        is_symmetric = work.options.weights.given is None  # formulas give symmetric weights
        straight_unit = work.unit * work.surface.weight_unit if work.has_parts else 0.0
        ordered = _core.OrderedGraph(
            placed, offsets, neighbors, lengths, n_threads, is_symmetric, straight_unit
        )
        if work.of_machine_part:
            limit = work.options.weights.crease_limit(work.plan.size.radius)
            ordered.crease_limit = limit / straight_unit
    return replace(work, ordered=ordered)


def _coarsen(work: _Work) -> _Work:
    """Group cells into coarse cells, on which most iterations of the loop run."""
    coarsening = coarsened(work.ordered, work.plan, work.options.loop, work.timings)
    return replace(work, coarsening=coarsening)


def _add_parts(work: _Work) -> _Work:
    """Add far arcs and costs between parts (see `add_part_costs`) if `_Work.has_parts` is true."""
    if not work.has_parts:
        return work
    options, size, n_threads = work.options.weights, work.plan.size, work.surface.n_threads
    with work.timed("weights", begins=False):
        part_costs = add_part_costs(work.ordered, work.coarsening, options, size, n_threads)
    return replace(work, part_costs=part_costs)


def add_part_costs(
    graph: Any, coarsening: Any, options: WeightOptions, size: RegionSize, n_threads: int
) -> PartCosts:
    """Add costs between parts of the shape, and far arcs, to the graphs on which the loop runs.

    Far arcs join faces that are two or more arcs apart. `graph` must be in memory if
    ``coarsening.on_all`` is true; otherwise, it may be on disk.
    """
    factors = (options.params["gamma"], options.crease_cost(size.radius))
    if coarsening.on_all:
        groups = groups_to_embed(graph, n_threads)
        costs = PartCosts.of(graph, groups, factors, n_threads)
        far_steps = FAR_STEPS if has_small_regions(graph, size.n_segments) else 1
        if coarsening.is_short or groups:
            far_steps = min(far_steps, SHORT_STEPS)
        costs.add_to_all(graph, coarsening.graphs, n_threads, far_steps=far_steps)
    else:
        groups = coarsening.graphs[: coarsening.n_finer + 1]
        costs = PartCosts.of(graph, groups, factors, n_threads)
        costs.add_to_coarse(coarsening.graphs[coarsening.n_finer :], n_threads)
    return costs


def _cluster(work: _Work) -> _Work:
    """Place seeds, and run the clustering loop, which labels cells and moves centers."""
    options = work.options
    note = sliver_note(work.sliver_share, sliver_advice(work.plan.size.radius))
    if note is not None:
        warnings.warn(note, SliverWarning, stacklevel=5)
    join_pieces = None
    if work.has_parts:
        join_pieces = joiner_of(work.arcs, work.ordered.crease_limit, options.loop.n_threads)
    balancer = None
    if work.sizes is not None:
        balancer = Balancer.of(work.sizes, work.coarsening.graphs, work.plan, options.loop)
    result = segment_cells(
        work.ordered,
        work.coarsening,
        work.surface.bounds,
        work.plan,
        options.loop,
        join_pieces,
        balancer,
    )
    warn_of_islands(replace(result, params=options.params(result)), 6)
    work = replace(work, ordered=None, coarsening=None, arcs=None, sizes=None)
    return replace(work, balancer=balancer, result=result)


def _clean(work: _Work) -> _Work:
    """Clean up regions as requested: connect, merge, straighten borders, and adjust sizes."""
    options, plan, n_threads = work.options, work.plan, work.surface.n_threads
    if not (options.cleanup.is_needed or options.balance.is_used):
        return work
    with work.timed("regions"):
        costs = _border_costs(work)
        costs = costs if plan.cut is None else costs.of_cut(plan.cut)
        if work.part_costs is not None:
            arcs, lengths = costs.surface.arcs, costs.lengths
            lengths = work.part_costs.border_lengths(arcs, lengths, n_threads)
            costs = replace(costs, lengths=lengths, crease_scale=PART_CREASE_SCALE)
        smoothing = SmoothOptions() if work.part_costs is None else OF_PARTS
        cleanup, goals = options.cleanup, None
        if work.balancer is not None:
            labels = work.result.labels
            goals = Goals.of(work.balancer, labels, work.result.n_segments)
        result = _cleaned(costs, work.result, cleanup, plan.groups, smoothing, goals)
        if goals is not None:
            result = _sized(costs, result, goals, smoothing if cleanup.smooth else None)
    return replace(work, lengths=None, balancer=None, result=result)


def _sized(
    costs: BorderCosts, result: Segmentation, goals: Goals, smoothing: SmoothOptions | None
) -> Segmentation:
    """Move cells between regions until the sizes of regions are within their limits.

    Issues a BalanceWarning if sizes are exact and some regions are disconnected.
    """
    labels, centers = settle(costs, result.labels, result.centers, goals, smoothing)
    n_extra = costs.surface.extra_pieces(labels, len(centers)) if goals.is_exact else 0
    if n_extra > 0:
        note = (
            f"some regions are disconnected, with {counted(n_extra, 'extra piece')}: no connected"
            " regions of the requested sizes were found"
        )
        warnings.warn(note, BalanceWarning, stacklevel=6)
    return replace(result, labels=labels, centers=centers, n_extra_pieces=n_extra)


def _cleaned(
    costs: BorderCosts,
    result: Segmentation,
    options: CleanupOptions,
    groups: Ints,
    smoothing: SmoothOptions,
    goals: Goals | None = None,
) -> Segmentation:
    """Clean up the regions of a result; cells of different `KeptCells.groups` stay separate."""
    if options.enforce_connectivity:
        edit = connect_regions(costs, result.labels, result.n_segments, result.centers)
        # In `edit`, pieces that touch no other region are new regions. Here, they get their old
        # labels again.
        labels = edit.sources[edit.labels]
        result = replace(result, labels=labels, n_joined=edit.n_joined)
    if options.min_size > 0:
        edit = merge_regions(
            costs, result.labels, result.n_segments, options.min_size, options.islands, groups
        )
        result = replace(
            result,
            labels=edit.labels,
            centers=result.centers[edit.sources],
            n_merged=edit.n_joined,
            n_islands=edit.n_islands,
        )
    if options.smooth:
        sizes = None if goals is None else goals[:2]
        labels = straighten(costs, result.labels, result.centers, smoothing, sizes)
        result = replace(result, labels=labels)
    return result


def _border_costs(work: _Work) -> BorderCosts:
    """Return the costs of borders between regions.

    The costs are computed from the weights of arcs if these have the same unit as the weights
    ``"creases"``, and otherwise from the result of `creases_of`.
    """
    surface, radius = work.surface, work.plan.size.radius
    scale = radius or surface.diagonal
    if not work.options.weights.has_other_unit:
        return BorderCosts(surface, work.lengths, work.unit, scale)
    weights = creases_of(surface, radius, ridges=0.0)  # weights in other units have no ridge costs
    if work.steps is not None:
        weights = work.steps.added(weights, surface, radius)
    return BorderCosts.of_weights(surface, weights, scale)


def _finish(work: _Work) -> _Work:
    """Restore the input order of cells, and add timings and parameters to the result."""
    result = work.plan.whole(work.result)
    if work.order is not None:
        result = _in_input_order(result, work.order)
    result = replace(
        result,
        sliver_share=work.sliver_share,
        timings=stages_in_order(work.timings | result.timings),
        params=work.options.params(result),
        cells=work.source,
    )
    note = radius_note(result)
    if note is not None:
        warnings.warn(note, RadiusWarning, stacklevel=5)
    return replace(work, result=result)


def _in_input_order(result: Segmentation, order: Ints) -> Segmentation:
    """Convert a result for sorted cells to input order; `order` gives input indices."""
    labels = np.empty_like(result.labels)
    labels[order] = result.labels
    return replace(result, labels=labels, centers=order[result.centers])


def sliver_advice(radius: float) -> str:
    """Return advice on how to subdivide long and thin faces, for regions of the given radius."""
    max_edge = EDGE_PER_RADIUS * radius
    return f"subdivide first, mesh = superfacets.subdivide(mesh, max_edge={max_edge:.3g}).mesh"


FEWEST_CELLS = 4
"""Minimum mean number of cells of a region, below which `segment` doubts a radius."""


def radius_note(result: Segmentation) -> str | None:
    """Return a note if a radius led to regions of fewer than `FEWEST_CELLS` cells, or None."""
    params = result.params
    if params["n_segments"] is not None or params["init"] == "given":
        return None
    n_kept = result.n_unreached if params["islands"] == "keep" else 0
    n_made = result.n_segments + result.n_merged - n_kept
    mean = np.count_nonzero(result.labels >= 0) / max(1, n_made)
    if mean >= FEWEST_CELLS:
        return None
    is_fraction = params["radius"] is not None
    unit = "a fraction of the bounding box's diagonal" if is_fraction else "in the unit of the mesh"
    things = "cells" if result.cells is None else kind_of(result.cells).plural
    return f"regions have {mean:.1f} {things} on average: is the radius {unit}?"


def fewer_note(result: Segmentation) -> str | None:
    """Return a note if `min_measure` led to fewer regions than requested; otherwise None."""
    asked, n_made = result.params["n_segments"], result.n_segments + result.n_merged
    least = result.params.get("min_measure")
    if asked is None or n_made >= asked or least is None:
        return None
    components = "components between barriers" if "barriers" in result.params else "components"
    return (
        f"{counted(n_made, 'region')} instead of {asked}: some {components} are too small for more"
        f" regions of at least min_measure={least:g}"
    )


BARRIERS_NOTE = "barriers divide the cells into components, each of which has at least one region"
"""Explains why barriers led to more regions than requested."""


def warn_of_islands(result: Segmentation, stacklevel: int = 4) -> None:
    """Issue an IslandWarning if components or `min_measure` changed the number of regions.

    There is no warning if seeds, a radius or `radius_factor` are given, or if there are more
    regions because barriers are given and one region was requested.
    """
    params = result.params
    asked = params["n_segments"]  # None if `segment` was called with a radius
    if asked is None or params["init"] == "given" or params["radius_factor"] is not None:
        return
    n_more, has_barriers = result.n_segments - asked, "barriers" in params
    fewer = fewer_note(result)
    if fewer is not None:
        warnings.warn(fewer, IslandWarning, stacklevel=stacklevel)
        return
    if params["islands"] == "keep" and result.n_unreached:
        if has_barriers and asked == 1:  # users request this to get one region per component
            return
        advice = "to join them to the nearest region, use islands='nearest'"
        note = f"{counted(result.n_unreached, 'component')} got no seed; {advice}"
        if has_barriers:
            note = BARRIERS_NOTE
    elif params["islands"] == "nearest" and n_more > 0 and params["init"] not in ("flood", "grid"):
        note = f"{counted(n_more, 'part')} between barriers got no seed and cannot join a region"
    else:
        return
    message = f"{counted(result.n_segments, 'region')} instead of {asked}: {note}"
    warnings.warn(message, IslandWarning, stacklevel=stacklevel)


def stages_in_order(timings: dict[str, float]) -> dict[str, float]:
    """Return `timings` with the entry ``"regions"`` last, because this stage runs last."""
    last = {"regions": timings.pop("regions")} if "regions" in timings else {}
    return timings | last
