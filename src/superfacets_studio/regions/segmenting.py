"""Segment a mesh in a thread, with cached results so that sliders react fast; check parameters."""

from __future__ import annotations

import hashlib
import threading
import warnings
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

import superfacets as sf
from superfacets import kit, segment
from superfacets.kit import WEIGHTS, BaseGraph, Bools, Cells, Ints, Surface

from ..labels.coding import CellNumbers

MAX_KEPT = 4  # number of cached segmentations, each with its merge tree
LEVEL_STEP = 2  # ratio of the numbers of regions of two successive levels
FEWEST_OFFERED = 4  # minimum number of regions on any level except the finest
MAX_REGIONS = 20_000  # maximum of the slider; with more, regions would be too small for labeling
MAX_ALPHA, MAX_RIDGES = 100.0, 1.0
_WEIGHTS = ("alpha", "ridges")
USUAL_REGIONS = 150  # number of regions of a new work file, the default of `segment`

Parameters = dict[str, Any]


def default_parameters(n_cells: int, n_segments: int | None = None) -> Parameters:
    """Return default parameters, with `n_segments` regions if given, but at most `n_cells`."""
    n = USUAL_REGIONS if n_segments is None else n_segments
    weights = {name: WEIGHTS["parts"].defaults[name] for name in _WEIGHTS}
    switches = {"smooth": True, "scans": False, "color": False}
    return {"n_segments": min(n, n_cells), **weights, **switches, "level": None}


def first_parameters(
    cells: Cells, n_segments: int | None, *, radius: float | None = None, **given: Any
) -> Parameters:
    """Return the parameters of new work; `radius` is the radius of a region."""
    if radius is not None:
        if n_segments is not None:
            raise ValueError("n_segments and radius exclude each other: give one of them")
        kind = kit.kind_of(cells)
        size = np.pi * (radius**2 if kind.dimension < 3 else 4 / 3 * radius**3)
        n_segments = max(1, round(float(kind.measures(cells, 1).sum()) / size))
    return checked_parameters(given, default_parameters(cells.n_cells, n_segments), cells.n_cells)


def ranges(n_cells: int) -> dict[str, list[float]]:
    """Return the minimum and maximum of each slider."""
    n_segments: list[float] = [1, min(n_cells, MAX_REGIONS)]
    return {"n_segments": n_segments, "alpha": [0.0, MAX_ALPHA], "ridges": [0.0, MAX_RIDGES]}


def checked_parameters(given: Mapping[str, Any], usual: Parameters, n_cells: int) -> Parameters:
    """Check parameters from a client, and take missing parameters from `usual`.

    `level`, the number of regions after merging, becomes None (no merging) if it equals
    `n_segments`, or if a new `n_segments` is given without a level. Raises ValueError or TypeError
    if a parameter is unknown, out of range or of the wrong type.
    """
    if unknown := sorted(set(given) - set(usual)):
        raise ValueError(f"unknown parameter {unknown[0]}")
    merged = {**usual, **given}
    if "alpha" not in given and merged["scans"] != usual["scans"]:
        merged["alpha"] = (sf.SCANS if merged["scans"] else WEIGHTS["parts"].defaults)["alpha"]
    if "level" not in given and given.get("n_segments") not in (None, usual["n_segments"]):
        merged["level"] = None  # the level in `usual` is for another number of regions
    n_segments = kit.checked_count(merged["n_segments"], "n_segments", n_cells, "cells")
    level = merged["level"]
    if level is not None:
        level = kit.checked_count(level, "level", n_segments, "regions on the finest level")
    weights = {name: kit.checked_number(merged[name], name, zero=True) for name in _WEIGHTS}
    flags = {name: kit.checked_flag(merged[name], name) for name in ("smooth", "scans", "color")}
    level = None if level == n_segments else level
    return {"n_segments": n_segments, **weights, **flags, "level": level}


def levels_of(n_segments: int) -> list[int]:
    """Return the number of regions on each level that the page offers, in descending order."""
    levels = [n_segments]
    while levels[-1] // LEVEL_STEP >= FEWEST_OFFERED:
        levels.append(levels[-1] // LEVEL_STEP)
    return levels


class Cancelled(Exception):  # noqa: N818  # not an error
    """Raised in a segmentation if a newer one replaces it, or if its client has disconnected."""


@dataclass
class SegmentationTask:
    """Handle of a segmentation: other threads can cancel it, and `tell` receives its progress."""

    tell: Callable[[dict[str, Any]], object] = lambda _: None
    _is_cancelled: threading.Event = field(default_factory=threading.Event)

    def cancel(self) -> None:
        """Make the segmentation end at its next stage or iteration."""
        self._is_cancelled.set()

    def check(self) -> None:
        """Raise `Cancelled` if the segmentation was cancelled."""
        if self._is_cancelled.is_set():
            raise Cancelled

    def report(self, stage: str, n_iter: int = 0, n_moved: int = 0) -> None:
        """Report that a stage begins, or how many centers have moved in an iteration."""
        self.check()
        self.tell({"iteration": n_iter, "moved": n_moved} if n_iter else {"stage": stage})


@dataclass(frozen=True, eq=False)
class UnsplitRegions:
    """Regions computed by `segment`, merged if a level is set, but not yet split by the user."""

    labels: Ints
    n_regions: int
    digest: str  # hash of the labels
    notes: tuple[str, ...]  # warnings to show to the user


@dataclass
class Segmenter:
    """Segments one mesh with any parameters in a separate thread, one segmentation at a time.

    The cell graph is built once, because it does not depend on the parameters. Regions and merge
    trees for the `MAX_KEPT` most recently used parameters are cached.
    """

    source: Cells
    colors: Callable[[], Any] | None = None  # returns the colors of cells; None if there are none
    _kept: OrderedDict[tuple[Any, ...], UnsplitRegions] = field(default_factory=OrderedDict)
    _trees: dict[str, sf.Hierarchy] = field(default_factory=dict)  # by the digest of the regions
    _worker: ThreadPoolExecutor = field(
        default_factory=lambda: ThreadPoolExecutor(1, thread_name_prefix="superfacets-studio")
    )
    _latest: SegmentationTask | None = None
    _built: Future[tuple[BaseGraph, Surface]] | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @cached_property
    def prepared(self) -> Any:
        """Mesh as prepared for `segment`, with its cell graph."""
        return sf.prepare(self.source)

    def build(self) -> Future[tuple[BaseGraph, Surface]]:
        """Let the thread build the graph of the cells in input order, and its `surface`, once."""
        if self._built is None:
            make, threads = self.prepared.graph_and_surface, kit.checked_threads(None)
            self._built = self._worker.submit(make, n_threads=threads)
        return self._built

    @property
    def surface(self) -> Surface:
        """Geometry of the cells in input order, for borders, merging and splits."""
        return self.build().result()[1]

    def run(self, parameters: Parameters, task: SegmentationTask | None = None) -> UnsplitRegions:
        """Segment with checked parameters; this call cancels the previous call of `run`.

        Raises Cancelled if a later call or `task` cancels this call, and ValueError if merging
        cannot reach the number of regions in `level`.
        """
        task = SegmentationTask() if task is None else task
        with self._lock:
            if self._latest is not None:
                self._latest.cancel()
            self._latest = task
        return self._worker.submit(self._base, parameters, task).result()

    def base(self, parameters: Parameters) -> UnsplitRegions:
        """Segment like `run`, but without cancelling a call of `run` or being cancelled by it."""
        return self._worker.submit(self._base, parameters, SegmentationTask()).result()

    def divided(self, parameters: Parameters, cells: CellNumbers, n_parts: int) -> Ints:
        """Return the part of each of the given cells, which `segment` divides into `n_parts`."""
        kit.checked_count(n_parts, "parts", len(cells), "cells in the region")
        mask = np.zeros(self.source.n_cells, bool)
        mask[cells] = True
        found = self._worker.submit(self._segment, parameters, n_parts, SegmentationTask(), mask)
        return found.result().labels[cells]

    def close(self) -> None:
        """Cancel the current segmentation, and end the thread."""
        if self._latest is not None:
            self._latest.cancel()
        self._worker.shutdown()  # waiting work is not cancelled, because others wait for `build`

    def _base(self, parameters: Parameters, task: SegmentationTask) -> UnsplitRegions:
        task.check()
        finest = self._finest(parameters, task)
        level = parameters["level"]
        if level is None:
            return finest
        if finest.digest not in self._trees:
            task.report("merging")
            tree = sf.hierarchy(self.source, [finest.n_regions], labels=finest.labels)
            self._trees[finest.digest] = tree
        tree = self._trees[finest.digest]
        kit.checked_count(level, "level", tree.n_finest, "regions on the finest level")
        if level < tree.n_fewest:
            reason = "because merging stops if no regions are neighbors"
            raise ValueError(f"level must be at least {tree.n_fewest} {reason}, got {level}")
        return _base_of(tree.cut(level), finest.notes)

    def _finest(self, parameters: Parameters, task: SegmentationTask) -> UnsplitRegions:
        key = tuple(value for name, value in sorted(parameters.items()) if name != "level")
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        with warnings.catch_warnings(record=True) as found:
            warnings.simplefilter("always")
            result = self._segment(parameters, parameters["n_segments"], task)
        self._kept[key] = base = _base_of(result.labels, _notes_of(found, result))
        if len(self._kept) > MAX_KEPT:
            self._trees.pop(self._kept.popitem(last=False)[1].digest, None)
        return base

    def _segment(
        self, parameters: Parameters, n_segments: int, task: SegmentationTask,
        mask: Bools | None = None,
    ) -> sf.Segmentation:  # fmt: skip
        weights = sf.Weights("parts", alpha=parameters["alpha"], ridges=parameters["ridges"])
        is_scan = parameters["scans"] and kit.kind_of(self.source).has_faces
        if "prepared" not in self.__dict__:
            task.report("face_graph")
        return segment(
            self.prepared, n_segments, weights=weights, mask=mask, smooth=parameters["smooth"],
            features=self.colors() if self.colors and parameters["color"] else None,
            denoise=sf.SCANS["denoise"] if is_scan else "auto", callback=task.report,
        )  # fmt: skip


def _notes_of(found: list[warnings.WarningMessage], result: sf.Segmentation) -> tuple[str, ...]:
    """Return a text for each warning, which names no parameters of Python functions."""
    notes = []
    for warning in found:
        if warning.category is sf.SliverWarning:
            notes.append("Triangles are long and thin, so regions are stripes: subdivide first.")
        elif warning.category is sf.IslandWarning:
            n_pieces = kit.counted(result.n_unreached, "small disconnected piece")
            became = "an additional region" if result.n_unreached == 1 else "additional regions"
            notes.append(f"{n_pieces} of the mesh became {became}.")
        else:
            notes.append(str(warning.message))
    return tuple(notes)


def _base_of(labels: Ints, notes: tuple[str, ...]) -> UnsplitRegions:
    digest = hashlib.blake2b(labels.tobytes(), digest_size=8).hexdigest()
    return UnsplitRegions(labels, int(labels.max()) + 1, digest, notes)
