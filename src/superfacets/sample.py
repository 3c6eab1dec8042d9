"""A mesh to try things on: a plush bear whose parts meet in sharp concave creases.

The bear is the union of solid ellipsoids, so the part that each face belongs to is known.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from ._validate import checked_count
from .mesh import Mesh

__all__ = ["PART_NAMES", "sample_mesh", "sample_parts"]

FloatArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class _Solid:
    """An ellipsoid: radii along its own axes, turned about x, then y, then z (degrees)."""

    name: str
    center: tuple[float, float, float]
    radii: tuple[float, float, float]
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)


# The bear sits, looks along +z, and y is up. It is a little lopsided, so that no two distances
# on it are equal. Surfaces cross at 45 degrees and more: shallower creases polygonise badly.
_SOLIDS = (
    _Solid("body", (0.0, 0.0, 0.0), (0.60, 0.70, 0.52), (-6, 0, 0)),
    _Solid("head", (0.04, 0.98, 0.10), (0.55, 0.47, 0.46), (4, 8, -5)),
    _Solid("muzzle", (0.10, 0.80, 0.50), (0.28, 0.20, 0.24), (6, 10, -5)),
    _Solid("nose", (0.125, 0.885, 0.715), (0.125, 0.095, 0.10), (0, 10, -5)),
    _Solid("right ear", (-0.38, 1.36, 0.05), (0.21, 0.22, 0.11), (-8, 4, 32)),
    _Solid("left ear", (0.50, 1.31, 0.00), (0.22, 0.21, 0.11), (-6, 16, -38)),
    _Solid("right eye", (-0.15, 1.165, 0.485), (0.092, 0.096, 0.09)),
    _Solid("left eye", (0.32, 1.135, 0.445), (0.092, 0.096, 0.09)),
    _Solid("right arm", (-0.62, 0.22, 0.20), (0.40, 0.18, 0.19), (0, 24, 34)),
    _Solid("left arm", (0.66, 0.42, 0.16), (0.40, 0.18, 0.19), (0, -18, 26)),
    _Solid("right paw", (-0.90, 0.02, 0.32), (0.20, 0.19, 0.19)),
    _Solid("left paw", (0.97, 0.60, 0.24), (0.20, 0.19, 0.19)),
    _Solid("right leg", (-0.42, -0.50, 0.52), (0.24, 0.23, 0.50), (6, -24, 0)),
    _Solid("left leg", (0.46, -0.50, 0.50), (0.24, 0.23, 0.50), (6, 32, 0)),
    _Solid("right foot", (-0.63, -0.44, 0.99), (0.25, 0.31, 0.13), (-8, -24, 4)),
    _Solid("left foot", (0.75, -0.44, 0.94), (0.25, 0.31, 0.13), (-8, 32, -4)),
    _Solid("tail", (0.03, -0.40, -0.53), (0.17, 0.17, 0.17)),
)

PART_NAMES = tuple(solid.name for solid in _SOLIDS)
"""Name of each solid, in the order of the numbers that `sample_parts` gives."""

MIN_FACES = 3_000
"""With fewer faces the grid is too coarse for the ears, and holes open beside them."""

# Faces times the square of the grid spacing, measured at 20,000 to 2,000,000 faces (36.4 to 37.4);
# it follows from the area of the bear. A coarser grid misses a little: 34.6 at 3,000.
_FACES_PER_SPACING = 36.8

_ROUNDS = 2
"""Seams are placed again once vertices are spread: the first guess is off by a quad at places."""

_RELAX_STEPS = 6
"""Smoothing steps a round after which slivers are gone; more change little."""


@dataclass(frozen=True)
class _Ellipsoids:
    """The solids as arrays: p is inside solid s where |frames[s] @ (p - centers[s])| < 1."""

    centers: FloatArray  # (S, 3)
    frames: FloatArray  # (S, 3, 3), rows are the own axes divided by their radii
    reach: FloatArray  # (S, 3), half of each solid's bounding box

    def levels(self, solid: int, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Value, (N,), and gradient, (N, 3), of a function that is 0 on the solid's surface."""
        local = (points - self.centers[solid]) @ self.frames[solid].T
        radius = np.sqrt(np.einsum("ij,ij->i", local, local))
        np.maximum(radius, 1e-9, out=radius)  # at the very center there is no gradient
        return radius - 1.0, (local @ self.frames[solid]) / radius[:, None]

    def nearest(self, points: FloatArray) -> npt.NDArray[np.int32]:
        """Index of the solid with the least signed distance to each point, to first order."""
        blocks = [self._nearest_in_block(block) for block in _blocks(points)]
        return np.concatenate(blocks)

    def _nearest_in_block(self, points: FloatArray) -> npt.NDArray[np.int32]:
        least = np.full(len(points), np.inf)
        nearest = np.zeros(len(points), dtype=np.int32)
        for solid in range(len(self.centers)):
            values, gradients = self.levels(solid, points)
            distances = values / np.sqrt(np.einsum("ij,ij->i", gradients, gradients))
            closer = distances < least
            least[closer] = distances[closer]
            nearest[closer] = solid
        return nearest


@dataclass(frozen=True)
class _Lattice:
    """Which points of a regular grid are inside; the outermost two layers are outside."""

    inside: npt.NDArray[np.bool_]  # (Z, Y, X), contiguous
    origin: FloatArray  # (3,), x, y, z of the first point
    spacing: float

    @property
    def strides(self) -> tuple[int, int, int]:
        """Steps in the flat array along x, y and z."""
        _, n_y, n_x = self.inside.shape
        return 1, n_x, n_x * n_y

    def positions(self, flat: IndexArray) -> FloatArray:
        """Positions, (N, 3), of grid points given by their flat index."""
        z, y, x = np.unravel_index(flat, self.inside.shape)
        return self.origin + self.spacing * np.stack([x, y, z], axis=1)


@dataclass(frozen=True)
class _QuadSurface:
    """A closed surface of quads, each of which belongs to one solid."""

    points: FloatArray  # (V, 3)
    quads: IndexArray  # (Q, 4), counterclockwise seen from outside
    owners: IndexArray  # (Q,), the solid


def sample_mesh(n_faces: int = 60_000) -> Mesh:
    """Return a plush bear of about `n_faces` faces: smooth parts that meet in concave creases.

    The surface is closed, manifold, of one piece and genus 0, and oriented outward. It bounds the
    union of ellipsoids, and vertices lie on it: along a crease, on both ellipsoids at once. The
    bear is 2.3 high, looks along +z, and y is up. The same request gives the same mesh. From
    12,000 faces on, less than one face in 2,000 has an angle under 5 degrees, and next to none is
    folded; with fewer, eyes and nose are too small for the grid. Every face has an area.

    A grid is filled with the ellipsoids, its border becomes a surface net (Gibson, "Constrained
    elastic surface nets", 1998), and Newton's method takes the net's vertices to the ellipsoids
    while smoothing spreads them. Time is linear in `n_faces` but for the filling, which is linear
    in the points of the grid, about n_faces**1.5 / 20.

    Parameters
    ----------
    n_faces : int, default 60_000
        At least 3,000. The mesh has this many faces within 10 percent.

    Raises
    ------
    ValueError
        If `n_faces` is less than 3,000.
    TypeError
        If it is not an integer.

    Examples
    --------
    >>> bear = sample_mesh(5_000)
    >>> bear.n_vertices - bear.n_faces // 2  # V - E + F of a closed surface of genus 0
    2
    """
    count = checked_count(n_faces, "n_faces")
    if count < MIN_FACES:
        raise ValueError(f"n_faces must be at least {MIN_FACES}, got {count}")
    lattice = _without_pinches(_fill_lattice(math.sqrt(_FACES_PER_SPACING / count)))
    surface = _surface_net(lattice)
    for _ in range(_ROUNDS):
        surface = _relax(_place_seams(surface), lattice.spacing)
    return Mesh(surface.points, _split_quads(surface))


def sample_parts(mesh: Mesh) -> npt.NDArray[np.int32]:
    """Return the part of the bear that each face belongs to: a ground truth for `sample_mesh`.

    Parameters
    ----------
    mesh : Mesh
        What `sample_mesh` returned, neither moved nor scaled.

    Returns
    -------
    ndarray of int32, shape (F,)
        Index into `PART_NAMES` of the solid nearest to the face's centroid.

    Examples
    --------
    >>> parts = sample_parts(sample_mesh(5_000))
    >>> len(PART_NAMES), int(parts.max())
    (17, 16)
    """
    return _ellipsoids().nearest(mesh.vertices[mesh.faces].mean(axis=1))


@cache
def _ellipsoids() -> _Ellipsoids:
    """Convert the table of solids."""
    rotations = np.array([_rotation(*np.radians(solid.turn)) for solid in _SOLIDS])
    radii = np.array([solid.radii for solid in _SOLIDS])
    return _Ellipsoids(
        centers=np.array([solid.center for solid in _SOLIDS]),
        frames=(rotations / radii[:, None, :]).transpose(0, 2, 1),
        reach=np.sqrt(((rotations * radii[:, None, :]) ** 2).sum(axis=2)),
    )


def _blocks(rows: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    """Cut into views of 16,384 rows, whose intermediate results stay in the cache."""
    return [rows[start : start + 16_384] for start in range(0, len(rows), 16_384)]


def _rotation(about_x: float, about_y: float, about_z: float) -> FloatArray:
    """Rotation matrix of turns about x, then y, then z, in radians."""
    matrix = np.eye(3)
    for axis, angle in enumerate((about_x, about_y, about_z)):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[second, second] = turn[third, third] = math.cos(angle)
        turn[second, third] = -math.sin(angle)
        turn[third, second] = math.sin(angle)
        matrix = turn @ matrix
    return matrix


def _fill_lattice(spacing: float) -> _Lattice:
    """Mark the grid points inside any solid."""
    solids = _ellipsoids()
    origin = (solids.centers - solids.reach).min(axis=0) - 2 * spacing
    extent = (solids.centers + solids.reach).max(axis=0) - origin
    n_x, n_y, n_z = np.ceil(extent / spacing).astype(int) + 3
    # Difference along x of the number of solids around a point; the sum along x gives the number.
    steps = np.zeros((n_z, n_y, n_x), dtype=np.int8)
    for solid in range(len(solids.centers)):
        z, y, first, last = _rows_inside(solid, origin, spacing)
        steps[z, y, first] += 1
        steps[z, y, last] -= 1
    depth = np.cumsum(steps, axis=2, dtype=np.int8, out=steps)
    return _Lattice(depth > 0, origin, spacing)


def _rows_inside(
    solid: int, origin: FloatArray, spacing: float
) -> tuple[IndexArray, IndexArray, IndexArray, IndexArray]:
    """Rows of the grid that run through a solid, and the points in it: z, y, first x, last x + 1.

    Along a row a x^2 + 2 b x + c <= 0 inside, x counted from the solid's center.
    """
    solids = _ellipsoids()
    center, frame, reach = solids.centers[solid], solids.frames[solid], solids.reach[solid]
    low = np.floor((center - reach - origin) / spacing).astype(np.int64)
    high = np.ceil((center + reach - origin) / spacing).astype(np.int64)
    rows_y, rows_z = (np.arange(low[axis], high[axis] + 1) for axis in (1, 2))
    across_y = np.outer(origin[1] + spacing * rows_y - center[1], frame[:, 1])
    across_z = np.outer(origin[2] + spacing * rows_z - center[2], frame[:, 2])
    across = across_z[:, None, :] + across_y[None, :, :]
    a = frame[:, 0] @ frame[:, 0]
    b = across @ frame[:, 0]
    discriminant = b**2 - a * ((across**2).sum(axis=2) - 1.0)
    z, y = np.nonzero(discriminant > 0)
    root = np.sqrt(discriminant[z, y])
    start = center[0] - origin[0]
    first = np.ceil((start - (b[z, y] + root) / a) / spacing).astype(np.int64)
    last = np.floor((start - (b[z, y] - root) / a) / spacing).astype(np.int64) + 1
    kept = first < last
    return rows_z[z[kept]], rows_y[y[kept]], first[kept], last[kept]


def _crossed_edges(lattice: _Lattice) -> list[IndexArray]:
    """Edges of the grid that cross the surface, for x, y and z: the flat index of the lower end."""
    flat = lattice.inside.ravel()
    return [np.flatnonzero(flat[step:] != flat[:-step]) for step in lattice.strides]


def _cells_around(lattice: _Lattice, axis: int, edges: IndexArray) -> IndexArray:
    """Cells around each edge, (E, 4), counterclockwise seen from its upper end.

    A cell is named by its lowest corner.
    """
    second = lattice.strides[(axis + 1) % 3]
    third = lattice.strides[(axis + 2) % 3]
    return np.stack([edges - second - third, edges - third, edges, edges - second], axis=1)


def _without_pinches(lattice: _Lattice) -> _Lattice:
    """Lattice with points added until the surface between inside and outside is manifold.

    It is if no cell's face has its two inside corners on one diagonal, and no cell has two
    opposite corners on one side and the other six on the other: the inside is then well-composed
    (Latecki, Eckhardt and Rosenfeld 1995). Points are only added, so this ends.
    """
    repaired = replace(lattice, inside=lattice.inside.copy())
    inside = repaired.inside.reshape(-1)  # a view
    corners = np.array([0, 1])
    for step in lattice.strides[1:]:
        corners = np.concatenate([corners, corners + step])
    while True:
        edges = _crossed_edges(repaired)
        around = [_cells_around(lattice, axis, edges[axis]).ravel() for axis in range(3)]
        cells = np.unique(np.concatenate(around))
        codes = np.packbits(inside[cells[:, None] + corners], axis=1, bitorder="little")[:, 0]
        wanted = _well_composed_codes()[codes]
        pinched = np.flatnonzero(wanted != codes)
        if len(pinched) == 0:
            return repaired
        added = np.unpackbits(wanted[pinched, None], axis=1, bitorder="little").astype(bool)
        inside[(cells[pinched, None] + corners)[added]] = True


@cache
def _well_composed_codes() -> npt.NDArray[np.uint8]:
    """For the corners inside a cell, as 8 bits: those bits, and the corners that must be added.

    Bit 4 z + 2 y + x stands for corner (x, y, z).
    """
    codes = np.arange(256)
    wanted = codes.copy()
    for axis, side in itertools.product(range(3), (0, 1)):
        corners = [corner for corner in range(8) if (corner >> axis & 1) == side]
        first, second, third, fourth = (1 << corner for corner in corners)
        face = first | second | third | fourth
        for diagonal in (first | fourth, second | third):
            wanted[codes & face == diagonal] |= face
    for corner in range(4):
        opposite = 1 << corner | 1 << (7 - corner)
        wanted[[opposite, 255 - opposite]] = 255
    return wanted.astype(np.uint8)


def _surface_net(lattice: _Lattice) -> _QuadSurface:
    """Surface with a vertex in each cell that it crosses and a quad across each crossed edge."""
    inside = lattice.inside.ravel()
    quads, middles = [], []
    for axis, edges in enumerate(_crossed_edges(lattice)):
        around = _cells_around(lattice, axis, edges)
        leaves_upward = inside[edges]
        quads.append(np.where(leaves_upward[:, None], around, around[:, ::-1]))
        middles.append(lattice.positions(edges))
        middles[-1][:, axis] += lattice.spacing / 2
    cells, corners = np.unique(np.concatenate(quads), return_inverse=True)
    corners = corners.reshape(-1, 4)
    n_quads_at = np.bincount(corners.ravel(), minlength=len(cells))
    sums = _sum_at(corners.ravel(), np.repeat(np.concatenate(middles), 4, axis=0), len(cells))
    points = sums / n_quads_at[:, None]
    nearest = _ellipsoids().nearest(points).astype(np.int64)
    points = _project(points, _groups(np.int64(1) << nearest), lattice.spacing, n_steps=2)
    return _QuadSurface(points, corners, np.zeros(len(corners), dtype=np.int64))


def _sum_at(targets: IndexArray, rows: FloatArray, n_targets: int) -> FloatArray:
    """Sum of the rows, (N, 3), that go to each target."""
    sums = [np.bincount(targets, weights=column, minlength=n_targets) for column in rows.T]
    return np.stack(sums, axis=1)


def _solids_of_vertices(surface: _QuadSurface) -> IndexArray:
    """Owners of the quads around each vertex, as bits, (V,): the solids it has to lie on."""
    solids = np.zeros(len(surface.points), dtype=np.int64)
    bits = np.int64(1) << surface.owners
    for corner in range(4):
        np.bitwise_or.at(solids, surface.quads[:, corner], bits)
    return solids


def _on_seam(solids_of_vertex: IndexArray) -> npt.NDArray[np.bool_]:
    """Whether more than one bit is set."""
    return np.asarray(solids_of_vertex & (solids_of_vertex - 1) != 0)


def _place_seams(surface: _QuadSurface) -> _QuadSurface:
    """Give each quad to the nearest solid, then smooth the seams between quads of two solids.

    Vertices on a seam will be put on the crease. A quad with all corners on seams would be
    squeezed flat there, and a spur two quads wide be folded over. So quads that are outvoted by
    the quads around them change hands, one at a time around a vertex. Only those outvoted at the
    start do, lest small parts be worn away turn by turn; flat ones always. A few turns suffice;
    the bound is for creases that the grid cannot resolve at all.
    """
    middles = surface.points[surface.quads].mean(axis=1)
    owners = _ellipsoids().nearest(middles).astype(np.int64)
    outvoted = None
    for _ in range(8):
        on_seam = _on_seam(_solids_of_vertices(replace(surface, owners=owners)))
        rivals, margins = _vote(surface.quads, owners, on_seam)
        outvoted = margins > 0 if outvoted is None else outvoted
        flat = on_seam[surface.quads].all(axis=1)
        loses = np.flatnonzero((margins > 0) & outvoted | (margins >= 0) & flat)
        if len(loses) == 0:
            break
        chosen = loses[_lowest_around(surface.quads[loses], len(surface.points))]
        owners[chosen] = rivals[chosen]
    return replace(surface, owners=owners)


def _vote(
    quads: IndexArray, owners: IndexArray, on_seam: npt.NDArray[np.bool_]
) -> tuple[IndexArray, IndexArray]:
    """Strongest other solid around each quad, (Q,), and its votes less those of the quad's own.

    Each quad votes at each of its corners, so neighbors across a side have two votes, but not for
    itself. Away from seams the margin is -1.
    """
    n_solids = len(_SOLIDS)
    ballots = (quads * n_solids + owners[:, None]).ravel()
    votes_at = np.bincount(ballots, minlength=len(on_seam) * n_solids).reshape(-1, n_solids)
    at_seam = np.flatnonzero(on_seam[quads].any(axis=1))
    votes = votes_at[quads[at_seam]].sum(axis=1)
    own = owners[at_seam, None]
    own_votes = np.take_along_axis(votes, own, axis=1)[:, 0] - 4
    np.put_along_axis(votes, own, -1, axis=1)
    rivals, margins = owners.copy(), np.full(len(quads), -1)
    rivals[at_seam], margins[at_seam] = votes.argmax(axis=1), votes.max(axis=1) - own_votes
    return rivals, margins


def _lowest_around(quads: IndexArray, n_vertices: int) -> npt.NDArray[np.bool_]:
    """Which of the quads are the first in the list at all of their corners."""
    first = np.full(n_vertices, len(quads))
    rank = np.arange(len(quads))
    np.minimum.at(first, quads.ravel(), np.repeat(rank, 4))
    return np.asarray((first[quads] == rank[:, None]).all(axis=1))


def _groups(solids_of_vertex: IndexArray) -> list[tuple[list[int], IndexArray]]:
    """Vertices by the solids they have to lie on."""
    masks, group = np.unique(solids_of_vertex, return_inverse=True)
    order = np.argsort(group, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(group))[:-1])
    solids = [[s for s in range(len(_SOLIDS)) if int(mask) >> s & 1] for mask in masks]
    return list(zip(solids, parts, strict=True))


def _project(
    points: FloatArray,
    groups: list[tuple[list[int], IndexArray]],
    spacing: float,
    n_steps: int,
) -> FloatArray:
    """Move points onto all of their solids at once, by Newton steps of least length."""
    projected = points.copy()
    for solids, members in groups:
        for block in _blocks(members):
            moved = points[block]
            for _ in range(n_steps):
                moved = moved - _newton_step(moved, solids, spacing)
            projected[block] = moved
    return projected


def _newton_step(points: FloatArray, solids: list[int], longest: float) -> FloatArray:
    """Shortest step away from where all linearized functions are 0, (N, 3), cut to a length."""
    levels = [_ellipsoids().levels(solid, points) for solid in solids]
    values = np.stack([value for value, _ in levels], axis=1)
    gradients = np.stack([gradient for _, gradient in levels], axis=1)
    gram = gradients @ gradients.transpose(0, 2, 1)
    if len(solids) == 1:
        factors = values / gram[:, :, 0]
    else:  # a trace of ridge, for more solids at a point than there are dimensions
        ridge = 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(len(solids))
        factors = np.linalg.solve(gram + ridge, values[:, :, None])[:, :, 0]
    step = np.einsum("ns,nsd->nd", factors, gradients)
    length = np.sqrt(np.einsum("nd,nd->n", step, step))
    return np.asarray(step * np.minimum(1.0, longest / np.maximum(length, 1e-30))[:, None])


def _relax(surface: _QuadSurface, spacing: float) -> _QuadSurface:
    """Spread the vertices evenly over the surface, those on creases along them.

    A vertex moves toward the mean of its neighbors that lie on all of its solids. On a closed,
    oriented surface the sides of the quads hold each pair of neighbors once either way.
    """
    solids_of_vertex = _solids_of_vertices(surface)
    targets = surface.quads.ravel()
    sources = np.roll(surface.quads, -1, axis=1).ravel()
    guides = (solids_of_vertex[targets] & ~solids_of_vertex[sources]) == 0
    targets, sources = targets[guides], sources[guides]
    n_vertices = len(surface.points)
    n_guides = np.bincount(targets, minlength=n_vertices)[:, None]
    groups = _groups(solids_of_vertex)
    points = _project(surface.points, groups, spacing, n_steps=3)
    for _ in range(_RELAX_STEPS):
        means = _sum_at(targets, points[sources], n_vertices) / np.maximum(n_guides, 1)
        # 0.7: full steps let vertices of a checkerboard swing.
        points = np.where(n_guides > 0, points + 0.7 * (means - points), points)
        points = _project(points, groups, spacing, n_steps=1)
    points = _project(points, groups, spacing, n_steps=3)
    return _QuadSurface(points, surface.quads, surface.owners)


def _split_quads(surface: _QuadSurface) -> npt.NDArray[np.int32]:
    """Triangles, (2 Q, 3): each quad cut along the diagonal that makes the rounder triangles.

    A diagonal between different solids, or one that cuts off a triangle with all corners on a
    crease, is the last choice: it would bridge the crease.
    """
    quads = surface.quads
    solids = _solids_of_vertices(surface)
    cuts = [quads[:, [[0, 1, 2], [0, 2, 3]]], quads[:, [[0, 1, 3], [1, 2, 3]]]]
    scores = []
    for cut, (start, end) in zip(cuts, ((0, 2), (1, 3)), strict=True):
        bridges = (solids[quads[:, start]] & solids[quads[:, end]]) == 0
        bridges |= np.any(np.all(_on_seam(solids)[cut], axis=2), axis=1)
        scores.append(_roundness(surface.points[cut]).min(axis=1) - bridges)
    choose_first = scores[0] >= scores[1]
    triangles = np.where(choose_first[:, None, None], cuts[0], cuts[1])
    return triangles.reshape(-1, 3).astype(np.int32)


def _roundness(corners: FloatArray) -> FloatArray:
    """4 sqrt(3) area / sum of squared sides, of triangles (..., 3, 3): 1 equilateral, 0 flat."""
    sides = np.roll(corners, -1, axis=-2) - corners
    doubled_area = np.linalg.norm(np.cross(sides[..., 0, :], sides[..., 1, :]), axis=-1)
    return np.asarray(2 * math.sqrt(3) * doubled_area / (sides**2).sum(axis=(-2, -1)))
