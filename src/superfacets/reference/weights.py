"""Stage 2: eq. 1 to 3, and whole units."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..mesh.triangle_mesh import Mesh
from .elementary import arctangent
from .face_graph import Arc, measure_faces
from .vectors import cross, dot, norm

__all__ = ["quantize_weights", "superfacet_weights", "unit_normals"]

Floats = npt.NDArray[np.float64]


def superfacet_weights(
    mesh: Mesh,
    arcs: list[Arc],
    *,
    alpha: float,
    eta_convex: float,
    crease_length: float | None = None,
    ridges: float = 0.0,
    hollows: bool = False,
    weld: bool = True,
) -> Floats:
    """Weight of each arc, eq. 1-3 of the paper; `crease_length` stands for |e| in eq. 2.

    Ridges count `ridges` where that is more than `eta_convex`. With `hollows`, smooth edges are
    evened where a shape is hollow.
    """
    used = mesh.vertices[np.unique(mesh.faces)]
    diagonal = float(norm(used.max(axis=0) - used.min(axis=0)))
    volume = _signed_volume(mesh, arcs, weld)
    inside_out = volume < -1e-12 * diagonal**3
    centroids, areas = measure_faces(mesh)
    normals = unit_normals(mesh)
    terms = []
    edges = []
    concave = []
    for face, side, neighbor, same_turn in arcs:
        start = mesh.vertices[mesh.faces[face, side]]
        end = mesh.vertices[mesh.faces[face, (side + 1) % 3]]
        middle = 0.5 * (start + end)
        geodesic = norm(centroids[face] - middle) + norm(middle - centroids[neighbor])  # eq. 1
        n_i, n_j = normals[face], normals[neighbor]
        if same_turn:
            a_i, a_j = areas[face], areas[neighbor]
            as_large = abs(a_i - a_j) <= 1e-9 * max(a_i, a_j)
            turn_j = face < neighbor if as_large else a_i > a_j
            n_i, n_j = (n_i, -n_j) if turn_j else (-n_i, n_j)
        rise = dot(n_i - n_j, centroids[neighbor] - centroids[face])
        concave.append(bool(rise < 0 if inside_out else rise > 0))
        edges.append(norm(end - start))
        length = edges[-1] if crease_length is None else crease_length
        terms.append((geodesic, length, norm(cross(n_i, n_j)), dot(n_i, n_j)))
    geodesics, lengths, sines, cosines = np.array(terms).reshape(-1, 4).T
    thetas = arctangent(sines, cosines)
    of_convex = np.full(len(arcs), eta_convex)
    is_ridge = _find_ridges(mesh, arcs, thetas, concave, weld=weld)
    of_concave = np.ones(len(arcs))
    if hollows and abs(volume) > 1e-12 * diagonal**3 and not any(arc.same_turn for arc in arcs):
        turns = np.where(concave, -thetas, thetas) * np.array(edges)
        turns[is_ridge if ridges > eta_convex else []] = 0.0
        evened = _evened_share(float(turns.sum()), abs(volume), float(areas.sum()))
        is_smooth = thetas < math.pi * 2 / 9
        of_concave[is_smooth] = 1.0 - evened
        of_convex[is_smooth] = max(eta_convex, evened)
    of_convex[is_ridge] = max(ridges, eta_convex)
    eta = np.where(np.array(concave, dtype=bool), of_concave, of_convex)
    angular = alpha * eta * lengths * thetas / math.pi  # eq. 2
    weights: Floats = (geodesics + angular) / diagonal  # eq. 3
    return weights


def _evened_share(turn: float, volume: float, area: float) -> float:
    """A quarter for hollow shapes, 0 for solid ones; the turn is over arcs, two for each edge."""
    roundness = 3.0 * volume * turn / 4.0 / area**2
    share = min(max((0.3 - roundness) / (0.3 - 0.15), 0.0), 1.0)
    return 0.25 * round(2**16 * share) / 2**16


def _find_ridges(
    mesh: Mesh, arcs: list[Arc], thetas: Floats, concave: list[bool], *, weld: bool
) -> list[int]:
    """Arcs across sharp convex edges between triangles that are flat beside them.

    At both ends such an edge must meet another one, or a border of the surface.
    """
    sharp = math.pi * 2 / 9  # 40 degrees
    of_face: dict[int, list[tuple[int, int]]] = {}  # neighbor and arc
    for index, arc in enumerate(arcs):
        of_face.setdefault(arc.face, []).append((arc.neighbor, index))

    def is_flat(face: int, other: int, theta: float) -> bool:
        bends = [float(thetas[i]) for neighbor, i in of_face[face] if neighbor != other]
        bent = [bend for bend in bends if bend >= 0.3 * theta]
        alike = [max(sharp, 0.7 * theta) <= bend and 0.7 * bend <= theta for bend in bent]
        return len(bent) <= 1 and all(alike)

    def is_only(face: int, other: int) -> bool:
        return [neighbor for neighbor, _ in of_face[face]].count(other) == 1

    def name(vertex: int) -> object:
        return tuple(mesh.vertices[vertex].tolist()) if weld else vertex

    found = {
        index
        for index, (arc, theta) in enumerate(zip(arcs, thetas.tolist(), strict=True))
        if theta >= sharp
        and not concave[index]
        and is_only(arc.face, arc.neighbor)
        and is_flat(arc.face, arc.neighbor, theta)
        and is_flat(arc.neighbor, arc.face, theta)
    }

    def next_around(corner: object, before: int, here: int) -> tuple[int, int] | None:
        names = [name(vertex) for vertex in mesh.faces[here]]
        opposite = (names.index(corner) + 1) % 3
        further = [
            (neighbor, index)
            for neighbor, index in of_face[here]
            if arcs[index].side != opposite and neighbor != before
        ]
        return further[0] if len(further) == 1 else None

    def leads_to_another(corner: object, before: int, here: int) -> bool:
        start = before
        for _ in range(64):
            step = next_around(corner, before, here)
            if step is None:
                return True  # a border
            if step[1] in found:
                return True
            before, here = here, step[0]
            if here == start:
                return False
        return False

    def continues(index: int) -> bool:
        face, side, neighbor, _ = arcs[index]
        ends = [name(mesh.faces[face, corner % 3]) for corner in (side, side + 1)]
        return all(
            leads_to_another(end, face, neighbor) or leads_to_another(end, neighbor, face)
            for end in ends
        )

    return [index for index in sorted(found) if continues(index)]


def unit_normals(mesh: Mesh) -> Floats:
    """Unit normals; zero where a face has none."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    normals = cross(b - a, c - a)
    lengths = norm(normals)
    longest = np.max([dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)], axis=0)
    exists = lengths > 8 * np.finfo(np.float64).eps * longest
    return np.where(exists[:, None], normals / np.where(exists, lengths, 1.0)[:, None], 0.0)


def _signed_volume(mesh: Mesh, arcs: list[Arc], weld: bool) -> float:
    """What the mesh encloses, negative where normals point inwards; 0 if it is open."""
    corners = mesh.vertices[mesh.faces]
    names = corners.tolist() if weld else [[[v] for v in face] for face in mesh.faces.tolist()]
    # A side without an arc is on the boundary, unless its two ends are one vertex or its face runs
    # through the same edge twice.
    with_arc = {(arc.face, arc.side) for arc in arcs}
    for face, ends in enumerate(names):
        edges = [frozenset((tuple(ends[s]), tuple(ends[(s + 1) % 3]))) for s in range(3)]
        reached = {edges[side] for side in range(3) if (face, side) in with_arc}
        if any(len(edge) == 2 and edge not in reached for edge in edges):
            return 0.0
    centroids, areas = measure_faces(mesh)
    weights = areas if areas.any() else np.ones(mesh.n_faces)
    origin = np.cumsum(weights[:, None] * centroids, axis=0)[-1] / np.cumsum(weights)[-1]
    a, b, c = (corners[:, corner] - origin for corner in range(3))
    return float(np.sum(dot(a, cross(b, c)))) / 6.0


def quantize_weights(weights: Floats) -> tuple[npt.NDArray[np.float32], float]:
    """Weights as whole numbers of a unit, and the unit."""
    chunks = np.zeros((-(-len(weights) // 4096), 4096))
    chunks.flat[: len(weights)] = weights
    partial_sums = np.cumsum(chunks, axis=1)[:, -1]  # cumsum adds from left to right
    total = float(np.cumsum(partial_sums)[-1]) if len(weights) else 0.0
    unit = 2.0 ** (math.frexp(total)[1] - 48) if total > 0 else 1.0
    return np.maximum(1.0, np.rint(weights / unit)).astype(np.float32), unit
