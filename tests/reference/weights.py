"""Stage 2: compute arc weights, sharp edges, ridges, and eigenvectors for the embedding."""

from __future__ import annotations

import math

import numpy as np

from superfacets.base.types import Bools, Floats, Ints, Longs, Singles
from superfacets.mesh.meshes import Mesh

from .arithmetic import arctangent, dot, norm
from .cells import Arc, measure_faces


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
    """Return the weight of each arc, computed with equations 1 to 3 of the paper.

    `crease_length`, if given, replaces |e| in equation 2. The relative cost of ridges is the
    maximum of `ridges` and `eta_convex`. If `hollows` is true, smooth convex edges of hollow shapes
    have a cost, and their smooth concave edges cost less. This needs a closed, consistently
    oriented mesh.
    """
    used = mesh.vertices[np.unique(mesh.faces)]
    diagonal = float(norm(used.max(axis=0) - used.min(axis=0)))
    volume = _signed_volume(mesh, arcs, weld)
    noise = 1e-12 * diagonal**3
    geodesics, edges, thetas, concave = _measure_arcs(mesh, arcs, inside_out=volume < -noise)
    lengths = edges if crease_length is None else crease_length
    of_concave, of_convex = np.ones(len(arcs)), np.full(len(arcs), eta_convex)
    is_ridge = find_ridges(mesh, arcs, thetas, concave, weld=weld)
    if hollows and abs(volume) > noise and not any(arc.same_turn for arc in arcs):
        turns = np.where(concave, -thetas, thetas) * edges
        turns[is_ridge if ridges > eta_convex else []] = 0.0
        area = float(measure_faces(mesh)[1].sum())
        convex_share = _convex_share_of(float(turns.sum()), abs(volume), area)
        is_smooth = thetas < SHARP_ANGLE
        of_concave[is_smooth] = 1.0 - convex_share
        of_convex[is_smooth] = max(eta_convex, convex_share)
    of_convex[is_ridge] = max(ridges, eta_convex)
    eta = np.where(concave, of_concave, of_convex)
    angular = alpha * eta * lengths * thetas / math.pi  # equation 2
    weights: Floats = (geodesics + angular) / diagonal  # equation 3
    return weights


def _measure_arcs(
    mesh: Mesh, arcs: list[Arc], *, inside_out: bool
) -> tuple[Floats, Floats, Floats, Bools]:
    """Return the path length, edge length and angle of each arc, and whether it is concave."""
    centroids, areas = measure_faces(mesh)
    normals = unit_normals(mesh)
    terms, concave = [], []
    for face, side, neighbor, same_turn in arcs:
        start = mesh.vertices[mesh.faces[face, side]]
        end = mesh.vertices[mesh.faces[face, (side + 1) % 3]]
        middle = 0.5 * (start + end)
        # equation 1
        geodesic = norm(centroids[face] - middle) + norm(middle - centroids[neighbor])
        n_i, n_j = normals[face], normals[neighbor]
        if same_turn:
            a_i, a_j = areas[face], areas[neighbor]
            as_large = abs(a_i - a_j) <= 1e-9 * max(a_i, a_j)
            flips_j = face < neighbor if as_large else a_i > a_j
            n_i, n_j = (n_i, -n_j) if flips_j else (-n_i, n_j)
        rise = dot(n_i - n_j, centroids[neighbor] - centroids[face])
        concave.append(bool(rise < 0 if inside_out else rise > 0))
        terms.append((geodesic, norm(end - start), norm(np.cross(n_i, n_j)), dot(n_i, n_j)))
    geodesics, edges, sines, cosines = np.array(terms).reshape(-1, 4).T
    return geodesics, edges, arctangent(sines, cosines), np.array(concave, dtype=bool)


def _convex_share_of(turn: float, volume: float, area: float) -> float:
    """Return the relative cost of smooth convex edges, from 0 (solid shapes) to 1/4 (hollow).

    `turn` is the sum, over all arcs, of angle times edge length. Angles of concave edges are
    negative.
    """
    roundness = 3.0 * volume * turn / 4.0 / area**2
    hollowness = min(max((0.3 - roundness) / (0.3 - 0.15), 0.0), 1.0)
    return 0.25 * round(2**16 * hollowness) / 2**16


def unit_normals(mesh: Mesh) -> Floats:
    """Return the unit normals of faces, (F, 3), or 0 for degenerate faces."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    lengths = norm(normals)
    longest = np.max([dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)], axis=0)
    exists = lengths > 8 * np.finfo(np.float64).eps * longest
    return np.where(exists[:, None], normals / np.where(exists, lengths, 1.0)[:, None], 0.0)


def _signed_volume(mesh: Mesh, arcs: list[Arc], weld: bool) -> float:
    """Return the volume of the mesh, negative if normals point inward, or 0 if the mesh is open."""
    corners = mesh.vertices[mesh.faces]
    names = corners.tolist() if weld else [[[v] for v in face] for face in mesh.faces.tolist()]
    # A side without an arc is on the boundary, unless its two ends are equal, or another side of
    # the same face with the same ends has an arc.
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
    return float(np.sum(dot(a, np.cross(b, c)))) / 6.0


def quantize_weights(weights: Floats) -> tuple[Singles, float]:
    """Round weights to integer multiples of a unit; return the integers and the unit."""
    chunks = np.zeros((-(-len(weights) // 4096), 4096))
    chunks.flat[: len(weights)] = weights
    partial_sums = np.cumsum(chunks, axis=1)[:, -1]  # adds from left to right
    total = float(np.cumsum(partial_sums)[-1]) if len(weights) else 0.0
    unit = 2.0 ** (math.frexp(total)[1] - 48) if total > 0 else 1.0
    return np.maximum(1.0, np.rint(weights / unit)).astype(np.float32), unit


SHARP_ANGLE = math.pi * 2 / 9
"""Minimum angle between the normals at a sharp edge: 40 degrees, in radians."""

MAX_STEPS = 64
"""Maximum number of faces that are visited around a vertex."""


def find_ridges(
    mesh: Mesh, arcs: list[Arc], thetas: Floats, concave: Bools, *, weld: bool
) -> list[int]:
    """Return the arcs across ridges, as defined by `superfacets.crease_weights`."""
    surface = _Surface(mesh, arcs, weld)
    sharp = np.flatnonzero((thetas >= SHARP_ANGLE) & ~concave).tolist()
    found = {index for index in sharp if surface.is_flat_beside(index, thetas)}
    return [index for index in sorted(found) if surface.continues(index, found)]


class _Surface:
    """Faces of a mesh and their arcs, with methods that test whether an edge is a ridge."""

    def __init__(self, mesh: Mesh, arcs: list[Arc], weld: bool) -> None:
        self._mesh = mesh
        self._arcs = arcs
        self._weld = weld
        self._of_face: dict[int, list[tuple[int, int]]] = {}  # (neighbor, arc index) of each face
        for index, arc in enumerate(arcs):
            self._of_face.setdefault(arc.face, []).append((arc.neighbor, index))

    def is_only(self, index: int) -> bool:
        """Return whether an arc is the only arc between its two faces."""
        face, _, neighbor, _ = self._arcs[index]
        return [other for other, _ in self._of_face[face]].count(neighbor) == 1

    def is_flat_beside(self, index: int, thetas: Floats) -> bool:
        """Return whether an arc is the only arc between its faces, and their other edges are flat.

        See `_is_flat` for an exception.
        """
        face, _, neighbor, _ = self._arcs[index]
        theta = float(thetas[index])
        return self.is_only(index) and all(
            self._is_flat([float(thetas[i]) for to, i in self._of_face[here] if to != there], theta)
            for here, there in ((face, neighbor), (neighbor, face))
        )

    @staticmethod
    def _is_flat(bends: list[float], theta: float) -> bool:
        """Return whether all angles `bends` are small, except at most one that is near `theta`."""
        bent = [bend for bend in bends if bend >= 0.3 * theta]
        alike = [max(SHARP_ANGLE, 0.7 * theta) <= bend and 0.7 * bend <= theta for bend in bent]
        return len(bent) <= 1 and all(alike)

    def continues(self, index: int, found: set[int]) -> bool:
        """Return whether an edge continues as a ridge at both ends, as in `crease_weights`."""
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
                return True  # boundary of the mesh, or edge of three or more faces
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


def smallest_eigenpairs(
    offsets: Longs,
    neighbors: Ints,
    conductances: Floats,
    measures: Floats,
    n_constants: int,
    n_wanted: int,
) -> tuple[Floats, Floats]:
    """Return the smallest eigenvalues of L x = lambda A x, and their eigenvectors, (N, n_wanted).

    L is the Laplacian with the arc weights `conductances`, and A is the diagonal matrix of
    `measures`. The first `n_constants` eigenvalues are skipped. Results of the C++ core differ only
    by rounding errors and by the signs of eigenvectors.
    """
    n = len(measures)
    laplacian = np.zeros((n, n))
    sources = np.repeat(np.arange(n), np.diff(offsets))
    np.add.at(laplacian, (sources, neighbors), -conductances)
    laplacian[np.diag_indices(n)] -= laplacian.sum(axis=1)
    scale = 1.0 / np.sqrt(measures)
    values, vectors = np.linalg.eigh(scale[:, None] * laplacian * scale)
    some = slice(n_constants, n_constants + n_wanted)
    return values[some], (scale[:, None] * vectors)[:, some]
