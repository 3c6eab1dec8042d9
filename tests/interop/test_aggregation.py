"""ScanNet's groups of segments are not overwritten, and can be moved to other segments."""

import importlib.machinery
import importlib.util
import json
import sys
import types

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import MeshError
from superfacets_scans import group_segments, regroup_segments


def write_json(path, document):
    path.write_text(json.dumps(document))
    return path


@pytest.fixture
def scene(tmp_path):
    """Write ten vertices in five segments, three of which form two objects."""
    groups = [
        {"id": 0, "objectId": 0, "segments": [3, 5], "label": "chair"},
        {"id": 1, "objectId": 7, "segments": [8], "label": "table"},
    ]
    segments = {"params": {}, "sceneId": "s", "segIndices": [3, 3, 5, 5, 8, 8, 8, 9, 9, 2]}
    named = "scannet.s_vh_clean_2.0.010000.segs.json"
    write_json(tmp_path / "s_vh_clean_2.0.010000.segs.json", segments)
    aggregation = {"sceneId": "scannet.s", "appId": "Aggregator.v2", "segGroups": groups}
    write_json(tmp_path / "s.aggregation.json", {**aggregation, "segmentsFile": named})
    return tmp_path


def new_segments(scene, ids):
    return write_json(scene / "new.segs.json", {"segIndices": ids})


def test_objects_go_to_the_segments_that_most_of_their_vertices_are_in(scene):
    new = new_segments(scene, [0, 0, 0, 1, 1, 1, 2, 3, 3, 3])
    objects = regroup_segments(scene / "new.aggregation.json", scene / "s.aggregation.json", new)
    assert [tuple(found) for found in objects] == [(0, "chair", 4, 1, 0), (7, "table", 3, 0, 1)]
    written = json.loads((scene / "new.aggregation.json").read_text())
    assert [group["segments"] for group in written["segGroups"]] == [[0], [1, 2]]
    assert written["segmentsFile"] == "scannet.new.segs.json"
    assert written["appId"] == "Aggregator.v2"


def test_segments_are_grouped_into_objects(tmp_path):
    segments, output = tmp_path / "room.segs.json", tmp_path / "room.aggregation.json"
    sf.write_labels(segments, [4, 4, 9, 2, 7])
    group_segments(output, segments, [8, -1, 3, 8], classes=["desk", "chair"], scores=[0.5, 1])
    written = json.loads(output.read_text())
    assert written["segmentsFile"] == "scannet.room.segs.json"
    assert [list(group.values()) for group in written["segGroups"]] == [
        [0, 0, [7], "desk", 0.5],
        [1, 1, [2, 9], "chair", 1.0],
    ]
    group_segments(output, segments, [-1] * 4)
    assert json.loads(output.read_text())["segGroups"] == []


def test_what_does_not_fit_segments_writes_no_groups(scene):
    segments = new_segments(scene, [0, 2, 2])
    output = scene / "own.aggregation.json"
    for objects, words, options in (
        ([0], r"objects must have one value per segment \(2\), got 1 value", {}),
        (0, "objects must have one value per segment", {}),
        ([0, -2], r"objects\[1\] must be -1 to", {}),
        ([0, 1], r"classes must have one value per object \(2\), got 1", {"classes": ["a"]}),
    ):
        with pytest.raises(ValueError, match=words):
            group_segments(output, segments, objects, **options)
    with pytest.raises(MeshError, match=r"expected the ending \.segs\.json"):
        group_segments(output, scene / "new.npy", [0, 1])
    with pytest.raises(FileExistsError):
        group_segments(scene / "s.aggregation.json", segments, [0, 1])
    assert not output.exists()


def test_groups_are_labels_of_vertices(scene):
    assert sf.read_labels(scene / "s.aggregation.json").tolist() == [0] * 4 + [7] * 3 + [-1] * 3
    (scene / "s_vh_clean_2.0.010000.segs.json").unlink()
    with pytest.raises(MeshError, match=r"s\.aggregation\.json: the segmentsFile .* copy it there"):
        sf.read_labels(scene / "s.aggregation.json")


def test_finer_segments_lose_nothing(scene):
    new = new_segments(scene, list(range(10)))
    objects = regroup_segments(scene / "new.aggregation.json", scene / "s.aggregation.json", new)
    assert all(found.n_lost == found.n_gained == 0 for found in objects)


def test_an_object_without_segments_is_left_out_and_counted(scene):
    new = new_segments(scene, [0] * 10)
    objects = regroup_segments(scene / "new.aggregation.json", scene / "s.aggregation.json", new)
    assert [found.n_lost for found in objects] == [0, 3]
    written = json.loads((scene / "new.aggregation.json").read_text())
    assert [group["label"] for group in written["segGroups"]] == ["chair"]


def test_files_that_do_not_belong_together_are_refused(scene):
    groups, output = scene / "s.aggregation.json", scene / "new.aggregation.json"
    new = new_segments(scene, [0] * 9)
    with pytest.raises(MeshError, match=r"must have 10 vertices like .*, got 9"):
        regroup_segments(output, groups, new)
    other = write_json(scene / "other.segs.json", {"segIndices": [3] * 10})
    with pytest.raises(
        MeshError,
        match=r"has segment 8, which is not in other\.segs\.json: use the files of the"
        r" same mesh",
    ):
        regroup_segments(output, groups, other, segments=other)
    new.write_text('{"segIndices": [1, 2')
    with pytest.raises(MeshError, match="the file is not valid JSON: "):
        regroup_segments(output, groups, new)
    for wrong in ([0.5] * 10, [-1] * 10, [], "ids", None):
        with pytest.raises(MeshError, match="must have segIndices, a list of integers >= 0"):
            regroup_segments(output, groups, new_segments(scene, wrong))
    write_json(groups, {"segGroups": [{"objectId": 0, "segments": "all"}]})
    with pytest.raises(
        MeshError, match="must have a list segGroups, whose entries have objectId and segments"
    ):
        regroup_segments(output, groups, new)
    write_json(groups, {"segGroups": []})
    with pytest.raises(
        MeshError,
        match=r"has no segmentsFile: add this entry, or give the path of the file of old segments"
        r" \(segments=\)",
    ):
        regroup_segments(output, groups, new)
    assert not output.exists()


def test_segments_that_groups_depend_on_are_not_replaced(scene):
    mesh = shapes.cube()
    labels = np.arange(mesh.n_faces)
    path = scene / "s_vh_clean_2.0.010000.segs.json"
    before = path.read_bytes()
    for write in (
        lambda force: sf.write_mesh(path, mesh, labels, force=force),
        lambda force: sf.write_labels(path, [0, 1, 2], force=force),
    ):
        with pytest.raises(FileExistsError, match=r"s\.aggregation\.json refers to the segments"):
            write(False)
        assert path.read_bytes() == before
        write(True)
        path.write_bytes(before)


def test_objects_from_elsewhere_are_not_replaced(scene):
    mesh, labels = shapes.cube(), np.arange(12) // 4
    path = scene / "s.aggregation.json"
    before = path.read_bytes()
    new = write_json(scene / "own.segs.json", {"segIndices": [0, 0, 1, 1, 2, 2]})
    for write in (
        lambda: sf.write_mesh(path, mesh, labels),
        lambda: regroup_segments(scene / "t.aggregation.json", scene / "s.aggregation.json", new),
    ):
        (scene / "t.aggregation.json").write_bytes(before)
        with pytest.raises(
            FileExistsError, match="this file was written by another program, and its objects would"
        ):
            write()
        assert path.read_bytes() == before
    with pytest.raises(FileExistsError, match="another program, and its segments would be lost"):
        sf.write_labels(new, [1, 2])
    with pytest.raises(
        ValueError, match="output must differ from aggregation, which is never replaced"
    ):
        regroup_segments(path, path, new, force=True)
    own = scene / "own.aggregation.json"
    sf.write_mesh(own, mesh, labels)
    sf.write_mesh(own, mesh, labels)  # our own file may be replaced
    sf.write_mesh(path, mesh, labels, force=True)
    assert path.read_bytes() != before


def test_a_file_that_groups_name_is_kept_whatever_its_name(scene):
    other = write_json(scene / "mine.segs.json", {"segIndices": [0]})
    write_json(scene / "x.aggregation.json", {"segGroups": [], "segmentsFile": "mine.segs.json"})
    with pytest.raises(FileExistsError, match=r"x\.aggregation\.json refers"):
        sf.write_labels(other, [1, 2])
    sf.write_labels(scene / "free.segs.json", [1, 2])
    sf.write_labels(scene / "free.segs.json", [2, 2])
    written = json.loads((scene / "free.segs.json").read_text())
    assert written["params"] == {"software": "superfacets", "nSegments": 1}


def test_tensors_are_written_by_torch(tmp_path, monkeypatch):
    saved = []
    torch = types.ModuleType("torch")
    torch.__spec__ = importlib.machinery.ModuleSpec("torch", None)
    torch.from_numpy = lambda array: array
    torch.save = lambda tensor, file: saved.append(tensor) or file.write(b"tensor")
    monkeypatch.setitem(sys.modules, "torch", torch)
    sf.write_labels(tmp_path / "scene.pth", [4, 9, 4])
    assert (saved[0].tolist(), saved[0].dtype) == ([0, 1, 0], np.int64)
    assert (tmp_path / "scene.pth").read_bytes() == b"tensor"


@pytest.mark.skipif(importlib.util.find_spec("torch") is not None, reason="torch is installed")
def test_without_torch_no_tensor_is_written(tmp_path):
    with pytest.raises(ImportError, match=r"a \.pth file needs torch"):
        sf.write_mesh(tmp_path / "scene.pth", shapes.cube(), np.zeros(12, int))
    with pytest.raises(ImportError, match=r"a \.pth file needs torch"):
        sf.batch(["missing.ply"], tmp_path, formats=["ply", "pth"])  # before an input is read
    assert not list(tmp_path.iterdir())
