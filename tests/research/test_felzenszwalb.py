"""The segments of ScanNet's segmenter."""

import numpy as np
import pytest
import shapes
from research.baselines import felzenszwalb_segments

import superfacets as sf
from superfacets.segmentator import segment_mesh


def share_in_matching_segments(first, second):
    """Return the lower share of items in the largest overlaps, over both directions."""
    overlaps = np.zeros((first.max() + 1, second.max() + 1), int)
    np.add.at(overlaps, (first, second), 1)
    return min(overlaps.max(axis=axis).sum() for axis in (0, 1)) / len(first)


@pytest.mark.parametrize(
    ("name", "least"),
    [("office_d1", 1), ("storage_d1", 1), ("bedroom_n1", 0.9998), ("office_n2", 0.98)],
)
def test_segments_are_those_of_the_original(name, least, data_dir):
    path = data_dir / "rooms" / f"{name}.npz"
    if not path.exists():
        pytest.skip("there are no rooms")
    with np.load(path) as room:
        mesh, original = sf.Mesh(room["vertices"], room["faces"]), room["felzenszwalb"]
    ranks = np.unique(original, return_inverse=True)[1]
    assert share_in_matching_segments(felzenszwalb_segments(mesh), ranks) >= least


def test_vertices_at_one_position_are_one_and_unused_ones_stay_alone():
    mesh = shapes.bumpy_sheet(10)
    soup = sf.Mesh(
        np.vstack([mesh.vertices[mesh.faces.ravel()], [[9, 9, 9]]]),
        np.arange(3 * mesh.n_faces).reshape(-1, 3),
    )
    of_mesh, of_soup = (felzenszwalb_segments(m, 0.1, 5) for m in (mesh, soup))
    assert 0 < of_mesh.max() < mesh.n_vertices // 5
    assert share_in_matching_segments(of_soup[:-1], of_mesh[mesh.faces.ravel()]) == 1
    assert of_soup[-1] == of_soup.max() == of_soup[:-1].max() + 1
    assert felzenszwalb_segments(soup, 0.1, 5, weld=False).max() + 1 == mesh.n_faces + 1
    assert (np.diff(np.unique(of_soup, return_index=True)[1]) > 0).all()


def test_segmentator_finds_as_many_regions():
    mesh = sf.sample_mesh(3000)
    segments = felzenszwalb_segments(mesh)
    assert segments.max() == segment_mesh(mesh.vertices, mesh.faces).max() > 1


@pytest.mark.parametrize(
    ("options", "message"),
    [({"threshold": -1}, "threshold must be"), ({"min_vertices": 0}, "min_vertices must be")],
)
def test_wrong_parameters_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        felzenszwalb_segments(shapes.strip(3), **options)
