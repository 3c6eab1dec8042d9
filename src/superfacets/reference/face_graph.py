"""Stage 1: which faces share an edge; centroids and areas."""

from __future__ import annotations

from collections import defaultdict
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..mesh.triangle_mesh import Mesh
from .vectors import cross, norm

__all__ = ["Arc", "build_face_graph", "measure_faces"]

Floats = npt.NDArray[np.float64]


class Arc(NamedTuple):
    """A step from a face, over one of its sides, to a neighbor."""

    face: int
    side: int
    neighbor: int
    same_turn: bool


def build_face_graph(mesh: Mesh, *, weld: bool = True) -> list[Arc]:
    """All arcs, sorted by face, side and neighbor."""
    vertex_at: dict[tuple[float, ...], int] = {}
    corners = [
        [vertex_at.setdefault(tuple(mesh.vertices[v].tolist()), v) if weld else v for v in face]
        for face in mesh.faces.tolist()
    ]
    sides_on_edge: dict[tuple[int, int], dict[int, tuple[int, bool]]] = defaultdict(dict)
    for face, (a, b, c) in enumerate(corners):
        for side, (start, end) in enumerate(((a, b), (b, c), (c, a))):
            if start != end:
                edge = (min(start, end), max(start, end))
                sides_on_edge[edge].setdefault(face, (side, start < end))
    arcs = [
        Arc(face, side, neighbor, ascending == neighbor_ascending)
        for faces in sides_on_edge.values()
        for face, (side, ascending) in faces.items()
        for neighbor, (_, neighbor_ascending) in faces.items()
        if face != neighbor
    ]
    return sorted(arcs)


def measure_faces(mesh: Mesh) -> tuple[Floats, Floats]:
    """Centroids, shape (F, 3), and areas, shape (F,)."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return (a + b + c) / 3.0, 0.5 * norm(cross(b - a, c - a))
