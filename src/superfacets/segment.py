"""Stage 4: the loop. Place seeds; label all cells; move the centers; repeat."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _core
from ._timing import timed
from ._validate import (
    checked_callable,
    checked_choice,
    checked_count,
    checked_number,
    checked_threads,
)
from .cell_graph import CellGraph, OrderedCells, checked_graph
from .face_graph import build_face_graph
from .mesh import as_mesh
from .seeding import INITS, check_size, expected_radius, region_size, run_seeding
from .weights import ArcWeights

__all__ = ["PAPER", "Segmentation", "segment", "segment_graph"]

PAPER: Mapping[str, Any] = MappingProxyType(
    {"weights": "superfacets", "radius_factor": 2.0, "tol": 0.0}
)
"""Keywords that give the paper's algorithm to the letter: ``segment(mesh, 150, **PAPER)``.

Expansions are halted at 2 r and the loop ends when no center changes, with the weights of eq. 1-3.
"""

StopReason = Literal["converged", "cycle", "max_num_iter", "cancelled"]
Progress = Callable[[int, int], object]


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Superfacets: a label for every face, and how they came about.

    ``np.asarray(segmentation)`` is ``labels``.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Region of each face, 0..K-1, in the order of the input.
    centers : ndarray of int32, shape (K,)
        The face that stands for each region; the labels are the classification of these.
    n_segments : int
        Number of regions, K.
    n_iter : int
        How many times all faces were labeled.
    stop_reason : {"converged", "cycle", "max_num_iter", "cancelled"}
        The centers moved less than `tol`; a set of centers came back; as many iterations as
        allowed; `progress` returned False.
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

    @property
    def n_segments(self) -> int:
        """Number of regions, K."""
        return len(self.centers)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        return np.array(self.labels, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        return (
            f"Segmentation({len(self.labels)} cells, {self.n_segments} regions, "
            f"{self.n_iter} iterations, {self.stop_reason})"
        )


def segment(
    mesh: object,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    alpha: float | None = None,
    eta_convex: float | None = None,
    weights: str | npt.ArrayLike = "superfacets",
    init: str | npt.ArrayLike = "farthest",
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    weld: bool = True,
    n_threads: int | None = None,
    progress: Progress | None = None,
) -> Segmentation:
    """Label every face of a mesh with one of k compact regions that follow its concave creases.

    Parameters
    ----------
    mesh : Mesh, (vertices, faces) pair, path, or mesh of trimesh, PyVista or Open3D
        Any triangle mesh: open, non-manifold, inconsistently oriented, degenerate, in many
        components, or soup.
    n_segments : int, optional
        Number of regions k, 1 to the number of faces. 150 (or the number of faces, if that is
        less) if neither this nor `radius` is given. One more region comes for each component that
        gets no seed, and, with `radius_factor`, for faces that no center reaches.
    radius : float, optional
        Expected radius r of a region instead, as a fraction of the diagonal of the bounding box.
    alpha : float, optional
        How much borders follow creases. 0: regions as compact as they get. If not given, 20 with
        ``"creases"``, 200 with ``"superfacets"``, and any number >= 0; 0.5 with ``"stk02"``, and 0
        to 1.
    eta_convex : float, optional
        How much a convex crease counts against a concave one, >= 0. If not given, 0.05 with
        ``"creases"``, 0.2 with ``"superfacets"``; not used with ``"stk02"``.
    weights : {"superfacets", "creases", "stk02"} or array_like, shape (M,)
        Arc weights by name. ``"superfacets"``: those of the paper (`superfacet_weights`).
        ``"creases"``: the same, but that a crease costs what it costs whatever the length of the
        edges along it: the expected radius r stands for the length of each edge. ``"stk02"``: those
        that the paper compares with (`stk02_weights`). Or one per arc of
        ``build_face_graph(mesh, weld=weld)``: `alpha` and `eta_convex` are then not used.
    init : {"farthest", "geodesic", "flood", "grid"} or array_like of int
        How seeds are placed, or the faces that are the seeds; see `place_seeds`. ``"flood"`` and
        ``"grid"`` do not keep to k exactly.
    radius_factor : float, optional
        Not given: each face belongs to the center with the shortest path to it, and regions are
        connected. Given, the paper's way: an expansion halts at so many r from its center (2 in
        the paper); regions may fall apart.
    max_num_iter : int, default 50
        At most so many times all faces are labeled.
    tol : float, default 0.02
        Stop when the root mean square of the centers' moves is at most this fraction of r. 0:
        when no center changes, as in the paper.
    weld : bool, default True
        Count vertices at exactly the same position as one.
    n_threads : int, optional
        Threads to use: the environment variable ``SUPERFACETS_NUM_THREADS``, or one per core, if
        not given. The labels do not depend on it. (To check the arrays of a new mesh or graph, the
        variable counts, or all cores, in any case.)
    progress : callable, optional
        Called after each iteration with its number (from 1) and how many centers it moved;
        returning False ends the loop with ``stop_reason="cancelled"``.

    Returns
    -------
    Segmentation
        Labels are int32, 0..K-1, one per face in the order of the input, and the same each time.

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
    check_size(n_segments, radius)
    if isinstance(init, str):
        checked_choice(init, "init", INITS)
    loop = _Loop.checked(max_num_iter, tol, radius_factor, n_threads, progress)
    chosen = ArcWeights.checked(weights, alpha, eta_convex)
    params = {"weld": weld, **chosen.params}
    timings: dict[str, float] = {}
    with timed(timings, "mesh"):
        surface = as_mesh(mesh)
    with timed(timings, "face_graph"):
        faces = build_face_graph(surface, weld=weld, n_threads=loop.n_threads)
    with timed(timings, "weights"):
        r = expected_radius(faces, n_segments, radius, init)
        lengths = faces.quantized(chosen.weigh(surface, faces, r, loop.n_threads), loop.n_threads)
    with timed(timings, "order"):
        cells, bounds = (
            (faces.positions, faces.measures, faces.offsets, faces.neighbors),
            faces.bounds,
        )
        del surface, faces, weights, chosen  # what is not needed any more makes room
        ordered = OrderedCells(_core.OrderedGraph(*cells, lengths, loop.n_threads), bounds)
        del cells, lengths
    result = _segment_cells(ordered, n_segments, radius, init, loop)
    return replace(result, timings=timings | result.timings, params=params | result.params)


def segment_graph(
    graph: CellGraph,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    init: str | npt.ArrayLike = "farthest",
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    n_threads: int | None = None,
    progress: Progress | None = None,
) -> Segmentation:
    """Label every cell of a graph of one's own with one of k compact regions.

    The clustering behind `segment`, for cells of any kind: it knows positions, measures and
    weighted arcs, and no mesh.

    Parameters
    ----------
    graph : CellGraph
    n_segments, radius, init, radius_factor, max_num_iter, tol, n_threads, progress
        As for `segment`; `radius` is a fraction of the diagonal of ``graph.bounds``.

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
    """
    checked_graph(graph)
    check_size(n_segments, radius)
    loop = _Loop.checked(max_num_iter, tol, radius_factor, n_threads, progress)
    return _segment_cells(graph.ordered(loop.n_threads), n_segments, radius, init, loop)


@dataclass(frozen=True)
class _Loop:
    """Checked parameters of the loop."""

    max_num_iter: int
    tol: float  # in radii
    radius_factor: float | None  # None: exact
    n_threads: int
    progress: Progress | None

    @classmethod
    def checked(
        cls, max_num_iter: int, tol: float, radius_factor: float | None, n_threads: int | None,
        progress: Progress | None,
    ) -> _Loop:  # fmt: skip
        if radius_factor is not None:
            radius_factor = checked_number(radius_factor, "radius_factor", zero=False)
        return cls(
            checked_count(max_num_iter, "max_num_iter"),
            checked_number(tol, "tol", zero=True),
            radius_factor,
            checked_threads(n_threads),
            checked_callable(progress, "progress"),
        )


def _segment_cells(
    cells: OrderedCells,
    n_segments: int | None,
    radius: float | None,
    init: str | npt.ArrayLike,
    loop: _Loop,
) -> Segmentation:
    timings = {"seeding": 0.0, "classify": 0.0, "update": 0.0}
    with timed(timings, "seeding"):
        size = region_size(cells, n_segments, radius, init)
        seeds = run_seeding(cells, size, n_segments, init, loop.n_threads)
    clustering, n_iter, stop_reason = _iterate(cells.graph, seeds, size.radius, loop, timings)
    params = {
        "n_segments": None if radius is not None else size.n_segments,
        "radius": radius,
        "expected_radius": size.radius,
        "init": init if isinstance(init, str) else "given",
        "radius_factor": loop.radius_factor,
        "max_num_iter": loop.max_num_iter,
        "tol": loop.tol,
    }
    labels, centers = clustering.labels(), clustering.centers()
    return Segmentation(labels, centers, n_iter, stop_reason, timings, params)


def _iterate(
    graph: _core.OrderedGraph,
    seeds: npt.NDArray[np.int32],
    radius: float,
    loop: _Loop,
    timings: dict[str, float],
) -> tuple[_core.Clustering, int, StopReason]:
    """Classify and update until one of the stop rules holds; add up the time of both.

    What comes back is the classification by its own centers: the last move is dropped, whatever
    ends the loop.
    """
    reach = math.inf if loop.radius_factor is None else loop.radius_factor * radius
    with timed(timings, "classify"):
        clustering = _core.Clustering(graph, seeds, reach, loop.n_threads)
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
