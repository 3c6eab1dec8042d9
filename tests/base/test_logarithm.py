"""The logarithm of the core: its error, and extreme arguments."""

import math

import mpmath
import numpy as np
import pytest

from superfacets import _core

RNG = np.random.default_rng(0)
N = 2000
SAMPLES = {
    "of order 1": RNG.uniform(0.1, 10, N),
    "over the range": np.exp2(RNG.uniform(-1022, 1023, N)),
    "near 1": 1 + RNG.uniform(-1e-3, 1e-3, N),
    "between": np.exp2(RNG.integers(-9, 9, N) - 0.5) * (1 + RNG.uniform(-1e-15, 1e-15, N)),
}


@pytest.mark.parametrize("kind", SAMPLES)
def test_errors_are_below_2_ulp(kind):
    x = SAMPLES[kind]
    ours = _core.logarithms(x)
    with mpmath.workprec(120):
        true = [mpmath.log(mpmath.mpf(value)) for value in x.tolist()]
        errors = [
            abs(value - exact) / max(math.ulp(float(exact)), 2.0**-53)
            for value, exact in zip(ours.tolist(), true, strict=True)
        ]
    assert max(errors) < 2


def test_powers_of_two_are_multiples_of_one_number():
    powers = np.exp2(np.arange(-1000.0, 1001.0))
    assert np.allclose(_core.logarithms(powers), np.arange(-1000, 1001) * math.log(2), rtol=1e-15)
    assert _core.logarithms(np.ones(1))[0] == 0.0
