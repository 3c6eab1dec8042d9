"""Pictures: framing, shading, borders, complete files, and the error without OpenGL."""

import os
import subprocess
import sys

import numpy as np
import pytest
from shapes import bumpy_sheet, cube, fins, inside_out_cube, moebius, slivers, soup, strip, table
from tools.sample_bear import parts_of

from superfacets import Mesh, MissingExtraError, PointCloud, PolygonMesh, TetMesh, plot, segment
from superfacets_show import drawing
from superfacets_show.backend import RenderError
from superfacets_show.colors import face_colors
from superfacets_show.rendering import View
from superfacets_show.scene import build_scene, hexagons_of

SIZE = (160, 120)
FRONT = View(azimuth=0, elevation=0, up="y")


def square():
    """Return the unit square, which faces +z, cut along the diagonal from the lower left."""
    return Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def covered(picture, background=(255, 255, 255)):
    """Return the fraction of pixels that are not background."""
    return (np.abs(picture.astype(int) - background).max(axis=2) > 8).mean()


def dark(picture):
    """Return which pixels are as dark as border lines."""
    return picture.max(axis=2) < 70


def difference(one, other):
    """Return the mean absolute difference per channel, 0 to 255."""
    return np.abs(one.astype(int) - other.astype(int)).mean()


def test_a_picture_has_the_size_asked_for(gl):
    for size in [(160, 120), (51, 103), (1, 1)]:
        picture = plot(square(), size=size).image
        assert picture.shape == (size[1], size[0], 3)
        assert picture.dtype == np.uint8


@pytest.mark.parametrize("side", [1.0, 1e-14, 1e14])
def test_a_square_fills_the_height_but_for_the_margin(gl, side):
    mesh = Mesh(square().vertices * side, square().faces)
    picture = plot(mesh, size=SIZE, view=FRONT).image
    rows = np.flatnonzero((picture < 250).any(axis=(1, 2)))
    columns = np.flatnonzero((picture < 250).any(axis=(0, 2)))
    margin = 0.015 * 120
    assert rows[[0, -1]] == pytest.approx([margin, 119 - margin], abs=1.5)
    assert columns[[0, -1]] == pytest.approx([20 + margin, 139 - margin], abs=1.5)


@pytest.mark.parametrize("elevation", [-90, 0, 45, 90])
@pytest.mark.parametrize("azimuth", [0, 100])
def test_the_whole_mesh_touches_the_frame_but_never_leaves_it(gl, bear, azimuth, elevation):
    picture = plot(bear, size=SIZE, view=View(azimuth=azimuth, elevation=elevation, up="y")).image
    shown = (picture < 250).any(axis=2)
    assert not shown[[0, -1]].any()
    assert not shown[:, [0, -1]].any()
    for axis, side in enumerate(SIZE[::-1]):
        first, last = np.flatnonzero(shown.any(axis=1 - axis))[[0, -1]]
        assert first == pytest.approx(side - 1 - last, abs=2.5)  # in the middle
    rows, columns = shown.any(axis=1).sum() / 120, shown.any(axis=0).sum() / 160
    assert max(rows, columns) > 0.94


def test_zoom_magnifies_about_the_middle(gl):
    wide, near = (
        plot(square(), size=SIZE, view=View(azimuth=0, elevation=0, up="y", zoom=zoom)).image
        for zoom in (0.4, 0.8)
    )
    assert covered(near) == pytest.approx(4 * covered(wide), rel=0.05)
    shown = np.argwhere((wide < 250).any(axis=2))
    np.testing.assert_allclose(shown.mean(axis=0), [59.5, 79.5], atol=1)


def test_azimuth_walks_to_the_right_and_elevation_upward(gl):
    """The front of a box is red, its right side blue, its top green."""
    colors = np.full((12, 3), 128, dtype=np.uint8)
    colors[2:4], colors[10:12], colors[6:8] = [255, 0, 0], [0, 0, 255], [0, 255, 0]

    def shares(azimuth, elevation):
        view = View(azimuth=azimuth, elevation=elevation, up="y")
        picture = plot(cube(), colors=colors, size=SIZE, view=view, border_width=0).image.astype(
            int
        )
        return [
            (picture[..., c] - np.delete(picture, c, axis=2).max(axis=2) > 40) for c in range(3)
        ]

    red, green, blue = shares(20, 20)
    assert red.sum() > 1.5 * blue.sum() > 0
    assert np.argwhere(red)[:, 1].mean() < np.argwhere(blue)[:, 1].mean()
    assert np.argwhere(green)[:, 0].max() < np.argwhere(red)[:, 0].mean()
    red, green, blue = shares(70, 45)
    assert blue.sum() > 1.5 * red.sum() > 0
    assert green.sum() > 1.5 * red.sum()
    assert not shares(20, -20)[1].any()


@pytest.mark.parametrize("up", ["x", "z"])
def test_any_axis_may_point_up(gl, bear, up):
    """Turning the mesh and the up axis together gives the same picture."""
    x, y, z = bear.vertices.T
    turned = {"x": np.stack([y, -x, z], axis=1), "z": np.stack([x, -z, y], axis=1)}[up]
    upright = plot(bear, size=SIZE, view=View(up="y")).image
    assert difference(plot((turned, bear.faces), size=SIZE, view=View(up=up)).image, upright) < 0.1
    assert difference(plot((turned, bear.faces), size=SIZE, view=View(up="y")).image, upright) > 5


def test_by_default_what_stands_on_z_has_z_up(gl):
    picture = plot(table(), size=SIZE).image
    np.testing.assert_array_equal(picture, plot(table(), size=SIZE, view=View(up="z")).image)
    assert difference(picture, plot(table(), size=SIZE, view=View(up="y")).image) > 5


def test_place_and_scale_do_not_matter(gl, bear):
    moved = Mesh(bear.vertices * 1e-3 + [1e3, -2e3, 5], bear.faces)
    assert difference(plot(moved, size=SIZE).image, plot(bear, size=SIZE).image) < 0.1


def test_the_background_has_its_color(gl):
    picture = plot(square(), size=SIZE, background="#204060").image
    np.testing.assert_array_equal(picture[0, 0], [0x20, 0x40, 0x60])
    np.testing.assert_array_equal(plot(square(), size=SIZE).image[-1, -1], [255, 255, 255])


def test_a_plain_mesh_is_shaded_in_one_color(gl, bear):
    picture = plot(bear, size=SIZE).image.astype(int)
    shown = picture[(picture < 250).any(axis=2)]
    assert shown.mean(axis=1).std() > 8
    assert np.abs(shown[:, 0] - shown[:, 2]).max() < 40


def test_edges_of_a_box_are_sharp(gl):
    """Each side has one brightness, except for soft shadows; smooth shading would round the box."""
    picture = plot(cube(), size=SIZE, view=View(azimuth=45, elevation=0, up="y")).image.astype(int)
    left, right = picture[60, 40:70, 0], picture[60, 90:120, 0]
    assert np.ptp(left) < 4
    assert np.ptp(right) < 4
    assert abs(left.mean() - right.mean()) > 12


def test_creases_between_smooth_parts_are_darker(gl):
    """Two walls that meet in a valley shade each other near it."""
    valley = Mesh(
        [[-1, 0, 1], [-1, 1, 1], [0, 1, 0], [0, 0, 0], [1, 1, 1], [1, 0, 1]],
        [[0, 3, 2], [0, 2, 1], [3, 5, 4], [3, 4, 2]],
    )
    row = plot(valley, size=SIZE, view=FRONT).image[60].astype(int).sum(axis=1)
    assert row[77:83].min() < row[50] - 15
    assert row[77:83].min() < row[110] - 15


def test_regions_are_outlined_in_dark(gl):
    picture = plot(square(), [0, 1], size=SIZE, view=FRONT, border_width=3).image
    assert dark(picture)[59:61, 79:81].all()  # the diagonal, through the middle
    assert dark(picture)[89:91, 49:51].all()
    assert not dark(picture)[30, 50]
    assert not dark(picture)[90, 110]


def changed(one, other):
    """Rows and columns of the pixels that differ."""
    return np.argwhere((one != other).any(axis=2))


def test_the_number_of_a_visible_region_is_written_near_its_center(gl):
    """From the front, only one side of the cube is visible."""
    sides = np.arange(12) // 2
    for names in (np.arange(6), np.arange(6) * 1000 - 7):
        plain, numbered = (
            plot(cube(), names[sides], size=SIZE, view=FRONT, numbers=numbers).image
            for numbers in (False, True)
        )
        pixels = changed(plain, numbered)
        assert (pixels.min(axis=0) + pixels.max(axis=0)) / 2 == pytest.approx([60, 80], abs=2)
        assert np.ptp(pixels[:, 0]) < 20
        text = numbered[tuple(pixels.T)]
        assert text.min() < 50
        assert text.max() > 245  # the outline
    front = np.where(sides == 1, -1, sides)  # now the visible side is in no region
    pictures = [plot(cube(), front, size=SIZE, view=FRONT, numbers=n).image for n in (False, True)]
    np.testing.assert_array_equal(*pictures)


def test_each_region_has_its_own_number(gl):
    """The text on a region is the same if the other region has no label."""
    labels = np.array([42, 7])
    colors = np.full((2, 3), 200, dtype=np.uint8)
    style = {"colors": colors, "size": SIZE, "view": FRONT, "border_width": 0}
    plain, both = (plot(square(), labels, numbers=n, **style).image for n in (False, True))
    n_pixels = 0
    for label in labels:
        alone = plot(square(), np.where(labels == label, label, -1), numbers=True, **style).image
        pixels = tuple(changed(plain, alone).T)
        np.testing.assert_array_equal(both[pixels], alone[pixels])
        n_pixels += len(pixels[0])
    assert n_pixels == len(changed(plain, both)) > 0


def tets():
    return TetMesh([*np.eye(3), [0, 0, 0], [1, 1, 1]], [[3, 0, 1, 2], [4, 2, 1, 0]])


@pytest.mark.parametrize(("cells", "options"), [
    (PolygonMesh.of_faces(square().vertices, [[0, 1, 2, 3]]), {}),
    (square(), {"smooth_borders": True}), (tets(), {}), (tets(), {"clip": "x"}),
    (PointCloud(bumpy_sheet(6).vertices), {}),
])  # fmt: skip
def test_numbers_are_the_labels_that_were_given(gl, cells, options):
    """If the same regions have other labels, pictures differ only in the numbers."""
    labels = np.arange(cells.n_cells) % 2
    options = {"size": SIZE, "view": View(azimuth=40, elevation=40, up="z"), **options}
    plain, ones, more = (
        plot(cells, labels + step, numbers=numbers, **options).image
        for step, numbers in [(0, False), (1, True), (1001, True)]
    )
    assert len(changed(plain, ones)) < len(changed(plain, more))
    assert len(changed(plain, more)) < 0.1 * plain[..., 0].size


def test_numbers_need_labels(gl, tmp_path):
    with pytest.raises(
        ValueError,
        match="numbers shows the label of each region, but no labels are given: give labels too",
    ):
        plot(square(), numbers=True, output=tmp_path / "picture.png")
    with pytest.raises(TypeError, match="numbers must be True or False"):
        plot(square(), [0, 1], numbers="yes")
    assert not list(tmp_path.iterdir())


def test_smooth_borders_are_shorter_lines_and_keep_the_colors_of_regions(gl):
    """A border in steps of 1 along a square of 24, with colors that belong to regions."""
    points = [[x, y, 0] for y in range(25) for x in range(25)]
    corner = [y * 25 + x for y in range(24) for x in range(24)]
    mesh = Mesh(points, [t for v in corner for t in ([v, v + 1, v + 26], [v, v + 26, v + 25])])
    x, y, _ = mesh.vertices[mesh.faces].mean(axis=1).T
    labels = (np.floor(x) + np.floor(y) > 23).astype(int) * 8  # any numbers
    colors = np.where((labels > 0)[:, None], [250, 0, 0], [0, 0, 250]).astype(np.uint8)
    style = {"colors": colors, "view": FRONT, "size": (200, 200), "border_width": 2}
    edges = plot(mesh, labels, **style).image
    smooth = plot(mesh, labels, smooth_borders=True, **style).image
    assert dark(smooth).sum() < 0.85 * dark(edges).sum()
    above, below = smooth[60:90, 140:170], smooth[130:160, 30:60]
    assert difference(above, edges[60:90, 140:170]) == 0
    assert difference(below, edges[130:160, 30:60]) == 0
    found = segment(mesh, 4)
    default = plot(mesh, found, **style).image  # smooth for segmentations
    assert difference(default, plot(mesh, found.labels, smooth_borders=True, **style).image) == 0
    assert difference(default, plot(mesh, found.labels, **style).image) > 0
    with pytest.raises(TypeError, match="smooth_borders must be True or False"):
        plot(mesh, labels, smooth_borders="yes")


def test_walls_seen_from_behind_are_hidden(gl):
    """A room looks the same without its three walls that are nearest to the camera."""
    room = inside_out_cube()
    is_near = (room.vertices[room.faces] == 1).all(axis=1).any(axis=1)
    stage = Mesh(room.vertices, room.faces[~is_near])
    sides, colors = (
        np.arange(12) // 2,
        np.random.default_rng(0).integers(90, 255, (12, 3), np.uint8),
    )
    style = {"size": SIZE, "view": View(azimuth=20, elevation=10, up="y"), "border_width": 0}
    for numbers in (False, True):
        inside, closed = (
            plot(room, sides, colors=colors, numbers=numbers, see_inside=see_inside, **style).image
            for see_inside in (True, False)
        )
        expected = plot(
            stage, sides[~is_near], colors=colors[~is_near], numbers=numbers, **style
        ).image
        assert difference(inside, expected) < 0.1
        assert difference(inside, closed) > 5
    outward = [plot(cube(), see_inside=see_inside, **style).image for see_inside in (True, False)]
    assert difference(*outward) < 0.1
    with pytest.raises(TypeError, match="see_inside must be True or False"):
        plot(room, see_inside="yes")


@pytest.mark.parametrize("smooth", [False, True])
def test_borders_on_walls_seen_from_behind_are_hidden(gl, smooth):
    """One of the walls has two regions or one, and is seen from behind, then from the front."""
    room = inside_out_cube()
    is_front = (room.vertices[room.faces][..., 2] == 1).all(axis=1)
    one, two = is_front.astype(int), np.cumsum(is_front) * is_front
    style = {"colors": np.full((12, 3), 200, np.uint8), "view": FRONT, "smooth_borders": smooth}
    turns = [
        plot(room, labels, see_inside=True, size=SIZE, border_width=3, n_frames=2, **style).frames
        for labels in (one, two)
    ]
    np.testing.assert_array_equal(turns[0][0], turns[1][0])
    assert dark(turns[0][0]).sum() > 100  # the rim of the wall
    assert dark(turns[1][1]).sum() > dark(turns[0][1]).sum() + 100


def test_a_border_is_in_front_if_one_of_its_faces_is():
    for mesh, n_borders in ((cube(), 5), (inside_out_cube(), 17)):  # of 18 edges
        scene = build_scene(mesh, np.arange(12), None)
        assert scene.are_borders_in_front(np.array([0, 0, 3])).sum() == n_borders


def test_points_that_face_away_are_hidden(gl):
    """A red layer of points in front of a green layer. Normals point between the layers."""
    layer = bumpy_sheet(12).vertices * [1, 1, 0.1]
    points = np.concatenate([layer, layer + [0, 0, 1]])
    normals = np.repeat([[0, 0, 1], [0, 0, -1]], len(layer), axis=0)
    colors = np.repeat([[0, 200, 0], [200, 0, 0]], len(layer), axis=0).astype(np.uint8)

    def shares(**given):
        """Return the fractions of red and of green pixels."""
        cloud = PointCloud(points, given.pop("normals", None), viewpoints=given.pop("at", None))
        picture = plot(cloud, colors=colors, size=SIZE, view=FRONT, **given).image.astype(int)
        red, green, _ = np.moveaxis(picture, 2, 0)
        return (red > green + 40).mean(), (green > red + 40).mean()

    assert shares(normals=normals)[0] > 0.3
    for fronts in ({"normals": normals}, {"at": [0.5, 0.5, 0.5]}):
        red, green = shares(see_inside=True, **fronts)
        assert red == 0
        assert green > 0.3
    message = "see_inside needs a cloud with normals or viewpoints, but this cloud has neither"
    with pytest.raises(ValueError, match=f"^{message}$"):
        shares(see_inside=True)


def test_outlines_are_as_wide_as_asked_for(gl):
    shares = [
        dark(plot(square(), [0, 1], size=SIZE, view=FRONT, border_width=width).image).sum()
        for width in (0, 2, 4, 8)
    ]
    assert shares[0] == 0
    length = 116.4 * np.sqrt(2)
    # half a pixel on either side is blended with the surface
    assert shares[2] == pytest.approx(3.5 * length, rel=0.1)
    assert shares[3] == pytest.approx(7.5 * length, rel=0.1)


def test_outlines_keep_their_width_where_the_surface_is_tilted(gl):
    for azimuth in (50, 70):
        view = View(azimuth=azimuth, elevation=0, up="y")
        picture = plot(strip(4), [0, 0, 1, 1], size=SIZE, view=view, border_width=8).image
        assert dark(picture)[20:100].sum(axis=1).min() >= 7


def test_no_line_is_drawn_within_a_region_or_at_its_boundary(gl):
    assert not dark(plot(square(), [0, 0], size=SIZE, view=FRONT, border_width=6).image).any()


def test_soft_shadows_are_drawn_at_a_size_of_their_own():
    sizes = [(1200, 900), (160, 120), (600, 300), (3000, 1500), (5, 960), (1, 1)]
    frames = [drawing._shadow_frame(size) for size in sizes]
    assert frames == [(480, 360), (320, 240), (480, 240), (1200, 600), (3, 480), (2, 2)]


def test_many_regions_do_not_drown_in_outlines(gl):
    """On 450 regions of 8 pixels, lines of two pixels would cover half of the picture."""
    sheet = bumpy_sheet(30)
    quads = np.arange(sheet.n_faces) // 2
    labels = quads // 60 * 15 + quads % 30 // 2
    plain, fine, bold = (
        plot(sheet, labels, size=SIZE, view=FRONT, border_width=width).image
        for width in (0, None, 2)
    )
    assert 0 < plain.mean() - fine.mean() < 0.5 * (plain.mean() - bold.mean())


def test_lines_on_the_far_side_are_hidden(gl, bear):
    behind = bear.vertices[bear.faces].mean(axis=1)[:, 2] < -0.3
    labels = (behind & (np.arange(bear.n_faces) % 2 == 0)).astype(int)
    assert dark(plot(bear, labels, size=SIZE, view=View(azimuth=180, up="y")).image).sum() > 150
    assert dark(plot(bear, labels, size=SIZE, view=FRONT).image).sum() < 8


def test_regions_have_their_colors(gl):
    picture = plot(square(), [0, 1], size=SIZE, view=FRONT, border_width=0).image.astype(int)
    for face, (row, column) in enumerate([(90, 110), (30, 50)]):
        expected = face_colors(square(), [0, 1])[face] / 255
        shown = picture[row, column] / 255
        np.testing.assert_allclose(shown / shown.max(), expected / expected.max(), atol=0.1)


def test_given_colors_are_used_with_and_without_labels(gl):
    red_and_blue = np.array([[200, 0, 0], [0, 0, 200]], dtype=np.uint8)
    for labels in (None, [0, 1]):
        picture = plot(square(), labels, colors=red_and_blue, size=SIZE, view=FRONT).image
        assert picture[90, 110, 0] > 120 > picture[90, 110, 2]
        assert picture[30, 50, 2] > 120 > picture[30, 50, 0]


def test_a_soup_looks_like_the_connected_mesh(gl, bear):
    labels = np.unique(parts_of(bear.vertices, bear.faces), return_inverse=True)[1]
    assert (
        difference(plot(bear, labels, size=SIZE).image, plot(soup(bear), labels, size=SIZE).image)
        < 0.01
    )


def test_unused_vertices_are_not_framed(gl):
    far = Mesh([*square().vertices, [1e9, 0, 0]], square().faces)
    np.testing.assert_array_equal(plot(far, size=SIZE).image, plot(square(), size=SIZE).image)


@pytest.mark.parametrize("make", [fins, moebius, slivers, bumpy_sheet])
def test_any_mesh_can_be_drawn(gl, make):
    mesh = make()
    picture = plot(mesh, np.arange(mesh.n_faces), size=SIZE).image
    assert covered(picture) > 0.01


def test_a_mesh_without_any_area_is_no_error(gl):
    needle = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert plot(needle, [0], size=SIZE).image.shape == (120, 160, 3)


def test_the_same_input_gives_the_same_picture(gl):
    sheet = bumpy_sheet()
    labels = np.arange(sheet.n_faces) // 100
    np.testing.assert_array_equal(
        plot(sheet, labels, size=SIZE).image, plot(sheet, labels, size=SIZE).image
    )


def test_arguments_are_left_as_they_are(gl):
    labels, colors = np.array([0, 1]), np.full((2, 3), 99, dtype=np.uint8)
    for array in (labels, colors):
        array.setflags(write=False)
    mesh = square()
    plot(mesh, labels, colors=colors, size=SIZE)
    np.testing.assert_array_equal(mesh.vertices, square().vertices)
    np.testing.assert_array_equal(mesh.faces, square().faces)


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def read_png(path):
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def test_the_file_holds_the_picture_returned_and_nothing_of_an_older_one(gl, tmp_path):
    path = tmp_path / "picture.PNG"
    path.write_bytes(b"old")
    picture = plot(square(), [0, 1], size=SIZE, output=str(path)).image
    np.testing.assert_array_equal(read_png(path), picture)
    assert names_in(tmp_path) == ["picture.PNG"]


@pytest.mark.parametrize(
    "failing", ["rendering.draw", "rendering.build_scene", "plotting.place_camera"]
)
def test_a_failed_picture_leaves_an_existing_file_as_it_was(gl, tmp_path, broken, failing):
    path = tmp_path / "picture.png"
    path.write_bytes(b"old")
    broken(f"superfacets_show.{failing}", RenderError("no"))
    with pytest.raises(RenderError, match="no"):
        plot(square(), output=path)
    assert path.read_bytes() == b"old"
    assert names_in(tmp_path) == ["picture.png"]


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"labels": [0, 1, 2]}, ValueError,
     r"labels must have one value per cell \(2\), got 3 values"),
    ({"labels": [[0, 1], None]}, ValueError,
     r"^labels must be one-dimensional, got items of different shapes$"),
    ({"labels": [0.5, 1.0]}, TypeError, "labels must contain integers, got float64"),
    ({"colors": [[1, 2, 3]]}, ValueError, r"colors must have shape \(2, 3\), got \(1, 3\)"),
    ({"colors": np.zeros((2, 3))}, TypeError, "colors must be uint8"),
    ({"size": 900}, ValueError, "size must be"),
    ({"size": (9, 9, 9)}, ValueError, "size must be"),
    ({"size": (0, 9)}, ValueError, "size must be at least 1"),
    ({"size": (9, 8193)}, ValueError, "at most 8192"),
    ({"size": (9.5, 9)}, TypeError, "size must be an integer"),
    ({"border_width": -1}, ValueError, "border_width"),
    ({"view": "xy"}, ValueError, "view must be one of front, back, left, .*'xy'"),
    ({"view": 7}, TypeError, "view must be a superfacets.View or the name of a view, got 7"),
    ({"border_width": "thin"}, TypeError, "border_width"),
    ({"background": "no color"}, ValueError, "background must be .*'no color'"),
    ({"background": None, "labels": [0]}, ValueError, "labels|background"),
])  # fmt: skip
def test_wrong_arguments_are_named_and_leave_no_file(gl, tmp_path, arguments, error, message):
    arguments = {"output": tmp_path / "picture.png", **arguments}
    with pytest.raises(error, match=message):
        plot(square(), **arguments)
    assert not names_in(tmp_path)


def test_the_background_stays_clean_beside_soft_shadows(gl):
    """A wall behind a post: the shadow on the wall ends where the wall does."""
    picture = plot(table(), size=SIZE, background="#204060").image
    on_surface = np.abs(picture.astype(int) - [0x20, 0x40, 0x60]).max(axis=2) > 30
    near = on_surface.copy()
    for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
        near |= np.roll(on_surface, shift, axis=axis)
    np.testing.assert_array_equal(np.unique(picture[~near], axis=0), [[0x20, 0x40, 0x60]])


def test_isolated_points_are_not_large_discs():
    areas = np.append(np.linspace(1, 2, 99), 1e4)
    corners = hexagons_of(np.zeros((100, 3)), np.tile([0.0, 0.0, 1.0], (100, 1)), areas)
    radii = np.linalg.norm(corners[::6], axis=1)
    assert radii[:99] / radii[0] == pytest.approx(np.sqrt(areas[:99]))
    assert 1 < radii[99] / radii[98] < 2.1


def test_points_have_no_inside_to_clip():
    with pytest.raises(ValueError, match="it is only for tetrahedra, and points have no interior"):
        plot(PointCloud(np.eye(3)), clip="x")


def test_cells_in_no_region_are_gray(gl):
    picture = plot(square(), [0, -1], size=SIZE, view=FRONT, border_width=0).image.astype(int)
    assert np.ptp(picture[30, 50]) < 4
    assert np.ptp(picture[90, 110]) > 30


def test_a_path_that_cannot_hold_a_picture_is_refused_before_it_is_made(tmp_path):
    with pytest.raises(FileNotFoundError, match="does not exist"):
        plot(square(), output=tmp_path / "nowhere" / "picture.png")


@pytest.mark.parametrize(("members", "error", "message"), [
    ({"azimuth": float("nan")}, ValueError, "azimuth must be finite"),
    ({"elevation": 91}, ValueError, "elevation must be -90 to 90"),
    ({"elevation": float("nan")}, ValueError, "elevation must be -90 to 90"),
    ({"up": "w"}, ValueError, "up must be one of auto, x, y, z"),
    ({"zoom": 0}, ValueError, "zoom must be finite and positive"),
    ({"zoom": "big"}, TypeError, "zoom must be a number"),
])  # fmt: skip
def test_wrong_views_are_refused(members, error, message):
    with pytest.raises(error, match=message):
        View(**members)


@pytest.mark.parametrize("missing", ["vtkmodules", "PIL.ImageColor"])
def test_without_vtk_or_pillow_the_extra_is_named(gl, monkeypatch, missing):
    for name in [missing, *(name for name in sys.modules if name.startswith(missing + "."))]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingExtraError, match=r"rendering needs .*superfacets\[viz\]"):
        plot(square())


def test_a_vtk_that_cannot_be_loaded_is_no_missing_extra(monkeypatch, tmp_path):
    (tmp_path / "vtkmodules").mkdir()
    (tmp_path / "vtkmodules" / "__init__.py").write_text('raise ImportError("libXYZ.so.1: none")')
    monkeypatch.syspath_prepend(tmp_path)
    for name in [name for name in sys.modules if name.split(".")[0] == "vtkmodules"]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.raises(RenderError, match=r"cannot be loaded: libXYZ.so.1"):
        plot(square())


def test_a_driver_that_makes_too_few_pixels_is_an_error_and_no_file(gl, monkeypatch, tmp_path):
    vtk = drawing.import_vtk()
    vtk.vtk_to_numpy = lambda _: np.zeros(12, dtype=np.uint8)
    monkeypatch.setattr(drawing, "import_vtk", lambda: vtk)
    with pytest.raises(RenderError, match=r"VTK returned 12 values instead of 1152$"):
        plot(square(), size=(16, 6), output=tmp_path / "picture.png")
    assert not names_in(tmp_path)


def test_a_picture_without_opengl_is_an_error_and_no_file(gl, broken, no_display, tmp_path):
    broken("ctypes.CDLL", OSError("no such library"))
    with pytest.raises(RenderError, match="apt install"):
        plot(square(), output=tmp_path / "picture.png")
    assert not names_in(tmp_path)


def test_warnings_of_vtk_are_off_while_drawing_only(gl, monkeypatch):
    from vtkmodules.vtkCommonCore import vtkObject

    seen = []
    aim = drawing._aim
    monkeypatch.setattr(
        drawing, "_aim", lambda *a: seen.append(vtkObject.GetGlobalWarningDisplay()) or aim(*a)
    )
    for state in (1, 0, 1):
        vtkObject.SetGlobalWarningDisplay(state)
        plot(square(), size=(8, 6))
        assert vtkObject.GetGlobalWarningDisplay() == state
    assert seen == [0, 0, 0]


DRAW_IN_NEW_PROCESS = """
import os, sys
from superfacets import plot
before = dict(os.environ)
try:
    plot(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]), [0], size=(32, 24))
finally:
    assert dict(os.environ) == before
assert "pyvista" not in sys.modules  # takes longer than the picture
"""


def run_python(code, **environment):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False,
        env={**os.environ, **environment},
    )  # fmt: skip


def test_drawing_prints_nothing_and_leaves_the_environment_as_it_was(gl):
    done = run_python(DRAW_IN_NEW_PROCESS)
    assert (done.stdout, done.stderr, done.returncode) == ("", "", 0)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux may lack OpenGL")
def test_a_machine_without_drivers_gets_an_error_and_no_crash(gl):
    """EGL is requested, but its vendor libraries are hidden."""
    done = run_python(
        DRAW_IN_NEW_PROCESS,
        VTK_DEFAULT_OPENGL_WINDOW="vtkEGLRenderWindow",
        __EGL_VENDOR_LIBRARY_FILENAMES="/none",
    )
    assert done.returncode == 1
    assert done.stderr.rstrip().splitlines()[-1].endswith("(or libosmesa6)")
