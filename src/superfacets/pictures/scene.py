"""What a picture shows: the welded surface, the colors of its faces, and the region borders."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Bytes, Floats, Longs
from .._validate import checked_threads, compact_partial_labels, refuse_mask
from ..cells.face_graph import build_face_graph
from ..cells.point_graph import PointGraph, find_point_graph
from ..mesh.faces import FaceMesh, cut_into_triangles
from ..mesh.point_cloud import PointCloud
from .borders import border_edges
from .colors import colors_of_cells, region_colors

FloatArray = Floats
Picture = Bytes

_PLAIN_COLOR = (205, 197, 184)

# Radius of the hexagon that is drawn for a point, in square roots of the area around it. Gaps
# between points spread at random are closed, but for a few.
_RADIUS = 1.32
_HEXAGON = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])


@dataclass(frozen=True)
class Scene:
    """What is drawn, scaled and moved to a box of diagonal 1 around the origin."""

    points: FloatArray  # (P, 3), no two at one place, all used
    triangles: Longs  # (T, 3), faces, or triangulated polygons
    colors: Picture  # (T, 3)
    borders: Longs  # (B, 2), ends of edges between regions
    n_regions: int  # 1 without any

    @cached_property
    def normals(self) -> FloatArray:
        """Normal of each triangle, (T, 3), as long as its area."""
        first, second, third = (self.points[corner] for corner in self.triangles.T)
        return np.cross(second - first, third - first) / 2

    @property
    def mean_region_area(self) -> float:
        """Mean over regions; the box's diagonal is 1."""
        return float(np.linalg.norm(self.normals, axis=1).sum()) / self.n_regions


def checked_colors(colors: npt.ArrayLike, n_faces: int) -> Picture:
    """Colors of faces as an (F, 3) uint8 array."""
    refuse_mask(colors, "colors")
    array = np.asarray(colors)
    if array.shape != (n_faces, 3):
        raise ValueError(f"colors must have shape ({n_faces}, 3), got {array.shape}")
    if array.dtype != np.uint8:
        raise TypeError(f"colors must be uint8, 0 to 255, got {array.dtype}")
    return np.ascontiguousarray(array)


def build_scene(
    mesh: FaceMesh, labels: npt.ArrayLike | None, colors: npt.ArrayLike | None
) -> Scene:
    """Weld, drop unused vertices, scale to unit size, color and find the borders."""
    representative = _core.weld_vertices(mesh.vertices, checked_threads(None))
    drawn, sources = cut_into_triangles(mesh)
    corners = representative[drawn]
    used = np.zeros(mesh.n_vertices, dtype=bool)
    used[corners] = True
    places = np.cumsum(used) - 1
    triangles, points = places[corners], mesh.vertices[used]
    low, high = points.min(axis=0), points.max(axis=0)
    points = (points - (low + high) / 2) / np.linalg.norm(high - low)
    face_colors = np.tile(np.array(_PLAIN_COLOR, dtype=np.uint8), (mesh.n_faces, 1))
    borders, n_regions = np.empty((0, 2), dtype=np.int64), 1
    if labels is not None:
        checked, ids = compact_partial_labels(labels, mesh.n_faces)
        graph, n_regions = build_face_graph(mesh), max(1, len(ids))
        if colors is None:
            face_colors = colors_of_cells(region_colors(graph, checked), checked)
        borders = places[representative[border_edges(mesh, graph, checked)]]
    if colors is not None:
        face_colors = checked_colors(colors, mesh.n_faces)
    if sources is not None:
        face_colors = face_colors[sources]
    return Scene(points, triangles, face_colors, borders, n_regions)


def build_cloud_scene(
    cloud: PointCloud, labels: npt.ArrayLike | None, colors: npt.ArrayLike | None
) -> Scene:
    """Make a hexagon on the surface of each point, scaled to unit size, and color it."""
    graph = find_point_graph(cloud, checked_threads(None))
    point_colors, n_regions = np.tile(np.array(_PLAIN_COLOR, np.uint8), (cloud.n_points, 1)), 1
    if labels is not None:
        checked, ids = compact_partial_labels(labels, cloud.n_points)
        point_colors = colors_of_cells(region_colors(graph, checked), checked)
        n_regions = max(1, len(ids))
    elif cloud.colors is not None:
        point_colors = np.rint(cloud.colors * 255).astype(np.uint8)
    if colors is not None:
        point_colors = checked_colors(colors, cloud.n_points)
    low, high = cloud.bounds
    corners = (hexagons_of(graph) - (low + high) / 2) / np.linalg.norm(high - low)
    first = 6 * np.arange(cloud.n_points)[:, np.newaxis, np.newaxis]
    triangles = (first + _HEXAGON).reshape(-1, 3)
    shades = np.repeat(point_colors, len(_HEXAGON), axis=0)
    return Scene(corners, triangles, shades, np.empty((0, 2), dtype=np.int64), n_regions)


def hexagons_of(graph: PointGraph) -> FloatArray:
    """Corners, (6 N, 3), of a hexagon around each point, counterclockwise seen from outside."""
    areas = graph.measures
    known = areas[areas > 0]
    areas = np.where(areas > 0, areas, np.median(known) if len(known) else 0.0)
    is_flat = np.abs(graph.normals[:, :1]) < 0.7
    across = np.cross(graph.normals, np.where(is_flat, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    across = np.where(lengths > 0, across / np.where(lengths > 0, lengths, 1), [[1.0, 0.0, 0.0]])
    has_normal = (graph.normals != 0).any(axis=1, keepdims=True)
    up = np.where(has_normal, np.cross(graph.normals, across), [[0.0, 1.0, 0.0]])
    radii = _RADIUS * np.sqrt(areas)[:, np.newaxis]
    angles = np.arange(6) * (np.pi / 3)
    spokes = [math.cos(angle) * across + math.sin(angle) * up for angle in angles]
    return np.stack([graph.positions + radii * spoke for spoke in spokes], axis=1).reshape(-1, 3)
