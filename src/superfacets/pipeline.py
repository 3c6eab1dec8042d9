"""From a mesh to its superfacets: all stages in a row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._timing import timed
from ._validate import checked_choice
from .adapters.convert import as_mesh
from .cells.cell_graph import OrderedCells
from .cells.face_graph import EdgeCounts, FaceGraph, build_face_graph
from .cells.weights import ArcWeights, crease_weights
from .clustering.loop import Loop, Progress, Segmentation, segment_cells
from .clustering.seeding import INITS, check_size, expected_radius
from .mesh.triangle_mesh import Mesh
from .regions.cleaning import Cleaning, clean
from .regions.regions import LabeledSurface

__all__ = ["PAPER", "segment"]

PAPER: Mapping[str, Any] = MappingProxyType(
    {
        "weights": "superfacets",
        "init": "farthest",
        "radius_factor": 2.0,
        "tol": 0.0,
        "smooth": False,
    }
)
"""Keywords that give the paper's algorithm to the letter: ``segment(mesh, 150, **PAPER)``.

Expansions are halted at 2 r and the loop ends when no center changes, with the weights of eq. 1-3
and seeds that are the farthest from each other in space; borders are left as they are.
"""


def segment(
    mesh: object,
    n_segments: int | None = None,
    *,
    radius: float | None = None,
    alpha: float | None = None,
    eta_convex: float | None = None,
    weights: str | npt.ArrayLike = "creases",
    init: str | npt.ArrayLike = "geodesic",
    radius_factor: float | None = None,
    max_num_iter: int = 50,
    tol: float = 0.02,
    enforce_connectivity: bool = False,
    min_size: float = 0.0,
    islands: str = "keep",
    smooth: bool = True,
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
        How much a convex crease counts against a concave one, >= 0. If not given, 0 with
        ``"creases"``, 0.2 with ``"superfacets"``; not used with ``"stk02"``.
    weights : {"creases", "superfacets", "stk02"} or array_like, shape (M,)
        Arc weights by name. ``"creases"`` (`crease_weights`): a crease costs the same to cross at
        every resolution of the mesh. ``"superfacets"`` (`superfacet_weights`): those of the paper.
        ``"stk02"`` (`stk02_weights`): those that the paper compares with. Or one per arc of
        ``build_face_graph(mesh, weld=weld)``, in units of the diagonal of the bounding box as
        these: `alpha` and `eta_convex` are then not used.
    init : {"geodesic", "farthest", "flood", "grid"} or array_like of int
        How seeds are placed, or the faces that are the seeds; see `place_seeds`. By default the
        farthest from each other by path length. ``"flood"`` and ``"grid"`` do not keep to k
        exactly.
    radius_factor : float, optional
        Not given: each face belongs to the center with the shortest path to it, and regions are
        connected. Given, the paper's way: an expansion halts at so many r from its center (2 in
        the paper); regions may fall apart.
    max_num_iter : int, default 50
        At most so many times all faces are labeled.
    tol : float, default 0.02
        Stop when the root mean square of the centers' moves is at most this fraction of r. 0:
        when no center changes, as in the paper.
    enforce_connectivity : bool, default False
        Where regions have fallen apart (with `radius_factor`), each keeps the piece that its center
        is in, and the others join a neighbor; see `enforce_connectivity`.
    min_size : float, default 0.0
        Regions smaller than this fraction of the mean region area join a neighbor, after which
        there are fewer than k; see `merge_small_regions`.
    islands : {"keep", "nearest"}
        What becomes of small regions that touch no other.
    smooth : bool, default True
        Make borders straight where the surface is smooth; see `smooth_borders`. Centers stay in
        their regions, and regions in one piece.
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
    loop = Loop.checked(max_num_iter, tol, radius_factor, n_threads, progress)
    chosen = ArcWeights.checked(weights, alpha, eta_convex)
    cleaning = Cleaning.checked(smooth, enforce_connectivity, min_size, islands)
    timings: dict[str, float] = {}
    radius_of = partial(expected_radius, n_segments=n_segments, radius=radius, init=init)
    ordered, unlabeled = _order_cells(mesh, weld, chosen, radius_of, loop.n_threads, timings)
    result = segment_cells(ordered, n_segments, radius, init, loop)
    del ordered  # makes room
    if cleaning.is_needed:
        with timed(timings, "regions"):
            labeled = unlabeled.with_labels(result, loop.n_threads)
            del unlabeled
            result = clean(labeled, result, cleaning)
    params = {"weld": weld, **chosen.params, **result.params, **cleaning.params}
    return replace(result, timings=_in_order(timings | result.timings), params=params)


def _order_cells(
    mesh: object, weld: bool, chosen: ArcWeights, radius_of: Callable[[FaceGraph], float],
    n_threads: int, timings: dict[str, float],
) -> tuple[OrderedCells, _Unlabeled]:  # fmt: skip
    """Run stages 0 to 2, order the cells, and return what later stages need, and no more."""
    with timed(timings, "mesh"):
        surface = as_mesh(mesh)
    with timed(timings, "face_graph"):
        faces = build_face_graph(surface, weld=weld, n_threads=n_threads)
    with timed(timings, "weights"):
        radius = radius_of(faces)
        weights = chosen.weigh(surface, faces, radius, n_threads)
        lengths, unit = faces.quantized(weights, n_threads)
        del weights  # makes room
    with timed(timings, "order"):
        cells = (faces.positions, faces.measures, faces.offsets, faces.neighbors, lengths)
        bounds = faces.bounds
        unlabeled = _Unlabeled.of(surface, faces, chosen, radius, (lengths, unit))
        del faces  # what is kept of it takes less
        return OrderedCells(_core.OrderedGraph(*cells, n_threads), bounds), unlabeled


@dataclass(frozen=True)
class _Unlabeled:
    """What the clean-up of regions needs of a mesh, kept as small as it gets until it has labels.

    Positions and areas of faces are made anew, and of weights what paths were measured by is kept.
    """

    mesh: Mesh
    offsets: npt.NDArray[np.int64]
    neighbors: npt.NDArray[np.int32]
    sides: npt.NDArray[np.uint8]
    same_turn: npt.NDArray[np.uint8] | None  # None: 0 everywhere
    edge_counts: EdgeCounts
    chosen: ArcWeights
    radius: float  # expected of a region
    lengths: npt.NDArray[np.float32]
    unit: float

    @classmethod
    def of(
        cls, mesh: Mesh, faces: FaceGraph, chosen: ArcWeights, radius: float,
        quantized: tuple[npt.NDArray[np.float32], float],
    ) -> _Unlabeled:  # fmt: skip
        return cls(
            mesh, faces.offsets, faces.neighbors, faces.sides.astype(np.uint8),
            faces.same_turn if faces.same_turn.any() else None, faces.edge_counts,
            chosen, radius, *quantized,
        )  # fmt: skip

    def with_labels(self, result: Segmentation, n_threads: int) -> LabeledSurface:
        faces = self._faces(n_threads)
        if self.chosen.params["weights"] in ("creases", "given"):
            # With numpy 1, a scalar of another type would leave the product in float32.
            weights = np.multiply(self.lengths, self.unit, dtype=np.float64)
        else:  # other units, or other prices at other resolutions
            weights = crease_weights(self.mesh, faces, self.radius, n_threads=n_threads)
        return LabeledSurface(
            self.mesh, faces, weights, result.labels, result.n_segments,
            self.radius or faces.diagonal, n_threads,
        )  # fmt: skip

    def _faces(self, n_threads: int) -> FaceGraph:
        centroids, areas = _core.measure_faces(self.mesh.vertices, self.mesh.faces, n_threads)
        same_turn = self.same_turn
        if same_turn is None:
            same_turn = np.zeros(len(self.neighbors), np.uint8)
        return FaceGraph._unchecked(
            self.edge_counts,
            positions=centroids,
            measures=areas,
            offsets=self.offsets,
            neighbors=self.neighbors,
            sides=self.sides.astype(np.uint16),
            same_turn=same_turn,
            bounds=self.mesh.bounds,
        )


def _in_order(timings: dict[str, float]) -> dict[str, float]:
    """The stages in the order in which they run."""
    last = {"regions": timings.pop("regions")} if "regions" in timings else {}
    return timings | last
