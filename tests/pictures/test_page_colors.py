"""Colors of vertices, points and cells on pages, beside the colors of regions."""

import base64
import re
import zlib

import numpy as np
import pytest
from shapes import bumpy_sheet, cube, soup, strip, two_tets
from test_page import contents, facts_of
from test_page_browser import cells_seen, check_tinted, hue_at, opened, pixels
from textured_meshes import facade, grid

import superfacets as sf
from superfacets import Mesh, MeshAttributes, PointCloud, PolygonMesh, View

__all__ = ["opened"]  # a fixture

UPRIGHT = View(azimuth=0, elevation=0, up="z")
NAMES = ("red", "green", "blue")


def random_colors(n, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (n, 3)).astype(np.uint8)


def channels(colors):
    """Return colors as properties of a file."""
    return dict(zip(NAMES, colors.T, strict=True))


def payload_of(page):
    """Return all arrays of a page, as one block of bytes."""
    (text,) = re.findall(r'id="payload">(.*?)</script>', page.html)
    return zlib.decompress(base64.b64decode(text))


def quads(n=6):
    """Return the sheet of `grid` as squares, with an unused first vertex."""
    mesh, _ = grid(n, n, 1, 1)
    corners = mesh.faces.reshape(-1, 2, 3)
    squares = np.concatenate([corners[:, 0], corners[:, 1, 2:]], axis=1) + 1
    return PolygonMesh.of_faces(np.concatenate([[[0.4, 0, 0.6]], mesh.vertices]), squares)


@pytest.mark.parametrize(
    "make", [lambda: bumpy_sheet(6), quads, two_tets], ids=["mesh", "quads", "tets"]
)
def test_colors_of_vertices_come_back_at_the_positions_of_the_vertices(make):
    mesh = make()
    colors = random_colors(mesh.n_vertices)
    _, arrays = contents(sf.view(mesh, colors=colors))
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    points = low + (high - low) * arrays["positions"] / 65535
    nearest = np.linalg.norm(points[:, np.newaxis] - mesh.vertices, axis=2).argmin(axis=1)
    np.testing.assert_array_equal(arrays["vertex_colors"], colors[nearest])
    assert "cell_colors" not in arrays


@pytest.mark.parametrize("make", [lambda: strip(6), quads, two_tets], ids=["mesh", "quads", "tets"])
def test_colors_of_cells_come_back(make):
    cells = make()
    colors = random_colors(cells.n_cells)
    _, arrays = contents(sf.view(cells, colors=colors))
    np.testing.assert_array_equal(arrays["cell_colors"], colors)
    assert "vertex_colors" not in arrays


def test_as_many_vertices_as_faces_have_the_colors():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])  # fmt: skip
    colors = random_colors(4)
    _, arrays = contents(sf.view(mesh, colors=colors))
    assert sorted(arrays["vertex_colors"].tolist()) == sorted(colors.tolist())


def test_the_points_of_a_cloud_have_their_colors_unless_others_are_given():
    points = bumpy_sheet(8).vertices
    colors, others = random_colors(len(points)), random_colors(len(points), 1)
    cloud = PointCloud(points, colors=colors)
    _, arrays = contents(sf.view(cloud))
    np.testing.assert_array_equal(arrays["vertex_colors"], colors)
    _, arrays = contents(sf.view(cloud, colors=others / 255))
    np.testing.assert_array_equal(arrays["vertex_colors"], others)
    black = PointCloud(points, colors=np.zeros_like(colors))  # files store black for no color
    assert "vertex_colors" not in contents(sf.view(black))[1]


def test_vertices_at_one_position_are_mixed_unless_each_face_has_a_color():
    """Meshes are a cube whose colored sides have separate vertices, and a sheet with a seam."""
    box = cube()
    of_faces = np.repeat(random_colors(6), 2, axis=0)
    _, arrays = contents(sf.view(soup(box), colors=np.repeat(of_faces, 3, axis=0)))
    np.testing.assert_array_equal(arrays["cell_colors"], of_faces)
    sheet = bumpy_sheet(6)
    faces = sheet.faces.copy()
    faces[0, 0] = sheet.n_vertices
    seam = Mesh(np.concatenate([sheet.vertices, sheet.vertices[sheet.faces[:1, 0]]]), faces)
    x = np.rint(200 * sheet.vertices[:, :1] * (1, 1, 1)).clip(0, 255).astype(np.uint8)
    colors = np.concatenate([x, x[sheet.faces[:1, 0]] + np.uint8(20)])
    _, arrays = contents(sf.view(seam, colors=colors))
    drawn = arrays["vertex_colors"][arrays["triangles"]].astype(int)
    off = np.abs(drawn - colors[seam.faces]).max(axis=2)
    assert off[0, 0] > 0
    assert off.max() <= 20
    assert off[seam.faces != sheet.n_vertices].astype(bool).sum() <= 5  # faces beside the seam


def test_colors_add_three_bytes_per_point_and_nothing_else_to_the_data():
    points = bumpy_sheet(30).vertices
    labels = np.arange(len(points)) % 3
    plain = sf.view(PointCloud(points), labels)
    colored = sf.view(PointCloud(points, colors=random_colors(len(points))), labels)
    facts, expected = facts_of(colored), facts_of(plain)
    added = facts["arrays"].pop()
    assert (added["name"], added["shape"]) == ("vertex_colors", [len(points), 3])
    assert facts == expected
    assert payload_of(colored)[: added["offset"]] == payload_of(plain)
    assert len(colored.html) - len(plain.html) < 4.1 * len(points) + 200


def test_the_data_of_a_page_without_colors_do_not_mention_them():
    for page in (sf.view(strip(2), [0, 1]), sf.view(strip(2))):
        facts, arrays = contents(page)
        assert facts["texture"] is None
        assert "color" not in " ".join(facts)
        assert {"vertex_colors", "cell_colors"}.isdisjoint(arrays)


@pytest.mark.parametrize(("colors", "message"), [
    (np.zeros((3, 3), np.uint8), r"colors must have shape \(2, 3\), got \(3, 3\)"),
    (np.zeros((4, 2), np.uint8), r"colors must have shape \(4, 3\), got \(4, 2\)"),
    (np.full((4, 3), 255.0), r"colors\[0\] must be from 0 to 1, got \[255"),
])  # fmt: skip
def test_wrong_colors_are_refused(colors, message):
    with pytest.raises(sf.MeshError, match=message):
        sf.view(strip(2), colors=colors)


def test_a_path_has_the_colors_of_the_file_and_a_texture_replaces_colors(tmp_path):
    made = facade(tmp_path, edge=1)
    colors = random_colors(made.mesh.n_vertices)
    attributes = MeshAttributes(vertex=channels(colors))
    sf.write_mesh(tmp_path / "a.ply", made.mesh, attributes=attributes)
    _, arrays = contents(sf.view(tmp_path / "a.ply"))
    assert "vertex_colors" in arrays
    _, arrays = contents(sf.view(made.mesh, texture=made.texture, colors=colors))
    assert "atlas" in arrays
    assert {"vertex_colors", "cell_colors"}.isdisjoint(arrays)


@pytest.mark.parametrize("kind", ["mesh", "cloud"])
def test_colors_of_vertices_are_interpolated_and_fill_a_page_without_labels(opened, kind):
    """Red decreases and blue increases linearly from left to right."""
    mesh, pairs = grid(1 if kind == "mesh" else 60, 1 if kind == "mesh" else 60, 1, 1)
    colors = pairs[:, :1] * (-255, 0, 255) + (255, 0, 0)
    if kind == "mesh":
        page = sf.view(mesh, colors=colors / 255, camera=UPRIGHT)
    else:
        page = sf.view(PointCloud(mesh.vertices, colors=colors / 255), camera=UPRIGHT)
    tab = opened(page)
    assert tab.locator("#texture").input_value() == "1"
    picture = pixels(tab)
    for x in (0.1, 0.3, 0.5, 0.8):
        column, row = tab.evaluate(f"""() => {{
            const {{ camera, canvas }} = superfacets.drawing;
            const [left, top] = camera.placeOf([{(x - 0.5) / 2**0.5}, 0, 0.1]);
            return [Math.round(left * canvas.clientWidth), Math.round(top * canvas.clientHeight)];
        }}""")
        np.testing.assert_allclose(hue_at(picture, column, row), [1 - x, 0, x], atol=0.03)


@pytest.mark.parametrize(
    "make", [lambda: grid(12, 12, 1, 1)[0], lambda: quads(12)], ids=["mesh", "quads"]
)
def test_pixels_have_the_colors_of_cells_after_t(opened, make):
    cells = make()
    colors = np.array([[255, 0, 0], [0, 200, 0], [0, 0, 255]], np.uint8)
    own = colors[np.arange(cells.n_cells) // 7 % 3]
    tab = opened(sf.view(cells, np.zeros(cells.n_cells, int), colors=own, camera=UPRIGHT))
    assert tab.locator("#texture").input_value() == "0.5"
    mixed = pixels(tab)
    tab.locator("#canvas").press("t")
    found, picture = cells_seen(tab), pixels(tab)
    assert len(found) > 150
    shares = [own[cell] / own[cell].sum() for _, _, cell in found]
    off = [
        np.abs(hue_at(picture, x, y) - s).max() for (x, y, _), s in zip(found, shares, strict=True)
    ]
    assert np.mean(np.array(off) < 0.05) > 0.9  # the others are at borders of cells
    assert len({cell // 7 % 3 for _, _, cell in found}) == 3
    tab.locator("#canvas").press("t")
    assert tab.locator("#texture").input_value() == "0"
    x, y, _ = found[0]
    plain = pixels(tab)[y, x, :3]
    check_tinted(mixed[y, x, :3], plain, picture[y, x, :3])


def test_features_are_not_hidden_by_colors_at_first(opened):
    mesh, _ = grid(4, 4, 1, 1)
    features = {"height": np.arange(mesh.n_faces)}
    tab = opened(sf.view(mesh, features=features, colors=random_colors(mesh.n_faces)))
    assert tab.locator("#texture").input_value() == "0.5"
