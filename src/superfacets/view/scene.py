"""What a picture shows: the welded surface, the colors of its faces, and the region borders."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import checked_threads, compact_labels, refuse_mask
from ..cells.face_graph import build_face_graph
from ..mesh.faces import FaceMesh, cut_into_triangles
from .borders import border_edges
from .colors import region_colors

__all__ = ["FloatArray", "Picture", "Scene", "build_scene"]

FloatArray = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]

_PLAIN_COLOR = (205, 197, 184)


@dataclass(frozen=True)
class Scene:
    """What is drawn, scaled and moved to a box of diagonal 1 around the origin."""

    points: FloatArray  # (P, 3), no two at one place, all used
    triangles: npt.NDArray[np.int64]  # (T, 3), faces, or what polygons are cut into
    colors: Picture  # (T, 3)
    borders: npt.NDArray[np.int64]  # (B, 2), ends of edges between regions
    n_regions: int  # 1 without labels

    @cached_property
    def normals(self) -> FloatArray:
        """Normal of each triangle, (T, 3), as long as its area."""
        first, second, third = (self.points[corner] for corner in self.triangles.T)
        return np.cross(second - first, third - first) / 2

    @property
    def mean_region_area(self) -> float:
        """Mean over regions; the box's diagonal is 1."""
        return float(np.linalg.norm(self.normals, axis=1).sum()) / self.n_regions


def _checked_colors(colors: npt.ArrayLike, n_faces: int) -> Picture:
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
        checked, n_regions = compact_labels(labels, mesh.n_faces)
        graph = build_face_graph(mesh)
        face_colors = region_colors(graph, checked)[checked]
        borders = places[representative[border_edges(mesh, graph, checked)]]
    if colors is not None:
        face_colors = _checked_colors(colors, mesh.n_faces)
    if sources is not None:
        face_colors = face_colors[sources]
    return Scene(points, triangles, face_colors, borders, n_regions)
