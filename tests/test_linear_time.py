"""Time grows linearly with size, even if much is equal or meets at one place."""

import pytest
from benchmarks.doubling import JOBS, SHAPES, doubling_table, exponent, measure_doubling

MOST = 8**1.6
"""Limit of the ratio of times for a ratio of sizes of eight: linear time gives 8, quadratic 64.
Most of the difference allows for noise."""

QUADRATIC_ONCE = [
    ("flat grid", "k = N", 8_000), ("star", "k = N/2", 8_000), ("star", "cut_borders", 1_000),
    ("coin", "defaults", 500), ("one place", "k = N/2", 4_000), ("one place", "farthest", 4_000),
    ("twins", "defaults", 1_000), ("book", "defaults", 1_000),
    *(("flat grid", job, 2_000) for job in JOBS if ", one " in job),
    ("coin", "smooth_borders", 2_000),
]  # fmt: skip


@pytest.mark.parametrize(("shape", "job", "size"), QUADRATIC_ONCE)
def test_time_does_not_grow_with_the_square_of_the_size(shape, job, size):
    (growth,) = measure_doubling([shape], [job], [size, 8 * size], 3)
    assert growth.seconds[1] < MOST * growth.seconds[0]


def test_all_jobs_run_on_all_shapes():
    found = list(measure_doubling(list(SHAPES), list(JOBS), [64, 128], 1))
    assert {growth.shape for growth in found} == set(SHAPES)
    assert {growth.job for growth in found} == set(JOBS)
    assert all(min(growth.seconds) > 0 for growth in found)
    lines = doubling_table(found).splitlines()
    assert len(lines) == 2 + len(JOBS)
    assert all(line.count("|") == len(SHAPES) + 2 for line in lines)


@pytest.mark.parametrize(
    ("seconds", "expected"), [((1, 2, 4), 1), ((3, 12, 48), 2), ((5, 5, 5), 0)]
)
def test_the_exponent_is_the_slope_in_logarithms(seconds, expected):
    assert exponent((100, 200, 400), seconds) == pytest.approx(expected, abs=1e-12)
