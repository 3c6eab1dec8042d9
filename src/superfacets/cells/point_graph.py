"""Stages 1 and 2 for point clouds: neighbors, areas, normals and weights."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Array, Floats, Ints, Longs, Viewpoint
from .._validate import (
    check_spread,
    checked_count,
    checked_normals,
    checked_number,
    checked_threads,
)
from ..adapters.convert import CloudLike, as_cloud
from ..mesh.point_cloud import PointCloud
from .cell_graph import ArcMeasures, Arcs, CellGraph
from .surface import Surface
from .weights import NO_NORMALS, WEIGHTS, EdgeFactors, weights_of

N_NEIGHBORS = 6
"""Number of nearest neighbors with an arc. With reverse arcs, a point has seven on average."""

N_AROUND = 12
"""Number of nearest neighbors for the estimate of a normal."""

CUTOFF = 4.0
"""Longest arc, in square roots of the smaller area at its ends. For uniformly random points, one in
ten thousand of the six nearest neighbors is farther away than 3.3."""


OPEN_SHARE = 0.05
"""A cloud counts as an open surface if the length of its area-weighted mean normal exceeds this
value. Rooms without a ceiling have 0.2 or more. Of 95 closed benchmark models, none counts as open
if sampled at 100,000 points. At 5,000 points 14 models count as open, because some normals are
wrong."""


@dataclass(frozen=True, eq=False)
class PointGraph(Arcs):
    """Points as cells, with arcs between near points; arrays come from kernels, unchecked."""

    positions: Floats  # (N, 3)
    measures: Floats  # (N,) area around each point
    normals: Floats  # (N, 3)
    offsets: Longs  # (N + 1,)
    neighbors: Ints  # (M,) ascending for each point
    order: Ints  # (N,) all cells along a space-filling curve
    bounds: Floats  # (2, 3)
    points: Ints | None = None  # (N,) index of each cell in the cloud; None: 0 to N - 1
    knows_turns: bool = True  # whether normals distinguish concave from convex creases


def find_point_graph(
    cloud: PointCloud,
    n_threads: int,
    *,
    n_neighbors: int = N_NEIGHBORS,
    n_around: int = N_AROUND,
    cutoff: float = CUTOFF,
) -> PointGraph:
    """Return the graph of a cloud; a MeshError if all points coincide."""
    check_spread(cloud.bounds)
    offsets, neighbors, measures, normals, order = _core.build_point_graph(
        cloud.points,
        n_neighbors,
        max(n_neighbors, n_around),
        cutoff,
        cloud.normals is not None,
        _axes_of(cloud),
        n_threads,
    )
    graph = PointGraph(cloud.points, measures, normals, offsets, neighbors, order, cloud.bounds)
    return _with_normals_of(cloud, graph)


def _axes_of(cloud: PointCloud) -> Floats:
    """Return the axes of a cloud for the core; empty if the cloud has no axes."""
    return NO_NORMALS if cloud.axes is None else cloud.axes


def _with_normals_of(cloud: PointCloud, graph: PointGraph) -> PointGraph:
    """Return the graph with the normals of the cloud, or with estimates that face the viewpoint."""
    if cloud.normals is not None:
        given = cloud.normals if graph.points is None else cloud.normals[graph.points]
        return replace(graph, normals=given)
    if cloud.viewpoints is not None:
        places = cloud.viewpoints
        if places.ndim == 2 and graph.points is not None:
            places = places[graph.points]
        normals = _turned_to(places, graph)
        return replace(graph, normals=checked_normals(normals, len(normals)))
    normal_sum = np.einsum("i,ij->j", graph.measures, graph.normals)
    return replace(graph, knows_turns=not is_open(normal_sum, graph.measures.sum()))


def is_open(normal_sum: Floats, area: float) -> bool:
    """Return whether the area-weighted sum of normals shows that a surface is open.

    Estimated normals point outwards, which may be wrong on an open surface: in a room seen from
    within, concave edges then look convex.
    """
    return bool(np.linalg.norm(normal_sum) > OPEN_SHARE * area)


def find_sorted_graph(cloud: PointCloud, n_threads: int) -> PointGraph:
    """Return the graph of a cloud with cells sorted along a space-filling curve.

    Later stages are two to three times as fast as with points in random order. Raises a MeshError
    if all points coincide.
    """
    check_spread(cloud.bounds)
    has_normals = cloud.normals is not None
    positions, offsets, neighbors, measures, normals, points = _core.build_sorted_point_graph(
        cloud.points, N_NEIGHBORS, N_AROUND, CUTOFF, has_normals, _axes_of(cloud), n_threads
    )
    order = np.arange(len(points), dtype=np.int32)
    graph = PointGraph(
        positions, measures, normals, offsets, neighbors, order, cloud.bounds, points
    )
    return _with_normals_of(cloud, graph)


def bare_point_surface(cloud: PointCloud, graph: PointGraph, n_threads: int) -> Surface:
    """Return the points as cells without normals, which saves a tenth of all memory."""
    return point_surface(cloud, replace(graph, normals=NO_NORMALS), n_threads)


def point_surface(cloud: PointCloud, graph: PointGraph, n_threads: int) -> Surface:
    """Return the points of a cloud as cells."""
    handle = _core.PointSurface(
        graph.positions, graph.measures, graph.normals, graph.order, graph.offsets, graph.neighbors
    )
    return Surface(handle, graph.offsets, graph.neighbors, cloud.bounds, graph.diagonal, n_threads)


def build_point_graph(
    cloud: CloudLike,
    n_neighbors: int = N_NEIGHBORS,
    *,
    cutoff: float = CUTOFF,
    expected_radius: float = 0.0,
    alpha: float = WEIGHTS["creases"].defaults["alpha"],
    eta_convex: float = WEIGHTS["creases"].defaults["eta_convex"],
    ridges: float = WEIGHTS["creases"].defaults["ridges"],
    n_threads: int | None = None,
) -> CellGraph:
    r"""Return the points of a cloud as cells, with arcs between near points.

    Two points are neighbors if one is among the `n_neighbors` nearest points of the other, and
    their distance is at most `cutoff` times the square root of the smaller of the two areas around
    them. The graph is symmetric. If points are spread evenly, the components of the graph are the
    components of the sampled surface. Duplicate points are joined to the lowest point at their
    position by arcs of length 0, and share its area.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        As for `segment`.
    n_neighbors : int, default 6
        Number of nearest neighbors with an arc. Ties go to the lowest index.
    cutoff : float, default 4.0
        Longest arc, > 0, as a multiple of the square root of the smaller area at both ends. The
        cutoff keeps outliers, and points across a gap, from becoming neighbors.
    expected_radius : float, default 0.0
        r = sqrt(A / (pi k)), >= 0, in the unit of the points, for weights like `crease_weights` of
        meshes. With 0, weights are distances.
    alpha, eta_convex
        As for `crease_weights`.
    ridges : float, default 0.35
        Weight of ridges relative to concave edges, >= 0. No effect if less than `eta_convex`. A
        ridge is a sharp edge between two flat sides that meet at 40 degrees or more. Where
        estimated normals blur an edge over more than the expected radius, there is no ridge.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    CellGraph
        ``measures`` holds the area around each point, :math:`2 \pi \overline{d^2} / (n + 1)` for
        the distances d of its n neighbors. This estimate is unbiased for uniformly random points,
        and 0 for a point without arcs. ``weights`` are in units of the diagonal. ``arc_measures``
        holds for each arc the length of the border that it crosses, the mean of :math:`\pi a / \sum
        d` at both points, so that the arcs across a line sum to the length of the line; and the
        angle between the normals, positive if the points are above each other's tangent planes.
        Normals are from the cloud, or from `estimate_normals`.

    Raises
    ------
    MeshError
        If the cloud is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(N log N) in practice. `segment` computes arc measures only near borders, to save memory.

    Examples
    --------
    Three points on a line, and a distant point:

    >>> graph = build_point_graph([[0, 0, 0], [1, 0, 0], [2, 0, 0], [90, 0, 0]], 2)
    >>> [graph.neighbors[a:b].tolist() for a, b in zip(graph.offsets, graph.offsets[1:])]
    [[1, 2], [0, 2], [0, 1], []]
    """
    checked = as_cloud(cloud)
    threads = checked_threads(n_threads)
    n_neighbors = checked_count(n_neighbors, "n_neighbors")
    cutoff = checked_number(cutoff, "cutoff", zero=False)
    radius = checked_number(expected_radius, "expected_radius", zero=True)
    alpha = checked_number(alpha, "alpha", zero=True)
    eta_convex = checked_number(eta_convex, "eta_convex", zero=True)
    ridges = checked_number(ridges, "ridges", zero=True)
    n_neighbors = min(n_neighbors, checked.n_points - 1)
    graph = find_point_graph(checked, threads, n_neighbors=n_neighbors, cutoff=cutoff)
    surface = point_surface(checked, graph, threads)
    cells = (graph.positions, graph.measures, NO_NORMALS)
    factors = EdgeFactors.of_radius(radius, alpha, eta_convex, ridges)
    return CellGraph(
        graph.positions,
        graph.measures,
        graph.offsets,
        graph.neighbors,
        weights_of(surface, cells, factors),
        graph.bounds,
        weight_unit=graph.diagonal,
        arc_measures=ArcMeasures(*surface.handle.arc_measures(threads)),
    )


def estimate_normals(
    cloud: CloudLike,
    *,
    n_neighbors: int = N_AROUND,
    viewpoint: npt.ArrayLike | None = None,
    n_threads: int | None = None,
) -> Floats:
    """Return the normal of each point: the direction of least variance of its neighbors.

    Normals are flipped so that neighbors agree, along a minimum spanning tree of each component of
    the neighbor graph (Hoppe et al. 1992). Without a viewpoint, all normals of a component are then
    flipped if necessary, so that they point outwards (the enclosed volume is positive). This is
    right for solids. On an open surface, normals point to the side that bulges out. If this is
    wrong, as in a room scanned from within, give the viewpoint of the scanner.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        As for `segment`. Existing normals are ignored. Existing axes are used as directions.
    n_neighbors : int, default 12
        Number of nearest neighbors per normal. More neighbors reduce noise, but also smooth edges.
    viewpoint : array_like, shape (3,), optional
        Position of the scanner. The normals of each component are flipped so that most of them, by
        area, face the scanner. For terrain, give a point far above. By default the viewpoints of
        the cloud, if it has any.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of float64, shape (N, 3)
        Unit vectors; zero if the neighbors lie on a line.

    Raises
    ------
    MeshError
        If the cloud is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    References
    ----------
    Hoppe, DeRose, Duchamp, McDonald and Stuetzle, "Surface Reconstruction from Unorganized Points",
    1992.

    Examples
    --------
    >>> grid = [[x, y, 0] for x in range(4) for y in range(4)]
    >>> estimate_normals(grid, viewpoint=[0, 0, 9])[:, 2].round(3).min().tolist()
    1.0
    """
    checked = as_cloud(cloud)
    threads = checked_threads(n_threads)
    n_neighbors = min(checked_count(n_neighbors, "n_neighbors"), checked.n_points - 1)
    views = checked.viewpoints if viewpoint is None else np.array(checked_viewpoint(viewpoint))
    bare = PointCloud(checked.points, axes=checked.axes)
    graph = find_point_graph(
        bare, threads, n_neighbors=min(n_neighbors, N_NEIGHBORS), n_around=n_neighbors
    )
    return graph.normals if views is None else _turned_to(views, graph)


def checked_viewpoint(viewpoint: npt.ArrayLike) -> Viewpoint:
    """Return a viewpoint as three finite numbers; a ValueError for anything else."""
    place = np.asarray(viewpoint, dtype=np.float64)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise ValueError(f"viewpoint must be three finite numbers, got {viewpoint!r}")
    x, y, z = place.tolist()
    return x, y, z


def _turned_to(places: Floats, graph: PointGraph) -> Floats:
    """Return normals, flipped per component so that most of its area faces the viewpoints."""
    labels = np.zeros(len(graph.positions), np.int32)
    components, n_components = _core.find_components(graph.offsets, graph.neighbors, labels)
    facing = facing_areas(places, graph.positions, graph.normals, graph.measures)
    sums: Array = np.bincount(components, weights=facing, minlength=n_components)
    return np.where(sums[components] < 0, -1.0, 1.0)[:, None] * graph.normals


def facing_areas(
    places: npt.ArrayLike, positions: Floats, normals: Floats, measures: Floats
) -> Floats:
    """Return the visible area of each point from a place, negative if seen from behind.

    `places` is one position for all points, or one per point.
    """
    toward = np.asarray(places) - positions
    farthest = np.abs(toward).max(axis=1, keepdims=True)
    np.divide(toward, farthest, out=toward, where=farthest > 0)  # keeps squares from overflowing
    facing = measures * np.einsum("ij,ij->i", normals, toward)
    lengths = np.sqrt(np.einsum("ij,ij->i", toward, toward))
    np.divide(facing, lengths, out=facing, where=lengths > 0)
    return np.asarray(facing)
