"""Shapes on a page: quantized positions, triangles or points, and possible borders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from ..._types import Array, Floats, Ints, Longs
from ..._validate import checked_threads
from ...cells.cell_graph import CsrArcs
from ...cells.face_graph import FaceGraph, build_face_graph
from ...cells.kinds import kind_of
from ...cells.point_graph import PointGraph, find_point_graph
from ...mesh.cells import Cells
from ...mesh.faces import FaceMesh, cut_into_triangles, ends_of_sides, measure_faces
from ...mesh.point_cloud import PointCloud
from ..camera import View, view_axes
from ..scene import Scene, guess_up, hexagons_of
from .coding import Coding

STEPS = 65535
"""Number of steps along a side of the bounding box; positions have errors of up to half a step."""

# Diameter of a drawn point, in units of the square root of the area of the point. There are then
# few gaps between points.
_POINT_SIZE = 2.0


@dataclass(frozen=True)
class Shape:
    """The drawn surface of cells: triangles, or the points of a cloud.

    Points of a mesh have no duplicates, and are in the order of their first use by triangles.
    """

    points: Floats  # (P, 3)
    triangles: npt.NDArray[np.uint32] | None  # (T, 3); None: the points are the cells
    sources: npt.NDArray[np.uint32] | None  # (T,) cell of each triangle; None: they are the cells
    normals: Floats | None  # (P, 3) for a cloud; None for a mesh
    measures: Floats  # (N,) area or volume of each cell
    areas: Floats  # areas of the drawn faces or points
    graph: CsrArcs  # neighbors of all cells
    outline: _Outline | None  # None without borders

    @cached_property
    def bounds(self) -> Floats:
        """The low and the high corner of the bounding box, (2, 3)."""
        return np.array([self.points.min(axis=0), self.points.max(axis=0)])

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box; 1 if all points coincide."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low)) or 1.0

    @property
    def scene(self) -> Scene:
        """The triangles, or one triangle per point, in a box of diagonal 1, without colors."""
        points, triangles = self.points, self.triangles
        if isinstance(self.graph, PointGraph):
            points = hexagons_of(self.graph)  # one triangle per hexagon suffices
            triangles = np.arange(len(points), dtype=np.uint32).reshape(-1, 6)[:, ::2]
        assert triangles is not None
        points = (points - self.bounds.mean(axis=0)) / self.diagonal
        none = np.empty((0, 3), np.uint8)
        return Scene(points, triangles.astype(np.int64), none, np.empty((0, 2), np.int64), 1)

    @property
    def point_size(self) -> float:
        """Diameter of the points of a cloud, in diagonals; 0 for a mesh."""
        if self.triangles is not None:
            return 0.0
        known = self.areas[self.areas > 0]
        area = float(np.median(known)) if len(known) else 0.0
        return _POINT_SIZE * float(np.sqrt(area)) / self.diagonal

    def quantized(self) -> npt.NDArray[np.uint16]:
        """Positions as multiples of 1 / `STEPS` of the bounding box, 0 to `STEPS`, (P, 3)."""
        low, high = self.bounds
        extent = np.where(high > low, high - low, 1.0)
        return np.asarray(np.rint((self.points - low) / extent * STEPS), np.uint16)

    def parts(self, positions: Array) -> dict[str, tuple[Array, Coding]]:
        """Arrays for the front end, each with its most compact encoding.

        ``positions`` are the coordinates of `points` in the unit of the caller.
        """
        found: dict[str, tuple[Array, Coding]] = {"positions": (positions, "difference")}
        if self.triangles is not None:
            found["triangles"] = self.triangles, "newest"
        if self.sources is not None:
            found["sources"] = self.sources, "difference"
        if self.normals is not None:
            found["normals"] = _packed(self.normals), "planes"
        return found


@dataclass(frozen=True)
class _Outline:
    """Edges between visible faces."""

    mesh: FaceMesh
    graph: FaceGraph
    cells: npt.NDArray[np.uint32] | None  # cell of each face; None: each face is a cell
    places: npt.NDArray[np.uint32]  # (V,) the drawn vertex of each vertex of the mesh

    def edges(self, labelings: Sequence[Ints]) -> npt.NDArray[np.uint32]:
        """Two vertices and two cells of each edge between regions, (B, 4)."""
        sources = np.repeat(
            np.arange(self.mesh.n_faces, dtype=np.int32), np.diff(self.graph.offsets)
        )
        targets = self.graph.neighbors
        is_border = np.zeros(len(targets), dtype=bool)
        for labels in labelings:
            of_face = labels if self.cells is None else labels[self.cells]
            is_border |= of_face[sources] != of_face[targets]
        kept = np.flatnonzero(is_border & (sources < targets))
        faces, others = sources[kept], targets[kept]
        ends = self.places[ends_of_sides(self.mesh, faces, self.graph.sides[kept])]
        cells = np.stack([faces, others], axis=1).astype(np.uint32)
        if self.cells is not None:
            cells = self.cells[cells]
        return np.concatenate([ends, cells], axis=1)


def view_facts(shape: Shape, camera: View) -> dict[str, Any]:
    """The first view: axes (right, up, toward the viewer at azimuth 0), angles and zoom."""
    up = guess_up(shape.scene) if camera.up == "auto" else camera.up
    right, toward, upward = view_axes(replace(View(azimuth=0, elevation=0), up=up))
    return {
        "axes": np.stack([right, upward, toward]).tolist(),
        "view": {
            "azimuth": camera.azimuth, "elevation": camera.elevation, "zoom": camera.zoom,
        },
    }  # fmt: skip


def shape_of(cells: Cells) -> Shape:
    """Return the drawn shape of a mesh, of the surface of tetrahedra, or of a cloud."""
    kind = kind_of(cells)
    outside = kind.outside(cells)
    if outside is None:
        return _cloud_shape(kind.cloud(cells))
    surface, sources = outside
    if sources is None:
        return _surface_shape(surface, None, None, None)
    threads = checked_threads(None)
    graph, _ = kind.build_graph(cells, True, threads)
    return _surface_shape(surface, sources.astype(np.uint32), graph.measures, graph)


def _surface_shape(
    mesh: FaceMesh,
    cells: npt.NDArray[np.uint32] | None,
    measures: Floats | None,
    cell_graph: CsrArcs | None,
) -> Shape:
    """The shape of faces, which are either cells or sides of cells."""
    threads = checked_threads(None)
    graph = build_face_graph(mesh)
    areas = measure_faces(mesh, threads)[1]
    drawn, sources = cut_into_triangles(mesh)
    corners = _core.weld_vertices(mesh.vertices, threads)
    used, triangles, places = _numbered_by_use(corners[drawn], mesh.n_vertices)
    outline = _Outline(mesh, graph, cells, places[corners])
    if sources is not None:
        cells = sources.astype(np.uint32)
    return Shape(
        mesh.vertices[used], triangles, cells, None,
        areas if measures is None else measures, areas, cell_graph or graph, outline,
    )  # fmt: skip


def _numbered_by_use(
    corners: Ints, n_vertices: int
) -> tuple[Longs, npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """Vertices in order of first use, corners as new indices, new index of each vertex or 0."""
    flat = corners.ravel()
    first = np.full(n_vertices, len(flat), dtype=np.int64)  # first corner that uses each vertex
    first[flat[::-1]] = np.arange(len(flat) - 1, -1, -1)  # the last of several writes counts
    is_first = np.zeros(len(flat), dtype=bool)
    is_first[first[first < len(flat)]] = True
    used = flat[is_first].astype(np.int64)
    places = np.zeros(n_vertices, dtype=np.uint32)
    places[used] = np.arange(len(used), dtype=np.uint32)
    return used, places[corners], places


def _cloud_shape(cloud: PointCloud) -> Shape:
    graph: PointGraph = find_point_graph(cloud, checked_threads(None))
    return Shape(
        graph.positions, None, None, graph.normals, graph.measures, graph.measures, graph, None
    )


def _packed(directions: Floats) -> npt.NDArray[np.uint16]:
    """Unit vectors in two bytes, by octahedral encoding; 0 for a zero vector."""
    sums = np.abs(directions).sum(axis=1, keepdims=True)
    folded = directions / np.where(sums > 0, sums, 1)
    x, y = folded[:, 0], folded[:, 1]
    signs = np.where(folded[:, :2] < 0, -1.0, 1.0)
    is_below = folded[:, 2] < 0
    x, y = (
        np.where(is_below, (1 - np.abs(y)) * signs[:, 0], x),
        np.where(is_below, (1 - np.abs(x)) * signs[:, 1], y),
    )
    low, high = (np.rint((part + 1) * 127).astype(np.uint16) for part in (x, y))
    codes = np.maximum(low | (high << 8), 1)  # (0, 0, -1) has several codes
    return np.where(sums[:, 0] > 0, codes, 0).astype(np.uint16)
