"""The function `build_point_graph`, which returns the graph of a cloud with weights."""

from __future__ import annotations

from ..base.checks import checked_count, checked_number, checked_threads
from ..graph.cell_graph import CellGraph
from ..graph.point_graph import CUTOFF, N_NEIGHBORS, find_point_graph, point_surface
from ..mesh.convert import CloudLike, as_cloud
from .formulas import WEIGHTS, EdgeFactors, weights_of


def build_point_graph(
    cloud: CloudLike, n_neighbors: int = N_NEIGHBORS, *, cutoff: float = CUTOFF,
    radius: float = 0.0, alpha: float = WEIGHTS["creases"].defaults["alpha"],
    eta_convex: float = WEIGHTS["creases"].defaults["eta_convex"],
    ridges: float = WEIGHTS["creases"].defaults["ridges"], n_threads: int | None = None,
) -> CellGraph:  # fmt: skip
    r"""Return the graph of a cloud, with arcs between near points.

    Two points are neighbors if one of them is among the `n_neighbors` nearest points of the other,
    and if their distance is not too large; see `cutoff`. Each arc has a reverse arc. Of points at
    the same position, only the point with the lowest index has other neighbors. Duplicates are
    joined to this point by arcs of length 0, and all get an equal part of its area.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        Same as in `segment`.
    n_neighbors : int, default 6
        Number of nearest neighbors of each point. If distances are equal, lower indices come first.
    cutoff : float, default 4.0
        Maximum length of an arc, > 0, as a multiple of the square root of an area: the smaller of
        the areas around its two points. The maximum prevents arcs to outliers and across gaps.
    radius : float, default 0.0
        Expected radius r = sqrt(A / (pi k)) of regions, >= 0, in the unit of the points. Weights
        are as in `crease_weights`, with angles of arcs that are estimated from the curvature at
        both points. With 0, weights are distances.
    alpha, eta_convex
        Same as in `crease_weights`.
    ridges : float, default 0.35
        Cost of ridges relative to concave edges, >= 0. A cost below `eta_convex` has no effect. A
        ridge is a convex edge between two flat sides whose normals differ by 40 degrees or more. If
        estimated normals blur an edge over more than the expected radius, the edge is not a ridge.
    n_threads : int, optional
        Same as in `segment`.

    Returns
    -------
    CellGraph
        ``measures`` are the areas around points, :math:`2 \pi \overline{d^2} / (n + 1)` for a point
        with n neighbors at distances d, 0 for a point without arcs, and limited for a few points
        far from all others. The estimate is unbiased for uniformly random points, 15% too large for
        blue noise, 20% too large on a square grid of points, and too large at the boundary of a
        surface. For scan lines at 2, 3, 5 and 10 times the point spacing, areas are 1.35, 1.40,
        0.84 and 0.42 times the true area. ``weights`` are in units of the diagonal of the bounding
        box. In ``arc_measures``, the border length of an arc is the mean of :math:`\pi a / \sum d`
        over its two points, where a is the area around a point, and d are the lengths of all its
        arcs, so that the arcs that cross a line sum to about its length. The angle of an arc is the
        angle between the normals of its points (missing normals are estimated), positive if the sum
        of the heights of both points above the tangent plane of the other is positive.

    Raises
    ------
    MeshError
        If the cloud is not valid, or if all points are at one position.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Examples
    --------
    >>> graph = build_point_graph([[0, 0, 0], [1, 0, 0], [2, 0, 0], [90, 0, 0]], 2)
    >>> [graph.neighbors[a:b].tolist() for a, b in zip(graph.offsets, graph.offsets[1:])]
    [[1, 2], [0, 2], [0, 1], []]
    """
    checked = as_cloud(cloud)
    threads = checked_threads(n_threads)
    n_neighbors = checked_count(n_neighbors, "n_neighbors")
    cutoff = checked_number(cutoff, "cutoff", zero=False)
    factors = EdgeFactors.checked(radius, alpha, eta_convex, ridges)
    n_neighbors = min(n_neighbors, checked.n_points - 1)
    graph = find_point_graph(checked, threads, n_neighbors=n_neighbors, cutoff=cutoff)
    surface = point_surface(graph, threads)
    arrays = (graph.positions, graph.measures)
    return CellGraph(
        graph.positions, graph.measures, graph.offsets, graph.neighbors,
        weights_of(surface, arrays, factors), graph.bounds, weight_unit=graph.diagonal,
        arc_measures=surface.arc_measures(),
    )  # fmt: skip
