"""Additional costs of arcs between parts of a shape, compared with NumPy code."""

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core

GRAPH = sf.build_face_graph(shapes.bumpy_sheet(8))
ARCS = (GRAPH.offsets, GRAPH.neighbors)


@pytest.mark.parametrize("n_vectors", [0, 1, 8])
@pytest.mark.parametrize("n_groups", [7, None])
def test_lengths_grow_with_distances_between_groups_and_stay_whole(n_vectors, n_groups):
    rng = np.random.default_rng(0)
    lengths = rng.integers(1, 2_000, GRAPH.n_arcs).astype(np.float32)
    n = n_groups or GRAPH.n_cells
    group_of = (rng.permutation(GRAPH.n_cells) % n) if n_groups else np.arange(n)
    vectors = rng.normal(size=(n, n_vectors)).astype(np.float32)
    given = group_of.astype(np.int32) if n_groups else np.empty(0, np.int32)
    one, other = group_of[GRAPH.sources], group_of[GRAPH.neighbors]
    distances = np.linalg.norm(vectors[one].astype(float) - vectors[other], axis=1)
    true = np.rint(lengths + 700.5 * distances).astype(np.float32)
    for n_threads in (1, 3):
        ours = _core.add_part_costs(*ARCS, lengths, given, vectors, 700.5, n_threads)
        assert np.array_equal(ours, true)


def test_within_a_group_steps_cost_nothing():
    lengths = np.full(GRAPH.n_arcs, 5.0, np.float32)
    one_group = np.zeros(GRAPH.n_cells, np.int32)
    ours = _core.add_part_costs(*ARCS, lengths, one_group, np.ones((1, 3), np.float32), 9.0, 1)
    assert np.array_equal(ours, lengths)
