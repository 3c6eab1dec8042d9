"""The exponential function of the core for numbers <= 0: its error, limits, and the reference."""

import math

import mpmath
import numpy as np
import pytest
from reference.arithmetic import exponential

from superfacets import _core

RNG = np.random.default_rng(0)
N = 3000
SAMPLES = {
    "of order 1": -3 * RNG.random(N),
    "over the range": -708 * RNG.random(N),
    "small": -np.exp2(RNG.uniform(-1074, 0, N)),
    # Near the arguments at which the power of two changes.
    "between": -math.log(2)
    * (RNG.integers(0, 1000, N) + 0.5)
    * (1 + RNG.uniform(-1e-15, 1e-15, N)),
}


@pytest.mark.parametrize("kind", SAMPLES)
def test_errors_are_below_1_ulp(kind):
    x = SAMPLES[kind]
    with mpmath.workprec(120):
        true = [mpmath.exp(value) for value in x.tolist()]
        errors = [
            float(abs(mpmath.mpf(power) - t) / np.spacing(float(t)))
            for power, t in zip(_core.exponentials(x).tolist(), true, strict=True)
        ]
    assert max(errors) < 1.0


@pytest.mark.parametrize("kind", SAMPLES)
def test_the_twin_gives_the_same_bits(kind):
    with np.errstate(under="ignore"):
        expected = exponential(SAMPLES[kind])
    assert _core.exponentials(SAMPLES[kind]).tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (0.0, 1.0), (-0.0, 1.0), (-5e-324, 1.0), (-(2.0**-54), 1.0),
        (-708.0, 3.307553003638408e-308), (-708.0000000000001, 0.0), (-1e300, 0.0),
        (-math.inf, 0.0),
    ],
)  # fmt: skip
def test_ends_are_exact(x, expected):
    assert _core.exponentials(np.array([x])).tolist() == [expected]
    assert exponential(np.array([x])).tolist() == [expected]


def test_what_is_not_a_number_counts_as_nothing():
    assert _core.exponentials(np.array([math.nan])).tolist() == [0.0]
