"""The command `demo`."""

import os
import sys

import pytest
from command_line import can_render, files_in

from superfacets import read_labels


def test_the_demo_makes_nothing_where_it_cannot_draw(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkCommonCore", None)
    status, out, err = run("demo", "-o", tmp_path / "demo")
    assert (status, out) == (1, "")
    assert "pip install 'superfacets[viz]'" in err
    assert files_in(tmp_path) == []


def test_a_file_and_folder_that_may_not_be_written_are_found_before_the_work(run, tmp_path, forbid):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    (tmp_path / "taken").write_text("")
    status, out, err = run("demo", "-o", tmp_path / "taken")
    assert (status, out) == (1, "")
    assert err == f"superfacets: error: {tmp_path / 'taken'}: is a file, not a folder\n"
    # Root can write to any folder, so `os.access` is replaced.
    forbid(lambda _, mode: not mode & os.W_OK)
    status, out, err = run("demo", "-o", tmp_path)
    assert (status, out) == (1, "")
    assert err == f"superfacets: error: {tmp_path}: the folder is not writable\n"


def test_the_demo_makes_a_labeled_mesh_and_a_picture(run, tmp_path):
    if not can_render():
        pytest.skip("no OpenGL to draw with")
    folder = tmp_path / "new" / "demo"
    status, out, _ = run("demo", "-o", folder)
    assert status == 0
    assert files_in(folder) == ["bear.superfacets.ply", "bear.superfacets.png"]
    assert all(str(folder / name) in out for name in files_in(folder))
    assert read_labels(folder / "bear.superfacets.ply").max() == 149
