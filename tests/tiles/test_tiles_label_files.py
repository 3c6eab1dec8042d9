"""Labels in one file for each file of a folder."""

import numpy as np
import pytest
from shapes import bumpy_sheet
from tiled_checks import in_memory, largest_file

from superfacets import (
    Mesh,
    MeshError,
    PointCloud,
    read_mesh,
    segment_tiled,
    write_mesh,
)


def named(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture
def sheet():
    return bumpy_sheet(24)


@pytest.fixture
def city(sheet, tmp_path):
    """Return a folder with the faces of a sheet in three files, and a file of another kind."""
    folder = tmp_path / "city"
    folder.mkdir()
    names = ["c.obj", "b.2.ply", "a.off"]
    for name, faces in zip(sorted(names), np.split(sheet.faces, [200, 700]), strict=True):
        used, corners = np.unique(faces, return_inverse=True)
        write_mesh(folder / name, Mesh(sheet.vertices[used], corners.reshape(-1, 3)))
    (folder / "readme.txt").write_text("of tiles")
    return folder


def check(out, result, wanted):
    """Check that each file has its part of the labels, and that the result has all."""
    assert np.array_equal(result.labels, wanted)
    assert named(out) == ["a.npy", "b.2.npy", "c.npy"]
    parts = [np.load(out / name) for name in named(out)]
    assert [len(part) for part in parts] == [200, 500, len(wanted) - 700]
    assert {part.dtype for part in parts} == {np.dtype(np.int32)}
    assert np.array_equal(np.concatenate(parts), wanted)


def test_each_mesh_of_a_folder_has_its_labels(sheet, city, tmp_path):
    out = tmp_path / "made" / "labels"
    result = segment_tiled(city, 12, scratch=tmp_path, out=out)
    check(out, result, in_memory(sheet, 12).labels)
    again = segment_tiled(str(city), 5, scratch=tmp_path, out=str(out))  # replaces them
    check(out, again, in_memory(sheet, 5).labels)


def test_each_cloud_of_a_folder_has_its_labels(tmp_path):
    points = np.random.default_rng(0).random((1_500, 3)) * [1, 1, 0.01]
    folder = tmp_path / "scans"
    folder.mkdir()
    parts = np.split(points, [200, 700])
    for name, part in zip(["a.ply", "b.2.ply", "c.ply"], parts, strict=True):
        write_mesh(folder / name, PointCloud(part))
    out = tmp_path / "labels.d"
    result = segment_tiled(folder, 7, scratch=tmp_path, out=f"{out}/")
    check(out, result, in_memory(points, 7).labels)


def test_one_file_takes_the_labels_of_a_folder(sheet, city, tmp_path):
    out = tmp_path / "labels.npy"
    segment_tiled(city, 12, scratch=tmp_path, out=out)
    assert np.array_equal(np.load(out), in_memory(sheet, 12).labels)


def test_a_folder_may_hold_one_file_and_take_its_labels_itself(sheet, tmp_path):
    folder = tmp_path / "city.d"
    folder.mkdir()
    write_mesh(folder / "a.ply", sheet)
    segment_tiled(folder, 12, scratch=tmp_path, out=folder)
    assert named(folder) == ["a.npy", "a.ply"]
    assert np.array_equal(np.load(folder / "a.npy"), in_memory(sheet, 12).labels)


def test_files_with_one_stem_are_refused_before_any_work(sheet, city, tmp_path):
    write_mesh(city / "a.ply", sheet)
    message = r"a\.off and a\.ply in .*city would both be written to a\.npy: rename one of the two"
    with pytest.raises(ValueError, match=message):
        segment_tiled(city, 12, scratch=tmp_path / "scratch", out=tmp_path / "out")
    assert named(tmp_path) == ["city"]


@pytest.mark.parametrize("name", ["out", "out.d/", "folder.npy/"])
def test_a_folder_is_for_the_labels_of_a_folder(sheet, tmp_path, name):
    write_mesh(tmp_path / "a.ply", sheet)
    for source in (sheet, tmp_path / "a.ply", str(tmp_path / "none.ply")):
        with pytest.raises(ValueError, match="out can be a folder only if the source is a folder"):
            segment_tiled(source, 12, scratch=tmp_path, out=f"{tmp_path}/{name}")
    assert named(tmp_path) == ["a.ply"]


def test_a_name_that_may_be_a_file_or_a_folder_is_refused(city, tmp_path):
    for name in ("labels.txt", ""):
        with pytest.raises(ValueError, match=rf"out must end in \.npy, got '{name}'"):
            segment_tiled(city, 12, out=name)
    (tmp_path / "labels").touch()
    with pytest.raises(NotADirectoryError, match="labels: is a file, not a folder"):
        segment_tiled(city, 12, out=tmp_path / "labels")
    (tmp_path / "out" / "c.npy").mkdir(parents=True)
    with pytest.raises(IsADirectoryError, match=r"c\.npy: is a folder, not a file"):
        segment_tiled(city, 12, out=tmp_path / "out")
    with pytest.raises(FileNotFoundError, match=r"out: has no file that ends in \.glb, "):
        segment_tiled(tmp_path / "out", 12, out=tmp_path / "out")


def test_a_run_that_fails_leaves_what_was_there(city, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "b.2.npy").write_text("old")
    for path in (city / "a.off", city / "c.obj"):  # PLY files need no tables on the disk
        write_mesh(path.with_suffix(".ply"), read_mesh(path))
        path.unlink()
    # The 200 labels of the first file fit into 1,000 bytes; the 500 of the second do not.
    with largest_file(1_000), pytest.raises(OSError, match="File too large") as caught:
        segment_tiled(city, 12, scratch=tmp_path, cache=1 << 30, out=out)
    assert caught.value.filename == str(out / "b.2.npy")
    (city / "d.obj").write_text("v 0 0\n")
    with pytest.raises(MeshError, match="line 1"):
        segment_tiled(city, 12, scratch=tmp_path, out=out)
    assert named(out) == ["b.2.npy"]
    assert (out / "b.2.npy").read_text() == "old"


def test_a_folder_that_changes_while_the_run_begins(city, tmp_path):
    def remove(_):
        (city / "c.obj").unlink(missing_ok=True)

    with pytest.raises(OSError, match="had 3 files when the run began, but now has 2"):
        segment_tiled(city, 12, scratch=tmp_path, out=tmp_path / "out", on_stage=remove)
    assert named(tmp_path / "out") == []


def test_labels_do_not_replace_the_source(sheet, city, tmp_path):
    points = tmp_path / "points.npy"
    np.save(points, sheet.vertices)
    before = points.read_bytes()
    with pytest.raises(
        ValueError, match=r"points\.npy: out must not be a file of the source: choose another"
    ):
        segment_tiled(points, 5, out=points)
    assert points.read_bytes() == before
    out = tmp_path / "labels"
    out.mkdir()
    (out / "c.npy").symlink_to(city / "c.obj")
    with pytest.raises(
        ValueError, match=r"c\.npy: out must not be a file of the source: choose another"
    ):
        segment_tiled(city, 5, out=out)
