"""What a notebook shows of a result: a picture where there can be one, and counts that add up."""

import base64
import io
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets.view import notebook

SHEET = shapes.bumpy_sheet(12)


@pytest.fixture
def result():
    """New for each test: pictures are kept for as long as a result is."""
    return sf.segment(SHEET, 6)


def parsed(html):
    """The elements of HTML that is well-formed XML but for the slash of images."""
    return ElementTree.fromstring(re.sub(r"(<img [^>]*)>", r"\1/>", html))


def rows_of(tree):
    return {row.find("th").text: row.find("td").text for row in tree.iter("tr")}


def test_the_picture_is_a_png_of_the_regions(gl, result):
    image = pytest.importorskip("PIL.Image")
    png = notebook.png_of(result, SHEET)
    picture = image.open(io.BytesIO(png)).convert("RGB")
    assert picture.size == (640, 480)
    assert len(np.unique(np.asarray(picture).reshape(-1, 3), axis=0)) > 6
    source = parsed(notebook.html_of(result, SHEET)).find("img").get("src")
    assert base64.b64decode(source.removeprefix("data:image/png;base64,")) == png
    assert notebook.png_of(result, SHEET) is png  # drawn once


def test_counts_and_bars_add_up(result, monkeypatch):
    monkeypatch.setattr(notebook, "MAX_DRAWN", 0)
    tree = parsed(notebook.html_of(result, SHEET))
    assert tree.find("img") is None
    rows, sizes = rows_of(tree), np.bincount(result.labels)
    assert (rows["faces"], rows["regions"]) == ("288", "6")
    median = int(np.median(sizes))
    assert rows["faces a region"] == f"{sizes.min()} to {sizes.max()}, median {median}"
    assert rows["iterations"] == f"{result.n_iter}, {result.stop_reason}"
    titles = [title.text for title in tree.iter("title")]
    assert sum(int(title.split(" of ")[0]) for title in titles) == 6
    for title in titles:
        count, low, high = map(int, re.findall(r"\d+", title))
        assert np.count_nonzero((sizes >= low) & (sizes <= high)) == count


def test_regions_of_one_size_make_one_bar():
    two = sf.segment(shapes.strip(2), 2)
    tree = parsed(notebook.html_of(two, None))
    assert [title.text for title in tree.iter("title")] == ["2 of 1 to 1 cells"]
    assert rows_of(tree)["cells"] == "2"


def test_cells_that_were_left_out_are_counted_apart(result):
    masked = replace(result, labels=np.where(np.arange(288) < 10, -1, result.labels))
    rows = rows_of(parsed(notebook.html_of(masked, None)))
    assert (rows["cells"], rows["left out"]) == ("288", "10 cells")


def test_points_and_tetrahedra_are_called_so(monkeypatch):
    monkeypatch.setattr(notebook, "MAX_DRAWN", 0)
    cloud = sf.PointCloud(SHEET.vertices)
    assert rows_of(parsed(notebook.html_of(sf.segment(cloud, 3), cloud)))["points"] == "169"


@pytest.mark.parametrize(
    "error", [sf.MissingExtraError("rendering", "viz"), sf.RenderError("no OpenGL was found")]
)
def test_without_the_extra_or_opengl_there_is_no_picture(result, monkeypatch, error):
    def fail(*args, **kwargs):
        raise error

    monkeypatch.setattr(notebook, "render", fail)
    assert notebook.png_of(result, SHEET) is None
    assert "<img" not in notebook.html_of(result, SHEET)
    assert "<svg" in notebook.html_of(result, SHEET)


def test_a_large_mesh_is_not_drawn(result, monkeypatch):
    monkeypatch.setattr(notebook, "MAX_DRAWN", SHEET.n_faces - 1)
    assert notebook.png_of(result, SHEET) is None
