"""Compute scalar products, norms, arctangents and exponentials, bit-identical to the C++ core."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from superfacets.base.types import Floats


def dot(a: Floats, b: Floats) -> Any:
    """Return the scalar product of each row of `a` with the same row of `b`."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def norm(a: Floats) -> Any:
    """Return the Euclidean length of each row of `a`."""
    return np.sqrt(dot(a, a))


# Coefficients of the polynomial P in atan(q) = q + q z P(z), where z = q^2, lowest power first.
_ARCTANGENT_SERIES = (
    -0.33333333333333315, 0.19999999999993445, -0.14285714284977744, 0.11111111069363067,
    -0.09090907692059402, 0.07692277476441967, -0.06666223702917291, 0.05877809365040213,
    -0.052300303597027926, 0.04589534242481706, -0.037121323435362535, 0.023659351268061797,
    -0.008368794178450841,
)  # fmt: skip

_PI_4_ERROR = float.fromhex("0x1.1a62633145c07p-55")  # pi / 4 minus the float64 nearest to pi / 4

# The sum of these two numbers is ln 2. `_LN_2` has only 32 bits, so that its products with the
# integers in `exponential` are exact.
_LN_2 = float.fromhex("0x1.62e42fefp-1")
_LN_2_REMAINDER = float.fromhex("0x1.473de6af278edp-34")


def arctangent(y: Floats, x: Floats) -> Floats:
    """Return the angle, in [0, pi], from the positive x axis to each (x, y), where y >= 0.

    The angle is 0 if x and y are 0. Unlike in `numpy.arctan2`, the last bits do not depend on the C
    library. An angle is computed as the sum of a multiple of pi / 4 and the arctangent of a number
    q with |q| <= 1/2. A polynomial approximates this arctangent.
    """
    left, width = x < 0, np.abs(x)
    flat, steep = y + y <= width, y > width + width
    top = np.where(steep, 0.0, y) - np.where(flat, 0.0, width)
    bottom = np.where(steep, 0.0, width) + np.where(flat, 0.0, y)
    eighths = np.where(flat, 0.0, np.where(steep, 2.0, 1.0))
    ratio = top / np.where(bottom == 0, 1.0, bottom)
    q = np.where(left, -ratio, ratio)
    n = np.where(left, 4.0 - eighths, eighths)
    z = q * q
    even, odd = (_horner(_ARCTANGENT_SERIES[first::2], z * z) for first in (0, 1))
    multiple = n * (math.pi / 4)
    total = multiple + q
    error = (multiple - total) + q  # rounding error of `total`
    angles: Floats = total + (q * (z * (even + z * odd)) + (error + n * _PI_4_ERROR))
    return angles


def exponential(x: Floats) -> Floats:
    """Return exp(x) for x <= 0, bit-identical on all platforms, or 0 if x < -708."""
    bounded = np.maximum(x, -708.0)
    n = np.rint(bounded * 1.4426950408889634)
    high, low = bounded - n * _LN_2, n * _LN_2_REMAINDER
    r = high - low
    error = (high - r) - low  # rounding error of `r`
    series = _horner([1 / math.factorial(i) for i in range(2, 14)], r)
    powers: Floats = np.ldexp(1.0 + (r + (r * r * series + error)), n.astype(np.int64))
    return np.where(x >= -708.0, powers, 0.0)


def _horner(coefficients: Sequence[float], x: Floats) -> Floats:
    """Return the sum of ``coefficients[i] * x**i``, computed by Horner's method."""
    total = np.full_like(x, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = total * x + coefficient
    return total
