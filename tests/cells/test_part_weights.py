"""What arcs cost more between the parts of a shape: against a few lines of numpy."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core

GRAPH = sf.build_face_graph(shapes.bumpy_sheet(8))
ARCS = (GRAPH.offsets, GRAPH.neighbors)
SOURCES = np.repeat(np.arange(GRAPH.n_cells), np.diff(GRAPH.offsets))
ALONE = np.empty(0, np.int32)


@pytest.mark.parametrize("n_vectors", [0, 1, 8])
@pytest.mark.parametrize("n_groups", [7, None])
def test_weights_grow_with_distances_and_with_the_factors_of_both_cells(n_vectors, n_groups):
    rng = np.random.default_rng(0)
    weights = rng.uniform(0.1, 2, GRAPH.n_arcs)
    n = n_groups or GRAPH.n_cells
    group_of = np.arange(GRAPH.n_cells) % n
    vectors = rng.normal(size=(n, n_vectors)).astype(np.float32)
    exponents = rng.normal(size=n)
    given = ALONE if n_groups is None else group_of.astype(np.int32)
    ours = _core.part_weights(*ARCS, weights, given, vectors, exponents, 0.7, 2)
    one, other = group_of[SOURCES], group_of[GRAPH.neighbors]
    distances = np.linalg.norm(vectors[one].astype(float) - vectors[other], axis=1)
    true = (weights + 0.7 * distances) * np.exp(exponents[one] + exponents[other])
    assert np.allclose(ours, true, rtol=1e-12)


def test_within_a_group_only_its_factor_counts():
    weights = np.ones(GRAPH.n_arcs)
    one_group = np.zeros(GRAPH.n_cells, np.int32)
    vectors, exponents = np.ones((1, 3), np.float32), np.log([3.0])
    ours = _core.part_weights(*ARCS, weights, one_group, vectors, exponents, 5.0, 1)
    assert np.allclose(ours, 9.0, rtol=1e-12)
