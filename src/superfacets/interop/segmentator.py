"""Superfacets with the function names of the package `segmentator`.

Scripts that prepare scans such as ScanNet for networks such as SPFormer, MAFT and OneFormer3D
import ``segmentator``, an extension that must be compiled against torch. After the import line is
changed to

    from superfacets import segmentator

such a script runs. It gets about the same number of regions, which are connected and compact, with
borders on creases.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Array, Floats, Ints, Longs
from .._validate import (
    check_spread,
    checked_count,
    checked_number,
    checked_threads,
    owned,
    ranked_labels,
)
from ..adapters.convert import MeshLike, as_mesh
from ..cells.cell_graph import CellGraph
from ..cells.point_graph import PointGraph, point_surface
from ..cells.weights import NO_NORMALS, WEIGHTS, EdgeFactors, weights_of
from ..clustering.loop import segment_graph
from ..errors import IslandWarning, MeshError
from ..mesh.cells import lowest_vertices
from ..mesh.faces import mean_normals
from ..mesh.point_cloud import PointCloud
from ..mesh.triangle_mesh import Mesh
from ..pipeline import segment
from ..regions.crease_labels import VertexEdges, crease_labels, large_regions
from ..regions.vertices import with_unused

__all__ = ["compute_vn", "segment_mesh", "segment_point"]


def segment_mesh(
    vertices: Any,
    faces: Any,
    kThresh: float = 0.01,  # noqa: N803  # the original's name
    segMinVerts: int = 20,  # noqa: N803
    *,
    n_segments: int | None = None,
) -> Any:
    r"""Return a region for each vertex of a mesh: a replacement of ``segmentator.segment_mesh``.

    The mesh is segmented by `superfacets.segment`, and vertices get labels by
    `superfacets.vertex_labels` with ``method="creases"``. Regions smaller than `segMinVerts` grow.
    Regions that cannot grow are merged with others.

    The number of regions is the number of segments that the original package finds with the same
    parameters. It uses the method of Felzenszwalb and Huttenlocher on the edges of the mesh. The
    weight of an edge is 1 - n_i . n_j, where n is the mean of the unit normals of the faces around
    a vertex. The weight is squared if n_j points forward along the edge, as on a convex surface. In
    order of ascending weight, an edge joins the segments at its ends if its weight is at most the
    threshold of both segments. The threshold of a segment is `kThresh` divided by its number of
    vertices, plus the weight of the edge that last joined it. Then edges join segments of fewer
    than `segMinVerts` vertices to others. Components of fewer than `segMinVerts` vertices are not
    counted: they become additional regions. Vertices at one position are one vertex.

    Parameters
    ----------
    vertices : array_like or torch tensor, shape (V, 3)
        Positions.
    faces : array_like or torch tensor of integers, shape (F, 3)
        Triangles.
    kThresh : float, default 0.01
        >= 0. A larger value gives fewer and larger regions.
    segMinVerts : int, default 20
        >= 1. Minimum number of vertices of a region, except for smaller components and vertices
        without faces.
    n_segments : int, optional
        Number of regions. If given, `kThresh` has no effect, and regions are not merged: regions
        that cannot grow stay smaller than `segMinVerts`.

    Returns
    -------
    ndarray of int64, shape (V,), or torch tensor on the device of `faces` if `faces` is a tensor
        Regions, numbered from 0 without gaps, each connected by edges. As in the original, each
        vertex without faces is a region; these regions have the highest numbers.

    Raises
    ------
    MeshError
        If the mesh is not valid.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Notes
    -----
    Time is nearly linear in the number of faces.

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
    threads = checked_threads(None)
    if n_segments is None:
        number = _number_in_mesh(mesh, threshold, least, threads)
    else:
        number = checked_count(n_segments, "n_segments", mesh.n_faces, "faces")
    with warnings.catch_warnings():  # small components become additional regions
        warnings.simplefilter("ignore", IslandWarning)
        of_faces = segment(mesh, min(number, mesh.n_faces)).labels
    names = np.arange(of_faces.max() + 1)
    labels = crease_labels(
        mesh, of_faces, len(names), threads, least=least, merge=n_segments is None
    )
    return _like(with_unused(labels, names), faces)


def segment_point(
    points: Any,
    normals: Any,
    edges: Any,
    kThresh: float = 0.01,  # noqa: N803
    segMinVerts: int = 20,  # noqa: N803
    *,
    n_segments: int | None = None,
) -> Any:
    r"""Return a region for each point of a cloud: a replacement of ``segmentator.segment_point``.

    The points are the cells of a `superfacets.CellGraph`, and the edges are its arcs. The graph is
    segmented by `superfacets.segment_graph`. The weight of an edge is its length plus a cost for
    the crease, from the angle between the normals, as in `superfacets.crease_weights`. The area of
    a point is computed from the lengths of its edges, as in `superfacets.build_point_graph`.

    Parameters
    ----------
    points, normals : array_like or torch tensor, shape (N, 3)
        Positions, and normals of any length on one side of the surface.
    edges : array_like or torch tensor of integers, shape (E, 2)
        Pairs of neighboring points, each in one direction or both.
    kThresh, segMinVerts, n_segments
        As for `segment_mesh`; the number of segments is computed from these edges and normals.

    Returns
    -------
    ndarray of int64, shape (N,), or torch tensor on the device of `edges` if `edges` is a tensor
        Regions, numbered from 0 without gaps, each connected by edges. Each point without an edge
        is a region.

    Raises
    ------
    MeshError
        If the points are not valid, or an edge refers to a point that does not exist.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Examples
    --------
    A row of points around a corner:

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
    threads = checked_threads(None)
    if n_segments is None:
        number = _core.count_graph_segments(
            cloud.points, cloud.normals, steps.ravel(), threshold, least, threads
        )
        number = max(number, 1)
    else:
        number = checked_count(n_segments, "n_segments", cloud.n_points, "points")
    graph = _graph_of_points(cloud, steps, number)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IslandWarning)
        labels = segment_graph(graph, number).labels
    joined = VertexEdges(graph.offsets, graph.neighbors, cloud.points, cloud.normals)
    counts = np.ones(cloud.n_points, np.int32)
    labels = large_regions(joined, labels, counts, least, merge=n_segments is None)
    return _like(labels, edges)


def compute_vn(mesh: MeshLike) -> Floats:
    """Return vertex normals for `segment_point`: a replacement of ``segmentator.compute_vn``.

    Parameters
    ----------
    mesh : Mesh, trimesh.Trimesh or other mesh-like
        A triangle mesh.

    Returns
    -------
    ndarray of float64, shape (V, 3)
        Mean of the unit normals of the faces around each vertex; zero at a vertex without faces. As
        in the original, the mean is not normalized, and vertices are not welded. The normal of a
        face without area counts as zero; the original returns NaN.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.

    Examples
    --------
    >>> from superfacets import Mesh, segmentator
    >>> fold = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [1, 0, 3]])
    >>> segmentator.compute_vn(fold)[:2]
    array([[0. , 0.5, 0.5],
           [0. , 0.5, 0.5]])
    """
    checked = as_mesh(mesh)
    return mean_normals(checked, lowest_vertices(checked.vertices, False, checked_threads(None)))


def _checked(threshold: Any, least: Any) -> tuple[float, int]:
    return checked_number(threshold, "kThresh", zero=True), checked_count(least, "segMinVerts")


def _array_of(values: Any) -> Array:
    """Convert to an array; a tensor is copied to the CPU."""
    return np.asarray(values.detach().cpu().numpy() if _is_tensor(values) else values)


def _is_tensor(values: Any) -> bool:
    """Whether the value is a torch tensor, without importing torch."""
    return all(hasattr(values, name) for name in ("detach", "cpu", "new_tensor"))


def _like(labels: npt.NDArray[np.integer[Any]], indices: Any) -> Any:
    """The labels without gaps, as a tensor or an array like the input."""
    ids = ranked_labels(labels)[0].astype(np.int64)
    return indices.new_tensor(ids).long() if _is_tensor(indices) else ids


def _checked_edges(edges: Array, n_points: int) -> Ints:
    """Check edges, and return them as int32, (E, 2)."""
    if edges.ndim != 2 or edges.shape[1] != 2:
        raise ValueError(f"edges must have shape (E, 2), got {edges.shape}")
    if edges.dtype.kind not in "iu":
        raise TypeError(f"edges must be integers, got {edges.dtype}")
    if edges.size and not 0 <= edges.min() <= edges.max() < n_points:
        raise MeshError(f"edges must be indices of points, 0 to {n_points - 1}")
    return owned(edges, np.int32)


def _distinct(steps: Ints, n_nodes: int) -> Longs:
    """Unique directed pairs of different nodes, in ascending order, shape (E, 2)."""
    first, second = steps.T.astype(np.int64)
    keys = np.unique((first * n_nodes + second)[first != second])
    return np.stack([keys // n_nodes, keys % n_nodes], axis=1)


def _number_in_mesh(mesh: Mesh, threshold: float, least: int, n_threads: int) -> int:
    """Number of segments of at least `least` vertices in the original, at least 1."""
    lowest = lowest_vertices(mesh.vertices, True, n_threads)
    normals = mean_normals(mesh, lowest)
    number = _core.count_mesh_segments(
        mesh.vertices, normals, mesh.faces, lowest, threshold, least, n_threads
    )
    return max(number, 1)


def _graph_of_points(cloud: PointCloud, edges: Ints, number: int) -> CellGraph:
    """Graph of points as cells, with both directions of each edge as arcs."""
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
