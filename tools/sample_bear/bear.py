"""Define the bear, as a union of ellipsoids."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Solid:
    """An ellipsoid, rotated about x, then y, then z by the angles of `turn`, in degrees."""

    name: str
    center: tuple[float, float, float]
    radii: tuple[float, float, float]
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)


# The bear sits and faces +z; y is up. The bear is slightly asymmetric, so that distances on its
# left and right side differ. Surfaces of solids cross at angles of at least 45 degrees, because
# shallower creases give poor meshes.
SOLIDS = (
    Solid("body", (0.0, 0.0, 0.0), (0.60, 0.70, 0.52), (-6, 0, 0)),
    Solid("head", (0.04, 0.98, 0.10), (0.55, 0.47, 0.46), (4, 8, -5)),
    Solid("muzzle", (0.10, 0.80, 0.50), (0.28, 0.20, 0.24), (6, 10, -5)),
    Solid("nose", (0.125, 0.885, 0.715), (0.125, 0.095, 0.10), (0, 10, -5)),
    Solid("right ear", (-0.38, 1.36, 0.05), (0.21, 0.22, 0.11), (-8, 4, 32)),
    Solid("left ear", (0.50, 1.31, 0.00), (0.22, 0.21, 0.11), (-6, 16, -38)),
    Solid("right eye", (-0.15, 1.165, 0.485), (0.092, 0.096, 0.09)),
    Solid("left eye", (0.32, 1.135, 0.445), (0.092, 0.096, 0.09)),
    Solid("right arm", (-0.62, 0.22, 0.20), (0.40, 0.18, 0.19), (0, 24, 34)),
    Solid("left arm", (0.66, 0.42, 0.16), (0.40, 0.18, 0.19), (0, -18, 26)),
    Solid("right paw", (-0.90, 0.02, 0.32), (0.20, 0.19, 0.19)),
    Solid("left paw", (0.97, 0.60, 0.24), (0.20, 0.19, 0.19)),
    Solid("right leg", (-0.42, -0.50, 0.52), (0.24, 0.23, 0.50), (6, -24, 0)),
    Solid("left leg", (0.46, -0.50, 0.50), (0.24, 0.23, 0.50), (6, 32, 0)),
    Solid("right foot", (-0.63, -0.44, 0.99), (0.25, 0.31, 0.13), (-8, -24, 4)),
    Solid("left foot", (0.75, -0.44, 0.94), (0.25, 0.31, 0.13), (-8, 32, -4)),
    Solid("tail", (0.03, -0.40, -0.53), (0.17, 0.17, 0.17)),
)

PART_NAMES = tuple(solid.name for solid in SOLIDS)
"""Name of each solid; `parts_of` returns indices into this tuple."""


@dataclass(frozen=True)
class _Ellipsoids:
    """The solids as arrays: p is inside solid s where |frames[s] @ (p - centers[s])| < 1."""

    centers: FloatArray  # center of each of the S solids, shape (S, 3)
    frames: FloatArray  # rows are the axes of a solid divided by its radii, shape (S, 3, 3)
    reach: FloatArray  # half of the side lengths of each solid's bounding box, shape (S, 3)

    def levels(self, solid: int, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values, (N,), and gradients, (N, 3), of a function at `points`.

        The function is 0 on the surface of the solid, negative inside, and positive outside.
        """
        local = (points - self.centers[solid]) @ self.frames[solid].T
        radius = np.sqrt(np.einsum("ij,ij->i", local, local))
        np.maximum(radius, 1e-9, out=radius)  # the gradient is undefined at the center
        return radius - 1.0, (local @ self.frames[solid]) / radius[:, None]

    def nearest(self, points: FloatArray) -> npt.NDArray[np.int32]:
        """Return the solid with the smallest signed distance to each point, as an index, (N,).

        Distances are approximated to first order.
        """
        blocks = [self._nearest_in_block(block) for block in cut_into_blocks(points)]
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


@cache
def ellipsoids() -> _Ellipsoids:
    """Return `SOLIDS` as arrays."""
    rotations = np.array([_rotation(*np.radians(solid.turn)) for solid in SOLIDS])
    radii = np.array([solid.radii for solid in SOLIDS])
    return _Ellipsoids(
        centers=np.array([solid.center for solid in SOLIDS]),
        frames=(rotations / radii[:, None, :]).transpose(0, 2, 1),
        reach=np.sqrt(((rotations * radii[:, None, :]) ** 2).sum(axis=2)),
    )


def cut_into_blocks(rows: npt.NDArray[Any]) -> list[npt.NDArray[Any]]:
    """Cut an array into views of 16,384 rows; intermediate results then fit into the cache."""
    return [rows[start : start + 16_384] for start in range(0, len(rows), 16_384)]


def _rotation(about_x: float, about_y: float, about_z: float) -> FloatArray:
    """Return the matrix of a rotation about x, then y, then z, by angles in radians."""
    matrix = np.eye(3)
    for axis, angle in enumerate((about_x, about_y, about_z)):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[second, second] = turn[third, third] = math.cos(angle)
        turn[second, third] = -math.sin(angle)
        turn[third, second] = math.sin(angle)
        matrix = turn @ matrix
    return matrix
