"""Products of vectors, summed from left to right as the kernels do.

numpy's own may take another order.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._types import Floats


def dot(a: Floats, b: Floats) -> Any:
    """Scalar products of rows."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def norm(a: Floats) -> Any:
    """Lengths of rows."""
    return np.sqrt(dot(a, a))


def cross(a: Floats, b: Floats) -> Floats:
    """Cross products of rows."""
    return np.stack(
        [
            a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
            a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
            a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0],
        ],
        axis=-1,
    )
