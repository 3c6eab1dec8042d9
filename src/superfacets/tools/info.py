"""Compute counts and sizes of meshes and point clouds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..base.checks import checked_threads
from ..base.errors import MeshError
from ..base.lazy import load
from ..base.types import Floats
from ..graph.cell_graph import BaseGraph
from ..graph.face_graph import FaceArcs, FaceGraph
from ..graph.kinds import kind_of
from ..graph.point_graph import find_point_graph
from ..graph.size import checked_n_segments, radius_of, sliver_share
from ..graph.surface import Surface
from ..graph.tet_cells import TetCells
from ..mesh.convert import CloudLike, MeshLike, as_cells, as_cloud
from ..mesh.faces import FaceMesh, count_degenerate, cut_into_triangles

if TYPE_CHECKING:
    from .. import TetInfo


@dataclass(frozen=True)
class MeshInfo:
    """Counts and sizes of a mesh of faces, from `superfacets.mesh_info`."""

    n_faces: int
    n_vertices: int
    """Number of vertices, including vertices that no face uses."""
    n_positions: int
    """Number of different positions of vertices."""
    n_components: int
    """Number of connected components of the graph of faces."""
    n_edges: int
    """Number of edges. An edge that several faces share is counted once."""
    n_boundary_edges: int
    """Number of edges that belong to exactly one face."""
    n_nonmanifold_edges: int
    """Number of edges that belong to three or more faces."""
    n_inconsistent_edges: int
    """Number of edges whose two faces traverse the edge in the same direction."""
    n_degenerate_faces: int
    """Number of faces whose normal is undefined, such as faces with all corners on a line."""
    is_inside_out: bool | None
    """Whether the normals of a closed mesh point inwards; None if the mesh is open."""
    faces_down: bool
    """Whether the mesh looks like terrain that faces down if z is up: it is open, at most half as
    high as wide, and the z component of its mean normal is below -1/2."""
    area: float
    """Total area, in the squared unit of the vertices."""
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Minimum and maximum corner of the bounding box of all vertices of faces."""
    diagonal: float
    sliver_share: float
    """Fraction of the area, 0 to 1, in faces that are long and thin compared with the regions of a
    default segmentation; see `Segmentation`."""


@dataclass(frozen=True)
class CloudInfo:
    """Counts and sizes of a point cloud, from `superfacets.cloud_info`."""

    n_points: int
    n_positions: int
    """Number of different positions of points."""
    n_components: int
    """Number of connected components of the graph of points; see `build_point_graph`."""
    n_isolated: int
    """Number of points that have no arcs in the graph of points."""
    has_normals: bool
    knows_turns: bool
    """Whether concave and convex creases can be distinguished. This is possible if the cloud has
    normals or viewpoints, or if the cloud is closed, because estimated normals then point
    outward."""
    has_axes: bool
    """Whether the cloud has axes: normals of unknown sign."""
    has_viewpoints: bool
    """Whether the cloud has viewpoints: positions of the scanner."""
    has_colors: bool
    """Whether the cloud has colors that are not all black. Many files store black for no color."""
    are_colors_zero: bool
    """Whether the cloud has colors that are all black."""
    colors_differ: bool
    """Whether the points have different colors."""
    spacing: float
    """Typical distance between neighbors: the square root of the median area around one point."""
    area: float
    """Sum of the areas around the points; see `build_point_graph`. For uniformly random points, it
    is the area of the surface. It is 15% too large for evenly spaced points, and up to 40% too
    large or 60% too small for scan lines."""
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Minimum and maximum corner of the bounding box of all points."""
    diagonal: float


def mesh_info(mesh: MeshLike, *, weld: float = True) -> MeshInfo | TetInfo:
    """Return counts and sizes of a mesh: a `TetInfo` for tetrahedra, a `MeshInfo` otherwise.

    Raises a MeshError for a point cloud; use `cloud_info` instead.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        Same as in `segment`.
    weld : bool, default True
        Whether vertices at exactly the same position are treated as one vertex when edges,
        triangles of tetrahedra, and components are counted.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> info = mesh_info(square)
    >>> info.n_components, info.n_boundary_edges, info.area
    (1, 4, 1.0)
    """
    cells: Any = as_cells(mesh)
    kind = kind_of(cells)
    if kind.are_points:
        raise MeshError("mesh_info needs a mesh, got a point cloud: use cloud_info instead")
    if kind.name in ("triangles", "polygons"):
        return _face_info(cells, weld)
    if kind.name == "tetrahedra":
        return _tet_info(cells, weld)
    raise MeshError(f"counts and sizes are not available for {kind.plural}")


def cloud_info(cloud: CloudLike) -> CloudInfo:
    """Return counts and sizes of a point cloud.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        Same as in `segment`.

    Examples
    --------
    >>> info = cloud_info([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 0]])
    >>> info.n_points, info.n_positions, info.n_components, info.n_isolated
    (4, 3, 1, 0)
    """
    points = as_cloud(cloud)
    threads = checked_threads(None)
    graph = find_point_graph(points, threads)
    low, high = points.bounds.tolist()
    return CloudInfo(
        n_points=points.n_points, n_positions=count_positions(points.points),
        n_components=count_components(graph),
        n_isolated=int(np.count_nonzero(np.diff(graph.offsets) == 0)),
        has_normals=points.normals is not None, knows_turns=graph.tells_concave,
        has_axes=points.axes is not None, has_viewpoints=points.viewpoints is not None,
        has_colors=points.colors is not None and bool(points.colors.any()),
        are_colors_zero=points.colors is not None and not points.colors.any(),
        colors_differ=points.colors is not None and bool(np.any(points.colors != points.colors[0])),
        spacing=float(np.sqrt(np.median(graph.measures))),
        area=_core.sum_of(graph.measures, threads), bounds=(tuple(low), tuple(high)),
        diagonal=graph.diagonal,
    )  # fmt: skip


def _face_info(mesh: FaceMesh, weld: float) -> MeshInfo:
    n_threads = checked_threads(None)
    graph, longest = FaceArcs.of(mesh, weld, n_threads).measured(mesh, n_threads)
    handle: Any = Surface.of_faces(mesh, graph, n_threads).handle
    edges, boundary, non_manifold, inconsistent = graph.edge_counts
    low, high = graph.bounds.tolist()
    area = _core.sum_of(graph.measures, n_threads)
    radius = radius_of(graph.measures, checked_n_segments(None, graph.n_cells), n_threads)
    return MeshInfo(
        n_faces=mesh.n_faces, n_vertices=mesh.n_vertices,
        n_positions=count_positions(mesh.vertices), n_components=count_components(graph),
        n_edges=edges, n_boundary_edges=boundary, n_nonmanifold_edges=non_manifold,
        n_inconsistent_edges=inconsistent, n_degenerate_faces=count_degenerate(mesh, n_threads),
        is_inside_out=None if boundary else handle.is_inside_out,
        faces_down=_faces_down(mesh, graph, area), area=area, bounds=(tuple(low), tuple(high)),
        diagonal=graph.diagonal,
        sliver_share=sliver_share(mesh, graph.measures, longest, radius, n_threads),
    )  # fmt: skip


def _faces_down(mesh: FaceMesh, graph: FaceGraph, area: float) -> bool:
    """Return the value of `MeshInfo.faces_down` for a mesh with the total `area`."""
    *widths, height = np.ptp(graph.bounds, axis=0)
    if not graph.edge_counts.boundary or height > min(widths) / 2:
        return False
    triangles, _ = cut_into_triangles(mesh)
    first, second, third = (mesh.vertices[corner, :2] for corner in triangles.T)
    (x, y), (other_x, other_y) = (second - first).T, (third - first).T
    shadow = np.sum(x * other_y - y * other_x) / 2.0  # signed area of the projection to the plane
    return bool(shadow < -area / 2.0)


def _tet_info(mesh: TetCells, weld: float) -> TetInfo:
    threads = checked_threads(None)
    graph, _ = kind_of(mesh).build_graph(mesh, weld, threads)
    counts = count_positions(mesh.vertices), count_components(graph)
    volume = _core.sum_of(graph.measures, threads)
    info: TetInfo = load("superfacets_formats.tet_graph:tet_info")(mesh, graph, *counts, volume)
    return info


def count_positions(points: Floats) -> int:
    """Return the number of different positions of points."""
    return int(np.count_nonzero(np.bincount(_core.weld_vertices(points, checked_threads(None)))))


def count_components(graph: BaseGraph) -> int:
    """Return the number of connected components of a graph."""
    same_label = np.zeros(graph.n_cells, np.int32)
    _, n_components = _core.find_components(graph.offsets, graph.neighbors, same_label)
    return n_components
