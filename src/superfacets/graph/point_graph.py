"""Build graphs of the points of a cloud. Compute areas around points, and normals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import check_extent, checked_normals
from ..base.types import Bools, Floats, Ints, Longs, Viewpoint
from ..mesh.point_cloud import PointCloud
from .cell_graph import BaseGraph
from .sums import sums_by_label
from .surface import NO_NORMALS, Surface

N_NEIGHBORS = 6
"""Number of nearest neighbors to which each point gets an arc, if they are not too far (see
`CUTOFF`). All arcs get a reverse arc, so that a point has seven arcs on average."""

N_AROUND = 12
"""Number of nearest neighbors from which the normal of a point is estimated."""

CUTOFF = 4.0
"""Maximum length of an arc, as a multiple of the square root of an area: the smaller of the areas
around its two points. For uniformly random points, only one in ten thousand of the six nearest
neighbors is farther away than 3.3 times this square root."""

MAX_AREA = 30.0
"""Maximum area around a point, as a multiple of the area that is exceeded around 1 % of the points.
Without the maximum, a few points of noise, far from all others, would get many of the regions."""

OPEN_SHARE = 0.05
"""A cloud is treated as an open surface if the length of its area-weighted mean normal exceeds this
value. The length is 0.2 or more for rooms without a ceiling. It is below 0.05 for all 95 closed
benchmark models sampled at 100,000 points. With 5,000 points, it is above 0.05 for 14 of these
models, because some estimated normals are wrong."""


@dataclass(frozen=True, eq=False)
class PointGraph(BaseGraph):
    """Graph of the points of a cloud, with arcs between near points. Its arrays are not checked."""

    positions: Floats  # (N, 3) position of each point
    measures: Floats  # (N,) area around each point
    normals: Floats  # (N, 3) unit normal of each point; 0 if undefined
    offsets: Longs  # (N + 1,) index of the first arc of each point
    neighbors: Ints  # (M,) target point of each arc; in ascending order for each start point
    order: Ints  # (N,) indices of the points in the order of a space-filling curve
    bounds: Floats  # (2, 3) minimum and maximum corner of the bounding box
    # (N,) index of each point in the cloud; None if the points are in the order of the cloud
    points: Ints | None = None
    tells_concave: bool = True  # whether normals distinguish concave from convex creases


def find_point_graph(
    cloud: PointCloud, n_threads: int, *, n_neighbors: int = N_NEIGHBORS,
    cutoff: float = CUTOFF, is_kept: Bools | None = None, is_sorted: bool = False,
) -> PointGraph:  # fmt: skip
    """Return the graph of a cloud, or raise a MeshError if all points coincide.

    Points that are not in `is_kept`, (N,), have no arcs and no area. If `is_sorted`, points are
    sorted along a curve (others last), which makes later stages two to three times as fast.
    """
    part, kept = _kept_part(cloud, is_kept)
    check_extent(part.bounds, "points", "cloud")
    axes, has_normals = NO_NORMALS if part.axes is None else part.axes, part.normals is not None
    offsets, neighbors, measures, normals, order, positions = _core.build_point_graph(
        part.points, n_neighbors, max(n_neighbors, N_AROUND), cutoff, has_normals, axes, is_sorted,
        n_threads,
    )  # fmt: skip
    np.minimum(measures, MAX_AREA * np.quantile(measures, 0.99) or np.inf, out=measures)
    points = None
    if is_sorted:
        points, order = order, np.arange(len(order), dtype=np.int32)
    else:
        positions = part.points
    graph = PointGraph(positions, measures, normals, offsets, neighbors, order, part.bounds, points)
    graph = _with_normals_of(part, graph)
    if kept is None:
        return graph
    if points is None:
        return _widened(graph, kept, cloud.points)
    left_out = np.delete(np.arange(cloud.n_points, dtype=np.int32), kept)
    points = np.concatenate([kept[points], left_out])
    return replace(_widened(graph, order, cloud.points[points]), points=points)


def _kept_part(cloud: PointCloud, is_kept: Bools | None) -> tuple[PointCloud, Ints | None]:
    """Return a cloud of the kept points and their indices; if they coincide, `cloud` and None."""
    if is_kept is None or is_kept.all():
        return cloud, None
    kept = np.flatnonzero(is_kept).astype(np.int32)
    part = cloud.taken(kept)
    if np.array_equal(*part.bounds):
        return cloud, None
    return part, kept


def _widened(graph: PointGraph, places: Ints, positions: Floats) -> PointGraph:
    """Add points without arcs to a graph, whose points are at `places` in `positions`, (N, 3)."""
    n_points = len(positions)
    measures, normals = np.zeros(n_points), np.zeros((n_points, 3))
    counts = np.zeros(n_points, np.int64)
    measures[places], normals[places] = graph.measures, graph.normals
    counts[places] = np.diff(graph.offsets)
    added = np.delete(np.arange(n_points, dtype=np.int32), places)
    return replace(
        graph, positions=positions, measures=measures, normals=normals,
        offsets=np.concatenate([[0], np.cumsum(counts)]), neighbors=places[graph.neighbors],
        order=np.concatenate([places[graph.order], added]),
    )  # fmt: skip


def _with_normals_of(cloud: PointCloud, graph: PointGraph) -> PointGraph:
    """Return the graph with the normals of the cloud if it has any, or with estimated normals.

    `_core` estimates them as in Hoppe, DeRose, Duchamp, McDonald and Stuetzle, "Surface
    Reconstruction from Unorganized Points", 1992: neighbors vary least along a normal. Normals are
    flipped along a minimum spanning tree of each component so that neighbors agree, and then so
    that the enclosed volume is positive or, with viewpoints, as in `_are_turned_away`.
    """
    if cloud.normals is not None:
        given = cloud.normals if graph.points is None else cloud.normals[graph.points]
        return replace(graph, normals=given)
    if cloud.viewpoints is not None:
        viewpoints = cloud.viewpoints
        if viewpoints.ndim == 2 and graph.points is not None:
            viewpoints = viewpoints[graph.points]
        one_label = np.zeros(len(graph.positions), np.int32)
        components, n_components = _core.find_components(*graph.arcs, one_label)
        is_flipped = _are_turned_away(components, n_components, viewpoints, graph)
        normals = np.where(is_flipped[components], -1.0, 1.0)[:, None] * graph.normals
        return replace(graph, normals=checked_normals(normals, len(normals)))
    # On open surfaces, as a room scanned from inside, estimated normals may be on the wrong side.
    normal_sum = np.einsum("i,ij->j", graph.measures, graph.normals)
    is_open = bool(np.linalg.norm(normal_sum) > OPEN_SHARE * graph.measures.sum())
    return replace(graph, tells_concave=not is_open)


def point_surface(graph: PointGraph, n_threads: int) -> Surface:
    """Return the `Surface` of the graph of a cloud."""
    handle = _core.PointSurface(
        graph.positions, graph.measures, graph.normals, graph.order, graph.offsets, graph.neighbors
    )
    return Surface(handle, graph.offsets, graph.neighbors, graph.bounds, graph.diagonal, n_threads)


def checked_viewpoint(viewpoint: npt.ArrayLike) -> Viewpoint:
    """Return a viewpoint as (x, y, z); raise a ValueError unless it is three finite numbers."""
    position = np.asarray(viewpoint, dtype=np.float64)
    if position.shape != (3,) or not np.isfinite(position).all():
        raise ValueError(f"viewpoint must be three finite numbers, got {viewpoint!r}")
    x, y, z = position.tolist()
    return x, y, z


def _are_turned_away(
    components: Ints, n_components: int, viewpoints: Floats, graph: PointGraph
) -> Bools:
    """Return which components must be flipped, assuming that normals point outward, (C,).

    An open component is flipped if most of it is seen from behind. A closed component is flipped
    only if a viewpoint is inside, where the surface covers a solid angle of 4 pi.
    """
    measures, toward = graph.measures, viewpoints - graph.positions
    farthest = np.abs(toward).max(axis=1, keepdims=True)
    np.divide(toward, farthest, out=toward, where=farthest > 0)  # avoids overflow of squares
    facing = measures * np.einsum("ij,ij->i", graph.normals, toward)  # < 0 if seen from behind
    lengths = np.sqrt(np.einsum("ij,ij->i", toward, toward))
    np.divide(facing, lengths, out=facing, where=lengths > 0)
    is_behind = sums_by_label(components, facing, n_components) < 0
    if viewpoints.ndim == 2:  # each point is visible from its own viewpoint
        return np.asarray(is_behind)
    distances = farthest[:, 0] * lengths
    with np.errstate(over="ignore"):  # converts areas to solid angles
        np.divide(-facing, distances * distances, out=facing, where=distances > 0)
    normal_sums = [
        sums_by_label(components, measures * axis, n_components) for axis in graph.normals.T
    ]
    areas = sums_by_label(components, measures, n_components)
    is_closed = np.linalg.norm(normal_sums, axis=0) <= OPEN_SHARE * areas
    angles = sums_by_label(components, facing, n_components)
    return np.where(is_closed, angles > 2.0 * np.pi, is_behind)
