"""Generate the sample mesh: a plush bear, as a union of ellipsoids.

``python -m tools.sample_bear`` writes the files that `superfacets.sample_mesh` reads. The generator
marks the points of a grid that are inside the ellipsoids, and makes a surface net from the border
of these points (Gibson, "Constrained elastic surface nets", 1998). Newton's method moves the
vertices of the net onto the ellipsoids, and smoothing spreads the vertices. Users of the package do
not need this generator.

bear      the ellipsoids
lattice   the grid, and its points inside the ellipsoids
net       the surface net, and movements of its vertices
quads     surfaces of quads, and their triangles
seams     the solid of each quad
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .bear import PART_NAMES, FloatArray, ellipsoids
from .lattice import fill_lattice, without_pinches
from .net import relax, surface_net
from .quads import split_quads
from .seams import place_seams

__all__ = ["MIN_FACES", "PART_NAMES", "make_bear", "parts_of"]

MIN_FACES = 3_000
"""Smallest number of faces. With fewer faces, the grid is too coarse for the ears, and holes open
beside the ears."""

# Number of faces times the square of the grid spacing: 36.4 to 37.4 with 20,000 to 2,000,000 faces,
# and 34.6 with 3,000 faces. The number follows from the area of the bear.
_FACES_PER_SPACING = 36.8

_ROUNDS = 2
"""Number of rounds of placing seams and spreading vertices. The seams of the first round may be one
quad away from the crease."""


def make_bear(n_faces: int) -> tuple[FloatArray, npt.NDArray[np.int32]]:
    """Return vertices and faces of a bear with about `n_faces` faces, within 10 percent.

    The surface is closed, manifold, connected, of genus 0, and oriented outward. It is the boundary
    of the union of the ellipsoids. All vertices are on ellipsoids, and vertices along a crease are
    on both ellipsoids that meet there.
    With at least 12,000 faces, less than one face in 2,000 has an angle under 5 degrees, and almost
    no face is folded. With fewer faces, eyes and nose are too small for the grid. No face has area
    0.

    Time is linear in `n_faces`, except for marking the grid points, whose number is about
    n_faces**1.5 / 20. The last bits of the vertices differ between machines.

    Raises
    ------
    ValueError
        If `n_faces` is less than `MIN_FACES`.
    """
    if n_faces < MIN_FACES:
        raise ValueError(f"n_faces must be at least {MIN_FACES}, got {n_faces}")
    lattice = without_pinches(fill_lattice(math.sqrt(_FACES_PER_SPACING / n_faces)))
    surface = surface_net(lattice)
    for _ in range(_ROUNDS):
        surface = relax(place_seams(surface), lattice.spacing)
    return surface.points, split_quads(surface)


def parts_of(vertices: FloatArray, faces: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the part of each face, (F,), as an index into `PART_NAMES`.

    The part is the solid nearest to the centroid of the face. The bear must not be moved or scaled.
    """
    return ellipsoids().nearest(vertices[faces].mean(axis=1))
