"""Commands that accept a folder of files also accept a tileset."""

import json

import numpy as np
import pytest
from command_line import files_in
from numpy.testing import assert_allclose, assert_array_equal
from tilesets import ORIGIN, sheet_in_parts, write_city, write_glb, write_tileset

from superfacets import batch, read_attributes, read_mesh, segment, segment_tiled
from superfacets.batches.sources import find_sources

NOTE = "positions in results are relative to the origin 4501000, 700000, 4400001"


@pytest.fixture
def city(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return write_city(tmp_path / "city")[1]


def corners_of(mesh):
    return mesh.vertices[mesh.faces]


@pytest.mark.parametrize("source", ["city", "city/tileset.json"])
def test_batch_segments_each_model_in_its_place(run, city, tmp_path, source):
    status, printed, err = run("batch", source, "-o", "out", "-n", "5", "--workers", "1")
    assert (status, NOTE in err) == (0, True)
    assert printed.startswith("4 files done; 1152 cells")
    names = ["data/one", "data/two", "sub/three 3", "sub/four"]
    results = [tmp_path / "out" / f"{name}.superfacets.ply" for name in names]
    assert read_attributes(results[1]).comments == ("comment origin 4501000 700000 4400001",)
    found = np.concatenate([corners_of(read_mesh(path)) for path in results])
    assert_allclose(found, corners_of(city), rtol=0, atol=1e-5)
    again = batch(source, "out", n_segments=5)
    assert (again.n_kept, again.n_done) == (4, 0)
    record = json.loads((tmp_path / "out" / "manifest.jsonl").read_text().splitlines()[0])
    assert record["params"]["origin"] == [*ORIGIN]


def test_a_moved_model_is_segmented_again(city, tmp_path):
    batch("city", "out", n_segments=5, workers=1)
    path = tmp_path / "city" / "tileset.json"
    document = json.loads(path.read_text())
    document["root"]["children"][0]["transform"] = np.diag([1, 1, 1, 1.0]).ravel().tolist()
    document["root"]["children"][1]["transform"] = np.diag([2, 2, 2, 1.0]).ravel().tolist()
    path.write_text(json.dumps(document))
    again = batch("city", "out", n_segments=5, workers=1)
    assert (again.n_kept, again.n_done) == (3, 1)


def test_a_folder_above_tilesets_is_searched_for_them(city, tmp_path):
    write_glb(tmp_path / "other.glb", np.eye(3), np.array([[0, 1, 2]]))
    (tmp_path / "city").rename(tmp_path / "towns")
    result = batch(tmp_path, tmp_path / "out", formats=["npy"], n_segments=5, workers=1)
    assert [record["name"] for record in result.records] == [
        "other.glb",
        "towns/data/one.glb",
        "towns/data/two.b3dm",
        "towns/sub/three 3.glb",
        "towns/sub/four.glb",
    ]


def test_lists_and_patterns_may_name_tilesets(city, tmp_path):
    (tmp_path / "list.txt").write_text("city/tileset.json\n")
    names = ["data/one.glb", "data/two.b3dm", "sub/three 3.glb", "sub/four.glb"]
    listed = [source.name for source in find_sources("@list.txt")]
    assert listed == [f"city/{name}" for name in names]
    assert [source.name for source in find_sources("city/t*.json")] == names


def test_a_missing_model_fails_alone(run, city, tmp_path):
    (tmp_path / "city" / "data" / "one.glb").unlink()
    status, printed, err = run("batch", "city", "-o", "out", "-n", "5", "--workers", "1")
    assert status == 1
    assert "3 files done" in printed
    assert "one.glb: no such file" in err


@pytest.mark.parametrize("source", ["city", "city/tileset.json"])
def test_tiles_segment_all_models_as_one(run, city, source):
    status, _, err = run("segment", source, "--tiled", "-n", "40", "-o", "all.npy")
    assert (status, err) == (0, "")
    found = np.load("all.npy")
    assert found.min() == 0
    assert len(np.unique(found)) == found.max() + 1 == 40
    assert len(found) == city.n_faces


def test_models_that_meet_exactly_are_one_surface(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    sheet, parts = sheet_in_parts()
    for i, part in enumerate(parts):
        write_glb(tmp_path / f"{i}.glb", *part)
    children = [{"content": {"uri": f"{i}.glb"}} for i in range(4)]
    write_tileset(tmp_path / "tileset.json", {"children": children})
    result = segment_tiled("tileset.json", n_segments=5)
    assert_array_equal(result.labels, segment(sheet, 5).labels)


def test_tiles_write_labels_of_each_model(city, tmp_path):
    whole = segment_tiled("city", n_segments=40, out="all.npy")
    parts = segment_tiled("city/tileset.json", n_segments=40, out="labels/")
    names = ["data_one", "data_two", "sub_three 3", "sub_four"]
    assert {*files_in(tmp_path / "labels")} == {f"{name}.npy" for name in names}
    assert_array_equal(np.concatenate([np.load(f"labels/{name}.npy") for name in names]),
                       np.load("all.npy"))  # fmt: skip
    assert whole.n_segments == parts.n_segments


def test_convert_writes_each_model_in_its_place(run, city, tmp_path):
    status, printed, err = run("convert", "city/tileset.json", "-o", "out/", "--to", "glb")
    assert (status, err) == (0, f"superfacets: note: {NOTE}\n")
    names = ["data_one", "data_two", "sub_three 3", "sub_four"]
    found = [read_mesh(tmp_path / "out" / f"{name}.superfacets.glb") for name in names]
    assert_allclose(np.concatenate([*map(corners_of, found)]), corners_of(city), atol=1e-5)
    assert len(printed.splitlines()) == 4


def test_a_damaged_tileset_is_one_failed_file(run, city, tmp_path):
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "tileset.json").write_text("nonsense")
    twice = {"children": [{"content": {"uri": "one.glb"}}] * 2}
    write_tileset(tmp_path / "city" / "data" / "two.json", twice)
    inputs = ["bad", "city", "city/data/two.json"]
    status, _, err = run("batch", *inputs, "-n", "20", "-o", "out")
    assert status == 1
    assert "bad/tileset.json: not a tileset, or damaged" in err
    assert "the tileset contains one.glb more than once" in err
    assert len([*(tmp_path / "out").rglob("*.ply")]) == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["convert", "city", "a.npy", "-o", "out/"], "LABELS and --split need a single mesh"),
        (["convert", "city/sub/two.json", "-o", "out/"], "contains two.glb more than once"),
        (
            ["segment", "city/tileset.json", "-n", "9"],
            "tilesets can be read only by batch, convert and segment --tiled",
        ),
        (["segment", "city/sub/bad.json", "--tiled", "-n", "9"], "bad.json: not a tileset"),
        (["segment", "city/sub/gone.json", "--tiled", "-n", "9"], "gone.json: no such file"),
        (["segment", "city/sub/points.json", "--tiled", "-n", "9"], "got .pnts"),
    ],
)
def test_what_cannot_be_done_is_told_in_one_line(run, city, tmp_path, arguments, message):
    sub = tmp_path / "city" / "sub"
    (sub / "bad.json").write_text("nonsense")
    write_glb(sub / "two.glb", np.eye(3), np.array([[0, 1, 2]]))
    write_tileset(sub / "two.json", {"children": [{"content": {"uri": "two.glb"}}] * 2})
    (sub / "a.pnts").write_bytes(b"pnts")
    write_tileset(sub / "points.json", {"content": {"uri": "a.pnts"}})
    status, _, err = run(*arguments)
    assert status in (1, 2)
    assert message in err.splitlines()[-1]
    assert len([line for line in err.splitlines() if "error" in line]) == 1
