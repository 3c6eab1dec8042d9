"""Results in notebooks: a picture if one can be drawn, and correct counts."""

import base64
import io
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import shapes

import superfacets as sf

SHEET = shapes.bumpy_sheet(12)


@pytest.fixture
def result():
    """Return a new result for each test, because pictures are cached per result."""
    return sf.segment(SHEET, 6)


def parsed(html):
    """Return the elements of HTML that is well-formed XML except for image tags."""
    return ElementTree.fromstring(re.sub(r"(<img [^>]*)>", r"\1/>", html))


def rows_of(tree):
    return {row.find("th").text: row.find("td").text for row in tree.iter("tr")}


def test_the_picture_is_a_png_of_the_regions(gl, result):
    image = pytest.importorskip("PIL.Image")
    png = result._repr_png_()
    picture = image.open(io.BytesIO(png)).convert("RGB")
    assert picture.size == (640, 480)
    assert len(np.unique(np.asarray(picture).reshape(-1, 3), axis=0)) > 6
    source = parsed(result._repr_html_()).find("img").get("src")
    assert base64.b64decode(source.removeprefix("data:image/png;base64,")) == png
    assert result._repr_png_() is png  # drawn once


def test_counts_and_bars_add_up(result, limit):
    limit("faces drawn", 0)
    tree = parsed(result._repr_html_())
    assert tree.find("img") is None
    rows, sizes = rows_of(tree), np.bincount(result.labels)
    assert (rows["faces"], rows["regions"]) == ("288", "6")
    median = int(np.median(sizes))
    assert rows["faces per region"] == f"{sizes.min()} to {sizes.max()}, median {median}"
    assert rows["iterations"] == f"{result.n_iter}, {result.stop_reason}"
    titles = [title.text for title in tree.iter("title")]
    assert sum(int(title.split(" of ")[0]) for title in titles) == 6
    for title in titles:
        count, low, high = map(int, re.findall(r"\d+", title))
        assert np.count_nonzero((sizes >= low) & (sizes <= high)) == count


def test_regions_of_one_size_make_one_bar(limit):
    limit("faces drawn", 0)
    tree = parsed(sf.segment(shapes.strip(2), 2)._repr_html_())
    assert [title.text for title in tree.iter("title")] == ["2 of 1 to 1 faces"]
    assert rows_of(tree)["faces"] == "2"


def test_cells_that_were_left_out_are_counted_apart(result, limit):
    limit("faces drawn", 0)
    masked = replace(result, labels=np.where(np.arange(288) < 10, -1, result.labels))
    rows = rows_of(parsed(masked._repr_html_()))
    assert (rows["faces"], rows["in no region"]) == ("288", "10 faces")


def test_cells_are_called_what_they_are(limit):
    limit("faces drawn", 0)
    limit("points drawn", 0)
    cloud = sf.PointCloud(SHEET.vertices)
    assert rows_of(parsed(sf.segment(cloud, 3)._repr_html_()))["points"] == "169"
    graph = sf.build_face_graph(SHEET).with_weights(np.ones(sf.build_face_graph(SHEET).n_arcs))
    assert rows_of(parsed(sf.segment_graph(graph, 3)._repr_html_()))["cells"] == "288"


def test_a_result_without_its_cells_has_no_picture(result):
    assert replace(result, cells=None)._repr_png_() is None


@pytest.mark.parametrize(
    "error", [sf.MissingExtraError("rendering", "viz"), sf.RenderError("no OpenGL was found")]
)
def test_without_the_extra_or_opengl_there_is_no_picture(result, broken, error):
    broken("superfacets_show.notebook.plot", error)
    assert result._repr_png_() is None
    assert "<img" not in result._repr_html_()
    assert "<svg" in result._repr_html_()


def test_what_is_large_is_not_drawn(result, broken, limit):
    broken("superfacets_show.notebook.plot")
    limit("faces drawn", SHEET.n_faces - 1)
    assert result._repr_png_() is None
    cloud = sf.segment(sf.PointCloud(SHEET.vertices), 3)
    limit("points drawn", SHEET.n_vertices - 1)
    assert cloud._repr_png_() is None
