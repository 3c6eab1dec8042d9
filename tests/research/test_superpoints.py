"""The comparison of superpoints on rooms."""

import csv

import numpy as np
import pytest
import shapes
from research.__main__ import commands
from research.baselines.felzenszwalb import felzenszwalb_segments
from research.superpoints import COMPUTED, ORIGINAL, WITH_COLOR, Room, study

from superfacets import write_labels, write_mesh
from superfacets.base.errors import MeshError
from superfacets.metrics import evaluate_vertices


@pytest.fixture
def room(tmp_path):
    """Return a sheet of two objects, left and right, and a speck; one vertex is not in any face."""
    mesh = shapes.bumpy_sheet(16)
    vertices = np.r_[mesh.vertices, [[9, 9, 9]]]
    truth = np.r_[np.where(mesh.vertices[:, 0] < np.median(mesh.vertices[:, 0]), 4, 7), 4]
    path = tmp_path / "sheet_n1.npz"
    np.savez(path, vertices=vertices, faces=mesh.faces, instances=truth, felzenszwalb=truth)
    return path


def test_superpoints_that_are_the_objects_have_no_error(room):
    read = Room.read(room)
    score = read.score(read.given[ORIGINAL])
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


def test_errors_and_iou_are_those_of_the_command_evaluate(room):
    read = Room.read(room)
    labels = (7 * read.mesh.vertices[:, 0]).astype(int) + 100
    values = evaluate_vertices(read.mesh, labels, [read.truth])
    score = read.score(labels)
    assert score.mean_iou == values["achievable_iou"] < 1
    assert score.error == pytest.approx(1 - values["achievable_accuracy"])
    assert score.error > 0


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


@pytest.fixture
def plain_room(room):
    """Return the same room without the segments of ScanNet."""
    with np.load(room) as file:
        arrays = {name: file[name] for name in ("vertices", "faces", "instances")}
    np.savez(room, **arrays)
    return room


def methods_in(table):
    return [row.split("|")[2].strip() for row in table.splitlines()[2:]]


def test_segments_of_scannet_are_computed_if_missing(plain_room):
    room = Room.read(plain_room)
    assert list(room.given) == [COMPUTED]
    assert np.array_equal(room.given[COMPUTED], felzenszwalb_segments(room.mesh))
    assert methods_in(study([plain_room])) == [COMPUTED, "default", "SCANS"]


def test_colors_of_a_room_add_a_method(room):
    with np.load(room) as file:
        arrays = dict(file)
    colors = np.where(arrays["instances"][:, None] == 4, 0, [[255, 0, 0]]).astype(np.uint8)
    np.savez(room, **arrays, colors=colors)
    scores = Room.read(room).scores()
    assert list(scores) == [ORIGINAL, "default", "SCANS", WITH_COLOR]
    assert scores[WITH_COLOR].error < scores["SCANS"].error


def test_rooms_without_a_level_of_noise_form_one_level(room):
    for name in ("scene0000_00", "scene0000_01"):
        room.with_name(f"{name}.npz").write_bytes(room.read_bytes())
    paths = room.parent.glob("*.npz")
    levels = [row.split("|")[1].strip() for row in study(paths).splitlines()[2:]]
    assert levels == ["all"] * 3 + ["n1"] * 3


def test_label_files_of_other_methods_are_rated(plain_room, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    truth = Room.read(plain_room).truth
    write_labels(folder / "sheet_n1.0.010000.segs.json", truth)
    table = study([plain_room], [folder])
    assert methods_in(table) == [COMPUTED, str(folder), "default", "SCANS"]
    assert table.splitlines()[3].replace(" ", "").split("|")[3:6] == ["2", "0.000", "0.000"]
    write_labels(folder / "sheet_n1.npy", np.zeros_like(truth))
    assert study([plain_room], [folder]) == table  # segments are preferred to other formats
    write_labels(folder / "sheet_n1.segs.json", truth)
    with pytest.raises(
        MeshError,
        match=r"room sheet_n1, sheet_n1\.0\.010000\.segs\.json, sheet_n1\.segs\.json: keep one$",
    ):
        study([plain_room], [folder])
    for path in folder.glob("*.segs.json"):
        path.unlink()
    write_labels(folder / "sheet_n1.npy", truth[1:])
    with pytest.raises(
        ValueError, match=r"mine must have one value per vertex \(290\), got 289 values"
    ):
        study([plain_room], [folder])


def test_a_missing_label_file_is_named(plain_room, tmp_path):
    with pytest.raises(MeshError) as caught:
        study([plain_room], [tmp_path / "mine"])
    assert str(caught.value) == (
        f"{tmp_path / 'mine'} has no labels of the room sheet_n1: add sheet_n1.segs.json or"
        f" sheet_n1.0.010000.segs.json, or remove {plain_room}"
    )


def test_scores_of_each_room_are_a_csv_file(room, tmp_path):
    other = room.with_name("other_n1.npz")
    with np.load(room) as file:
        np.savez(other, **{**file, "felzenszwalb": np.zeros_like(file["felzenszwalb"])})
    table = study([room, other], output=tmp_path / "a.csv")
    assert table == study([room, other])
    with (tmp_path / "a.csv").open() as file:
        rows = list(csv.DictReader(file))
    names = [ORIGINAL, "default", "SCANS"]
    assert [(row["room"], row["method"]) for row in rows] == [
        *(("other_n1", name) for name in names), *(("sheet_n1", name) for name in names),
    ]  # fmt: skip
    read = Room.read(other)
    score = read.score(read.given[ORIGINAL])
    assert [float(rows[0][name]) for name in score._fields] == list(score)
    mean = np.mean([float(row["error"]) for row in rows if row["method"] == "SCANS"])
    assert table.splitlines()[-1].split("|")[4].strip() == f"{100 * mean:.3f}"
    with pytest.raises(ValueError, match=r"expected the ending \.csv"):
        study([room], output=room)


def test_unannotated_vertices_are_left_out_of_the_error(room):
    with np.load(room) as file:
        arrays = dict(file)
    hidden = arrays["vertices"][:, 1] > np.median(arrays["vertices"][:, 1])
    segments = np.where(hidden, 0, arrays["felzenszwalb"])  # wrong only where nothing is annotated
    arrays["instances"][hidden] = -1
    np.savez(room, **arrays)
    score = Room.read(room).score(segments)
    assert (score.error, score.error_away, score.mean_iou) == (0, 0, 1)
    np.savez(room, **arrays | {"instances": np.full(len(segments), -1)})
    with pytest.raises(MeshError, match="not a room: all instances are -1"):
        Room.read(room)


def test_the_command_rates_label_files_of_rooms(tmp_path, capsys):
    def table(*more):
        words = ["superpoints", str(tmp_path), "--labels", str(mine), *more]
        commands(words, standalone_mode=False)
        return capsys.readouterr().out

    mesh = shapes.bumpy_sheet(16)
    objects = (mesh.vertices[:, 0] > 0.5).astype(int)
    mine = tmp_path / "mine"
    mine.mkdir()
    np.savez(tmp_path / "a_n1.npz", vertices=mesh.vertices, faces=mesh.faces, instances=objects)
    write_labels(mine / "a_n1.segs.json", objects)
    printed = table()
    row = next(line for line in printed.splitlines() if f"{mine} " in line)
    assert row.replace(" ", "").split("|")[3:5] == ["2", "0.000"]
    write_mesh(mine / "a_n1.ply", mesh, np.zeros(mesh.n_faces, int))
    assert table("-o", str(tmp_path / "rooms.csv")) == printed
    assert (tmp_path / "rooms.csv").read_text().startswith("room,method,n_superpoints,error,")
