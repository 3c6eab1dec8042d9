"""Pages: encoded data, size, and protection against scripts in the input."""

import base64
import html
import json
import re
import time
import zlib

import numpy as np
import pytest
from front_end_arrays import decode_arrays
from shapes import bumpy_sheet, cube, soup, strip, table, two_tets

import superfacets as sf
from superfacets import Mesh, Page, PointCloud, PolygonMesh, View, hierarchy
from superfacets_show.colors import face_colors, oklab, scale_colors
from superfacets_show.page.coding import Arrays, newest_codes

EVIL = "</script><script>alert('&\"')</script>"
NO_GROUP = 2**32 - 1


def facts_of(page):
    (text,) = re.findall(r'<script type="application/json" id="facts">(.*?)</script>', page.html)
    return json.loads(text)


def contents(page):
    """Return the facts and arrays of a page."""
    (payload,) = re.findall(r'id="payload">([A-Za-z0-9+/=]*)</script>', page.html)
    facts = facts_of(page)
    return facts, decode_arrays(facts["arrays"], zlib.decompress(base64.b64decode(payload)))


def drawn_corners(mesh, facts, arrays):
    """Return positions of the corners of triangles, (T, 3, 3), in the unit of the mesh."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return (low + (high - low) * arrays["positions"] / 65535)[arrays["triangles"]]


@pytest.fixture(scope="module")
def bear_levels(bear):
    return hierarchy(bear, [60, 20, 5])


@pytest.mark.parametrize("make", [lambda mesh: mesh, soup], ids=["mesh", "soup"])
def test_positions_come_back_to_half_a_step(bear, make):
    mesh = make(bear)
    facts, arrays = contents(sf.view(mesh))
    error = np.abs(drawn_corners(mesh, facts, arrays) - mesh.vertices[mesh.faces])
    assert (error <= np.ptp(mesh.vertices, axis=0) / 65535 * 0.5001).all()
    assert arrays["positions"].shape == (bear.n_vertices, 3)  # vertices at one position are merged
    box = np.array(facts["step"]) * 65535
    assert np.linalg.norm(box) == pytest.approx(1)
    np.testing.assert_allclose(facts["low"], -box / 2)


def test_labels_counts_sizes_and_colors_of_all_levels_come_back(bear, bear_levels):
    facts, arrays = contents(sf.view(bear, bear_levels))  # with smooth borders
    labels = bear_levels.levels[0]
    np.testing.assert_array_equal(arrays["level_0_labels"], sf.cut_borders(bear, labels).labels)
    areas = sf.build_face_graph(bear).measures
    for i, expected in enumerate(bear_levels.levels):
        found = labels if i == 0 else arrays[f"level_{i}_parents"][labels]
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(arrays[f"level_{i}_counts"], np.bincount(expected))
        sizes = np.bincount(expected, areas)
        np.testing.assert_allclose(arrays[f"level_{i}_sizes"], sizes, rtol=1e-6)
        colors = arrays[f"level_{i}_colors"].reshape(-1, 3)
        np.testing.assert_array_equal(colors[expected], face_colors(bear, expected))
    assert [level["ids"] for level in facts["levels"]] == [None] * 3


def test_parts_of_cut_faces_have_the_ground_truth_and_the_values_of_their_faces(bear, bear_levels):
    numbers = np.arange(bear.n_faces)
    page = sf.view(bear, bear_levels, ground_truth=numbers % 7, features={"number": numbers})
    facts, arrays = contents(page)
    cut = sf.cut_borders(bear, bear_levels.levels[0])
    drawn = drawn_corners(bear, facts, arrays)
    np.testing.assert_allclose(drawn, cut.mesh.vertices[cut.mesh.faces], atol=1e-4)
    np.testing.assert_array_equal(arrays["truth_labels"], cut.sources % 7)
    np.testing.assert_array_equal(arrays["feature_0"], np.rint(cut.sources / numbers[-1] * 65534))
    assert facts["n_cells"] == cut.mesh.n_faces > bear.n_faces
    assert facts_of(sf.segment(bear, 20).view())["n_cells"] > bear.n_faces  # smooth by default


def test_levels_that_are_not_nested_are_all_there(bear):
    levels = [np.arange(bear.n_faces) % 3, np.arange(bear.n_faces) % 2]
    for given in (levels, np.stack(levels)):
        _, arrays = contents(sf.view(bear, given))
        for i, expected in enumerate(levels):
            np.testing.assert_array_equal(arrays[f"level_{i}_labels"], expected)


def test_cells_left_out_are_in_no_region_on_any_level():
    fine, coarse = [0, -1, 1, 1, 2, 2], [0, -1, 0, 0, 1, 1]
    facts, arrays = contents(sf.view(strip(6), [fine, coarse], ground_truth=[-1] * 6))
    assert arrays["level_0_labels"].tolist() == [0, NO_GROUP, 1, 1, 2, 2]
    assert arrays["level_1_parents"].tolist() == [0, 0, 1]
    assert arrays["level_0_counts"].tolist() == [1, 2, 2]
    assert [level["n_left_out"] for level in facts["levels"]] == [1, 1]
    assert set(arrays["truth_labels"].tolist()) == {NO_GROUP}
    # A face is left out on only one level, which parents cannot encode.
    _, arrays = contents(sf.view(strip(6), [[0, 0, 1, 1, 2, 2], coarse]))
    assert arrays["level_1_labels"].tolist() == [0, NO_GROUP, 0, 0, 1, 1]


@pytest.mark.parametrize("high", [5, 10**9])
def test_labels_may_be_any_numbers(high):
    facts, arrays = contents(sf.view(strip(4), [high, -1, 3, high]))
    assert facts["levels"][0]["ids"] == [3, high]
    assert arrays["level_0_labels"].tolist() == [1, NO_GROUP, 0, 1]
    facts, arrays = contents(sf.view(strip(4), [-7, -1, -7, 0]))
    assert facts["levels"][0]["ids"] == [-7, 0]
    assert arrays["level_0_labels"].tolist() == [0, NO_GROUP, 0, 1]


def test_edges_are_those_between_regions_of_any_labeling():
    """Faces 1 and 2 differ in the labels, 2 and 3 in the ground truth."""
    _, arrays = contents(sf.view(strip(4), [0, 0, 1, 1], ground_truth=[4, 4, 4, 6]))
    points = arrays["positions"].tolist()
    edges = arrays["edges"].tolist()
    found = {(one, other): sorted([points[a], points[b]]) for a, b, one, other in edges}
    middle, end = 32768, 65535
    assert found == {
        (1, 2): [[middle, 0, 0], [middle, end, 0]],
        (2, 3): [[middle, end, 0], [end, 0, 0]],
    }


def test_polygons_are_cut_into_triangles_that_know_their_polygon():
    quads = PolygonMesh.of_faces(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0], [3, 0.5, 0]],
        [[0, 1, 4, 3], [1, 2, 5, 4], [2, 6, 5]],
    )
    facts, arrays = contents(sf.view(quads, [0, 1, 1]))
    assert arrays["sources"].tolist() == [0, 0, 1, 1, 2]
    assert arrays["level_0_labels"].tolist() == [0, 1, 1]
    assert arrays["level_0_sizes"].tolist() == [1, 1.5]
    assert arrays["edges"][:, 2:].tolist() == [[0, 1]]
    assert (facts["noun"], facts["measure"]) == ("face", "area")


def test_tetrahedra_are_seen_from_outside():
    """Two tetrahedra share a side, so six of the eight sides are outside."""
    facts, arrays = contents(sf.view(two_tets(), [0, 1]))
    assert arrays["sources"].tolist() == [0, 0, 0, 1, 1, 1]
    assert len(arrays["triangles"]) == 6
    assert arrays["level_0_sizes"] == pytest.approx([1 / 6, 1 / 3])
    assert arrays["edges"].shape == (3, 4)  # around the side that they share
    assert set(arrays["edges"][:, 2:].ravel().tolist()) == {0, 1}
    assert (facts["noun"], facts["measure"]) == ("tet", "volume")


def test_points_have_normals_and_no_borders():
    sheet = bumpy_sheet(12)
    cloud = PointCloud(sheet.vertices)
    labels = np.arange(cloud.n_points) % 2
    facts, arrays = contents(sf.view(cloud, labels))
    assert 0 < facts["point_size"] < 0.3
    assert {"triangles", "edges", "sources"}.isdisjoint(arrays)
    extent = np.ptp(cloud.points, axis=0)
    found = cloud.points.min(axis=0) + extent * arrays["positions"] / 65535
    assert (np.abs(found - cloud.points) <= extent / 65535 * 0.5001).all()
    x, y = arrays["normals"] & 255, arrays["normals"] >> 8
    x, y = x / 127 - 1, y / 127 - 1
    z = 1 - np.abs(x) - np.abs(y)
    assert (np.abs(z) > 0.3).all()  # a sheet over the plane z = 0
    np.testing.assert_array_equal(arrays["level_0_labels"], labels)


def test_values_come_back_to_half_a_step_of_their_range(bear):
    heights = bear.vertices[bear.faces, 1].mean(axis=1)
    heights[:3] = np.nan
    labels = np.arange(bear.n_faces) % 4
    page = sf.view(bear, labels, features={"height": heights, "k": [3, 1, 2, np.nan]})
    facts, arrays = contents(page)
    first, second = facts["features"]
    assert (first["of"], first["n_missing"]) == ("cell", 3)
    steps = arrays["feature_0"].astype(float)
    assert (steps[:3] == 65535).all()
    found = first["low"] + (first["high"] - first["low"]) * steps[3:] / 65534
    np.testing.assert_allclose(found, heights[3:], atol=(first["high"] - first["low"]) / 130_000)
    assert (second["of"], second["low"], second["high"]) == ("region", 1, 3)
    assert arrays["feature_1"].tolist() == [65534, 0, 32767, 65535]
    np.testing.assert_array_equal(arrays["scale"], scale_colors().ravel())


def test_values_of_vertices_are_averaged_over_the_corners_of_faces():
    facts, arrays = contents(sf.view(strip(2), features={"a": [0, 3, 6, 30]}))
    of_faces = strip(2).faces
    assert [facts["features"][0][key] for key in ("of", "low", "high")] == [
        "cell", *sorted(np.array([0, 3, 6, 30])[of_faces].mean(axis=1)),
    ]  # fmt: skip
    assert sorted(arrays["feature_0"].tolist()) == [0, 65534]


@pytest.mark.parametrize(("values", "steps"), [([2, 2], [32767] * 2), ([np.nan] * 2, [65535] * 2)])
def test_values_that_are_all_one_or_none_do_no_harm(values, steps):
    _, arrays = contents(sf.view(strip(2), features={"a": values}))
    assert arrays["feature_0"].tolist() == steps


def test_lightness_of_the_scale_rises_evenly():
    lightness = oklab(scale_colors())[:, 0]
    assert np.diff(lightness[::5]).min() > 0  # within rounding to 8 bits
    np.testing.assert_allclose(lightness, np.linspace(0.4, 0.94, 256), atol=0.02)


def test_titles_and_names_cannot_become_elements():
    page = sf.view(strip(2), [0, 1], title=EVIL, features={EVIL: [0, 1]})
    plain = sf.view(strip(2), [0, 1], features={"a": [0, 1]})
    assert "<script>alert" not in page.html
    assert all(page.html.count(end) == plain.html.count(end) for end in ("<script", "</script>"))
    assert f"<title>{html.escape(EVIL)}</title>" in page.html
    assert facts_of(page)["features"][0]["name"] == EVIL
    assert "@SCRIPT@" in sf.view(strip(2), title="@SCRIPT@").html  # not replaced in the title


def test_a_page_loads_nothing():
    page = sf.view(strip(2), [0, 1]).html
    assert "default-src 'none'" in page
    assert not re.search(r"https?:|src=|@import|url\(|fetch\(", page)


def test_a_notebook_shows_the_page_in_a_frame_of_its_own():
    page = sf.view(strip(2), [0, 1], title=EVIL)
    (inner,) = re.findall(r'srcdoc="([^"]*)"></iframe>$', page._repr_html_())
    assert html.unescape(inner) == page.html
    assert 'sandbox="allow-scripts"' in page._repr_html_()


def test_a_page_is_saved_whole(tmp_path):
    page = sf.view(strip(2))
    assert page.save(tmp_path / "a.html") == tmp_path / "a.html"
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == page.html
    message = r"the name of a page must end in \.html or \.htm, got 'a\.txt'$"
    with pytest.raises(ValueError, match=message):
        page.save(tmp_path / "a.txt")
    with pytest.raises(OSError, match="nowhere"):
        page.save(tmp_path / "nowhere" / "a.html")
    assert [path.name for path in tmp_path.iterdir()] == ["a.html"]
    assert repr(Page("much" * 300_000, "y")) == (
        "Page(1.2 MB of HTML: shown by a notebook, or written by .save(path) to a .html file)"
    )


def test_the_first_view_is_that_of_pictures():
    page = sf.view(cube(), camera=View(azimuth=10, elevation=-20, up="z", zoom=2))
    assert (page.up, sf.view(cube()).up) == ("z", "y")
    facts = facts_of(page)
    assert facts["view"] == {"azimuth": 10, "elevation": -20, "zoom": 2}
    assert facts["axes"] == [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # right, up, toward the viewer


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"labels": [0]}, ValueError, r"labels must have one value per cell \(2\), got 1 value"),
    ({"labels": [[0, 1], [0]]}, ValueError, r"labels must have one value per cell \(2\), got 1"),
    ({"labels": [0.5, 1]}, TypeError, "labels must contain integers, got float64"),
    ({"ground_truth": [0, 1, 2]}, ValueError, r"must have one value per cell \(2\), got 3 values"),
    ({"features": {"a": [1, 2, 3]}}, ValueError,
     r"feature 'a' must have one value per cell, \(2,\), or one value per vertex, \(4,\);"
     r" got shape \(3,\)"),
    ({"labels": [0, 0], "features": {"a": []}}, ValueError,
     r"feature 'a' must have one value per cell, \(2,\), or one value per region, \(1,\), or"
     r" one value per vertex, \(4,\); got shape \(0,\)"),
    ({"features": {"a": ["x", "y"]}}, TypeError, "feature 'a' must be numbers"),
    ({"features": {"a": [0, np.inf]}}, ValueError, "feature 'a' has infinite values"),
    ({"labels": np.ma.array([0, 1, 1, 1], mask=[1, 0, 0, 0])}, ValueError, "masked entries"),
    ({"labels": np.ma.array([0, 1], mask=[1, 0])}, ValueError,
     "labels must not have masked entries: fill or remove these entries"),
    ({"features": {"a": np.ma.array([0, 1], mask=[1, 0])}}, ValueError,
     "feature 'a' must not have masked entries: fill or remove these entries"),
    ({"camera": "front"}, TypeError, "camera must be a superfacets.View, got 'front'"),
])  # fmt: skip
def test_wrong_arguments_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        sf.view(strip(2), **arguments)


@pytest.mark.parametrize("coding", ["plain", "planes", "difference", "newest"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "uint32", "int32", "float32"])
@pytest.mark.parametrize("shape", [(7,), (7, 3), (0, 3)])
def test_arrays_come_back_from_a_block_of_bytes(shape, dtype, coding):
    if coding == "newest":
        dtype, values = "uint32", np.arange(np.prod(shape)) % 5
    elif dtype == "float32":
        coding = "plain" if coding == "difference" else coding
        values = np.arange(np.prod(shape)) / 3
    else:
        values = np.arange(np.prod(shape)) * 0x1234567 % np.iinfo(dtype).max
    arrays = Arrays()
    arrays.add("first", np.array([1, 2, 3], np.uint8), "plain")
    arrays.add("second", values.astype(dtype).reshape(shape), coding)
    found = decode_arrays(arrays.entries, arrays.data)
    assert found["first"].tolist() == [1, 2, 3]
    assert found["second"].dtype == dtype
    np.testing.assert_array_equal(found["second"], values.astype(dtype).reshape(shape))


def test_numbers_are_coded_by_the_newest():
    codes = newest_codes(np.array([0, 1, 2, 2, 1, 3, 0], np.uint32))
    assert codes.tolist() == [0, 0, 0, 1, 2, 0, 4]


@pytest.mark.parametrize(
    "vertices", [[[0, 1, 1], [1, 1, 1], [2, 1, 1]], [[1e9, 0, 0], [1e9 + 1, 0, 0], [1e9, 1, 0]]]
)
def test_meshes_without_area_or_far_away_are_shown(vertices):
    mesh = Mesh(vertices, [[0, 1, 2]])
    facts, arrays = contents(sf.view(mesh, [0]))
    assert np.isfinite([*facts["low"], *facts["step"]]).all()
    np.testing.assert_allclose(drawn_corners(mesh, facts, arrays)[0], mesh.vertices, atol=2e-5)


def test_what_stands_on_z_has_z_up_as_in_pictures():
    mesh = table()
    rng = np.random.default_rng(0)
    areas = sf.build_face_graph(mesh).measures
    faces = rng.choice(mesh.n_faces, 3_000, p=areas / areas.sum())
    shares = rng.dirichlet([1, 1, 1], 3_000)
    cloud = PointCloud(np.einsum("ij,ijk->ik", shares, mesh.vertices[mesh.faces[faces]]))
    for source in (mesh, cloud):
        assert facts_of(sf.view(source))["axes"][1] == [0, 0, 1]


def test_the_package_is_the_function_however_it_is_imported():
    from superfacets_show import colors  # noqa: F401

    assert isinstance(sf.view(strip(2)), Page)


def test_the_bunny_has_less_than_a_megabyte(data_dir):
    bunny = sf.read_mesh(data_dir / "meshes" / "bunny.ply")
    labels = sf.segment(bunny, n_segments=150).labels
    start = time.process_time()
    page = sf.view(bunny, labels)
    assert time.process_time() - start < 1.0  # usually a fifth of this
    assert len(page.html) < 1_000_000
