"""Plots: several labelings, values with a scale, rotations; in files, arrays and notebooks."""

import io
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from shapes import bumpy_sheet, strip

import superfacets as sf
from superfacets_show.annotations import _clearances, _places, _ticks, scale_strip, title_strip
from superfacets_show.colors import NO_COLOR, Scale, checked_values, scale_colors, scale_of

SIZE = (160, 120)
WHITE = (255, 255, 255)
SHEET = bumpy_sheet(6)
LABELS = np.arange(SHEET.n_faces) * 5 // SHEET.n_faces
FRONT = sf.View(azimuth=0, elevation=0, up="z")
TWO = strip(2)
TETS = sf.TetMesh([*np.eye(3), [0, 0, 0], [1, 1, 1]], [[3, 0, 1, 2], [4, 2, 1, 0], [3, 0, 1, 2]])


def read_image(source):
    from PIL import Image

    return Image.open(io.BytesIO(source if isinstance(source, bytes) else source.read_bytes()))


def test_a_plot_of_labels_is_what_render_draws(gl, tmp_path):
    path = tmp_path / "plot.png"
    plotted = sf.plot(SHEET, LABELS, size=SIZE, output=path)
    expected = sf.plot(SHEET, LABELS, size=SIZE).image
    np.testing.assert_array_equal(plotted.image, expected)
    np.testing.assert_array_equal(np.asarray(plotted), expected)
    np.testing.assert_array_equal(np.asarray(read_image(path)), expected)
    np.testing.assert_array_equal(np.asarray(read_image(plotted._repr_png_())), expected)
    assert plotted._repr_html_() is None


def test_a_plot_is_an_array_of_any_type():
    plotted = sf.Plot([np.full((2, 3, 3), 7, np.uint8)], "y")
    assert repr(plotted).startswith("Plot(1 picture of 3 x 2 pixels: shown by a notebook, or ")
    assert np.asarray(plotted, dtype=np.float64).dtype == np.float64
    copied = np.array(plotted)
    copied[:] = 0
    assert (plotted.image == 7).all()


def test_labelings_stand_side_by_side_from_the_same_camera(gl):
    coarse = LABELS // 3
    both = sf.plot(SHEET, LABELS, compare=[coarse], size=SIZE).image
    assert both.shape == (120, 320, 3)
    np.testing.assert_array_equal(both[:, :160], sf.plot(SHEET, LABELS, size=SIZE).image)
    np.testing.assert_array_equal(both[:, 160:], sf.plot(SHEET, coarse, size=SIZE).image)
    nested = sf.hierarchy(SHEET, [3, 2], labels=LABELS)
    both = sf.plot(SHEET, nested.levels[0], compare=nested.levels[1:], size=SIZE).image
    np.testing.assert_array_equal(both, sf.plot(SHEET, nested, size=SIZE).image)
    of_vertices = np.arange(SHEET.n_vertices) // 9
    found = sf.plot(SHEET, sf.face_labels(SHEET, of_vertices), size=SIZE).image
    np.testing.assert_array_equal(sf.plot(SHEET, of_vertices, size=SIZE).image, found)


def test_each_labeling_has_numbers_of_its_own(gl):
    one, other = LABELS, 10 - LABELS // 3
    both = sf.plot(SHEET, one, compare=[other], numbers=True, size=SIZE).image
    for half, labels in [(both[:, :160], one), (both[:, 160:], other)]:
        numbered = sf.plot(SHEET, labels, numbers=True, size=SIZE).image
        np.testing.assert_array_equal(half, numbered)
        assert not np.array_equal(numbered, sf.plot(SHEET, labels, size=SIZE).image)


def test_the_room_of_a_pixel_is_the_distance_to_the_end_of_its_region():
    regions = np.array([[0, 0, 0, 0, 1], [0, 0, 0, 0, 1], [0, 0, 0, 0, 1]])
    assert _clearances(regions).tolist() == [[1, 1, 1, 1, 1], [1, 2, 2, 1, 1], [1, 1, 1, 1, 1]]


def test_numbers_do_not_overlap_and_regions_seen_edge_on_have_none():
    """A large region, a region of two pixel columns, and a ring around a small square."""
    regions = np.full((60, 100), 0)
    regions[:, :2] = 1
    regions[20:40, 60:80], regions[27:33, 67:73] = 2, 3
    counts = np.bincount(regions.ravel())
    [large, ring, *small] = _places(regions, counts, 8, [10, 10, 10, 10])
    assert (large[0], ring[0], len(small)) == (0, 2, 0)  # no room in the square is left
    assert regions[large[1:]] == 0
    assert regions[ring[1:]] == 2
    assert abs(large[1] - ring[1]) > 8 or abs(large[2] - ring[2]) > 10
    ((region, *place),) = _places(
        np.where(regions == 2, -1, regions), counts * [0, 0, 0, 1], 8, [9] * 4
    )
    assert (region, place) == (3, [29, 69])


def test_titles_stand_above_and_take_of_the_height(gl):
    titled = sf.plot(SHEET, LABELS, compare=[LABELS], titles=["one", "two"], size=SIZE).image
    assert titled.shape == (120, 320, 3)
    assert (titled[:8, 60:100] < 200).any()
    assert not np.array_equal(titled[:8, :160], titled[:8, 160:])
    untitled = sf.plot(SHEET, LABELS, compare=[LABELS], size=(160, 112)).image
    np.testing.assert_array_equal(titled[8:], untitled)


def test_long_titles_are_made_to_fit():
    strip_of = title_strip(["a very long title " * 5, ""], 200, 20, WHITE)
    assert strip_of.shape == (20, 400, 3)
    assert (strip_of[:, :200] < 128).any()
    assert (strip_of[:, 200:] == 255).all()


def test_text_on_a_dark_background_is_light():
    assert title_strip(["one"], 100, 20, (0, 0, 0)).max() > 200
    assert scale_strip(Scale(0, 1, "", False), 300, 60, (0, 0, 90)).min() == 0


def test_values_of_cells_and_regions_have_the_colors_of_the_scale(gl):
    settings = {"size": SIZE, "border_width": 0}
    by_region = np.array([3.0, 1.0, np.nan, 2.0, 5.0])
    of_cells = by_region[LABELS]
    one = sf.plot(SHEET, LABELS, color_by=by_region, **settings).image
    np.testing.assert_array_equal(one, sf.plot(SHEET, LABELS, color_by=of_cells, **settings).image)
    np.testing.assert_array_equal(one, sf.plot(SHEET, color_by=of_cells, **settings).image)
    colors = Scale(1, 5, "", True).colors(of_cells)
    np.testing.assert_array_equal(
        one[:106], sf.plot(SHEET, colors=colors, size=(160, 106), border_width=0).image
    )


def test_values_that_fit_several_counts_are_of_cells_then_regions_then_vertices():
    quads = sf.PolygonMesh.of_faces(SHEET.vertices, [[0, 1, 8], [1, 2, 9, 8]])
    values = np.arange(SHEET.n_vertices)
    for cells, corners in ((TWO, TWO.faces), (TETS, TETS.tets), (quads, [[0, 1, 8], [1, 2, 9, 8]])):
        given = values[: cells.n_vertices]
        found, of = checked_values(given, "given", cells, 2)
        assert (found.tolist(), of) == ([np.mean(row) for row in corners], "cell")
    assert checked_values([4, 5, 6, 7], "given", TWO, 4)[1] == "region"
    closed = sf.TetMesh(TETS.vertices, [[3, 0, 1, 2]] * 5)
    found, of = checked_values([5, 6, 7, 8, 9], "given", closed, 5)
    assert (found.tolist(), of) == ([5, 6, 7, 8, 9], "cell")
    found, _ = checked_values([np.nan, 0, 0, 0], "given", TWO, None)
    assert np.isnan(found).tolist() == [0 in face for face in TWO.faces]


def test_a_column_of_the_table_of_regions_is_known_by_name(gl):
    labels = LABELS.copy()
    labels[labels == 2] = -1
    labels *= 2  # numbers with gaps; cells in no region are still the only ones below 0
    labels[labels < 0] = -1
    compact = np.where(labels < 0, -1, np.unique(labels, return_inverse=True)[1] - 1)
    perimeters = sf.region_graph(SHEET, compact.astype(np.int32)).perimeters
    named = sf.plot(SHEET, labels, color_by="perimeters", size=SIZE).image
    given = sf.plot(SHEET, labels, color_by=perimeters, scale_title="perimeter", size=SIZE).image
    np.testing.assert_array_equal(named, given)
    assert (named == NO_COLOR).all(axis=2).any()  # the patch beside the scale


def test_labelings_share_a_scale(gl):
    values = np.linspace(0, 1, SHEET.n_faces)
    both = sf.plot(SHEET, LABELS, compare=[LABELS // 2], color_by=values, size=SIZE).image
    alone = sf.plot(SHEET, LABELS, color_by=values, size=SIZE).image
    np.testing.assert_array_equal(both[:106, :160], alone[:106])
    row = both[112]
    found = np.flatnonzero((row == scale_colors()[0]).all(axis=1))
    assert 80 <= found.min() < 90


@pytest.mark.parametrize("cells", [sf.PointCloud(SHEET.vertices), TETS], ids=["points", "tets"])
def test_points_and_tetrahedra_are_colored_by_value(gl, cells):
    n = cells.n_points if isinstance(cells, sf.PointCloud) else cells.n_tets
    labels = np.arange(n) % 3
    image = sf.plot(cells, labels, color_by=np.arange(n), size=SIZE).image
    assert (image[:100] < 250).any()
    name = "area" if isinstance(cells, sf.PointCloud) else "volume"
    assert sf.plot(cells, labels, color_by=name, size=SIZE).image.shape == (120, 160, 3)


def test_colors_of_values():
    scale = scale_of([np.array([2.0, np.nan]), np.array([4.0, 3.0])], "title")
    assert (scale.low, scale.high, scale.title, scale.has_missing) == (2, 4, "title", True)
    colors = scale.colors(np.array([2.0, 4.0, np.nan]))
    np.testing.assert_array_equal(colors, [*scale_colors()[[0, 255]], NO_COLOR])


@pytest.mark.parametrize(
    "values", [[np.nan] * 3, [2.0] * 3, [-1.7e308, 0, 1.7e308], [0, 5e-324, 0]]
)
def test_odd_values_have_colors_and_a_scale(values):
    values = np.array(values)
    scale = scale_of([values], "")
    assert scale.colors(values).shape == (3, 3)
    assert scale_strip(scale, 300, 40, WHITE).shape == (40, 300, 3)


@pytest.mark.parametrize(("low", "high", "expected"), [
    (0, 1, [0, 0.2, 0.4, 0.6, 0.8, 1]), (0.13, 0.9, [0.2, 0.4, 0.6, 0.8]), (-3, 12, [0, 5, 10]),
    (1e-9, 6e-9, [1e-9, 2e-9, 3e-9, 4e-9, 5e-9, 6e-9]), (5, 5, [5]),
])  # fmt: skip
def test_ticks_are_round_numbers(low, high, expected):
    np.testing.assert_allclose(_ticks(low, high), expected)


def test_a_turn_goes_around_and_shows_itself(gl, tmp_path):
    plotted = sf.plot(SHEET, LABELS, n_frames=4, size=(64, 48))
    assert len(plotted.frames) == 4
    assert not np.array_equal(plotted.frames[0], plotted.frames[1])
    path = plotted.save(tmp_path / "turn.gif")
    image = read_image(path)
    assert (image.n_frames, image.size, image.info["loop"]) == (4, (64, 48), 0)
    assert image.info["duration"] == 1200
    shown = np.asarray(image.convert("RGB")).astype(int)
    assert np.abs(shown - plotted.frames[0]).mean() < 4
    assert plotted._repr_html_().startswith("<img alt=")
    assert plotted._repr_png_() is None


def test_the_ending_asks_for_a_turn(gl, tmp_path, limit):
    limit("frames of a turn", 3)
    limit("size of a turn", (32, 24))
    plotted = sf.plot(SHEET, LABELS, output=tmp_path / "turn.gif")
    assert [frame.shape for frame in plotted.frames] == [(24, 32, 3)] * 3


@pytest.fixture
def ffmpeg(monkeypatch):
    """Install a stand-in for imageio-ffmpeg that writes sizes instead of a video."""
    calls = []

    def write_frames(path, size, **options):
        calls.append((size, options["fps"]))
        sizes = []
        try:
            while True:
                sizes.append((yield).nbytes)
        finally:
            Path(path).write_text(repr(sizes))

    module = types.SimpleNamespace(write_frames=write_frames)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", module)
    return calls


def test_videos_have_sides_of_even_length(tmp_path, ffmpeg):
    frames = [np.full((5, 7, 3), 9, np.uint8)] * 30
    path = sf.Plot(frames, "y").save(tmp_path / "turn.mp4")
    assert ffmpeg == [((8, 6), pytest.approx(6.25))]
    assert path.read_text() == repr([8 * 6 * 3] * 30)


def test_a_video_can_be_played(tmp_path):
    reader = pytest.importorskip("imageio_ffmpeg", reason="imageio-ffmpeg is not installed")
    frames = [np.full((33, 65, 3), shade, np.uint8) for shade in range(0, 250, 10)]
    path = sf.Plot(frames, "y").save(tmp_path / "turn.mp4")
    assert reader.count_frames_and_secs(str(path))[0] == 25


def test_without_the_encoder_a_video_is_refused_before_anything_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(sf.RenderError, match=r"an \.mp4 file needs imageio-ffmpeg: pip install"):
        sf.plot(SHEET, output=tmp_path / "turn.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"output": "a.jpg"}, ValueError, "output must end in .png or .gif or .mp4, got 'a.jpg'"),
    ({"output": "a.gif", "n_frames": 1}, ValueError,
     r"'a\.gif' needs several pictures: n_frames must be > 1, got 1"),
    ({"output": "a.png", "n_frames": 2}, ValueError,
     r"'a\.png' can store only one picture: write a \.gif or \.mp4 file"),
    ({"n_frames": 0}, ValueError, "n_frames must be at least 1"),
    ({"titles": ["a", "b"]}, ValueError,
     r"titles must be a list of one title per labeling \(1\), got \['a', 'b'\]"),
    ({"titles": "a"}, ValueError,
     r"titles must be a list of one title per labeling \(1\), got 'a'"),
    ({"color_by": [1, 2], "colors": [[0] * 3] * 2}, ValueError, "give colors or color_by"),
    ({"color_by": "area"}, ValueError,
     "color_by='area' is the name of a region property: pass labels too"),
    ({"color_by": "curvature", "labels": [0, 1]}, ValueError,
     "color_by must be one of region, cell_count, area"),
    ({"color_by": "curvature"}, ValueError,
     "color_by must be one of region, cell_count, area, .*, high_z, got 'curvature'"),
    ({"color_by": [1, 2, 3]}, ValueError,
     r"color_by must have one value per cell, \(2,\), or one value per vertex, \(4,\); got"
     r" shape \(3,\)"),
    ({"view": "above"}, ValueError, "view must be one of front"),
    ({"compare": [[0, 1, 2]]}, ValueError,
     r"labels must have one value per cell \(2\), got 3 values"),
])  # fmt: skip
def test_wrong_arguments_are_named(gl, tmp_path, monkeypatch, arguments, error, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=message):
        sf.plot(TWO, size=SIZE, **arguments)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("values", "error", "message"), [
    (["a", "b"], TypeError, "given must be numbers, got <U1"),
    ([1, np.inf], ValueError, "given has infinite values: use NaN"),
    ([1, 2, 3], ValueError,
     r"given must have one value per cell, \(2,\), or one value per region, \(5,\), or one"
     r" value per vertex, \(4,\); got shape \(3,\)"),
    (np.ma.array([1, 2], mask=[0, 1]), ValueError, "given"),
])  # fmt: skip
def test_what_is_no_value_per_cell_or_region_is_refused(values, error, message):
    with pytest.raises(error, match=message):
        checked_values(values, "given", TWO, 5)


def test_a_failed_write_leaves_an_existing_file_as_it_was(gl, tmp_path, broken):
    path = tmp_path / "turn.gif"
    path.write_bytes(b"old")
    broken("superfacets_show.plotting.gif_of", OSError(28, "No space left on device"))
    with pytest.raises(OSError, match="No space"):
        sf.Plot([np.zeros((2, 2, 3), np.uint8)] * 2, "y").save(path)
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["turn.gif"]
