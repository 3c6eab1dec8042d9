"""The command `superfacets batch`."""

import json
import sys

import numpy as np
import pytest
import shapes
from command_line import files_in

from superfacets import MeshAttributes, read_mesh, segment, write_mesh
from superfacets.files import formats


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out"


def test_a_file_is_done_with_the_options_of_segment(run, sheet, out):
    status, printed, err = run("batch", sheet, "-o", out, "-n", 7, "--to", "npy,seg", "--paper")
    assert (status, err) == (0, "")
    assert printed.startswith("1 file done; 1152 cells in ")
    assert files_in(out) == [
        ".lock", "manifest.jsonl", "sheet.superfacets.npy", "sheet.superfacets.seg",
    ]  # fmt: skip
    record = json.loads((out / "manifest.jsonl").read_text())
    assert record["params"]["paper"] is True
    assert record["params"]["formats"] == ["npy", "seg"]
    run("segment", sheet, "-n", 7, "--paper", "-o", out / "labels.npy")
    assert np.array_equal(np.load(out / "sheet.superfacets.npy"), np.load(out / "labels.npy"))
    status, printed, _ = run("batch", sheet, "-o", out, "-n", 7, "--to", "npy,seg", "--paper")
    assert status == 0
    assert printed.startswith("0 files done, 1 done before; 0 cells in ")


def test_a_line_per_kind_of_note_says_how_many_files_have_it(run, tmp_path, out):
    for name in "ab":
        write_mesh(tmp_path / f"{name}.ply", shapes.two_islands(), [0] * 8)
    command = ("batch", tmp_path, "-o", out, "-n", 1, "--to", "ply,segs.json", "--workers", 1)
    err, kinds = run(*command)[2], ("IslandWarning", "small regions", "changed data")
    begins = ("2 regions instead of 1: 1 comp", "2 with fewer than 20 vertices", "in .ply, new val")
    for line, kind, begin in zip(err.splitlines(), kinds, begins, strict=True):
        assert line.startswith(f"superfacets: note: {kind} in 2 files, such as a.ply: {begin}")
    record = json.loads((out / "manifest.jsonl").read_text().splitlines()[1])
    assert tuple(record["notes"]) == kinds
    assert run(*command)[2] == err  # files that were done before have notes, too


def test_values_of_each_file_are_a_mask(run, sheet, tmp_path, out):
    mesh = read_mesh(sheet)
    places = mesh.vertices[mesh.faces].mean(axis=1)[:, 0]
    kept = places < np.median(places)
    options = ("--mask-values", "6,9", "--labels-named", "kind", "-n", 9)
    inputs = []
    for name, is_kept in {"a": kept, "b": ~kept, "none": kept & ~kept}.items():
        kinds = MeshAttributes(face={"kind": np.where(is_kept, 6, 2).astype(np.int32)})
        inputs.append(tmp_path / f"{name}.ply")
        write_mesh(inputs[-1], mesh, attributes=kinds)
    status, _, err = run("batch", *inputs, "-o", out, *options, "--to", "npy")
    assert status == 1
    assert "none.ply: no face has the value 6 or 9" in err
    run("segment", *inputs[:2], "-o", tmp_path, *options, "--to", "npy")
    for name in ("a.superfacets.npy", "b.superfacets.npy"):
        assert np.array_equal(np.load(out / name), np.load(tmp_path / name))
    assert np.array_equal(np.load(out / "b.superfacets.npy") >= 0, ~kept)
    record = json.loads((out / "manifest.jsonl").read_text().splitlines()[0])
    assert record["params"]["mask_values"] == [6, 9]


def test_failures_are_lines_and_a_status(run, sheet, out):
    sheet.write_text("nothing")
    status, printed, err = run("batch", sheet, "-o", out)
    assert status == 1
    assert printed.startswith("0 files done; ")
    assert err.splitlines() == [
        f"superfacets: error: {sheet}: not a PLY file: it does not begin with the word ply",
        "superfacets: error: 1 of 1 file failed",
    ]
    status, _, err = run("batch", sheet, "-o", out, "-q")
    assert (status, err) == (
        1,
        "superfacets: error: 1 of 1 file failed in an earlier run: retry with --retry-failed\n",
    )
    assert len(run("batch", sheet, "-o", out, "--retry-failed")[2].splitlines()) == 2
    sheet.unlink()
    err = run("batch", sheet, "-o", out)[2]
    assert err.startswith(f"superfacets: error: FileNotFoundError: {sheet}: no such file\n")


def test_json_is_one_object(run, sheet, out):
    status, printed, err = run("batch", sheet, "-o", out, "-n", 7, "--json", "--format", "npy")
    assert (status, err) == (0, "")
    facts = json.loads(printed)
    assert facts.pop("seconds") > 0
    assert facts == {
        "n_files": 1, "n_done": 1, "n_kept": 0, "n_failed": 0, "n_cells": 1152,
        "manifest": str(out / "manifest.jsonl"), "failed": {},
    }  # fmt: skip
    sheet.write_text("nothing")
    facts = json.loads(run("batch", sheet, "-o", out, "--json")[1])
    assert list(facts["failed"]) == ["sheet.ply"]


def test_quiet_prints_nothing(run, sheet, out):
    assert run("batch", sheet, "-o", out, "-q") == (0, "", "")


@pytest.mark.parametrize(("arguments", "message"), [
    (["--to", "npy,png"], "'png' is not one of 'ply', "),
    (["--workers", "0"], "is not a whole number of 1 or more"),
    (["--workers", "2", "--scheduler", "tcp://a:1"], "scheduler or workers, not both"),
    (["--init", "flood"], "init must be one of geodesic, curve, farthest"),
    (["-n", 5, "-r", 0.1], "n_segments is 5 and radius is 0.1: give only one"),
    (["--mask-values", "six"], "'six' is not a whole number of 0 or more"),
])  # fmt: skip
def test_a_wrong_command_line_is_one_line(run, sheet, out, arguments, message):
    status, printed, err = run("batch", sheet, "-o", out, *arguments)
    assert (status, printed, err.count("\n")) == (2, "", 1)
    assert message in err
    assert not out.exists()


def test_what_is_not_there_is_one_line(run, tmp_path, out):
    assert run("batch", tmp_path / "*.ply", "-o", out) == (
        1, "", f"superfacets: error: {tmp_path}/*.ply: no file matches this pattern\n",
    )  # fmt: skip


def test_a_missing_extra_is_named_before_the_first_file(run, sheet, tmp_path, out, monkeypatch):
    (tmp_path / "b.msh").write_text("1")
    monkeypatch.setitem(formats._EXTRAS, ".msh", ("a_missing_package", "mesh"))
    status, printed, err = run("batch", sheet, tmp_path / "b.msh", "-o", out)
    assert (status, printed) == (1, "")
    assert "needs an extra: pip install 'superfacets[mesh]'" in err
    assert not out.exists()


def test_a_terminal_shows_how_far_it_is(run, sheet, out, terminal):
    pytest.importorskip("distributed")
    for place in range(3):
        sheet.with_name(f"copy{place}.ply").write_bytes(sheet.read_bytes())
    (sheet.parent / "bad.ply").write_text("nothing")
    terminal(sys.stderr)
    status, _, err = run("batch", sheet.parent / "*.ply", "-o", out, "--to", "npy", "--workers", 1)
    assert status == 1
    assert "/5 [" in err
    assert "superfacets: error: " in err
    assert np.array_equal(np.load(out / "copy1.superfacets.npy"), segment(sheet).labels)
