"""The included bear is complete, has the stated sizes, and is what the generator makes."""

import numpy as np
import pytest
import shapes
from tools.sample_bear import make_bear
from tools.sample_bear.__main__ import SIZES

from superfacets import build_face_graph, sample_mesh


@pytest.mark.parametrize(
    ("asked", "given"),
    [
        (3_000, 4_892), (9_700, 4_892), (9_900, 19_568), (20_000, 19_568), (34_000, 19_568),
        (35_000, 60_220), (60_000, 60_220), (250_000, 240_880), (1_000_000, 963_520),
    ],
)  # fmt: skip
def test_the_size_nearest_by_ratio_is_given(asked, given):
    assert sample_mesh(asked).n_faces == given
    assert 0.5 <= given / asked <= 2


@pytest.mark.parametrize("n_faces", [5_000, 20_000, 60_000, 250_000])
def test_the_bear_is_closed_of_one_piece_and_without_handles(n_faces):
    bear = sample_mesh(n_faces)
    graph = build_face_graph(bear, weld=False)
    assert graph.edge_counts == (3 * bear.n_faces // 2, 0, 0, 0)
    assert shapes.count_pieces(graph, np.zeros(bear.n_faces, dtype=np.int32)) == 1
    assert bear.n_vertices - bear.n_faces // 2 == 2
    assert np.array_equal(np.unique(bear.faces), np.arange(bear.n_vertices))
    assert np.linalg.det(bear.vertices[bear.faces]).sum() / 6 == pytest.approx(1.892, rel=0.05)


def test_the_files_hold_what_the_generator_makes():
    for n_faces in SIZES.values():
        bear = sample_mesh(n_faces)
        vertices, faces = make_bear(n_faces)
        same = (bear.faces == faces).all(axis=1)  # in others, a diagonal may differ
        assert same.mean() > 0.999
        np.testing.assert_allclose(bear.vertices, vertices, atol=2e-7)


def test_a_split_bear_has_the_surface_of_the_one_it_is_split_from():
    coarse, fine = sample_mesh(5_000), sample_mesh(20_000)
    areas = build_face_graph(fine).measures.reshape(-1, 4)
    expected = np.repeat(build_face_graph(coarse).measures[:, None] / 4, 4, axis=1)
    np.testing.assert_allclose(areas, expected, rtol=1e-6)


@pytest.mark.parametrize("n_faces", [0, -5, 2_999])
def test_too_few_faces_are_a_value_error(n_faces):
    with pytest.raises(ValueError, match=f"n_faces must be at least .*, got {n_faces}"):
        sample_mesh(n_faces)


@pytest.mark.parametrize("n_faces", [60_000.0, "many", None, True])
def test_a_number_of_faces_that_is_no_integer_is_a_type_error(n_faces):
    with pytest.raises(TypeError, match="n_faces must be an integer"):
        sample_mesh(n_faces)
