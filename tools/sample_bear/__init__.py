"""The generator of the sample mesh: a plush bear, as a union of ellipsoids.

``python -m tools.sample_bear`` writes the files that `superfacets.sample_mesh` reads. The generator
marks the points of a grid that are inside the ellipsoids, and makes a surface net from the border
of these points (Gibson, "Constrained elastic surface nets", 1998). Newton's method moves the
vertices of the net onto the ellipsoids, while smoothing spreads them. Users of the package do not
need this generator, so the package does not contain it.

bear      the ellipsoids
lattice   which points of a grid are inside
net       the surface of the grid, and how its vertices are moved
quads     surfaces of quads, and their triangles
seams     which quad belongs to which solid
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
"""Smallest number of faces. With fewer, the grid is too coarse for the ears, and holes open beside
them."""

# Number of faces times the square of the grid spacing, measured at 20,000 to 2,000,000 faces (36.4
# to 37.4). It follows from the area of the bear. A coarser grid misses details: 34.6 at 3,000
# faces.
_FACES_PER_SPACING = 36.8

_ROUNDS = 2
"""Number of times that seams are placed and vertices are spread: the first seams are off by a quad
in places."""


def make_bear(n_faces: int) -> tuple[FloatArray, npt.NDArray[np.int32]]:
    """Return vertices and faces of a bear with about `n_faces` faces, within 10 percent.

    The surface is closed, manifold, connected, of genus 0, and oriented outward. It is the boundary
    of the union of the ellipsoids. Vertices are on the ellipsoids: along a crease, on both at once.
    From 12,000 faces on, less than one face in 2,000 has an angle under 5 degrees, and almost none
    is folded. With fewer faces, eyes and nose are too small for the grid. No face has area 0.

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
    """Return the part of the bear that each face belongs to, (F,): an index into `PART_NAMES`.

    This is the solid nearest to the centroid of the face. The bear must not be moved or scaled.
    """
    return ellipsoids().nearest(vertices[faces].mean(axis=1))
