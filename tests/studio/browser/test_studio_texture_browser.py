"""The studio draws textures, blends them with regions, and gives the reason if it cannot."""

import numpy as np
import pytest
from studio_page import hue
from textured_meshes import grid, save_png

import superfacets as sf
from superfacets import MeshAttributes, Texture
from superfacets_textures import Material, TextureImage

COLORS = ["#ff0000", "#00c800", "#0000ff", "#c8c800"]


def write_wall(folder):
    """Write a wall with an image of four quarters."""
    quarters = np.array([[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in COLORS])
    pixels = np.kron(quarters.reshape(2, 2, 3), np.ones((64, 64, 1))).astype(np.uint8)
    save_png(folder / "quarters.png", pixels)
    mesh, pairs = grid(20, 20, 1, 1)
    image = TextureImage("quarters.png", folder / "quarters.png")
    texture = Texture(pairs, mesh.faces.ravel(), [Material(image=image)], [0] * mesh.n_faces)
    sf.write_mesh(folder / "wall.obj", mesh, attributes=MeshAttributes(texture=texture))
    return folder / "wall.obj"


def test_pixels_have_the_colors_of_the_texture_after_t(serve, open_tab, tmp_path):
    tab = open_tab(serve(write_wall(tmp_path), 16).address)
    tab.until("studio.workbench.drawing.ownColors.isShown")
    assert tab.locator("#texture").input_value() == "0.5"
    tab.locator("#borders").uncheck()
    tab.evaluate("document.activeElement.blur()")
    tab.away()
    places = tab.evaluate("""[[-0.3, 0.3], [0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]].map(
        ([x, z]) => Object.values(studio.workbench.picker.placeIn([x, 0, z])))""")
    blended = [tab.hue_at(*place) for place in places]
    tab.press("t")
    assert tab.locator("#texture").input_value() == "1"
    tab.settled()
    for place, color in zip(places, COLORS, strict=True):
        np.testing.assert_allclose(tab.hue_at(*place), hue(color), atol=0.05)
    tab.press("t")
    for place, color, mixed in zip(places, COLORS, blended, strict=True):
        plain = tab.hue_at(*place)
        assert np.abs(plain - hue(color)).max() > np.abs(mixed - hue(color)).max() > 0.02


def test_a_missing_image_is_said_and_nothing_else_fails(serve, open_tab, tmp_path):
    path = write_wall(tmp_path)
    (tmp_path / "quarters.png").unlink()
    tab = open_tab(serve(path, 16).address)
    assert "The texture is not shown: the image 'quarters.png' is missing." in tab.evaluate(
        "document.body.textContent"
    )
    assert tab.locator("#texture-row").is_hidden()


def test_a_mesh_without_a_texture_or_colors_has_no_slider(serve, open_tab, bear):
    tab = open_tab(serve(bear, 20).address)
    assert tab.locator("#texture-row").is_hidden()
    tab.press("t", until="This file has no texture or colors.")


@pytest.mark.parametrize("kind", ["mesh", "cloud"])
def test_the_colors_of_vertices_and_points_are_shown_after_t(serve, open_tab, tmp_path, kind):
    mesh, _ = grid(20, 20, 1, 1)
    is_left = mesh.vertices[:, 0] < mesh.vertices[:, 0].mean()
    colors = np.where(is_left[:, np.newaxis], [255, 0, 0], [0, 0, 255]).astype(np.uint8)
    if kind == "mesh":
        names = ("red", "green", "blue")
        of_vertices = MeshAttributes(vertex=dict(zip(names, colors.T, strict=True)))
        sf.write_mesh(tmp_path / "wall.ply", mesh, attributes=of_vertices)
    else:
        sf.write_mesh(tmp_path / "wall.ply", sf.PointCloud(mesh.vertices, colors=colors))
    tab = open_tab(serve(tmp_path / "wall.ply", 16).address)
    assert tab.locator("#texture").input_value() == "0.5"
    tab.locator("#borders").uncheck()
    tab.evaluate("document.activeElement.blur()")
    tab.press("t")
    tab.away()
    corners = mesh.faces if kind == "mesh" else np.arange(mesh.n_vertices)[:, np.newaxis]
    for is_color, color in ((is_left, "#ff0000"), (~is_left, "#0000ff")):
        cell = int(is_color[corners].all(axis=1).argmax())
        place = tab.evaluate("cell => studio.screenOf(cell)", cell)
        expected = hue(color)
        np.testing.assert_allclose(tab.hue_at(place["x"], place["y"]), expected, atol=0.05)
    tab.press("t")
    assert np.abs(tab.hue_at(place["x"], place["y"]) - expected).max() > 0.2
