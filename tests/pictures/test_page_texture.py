"""Textures on pages: image colors at the right positions, beside the colors of regions."""

import json
import re

import numpy as np
import pytest
from test_page_browser import cells_seen, check_tinted, hue_at, opened, pixels
from textured_meshes import facade, grid, save_png

import superfacets as sf
from superfacets import Texture
from superfacets_textures import Material, TextureImage, texture_colors

__all__ = ["opened"]  # a fixture

QUARTERS = np.array([[[255, 0, 0], [0, 200, 0]], [[0, 0, 255], [200, 200, 0]]], np.uint8)


def wall(folder, wrap=("repeat", "repeat"), scale=1.0, shift=0.0):
    """Return a wall with an image of four colors; its lower right material has no image."""
    mesh, pairs = grid(24, 24, 1, 1)
    save_png(folder / "quarters.png", np.kron(QUARTERS, np.ones((64, 64, 1), np.uint8)))
    image = TextureImage("quarters.png", folder / "quarters.png")
    middles = pairs[mesh.faces].mean(axis=1)
    is_plain = (middles[:, 0] > 0.75) & (middles[:, 1] < 0.25)
    materials = [Material("four", image=image, wrap=wrap), Material("violet", (0.5, 0, 1))]
    moved = pairs * scale + shift
    texture = Texture(moved, mesh.faces.ravel(), materials, is_plain.astype(int))
    found = texture_colors(mesh, texture)
    return mesh, texture, np.where(found.spread[:, np.newaxis] < 0.01, found.srgb, np.nan)


@pytest.mark.parametrize(("wrap", "scale", "shift"), [
    (("repeat", "repeat"), 1, 0), (("repeat", "repeat"), 2, -0.7), (("mirror", "clamp"), 2.5, -0.8),
])  # fmt: skip
def test_each_pixel_has_the_color_of_the_texture_there(opened, tmp_path, wrap, scale, shift):
    mesh, texture, expected = wall(tmp_path, wrap, scale, shift)
    camera = sf.View(azimuth=20, elevation=10, up="z")
    tab = opened(sf.view(mesh, np.zeros(mesh.n_faces, int), texture=texture, camera=camera))
    assert tab.locator("#texture").input_value() == "0.5"
    tab.locator("#canvas").press("t")
    found = [seen for seen in cells_seen(tab) if np.isfinite(expected[seen[2], 0])]
    picture = pixels(tab)
    assert len(found) > 150
    shares = {cell: expected[cell] / expected[cell].sum() for _, _, cell in found}
    off = [np.abs(hue_at(picture, x, y) - shares[cell]).max() for x, y, cell in found]
    assert np.mean(np.array(off) < 0.05) > 0.93  # the others are at edges of colors
    assert len({tuple(expected[cell].round(-1)) for _, _, cell in found}) >= 5
    tab.locator("#canvas").press("t")
    assert tab.locator("#texture").input_value() == "0"
    x, y, _ = found[0]
    plain = pixels(tab)[y, x, :3]
    tab.locator("#texture").fill("0.5")
    tab.locator("#texture").dispatch_event("input")
    check_tinted(pixels(tab)[y, x, :3], plain, picture[y, x, :3])


def test_a_page_without_a_texture_has_no_slider(opened):
    tab = opened(sf.view(sf.sample_mesh(5_000)))
    assert tab.locator("#texture-row").is_hidden()
    tab.locator("#canvas").press("t")


def test_images_are_scaled_to_one_of_the_stated_size(tmp_path):
    made = facade(tmp_path, edge=1)
    save_png(tmp_path / "facade.png", np.zeros((5000, 2500, 3), np.uint8))
    page = sf.view(made.mesh, texture=made.texture)
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', page.html)[1])
    assert facts["texture"]["tiles"][0][:4] == [0, 0, 1024, 2048]
    images = [TextureImage(f"{n}.png", tmp_path / "facade.png") for n in range(3)]
    materials = [Material(image=image) for image in images]
    texture = Texture(
        made.texture.coordinates, made.texture.corners, materials, [0] * made.mesh.n_faces
    )
    page = sf.view(made.mesh, texture=texture)
    facts = json.loads(re.search(r'id="facts">(.*?)</script>', page.html)[1])
    assert [tile[:4] for tile in facts["texture"]["tiles"][:3]] == [
        [0, 0, 512, 1024], [1024, 0, 512, 1024], [0, 1024, 512, 1024],
    ]  # fmt: skip


def test_the_command_shows_textures_and_notes_missing_ones(run_view, tmp_path):
    made = facade(tmp_path, edge=1)
    attributes = sf.MeshAttributes(texture=made.texture)
    sf.write_mesh(tmp_path / "a.obj", made.mesh, attributes=attributes)
    assert "note: no texture" not in run_view(tmp_path / "a.obj", tmp_path / "a.html")
    assert '"tiles"' in (tmp_path / "a.html").read_text()
    (tmp_path / "facade.png").unlink()
    err = run_view(tmp_path / "a.obj", tmp_path / "b.html")
    assert "note: the texture is not shown: the image 'facade.png' is missing" in err
    assert '"texture":null' in (tmp_path / "b.html").read_text()


@pytest.fixture
def run_view(run_main):
    """Run ``superfacets view``, and return its output."""
    from superfacets_cli.main import main

    def run(mesh, page):
        status, _, err = run_main(main, "superfacets", "view", mesh, "--html", page)
        assert status == 0
        return err

    return run


def test_small_pictures_of_fine_patterns_are_their_mean_and_do_not_mix(opened, tmp_path):
    mesh, pairs = grid(24, 24, 1, 1)
    squares = np.indices((500, 500)).sum(axis=0) % 2 * 255
    pictures = [np.repeat(squares[:, :, np.newaxis], 3, axis=2), np.full((90, 50, 3), (255, 0, 0))]
    images = []
    for number, picture in enumerate(pictures):
        save_png(tmp_path / f"{number}.png", picture.astype(np.uint8))
        images.append(TextureImage(f"{number}.png", tmp_path / f"{number}.png"))
    is_red = (pairs[mesh.faces].mean(axis=1)[:, 0] > 0.5).astype(int)
    texture = Texture(40 * pairs, mesh.faces.ravel(), [Material(image=i) for i in images], is_red)
    camera = sf.View(azimuth=20, elevation=10, up="z")
    tab = opened(sf.view(mesh, np.zeros(mesh.n_faces, int), texture=texture, camera=camera))
    tab.locator("#canvas").press("t")
    picture, seen = pixels(tab), cells_seen(tab)
    gray = np.array([picture[y, x, :3] for x, y, cell in seen if not is_red[cell]], float)
    red = np.array([picture[y, x, :3] for x, y, cell in seen if is_red[cell]], float)
    assert min(len(gray), len(red)) > 100
    assert gray.std(axis=0).max() < 4  # each pixel covers hundreds of squares
    assert np.abs(gray - gray.mean(axis=1, keepdims=True)).max() < 4
    assert red[:, 1:].max() < 8
