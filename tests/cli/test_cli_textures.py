"""Textures on the command line: as features, in outputs, and in notes on other formats."""

import shutil

import numpy as np
import pytest
from textured_meshes import facade

from superfacets import (
    MeshAttributes,
    PolygonMesh,
    Texture,
    read_attributes,
    read_labels,
    read_mesh,
    write_mesh,
)


@pytest.fixture
def wall(tmp_path):
    """Write a painted facade as OBJ with its MTL file and image, and return its path."""
    folder = tmp_path / "in"
    folder.mkdir()
    made = facade(folder, edge=0.5)
    write_mesh(folder / "wall.obj", made.mesh, attributes=MeshAttributes(texture=made.texture))
    return folder / "wall.obj"


def test_regions_follow_a_texture_and_keep_it(run, wall, tmp_path):
    outputs = [tmp_path / "out" / f"a{ending}" for ending in (".obj", ".glb", ".ply", ".npy")]
    outputs[0].parent.mkdir()
    named = [word for output in outputs for word in ("-o", output)]
    status, _, err = run("segment", wall, "-n", 40, "--features", "texture", *named)
    assert (status, err.count("note"), "order of faces" in err) == (0, 1, True), err
    shutil.rmtree(wall.parent)
    assert len(np.unique(read_labels(outputs[3]))) == 40
    for output in outputs[:3]:
        texture = read_attributes(output).texture
        assert texture.images[0].size() == (1200, 900)
    assert outputs[0].read_text().count("g region_") == 40


def test_an_image_of_ids_is_written(run, wall, tmp_path):
    from PIL import Image

    assert run("segment", wall, "-n", 20, "-q", "-o", tmp_path / "a.ids.png")[0] == 0
    ids = np.asarray(Image.open(tmp_path / "a.ids.png"))
    assert ids.shape == (900, 1200, 3)
    assert set(ids[..., 0].ravel()) == {*range(1, 21)}
    assert len((tmp_path / "a.ids.csv").read_text().splitlines()) == 21


@pytest.mark.parametrize("ending", [".off", ".vtp"])
def test_formats_without_textures_say_so(run, wall, tmp_path, ending):
    status, _, err = run("segment", wall, "-n", 5, "-o", tmp_path / f"a{ending}")
    assert status == 0
    assert f"note: data of the input that {ending} does not store: texture" in err
    status, _, err = run("convert", wall, "-o", tmp_path / f"b{ending}")
    assert (status, "does not store: texture" in err) == (0, True)


def test_textures_of_polygons_are_noted_where_ply_lacks_them(run, tmp_path):
    mesh = PolygonMesh.of_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    texture = Texture([[0, 0], [1, 0], [1, 1], [0, 1]], [0, 1, 2, 3], [], [-1])
    write_mesh(tmp_path / "a.obj", mesh, attributes=MeshAttributes(texture=texture))
    status, _, err = run("convert", tmp_path / "a.obj", "-o", tmp_path / "a.ply")
    assert (status, "data of the input that .ply does not store: texture" in err) == (0, True)


def test_images_that_a_format_has_no_place_for_are_noted(run, wall, tmp_path):
    library = wall.with_name("wall.mtl")
    library.write_text(library.read_text() + "map_Bump facade.png\nmap_d alpha.png\n")
    shutil.copy(wall.with_name("facade.png"), wall.with_name("alpha.png"))
    for ending, is_noted in ((".glb", True), (".ply", True), (".obj", False)):
        _, _, err = run("convert", wall, "-o", tmp_path / f"a{ending}")
        note = f"{ending} can store only the color and color image of 1 material"
        assert (note in err) == is_noted


def test_a_missing_image_is_noted_and_then_refused(run, wall, tmp_path):
    (wall.parent / "facade.png").unlink()
    status, _, err = run("segment", wall, "-n", 5, "-o", tmp_path / "a.ply")
    assert status == 0
    assert "data of the input that is not copied: image 'facade.png', which is missing" in err
    status, _, err = run(
        "segment", wall, "-n", 5, "--features", "texture", "-o", tmp_path / "b.ply"
    )
    assert status == 1
    assert "features texture: the image 'facade.png' is missing" in err.strip()
    assert not (tmp_path / "b.ply").exists()


@pytest.mark.parametrize("command", ["segment --subdivide --max-edge 0.2", "cut"])
def test_parts_of_faces_share_coordinates_as_their_source(run, wall, tmp_path, command):
    paths = [tmp_path / name for name in ("a.ply", "a.obj", "a.glb")]  # PLY: a pair per corner
    for path, source in zip(paths, (wall, paths[0], paths[0]), strict=True):
        words = [*command.split(), wall, "-n", 9] if source is wall else ["convert", source]
        assert run(*words, "-o", path, "-q")[0] == 0
    mesh, texture = read_mesh(paths[1]), read_attributes(paths[1]).texture
    expected = mesh.vertices[mesh.faces.ravel()][:, [0, 2]] / [12, 9]
    np.testing.assert_allclose(texture.coordinates[texture.corners], expected, atol=1e-7)
    assert len(texture.coordinates) == mesh.n_vertices > 475
    assert len(read_attributes(paths[2]).texture.coordinates) < 2 * mesh.n_vertices


def test_attributes_that_are_dropped_are_textures_too(run, wall, tmp_path):
    status = run("segment", wall, "-n", 5, "--drop-attributes", "-o", tmp_path / "a.obj")[0]
    assert (status, b"vt" in (tmp_path / "a.obj").read_bytes()) == (0, False)
