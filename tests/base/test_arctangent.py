"""The arctangent of the core: its error, extreme arguments, and equal bits on all processors."""

import math

import mpmath
import numpy as np
import pytest
from reference.arithmetic import arctangent

from superfacets import _core

VERSIONS = range(_core.best_instruction_set() + 1)
TINY = 5e-324
LARGEST = 2.0**1022  # largest argument in the specification

# Quotients at which the core switches formulas, and at which other implementations do.
BORDERS = (0.5, 1.0, 2.0, math.tan(math.pi / 8), math.tan(3 * math.pi / 8))


def angles(y, x, version=0):
    return _core.arctangents(np.asarray(y, dtype=float), np.asarray(x, dtype=float), version)


def errors_in_ulp(y, x):
    """Return the errors of the computed angles, in units of the last place of the true angles."""
    with mpmath.workprec(1300):  # enough bits for pi minus 2^-1000
        true = [mpmath.atan2(a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)]
        return [
            float(abs(mpmath.mpf(angle) - t) / np.spacing(float(t)))
            for angle, t in zip(angles(y, x).tolist(), true, strict=True)
        ]


N = 1500
RNG = np.random.default_rng(0)
EITHER = RNG.choice([-1.0, 1.0], N)
THETA = np.linspace(0, math.pi, N)
WIDTHS = RNG.uniform(0.5, 1, N)
NEAR_BORDERS = [border * (1 + k * 2.0**-52) for border in BORDERS for k in range(-9, 10)]
EXPONENTS = RNG.uniform(-1074, 1022, (2, N))
PAIRS = {  # y and x
    "unit circle": (np.abs(np.sin(THETA)), np.cos(THETA)),
    "at random": (RNG.random(N), RNG.uniform(-1, 1, N)),
    "around borders": (WIDTHS * np.resize(NEAR_BORDERS, N), WIDTHS * EITHER),
    "nearly flat": (np.exp2(-RNG.uniform(20, 1074, N)), EITHER),
    "nearly upright": (np.ones(N), np.exp2(-RNG.uniform(20, 1074, N)) * EITHER),
    "any exponents": (np.exp2(EXPONENTS[0]), np.exp2(EXPONENTS[1]) * EITHER),
    "denormal": (RNG.integers(0, 2**20, N) * TINY, RNG.integers(0, 2**20, N) * TINY * EITHER),
}


@pytest.mark.parametrize("kind", PAIRS)
def test_errors_are_below_1_6_ulp(kind):
    assert max(errors_in_ulp(*PAIRS[kind])) < 1.6


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("kind", PAIRS)
def test_all_instruction_sets_and_the_twin_give_the_same_bits(kind, version):
    y, x = PAIRS[kind]
    with np.errstate(under="ignore"):
        assert angles(y, x, version).tobytes() == arctangent(y, x).tobytes()


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("n", [0, 1, 2, 3, 5, 7, 9, 17])
def test_what_is_left_over_by_full_vectors_has_the_same_bits(n, version):
    y, x = PAIRS["at random"]
    alone = [angles(y[i : i + 1], x[i : i + 1])[0] for i in range(1, n + 1)]
    assert angles(y[1 : n + 1], x[1 : n + 1], version).tolist() == alone


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("y", "x", "expected"),
    [
        (0.0, 1.0, 0.0), (0.0, TINY, 0.0), (0.0, LARGEST, 0.0), (0.0, 0.0, 0.0), (0.0, -0.0, 0.0),
        (0.0, -1.0, math.pi), (0.0, -TINY, math.pi), (TINY, -1.0, math.pi), (1.0, 0.0, math.pi / 2),
        (1.0, -0.0, math.pi / 2), (TINY, 0.0, math.pi / 2), (LARGEST, TINY, math.pi / 2),
        (LARGEST, -TINY, math.pi / 2), (1.0, 1.0, math.pi / 4), (TINY, TINY, math.pi / 4),
        (LARGEST, LARGEST, math.pi / 4), (1.0, -1.0, 3 * math.pi / 4), (TINY, 1.0, TINY),
        (3 * TINY, 1.0, 3 * TINY), (2.0**-1000, 2.0**-500, 2.0**-500),
    ],
)  # fmt: skip
def test_ends_and_corners_are_exact(y, x, expected, version):
    assert angles([y], [x], version).tolist() == [expected]
    with np.errstate(under="ignore"):
        assert arctangent(np.array([y]), np.array([x])).tolist() == [expected]


def test_angles_near_pi_do_not_exceed_it():
    y = np.exp2(-np.linspace(40, 60, 2001))
    found = angles(y, -np.ones_like(y))
    assert found.max() == math.pi
    assert (np.diff(found) >= 0).all()
