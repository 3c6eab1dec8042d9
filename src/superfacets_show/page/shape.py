"""Encode the surface that a page shows: quantized positions, triangles, and border edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets import FaceGraph, build_face_graph, kit
from superfacets.kit import Array, BaseGraph, Cells, FaceMesh, Floats, Ints, Longs

from ..camera import View, view_axes
from ..scene import border_edges, upright
from .coding import Coding

STEPS = 65535
"""Number of quantization steps along each axis of the bounding box. The rounding error of a
position is at most half a step."""

# Diameter of a drawn point, as a multiple of the square root of the point's area. This diameter
# leaves few gaps between points.
_POINT_SIZE = 2.0


@dataclass(frozen=True)
class DrawnSurface:
    """Surface that a page draws for cells: triangles, or the points of a cloud.

    Vertices of a mesh at the same position are merged. The remaining vertices are sorted by their
    first use in `triangles`.
    """

    points: Floats  # (P, 3) vertices, or points of a cloud
    triangles: npt.NDArray[np.uint32] | None  # (T, 3) indices into `points`; None for a cloud
    # Index of the cell of each triangle, (T,); None if each triangle is a cell, or for a cloud.
    sources: npt.NDArray[np.uint32] | None
    normals: Floats | None  # (P, 3) normal of each point of a cloud; None for a mesh
    graph_of_cells: BaseGraph | None  # graph of tetrahedra or of points; None if faces are cells
    outline: _Outline | None  # edges that can be borders; None for a cloud

    @property
    def graph(self) -> BaseGraph:
        """Graph of all cells: their areas or volumes, and their neighbors."""
        if self.graph_of_cells is not None:
            return self.graph_of_cells
        assert self.outline is not None
        return self.outline.graph

    @property
    def areas(self) -> Floats:
        """Area of each drawn face or point."""
        return np.asarray((self.outline or self).graph.measures)

    @cached_property
    def bounds(self) -> Floats:
        """Bounding box, (2, 3): lower and upper corner."""
        return np.array([self.points.min(axis=0), self.points.max(axis=0)])

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box; 1 if all points are equal."""
        low, high = self.bounds
        return float(np.linalg.norm(high - low)) or 1.0

    @property
    def point_size(self) -> float:
        """Diameter of drawn points, as a fraction of the diagonal; 0 for a mesh."""
        if self.triangles is not None:
            return 0.0
        known = self.areas[self.areas > 0]
        area = float(np.median(known)) if len(known) else 0.0
        return _POINT_SIZE * float(np.sqrt(area)) / self.diagonal

    def quantized(self) -> npt.NDArray[np.uint16]:
        """Return `points` as integers, (P, 3): 0 to `STEPS` along each axis of the bounding box."""
        low, high = self.bounds
        extent = np.where(high > low, high - low, 1.0)
        return np.asarray(np.rint((self.points - low) / extent * STEPS), np.uint16)

    def view_facts(self, camera: View) -> dict[str, Any]:
        """Return the initial view: its angles and zoom, and three axes.

        The axes are the directions right, up, and toward the viewer, at azimuth 0 and elevation 0.
        """
        up = upright(camera, self.points, self.triangles).up
        right, toward, upward = view_axes(View(azimuth=0, elevation=0, up=up))
        return {
            "axes": np.stack([right, upward, toward]).tolist(),
            "view": {
                "azimuth": camera.azimuth, "elevation": camera.elevation, "zoom": camera.zoom,
            },
        }  # fmt: skip

    def parts(self, positions: Array) -> dict[str, tuple[Array, Coding]]:
        """Return the arrays for the JavaScript viewer by name, each with its most compact coding.

        `positions` is `points` or the result of `quantized`.
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
    """Edges between drawn faces. An edge is a border if the labels of its two faces differ."""

    mesh: FaceMesh
    cells: npt.NDArray[np.uint32] | None  # (F,) cell of each face; None if faces are cells
    places: npt.NDArray[np.uint32]  # (V,) index of each vertex in `DrawnSurface.points`

    @cached_property
    def graph(self) -> FaceGraph:
        """Graph of the faces, which the studio does not need."""
        return build_face_graph(self.mesh)

    def edges(self, labelings: Sequence[Ints]) -> npt.NDArray[np.uint32]:
        """Return the edges that are borders in at least one of the labelings, (B, 4).

        Each row contains the two vertices of an edge, as indices into `DrawnSurface.points`, and
        the two cells of the edge.
        """
        of_faces = labelings if self.cells is None else [each[self.cells] for each in labelings]
        ends, faces = border_edges(self.mesh, self.graph, of_faces)
        cells = faces if self.cells is None else self.cells[faces]
        return np.concatenate([self.places[ends], cells], axis=1, dtype=np.uint32, casting="unsafe")


def shape_of(cells: Cells, graph: Any = None) -> DrawnSurface:
    """Return the `DrawnSurface` of a mesh or a cloud; of tetrahedra, only the outer surface.

    `graph`, by default built here, is the graph of the cells in their order.
    """
    kind, threads = kit.kind_of(cells), kit.checked_threads(None)
    drawn = kind.drawn_faces(cells)
    if drawn is None:
        points = kind.point_graph(cells, threads) if graph is None else graph
        return DrawnSurface(points.positions, None, None, points.normals, points, None)
    surface, sources = drawn
    if sources is None:
        return _surface_shape(surface, None, None)
    graph = kind.build_graph(cells, True, threads)[0] if graph is None else graph
    return _surface_shape(surface, sources.astype(np.uint32), graph)


def _surface_shape(
    mesh: FaceMesh, cells: npt.NDArray[np.uint32] | None, graph: BaseGraph | None
) -> DrawnSurface:
    """Return the `DrawnSurface` of a mesh whose faces are either cells or sides of tetrahedra.

    `cells` is the tetrahedron of each face, and `graph` the graph of all tetrahedra. Both are None
    if the faces are cells.
    """
    drawn, sources = kit.cut_into_triangles(mesh)
    corners = kit.lowest_vertices(mesh.vertices, True, kit.checked_threads(None))
    used, triangles, places = _numbered_by_use(corners[drawn], mesh.n_vertices)
    outline = _Outline(mesh, cells, places[corners])
    if sources is not None:
        cells = sources.astype(np.uint32)
    return DrawnSurface(mesh.vertices[used], triangles, cells, None, graph, outline)


def _numbered_by_use(
    corners: Ints, n_vertices: int
) -> tuple[Longs, npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """Renumber the vertices of triangles in the order of their first use in `corners`.

    Returns the used vertices in the new order, the corners with new numbers, and the new number of
    each vertex (0 for unused vertices).
    """
    flat = corners.ravel()
    first = np.full(n_vertices, len(flat), dtype=np.int64)  # first corner that uses each vertex
    first[flat[::-1]] = np.arange(len(flat) - 1, -1, -1)  # the lowest corner is written last
    is_first = np.zeros(len(flat), dtype=bool)
    is_first[first[first < len(flat)]] = True
    used = flat[is_first].astype(np.int64)
    places = np.zeros(n_vertices, dtype=np.uint32)
    places[used] = np.arange(len(used), dtype=np.uint32)
    return used, places[corners], places


def _packed(directions: Floats) -> npt.NDArray[np.uint16]:
    """Encode unit vectors in two bytes with octahedral encoding; a zero vector becomes 0."""
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
    codes = np.maximum(low | (high << 8), 1)  # 0 is reserved; 1 decodes to nearly the same vector
    return np.where(sums[:, 0] > 0, codes, 0).astype(np.uint16)
