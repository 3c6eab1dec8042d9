"""Stage 1: which faces share an edge, or tetrahedra a triangle; centroids and areas."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .._types import Floats
from ..mesh.faces import FaceMesh, corners_of
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh
from ..mesh.triangle_mesh import Mesh
from .vectors import cross, norm


class Arc(NamedTuple):
    """A step from a face, over one of its sides, to a neighbor."""

    face: int
    side: int
    neighbor: int
    same_turn: bool


def build_face_graph(mesh: FaceMesh, *, weld: bool = True) -> list[Arc]:
    """All arcs, sorted by face, side and neighbor."""
    vertex_at: dict[tuple[float, ...], int] = {}
    corners = [
        [vertex_at.setdefault(tuple(mesh.vertices[v].tolist()), v) if weld else v for v in face]
        for face in _faces_of(mesh)
    ]
    sides_on_edge: dict[tuple[int, ...], dict[int, tuple[int, bool]]] = defaultdict(dict)
    for face, ring in enumerate(corners):
        for side, (start, end) in enumerate(zip(ring, ring[1:] + ring[:1], strict=True)):
            if start != end:
                edge = (min(start, end), max(start, end))
                sides_on_edge[edge].setdefault(face, (side, start < end))
    return _arcs_over(sides_on_edge)


def build_tet_graph(mesh: TetMesh, *, weld: bool = True) -> list[Arc]:
    """All arcs between tetrahedra, sorted likewise; what `same_turn` says means nothing."""
    vertex_at: dict[tuple[float, ...], int] = {}
    tets_on_triangle: dict[tuple[int, ...], dict[int, tuple[int, bool]]] = defaultdict(dict)
    for tet, corners in enumerate(mesh.tets.tolist()):
        lowest = [
            vertex_at.setdefault(tuple(mesh.vertices[v].tolist()), v) if weld else v
            for v in corners
        ]
        for side in range(4):
            triangle = tuple(sorted(lowest[:side] + lowest[side + 1 :]))
            if len(set(triangle)) == 3:
                tets_on_triangle[triangle].setdefault(tet, (side, True))
    return _arcs_over(tets_on_triangle)


def _faces_of(mesh: FaceMesh) -> list[list[int]]:
    corners = corners_of(mesh)
    ends = np.cumsum(np.broadcast_to(corners.sizes, mesh.n_faces))
    return [face.tolist() for face in np.split(corners.vertices, ends[:-1])]


def _arcs_over(sides: dict[tuple[int, ...], dict[int, tuple[int, bool]]]) -> list[Arc]:
    """Arcs between all pairs of cells on each side."""
    arcs = [
        Arc(cell, side, neighbor, ascending == neighbor_ascending)
        for cells in sides.values()
        for cell, (side, ascending) in cells.items()
        for neighbor, (_, neighbor_ascending) in cells.items()
        if cell != neighbor
    ]
    return sorted(arcs)


def measure_faces(mesh: Mesh) -> tuple[Floats, Floats]:
    """Centroids, shape (F, 3), and areas, shape (F,)."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return (a + b + c) / 3.0, 0.5 * norm(cross(b - a, c - a))


def measure_polygons(mesh: PolygonMesh) -> tuple[Floats, Floats]:
    """Centroids and areas by the fan, of faces that have a normal and do not cross themselves."""
    centroids, areas = np.empty((mesh.n_faces, 3)), np.empty(mesh.n_faces)
    for face in range(mesh.n_faces):
        origin, *others = mesh.vertices[mesh.face(face)]
        steps = [corner - origin for corner in others]
        doubled = [np.cross(u, v) for u, v in pairwise(steps)]
        total = np.sum(doubled, axis=0)
        shares = [vector @ total / (total @ total) for vector in doubled]
        thirds = [(u + v) / 3.0 for u, v in pairwise(steps)]
        centroids[face] = origin + sum(s * t for s, t in zip(shares, thirds, strict=True))
        areas[face] = 0.5 * np.linalg.norm(total)
    return centroids, areas
