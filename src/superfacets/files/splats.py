"""Compute colors and normal axes of Gaussian splats."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.types import Array, Bools, Floats
from .guards import as_rows

_COLORS = ("f_dc_0", "f_dc_1", "f_dc_2")
_COLOR = 0.5 / math.sqrt(math.pi)
"""Value of the spherical harmonic of degree 0. The color of a Gaussian splat is 0.5 plus this value
times the coefficients `_COLORS`."""

SCALES = ("scale_0", "scale_1", "scale_2")
ROTATIONS = ("rot_0", "rot_1", "rot_2", "rot_3")
_FLAT = math.log(2.0)
"""Minimum difference between the two smallest log scales of a Gaussian splat. If the difference is
smaller, the splat has no normal direction."""


def splat_colors(columns: Mapping[str, Array]) -> Floats | None:
    """Return the color of each splat, 0 to 1; None if the columns are missing or not finite."""
    if not {*_COLORS} <= columns.keys():
        return None
    shades = 0.5 + _COLOR * as_rows([columns[name] for name in _COLORS], np.float64)
    return np.clip(shades, 0.0, 1.0) if np.isfinite(shades).all() else None


def splat_axes(columns: Mapping[str, Array]) -> Floats | None:
    """Return the shortest axis of each Gaussian splat, or zero if no axis is clearly the shortest.

    The vector is also zero if rotation or scales are not valid. The result is None if the columns
    of rotations (w, x, y, z) or scales are missing. For splats with only two scales, the axis is
    the rotated z axis.
    """
    names = [name for name in SCALES if name in columns]
    if len(names) < 2 or not {*ROTATIONS} <= columns.keys():
        return None
    scales = np.stack([np.asarray(columns[name], np.float64) for name in names], axis=1)
    turns = np.stack([np.asarray(columns[name], np.float64) for name in ROTATIONS], axis=1)
    shortest = np.full(len(scales), 2)
    is_known: Bools = np.asarray(np.isfinite(turns).all(axis=1))
    if len(names) == 3:
        ordered = np.sort(scales, axis=1)
        shortest = scales.argmin(axis=1)
        is_known &= np.isfinite(scales).all(axis=1)
        is_known[is_known] = ordered[is_known, 1] - ordered[is_known, 0] >= _FLAT
    lengths = np.sqrt(np.einsum("ij,ij->i", turns, turns))
    is_known &= (lengths > 0) & np.isfinite(lengths)
    axes = np.zeros((len(scales), 3))
    axes[is_known] = _columns_of_rotations(turns[is_known], shortest[is_known])
    return axes


def _columns_of_rotations(rotations: Floats, columns: npt.NDArray[np.integer[Any]]) -> Floats:
    """Return column `columns[i]` of the rotation matrix of each quaternion i.

    Quaternions (w, x, y, z) may have any norm except 0.
    """
    w, axis = rotations[:, :1], rotations[:, 1:]
    unit = np.eye(3)[columns]
    crossed = np.cross(axis, unit)
    squared = np.einsum("ij,ij->i", rotations, rotations)[:, None]
    return np.asarray(unit + 2.0 * (w * crossed + np.cross(axis, crossed)) / squared)
