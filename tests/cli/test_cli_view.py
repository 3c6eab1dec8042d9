"""The command `view`."""

import os
from pathlib import Path

import numpy as np
import pytest
from shapes import bumpy_sheet, strip
from textured_meshes import facade

from superfacets import MeshAttributes, PointCloud, read_mesh, write_mesh


def test_a_page_is_written_with_levels_ground_truth_and_values(run, sheet, tmp_path):
    levels, page = tmp_path / "levels.npz", tmp_path / "page.html"
    assert run("levels", sheet, "-n", "20,5", "-o", levels)[0] == 0
    with np.load(levels) as arrays:
        labels = arrays["labels"]
    np.save(tmp_path / "truth.npy", labels[1])
    np.save(tmp_path / "height.npy", np.arange(labels.shape[1]) / 7)
    (tmp_path / "size.txt").write_text("".join(f"{n}\n" for n in np.bincount(labels[0])))
    np.save(tmp_path / "z.npy", read_mesh(sheet).vertices[:, 2])
    given = ["--gt", tmp_path / "truth.npy", "--feature", tmp_path / "height.npy"]
    given += ["--feature", tmp_path / "size.txt", "--title", "A sheet", "--up", "z"]
    given += ["--feature", tmp_path / "z.npy"]
    assert run("view", sheet, "--labels", levels, "--html", page, *given) == (
        0, f"wrote {page}\n", "",
    )  # fmt: skip
    text = page.read_text(encoding="utf-8")
    assert "<title>A sheet</title>" in text
    assert '"name":"height","of":"cell"' in text
    assert '"name":"size","of":"region"' in text
    assert '"name":"z","of":"cell"' in text
    assert '"level_1_parents"' in text
    assert '"truth_labels"' in text


def test_labels_in_the_file_are_taken_and_their_lack_is_noted(run, tmp_path):
    mesh, page = tmp_path / "<b>.ply", tmp_path / "page.html"
    write_mesh(mesh, strip(2), [0, 1])
    guess = "(up: z, guessed; change it with --up)"
    assert run("view", mesh, "--html", page) == (0, f"wrote {page} {guess}\n", "")
    text = page.read_text(encoding="utf-8")
    assert "level_0_labels" in text
    assert "<title>&lt;b&gt;.ply</title>" in text
    write_mesh(mesh, strip(2))
    status, _, err = run("view", mesh, "--html", page)
    assert status == 0
    assert "has no labels: give a label file as LABELS" in err


def test_colors_of_the_file_are_shown_unless_its_texture_is(run, tmp_path):
    made = facade(tmp_path, edge=1)
    shades = {name: np.full(made.mesh.n_vertices, 90) for name in ("red", "green", "blue")}
    attributes = MeshAttributes(vertex=shades, texture=made.texture)
    mesh, page = tmp_path / "a.ply", tmp_path / "a.html"
    write_mesh(mesh, made.mesh, [0] * made.mesh.n_faces, attributes=attributes)
    assert run("view", mesh, "--html", page)[::2] == (0, "")
    text = page.read_text(encoding="utf-8")
    assert '"atlas"' in text
    assert '"vertex_colors"' not in text
    (tmp_path / "facade.png").unlink()
    assert "note: the texture is not shown" in run("view", mesh, "--html", page)[2]
    assert '"vertex_colors"' in page.read_text(encoding="utf-8")
    write_mesh(
        mesh, PointCloud(made.mesh.vertices, colors=np.full((len(made.mesh.vertices), 3), 0.4))
    )
    assert run("view", mesh, "--html", page)[0] == 0
    assert '"vertex_colors"' in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(("title", "shown"), [("a\ud800", "a?"), ("\udcff", "?")])
def test_a_title_that_is_no_unicode_has_question_marks(run, sheet, tmp_path, title, shown):
    page = tmp_path / "page.html"
    assert run("view", sheet, "--html", page, "--title", title)[0] == 0
    assert f"<title>{shown}</title>" in page.read_text(encoding="utf-8")


@pytest.mark.skipif(os.name == "nt", reason="names of files are text there")
def test_a_name_that_is_no_unicode_is_a_title(run, tmp_path):
    mesh, page = tmp_path / os.fsdecode(b"a\xff.ply"), tmp_path / "page.html"
    try:
        write_mesh(mesh, strip(2), [0, 1])
    except OSError:
        pytest.skip("the file system takes no such name")
    assert run("view", mesh, "--html", page)[::2] == (0, "")
    assert "<title>a?.ply</title>" in page.read_text(encoding="utf-8")


def test_pages_end_in_html(run, sheet, tmp_path):
    status, _, err = run("view", sheet, "--html", tmp_path / "page.png")
    assert status == 2
    assert "must end in .html or .htm, got 'page.png'" in err


def test_features_have_different_names(run, sheet, tmp_path):
    features = ["--feature", tmp_path / "a.npy", "--feature", tmp_path / "a.txt"]
    status, _, err = run("view", sheet, "--html", tmp_path / "page.html", *features)
    assert status == 2
    assert "two features have the same name" in err


@pytest.mark.parametrize(("option", "name", "content", "message"), [
    ("--labels", "l.npz", b"PK damaged", "is not a .npz of superfacets levels, or is damaged"),
    ("--labels", "l.npz", None, "l.npz: no such file"),
    ("--labels", "l.txt", b"1\n2\n",
     "labels must have one value per face (1152) or per vertex (625), got 2 values"),
    ("--feature", "f.txt", b"1\nx\n", "f.txt: could not convert"),
    ("--feature", "f.npy", b"nothing", "f.npy: the header of the .npy file cannot be read"),
    ("--feature", "f.csv", b"1\n", "expected the ending .npy, .txt, .shape.gii"),
    ("--feature", "f.txt", b"1\n2\n",
     "feature 'f' must have one value per cell, (1152,), or one value per vertex, (625,); got"
     " shape (2,)"),
])  # fmt: skip
def test_wrong_files_are_refused(run, sheet, tmp_path, option, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    page = tmp_path / "page.html"
    status, _, err = run("view", sheet, "--html", page, option, tmp_path / name)
    assert status == 1
    assert message in err
    assert not page.exists()


def test_labels_of_another_name_are_shown(run, tmp_path):
    mesh = bumpy_sheet(6)
    attributes = MeshAttributes(face={"part": np.arange(mesh.n_faces) // 9})
    write_mesh(tmp_path / "a.ply", mesh, attributes=attributes)
    page = tmp_path / "a.html"
    status, _, err = run("view", tmp_path / "a.ply", "--html", page, "--labels-named", "part")
    assert (status, err) == (0, "")
    assert "has no labels" in run("view", tmp_path / "a.ply", "--html", page)[2]


@pytest.mark.parametrize("has_browser", [True, False])
def test_without_a_file_the_browser_opens_the_page(
    run, sheet, tmp_path, monkeypatch, temporary, has_browser
):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda page: opened.append(page) or has_browser)
    temporary(tmp_path)
    status, out, err = run("view", sheet)
    assert status == 0
    path, guess = out.removeprefix("wrote ").rstrip().split(" (", 1)
    path = Path(path)
    assert guess == "up: y, guessed; change it with --up)"
    assert path.name == "sheet.html"
    assert opened == [path.as_uri()]
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert ("no browser was found" in err) != has_browser
