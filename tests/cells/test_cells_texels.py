"""Colors of faces from textures: exact values, any number of threads, and borders of regions."""

import numpy as np
import pytest
from reference import texel_colors
from textured_meshes import checkered_ball, facade, grid, save_png

import superfacets as sf
from superfacets import Mesh, MeshAttributes, PolygonMesh, Texture, kit
from superfacets.tools.named_features import CellData
from superfacets.weights.features import Features, FeatureTable
from superfacets_textures import Material, TextureImage, texture_colors
from superfacets_textures.textures import WRAPS


@pytest.fixture
def image(tmp_path):
    """Return the pixels of a random image, and the image in a file."""
    pixels = np.random.default_rng(5).integers(0, 256, (12, 20, 3), dtype=np.uint8)
    save_png(tmp_path / "random.png", pixels)
    return pixels, TextureImage("random.png", tmp_path / "random.png")


def triangles(pairs, image, wrap=("repeat", "repeat")):
    """Return a mesh with one triangle for every three pairs of texture coordinates."""
    n = len(pairs) // 3
    vertices = np.random.default_rng(0).random((3 * n, 3))
    mesh = Mesh(vertices, np.arange(3 * n).reshape(-1, 3))
    material = Material("all", image=image, wrap=wrap)
    return mesh, Texture(pairs, np.arange(3 * n), [material], np.zeros(n, int))


def linear(srgb):
    share = np.asarray(srgb) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("wrap", WRAPS)
def test_colors_are_those_of_the_twin(image, wrap):
    pixels, stored = image
    rng = np.random.default_rng(1)
    large = rng.uniform(-1.5, 2.5, (60, 3, 2))
    small = rng.uniform(-1, 2, (60, 1, 2)) + rng.uniform(0, 0.04, (60, 3, 2))
    slivers = rng.uniform(-1, 2, (60, 1, 2)) + rng.uniform(0, 1, (60, 3, 1)) * [1.0, 0.37]
    pairs = np.concatenate([large, small, slivers]).reshape(-1, 2)
    mesh, texture = triangles(pairs, stored, (wrap, "repeat"))
    found = texture_colors(mesh, texture)
    means, spreads = texel_colors(pixels, pairs.reshape(-1, 3, 2), (wrap, "repeat"))
    np.testing.assert_array_equal(found.linear, means)
    np.testing.assert_array_equal(found.spread, spreads)
    assert found.is_textured.all()


def test_a_face_has_the_mean_of_its_texels_in_linear_light(image):
    _, stored = image
    pairs = np.array([[0, 1 - 3 / 12], [8 / 20, 1 - 3 / 12], [8 / 20, 1], [0, 1]])[
        [0, 1, 2, 0, 2, 3]
    ]
    mesh, texture = triangles(pairs, stored)
    square = PolygonMesh.of_faces(mesh.vertices[:4], [[0, 1, 2, 3]])
    whole = Texture(pairs[[0, 1, 2, 5]], [0, 1, 2, 3], texture.materials, [0])
    red, black = np.array([255, 0, 0], np.uint8), np.zeros(3, np.uint8)
    two = np.where(np.indices((12, 20))[1][..., None] % 2, red, black).astype(np.uint8)
    save_png(stored.path, two)
    found = texture_colors(square, whole)
    np.testing.assert_allclose(found.linear, [[0.5, 0, 0]], atol=0.03)
    assert found.srgb[0, 0] in range(184, 192)  # 188 has half the light of 255; 128 does not
    np.testing.assert_allclose(found.spread, [0.5], atol=0.03)


@pytest.mark.parametrize("wrap", WRAPS)
def test_coordinates_outside_of_the_image_go_on_as_the_sampler_says(image, wrap):
    pixels, stored = image
    texel = np.array([[0.1, 0.1], [0.9, 0.1], [0.5, 0.9]]) / [20, 12]
    column = {"repeat": 3, "clamp": 19, "mirror": 16}[wrap]
    pairs = texel + [1 + 3 / 20, 7 / 12]
    mesh, texture = triangles(pairs, stored, (wrap, wrap))
    expected = linear(pixels[12 - 1 - 7, column])
    np.testing.assert_allclose(texture_colors(mesh, texture).linear[0], expected, atol=1e-5)


def test_a_face_smaller_than_a_texel_is_sampled_between_texels(image):
    pixels, stored = image
    at = np.array([[4 / 20, 1 - 5 / 12]])  # the common corner of four texels
    mesh, texture = triangles(at + [[0, 1e-9], [1e-9, 0], [-1e-9, -1e-9]], stored)
    expected = linear(pixels[4:6, 3:5]).mean(axis=(0, 1))
    found = texture_colors(mesh, texture)
    np.testing.assert_allclose(found.linear[0], expected, atol=1e-5)
    mesh, texture = triangles(np.repeat(at + [[0.5 / 20, 0.5 / 12]], 3, axis=0), stored)
    found = texture_colors(mesh, texture)  # one point, in the middle of a texel
    np.testing.assert_allclose(found.linear[0], linear(pixels[4, 4]), atol=1e-5)


def test_faces_without_texels_have_the_color_of_their_material(image):
    _, stored = image
    pairs = np.array(
        [[0, 0], [1, 0], [0, 1], [np.nan, 0], [1, 0], [0, 1], [2e6, 0], [1, 0], [0, 1]]
    )
    mesh, texture = triangles(np.tile(pairs, (2, 1)), stored)
    materials = [Material(color=(0.25, 0.5, 1), image=stored), Material(color=(0, 1, 0))]
    corners = np.array(texture.corners)
    corners[9] = -1
    texture = Texture(texture.coordinates, corners, materials, [0, 0, 0, 0, 1, -1])
    found = texture_colors(mesh, texture)
    np.testing.assert_array_equal(found.is_textured, [True, False, False, False, False, False])
    np.testing.assert_array_equal(found.linear[1:], [[0.25, 0.5, 1]] * 3 + [[0, 1, 0], [1, 1, 1]])
    plain = Texture(texture.coordinates, corners, [Material(image=stored)], [0] * 6)
    expected = texture_colors(mesh, plain).linear[0] * [0.25, 0.5, 1]
    np.testing.assert_allclose(found.linear[0], expected)
    assert found.spread[1:].max() == 0


def test_huge_triangles_are_sampled_and_quick(image):
    pixels, stored = image
    pairs = np.array([[0, 0], [1e6, 0], [0, 1e6]] * 200, float)
    mesh, texture = triangles(pairs, stored)
    found = texture_colors(mesh, texture)
    np.testing.assert_allclose(found.linear[0], linear(pixels).mean(axis=(0, 1)), atol=0.03)
    slivers = np.array([[-1e6, 0], [1e6, 0], [0, 0.1]] * 2000, float)  # a slow method takes minutes
    mesh, texture = triangles(slivers, stored)
    assert np.isfinite(texture_colors(mesh, texture).linear).all()


def test_colors_are_the_same_on_any_number_of_threads(tmp_path):
    pixels = np.random.default_rng(3).integers(0, 256, (256, 256, 3), dtype=np.uint8)
    save_png(tmp_path / "a.png", pixels)
    image = TextureImage("a.png", tmp_path / "a.png")
    pairs = np.random.default_rng(4).uniform(-1, 2, (30_000, 2))
    pairs = (pairs.reshape(-1, 3, 2)[:, :1] + pairs.reshape(-1, 3, 2) * 0.02).reshape(-1, 2)
    mesh, texture = triangles(pairs, image, ("mirror", "clamp"))
    one, many = (texture_colors(mesh, texture, n_threads=n) for n in (1, 4))
    np.testing.assert_array_equal(one.linear, many.linear)
    np.testing.assert_array_equal(one.spread, many.spread)


def test_polygons_have_the_mean_of_their_triangles(image):
    pixels, stored = image
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    mesh = PolygonMesh.of_faces(np.insert(corners, 2, 0, axis=1), [[0, 1, 2, 3]])
    texture = Texture(corners, [0, 1, 2, 3], [Material(image=stored)], [0])
    found = texture_colors(mesh, texture)
    light = linear(pixels)
    np.testing.assert_allclose(found.linear[0], light.mean(axis=(0, 1)), atol=0.02)
    spread = np.sqrt(((light - light.mean(axis=(0, 1))) ** 2).sum(axis=2).mean())
    np.testing.assert_allclose(found.spread[0], spread, rtol=0.03)


# Regions.


def error_of(made, k, **options):
    labels = sf.segment(made.mesh, k, **options).labels
    return sf.metrics.undersegmentation_error(made.mesh, labels, made.parts)


def texture_features(made, *names):
    return CellData(made.mesh, MeshAttributes(texture=made.texture)).features(names, 2)


def test_regions_of_a_flat_facade_follow_the_paint(tmp_path):
    made = facade(tmp_path)
    features = texture_features(made, "texture")
    painted = np.median([error_of(made, k, features=features) for k in (180, 200, 220)])
    assert painted < 0.1 * error_of(made, 200)  # the requirement is at most half
    assert painted < 0.03


def test_a_chessboard_on_a_ball_is_followed(tmp_path):
    made = checkered_ball(tmp_path)
    assert error_of(made, 300, features=texture_features(made, "color")) < 0.001
    assert error_of(made, 300) > 0.5


def test_a_texture_of_one_color_changes_no_label(tmp_path):
    made = checkered_ball(tmp_path, n_rows=40)
    save_png(tmp_path / "board.png", np.full((64, 64, 3), (201, 90, 33), np.uint8))
    expected = sf.segment(made.mesh, 100).labels
    for names in (["texture"], ["color", "texture_spread"]):
        features = texture_features(made, *names)
        with pytest.warns(sf.FeatureWarning, match=f"^{names[0]}.*: all cells have the same value"):
            labels = sf.segment(made.mesh, 100, features=features).labels
        np.testing.assert_array_equal(labels, expected)


def test_the_noise_of_a_compressed_image_counts_for_little(tmp_path):
    from PIL import Image

    made = checkered_ball(tmp_path, n_rows=40)
    noise = np.random.default_rng(0).integers(-1, 2, (512, 512, 1)) + np.array([201, 90, 33])
    Image.fromarray(noise.astype(np.uint8)).save(tmp_path / "board.png", "jpeg")
    features = texture_features(made, "texture")
    assert features.values.std(axis=0).max() > 0
    areas = np.ones(made.mesh.n_faces)
    scaled = Features(features).scaled(made.mesh, areas)
    assert scaled.std(axis=0).max() < 0.1  # of what is just visible
    large = FeatureTable(features.values * 10_000, features.groups)  # columns of one scale
    table = Features(large).scaled(made.mesh, areas)
    np.testing.assert_allclose(np.sqrt((table.std(axis=0) ** 2).mean()), 1)
    np.testing.assert_allclose(table / large.values, (table / large.values)[0, 0])


def test_color_is_that_of_the_file_before_that_of_the_texture(tmp_path):
    made = facade(tmp_path, edge=0.5)
    shades = {name: np.arange(made.mesh.n_faces) % 256 for name in ("red", "green", "blue")}
    both = MeshAttributes(face=shades, texture=made.texture)
    color = CellData(made.mesh, both).features(["color"], 1)
    np.testing.assert_array_equal(color.values[:, 0], shades["red"])
    insisted = CellData(made.mesh, both).features(["texture"], 1)
    np.testing.assert_array_equal(insisted.values, texture_colors(made.mesh, made.texture).oklab)


def test_files_are_segmented_by_texture_by_name(tmp_path):
    made = facade(tmp_path, edge=0.25)
    attributes = MeshAttributes(texture=made.texture)
    by_array = sf.segment(made.mesh, 60, features=texture_features(made, "texture")).labels
    for name in ("a.obj", "a.glb", "a.ply"):
        sf.write_mesh(tmp_path / name, made.mesh, attributes=attributes)
    labels = sf.segment(tmp_path / "a.obj", 60, features="texture").labels
    np.testing.assert_array_equal(labels, by_array)
    for name in ("a.glb", "a.ply"):  # coordinates are float32
        assert sf.segment(tmp_path / name, 60, features="color").n_segments == 60
        found = texture_colors(tmp_path / name).linear
        np.testing.assert_allclose(found, texture_colors(tmp_path / "a.obj").linear, atol=0.04)


def test_features_without_a_texture_say_why(tmp_path):
    mesh, _ = grid(4, 4, 1, 1)
    sf.write_mesh(tmp_path / "a.ply", mesh)
    with pytest.raises(sf.MeshError, match=r"^features texture: the mesh has no texture$"):
        sf.segment(tmp_path / "a.ply", 3, features="texture")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 1 x\nf 1/1 2/1 3/1\n")
    with pytest.raises(
        sf.MeshError,
        match=r"the mesh has no texture \(texture: line 4: expected a number, got 'x'\)",
    ):
        sf.segment(tmp_path / "a.obj", 1, features="texture")
    made = facade(tmp_path, edge=1)
    (tmp_path / "facade.png").unlink()
    with pytest.raises(sf.MeshError, match=r"^features color: the image 'facade.png' cannot be"):
        CellData(made.mesh, MeshAttributes(texture=made.texture)).features(["color"], 1)


def test_features_need_pillow(tmp_path, monkeypatch):
    made = facade(tmp_path, edge=1)
    monkeypatch.setitem(__import__("sys").modules, "PIL.PngImagePlugin", None)
    with pytest.raises(sf.MissingExtraError, match=r"pip install 'superfacets\[texture\]'"):
        texture_colors(made.mesh, made.texture)


def test_texels_check_the_arrays_that_they_get():
    texels, square = kit.Texels(4, 2, ("repeat", "clamp")), np.zeros((2, 2))
    corners, linear = np.array([[0, 1, 1]], np.int32), np.arange(256, dtype=np.int32)
    with pytest.raises(ValueError, match=r"^pixels must have shape \(2, 4, 3\), got \(4, 2, 3\)"):
        texels.colors(np.zeros((4, 2, 3), np.uint8), linear, square, corners, 1)
    with pytest.raises(ValueError, match=r"^corners must be below 2, got 2"):
        texels.colors(np.zeros((2, 4, 3), np.uint8), linear, square, corners + 1, 1)
    with pytest.raises(ValueError, match=r"^ids must have shape \(1,\), got \(2,\)"):
        texels.painted(np.zeros(2, np.int32), square, corners, 0, 1)
