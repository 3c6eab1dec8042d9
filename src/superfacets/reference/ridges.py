"""Stage 2: edges of machine parts, which count as creases though they are convex."""

from __future__ import annotations

import math

import numpy as np

from .._types import Bools, Floats
from ..mesh.triangle_mesh import Mesh
from .face_graph import Arc

SHARP_ANGLE = math.pi * 2 / 9
"""40 degrees."""

MAX_STEPS = 64
"""Around a vertex."""


def find_ridges(
    mesh: Mesh, arcs: list[Arc], thetas: Floats, concave: Bools, *, weld: bool
) -> list[int]:
    """Arcs across sharp convex edges between triangles that are flat beside them.

    At both ends such an edge must meet another one, or a border of the surface.
    """
    surface = _Surface(mesh, arcs, weld)
    sharp = np.flatnonzero((thetas >= SHARP_ANGLE) & ~concave).tolist()
    found = {index for index in sharp if surface.is_flat_beside(index, thetas)}
    return [index for index in sorted(found) if surface.continues(index, found)]


class _Surface:
    """Faces, and the arcs that lead from each."""

    def __init__(self, mesh: Mesh, arcs: list[Arc], weld: bool) -> None:
        self._mesh = mesh
        self._arcs = arcs
        self._weld = weld
        self._of_face: dict[int, list[tuple[int, int]]] = {}  # neighbor and arc
        for index, arc in enumerate(arcs):
            self._of_face.setdefault(arc.face, []).append((arc.neighbor, index))

    def is_flat_beside(self, index: int, thetas: Floats) -> bool:
        """Whether an arc is the only one between its faces, and both are flat but for it."""
        face, _, neighbor, _ = self._arcs[index]
        is_only = [other for other, _ in self._of_face[face]].count(neighbor) == 1
        theta = float(thetas[index])
        return is_only and all(
            self._is_flat([float(thetas[i]) for to, i in self._of_face[here] if to != there], theta)
            for here, there in ((face, neighbor), (neighbor, face))
        )

    @staticmethod
    def _is_flat(bends: list[float], theta: float) -> bool:
        """Whether the other edges of a face bend little, but for one that is as sharp."""
        bent = [bend for bend in bends if bend >= 0.3 * theta]
        alike = [max(SHARP_ANGLE, 0.7 * theta) <= bend and 0.7 * bend <= theta for bend in bent]
        return len(bent) <= 1 and all(alike)

    def continues(self, index: int, found: set[int]) -> bool:
        """Whether an arc found meets another, or a border, at both ends of its edge."""
        face, side, neighbor, _ = self._arcs[index]
        ends = [self._name(self._mesh.faces[face, corner % 3]) for corner in (side, side + 1)]
        return all(
            self._leads_to_another(end, face, neighbor, found)
            or self._leads_to_another(end, neighbor, face, found)
            for end in ends
        )

    def _leads_to_another(self, corner: object, before: int, here: int, found: set[int]) -> bool:
        start = before
        for _ in range(MAX_STEPS):
            step = self._next_around(corner, before, here)
            if step is None:
                return True  # a border
            if step[1] in found:
                return True
            before, here = here, step[0]
            if here == start:
                return False
        return False

    def _next_around(self, corner: object, before: int, here: int) -> tuple[int, int] | None:
        names = [self._name(vertex) for vertex in self._mesh.faces[here]]
        opposite = (names.index(corner) + 1) % 3
        further = [
            (neighbor, index)
            for neighbor, index in self._of_face[here]
            if self._arcs[index].side != opposite and neighbor != before
        ]
        return further[0] if len(further) == 1 else None

    def _name(self, vertex: int) -> object:
        return tuple(self._mesh.vertices[vertex].tolist()) if self._weld else vertex
