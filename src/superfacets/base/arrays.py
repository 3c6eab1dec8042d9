"""Convert arrays: rows and types, and rotations from quaternions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .. import _core
from .checks import checked_threads
from .types import Array, Floats


def contiguous_rows(rows: Array) -> Array:
    """Return an (N, n) array in contiguous memory, copied by C++ if it is not contiguous."""
    if rows.flags.c_contiguous or not rows.size:
        return rows
    copied = _core.copy_rows(rows.view(np.uint8), checked_threads(None))
    return copied.view(rows.dtype).reshape(rows.shape)


def as_doubles(values: Array) -> Floats:
    """Convert values to float64, without NumPy's warning about signaling NaNs."""
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64, copy=False)


def as_rows(columns: Sequence[Array], dtype: npt.DTypeLike) -> Array:
    """Stack columns into an (N, n) array, without NumPy's warning about signaling NaNs."""
    rows = np.empty((len(columns[0]), len(columns)), dtype)
    with np.errstate(invalid="ignore"):
        for place, column in enumerate(columns):
            rows[:, place] = column
    return rows


def narrowed(column: Array) -> Array:
    """Convert 64-bit integers to int32, uint32 or float64, the first that has their range."""
    if column.dtype.kind not in "iu" or column.itemsize < 8:
        return column
    low, high = int(column.min(initial=0)), int(column.max(initial=0))
    unsigned = np.uint32 if low >= 0 and high < 2**32 else np.float64
    return column.astype(np.int32 if low >= -(2**31) and high < 2**31 else unsigned)


def rotation_of(quaternion: Sequence[float] | Floats) -> Floats | None:
    """Return the rotation matrix, (3, 3), of a quaternion (w, x, y, z); None if 0 or not finite."""
    length = np.abs(quaternion).max()
    if not 0 < length < math.inf:
        return None
    w, x, y, z = np.asarray(quaternion) / length
    s = 2 / (x * x + y * y + z * z + w * w)
    return np.array([
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ])  # fmt: skip
