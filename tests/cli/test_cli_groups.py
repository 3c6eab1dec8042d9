"""Commands on the files of a ScanNet scene."""

import json

import pytest
import shapes

import superfacets as sf


@pytest.fixture
def scene(tmp_path):
    """Write ten vertices in five segments, three of which form two objects."""
    groups = [
        {"objectId": 0, "segments": [3, 5], "label": "chair"},
        {"objectId": 7, "segments": [8], "label": "table"},
    ]
    named = "s_vh_clean_2.0.010000.segs.json"
    (tmp_path / named).write_text(json.dumps({"segIndices": [3, 3, 5, 5, 8, 8, 8, 9, 9, 2]}))
    document = {"segGroups": groups, "segmentsFile": f"scannet.{named}"}
    (tmp_path / "s.aggregation.json").write_text(json.dumps(document))
    return tmp_path


def test_the_command_carries_groups_over_and_shows_the_loss(run, scene):
    groups, new = scene / "s.aggregation.json", scene / "new.segs.json"
    new.write_text(json.dumps({"segIndices": [0, 0, 0, 1, 1, 1, 2, 3, 3, 3]}))
    output = scene / "own.aggregation.json"
    status, printed, err = run("convert", groups, new, "-o", output)
    assert (status, err) == (0, "")
    assert printed.splitlines() == [
        f"wrote {output}",
        "s.aggregation.json:   object  vertices    lost  gained  label",
        "       0         4       1       0  chair",
        "       7         3       0       1  table",
    ]  # fmt: skip
    status, _, err = run("convert", groups, new, "-o", output)
    assert (status, "this file was written by another program, and its objects would" in err) == (
        1,
        True,
    )
    again = ("convert", groups, new, "-o", output, "--json", "--force")
    objects = json.loads(run(*again)[1])["objects"]
    assert [found["n_lost"] for found in objects] == [1, 0]
    assert run("convert", groups, "-o", output)[0] == 2
    assert run("convert", "a.ply", "-o", "b.ply", "--segments", new)[0] == 2


def test_the_command_keeps_truth_unless_it_is_forced(run, scene):
    sf.write_mesh(scene / "s_vh_clean_2.ply", shapes.bumpy_sheet(8))
    path = scene / "s_vh_clean_2.0.010000.segs.json"
    before = path.read_bytes()
    arguments = ("segment", scene / "s_vh_clean_2.ply", "-n", 5, "-o", path)
    status, _, err = run(*arguments)
    assert status == 1
    assert err.count("\n") == 1
    assert "s.aggregation.json refers to the segments in this file" in err
    assert path.read_bytes() == before
    assert run(*arguments, "--force")[0] == 0
    assert path.read_bytes() != before
