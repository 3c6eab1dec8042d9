"""The short loop for many small regions: its conditions and results."""

import numpy as np
import pytest

from superfacets import enforce_connectivity, sample_mesh, segment
from superfacets.metrics import compactness

K = 200


@pytest.fixture(autouse=True)
def few_are_many(limit):
    limit("many regions", K)


@pytest.fixture(scope="module")
def bear():
    return sample_mesh(5_000)


def test_many_small_regions_have_seeds_along_the_curve_and_few_iterations(bear):
    result = segment(bear, K)
    assert result.params["init"] == "curve"
    assert (result.n_segments, result.n_unreached) == (K, 0)
    assert 4 <= result.n_iter <= 6
    assert [level.n_cells for level in result.levels] == [bear.n_faces]
    assert np.array_equal(segment(bear, K, init="curve").labels, result.labels)


@pytest.mark.parametrize(("k", "options"), [
    (K - 1, {}),  # not many
    (K, {"init": "geodesic"}),
    (K, {"weights": "creases"}),
    (K, {"tol": 0.0}),
    (K, {"max_num_iter": 1}),
])  # fmt: skip
def test_the_long_loop_runs_otherwise(bear, k, options, limit):
    expected = segment(bear, k, **{"init": "geodesic", **options})
    result = segment(bear, k, **options)
    assert result.params["init"] == "geodesic"
    assert np.array_equal(result.labels, expected.labels)
    limit("many regions", 10**9)
    assert np.array_equal(segment(bear, k, **options).labels, expected.labels)


def test_regions_of_enough_faces_for_coarse_cells_are_not_small():
    assert segment(sample_mesh(60_000), K).params["init"] == "geodesic"


@pytest.mark.parametrize("n_threads", [1, 3])
def test_labels_are_the_same_for_any_number_of_threads(bear, n_threads):
    expected = segment(bear, K, n_threads=2)
    assert np.array_equal(segment(bear, K, n_threads=n_threads).labels, expected.labels)


def test_regions_are_as_round_and_connected_as_those_of_the_long_loop(bear):
    short, long = segment(bear, K), segment(bear, K, init="geodesic")
    assert compactness(bear, short.labels) < 1.02 * compactness(bear, long.labels)
    assert enforce_connectivity(bear, short.labels).n_joined == 0
