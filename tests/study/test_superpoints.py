"""The comparison of superpoints on rooms."""

import numpy as np
import pytest
import shapes

from superfacets.errors import MeshError
from superfacets.study.superpoints import Room, study


@pytest.fixture
def room(tmp_path):
    """A sheet of two objects, left and right, and a speck; one vertex is of no face."""
    mesh = shapes.bumpy_sheet(16)
    vertices = np.r_[mesh.vertices, [[9, 9, 9]]]
    middle = np.median(mesh.vertices[:, 0])
    truth = np.r_[np.where(mesh.vertices[:, 0] < middle, 4, 7), 4]
    path = tmp_path / "sheet_n1.npz"
    np.savez(path, vertices=vertices, faces=mesh.faces, instances=truth, felzenszwalb=truth)
    return path


def test_superpoints_that_are_the_objects_have_no_error(room):
    read = Room.read(room)
    score = read.score(read.original)
    assert score == (2, 0.0, 0.0, 1.0, 0)


def test_errors_are_counted_as_they_are(room):
    read = Room.read(room)
    one = np.zeros(read.mesh.n_vertices, int)
    wrong = np.minimum(*np.bincount(read.truth[read.is_used])) / read.is_used.sum()
    score = read.score(one)
    assert score.error == pytest.approx(wrong)
    assert score.mean_iou == pytest.approx((1 - wrong) / 2)
    pieces = one.copy()
    pieces[[0, 100]] = 1
    assert read.score(pieces).extra_pieces == 1


def test_a_table_has_all_methods_at_all_levels(room):
    table = study([room])
    assert [row.split("|")[2].strip() for row in table.splitlines()[2:]] == [
        "ScanNet's segmenter", "default", "SCANS",
    ]  # fmt: skip


def test_other_files_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", vertices=np.eye(3))
    with pytest.raises(MeshError, match="not a room: 'faces is not a file"):
        Room.read(tmp_path / "a.npz")
    with pytest.raises(MeshError, match="no rooms were found"):
        study([])
