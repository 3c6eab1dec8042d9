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
"""Nearest neighbors that arcs lead to. With arcs back, a point has seven on average."""

N_AROUND = 12
"""Nearest neighbors that a normal is estimated from."""

CUTOFF = 4.0
"""Longest arc, in square roots of the smaller area at its ends. Among points spread at random, one
in ten thousand of the six nearest neighbors is farther than 3.3."""


OPEN_SHARE = 0.05
"""Length of the mean normal, weighted by area, from which a cloud is an open surface. Rooms without
a ceiling have 0.2 or more. None of 95 closed benchmark models, sampled at 100,000 points, counts as
open; at 5,000 points 14 do, because normals are wrong in places."""


@dataclass(frozen=True, eq=False)
class PointGraph(Arcs):
    """Points as cells, with arcs between near points; made by a kernel, so not checked."""

    positions: Floats  # (N, 3)
    measures: Floats  # (N,) area around each point
    normals: Floats  # (N, 3)
    offsets: Longs  # (N + 1,)
    neighbors: Ints  # (M,) ascending for each point
    order: Ints  # (N,) all cells along a space-filling curve
    bounds: Floats  # (2, 3)
    points: Ints | None = None  # (N,) index of each cell in the cloud; None: 0 to N - 1
    knows_turns: bool = True  # whether the signs of normals tell concave from convex


def find_point_graph(
    cloud: PointCloud,
    n_threads: int,
    *,
    n_neighbors: int = N_NEIGHBORS,
    n_around: int = N_AROUND,
    cutoff: float = CUTOFF,
) -> PointGraph:
    """Return the graph of a cloud; a MeshError if all points lie at one place."""
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
    """Return the axes of a cloud that has any, for the core."""
    return NO_NORMALS if cloud.axes is None else cloud.axes


def _with_normals_of(cloud: PointCloud, graph: PointGraph) -> PointGraph:
    """Return the graph with the normals of the cloud, or estimated ones that face the viewpoint."""
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
    """Whether normals, summed by area, are those of an open surface.

    Estimated normals point outwards. That is a guess for an open surface, such as a room seen from
    within, where concave edges are convex then.
    """
    return bool(np.linalg.norm(normal_sum) > OPEN_SHARE * area)


def find_sorted_graph(cloud: PointCloud, n_threads: int) -> PointGraph:
    """Return the graph of a cloud with cells sorted along a space-filling curve.

    Later stages are two to three times as fast as on points in random order. A MeshError if all
    points lie at one place.
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
    """Return the points as cells without their normals, which take a tenth of all memory."""
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
    r"""Return the points of a cloud as cells, with arcs between near ones.

    Two points are joined if one is among the `n_neighbors` nearest of the other, and if they are
    not farther apart than `cutoff` times the square root of the smaller of the areas around them.
    The graph is symmetric, and as connected as the surface that the points were taken from, where
    they are spread evenly. Points at the same position count as one: all are joined to the lowest
    of them by arcs of length 0, and share its area.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        As for `segment`.
    n_neighbors : int, default 6
        Nearest neighbors that arcs lead to, the lowest index among equally near ones.
    cutoff : float, default 4.0
        > 0. Longer arcs are dropped: an outlier, or a point on the other side of a gap, is no
        neighbor.
    expected_radius : float, default 0.0
        r = sqrt(A / (pi k)), >= 0, in the unit of the points, for weights as `crease_weights` of
        meshes. With 0, weights are distances.
    alpha, eta_convex
        As for `crease_weights`.
    ridges : float, default 0.35
        Weight of ridges relative to concave edges, >= 0, where that is more than `eta_convex`: of
        convex edges between two sides that are flat and meet at 40 degrees or more, whichever
        side of them is the outside. Where estimated normals spread an edge over more than the
        expected radius, there are none.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    CellGraph
        ``measures`` is the area around each point, from the squared distances of the neighbors that
        it is joined to: :math:`2 \pi \overline{d^2} / (n + 1)`, which is unbiased where points are
        spread at random; 0 for a point without arcs. ``weights`` are in units of the diagonal.
        ``arc_measures`` holds for each arc the length of the border that it crosses, the mean of
        :math:`\pi a / \sum d` at both points, so that the arcs across a line add up to its length;
        and the angle between the normals, positive where points lie above each other's tangent
        planes. Normals are given by the cloud or, if it has none, by `estimate_normals`.

    Raises
    ------
    MeshError
        If the cloud is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(N log N) in practice. `segment` computes arc measures only where borders are, which takes
    less memory.

    Examples
    --------
    Three points on a line, and one apart from them:

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
    """Return a normal for each point: the direction in which its neighbors vary least.

    Normals of neighbors are flipped to agree, along a minimum spanning tree of each component of
    the neighbor graph (Hoppe et al. 1992). Without a viewpoint, all normals of a component then
    point outwards, so that the volume that they enclose is positive. That is right for solids. On
    an open surface they point to the side that bulges out. If that is wrong, as for a room scanned
    from within, give the viewpoint of the scan.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        As for `segment`. Normals that it has are not used; its axes are, in place of positions.
    n_neighbors : int, default 12
        Nearest neighbors that a normal is estimated from. More of them smooth noise, and edges.
    viewpoint : array_like, shape (3,), optional
        A place from which all points were seen: the normals of each component are flipped so that
        most, by area, face it. For terrain, a place far above. By default the viewpoints of the
        cloud, if it has any.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of float64, shape (N, 3)
        Of length 1; zero where there is none: where neighbors lie on a line.

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
    """Return three finite numbers; a ValueError if it is anything else."""
    place = np.asarray(viewpoint, dtype=np.float64)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise ValueError(f"viewpoint must be three finite numbers, got {viewpoint!r}")
    x, y, z = place.tolist()
    return x, y, z


def _turned_to(places: Floats, graph: PointGraph) -> Floats:
    """Return normals, flipped in each component so that most of its area faces its viewpoints."""
    labels = np.zeros(len(graph.positions), np.int32)
    components, n_components = _core.find_components(graph.offsets, graph.neighbors, labels)
    facing = facing_areas(places, graph.positions, graph.normals, graph.measures)
    sums: Array = np.bincount(components, weights=facing, minlength=n_components)
    return np.where(sums[components] < 0, -1.0, 1.0)[:, None] * graph.normals


def facing_areas(
    places: npt.ArrayLike, positions: Floats, normals: Floats, measures: Floats
) -> Floats:
    """Return the area of each point as it is seen from a place, negative if seen from behind.

    There is one place for all points, or one for each.
    """
    toward = np.asarray(places) - positions
    farthest = np.abs(toward).max(axis=1, keepdims=True)
    np.divide(toward, farthest, out=toward, where=farthest > 0)  # squares of far places overflow
    facing = measures * np.einsum("ij,ij->i", normals, toward)
    lengths = np.sqrt(np.einsum("ij,ij->i", toward, toward))
    np.divide(facing, lengths, out=facing, where=lengths > 0)
    return np.asarray(facing)
