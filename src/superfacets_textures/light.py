"""Convert colors between the color spaces sRGB, linear light and OKLab."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from superfacets.kit import Bytes, Floats

_LINEAR_TO_CONES = np.array([
    [0.4122214708, 0.5363325363, 0.0514459929],
    [0.2119034982, 0.6806995451, 0.1073969566],
    [0.0883024619, 0.2817188376, 0.6299787005],
])  # fmt: skip
_CONES_TO_OKLAB = np.array([
    [0.2104542553, 0.7936177850, -0.0040720468],
    [1.9779984951, -2.4285922050, 0.4505937099],
    [0.0259040371, 0.7827717662, -0.8086757660],
])  # fmt: skip


def linear_of_srgb(values: npt.ArrayLike) -> Floats:
    """Convert sRGB values, 0 to 1, to linear light, 0 to 1."""
    given = np.asarray(values, np.float64)
    return np.where(given <= 0.04045, given / 12.92, ((given + 0.055) / 1.055) ** 2.4)


def srgb_of_linear(light: npt.ArrayLike) -> Bytes:
    """Convert linear light to sRGB values, 0 to 255; light below 0 or above 1 is clipped."""
    given = np.clip(light, 0, 1)
    values = np.where(given <= 0.0031308, given * 12.92, 1.055 * given ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(values * 255), np.uint8)


def oklab_of_linear(light: Floats) -> Floats:
    """Convert linear light, (N, 3), to OKLab (Ottosson, 2020), where distances are perceptual."""
    return _times(_CONES_TO_OKLAB, np.cbrt(_times(_LINEAR_TO_CONES, light)))


def _times(matrix: Floats, rows: Floats) -> Floats:
    """Multiply a matrix by each row. A fixed order of additions makes results reproducible."""
    r, g, b = rows.T
    columns = [(line[0] * r + line[1] * g) + line[2] * b for line in matrix]
    return np.stack(columns, axis=1)


def linear_of_oklab(colors: Floats) -> Floats:
    """Convert OKLab colors, (N, 3), to linear light; results may be below 0 or above 1."""
    cones = (colors @ np.linalg.inv(_CONES_TO_OKLAB).T) ** 3
    return np.asarray(cones @ np.linalg.inv(_LINEAR_TO_CONES).T)
