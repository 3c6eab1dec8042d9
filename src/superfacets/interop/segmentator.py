"""Superfacets under the function names of the package `segmentator`: change one import line.

Scripts that prepare ScanNet and other scans for networks such as SPFormer, MAFT and OneFormer3D
import ``segmentator``, an extension that has to be compiled against torch. With

    from superfacets import segmentator

they run unchanged. They get as many regions, so of the same mean size, which are connected and
compact.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import check_spread, checked_count, checked_number, checked_threads
from ..cells.cell_graph import CellGraph
from ..cells.point_graph import PointGraph, point_surface
from ..cells.weights import NO_NORMALS, WEIGHTS, EdgeFactors, weights_of
from ..clustering.loop import segment_graph
from ..errors import IslandWarning, MeshError
from ..mesh.faces import area_vectors
from ..mesh.point_cloud import PointCloud
from ..mesh.triangle_mesh import Mesh
from ..pipeline import segment
from ..regions.vertices import vertex_ids

__all__ = ["segment_mesh", "segment_point"]

N_BLOCKS = 8
"""Number of blocks of edges. Before each block, its edges that cannot join segments are dropped."""

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.integer[Any]]


def segment_mesh(
    vertices: Any,
    faces: Any,
    kThresh: float = 0.01,  # noqa: N803  # the original's name
    segMinVerts: int = 20,  # noqa: N803
    *,
    n_segments: int | None = None,
) -> Any:
    r"""Return a region for each vertex of a mesh: a stand-in for ``segmentator.segment_mesh``.

    The mesh is segmented as by `superfacets.segment`, and each vertex gets the region that most of
    the area around it is in, see `superfacets.vertex_labels`.

    The number of regions is the number that the method of the original finds with the same
    parameters: the method of Felzenszwalb and Huttenlocher on the edges of the mesh. The weight of
    an edge is 1 - n_i . n_j, with n the mean of the unit normals of the faces around a vertex; it
    is squared if n_j points forward along the edge, as on a convex surface. In the order of
    ascending weight w, an edge joins the segments at its ends if w is at most the threshold of
    both. The threshold of a segment is `kThresh` divided by its number of vertices, plus the weight
    that joined it last. Then edges join segments of fewer than `segMinVerts` vertices to others.
    Only the number of segments is used. Components of fewer than `segMinVerts` vertices are not
    counted: they become additional regions.

    Parameters
    ----------
    vertices : array_like or torch tensor, shape (V, 3)
        Positions.
    faces : array_like or torch tensor of integers, shape (F, 3)
        Triangles.
    kThresh : float, default 0.01
        >= 0. The larger, the fewer and larger regions.
    segMinVerts : int, default 20
        >= 1. Minimum number of vertices of a segment of the original. With this and `kThresh`, the
        mean size of regions is that of the original. Sizes here differ less from the mean, but have
        no minimum.
    n_segments : int, optional
        Number of regions; if given, `kThresh` and `segMinVerts` have no effect.

    Returns
    -------
    ndarray of int64, shape (V,), or torch tensor on the device of `faces`, if these are a tensor
        Regions, numbered from 0 without gaps. As in the original, a vertex without faces is a
        region of its own; these come last. In a region of one or two faces, no vertex may have most
        of the area around it. Such a region gets one vertex if the region beside it has more than
        one.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    Time is linear in the number of faces, except for a sort. Finding the number of regions takes
    some five seconds per million faces, which `n_segments` saves.

    References
    ----------
    Felzenszwalb and Huttenlocher, "Efficient Graph-Based Image Segmentation", 2004.

    Examples
    --------
    >>> from superfacets import segmentator
    >>> from superfacets import sample_mesh
    >>> bear = sample_mesh(3000)
    >>> ids = segmentator.segment_mesh(bear.vertices, bear.faces, n_segments=40)
    >>> ids.shape == (bear.n_vertices,), len(np.unique(ids))
    (True, 40)
    """
    threshold, least = _checked(kThresh, segMinVerts)
    mesh = Mesh(_array_of(vertices), _array_of(faces))
    if n_segments is None:
        corners = _core.weld_vertices(mesh.vertices, checked_threads(None))[mesh.faces]
        steps = corners[:, [0, 1, 0, 2, 2, 1]].reshape(-1, 2)  # the order of the original
        normals = _mean_normals(mesh, corners)
        number = _number_of_segments(mesh.vertices, normals, steps, threshold, least)
    else:
        number = checked_count(n_segments, "n_segments", mesh.n_faces, "faces")
    with warnings.catch_warnings():  # small components are additional
        warnings.simplefilter("ignore", IslandWarning)
        labels = segment(mesh, min(number, mesh.n_faces)).labels
    return _like(np.unique(vertex_ids(mesh, labels), return_inverse=True)[1], faces)


def segment_point(
    points: Any,
    normals: Any,
    edges: Any,
    kThresh: float = 0.01,  # noqa: N803
    segMinVerts: int = 20,  # noqa: N803
    *,
    n_segments: int | None = None,
) -> Any:
    r"""Return a region for each point of a cloud: a stand-in for ``segmentator.segment_point``.

    The points are the cells of a `superfacets.CellGraph`, the edges its arcs. It is segmented by
    `superfacets.segment_graph`. The weight of an edge is its length plus a cost for the crease,
    from the angle between the normals as in `superfacets.crease_weights`. The area around a point
    is computed from the lengths of its edges, as in `superfacets.build_point_graph`.

    Parameters
    ----------
    points, normals : array_like or torch tensor, shape (N, 3)
        Positions, and vectors to one side of the surface, of any length.
    edges : array_like or torch tensor of integers, shape (E, 2)
        Points that are neighbors, each pair in one direction or both.
    kThresh, segMinVerts, n_segments
        As for `segment_mesh`; the number of segments is found on these edges, with these normals.

    Returns
    -------
    ndarray of int64, shape (N,), or torch tensor on the device of `edges`, if these are a tensor
        Regions, numbered from 0 without gaps. A point without an edge is a region of its own.

    Raises
    ------
    MeshError
        If the points are not valid, or an edge refers to a point that does not exist.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Examples
    --------
    A row of points that turns a corner:

    >>> from superfacets import segmentator
    >>> points = [[x, 0, 0] for x in range(4)] + [[4, 0, z] for z in range(1, 5)]
    >>> normals = [[0, 0, 1]] * 4 + [[-1, 0, 0]] * 4
    >>> edges = [[i, i + 1] for i in range(7)]
    >>> segmentator.segment_point(points, normals, edges, n_segments=2)
    array([0, 0, 0, 0, 1, 1, 1, 1])
    """
    threshold, least = _checked(kThresh, segMinVerts)
    cloud = PointCloud(_array_of(points), _array_of(normals))
    assert cloud.normals is not None
    steps = _checked_edges(_array_of(edges), cloud.n_points)
    if n_segments is None:
        number = _number_of_segments(cloud.points, cloud.normals, steps, threshold, least)
    else:
        number = checked_count(n_segments, "n_segments", cloud.n_points, "points")
    graph = _graph_of_points(cloud, steps, number)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IslandWarning)
        labels = segment_graph(graph, number).labels
    return _like(labels.astype(np.int64), edges)


def _checked(threshold: Any, least: Any) -> tuple[float, int]:
    return checked_number(threshold, "kThresh", zero=True), checked_count(least, "segMinVerts")


def _array_of(values: Any) -> npt.NDArray[Any]:
    """The value as an array; a tensor is copied to the CPU."""
    return np.asarray(values.detach().cpu().numpy() if _is_tensor(values) else values)


def _is_tensor(values: Any) -> bool:
    """Whether the value is a torch tensor; does not import torch."""
    return all(hasattr(values, name) for name in ("detach", "cpu", "new_tensor"))


def _like(ids: Ints, indices: Any) -> Any:
    """The ids in the type of the input: a tensor, or an array."""
    return indices.new_tensor(ids).long() if _is_tensor(indices) else ids


def _checked_edges(edges: npt.NDArray[Any], n_points: int) -> npt.NDArray[Any]:
    if edges.ndim != 2 or edges.shape[1] != 2:
        raise ValueError(f"edges must have shape (E, 2), got {edges.shape}")
    if edges.dtype.kind not in "iu":
        raise TypeError(f"edges must be integers, got {edges.dtype}")
    if edges.size and not 0 <= edges.min() <= edges.max() < n_points:
        raise MeshError(f"edges must be points, 0 to {n_points - 1}")
    return edges


def _distinct(steps: npt.NDArray[Any], n_nodes: int) -> Ints:
    """Unique pairs of different nodes, ascending, shape (E, 2); (a, b) is not (b, a)."""
    first, second = steps.T.astype(np.int64)
    keys = np.unique((first * n_nodes + second)[first != second])
    return np.stack([keys // n_nodes, keys % n_nodes], axis=1)


def _mean_normals(mesh: Mesh, corners: npt.NDArray[np.int32]) -> Floats:
    """Mean unit normal of the faces around each vertex, shape (V, 3); not normalized."""
    normals = area_vectors(mesh, checked_threads(None))
    lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))[:, np.newaxis]
    np.divide(normals, lengths, out=normals, where=lengths > 0)
    flat, n = corners.ravel(), mesh.n_vertices
    counts = np.maximum(np.bincount(flat, minlength=n), 1)
    sums = [np.bincount(flat, np.repeat(axis, 3), n) for axis in normals.T]
    return np.stack([axis / counts for axis in sums], axis=1)


def _number_of_segments(
    points: Floats, normals: Floats, steps: Indices, threshold: float, least: int
) -> int:
    """Number of segments with at least `least` nodes that the original finds, at least 1."""
    weights = _weights_of_steps(points, normals, steps)
    order = np.argsort(weights, kind="stable")
    roots, sizes = _join(len(points), steps[order], weights[order], threshold, least)
    is_used = np.zeros(len(points), bool)
    is_used[roots[steps]] = True
    return max(int(np.count_nonzero(sizes[is_used] >= least)), 1)


def _weights_of_steps(points: Floats, normals: Floats, ends: Indices) -> Floats:
    """Weight of edges (a, b): 1 minus the dot product of the normals, squared where convex.

    An edge is convex if the normal at b points forward along it. On a rough surface this is often
    true for one of the directions (a, b) and (b, a).
    """
    first, second = normals[ends[:, 0]], normals[ends[:, 1]]
    turns = np.maximum(1.0 - np.einsum("ij,ij->i", first, second), 0.0)
    ways = points[ends[:, 1]] - points[ends[:, 0]]
    is_convex = np.einsum("ij,ij->i", second, ways) > 0
    weights: Floats = np.where(is_convex, turns * turns, turns)
    return weights


def _join(
    n_nodes: int, ends: Indices, weights: Floats, threshold: float, least: int
) -> tuple[Ints, Ints]:
    """Join nodes along edges, which are sorted by weight.

    Returns the root of each node, and the number of nodes of the segment of each root.
    """
    parents, sizes = list(range(n_nodes)), [1] * n_nodes
    limits = [threshold] * n_nodes
    for begin in range(0, len(ends), len(ends) // N_BLOCKS + 1):
        part = slice(begin, begin + len(ends) // N_BLOCKS + 1)
        tops, kept = _still_open(parents, limits, ends[part], float(weights[begin]))
        for first, second, weight in zip(
            *tops.T.tolist(), weights[part][kept].tolist(), strict=True
        ):
            a, b = _root(parents, first), _root(parents, second)
            if a != b and weight <= limits[a] and weight <= limits[b]:
                parents[b] = a
                sizes[a] += sizes[b]
                limits[a] = weight + threshold / sizes[a]
    roots = _roots(parents)
    for first, second in ends[roots[ends[:, 0]] != roots[ends[:, 1]]].tolist():
        a, b = _root(parents, first), _root(parents, second)
        if a != b and (sizes[a] < least or sizes[b] < least):
            parents[b] = a
            sizes[a] += sizes[b]
    return _roots(parents), np.array(sizes)


def _still_open(
    parents: list[int], limits: list[float], ends: Indices, lowest: float
) -> tuple[Ints, npt.NDArray[np.bool_]]:
    """The segments at the ends of the edges that may join them, and a mask of these edges.

    A segment whose limit is below `lowest`, the lowest weight of all edges that are left, stays as
    it is.
    """
    tops = _roots(parents)[ends]
    is_open = (np.array(limits) >= lowest)[tops].all(axis=1)
    kept = is_open & (tops[:, 0] != tops[:, 1])
    return tops[kept], kept


def _root(parents: list[int], node: int) -> int:
    """The root of a segment; halves the path to it."""
    while parents[node] != node:
        parents[node] = node = parents[parents[node]]
    return node


def _roots(parents: list[int]) -> Ints:
    """The root of each node, by pointer jumping."""
    roots, above = np.empty(0, np.int64), np.array(parents)
    while not np.array_equal(roots, above):
        roots, above = above, above[above]
    return roots


def _graph_of_points(cloud: PointCloud, edges: npt.NDArray[Any], number: int) -> CellGraph:
    """Points as cells, with both directions of each edge as arcs."""
    check_spread(cloud.bounds)
    n = cloud.n_points
    sources, targets = _distinct(np.concatenate([edges, edges[:, ::-1]]), n).T
    counts = np.bincount(sources, minlength=n)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    steps = cloud.points[targets] - cloud.points[sources]
    squares = np.bincount(sources, np.einsum("ij,ij->i", steps, steps), n)
    areas = 2 * np.pi * squares / np.maximum(counts * (counts + 1), 1)
    assert cloud.normals is not None
    graph = PointGraph(
        cloud.points, areas, cloud.normals, offsets.astype(np.int64), targets.astype(np.int32),
        np.arange(n, dtype=np.int32), cloud.bounds,
    )  # fmt: skip
    surface = point_surface(cloud, graph, checked_threads(None))
    creases = WEIGHTS["creases"].defaults
    radius = float(np.sqrt(areas.sum() / (np.pi * number)))
    factors = EdgeFactors.of_radius(radius, creases["alpha"], creases["eta_convex"])
    weights = weights_of(surface, (graph.positions, graph.measures, NO_NORMALS), factors)
    return CellGraph(
        graph.positions, areas, graph.offsets, graph.neighbors, weights, graph.bounds,
        weight_unit=graph.diagonal,
    )  # fmt: skip
