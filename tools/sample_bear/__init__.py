"""The generator of the sample mesh: a plush bear, as a union of ellipsoids.

``python -m tools.sample_bear`` writes the files that `superfacets.sample_mesh` reads. A grid is
filled with the ellipsoids, its border becomes a surface net (Gibson, "Constrained elastic surface
nets", 1998), and Newton's method takes the net's vertices to the ellipsoids while smoothing spreads
them. Nobody who uses the package needs this, so it is not in it.

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
"""With fewer faces the grid is too coarse for the ears, and holes open beside them."""

# Faces times the square of the grid spacing, measured at 20,000 to 2,000,000 faces (36.4 to 37.4);
# it follows from the area of the bear. A coarser grid misses a little: 34.6 at 3,000.
_FACES_PER_SPACING = 36.8

_ROUNDS = 2
"""Seams are placed again once vertices are spread: the first guess is off by a quad at places."""


def make_bear(n_faces: int) -> tuple[FloatArray, npt.NDArray[np.int32]]:
    """Return vertices and faces of a bear of about so many faces, within 10 percent.

    The surface is closed, manifold, of one piece and genus 0, and oriented outward. It bounds the
    union of the ellipsoids, and vertices lie on it: along a crease, on both ellipsoids at once.
    From 12,000 faces on, less than one face in 2,000 has an angle under 5 degrees, and next to none
    is folded; with fewer, eyes and nose are too small for the grid. Every face has an area.

    Time is linear in `n_faces` but for the filling, which is linear in the points of the grid,
    about n_faces**1.5 / 20. The last bits of the vertices differ from machine to machine.

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

    It is the solid nearest to the face's centroid. The bear may be neither moved nor scaled.
    """
    return ellipsoids().nearest(vertices[faces].mean(axis=1))
