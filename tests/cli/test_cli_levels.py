"""The command `levels`."""

import json

import numpy as np
import pytest
from command_line import files_in

from superfacets import hierarchy, read_labels, read_mesh, segment, write_labels


def test_levels_writes_all_levels_to_one_file(run, sheet, tmp_path):
    status, out, err = run("levels", sheet, "-n", "5,40,12", "-o", tmp_path / "all.npz")
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "sheet.ply: 1152 faces, levels of 40, 12, 5 regions",
        f"wrote {tmp_path / 'all.npz'}",
    ]
    nested = hierarchy(read_mesh(sheet), [40, 12, 5])
    with np.load(tmp_path / "all.npz") as found:
        assert sorted(found) == [
            "children", "costs", "counts", "finest", "labels", "parents_0", "parents_1",
        ]  # fmt: skip
        assert found["counts"].tolist() == [40, 12, 5]
        assert np.array_equal(found["labels"], nested.levels)
        assert np.array_equal(found["parents_1"], nested.parents[1])
        assert np.array_equal(found["parents_0"][found["labels"][0]], found["labels"][1])
        assert np.array_equal(found["children"], nested.children)


def test_levels_writes_a_file_for_each_level(run, sheet, tmp_path):
    labels = segment(read_mesh(sheet), 30).labels
    write_labels(tmp_path / "fine.npy", labels)
    options = ("--labels", tmp_path / "fine.npy", "--threads", 1, "--json")
    status, out, _ = run("levels", sheet, "-n", "7,20", "-o", tmp_path / "out.seg", *options)
    assert status == 0
    assert json.loads(out) == {
        "file": str(sheet),
        "levels": [20, 7],
        "n_finest": 30,
        "n_fewest": 1,
        "outputs": [str(tmp_path / "out.20.seg"), str(tmp_path / "out.7.seg")],
    }
    nested = hierarchy(read_mesh(sheet), [20, 7], labels=labels)
    for count, expected in zip((20, 7), nested.levels, strict=True):
        assert np.array_equal(read_labels(tmp_path / f"out.{count}.seg"), expected)
    assert run("levels", sheet, "-n", 6, "-o", tmp_path / "part.ply")[0] == 0
    assert len(np.unique(read_labels(tmp_path / "part.6.ply"))) == 6


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        (("-n", "3,x", "-o", "out.npz"), 2, "expected whole numbers >= 1, got 'x'"),
        (("-n", "3"), 2, "Missing option '-o'"),
        (("-n", "3", "-o", "out.xyz"), 2, "out.xyz: expected the ending .npz, .ply,"),
        (("-n", "3", "-o", "no/out.npz"), 1, "the folder no does not exist"),
        (("-n", "3", "-o", "no/out.seg"), 1, "the folder no does not exist"),
        (("-n", "9999", "-o", "out.npz"), 2, "n_segments is 9999 but there are only 1152 faces"),
    ],
)
def test_levels_refuses_what_cannot_be(run, sheet, monkeypatch, tmp_path, options, status, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = run("levels", sheet, *options)
    assert (code, out) == (status, "")
    assert message in err.replace(str(tmp_path) + "/", "")
    assert files_in(tmp_path) == ["sheet.ply"]
