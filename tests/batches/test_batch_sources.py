"""The files that inputs stand for, and the names of their results."""

import os

import pytest

from superfacets.kit import InputFile


@pytest.fixture
def tree(tmp_path, monkeypatch):
    for name in [
        "scans/a/one.ply", "scans/a/one.superfacets.ply", "scans/a/truth.txt", "scans/b/two.OBJ",
        "scans/b/notes.md", "scans/points.xyz", "scans/table.csv", "scans/labels.npy",
        "odd[1].ply",
    ]:  # fmt: skip
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def names_of(*inputs):
    return {source.name: source.input for source in InputFile.find(inputs)}


def test_a_folder_is_searched_for_meshes_and_clouds_but_not_for_results(tree):
    expected = {
        "a/one.ply": "scans/a/one.ply",
        "b/two.OBJ": "scans/b/two.OBJ",
        "points.xyz": "scans/points.xyz",
    }
    assert names_of("scans") == names_of("scans/") == expected
    assert list(names_of("scans")) == ["points.xyz", "a/one.ply", "b/two.OBJ"]
    assert names_of(tree / "scans") == {n: str(tree / p) for n, p in expected.items()}
    assert InputFile.find("scans") == InputFile.find(["scans"])


def test_links_to_folders_are_not_followed(tree):
    (tree / "scans" / "again").symlink_to(tree / "scans")
    assert len(names_of("scans")) == 3


def test_a_pattern_is_named_from_its_first_wildcard_on(tree):
    assert names_of("scans/*/*.ply") == {
        "a/one.ply": "scans/a/one.ply",
        "a/one.superfacets.ply": "scans/a/one.superfacets.ply",
    }
    assert set(names_of(f"{tree}/scans/**/*.txt")) == {"a/truth.txt"}
    assert names_of("scans/a/*.txt") == {"truth.txt": "scans/a/truth.txt"}
    assert names_of("odd[1].ply") == {"odd[1].ply": "odd[1].ply"}  # an existing file is preferred


def test_a_list_names_files_relative_to_its_folder(tree, monkeypatch):
    absolute = tree / "odd[1].ply"
    lines = ["# scans", "", "a/one.ply", "./b/../b/two.OBJ", "../odd[1].ply", str(absolute)]
    (tree / "scans" / "list.txt").write_text("\n".join(lines) + "\n")
    assert names_of("@scans/list.txt") == {
        "a/one.ply": "scans/a/one.ply",
        "b/two.OBJ": "scans/b/../b/two.OBJ",
        "odd[1].ply": "scans/../odd[1].ply",
    }


def test_files_may_be_of_any_kind_and_be_missing(tree):
    assert names_of("scans/a/truth.txt", "gone/x.ply") == {
        "truth.txt": "scans/a/truth.txt",
        "x.ply": "gone/x.ply",
    }


def test_a_file_that_is_given_twice_is_done_once(tree):
    assert len(names_of("scans/a/one.ply", "./scans/a/one.ply", "scans/a/*e.ply")) == 1


def test_files_of_one_name_are_refused(tree):
    (tree / "one.ply").write_text("")
    with pytest.raises(
        ValueError, match=r"scans/a/one\.ply and one\.ply would have the same result name, one\.ply"
    ):
        InputFile.find(["scans/a/one.ply", "one.ply"])


def test_files_with_one_result_are_refused(tree):
    (tree / "scans/a/one.obj").write_text("")
    sources = InputFile.find("scans")
    message = "scans/a/one.obj and scans/a/one.ply would both be written to a/one.superfacets.npy"
    with pytest.raises(ValueError, match=message):
        InputFile.check_outputs_differ(sources, (".npy",))
    InputFile.check_outputs_differ(InputFile.find(["scans/a/one.ply", "scans/b"]), (".npy",))


def test_inputs_that_stand_for_nothing_are_named(tree):
    (tree / "empty").mkdir()
    for inputs, error, message in [
        ("empty", FileNotFoundError, "empty: no file in it ends in "),
        ("scans/*.stl", FileNotFoundError, r"scans/\*.stl: no file matches"),
        ("@scans/list.txt", FileNotFoundError, "list.txt"),
        ("", ValueError, "inputs must not contain an empty path"),
        ([], ValueError, "inputs must contain at least one file, folder, pattern or list"),
    ]:
        with pytest.raises(error, match=message):
            InputFile.find(inputs)


def test_a_folder_that_cannot_be_read_is_named(tree, monkeypatch):
    scandir = os.scandir

    def refuse(path):
        if str(path).endswith("b"):
            raise PermissionError(13, "Permission denied", str(path))
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(PermissionError, match="scans/b"):
        InputFile.find("scans")


def test_results_mirror_folders():
    assert InputFile("", "a/b.x.obj").output_names((".npy", ".ply")) == (
        "a/b.x.superfacets.npy",
        "a/b.x.superfacets.ply",
    )
    assert InputFile("", "a/b.obj").output_names(()) == ("a/b.superfacets.ply",)
    assert InputFile("", "a/lh.pial").output_names(()) == ("a/lh.pial.superfacets.ply",)
    assert InputFile("", "body.MSH").output_names(()) == ("body.superfacets.vtu",)
