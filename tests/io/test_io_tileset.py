"""Tilesets of 3D Tiles: models, their positions, and invalid tilesets."""

import json
import re

import numpy as np
import pytest
from mesh_files import FACES, VERTICES, b3dm, glb
from numpy.testing import assert_allclose, assert_array_equal
from tilesets import ORIGIN, by_columns, write_city, write_glb, write_tileset

from superfacets import MeshError, read_attributes, read_mesh
from superfacets.io.readers.read import read_cells, read_cells_and_attributes
from superfacets.io.readers.tileset import read_tileset

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0.5]]), np.array([[0, 1, 2]])


def names_of(path):
    return [tile.name for tile in read_tileset(path).tiles]


def positions_of(path):
    tiles = read_tileset(path).tiles
    return [read_cells(tile.path, tile.placement).vertices for tile in tiles]


@pytest.fixture
def lone(tmp_path):
    """Write a tileset whose root has one model, with these changes, and return its path."""
    write_glb(tmp_path / "a.glb", *TRIANGLE)

    def write(root=None, **asset):
        content = {"content": {"uri": "a.glb"}, **(root or {})}
        return write_tileset(tmp_path / "tileset.json", content, **asset)

    return write


def test_models_of_the_finest_level_lie_where_they_should(tmp_path):
    path, city = write_city(tmp_path)
    found = read_tileset(path)
    assert names_of(path) == ["data/one.glb", "data/two.b3dm", "sub/three 3.glb", "sub/four.glb"]
    assert found.origin == ORIGIN
    soup = [read_cells(tile.path, tile.placement) for tile in found.tiles]
    corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in soup])
    # Single precision is accurate to 1e-7 m here; in geocentric coordinates, to half a meter.
    assert_allclose(corners, city.vertices[city.faces], rtol=0, atol=1e-6)


def test_a_tileset_near_to_zero_is_not_moved(lone):
    path = lone({"transform": by_columns(shift=(10, 20, 90_000))})
    assert read_tileset(path).origin == (0, 0, 0)
    assert_allclose(positions_of(path)[0], TRIANGLE[0] + [10, 20, 90_000])


@pytest.mark.parametrize(
    ("volume", "origin"),
    [
        ({"box": [500_000.4, 1, 2, *[0] * 9]}, (500_000, 1, 2)),
        ({"sphere": [0, 0, -300_000, 1]}, (0, 0, -300_000)),
        ({"region": [-0.01, -0.01, 0.01, 0.01, 0, 10]}, (6_378_142, 0, 0)),
        ({"region": [3.13, 0, -3.13, 0, 0, 0]}, (-6_378_137, 0, 0)),  # across the date line
        ({"region": [0, np.pi / 2, 0, np.pi / 2, 0, 0]}, (0, 0, 6_356_752)),
        ({"other": 1}, (0, 0, 0)),
    ],
)
def test_the_origin_is_the_center_of_the_bounding_volume(lone, volume, origin):
    assert_array_equal(read_tileset(lone({"boundingVolume": volume})).origin, origin)


@pytest.mark.parametrize(
    ("axis", "points"),
    [
        ("Y", [[0, 0, 0], [1, 0, 0], [0, 1, 0.5]]),
        ("z", [[0, 0, 0], [1, 0, 0], [0, 0.5, -1]]),
        ("X", [[0, 0, 0], [0, 0, 1], [1, 0.5, 0]]),
    ],
)
def test_models_may_have_another_axis_up(lone, axis, points):
    assert_allclose(positions_of(lone(gltfUpAxis=axis))[0], points, atol=1e-7)


def test_scale_and_mirror_are_applied_and_faces_keep_facing_outward(lone):
    turn = np.diag([2.0, 2, -2])
    path = lone({"transform": by_columns(turn)})
    tile = read_tileset(path).tiles[0]
    mesh, attributes = read_cells_and_attributes(tile.path)
    placed = read_cells(tile.path, tile.placement)
    assert_allclose(placed.vertices, TRIANGLE[0] @ turn)
    assert_array_equal(placed.faces, mesh.faces[:, [0, 2, 1]])
    assert attributes is not None


@pytest.mark.parametrize(
    ("refine", "names"),
    [("REPLACE", ["b.glb"]), ("replace", ["b.glb"]), ("ADD", ["b.glb", "a.glb"])],
)
def test_a_tile_is_replaced_by_its_children_or_stays(lone, tmp_path, refine, names):
    write_glb(tmp_path / "b.glb", *TRIANGLE)
    path = lone({"refine": refine, "children": [{"content": {"uri": "b.glb"}}]})
    assert sorted(names_of(path)) == sorted(names)


def test_several_contents_of_version_1_0_are_read(lone, tmp_path):
    write_glb(tmp_path / "b.glb", *TRIANGLE)
    both = {"3DTILES_multiple_contents": {"content": [{"uri": "b.glb"}, {"uri": "a.glb"}]}}
    assert names_of(lone({"content": None, "extensions": both})) == ["b.glb", "a.glb"]


def test_a_b3dm_alone_has_z_up_and_tells_its_center(tmp_path):
    path = tmp_path / "a.b3dm"
    path.write_bytes(b3dm(features={"RTC_CENTER": [4.5e6, 0, -0.25]}))
    mesh = read_mesh(path)
    assert_array_equal(mesh.vertices, VERTICES[:, [0, 2, 1]] * [1, -1, 1])
    assert_array_equal(mesh.faces, FACES)
    assert read_attributes(path).comments == ("comment origin 4500000 0 -0.25",)
    path.write_bytes(b3dm())
    assert read_attributes(path).comments == ()


def test_a_center_may_be_in_the_binary_part(tmp_path):
    path, binary = tmp_path / "a.b3dm", np.array([9, 1, 2, 3], "<f4").tobytes()
    path.write_bytes(b3dm(features={"RTC_CENTER": {"byteOffset": 4}}, binary=binary))
    assert read_attributes(path).comments == ("comment origin 1 2 3",)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"b3dm" + bytes(10), "the b3dm file is truncated: it has only 14 bytes"),
        (b3dm().replace(b"b3dm\1", b"b3dm\2"), "the b3dm version must be 1, got 2"),
        (b3dm()[:-4], "the b3dm file is shorter than its header declares: it may be truncated"),
        (b3dm(b"glTG" + glb()[4:]), "the b3dm file contains no binary glTF"),
        (b3dm(features={"RTC_CENTER": [1, 2]}), "RTC_CENTER must be a list of 3 numbers"),
        (
            b3dm(features={"RTC_CENTER": {"byteOffset": 4}}),
            "the offset of RTC_CENTER is outside the feature table",
        ),
        (
            b3dm(features={"RTC_CENTER": {"byteOffset": 0}}, binary=b"\xff" * 16),
            "RTC_CENTER is not finite",
        ),
        (b3dm(glb()[:30]), "the GLB declares 580 bytes but has 30: it may be damaged"),
    ],
)
def test_a_b3dm_that_is_wrong_is_refused(refuse, data, message):
    refuse("a.b3dm", data, message)


def refused(path):
    with pytest.raises(MeshError) as caught:
        read_tileset(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("root", "message"),
    [
        ({"content": {"uri": "../a.glb"}}, "the file '../a.glb' is not in the folder of the"),
        ({"content": {"uri": "/etc/a.glb"}}, "is not in the folder of the tileset"),
        ({"content": {"uri": "https://host/a.glb"}}, "is not in the folder of the tileset"),
        ({"content": {"uri": "%ff.glb"}}, "is not in the folder of the tileset"),
        ({"content": {"uri": "a" * 999 + "\0"}}, "...' is not in the folder of the tileset"),
        ({"content": {}}, "the content of a tile must have a uri"),
        ({"content": None}, "the tileset has no models"),
        ({"content": {"uri": "tileset.json"}}, "the tileset tileset.json includes itself"),
        ({"transform": [1, 2]}, "transform must be a list of 16 numbers"),
        ({"children": 3}, "children is not a list of objects"),
        ({"contents": [4]}, "contents is not a list of objects"),
        ({"implicitTiling": {}}, "implicit tiling is not supported"),
        ({"extensions": {"3DTILES_implicit_tiling": {}}}, "implicit tiling is not supported"),
        ({"boundingVolume": {"box": [1]}}, "box must be a list of 12 numbers"),
        (
            {"boundingVolume": {"region": [0, 0, 0, 0, 1e308, 1e308]}},
            "the position of the tileset is not finite",
        ),
        ({"transform": [1e300] * 16, "boundingVolume": {"sphere": [1e300] * 4}}, "is not finite"),
    ],
)
def test_a_tileset_that_is_wrong_is_refused(lone, root, message):
    assert message in refused(lone(root))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not a tileset, or damaged: "),
        ("[" * 100_000, "not a tileset, or damaged: RecursionError"),
        ("[]", "the JSON must have the entries asset and root"),
        ('{"asset": {"version": "1.0"}}', "the JSON must have the entries asset and root"),
        ('{"asset": {"version": "2.0"}, "root": {}}', "the tileset version must be 1.0 or 1.1"),
        (
            '{"asset": {"version": "1.0", "gltfUpAxis": "W"}, "root": {}}',
            "gltfUpAxis must be X, Y or Z, got 'W'",
        ),
    ],
)
def test_other_json_is_refused(tmp_path, text, message):
    path = tmp_path / "tileset.json"
    path.write_text(text)
    assert re.search(re.escape(message).replace("RecursionError", ".*"), refused(path))


def test_a_cycle_of_two_is_found(lone, tmp_path):
    path = lone({"content": {"uri": "sub/b.json"}})
    write_tileset(tmp_path / "sub" / "b.json", {"content": {"uri": "../tileset.json"}})
    with pytest.raises(MeshError, match=r"b.json: the tileset tileset.json includes itself"):
        read_tileset(path)


def test_tilesets_that_multiply_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("superfacets.io.readers.tileset.MAX_TILES", 5_000)
    for i in range(40):
        twice = [{"content": {"uri": f"{i + 1}.json"}}] * 2
        write_tileset(tmp_path / f"{i}.json", {"children": twice})
    write_tileset(tmp_path / "40.json", {})
    assert "has more than 5000 tiles" in refused(tmp_path / "0.json")


def test_a_tileset_of_too_many_tiles_is_refused_before_they_are_visited(tmp_path, monkeypatch):
    monkeypatch.setattr("superfacets.io.readers.tileset.MAX_TILES", 100)
    tiles = [{"transform": "damaged"}] * 100  # visiting a tile would raise another error
    path = write_tileset(tmp_path / "tileset.json", {"children": tiles})
    assert "has more than 100 tiles" in refused(path)


def test_a_missing_tileset_is_named(lone):
    path = lone({"content": {"uri": "b.json"}})
    with pytest.raises(FileNotFoundError, match=r"b\.json: no such file"):
        read_tileset(path)


def test_links_do_not_lead_out_of_the_folder(lone, tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.glb").symlink_to(tmp_path / "a.glb")
    path = write_tileset(tmp_path / "in" / "tileset.json", {"content": {"uri": "link.glb"}})
    lone()
    assert "is not in the folder" in refused(path)


def test_a_tileset_is_no_mesh(lone):
    with pytest.raises(
        MeshError, match=r"tilesets can be read only by batch, convert and segment --tiled$"
    ):
        read_mesh(lone())


def test_names_are_those_of_the_files(lone):
    assert json.loads(lone().read_text())["root"]["content"]["uri"] == names_of(lone())[0]
