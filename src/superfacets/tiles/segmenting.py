"""Segment a mesh or point cloud larger than memory, tile by tile, with `segment_tiled`."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, cast

import numpy as np

from .. import _core
from .._memory import address_limit, memory_of_process
from .._options import CleanupOptions, Init, Islands, LoopOptions, Progress, SizeOptions
from .._timing import OnStage, timed
from .._types import Viewpoint
from .._validate import checked_choice, checked_count, checked_flag
from ..batches.mapping import OnDone, Run, open_run
from ..cells.cell_graph import box_diagonal
from ..cells.point_graph import checked_viewpoint
from ..cells.size import size_of_total, sliver_note
from ..cells.weights import WeightName, WeightOptions
from ..clustering.coarsening import AnyGraph, can_be_coarse, coarsened, has_small_regions
from ..clustering.parts import PART_CREASE_SCALE, UNIT_FACTOR
from ..clustering.plan import Plan
from ..clustering.result import Segmentation
from ..clustering.run import segment_cells
from ..errors import MeshError, SliverWarning
from ..export.label_files import label_files, ranges_of, save_labels
from ..io.atomic import StrPath
from ..io.readers.pieces import Pieces
from ..mesh.denoising import Denoise, checked_denoise
from ..pipeline import Options, add_part_costs, sliver_advice, stages_in_order, warn_of_islands
from ..regions.smooth import OF_PARTS
from ..workers.scratch import Scratch, check_room, scratch_folder
from .borders import BorderRule, straighten_tiled
from .cloud_normals import has_open_cloud
from .cloud_tiles import make_cloud_tiles
from .denoising import make_mesh_tiles
from .opening import TiledSource, open_pieces
from .store import TileStore, find_cells
from .tile_arcs import ArcFacts, WeightRule, find_arcs
from .tiled_graph import TiledCoarseGraph, TiledGraph

TILE_SIZE = 1 << 18
"""Default number of cells of a tile."""

BYTES_AT_WORK = 500
"""Peak memory for processing a tile, in bytes per cell of the tile."""

BYTES_PER_FACE, BYTES_PER_POINT = 250, 400
"""Disk space used by the scratch folder, in bytes per cell."""

MEMORY_PART = 8
"""The default size of the cache is the memory limit of the process divided by MEMORY_PART. All
tiles that are processed at the same time may together use as much again."""

ADDRESSES_OF_THREAD = 150 << 20
"""Address space, in bytes, that each thread reserves for its stack and its heap."""

KEPT_HEAP = 1 << 28
"""Maximum number of freed bytes that the heap keeps for reuse by the next tile."""

_WEIGHTS = ("parts", "creases", "superfacets")
"""Supported weights. ``"stk02"`` is excluded, because it is for comparisons on small meshes."""


def segment_tiled(
    source: TiledSource,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    expected_radius: float | None = None,
    alpha: float | None = None,
    eta_convex: float | None = None,
    ridges: float | None = None,
    weights: WeightName = "parts",
    max_num_iter: int = 50,
    tol: float = 0.02,
    init: Literal["geodesic"] | None = None,
    relocate: bool | None = None,
    islands: Islands = "keep",
    smooth: bool = True,
    denoise: Denoise = "auto",
    viewpoint: Sequence[float] | None = None,
    weld: bool = True,
    tile_size: int = TILE_SIZE,
    scratch: StrPath | None = None,
    cache: int | None = None,
    out: StrPath | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    n_threads: int | None = None,
    progress: Progress | None = None,
    on_stage: OnStage | None = None,
    on_tile: OnDone | None = None,
) -> Segmentation:
    """Segment a mesh or point cloud larger than memory, as `segment` does.

    The faces (or points) are sorted along a space-filling curve on disk, and split into tiles. Each
    tile is divided into coarse cells, and the clustering loop uses the graph of coarse cells.
    Then the faces are labeled tile by tile. Borders are straightened with only the faces near
    borders in memory. If the faces of a mesh are in random order, `segment` sorts them first, and
    may then break ties differently.

    Parameters
    ----------
    source : path, Mesh, PolygonMesh, PointCloud, (N, 3) array or (vertices, faces) pair
        A mesh or cloud: an object, a file, arrays (which may be memory maps), a folder of mesh
        files or of cloud files, or a tileset of 3D Tiles (``tileset.json`` or its folder). Vertices
        of several files at the same position are merged. Faces or points are numbered consecutively
        through all files, in the order of file names or of the tileset.
    n_segments, radius, expected_radius, alpha, eta_convex, ridges, max_num_iter, tol, relocate
        Same as in `segment`.
    islands, smooth
        Same as in `segment`.
    init : {"geodesic"}, optional
        Seeding method. By default, it is chosen as in `segment`.
    denoise, weld
        Same as in `segment`.
    viewpoint : sequence of float, length 3, optional
        Position of the sensor, for a point cloud without normals. Estimated normals face the
        viewpoint, as in `estimate_normals`.
    weights : {"parts", "creases", "superfacets"}
        Same as in `segment`.
    tile_size : int, default 262144
        Number of faces or points per tile, rounded up to a multiple of 4096. Labels do not depend
        on the tile size.
    scratch : path, optional
        Folder for temporary arrays, which take about 250 bytes per face or 400 bytes per point and
        are removed at the end. By default, the system's folder for temporary files is used.
    cache : int, optional
        Memory, in bytes, for temporary arrays. Arrays that do not fit are written to the disk. The
        default is an eighth of the memory that this process may use, or 0 with several workers or
        with a scheduler.
    out : path, optional
        A ``.npy`` file for all labels. If the source is a folder, `out` may also be a folder, which
        is created if it is missing. Then each file of the source gets a label file (``a.npy`` for
        ``a.ply``). If the run fails, no label files are written. A name without a suffix, or with a
        trailing slash, is a folder.
    workers : int, default 1
        Number of processes of this machine that process tiles; 1 means only this process.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers process the tiles instead of processes of this
        machine. The workers must have access to the source and to `scratch`.
    n_threads : int, optional
        Number of threads of this process, as in `segment`. Several tiles are processed at the same
        time, each in one thread, if these tiles together fit in an eighth of the memory.
    progress, on_stage
        Same as in `segment`. The additional stage ``"tiles"`` reads the source.
    on_tile : callable, optional
        Function called with the number of finished tiles and the number of all tiles in the current
        pass. A tile is counted again each time new paths enter the tile.

    Returns
    -------
    Segmentation
        Same as the result of `segment`, but ``cells`` is None, and the last digits of
        ``sliver_share`` may differ.

    Warns
    -----
    SliverWarning, IslandWarning
        Same as in `segment`.

    Raises
    ------
    MeshError
        If the mesh or cloud is invalid, if a file is damaged, or if a folder has both meshes and
        clouds.
    OSError
        If a file cannot be read or written, if the disk has too little free space, or if worker
        processes end or cannot be reached.
    MissingExtraError
        If psutil is missing with several workers, or Dask is missing with a scheduler.
    ValueError, TypeError
        If a parameter is invalid, or if two label files would have the same name.

    Notes
    -----
    The memory in use is the sum of `cache`, about 500 bytes per face of a tile for each thread, 10
    bytes per face of the mesh for the graph of coarse cells, 4 bytes per face (8 per point) for
    labels, and the memory of the faces near borders. The graph of all faces is also in memory, with
    150 bytes per face, if regions have fewer than about 200 faces (100 if `weights` is not
    ``"parts"``), or if the loop runs on all faces (``tol=0``, or ``max_num_iter`` 0 or 1).

    The other options of `segment`, such as `features`, `mask` and `radius_factor`, are not
    supported.

    Examples
    --------
    >>> import numpy as np
    >>> from superfacets import sample_mesh, segment
    >>> mesh = sample_mesh(20_000)
    >>> tiled = segment_tiled(mesh, 20, tile_size=8192)
    >>> np.array_equal(tiled.labels, segment(mesh, 20).labels)
    True
    """
    checked_choice(weights, "weights", _WEIGHTS)  # weights given as an array are not supported
    if init is not None:
        checked_choice(init, "init", ("geodesic",))
    loop = LoopOptions.checked(
        max_num_iter, tol, None, islands, n_threads, progress, on_stage, relocate=relocate
    )
    options = Options(
        checked_flag(weld, "weld"),
        init,
        SizeOptions.checked(n_segments, radius, expected_radius, init),
        WeightOptions.checked(weights, alpha, eta_convex, ridges),
        loop,
        CleanupOptions.checked(smooth, False, 0.0, islands),
        denoise=checked_denoise(denoise),
    )
    place = Place.checked(source, tile_size, scratch, cache, out, workers, scheduler)
    seen_from = None if viewpoint is None else checked_viewpoint(viewpoint)
    with _core.Workspace(), _core.KeptHeap(KEPT_HEAP):  # threads and memory that all stages reuse
        return _run(source, options, place, on_tile, seen_from)


@dataclass(frozen=True)
class Place:
    """Options that define where tiles are stored and processed, and where labels are written."""

    tile_size: int
    scratch: Path
    cache: int
    files: tuple[Path, ...]  # files for labels; empty if labels are only returned
    workers: int
    scheduler: str | None

    @classmethod
    def checked(
        cls, source: TiledSource, tile_size: int, scratch: StrPath | None, cache: int | None,
        out: StrPath | None, workers: int, scheduler: str | None,
    ) -> Place:  # fmt: skip
        """Check arguments of `segment_tiled`, and return them as options."""
        workers = checked_count(workers, "workers")
        if cache is None:
            cache = memory_of_process() // MEMORY_PART
        elif checked_count(cache, "cache", low=0) and (workers > 1 or scheduler is not None):
            raise ValueError("cache must be 0 or None with several workers or with a scheduler")
        return cls(
            checked_count(tile_size, "tile_size"),
            Path(tempfile.gettempdir() if scratch is None else scratch).absolute(),
            cache,
            () if out is None else tuple(label_files(source, out)),
            workers,
            scheduler,
        )

    @property
    def is_remote(self) -> bool:
        """Whether tiles are processed in worker processes."""
        return self.workers > 1 or self.scheduler is not None

    def tiles_at_once(self, loop: LoopOptions) -> int:
        """Return the number of tiles that are processed at the same time, each in one thread."""
        each = BYTES_AT_WORK * self.tile_size
        if address_limit() is not None:
            each += ADDRESSES_OF_THREAD
        return min(loop.n_threads, max(memory_of_process() // MEMORY_PART // each, 1))


def _run(
    source: TiledSource, options: Options, place: Place, on_tile: OnDone | None,
    viewpoint: Viewpoint | None,
) -> Segmentation:  # fmt: skip
    timings: dict[str, float] = {}
    at_once = place.tiles_at_once(options.loop)
    # A worker process has one thread, and processes one tile at a time.
    is_parallel = place.is_remote or at_once > 1
    n_threads = 1 if is_parallel else options.loop.n_threads
    with (
        scratch_folder(place.scratch, 0 if place.is_remote else place.cache) as scratch,
        open_run(place.workers, place.scheduler, place.scratch, at_once, on_tile) as run,
    ):
        with timed(timings, "tiles", options.loop.on_stage):
            pieces = open_pieces(source, scratch, for_workers=place.is_remote)
            pieces = replace(pieces, viewpoint=viewpoint)
            ranges = ranges_of(pieces, len(place.files))
            is_cloud = pieces.corners is None
            n_bytes = BYTES_PER_POINT if is_cloud else BYTES_PER_FACE
            check_room(place.scratch, n_bytes * pieces.n_cells)
            made = pieces, scratch, place.tile_size
            store, options = _make_tiles(made, options, run, n_threads)
        are_guessed = is_cloud and pieces.normals is None and viewpoint is None
        if are_guessed and has_open_cloud(store, run):
            options = replace(options, weights=options.weights.counting_both_turns())
        graph = TiledGraph(store, run, n_threads, is_parallel)
        result = _segment(graph, options, timings)
        if place.files:
            save_labels(place.files, ranges, result.labels)
    return result


def _make_tiles(
    made: tuple[Pieces, Scratch, int], options: Options, run: Run, n_threads: int
) -> tuple[TileStore, Options]:
    """Run stages 0 and 1; return the tiles, and the options with the number of smoothing steps.

    `made` contains the input, the scratch folder and the tile size.
    """
    pieces, is_cloud = made[0], made[0].corners is None
    if is_cloud and options.denoise not in (None, 0, "auto"):
        raise ValueError("denoise needs a mesh of faces, got points: leave denoise out")
    if pieces.viewpoint is not None and (not is_cloud or pieces.normals is not None):
        raise MeshError("omit viewpoint: it is only for point clouds without normals or viewpoints")
    if is_cloud:
        options = options.smoothed(None, 0.0)
        return make_cloud_tiles(*made, run=run, n_threads=n_threads), options
    store, n_steps, slack = make_mesh_tiles(
        *made, options.denoise, welds=options.weld, run=run, n_threads=n_threads
    )
    return store, options.smoothed(n_steps, slack)


def _segment(graph: TiledGraph, options: Options, timings: dict[str, float]) -> Segmentation:
    store, diagonal = graph.store, box_diagonal(graph.store.bounds)
    size = size_of_total(options.size, store.n_cells, store.total_measure, diagonal)
    plan = Plan(None, size, options.size, cast("Init | None", options.init))
    has_parts = options.weights.has_parts and size.radius > 0.0
    if options.loop.relocate is None:
        options = replace(options, loop=replace(options.loop, relocate=has_parts))
    facts = _weigh(graph, plan, options, timings)
    share = min(facts.sliver_area / store.total_measure, 1.0) if store.total_measure > 0 else 0.0
    note = sliver_note(share, sliver_advice(size.radius))
    if note is not None:
        warnings.warn(note, SliverWarning, stacklevel=4)
    if has_parts:
        graph = replace(graph, straight_unit=facts.unit * diagonal)
    if facts.of_machine_part:
        limit = options.weights.crease_limit(size.radius)
        graph = replace(graph, crease_limit=limit / graph.straight_unit)
    result, borders = _cluster(graph, plan, options, timings)
    warn_of_islands(result, 5)
    if options.cleanup.smooth:
        with timed(timings, "regions", options.loop.on_stage):
            borders = replace(borders, unit=facts.unit)
            if options.weights.has_other_unit:
                borders = replace(borders, lengths="border_lengths", unit=facts.border_unit)
            straighten_tiled(store, borders, result.labels, result.centers, graph.run)
    if store.kind == "points":
        result = _in_input_order(store, result)
    timings, params = stages_in_order(timings | result.timings), options.params(result)
    return replace(result, sliver_share=share, timings=timings, params=params)


def _weigh(graph: TiledGraph, plan: Plan, options: Options, timings: dict[str, float]) -> ArcFacts:
    """Run stages 1 and 2, which write the arcs of all tiles; return the `ArcFacts` of the graph."""
    has_border_weights = options.cleanup.smooth and options.weights.has_other_unit
    unit_factor = UNIT_FACTOR if options.weights.has_parts and plan.size.radius > 0.0 else 1.0
    rule = WeightRule(
        plan.size.radius, options.weights, has_border_weights, graph.n_threads, unit_factor
    )
    with timed(timings, "weights", options.loop.on_stage):
        return find_arcs(graph.store, rule, graph.run)


def _cluster(
    graph: TiledGraph, plan: Plan, options: Options, timings: dict[str, float]
) -> tuple[Segmentation, BorderRule]:
    """Run stages 3 and 4; return the result, and the parameters of border costs.

    The `unit` of these parameters is 0. The caller must replace it.
    """
    loop, size, bounds = options.loop, plan.size, graph.store.bounds
    scale = size.radius or box_diagonal(bounds)
    borders = BorderRule("lengths", 0.0, scale, loop.n_threads)
    if not graph.straight_unit:
        coarsening = coarsened(graph, plan, loop, timings)
        return segment_cells(graph, coarsening, bounds, plan, loop), borders
    # A loop that runs on all cells needs far arcs (see `add_part_costs`). Tiles do not store them.
    is_coarse = can_be_coarse(graph.is_symmetric, plan, loop)
    is_coarse = is_coarse and not has_small_regions(graph, size.n_segments)
    cells: AnyGraph = graph if is_coarse else graph.gathered(loop.n_threads)
    coarsening = coarsened(cells, plan, loop, timings)
    if cells is graph and coarsening.on_all:
        cells = graph.gathered(loop.n_threads)
    with timed(timings, "weights"):
        part_costs = add_part_costs(cells, coarsening, options.weights, size, loop.n_threads)
    finest = next(iter(coarsening.graphs), None)
    borders = replace(
        borders, crease_scale=PART_CREASE_SCALE, smoothing=OF_PARTS, part_costs=part_costs,
        firsts=finest.firsts if isinstance(finest, TiledCoarseGraph) else None,
    )  # fmt: skip
    return segment_cells(cells, coarsening, bounds, plan, loop, graph.join_loose_pieces), borders


def _in_input_order(store: TileStore, result: Segmentation) -> Segmentation:
    labels, centers = np.empty_like(result.labels), np.empty_like(result.centers)
    for tile in range(store.n_tiles):
        numbers = store.read(tile, "numbers")
        labels[numbers] = result.labels[store.read(tile, "cells")]
        which, at = find_cells(store, tile, result.centers)
        centers[which] = numbers[at]
    return replace(result, labels=labels, centers=centers)
