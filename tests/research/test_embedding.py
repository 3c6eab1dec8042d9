"""The spectral embedding distinguishes the parts of a shape."""

import numpy as np
import pytest
import shapes
from research.embedding import spectral_embedding

import superfacets as sf
from superfacets import Mesh

BEAR = sf.sample_mesh(5_000)


def distances(embedding, one, other):
    return np.linalg.norm(embedding[one] - embedding[other], axis=-1)


def test_the_embedding_separates_two_balls():
    mesh = shapes.dumbbell(61, 28)
    embedding = spectral_embedding(mesh)
    x = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    left, right = embedding[x < -0.3, 0], embedding[x > 0.3, 0]
    assert np.sign(left.mean()) != np.sign(right.mean())
    assert abs(left.mean() - right.mean()) > 6 * max(left.std(), right.std())


def test_the_embedding_depends_on_no_thread():
    one = spectral_embedding(BEAR, n_threads=1)
    assert np.array_equal(one, spectral_embedding(BEAR, n_threads=3))


def test_the_embedding_scales_and_moves_with_nothing():
    moved = Mesh(100 * BEAR.vertices + [1, 2, 3], BEAR.faces)
    one, other = spectral_embedding(BEAR), spectral_embedding(moved)
    i, j = np.random.default_rng(0).integers(0, BEAR.n_faces, (2, 500))
    before, after = distances(one, i, j), distances(other, i, j)
    assert np.corrcoef(before, after)[0, 1] > 0.99


def test_columns_that_do_not_exist_are_0():
    embedding = spectral_embedding(shapes.strip(4), 6)
    assert embedding.shape == (4, 6)
    assert np.abs(embedding[:, :3]).sum(axis=0).min() > 0
    assert not embedding[:, 3:].any()


@pytest.mark.parametrize("n", [0, 16])
def test_the_number_of_vectors_is_limited(n):
    with pytest.raises(ValueError, match="n_vectors"):
        spectral_embedding(BEAR, n)


def test_thousands_of_islands_have_no_parts():
    """The embedding is 0 everywhere."""
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    n = 13_000
    vertices = (triangle[None] + 3 * np.arange(n)[:, None, None]).reshape(-1, 3)
    mesh = Mesh(vertices, np.arange(3 * n).reshape(-1, 3))
    assert not spectral_embedding(mesh).any()


@pytest.mark.parametrize("make", [
    shapes.moebius, shapes.fins, shapes.slivers, lambda: shapes.block(3),
    lambda: np.random.default_rng(0).random((400, 3)),
])  # fmt: skip
def test_cells_of_all_kinds_have_an_embedding(make):
    embedding = spectral_embedding(make())
    assert len(embedding)
    assert np.isfinite(embedding).all()
