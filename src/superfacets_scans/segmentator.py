"""Replacement of the package `segmentator`, with the same function names.

Neural networks such as SPFormer, MAFT and OneFormer3D come with scripts that prepare scans, such as
ScanNet. These scripts import ``segmentator``, an extension that must be compiled against torch.
To use this module instead, change the import line to

    from superfacets import segmentator

Regions are connected and compact, and their borders follow creases. Their number is the number of
segments of the original package, up to the rounding errors of its 32-bit numbers.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import (
    SCANS,
    CellGraph,
    IslandWarning,
    Mesh,
    MeshError,
    PointCloud,
    hierarchy,
    segment,
    segment_graph,
    vertex_labels,
)
from superfacets.kit import (
    Array,
    Floats,
    Ints,
    MeshLike,
    VertexEdges,
    as_mesh,
    checked_count,
    checked_number,
    checked_threads,
    lowest_vertices,
    ranked_labels,
)

__all__ = ["compute_vn", "segment_mesh", "segment_point"]

EDGES_IN_ORDER = np.array([[0, 1], [0, 2], [2, 1]])
"""Corners at the ends of the edges of a face, in the order of the original package."""


def segment_mesh(
    vertices: Any,
    faces: Any,
    kThresh: float = 0.01,  # noqa: N803  # the original's name
    segMinVerts: int = 20,  # noqa: N803
    *,
    n_segments: int | None = None,
) -> Any:
    r"""Segment the vertices of a mesh: a replacement of ``segmentator.segment_mesh``.

    The mesh is segmented with `superfacets.segment` and `superfacets.SCANS`, and the labels are
    converted to vertices with `superfacets.vertex_labels` and ``method="creases"``. Regions with
    fewer than `segMinVerts` vertices take vertices from their neighbors, or are merged with a
    neighbor if this is not possible.

    The number of regions is the number of segments of the original package, plus 1 or 2 or minus 1
    on noisy scans, because the original computes with 32-bit numbers. The original package uses the
    method of Felzenszwalb and Huttenlocher on the edges of the mesh. The weight of an edge from
    vertex i to vertex j is 1 - n_i . n_j, where the normal n of a vertex is the mean of the unit
    normals of its faces. The weight is squared if n_j points forward along the edge, as on a convex
    surface. In the order of ascending weight, an edge joins the segments at its ends, at first
    single vertices, if its weight is at most the threshold of both segments: `kThresh` divided by
    the number of vertices, plus the weight of the last edge that joined the segment. Then segments
    with fewer than `segMinVerts` vertices are joined to neighboring segments. Components with fewer
    than `segMinVerts` vertices become additional regions. Vertices at the same position are treated
    as one vertex.

    Parameters
    ----------
    vertices : array_like or torch tensor, shape (V, 3)
        Positions of vertices.
    faces : array_like or torch tensor of integers, shape (F, 3)
        Vertex indices of triangles.
    kThresh : float, default 0.01
        Threshold of the method, >= 0. Larger values give fewer and larger regions.
    segMinVerts : int, default 20
        Minimum number of vertices of a region, >= 1, except for smaller components and vertices
        without faces.
    n_segments : int, optional
        Number of regions, besides components without a seed and vertices without faces, which an
        `IslandWarning` reports. By default, it is computed from `kThresh` and `segMinVerts`, and
        includes these components. If you pass a number, small regions can still take vertices from
        their neighbors, but are not merged.

    Returns
    -------
    ndarray of int64, shape (V,), or torch tensor on the device of `faces` if `faces` is a tensor
        Region of each vertex. Regions are numbered from 0 without gaps, and are connected by edges.
        As in the original package, each vertex without faces is a region. These regions have the
        highest numbers.

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
    lowest = lowest_vertices(mesh.vertices, True, threads)
    joined = VertexEdges.of_mesh(mesh, lowest, threads)
    if n_segments is None:
        steps = lowest[mesh.faces[:, EDGES_IN_ORDER]].reshape(-1, 2)
        number = max(joined.count_segments(steps, threshold, least, threads), 1)
    else:
        number = checked_count(n_segments, "n_segments", mesh.n_faces, "faces")
    with warnings.catch_warnings():  # additional regions for small components are expected
        warnings.simplefilter("ignore", IslandWarning)
        of_faces = segment(mesh, min(number, mesh.n_faces), **SCANS).labels
    labels = vertex_labels(mesh, of_faces, min_vertices=least)
    if n_segments is None:
        labels = _merged(joined, labels, lowest, least)
        excess = int((np.bincount(labels + 1)[1:] >= least).sum()) - number
        if excess > 0:  # as many large components got no seed
            nested = hierarchy(mesh, [int(of_faces.max()) + 1], labels=of_faces)
            of_faces = nested.cut(max(nested.n_finest - excess, nested.n_fewest))
            labels = vertex_labels(mesh, of_faces, min_vertices=least)
            labels = _merged(joined, labels, lowest, least)
    unused = np.flatnonzero(labels < 0)
    labels[unused] = labels.max() + 1 + np.arange(len(unused))
    if n_segments is not None and (n_found := len(np.unique(labels))) > number:
        warnings.warn(
            f"{n_found} regions instead of {number}: components without a seed and vertices without"
            " faces are regions, too; superfacets.segment can join such components"
            " (islands='nearest')", IslandWarning, stacklevel=2,
        )  # fmt: skip
    return _like(labels, faces)


def segment_point(
    points: Any,
    normals: Any,
    edges: Any,
    kThresh: float = 0.01,  # noqa: N803
    segMinVerts: int = 20,  # noqa: N803
    *,
    n_segments: int | None = None,
) -> Any:
    r"""Segment the points of a cloud: a replacement of ``segmentator.segment_point``.

    The graph of points and edges is segmented with `superfacets.segment_graph`. The weight of an
    edge is its length plus a cost of creases, which is computed from the angle between the normals
    as in `superfacets.crease_weights`. The area of a point is computed from the lengths of its
    edges, as in `superfacets.build_point_graph`.

    Parameters
    ----------
    points, normals : array_like or torch tensor, shape (N, 3)
        Positions of points, and normals of any length that point to the same side of the surface.
    edges : array_like or torch tensor of integers, shape (E, 2)
        Pairs of neighboring points, in one direction or in both directions.
    kThresh, segMinVerts, n_segments
        Same as in `segment_mesh`, with `edges` and `normals` in place of the edges and the normals
        of a mesh. Components without a seed are always additional regions.

    Returns
    -------
    ndarray of int64, shape (N,), or torch tensor on the device of `edges` if `edges` is a tensor
        Region of each point. Regions are numbered from 0 without gaps, and are connected by edges.
        Each point without an edge is a region.

    Raises
    ------
    MeshError
        If the points are not valid, or if an index in `edges` is out of range.
    ValueError, TypeError
        If a parameter is out of range or of the wrong type.

    Examples
    --------
    A row of points has a corner in the middle:

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
    joined = _edges_of(cloud, steps)
    if n_segments is None:
        number = max(joined.count_segments(steps, threshold, least, threads), 1)
    else:
        number = checked_count(n_segments, "n_segments", cloud.n_points, "points")
    graph = _graph_of(joined, cloud, number)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IslandWarning)
        labels = segment_graph(graph, number).labels
    counts = np.ones(cloud.n_points, np.int32)
    labels = joined.grown(labels, counts, least)
    return _like(joined.merged(labels, counts, least) if n_segments is None else labels, edges)


def compute_vn(mesh: MeshLike) -> Floats:
    """Compute vertex normals for `segment_point`: a replacement of ``segmentator.compute_vn``.

    Parameters
    ----------
    mesh : Mesh, trimesh.Trimesh or other mesh-like
        A triangle mesh.

    Returns
    -------
    ndarray of float64, shape (V, 3)
        Mean of the unit normals of the faces around each vertex, or zero for a vertex without
        faces. As in the original package, the mean is not normalized, and vertices are not welded.
        Faces without area have a zero normal here, and NaN in the original package.

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
    checked, threads = as_mesh(mesh), checked_threads(None)
    each = lowest_vertices(checked.vertices, False, threads)
    return VertexEdges.of_mesh(checked, each, threads).normals


def _checked(threshold: Any, least: Any) -> tuple[float, int]:
    return checked_number(threshold, "kThresh", zero=True), checked_count(least, "segMinVerts")


def _array_of(values: Any) -> Array:
    """Convert values to an array; a tensor on another device is copied to the CPU."""
    return np.asarray(values.detach().cpu().numpy() if _is_tensor(values) else values)


def _is_tensor(values: Any) -> bool:
    """Return whether a value is a torch tensor, without importing torch."""
    return all(hasattr(values, name) for name in ("detach", "cpu", "new_tensor"))


def _like(labels: npt.NDArray[np.integer[Any]], indices: Any) -> Any:
    """Return labels renumbered without gaps, as an array, or as a tensor if `indices` is one."""
    ids = ranked_labels(labels)[0].astype(np.int64)
    return indices.new_tensor(ids).long() if _is_tensor(indices) else ids


def _checked_edges(edges: Array, n_points: int) -> Ints:
    if edges.ndim != 2 or edges.shape[1] != 2:
        raise ValueError(f"edges must have shape (E, 2), got {edges.shape}")
    if edges.dtype.kind not in "iu":
        raise TypeError(f"edges must contain integers, got {edges.dtype}")
    is_wrong = ((edges < 0) | (edges >= n_points)).any(axis=1)
    if is_wrong.any():
        first = int(np.argmax(is_wrong))
        raise MeshError(
            f"edges[{first}] must be points from 0 to {n_points - 1}, got {edges[first].tolist()}"
        )
    return np.array(edges, np.int32, order="C")


def _edges_of(cloud: PointCloud, steps: Ints) -> VertexEdges:
    """Return the edges between different points, in both directions and without duplicates."""
    assert cloud.normals is not None
    n = cloud.n_points
    first, second = np.concatenate([steps, steps[:, ::-1]]).T.astype(np.int64)
    sources, targets = np.divmod(np.unique((first * n + second)[first != second]), n)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(sources, minlength=n))])
    return VertexEdges(offsets, targets.astype(np.int32), cloud.points, cloud.normals)


def _graph_of(edges: VertexEdges, cloud: PointCloud, number: int) -> CellGraph:
    """Build a graph with two arcs per edge. Crease costs are scaled for `number` regions."""
    counts = np.diff(edges.offsets)
    sources = np.repeat(np.arange(len(counts)), counts)
    steps = cloud.points[edges.neighbors] - cloud.points[sources]
    squares = np.bincount(sources, np.einsum("ij,ij->i", steps, steps), len(counts))
    areas = 2 * np.pi * squares / np.maximum(counts * (counts + 1), 1)
    weights, unit = edges.crease_weights(areas, number, checked_threads(None))
    return CellGraph(
        cloud.points, areas, edges.offsets, edges.neighbors, weights, cloud.bounds, weight_unit=unit
    )


def _merged(edges: VertexEdges, of_vertices: Ints, lowest: Ints, least: int) -> Ints:
    """Merge regions of fewer than `least` vertices; vertices without a face keep the label -1."""
    is_used = of_vertices >= 0
    of_positions = np.full(len(lowest), -1, np.int32)
    of_positions[lowest[is_used]] = of_vertices[is_used]
    counts = np.bincount(lowest[is_used], minlength=len(lowest)).astype(np.int32)
    merged = edges.merged(of_positions, counts, least)
    return np.where(is_used, merged[lowest], np.int32(-1))
