"""Define closed surfaces of quads, and cut the quads into triangles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .bear import FloatArray
from .lattice import IndexArray


@dataclass(frozen=True)
class QuadSurface:
    """A closed surface of quads, each of which belongs to one solid."""

    points: FloatArray  # position of each vertex, shape (V, 3)
    quads: IndexArray  # vertices of each quad, counterclockwise from outside, shape (Q, 4)
    owners: IndexArray  # solid of each quad, shape (Q,)


def solids_of_vertices(surface: QuadSurface) -> IndexArray:
    """Return the solids that each vertex must be on, (V,): the owners of the quads around it.

    Solids are stored as bits.
    """
    solids = np.zeros(len(surface.points), dtype=np.int64)
    bits = np.int64(1) << surface.owners
    for corner in range(4):
        np.bitwise_or.at(solids, surface.quads[:, corner], bits)
    return solids


def is_on_seam(solids_of_vertex: IndexArray) -> npt.NDArray[np.bool_]:
    """Return whether each vertex must be on several solids: whether several of its bits are set."""
    return np.asarray(solids_of_vertex & (solids_of_vertex - 1) != 0)


def split_quads(surface: QuadSurface) -> npt.NDArray[np.int32]:
    """Return triangles, (2 Q, 3): each quad is cut along the diagonal that gives rounder triangles.

    A diagonal bridges a crease if its two ends have no common solid, or if it cuts off a triangle
    with all corners on creases. Such a diagonal is chosen only if both diagonals of a quad bridge a
    crease.
    """
    quads = surface.quads
    solids = solids_of_vertices(surface)
    cuts = [quads[:, [[0, 1, 2], [0, 2, 3]]], quads[:, [[0, 1, 3], [1, 2, 3]]]]
    scores = []
    for cut, (start, end) in zip(cuts, ((0, 2), (1, 3)), strict=True):
        bridges = (solids[quads[:, start]] & solids[quads[:, end]]) == 0
        bridges |= np.any(np.all(is_on_seam(solids)[cut], axis=2), axis=1)
        scores.append(_roundness(surface.points[cut]).min(axis=1) - bridges)
    choose_first = scores[0] >= scores[1]
    triangles = np.where(choose_first[:, None, None], cuts[0], cuts[1])
    return triangles.reshape(-1, 3).astype(np.int32)


def _roundness(corners: FloatArray) -> FloatArray:
    """Return the roundness of triangles, (..., 3, 3), from 0 (flat) to 1 (equilateral).

    The roundness is 4 sqrt(3) area / (sum of squared side lengths).
    """
    sides = np.roll(corners, -1, axis=-2) - corners
    doubled_area = np.linalg.norm(np.cross(sides[..., 0, :], sides[..., 1, :]), axis=-1)
    return np.asarray(2 * math.sqrt(3) * doubled_area / (sides**2).sum(axis=(-2, -1)))
