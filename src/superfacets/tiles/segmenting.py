"""From a mesh larger than memory to its superfacets: all stages in a row, tile by tile."""

from __future__ import annotations

import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._options import (
    INITS,
    CleanupOptions,
    Init,
    Islands,
    LoopOptions,
    Progress,
    SizeOptions,
    WeightName,
    WeightOptions,
)
from .._timing import OnStage, timed
from .._validate import checked_choice, checked_count
from ..cells.cell_graph import box_diagonal
from ..cells.size import size_of_total
from ..cells.slivers import sliver_note
from ..clustering.loop import segment_cells
from ..clustering.plan import Plan
from ..clustering.segmentation import Segmentation
from ..errors import SliverWarning
from ..io.atomic import StrPath
from ..pipeline import sliver_advice, stages_in_order, warn_of_islands
from .arcs import ArcFacts, WeightRule, find_arcs
from .band import smooth_tiled
from .graph import TiledGraph
from .opening import TiledSource, open_pieces
from .scratch import scratch_folder
from .sorting import make_tiles
from .store import Run, TileStore, run_serially

__all__ = ["TILE_CELLS", "segment_store", "segment_tiled"]

TILE_CELLS = 1 << 19
"""Faces of a tile. With 400 bytes a face while its arcs are found, 200 MB."""

BYTES_PER_CELL = 250
"""That the scratch folder needs on the disk, per face."""


def segment_tiled(
    source: TiledSource,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    alpha: float | None = None,
    eta_convex: float | None = None,
    weights: WeightName = "creases",
    init: Init = "geodesic",
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    islands: Islands = "keep",
    smooth: bool = True,
    weld: bool = True,
    tile_cells: int = TILE_CELLS,
    scratch: StrPath | None = None,
    run: Run = run_serially,
    n_threads: int | None = None,
    progress: Progress | None = None,
    on_stage: OnStage | None = None,
) -> Segmentation:
    ...


@dataclass(frozen=True)
class TiledOptions:
    """The checked options of all stages."""

    size: SizeOptions
    init: Init
    weights: WeightOptions
    loop: LoopOptions
    cleanup: CleanupOptions
    weld: bool


def segment_store(store: TileStore, options: TiledOptions, run: Run) -> Segmentation:
    """Segment the faces of a store."""
    loop, timings = options.loop, dict[str, float]()
    diagonal = box_diagonal(store.bounds)
    size = size_of_total(options.size, store.n_cells, store.total_measure, diagonal)
    has_prices = options.cleanup.smooth and options.weights.has_other_unit
    rule = WeightRule(size.radius, options.weights, False, has_prices, loop.n_threads)
    with timed(timings, "weights", loop.on_stage):
        facts = find_arcs(store, rule, run)
    share = min(facts.sliver_area / store.total_measure, 1.0) if store.total_measure > 0 else 0.0
    note = sliver_note(share, sliver_advice(size.radius))
    if note is not None:
        warnings.warn(note, SliverWarning, stacklevel=3)
    plan = Plan(None, size, options.size, options.init)
    result = segment_cells(TiledGraph(store, run), store.bounds, plan, loop)
    warn_of_islands(result)
    if options.cleanup.smooth:
        with timed(timings, "regions", loop.on_stage):
            scale = size.radius or diagonal
            labels = smooth_tiled(store, facts, result.labels, result.centers, scale, run)
            result = replace(result, labels=labels)
    params = {"weld": options.weld, **options.weights.params, **result.params}
    timings = stages_in_order(timings | result.timings)
    params |= options.cleanup.params
    return replace(result, sliver_share=share, timings=timings, params=params)
