"""Arithmetic of the kernels, bit for bit: vectors, arctangent and exponential function."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._types import Floats


def dot(a: Floats, b: Floats) -> Any:
    """Scalar products of rows."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def norm(a: Floats) -> Any:
    """Lengths of rows."""
    return np.sqrt(dot(a, a))


# Coefficients of P in ascending order, where atan(q) = q + q z P(z) and z = q^2.
_ARCTANGENT_SERIES = (
    -0.33333333333333315, 0.19999999999993445, -0.14285714284977744, 0.11111111069363067,
    -0.09090907692059402, 0.07692277476441967, -0.06666223702917291, 0.05877809365040213,
    -0.052300303597027926, 0.04589534242481706, -0.037121323435362535, 0.023659351268061797,
    -0.008368794178450841,
)  # fmt: skip

_REST_OF_EIGHTH_TURN = float.fromhex("0x1.1a62633145c07p-55")  # pi / 4 minus its double

# The first 32 bits of ln 2, and the remainder.
_LN_2 = float.fromhex("0x1.62e42fefp-1")
_REST_OF_LN_2 = float.fromhex("0x1.473de6af278edp-34")


def arctangent(y: Floats, x: Floats) -> Floats:
    """Angles in [0, pi] from the positive x axis to (x, y), for y >= 0; 0 where both are 0.

    Unlike `numpy.arctan2`, the last bits do not depend on the C library. An angle is a multiple of
    pi / 4 plus the arctangent of a number |q| <= 1/2, which a polynomial computes.
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
    turn = n * (math.pi / 4)
    total = turn + q
    lost = (turn - total) + q  # rounding error of the sum
    angles: Floats = total + (q * (z * (even + z * odd)) + (lost + n * _REST_OF_EIGHTH_TURN))
    return angles


def exponential(x: Floats) -> Floats:
    """exp(x) for x <= 0, with the same bits on every platform; 0 if x < -708."""
    bounded = np.maximum(x, -708.0)
    n = np.rint(bounded * 1.4426950408889634)
    high, low = bounded - n * _LN_2, n * _REST_OF_LN_2
    r = high - low
    lost = (high - r) - low
    series = _horner([1 / math.factorial(i) for i in range(2, 14)], r)
    powers: Floats = np.ldexp(1.0 + (r + (r * r * series + lost)), n.astype(np.int64))
    return np.where(x >= -708.0, powers, 0.0)


def _horner(coefficients: Sequence[float], x: Floats) -> Floats:
    """Sum of coefficients[i] x^i, by Horner's method."""
    total = np.full_like(x, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        total = total * x + coefficient
    return total
