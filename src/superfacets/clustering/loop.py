"""Stage 4: the loop. Place seeds; label all cells; move the centers; repeat."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from .._options import Init, Islands, LoopOptions, Progress, Seeds, SizeOptions
from .._timing import timed
from ..cells.cell_graph import CellGraph, checked_graph
from ..cells.size import RegionSize, region_size
from .seeding import CORE_ISLANDS, run_seeding

__all__ = ["Segmentation", "StopReason", "segment_cells", "segment_graph"]

StopReason = Literal["converged", "cycle", "max_num_iter", "cancelled"]


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The result of `segment`: a label for every face, and facts about the run.

    ``np.asarray(segmentation)`` is ``labels``.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each face, 0..K-1, in the order of the input.
    centers : ndarray of int32, shape (K,)
        The face that represents each region, and belongs to it. The labels are the classification
        by these centers, followed by the clean-up of regions, if there is one (as there is in
        `segment` by default).
    n_segments : int
        Number of regions, K.
    n_iter : int
        Number of iterations.
    stop_reason : {"converged", "cycle", "max_num_iter", "cancelled"}
        Why the loop ended: the centers moved less than `tol`; a set of centers occurred again; the
        maximum number of iterations; `progress` returned False.
    n_unreached : int
        Islands that no center reached: components that got no seed and, with `radius_factor`, faces
        out of reach. With ``islands="keep"`` each made one more region, which K counts; with
        ``"nearest"`` they joined the nearest region.
    n_joined : int
        Pieces of regions that joined a neighbor, with ``enforce_connectivity``.
    n_merged : int
        Small regions that were merged into another, with ``min_size``: K was larger by as many.
    n_islands : int
        Small regions that have no neighbor, and were kept.
    sliver_share : float or None
        Share of the area, 0 to 1, in faces longer than 3 r and thinner than r, with the expected
        radius r. Above 0.1 regions become stripes, and `segment` warns. None for cells of a graph
        of one's own, which have no length.
    timings : dict of str to float
        Seconds of wall time in each stage.
    params : dict
        The parameters as used. ``expected_radius`` is r in the unit of the vertices, where
        ``radius`` is the fraction of the diagonal that was asked for, or None.
    """

    labels: npt.NDArray[np.int32]
    centers: npt.NDArray[np.int32]
    n_iter: int
    stop_reason: StopReason
    timings: dict[str, float] = field(repr=False)
    params: dict[str, Any] = field(repr=False)
    n_unreached: int = 0
    n_joined: int = 0
    n_merged: int = 0
    n_islands: int = 0
    sliver_share: float | None = None

    @property
    def n_segments(self) -> int:
        """Number of regions, K."""
        return len(self.centers)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        if copy is None:  # which `array` of numpy 1 does not take
            return np.asarray(self.labels, dtype=dtype)
        return np.array(self.labels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        return (
            f"Segmentation({len(self.labels)} cells, {self.n_segments} regions, "
            f"{self.n_iter} iterations, {self.stop_reason})"
        )


def segment_graph(
    graph: CellGraph,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    init: Init | Seeds = "geodesic",
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    islands: Islands = "keep",
    n_threads: int | None = None,
    progress: Progress | None = None,
) -> Segmentation:
    """Label every cell of a graph with one of k compact regions.

    This is the clustering of `segment` for cells of any kind, given by positions, measures and
    weighted arcs, without a mesh.

    Parameters
    ----------
    graph : CellGraph
    n_segments, radius, init, radius_factor, max_num_iter, tol, islands, n_threads, progress
        As for `segment`; `radius` is a fraction of the diagonal of ``graph.bounds``. Where arcs
        lead one way, cells that no path from a center leads to are islands, too.

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
    Segmentation(5 cells, 2 regions, 1 iterations, converged)

    A pair of cells, and one alone:

    >>> apart = CellGraph([[0, 0, 0], [1, 0, 0], [5, 0, 0]], [1, 1, 1], [0, 1, 2, 2], [1, 0],
    ...                   [1, 1])
    >>> segment_graph(apart, 1).labels, segment_graph(apart, 1, islands="nearest").labels
    (array([0, 0, 1], dtype=int32), array([0, 0, 0], dtype=int32))
    """
    checked_graph(graph)
    options = SizeOptions.checked(n_segments, radius, init)
    loop = LoopOptions.checked(max_num_iter, tol, radius_factor, islands, n_threads, progress)
    size = region_size(options, graph.measures, graph.diagonal, loop.n_threads)
    ordered = graph.ordered(loop.n_threads)
    return segment_cells(ordered, graph.bounds, size, options, init, loop)


def segment_cells(
    graph: _core.OrderedGraph,
    bounds: npt.NDArray[np.float64],
    size: RegionSize,
    options: SizeOptions,
    init: Init | Seeds,
    loop: LoopOptions,
) -> Segmentation:
    """Segment what has been checked, in regions of a size that is known."""
    timings = {"seeding": 0.0, "classify": 0.0, "update": 0.0}
    with timed(timings, "seeding", loop.on_stage):
        seeds = run_seeding(graph, bounds, size, options, init, loop.islands, loop.n_threads)
    clustering, n_iter, stop_reason = _iterate(graph, seeds, size.radius, loop, timings)
    labels, centers = clustering.labels(), clustering.centers()
    n_unreached = len(centers) - len(seeds)
    if loop.islands == "nearest":
        with timed(timings, "classify"):
            labels, n_unreached = _core.join_islands(graph, labels, loop.n_threads)
    params = {
        "n_segments": None if options.radius is not None else size.n_segments,
        "radius": options.radius,
        "expected_radius": size.radius,
        "init": init if isinstance(init, str) else "given",
        **loop.params,
    }
    return Segmentation(labels, centers, n_iter, stop_reason, timings, params, n_unreached)


def _iterate(
    graph: _core.OrderedGraph,
    seeds: npt.NDArray[np.int32],
    radius: float,
    loop: LoopOptions,
    timings: dict[str, float],
) -> tuple[_core.Clustering, int, StopReason]:
    """Classify and update until one of the stop rules holds; add up the time of both.

    What comes back is the classification by its own centers: the last move is dropped, whatever
    ends the loop.
    """
    reach = math.inf if loop.radius_factor is None else loop.radius_factor * radius
    with timed(timings, "classify", loop.on_stage):
        islands = CORE_ISLANDS[loop.islands]
        clustering = _core.Clustering(graph, seeds, reach, loop.n_threads, islands)
    seen: set[bytes] = set()
    for iteration in range(1, loop.max_num_iter + 1):
        centers = clustering.centers()
        with timed(timings, "update"):
            moved_to = clustering.update()
        n_moved = int(np.count_nonzero(moved_to != centers))
        seen.add(_fingerprint(centers))
        answer = None if loop.progress is None else loop.progress(iteration, n_moved)
        is_cancelled = isinstance(answer, (bool, np.bool_)) and not answer
        if n_moved == 0 or _root_mean_square_move(graph, centers, moved_to) <= loop.tol * radius:
            return clustering, iteration, "converged"
        if is_cancelled:
            return clustering, iteration, "cancelled"
        if _fingerprint(moved_to) in seen:
            return clustering, iteration, "cycle"
        if iteration < loop.max_num_iter:
            with timed(timings, "classify"):
                clustering.classify(moved_to)
    return clustering, loop.max_num_iter, "max_num_iter"


def _root_mean_square_move(
    graph: _core.OrderedGraph, centers: npt.NDArray[np.int32], moved_to: npt.NDArray[np.int32]
) -> float:
    moves = graph.positions_of(moved_to) - graph.positions_of(centers)
    return math.sqrt(float(np.mean(np.sum(moves * moves, axis=1))))


def _fingerprint(centers: npt.NDArray[np.int32]) -> bytes:
    """128 bits that tell sets of centers apart, so that the sets need not be kept."""
    return hashlib.blake2b(np.sort(centers).tobytes(), digest_size=16).digest()
