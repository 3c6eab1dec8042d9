"""Textures in OBJ, GLB and PLY, compared with other libraries; no other files can be read."""

import base64
import io
import json
import random
import shutil
import struct
import warnings
import zlib

import numpy as np
import pytest
import trimesh
from damage import damaged
from PIL import Image
from textured_meshes import save_png

from superfacets import (
    Mesh,
    MeshAttributes,
    MeshError,
    PolygonMesh,
    Texture,
    read_attributes,
    read_mesh,
    write_mesh,
)
from superfacets.tools.named_features import CellData
from superfacets_textures import Material, TextureImage, texture_colors

pygltflib = pytest.importorskip("pygltflib")

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]], dtype=float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])
PAIRS = np.array([[0, 0], [0.75, 0.25], [1, 1], [0.125, 1], [0.5, 0.5]])
CORNERS = np.array([0, 1, 2, 4, 2, 3])
PIXELS = np.arange(4 * 8 * 3, dtype=np.uint8).reshape(4, 8, 3)
RED = np.full((2, 2, 3), (255, 0, 0), np.uint8)
LABELS = [1, 0]

OBJ = """mtllib square.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0.5
vt 0 0
vt 0.75 0.25
vt 1 1
vt 0.125 1
vt 0.5 0.5
usemtl wall
f 1/1 2/2 3/3
usemtl door # 2
f 1/5 3/3 4/4
"""
MTL = """newmtl wall
Kd 0.5 0.5 0.5
map_Kd -s 1 1 1 images/wall of brick.png
map_Bump bump.png
newmtl door # 2
map_Kd -clamp on door.png
Ns 7
"""


@pytest.fixture
def square(tmp_path):
    """Write an OBJ with two materials, and images beside it and in a subfolder."""
    folder = tmp_path / "in"
    (folder / "images").mkdir(parents=True)
    save_png(folder / "images" / "wall of brick.png", PIXELS)
    save_png(folder / "bump.png", RED)
    save_png(folder / "door.png", RED)
    (folder / "square.mtl").write_text(MTL)
    (folder / "square.obj").write_text(OBJ)
    return folder / "square.obj"


def png_bytes(pixels=PIXELS) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "png")
    return file.getvalue()


def gltf_document(images, **parts):
    """Return a glTF of two triangles whose material has the first image as its color."""
    pairs = PAIRS[CORNERS].astype("<f4") * [1, -1] + [0, 1]
    content = VERTICES[FACES].astype("<f4").tobytes() + pairs.astype("<f4").tobytes()
    return {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 6, "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 72},
            {"buffer": 0, "byteOffset": 72, "byteLength": 48},
        ],
        "buffers": [
            {"byteLength": 120, "uri": "data:;base64," + base64.b64encode(content).decode()}
        ],
        "images": images,
        "textures": [{"source": i, "sampler": 0} for i in range(len(images))],
        "samplers": [{"wrapS": 33071, "wrapT": 33648}],
        "materials": [{"name": "wall", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        **parts,
    }


def grown(document, content):
    """Append to the buffer of a document, and return its size."""
    content = base64.b64decode(document["buffers"][0]["uri"][13:]) + content
    uri = "data:;base64," + base64.b64encode(content).decode()
    document["buffers"][0] = {"byteLength": len(content), "uri": uri}
    return len(content)


def data_uri(content: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(content).decode()


def write_gltf(path, document):
    path.write_text(json.dumps(document))
    return path


def pairs_at_corners(texture):
    return texture.coordinates[texture.corners]


def same_pixels(image, pixels):
    np.testing.assert_array_equal(image.pixels(), pixels)


# Reading.


def test_obj_has_pairs_materials_and_images_at_its_corners(square):
    texture = read_attributes(square).texture
    np.testing.assert_array_equal(texture.coordinates, PAIRS)
    np.testing.assert_array_equal(texture.corners, CORNERS)
    np.testing.assert_array_equal(texture.face_materials, [0, 1])
    assert [material.name for material in texture.materials] == ["wall", "door # 2"]
    assert [material.wrap[0] for material in texture.materials] == ["repeat", "clamp"]
    same_pixels(texture.materials[0].image, PIXELS)
    same_pixels(texture.materials[1].image, RED)
    np.testing.assert_array_equal(read_mesh(square).faces, FACES)


def test_obj_counts_back_from_the_last_pair(square):
    text = OBJ.replace("f 1/1 2/2 3/3", "f -4/-5 -3/-4/7 -2/-3").replace("f 1/5 3/3", "f 1 3/3")
    square.write_text(text)
    corners = read_attributes(square).texture.corners
    np.testing.assert_array_equal(corners, [0, 1, 2, -1, 2, 3])


def test_images_are_decoded_when_asked_for(square):
    texture = read_attributes(square).texture
    (square.parent / "door.png").unlink()
    same_pixels(texture.materials[0].image, PIXELS)
    with pytest.raises(MeshError, match=r"the image 'door.png' cannot be read"):
        texture.materials[1].image.pixels()


@pytest.mark.parametrize("place", ["embedded", "data", "beside"])
def test_gltf_images_are_found_wherever_they_are(tmp_path, place):
    images = {
        "data": [{"uri": data_uri(png_bytes())}],
        "beside": [{"uri": "my%20wall.png"}],
        "embedded": [{"bufferView": 2, "mimeType": "image/png"}],
    }
    save_png(tmp_path / "my wall.png", PIXELS)
    document = gltf_document(images[place])
    if place == "embedded":
        grown(document, png_bytes())
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": 120, "byteLength": len(png_bytes())}
        )
    texture = read_attributes(write_gltf(tmp_path / "a.gltf", document)).texture
    np.testing.assert_allclose(pairs_at_corners(texture), PAIRS[CORNERS], atol=1e-7)
    assert texture.materials[0].wrap == ("clamp", "mirror")
    same_pixels(texture.images[0], PIXELS)


def test_gltf_transforms_of_coordinates_are_applied(tmp_path):
    transform = {"offset": [0.5, 0.25], "rotation": np.pi / 2, "scale": [2, 1]}
    info = {"index": 0, "extensions": {"KHR_texture_transform": transform}}
    material = {"pbrMetallicRoughness": {"baseColorTexture": info}, "normalTexture": {"index": 0}}
    document = gltf_document([{"uri": data_uri(png_bytes())}], materials=[material])
    attributes = read_attributes(write_gltf(tmp_path / "a.gltf", document))
    u, v = PAIRS[CORNERS].T * [[1], [-1]] + [[0], [1]]  # v down
    expected = np.stack([v + 0.5, 1 - (-2 * u + 0.25)], axis=1)
    np.testing.assert_allclose(pairs_at_corners(attributes.texture), expected, atol=1e-6)
    (note,) = attributes.left_out
    reason = "whose texture coordinates differ from the color's"
    assert note == f"normalTexture, {reason}, of material 'material_0'"


def test_mirrored_nodes_keep_pairs_at_their_corners(tmp_path):
    document = gltf_document([{"uri": data_uri(png_bytes())}])
    document["nodes"] = [{"mesh": 0, "scale": [-1, 1, 1]}, {"mesh": 0}]
    document["scenes"] = [{"nodes": [0, 1]}]
    path = write_gltf(tmp_path / "a.gltf", document)
    mesh, texture = read_mesh(path), read_attributes(path).texture
    positions = np.abs(mesh.vertices[mesh.faces.ravel()])
    order = {tuple(position): pair for position, pair in zip(
        VERTICES[FACES[0]], PAIRS[CORNERS[:3]], strict=True)}  # fmt: skip
    for face in (0, 2):
        for corner in range(3 * face, 3 * face + 3):
            found = pairs_at_corners(texture)[corner]
            np.testing.assert_allclose(found, order[tuple(positions[corner])], atol=1e-7)


PLY = """ply
format ascii 1.0
comment TextureFile wall.png
element vertex 4
property float x
property float y
property float z
{vertex}element face {n}
property list uchar int vertex_indices
{face}end_header
"""


def test_ply_pairs_of_vertices_and_of_corners_are_the_same_texture(tmp_path):
    save_png(tmp_path / "wall.png", PIXELS)
    of_vertices = PLY.format(vertex="property float s\nproperty float t\n", n=1, face="")
    rows = [f"{x:g} {y:g} {z:g}" for x, y, z in VERTICES]
    pairs = [f" {u:g} {v:g}" for u, v in PAIRS[:4]]
    body = "\n".join(map("".join, zip(rows, pairs, strict=True))) + "\n4 0 1 2 3\n"
    (tmp_path / "a.ply").write_text(of_vertices + body)
    of_corners = PLY.format(vertex="", n=1, face="property list uchar float texcoord\n")
    listed = " ".join(f"{value:g}" for value in PAIRS[:4].ravel())
    (tmp_path / "b.ply").write_text(of_corners + "\n".join(rows) + f"\n4 0 1 2 3 8 {listed}\n")
    for name in "ab":
        texture = read_attributes(tmp_path / f"{name}.ply").texture
        np.testing.assert_array_equal(pairs_at_corners(texture), PAIRS[:4])
        same_pixels(texture.images[0], PIXELS)


def test_ply_lists_of_corners_may_differ_in_length(tmp_path):
    save_png(tmp_path / "wall.png", PIXELS)
    face = "property list uchar float texcoord\nproperty int texnumber\n"
    text = PLY.format(vertex="", n=3, face=face)
    rows = "".join(f"{x:g} {y:g} {z:g}\n" for x, y, z in VERTICES)
    rows += "3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 0 0\n4 0 1 2 3 8 0 0 1 0 1 1 0 1 7\n"
    (tmp_path / "a.ply").write_text(text + rows)
    attributes = read_attributes(tmp_path / "a.ply")
    texture = attributes.texture
    assert attributes.left_out == ()
    np.testing.assert_array_equal(texture.corners, [0, 1, 2, -1, -1, -1, 3, 4, 5, 6])
    np.testing.assert_array_equal(texture.face_materials, [0, 0, -1])


# Writing.


def of_trimesh(path):
    """Return texture coordinates of all corners, and the image, of meshes read by trimesh."""
    meshes = list(trimesh.load(path, process=False, force="scene").geometry.values())
    pairs = [mesh.visual.uv[mesh.faces].reshape(-1, 2) for mesh in meshes]
    images = [
        getattr(mesh.visual.material, "baseColorTexture", None) or mesh.visual.material.image
        for mesh in meshes
    ]
    found = [np.asarray(image.convert("RGB")) for image in images]
    order = np.argsort([-image.size for image in found])  # trimesh has its own order
    return [pairs[i] for i in order], [found[i] for i in order]


@pytest.mark.parametrize("ending", [".obj", ".glb"])
@pytest.mark.parametrize("folder", ["in", "out"])
def test_trimesh_reads_the_same_pairs_and_pixels(square, tmp_path, folder, ending):
    (tmp_path / "out").mkdir(exist_ok=True)
    library = square.with_name("square.mtl")  # trimesh does not support map options
    library.write_text(MTL.replace("-s 1 1 1 ", "").replace("-clamp on ", ""))
    path = tmp_path / folder / f"again{ending}"
    write_mesh(path, read_mesh(square), attributes=read_attributes(square))
    if folder == "out":
        shutil.rmtree(tmp_path / "in")
    pairs, images = of_trimesh(path)
    for found, expected in zip(pairs, np.split(PAIRS[CORNERS], 2), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-7)
    np.testing.assert_array_equal(images[0], PIXELS)
    np.testing.assert_array_equal(images[1], RED)


def test_pygltflib_finds_images_bit_by_bit_and_region_ids(square, tmp_path):
    path = tmp_path / "a.glb"
    write_mesh(path, read_mesh(square), LABELS, attributes=read_attributes(square))
    gltf = pygltflib.GLTF2().load(path)
    blob = gltf.binary_blob()
    for image, name in zip(gltf.images, ["images/wall of brick.png", "door.png"], strict=True):
        view = gltf.bufferViews[image.bufferView]
        content = blob[view.byteOffset : view.byteOffset + view.byteLength]
        assert content == (square.parent / name).read_bytes()
    primitives = gltf.meshes[0].primitives
    assert [primitive.attributes.COLOR_0 for primitive in primitives] == [None, None]
    for face, primitive in enumerate(primitives):
        pairs = accessor_of(gltf, primitive.attributes.TEXCOORD_0)
        indices = accessor_of(gltf, primitive.indices)
        expected = PAIRS[CORNERS[3 * face : 3 * face + 3]] * [1, -1] + [0, 1]
        np.testing.assert_array_equal(pairs.reshape(-1, 2)[indices], expected)
        assert set(accessor_of(gltf, primitive.attributes._FEATURE_ID_0)) == {LABELS[face]}
    clamp = gltf.samplers[gltf.textures[1].sampler]
    assert (clamp.wrapS, clamp.wrapT) == (33071, 33071)
    assert "EXT_mesh_features" in gltf.extensionsUsed


def accessor_of(gltf, number):
    accessor = gltf.accessors[number]
    view = gltf.bufferViews[accessor.bufferView]
    dtype = {5126: "<f4", 5125: "<u4"}[accessor.componentType]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor.type]
    return np.frombuffer(gltf.binary_blob(), dtype, accessor.count * width, view.byteOffset)


def test_glb_keeps_all_textures_of_its_materials(tmp_path):
    extensions = {"KHR_materials_clearcoat": {"clearcoatTexture": {"index": 2}}}
    material = {
        "name": "wall", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "normalTexture": {"index": 1, "scale": 0.5}, "alphaMode": "MASK", "extensions": extensions,
    }  # fmt: skip
    images = [{"uri": data_uri(png_bytes(np.roll(PIXELS, i))), "name": f"i{i}"} for i in range(3)]
    path = write_gltf(tmp_path / "a.gltf", gltf_document(images, materials=[material]))
    write_mesh(tmp_path / "b.glb", read_mesh(path), attributes=read_attributes(path))
    write_mesh(
        tmp_path / "c.glb", read_mesh(tmp_path / "b.glb"),
        attributes=read_attributes(tmp_path / "b.glb"),
    )  # fmt: skip
    gltf = pygltflib.GLTF2().load(tmp_path / "c.glb")
    (found,) = gltf.materials
    assert (found.alphaMode, found.normalTexture.scale) == ("MASK", 0.5)
    clearcoat = found.extensions["KHR_materials_clearcoat"]["clearcoatTexture"]
    numbers = [
        found.pbrMetallicRoughness.baseColorTexture.index, found.normalTexture.index,
        clearcoat["index"],
    ]  # fmt: skip
    names = [gltf.images[gltf.textures[number].source].name for number in numbers]
    assert names == ["i0.png", "i1.png", "i2.png"]
    assert gltf.extensionsUsed == ["KHR_materials_clearcoat"]
    assert gltf.samplers[0].wrapS == 33071


def test_obj_beside_its_input_refers_to_its_materials(square):
    before = {path.name for path in square.parent.rglob("*")}
    attributes = read_attributes(square)
    write_mesh(square.with_name("b.obj"), read_mesh(square), LABELS, attributes=attributes)
    assert {path.name for path in square.parent.rglob("*")} == before | {"b.obj"}
    text = square.with_name("b.obj").read_text()
    assert text.startswith("mtllib square.mtl\n")
    assert text[text.index("g region_0") :].splitlines() == [
        "g region_0", "usemtl door # 2", "f 1/5 3/3 4/4",
        "g region_1", "usemtl wall", "f 1/1 2/2 3/3",
    ]  # fmt: skip


def test_obj_elsewhere_has_copies_of_materials_and_images(square, tmp_path):
    path = tmp_path / "out" / "b.obj"
    path.parent.mkdir()
    write_mesh(path, read_mesh(square), LABELS, attributes=read_attributes(square))
    shutil.rmtree(square.parent)
    names = {found.name for found in path.parent.iterdir()}
    assert names == {"b.obj", "b.mtl", "b_wall_of_brick.png", "b_bump.png", "b_door.png"}
    assert path.with_name("b.mtl").read_text().splitlines() == [
        "newmtl wall", "Kd 0.5 0.5 0.5", "map_Kd -s 1 1 1 b_wall_of_brick.png",
        "map_Bump b_bump.png", "newmtl door # 2", "map_Kd -clamp on b_door.png", "Ns 7",
    ]  # fmt: skip
    texture = read_attributes(path).texture
    np.testing.assert_array_equal(pairs_at_corners(texture), np.roll(PAIRS[CORNERS], 3, axis=0))


@pytest.mark.parametrize("start", [".obj", ".glb", ".ply"])
@pytest.mark.parametrize("end", [".obj", ".glb", ".ply"])
def test_every_format_hands_pairs_and_pixels_on_to_every_other(square, tmp_path, start, end):
    first, second = tmp_path / f"first{start}", tmp_path / "out" / f"second{end}"
    second.parent.mkdir()
    write_mesh(first, read_mesh(square), attributes=read_attributes(square))
    write_mesh(second, read_mesh(first), attributes=read_attributes(first))
    shutil.rmtree(square.parent)
    first.unlink()
    attributes = read_attributes(second)
    assert attributes.left_out == ()
    texture = attributes.texture
    np.testing.assert_allclose(pairs_at_corners(texture), PAIRS[CORNERS], atol=1e-7)
    images = [texture.materials[material].image for material in texture.face_materials]
    same_pixels(images[0], PIXELS)
    same_pixels(images[1], RED)


def test_ply_beside_its_input_refers_to_the_image(square):
    write_mesh(square.with_name("b.ply"), read_mesh(square), attributes=read_attributes(square))
    header = square.with_name("b.ply").read_bytes().split(b"end_header")[0].decode()
    assert "comment TextureFile images/wall of brick.png\ncomment TextureFile door.png" in header
    assert "property list uchar float texcoord\nproperty int texnumber" in header


def test_polygons_keep_their_pairs_in_obj_and_glb(tmp_path):
    save_png(tmp_path / "wall.png", PIXELS)
    mesh = PolygonMesh.of_faces([*VERTICES, [2, 0, 0]], [[0, 1, 2, 3], [1, 4, 2]])
    material = Material("wall", image=TextureImage("wall.png", tmp_path / "wall.png"))
    pairs = np.array([*PAIRS[:4], [0, 0], [1, 0], [1, 0.5]])
    texture = Texture(pairs, np.arange(7), [material], [0, -1])
    for name in ("a.obj", "a.glb"):
        write_mesh(tmp_path / name, mesh, [0, 0], attributes=MeshAttributes(texture=texture))
    found = read_attributes(tmp_path / "a.obj").texture
    np.testing.assert_array_equal(pairs_at_corners(found), pairs)
    assert [material.name for material in found.materials] == ["wall", "no_material"]
    found = read_attributes(tmp_path / "a.glb").texture
    at_corners = {tuple(pair) for pair in pairs_at_corners(found)}
    assert at_corners == {tuple(pair) for pair in pairs}


@pytest.mark.parametrize("kind", ["bmp", "tiff", "tga", "webp", "jpeg"])
def test_other_kinds_of_images_go_into_glb(tmp_path, kind):
    name = f"wall.{kind}"
    Image.fromarray(RED).save(tmp_path / name, **({"lossless": True} if kind == "webp" else {}))
    texture = Texture(PAIRS, CORNERS, [Material(image=TextureImage(name, tmp_path / name))], [0, 0])
    mesh = Mesh(VERTICES, FACES)
    write_mesh(tmp_path / "a.glb", mesh, attributes=MeshAttributes(texture=texture))
    found = read_attributes(tmp_path / "a.glb").texture.images[0]
    assert np.abs(found.pixels().astype(int) - RED).max() <= 2  # JPEG
    gltf = pygltflib.GLTF2().load(tmp_path / "a.glb")
    expected = {"webp": "image/webp", "jpeg": "image/jpeg"}.get(kind, "image/png")
    assert gltf.images[0].mimeType == expected
    assert gltf.extensionsUsed == (["EXT_texture_webp"] if kind == "webp" else [])


# Images of ids.


def test_ids_fill_the_layout_of_the_texture_and_two_texels_more(tmp_path):
    save_png(tmp_path / "wall.png", np.zeros((64, 64, 3), np.uint8))
    image = TextureImage("wall.png", tmp_path / "wall.png")
    pairs = np.array([[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]])
    texture = Texture(pairs, FACES.ravel(), [Material(image=image)], [0, 0])
    mesh = Mesh(VERTICES, FACES)
    path = tmp_path / "out.ids.png"
    write_mesh(path, mesh, [700, 3], attributes=MeshAttributes(texture=texture))
    ids = np.asarray(Image.open(path)).astype(int) @ [1, 256, 65536]
    row, column = np.indices((64, 64))
    is_drawn = (abs(row - 31.5) < 18) & (abs(column - 31.5) < 18)  # 32 texels, and 2 on each side
    lower = column + row > 64
    np.testing.assert_array_equal(ids > 0, is_drawn)
    assert set(ids[is_drawn & lower]) == {701}
    is_inner = (abs(row - 31.5) < 16) & (abs(column - 31.5) < 16)
    assert set(ids[is_inner & (column + row < 62)]) == {4}
    rows = (tmp_path / "out.ids.csv").read_text().splitlines()
    assert rows[0] == "id,label,texels,area"
    table = np.array([line.split(",") for line in rows[1:]], float)
    np.testing.assert_array_equal(table[:, :2], [[4, 3], [701, 700]])
    assert table[:, 2].sum() == is_drawn.sum()
    np.testing.assert_allclose(table[:, 3], [np.sqrt(1.5) / 2, 0.5], rtol=1e-8)


def test_each_image_has_ids_of_its_own(square, tmp_path):
    write_mesh(
        tmp_path / "a.ids.png", read_mesh(square), LABELS, attributes=read_attributes(square)
    )
    first, second = (np.asarray(Image.open(tmp_path / f"a{n}.ids.png")) for n in ("", ".1"))
    assert (first.shape, second.shape) == ((4, 8, 3), (2, 2, 3))
    assert set(first[..., 0].ravel()) <= {0, 2}
    assert set(second[..., 0].ravel()) == {1}


def test_ids_need_labels_and_a_texture(square, tmp_path):
    mesh = read_mesh(square)
    for labels, attributes in ((LABELS, None), (None, read_attributes(square))):
        with pytest.raises(MeshError, match="needs faces with labels and texture coordinates"):
            write_mesh(tmp_path / "a.ids.png", mesh, labels, attributes=attributes)
    assert not (tmp_path / "a.ids.png").exists()


# Missing, wrong and malicious files.


def color_of(path):
    return texture_colors(read_mesh(path), read_attributes(path).texture)


def test_a_missing_image_is_a_note_and_then_one_line(square):
    (square.parent / "door.png").unlink()
    attributes = read_attributes(square)
    assert attributes.left_out == ("image 'door.png', which is missing",)
    with pytest.raises(MeshError, match=r"^the image 'door.png' is missing$"):
        texture_colors(read_mesh(square), attributes.texture)
    write_mesh(square.with_name("b.glb"), read_mesh(square), attributes=attributes)
    assert len(pygltflib.GLTF2().load(square.with_name("b.glb")).images) == 1
    write_mesh(square.parent / "images" / "b.obj", read_mesh(square), attributes=attributes)
    assert "map_Kd -clamp on door.png" in (square.parent / "images" / "b.mtl").read_text()


def test_any_white_space_separates_the_words_of_obj_and_mtl(square):
    expected = color_of(square).linear
    square.write_text(OBJ.replace("mtllib ", "mtllib\t").replace("usemtl ", "usemtl \t "))
    tabs = (
        MTL.replace("Kd ", "Kd\t").replace("newmtl ", "newmtl\t").replace("-clamp on", "-clamp\ton")
    )
    tabs = tabs.replace("-s 1 1 1 ", "\t-s\f1 \\\n\t1 1\v")
    square.with_name("square.mtl").write_bytes(tabs.replace("\n", "\r\n").encode("utf-8-sig"))
    found = read_attributes(square)
    assert [material.image.name for material in found.texture.materials] == [
        "images/wall of brick.png",
        "door.png",
    ]
    assert found.texture.materials[1].wrap == ("clamp", "clamp")
    assert np.array_equal(color_of(square).linear, expected)


@pytest.mark.parametrize(("change", "reason"), [
    (lambda obj: obj.with_name("square.mtl").unlink(), "'square.mtl' cannot be read in the"),
    (lambda obj: obj.with_name("square.mtl").write_text(MTL.replace("newmtl door", "newmtl x")),
     "'door # 2', which no MTL file defines"),
])  # fmt: skip
def test_missing_materials_are_an_error_where_the_texture_is_asked_for(square, change, reason):
    change(square)
    attributes = read_attributes(square)
    assert reason in attributes.left_out[0]
    with pytest.raises(
        MeshError, match=r"features texture: the mesh has no complete texture"
    ) as caught:
        CellData(read_mesh(square), attributes).features(["texture"], 1)
    assert reason in str(caught.value)


@pytest.mark.parametrize("how", ["up", "absolute", "link", "library"])
def test_files_outside_of_the_folder_are_not_read_and_not_copied(square, tmp_path, how):
    secret = tmp_path / "secret.png"
    save_png(secret, PIXELS[::-1])
    name = {"up": "../secret.png", "absolute": str(secret), "link": "link.png"}.get(how)
    if how == "link":
        (square.parent / "link.png").symlink_to(secret)
    if how == "library":
        (tmp_path / "a.mtl").write_text(MTL)
        square.write_text(OBJ.replace("square.mtl", "../a.mtl"))
    else:
        square.with_name("square.mtl").write_text(MTL.replace("door.png", name))
    attributes = read_attributes(square)
    (note,) = attributes.left_out
    if how == "library":
        assert note == "materials: '../a.mtl' cannot be read in the mesh's folder"
    else:
        assert "which is not in the folder of the mesh" in note
    (tmp_path / "out").mkdir()
    with warnings.catch_warnings():  # PLY cannot store a texture without images
        warnings.simplefilter("ignore")
        for output in ("b.obj", "b.glb", "b.ply"):
            write_mesh(tmp_path / "out" / output, read_mesh(square), attributes=attributes)
    content = b"".join(path.read_bytes() for path in (tmp_path / "out").iterdir())
    assert secret.read_bytes() not in content
    if how != "library":
        with pytest.raises(MeshError, match="is not in the folder of the mesh"):
            color_of(square)


def test_gltf_images_outside_of_the_folder_are_not_read(tmp_path):
    save_png(tmp_path / "secret.png", RED)
    (tmp_path / "in").mkdir()
    document = gltf_document([{"uri": "%2e%2e/secret.png"}])
    attributes = read_attributes(write_gltf(tmp_path / "in" / "a.gltf", document))
    assert attributes.left_out == ("image '../secret.png', which is not in the folder of the mesh",)


def test_files_that_are_no_images_are_not_copied(square, tmp_path):
    (square.parent / "door.png").write_text("a key that nobody else should have")
    attributes = read_attributes(square)
    assert attributes.left_out == ("image 'door.png', which has an unknown format",)
    (tmp_path / "out").mkdir()
    write_mesh(tmp_path / "out" / "b.obj", read_mesh(square), attributes=attributes)
    assert not list((tmp_path / "out").glob("*door*"))


def png_of_size(width, height, rows=b""):
    """Return a PNG whose header declares this size, with compressed rows of any length."""

    def chunk(kind, content):
        checked = kind + content
        return struct.pack(">I", len(content)) + checked + struct.pack(">I", zlib.crc32(checked))

    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9))
        + chunk(b"IEND", b"")
    )  # fmt: skip


@pytest.mark.parametrize(("content", "message"), [
    (
        png_of_size(20_000, 20_000),
        "the image 'image_0.png' declares 20000 x 20000 pixels, but at most"
        " 16777216 are allowed for its 65 bytes",
    ),
    (png_of_size(30_000, 30_000, bytes(10**6)), "declares 30000 x 30000 pixels"),
    (png_of_size(9_000, 9_000, bytes(10**6)), "declares 9000 x 9000 pixels"),
    (png_of_size(64, 64), "is damaged: "),
    (png_bytes()[:-30], "is damaged: "),
    (png_bytes()[:20], "is damaged: "),
    (b"\xff\xd8\xff" + bytes(100), "is damaged: "),
    (b"\xabKTX 20\xbb\r\n\x1a\n" + bytes(80), "is KTX2: convert it to PNG or JPEG"),
])  # fmt: skip
def test_images_that_lie_are_refused_in_one_line(tmp_path, content, message):
    path = write_gltf(tmp_path / "a.gltf", gltf_document([{"uri": data_uri(content)}]))
    with pytest.raises(MeshError) as caught:
        color_of(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_bomb_takes_no_memory(tmp_path):
    import resource

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for size in (16_384, 100_000):
        image = TextureImage("a.png", content=png_of_size(size, size, bytes(10**6)))
        message = f"declares {size} x {size} pixels, but at most 16777216 are allowed for its"
        with pytest.raises(MeshError, match=message):
            image.size()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


def test_images_that_overlap_do_not_multiply(tmp_path):
    document = gltf_document([{"bufferView": 2 + i} for i in range(50)])
    n_bytes = grown(document, png_bytes() + bytes(20_000))
    document["bufferViews"] += [{"buffer": 0, "byteLength": n_bytes}] * 50
    many = {f"{i}Texture": {"index": i} for i in range(50)}
    document["materials"][0]["extensions"] = {"many": many}
    attributes = read_attributes(write_gltf(tmp_path / "a.gltf", document))
    assert attributes.left_out == ("texture: broken glTF: the images in the file overlap",)
    document["images"] = [{"bufferView": 2}] * 50
    assert len(read_attributes(write_gltf(tmp_path / "b.gltf", document)).texture.images) == 1


@pytest.mark.parametrize(("change", "message"), [
    (lambda d: d["accessors"][1].update(count=5), "expected 6 texture coordinates, got 5"),
    (lambda d: d["accessors"][1].update(type="VEC3"), "accessors[1] must have the type VEC2"),
    (lambda d: d["textures"][0].pop("source"), "textures[0] has no image"),
    (lambda d: d["textures"][0].update(source=7), "there is no images[7]"),
    (lambda d: d["images"][0].pop("uri"), "there is no bufferViews[None]"),
    (lambda d: d["images"][0].update(uri="data:;base64,?"), "is not base64"),
    (lambda d: d["samplers"][0].update(wrapS=-1), "wrapS must be an integer >= 0, got -1"),
    (lambda d: d["materials"].pop(), "there is no materials[0]"),
    (lambda d: d["materials"][0].update(pbrMetallicRoughness=3),
     "materials[0].pbrMetallicRoughness must be a JSON object"),
    (
        lambda d: d["materials"][0]["pbrMetallicRoughness"].update(
            baseColorTexture={"index": 0, "extensions": {"KHR_texture_transform": 1}}
        ),
        "extensions of a texture reference must be objects",
    ),
    (
        lambda d: d["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].update(
            extensions={"KHR_texture_transform": {"rotation": "north"}}
        ),
        "the rotation of a texture must be a finite number",
    ),
])  # fmt: skip
def test_a_damaged_gltf_texture_is_left_out_with_the_reason(tmp_path, change, message):
    document = gltf_document([{"uri": data_uri(png_bytes())}])
    change(document)
    path = write_gltf(tmp_path / "a.gltf", document)
    attributes = read_attributes(path)
    assert read_mesh(path).n_faces == 2
    assert attributes.texture is None
    (reason,) = attributes.left_out
    assert reason.startswith("texture: ")
    assert message in reason


@pytest.mark.parametrize("line", ["vt one 2", "vt 1"])
def test_damaged_coordinates_of_an_obj_are_left_out_with_the_line(square, line):
    square.write_text(OBJ.replace("vt 1 1", line))
    attributes = read_attributes(square)
    assert attributes.texture is None
    assert attributes.left_out[0].startswith("texture: line 8: ")
    assert read_mesh(square).n_faces == 2


def test_coordinates_of_an_obj_that_there_are_not_are_none(square):
    square.write_text(OBJ.replace("f 1/1 2/2 3/3", "f 1/99 2/2 3/-77"))
    np.testing.assert_array_equal(read_attributes(square).texture.corners, [-1, 1, -1, 4, 2, 3])


@pytest.mark.parametrize(("change", "message"), [
    ({"coordinates": [[0, 0, 0]]}, r"coordinates must have shape \(T, 2\), got \(1, 3\)"),
    ({"coordinates": [["a", "b"]]}, "coordinates must be numbers"),
    ({"corners": [0, 1, 9]}, r"corners\[2\] must be from -1 to 2, got 9"),
    ({"corners": [0.5, 1, 2]}, "corners must be integers"),
    ({"corners": [[0, 1, 2]]}, "corners must have one dimension"),
    ({"face_materials": [-2]}, r"face_materials\[0\] must be from -1 to 0, got -2"),
])  # fmt: skip
def test_wrong_textures_are_refused(change, message):
    right = {
        "coordinates": [[0, 0], [1, 0], [0, 1]], "corners": [0, 1, 2],
        "materials": [Material()], "face_materials": [0],
    }  # fmt: skip
    Texture(**right)
    with pytest.raises(ValueError, match=message):
        Texture(**{**right, **change})


def test_wrong_materials_and_attributes_are_refused():
    with pytest.raises(
        ValueError,
        match=r"wrap must be two values from repeat, clamp, mirror, got \('repeat', 'around'\)",
    ):
        Material(wrap=("repeat", "around"))
    with pytest.raises(TypeError, match="texture must be a Texture, got str"):
        MeshAttributes(texture="wall.png")


def test_a_texture_of_another_mesh_is_refused(square, tmp_path):
    attributes = read_attributes(square)
    with pytest.raises(
        MeshError,
        match="the texture must have 3 corners of 1 face, like the mesh, got 6 corners of 2 faces",
    ):
        write_mesh(tmp_path / "a.obj", Mesh(VERTICES, FACES[:1]), attributes=attributes)
    with pytest.raises(ValueError, match="points cannot have a texture"):
        write_mesh(tmp_path / "a.las", VERTICES, attributes=attributes)
    with pytest.raises(
        MeshError, match="the mesh has no texture: pass a texture, or the path of a file with one"
    ):
        texture_colors(read_mesh(square))


def test_pickles_of_textures_are_whole(square):
    import pickle

    texture = pickle.loads(pickle.dumps(read_attributes(square))).texture
    np.testing.assert_array_equal(pairs_at_corners(texture), PAIRS[CORNERS])
    same_pixels(texture.images[0], PIXELS)


@pytest.mark.filterwarnings("ignore:.* does not store")
@pytest.mark.parametrize(
    "target", ["a.gltf", "a.glb", "square.obj", "square.mtl", "a.ply", "door.png"]
)
def test_textured_files_that_are_damaged_are_read_or_refused(square, target):
    folder = square.parent
    document = gltf_document([{"uri": data_uri(png_bytes())}])
    write_gltf(folder / "a.gltf", document)
    mesh, attributes = read_mesh(square), read_attributes(square)
    write_mesh(folder / "a.glb", mesh, attributes=attributes)
    write_mesh(folder / "a.ply", mesh, attributes=attributes, ascii=True)
    whole = (folder / target).read_bytes()
    path = square if target in ("square.mtl", "door.png") else folder / target
    source = random.Random(27)
    n_read, messages = 0, []
    for _ in range(40):
        (folder / target).write_bytes(damaged(whole, source))
        try:
            mesh, attributes = read_mesh(path), read_attributes(path)
            if attributes.texture is not None:
                n_read += len(texture_colors(mesh, attributes.texture).linear) > 0
                write_mesh(folder / "images" / "b.obj", mesh, attributes=attributes)
                write_mesh(folder / "b.glb", mesh, attributes=attributes)
        except MeshError as error:
            messages.append(str(error))
    assert not any("\n" in message for message in messages)
    assert n_read > 0 or target == "door.png"  # every byte of door.png matters


@pytest.mark.parametrize("name", ["a.glb", "a.ply", "a.obj"])
def test_coordinates_beyond_float32_stay_finite(square, tmp_path, name):
    square.write_text(OBJ.replace("0.125 1", "1e300 -1e300"))
    write_mesh(tmp_path / name, read_mesh(square), attributes=read_attributes(square))
    pairs = read_attributes(tmp_path / name).texture.coordinates
    assert np.isfinite(pairs).all()
    assert np.abs(pairs).max() > 1e38
