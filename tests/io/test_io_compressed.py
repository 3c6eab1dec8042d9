"""glTF that Draco and meshopt compress is read like the same file without compression."""

import json
import struct
import sys

import meshopt
import numpy as np
import pytest
from mesh_files import FACES, VERTICES, draco_glb, glb, gltf_buffer, gltf_document, meshopt_glb
from numpy.testing import assert_allclose, assert_array_equal
from textured_meshes import facade

import superfacets as sf
from superfacets import MeshError, MissingExtraError, read_attributes, read_mesh
from superfacets_formats import compression

PAIRS = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.25]])


def document_of(data: bytes) -> tuple[dict, bytes]:
    """Return the JSON and the binary part of a GLB."""
    (size,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + size]), data[28 + size :]


def changed(data: bytes, change) -> bytes:
    document, buffer = document_of(data)
    change(document)
    return glb(document, buffer)


def pairs_at_corners(path):
    texture = read_attributes(path).texture
    return texture.coordinates[texture.corners]


def corners_of(positions, pairs, faces) -> set:
    """Return the faces as sets of corners, which do not depend on the order."""
    rows = np.hstack([positions, pairs])
    return {frozenset(map(tuple, rows[face].round(3).tolist())) for face in faces}


@pytest.mark.parametrize("keep", [True, False])
def test_draco_keeps_faces_positions_and_texture_coordinates(tmp_path, keep):
    mesh = sf.sample_mesh(3_000)
    points = mesh.vertices - mesh.vertices.min(axis=0)
    pairs = points[:, :2] / points.max()
    path = tmp_path / "a.glb"
    path.write_bytes(draco_glb(points, mesh.faces, pairs, preserve_order=keep,
                               quantization_bits=20))  # fmt: skip
    found, texture = read_mesh(path), read_attributes(path).texture
    step = points.max() / 2**20
    if keep:
        assert_array_equal(found.faces, mesh.faces)
        assert_allclose(found.vertices, points, rtol=0, atol=step)
        assert_allclose(texture.coordinates[texture.corners], [1, -1] * pairs[mesh.faces.ravel()]
                        + [0, 1], rtol=0, atol=2 / 2**20)  # fmt: skip
        return
    assert found.n_faces == mesh.n_faces
    assert_allclose(found.vertices.min(axis=0), 0, atol=step)
    # Each vertex keeps its texture coordinates in any order.
    at = texture.coordinates[texture.corners]
    expected = found.vertices[found.faces.ravel(), :2] / points.max() * [1, -1] + [0, 1]
    assert_allclose(at, expected, rtol=0, atol=1e-5)


def test_draco_seams_double_vertices(tmp_path):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 1, 0]])
    faces, pairs = [[0, 1, 2], [4, 5, 3]], np.linspace(0, 1, 12).reshape(6, 2)
    path = tmp_path / "a.glb"
    path.write_bytes(draco_glb(vertices, faces, pairs, preserve_order=False))
    mesh, texture = read_mesh(path), read_attributes(path).texture
    at = (texture.coordinates * [1, -1] + [0, 1])[texture.corners]
    found = corners_of(mesh.vertices[mesh.faces.ravel()], at, np.arange(6).reshape(2, 3))
    assert found == corners_of(vertices, pairs, faces)


@pytest.mark.parametrize("name", ["EXT_meshopt_compression", "KHR_meshopt_compression"])
def test_meshopt_keeps_all_numbers(tmp_path, name):
    path = tmp_path / "a.glb"
    path.write_bytes(meshopt_glb(pairs=PAIRS, name=name))
    mesh = read_mesh(path)
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)
    expected = [1, -1] * PAIRS[FACES.ravel()] + [0, 1]
    assert_allclose(pairs_at_corners(path), expected, rtol=0, atol=1 / 65535)


def test_a_filter_of_meshopt_is_undone(read):
    points = VERTICES * [0.1, 100, 3]
    found = read("a.glb", meshopt_glb(points, filter="EXPONENTIAL"))
    assert_allclose(found.vertices, points.astype(np.float32), rtol=0, atol=5e-5)


def test_quantized_positions_of_meshopt_are_scaled(read):
    stored = np.zeros((5, 4), np.int16)  # rows of 8 bytes, of which the last two are padding
    stored[:, :3] = np.rint(VERTICES / 9 * 32767)
    packed = meshopt.encode_gltf_buffer(stored, "ATTRIBUTES")
    corners = FACES.astype("<u2").tobytes()
    how = {"buffer": 0, "byteLength": len(packed), "count": 5, "byteStride": 8,
           "mode": "ATTRIBUTES"}  # fmt: skip
    document = gltf_document(
        extensionsRequired=["EXT_meshopt_compression", "KHR_mesh_quantization"],
        nodes=[{"mesh": 0, "scale": [9, 9, 9]}],
        bufferViews=[
            {"buffer": 1, "byteLength": 40, "byteStride": 8,
             "extensions": {"EXT_meshopt_compression": how}},
            {"buffer": 0, "byteOffset": len(packed), "byteLength": 12},
        ],
        buffers=[{"byteLength": len(packed) + 12}, {"byteLength": 40}],  # the fallback has no mark
    )  # fmt: skip
    document["accessors"][0] |= {"componentType": 5122, "normalized": True}
    mesh = read("a.glb", glb(document, packed + corners))
    assert_allclose(mesh.vertices, VERTICES, rtol=0, atol=9 / 32767)
    assert_array_equal(mesh.faces, FACES)


def test_uncompressed_copies_are_read_without_a_decoder(read, broken):
    broken("superfacets_formats.compression.import_extra")
    how = {"buffer": 0, "byteLength": 3, "count": 5, "byteStride": 12, "mode": "ATTRIBUTES"}
    document = gltf_document()
    document["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": how}
    document["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}
    }
    assert_array_equal(read("a.glb", glb(document, gltf_buffer())).vertices, VERTICES)


@pytest.mark.parametrize(
    ("make", "module", "name"),
    [(draco_glb, "DracoPy", "Draco"), (meshopt_glb, "meshopt", "meshopt")],
)
def test_a_missing_decoder_is_named(read, monkeypatch, make, module, name):
    data = make()
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError) as caught:
        read("a.glb", data)
    assert str(caught.value) == (
        f"reading glTF that is compressed by {name} needs an extra:"
        " pip install 'superfacets[compressed]'"
    )


def with_bytes(place: int, content: bytes):
    """Return a function that changes compressed bytes, at the start of the binary part."""

    def change(data: bytes) -> bytes:
        document, buffer = document_of(data)
        return glb(document, buffer[:place] + content + buffer[place + len(content) :])

    return change


@pytest.mark.parametrize(("change", "message"), [
    (with_bytes(0, b"DRAC0"), "the Draco data is damaged or does not have the version 2.2"),
    (with_bytes(5, b"\1"), "the Draco data is damaged or does not have the version 2.2"),
    (with_bytes(11, b"\xff\xff\xff\xff\x0f"),
     "the Draco data has 4294967295 faces and 2 vertices, but the accessors declare 2 faces"),
    (with_bytes(11, b"\3"),
     "the Draco data has 3 faces and 5 vertices, but the accessors declare 2 faces and 5"),
    (with_bytes(12, b"\x7f"),
     "the Draco data has 2 faces and 127 vertices, but the accessors declare 2 faces and 5"),
    (with_bytes(10, b"\x80" + b"\xff" * 60), "the Draco data is truncated"),
    (with_bytes(13, b"\xee" * 30), "the Draco data is damaged: "),
])  # fmt: skip
def test_draco_data_that_lies_is_refused(refuse, change, message):
    refuse("a.glb", change(draco_glb()), message)


@pytest.mark.parametrize(("change", "message"), [
    (lambda d: d["accessors"][0].update(count=9),
     "the Draco data has 2 faces and 5 vertices, but the accessors declare 3 faces and 5"),
    (lambda d: d["accessors"][1].update(count=10**8),
     "the arrays, including meshes[0], have more than 100 times the size of the files"),
    (lambda d: d["accessors"][1].update(count=4),
     "the Draco data has 2 faces and 5 vertices, but the accessors declare 2 faces and 4"),
    (lambda d: d["accessors"][1].update(count=6),
     "the sizes of the Draco data differ from the declared sizes"),
    (lambda d: d["accessors"][1].update(componentType=5123),
     "the Draco data has no rows of the type that accessors[1] declares"),
    (lambda d: d["meshes"][0]["primitives"][0].pop("indices"), "has damaged Draco data"),
    (lambda d: d["bufferViews"][0].update(byteLength=20), "the Draco data is damaged"),
    (lambda d: d["bufferViews"][0].update(byteLength=11), "the Draco data is truncated"),
    (lambda d: d["meshes"][0]["primitives"][0]["extensions"].update(
        KHR_draco_mesh_compression={"bufferView": 0, "attributes": {"POSITION": 5}}),
     "the Draco data has no rows of the type that accessors[1] declares"),
])  # fmt: skip
def test_documents_that_do_not_fit_their_draco_data_are_refused(refuse, change, message):
    refuse("a.glb", changed(draco_glb(), change), message)


def meshopt_of(document, view=0):
    return document["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]


@pytest.mark.parametrize(("change", "message"), [
    (lambda d: meshopt_of(d).update(byteLength=20), "bufferViews[0]: the meshopt data is"),
    (lambda d: meshopt_of(d).update(count=4), "accessors[0] is longer than its buffer"),
    (lambda d: meshopt_of(d).update(count=10**9),
     "the arrays, including bufferViews[0], have more than 100 times the size of"),
    (lambda d: meshopt_of(d).update(byteStride=7), "the meshopt data is damaged: a row must"),
    (lambda d: meshopt_of(d, 1).update(mode="STRIPS"), "bufferViews[1]: the meshopt data is"),
    (lambda d: meshopt_of(d).update(mode=None),
     "bufferViews[0] has an unknown compression"),
    (lambda d: meshopt_of(d).update(filter="BLUR"), "the meshopt data is damaged: filter"),
    (lambda d: meshopt_of(d).update(buffer=7), "there is no buffers[7]"),
    (lambda d: meshopt_of(d).update(byteOffset=10**6), "a buffer view is longer than its"),
    (lambda d: d["accessors"][0].update(count=6), "accessors[0] is longer than its buffer"),
])  # fmt: skip
def test_meshopt_data_that_lies_is_refused(refuse, change, message):
    refuse("a.glb", changed(meshopt_glb(), change), message)


def test_draco_keeps_the_type_of_quantized_positions():
    import DracoPy

    positions = np.array([[0, 0, 0], [32767, 0, 0], [0, -70, 5]], np.int16)
    data = DracoPy.encode(positions.astype(np.int32), faces=[[0, 1, 2]], preserve_order=True)
    data = data.replace(b"\0\5\3\0\0", b"\0\3\3\0\0")  # positions of int32 become int16
    assert_array_equal(compression.decode_draco(data, 1, 3)[1][0], positions, strict=True)


def test_draco_metadata_is_skipped():
    import DracoPy

    data = DracoPy.encode(VERTICES.astype(np.float32), faces=FACES.astype(np.uint32),
                          preserve_order=True, create_metadata=True,
                          generic_attributes={"x": np.zeros((5, 1), np.float32)})  # fmt: skip
    assert data[10] & 0x80
    assert len(compression.decode_draco(data, 2, 5)[0]) == 6
    with pytest.raises(MeshError, match="accessors declare 3 faces"):
        compression.decode_draco(data, 3, 5)


def packed_by_meshopt(data: bytes) -> bytes:
    """Return a GLB with compressed arrays and unchanged images."""
    document, buffer = document_of(data)
    content = b""
    sizes = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
    accessors = {each["bufferView"]: each for each in document["accessors"]}
    for number, view in enumerate(document["bufferViews"]):
        begin = view.get("byteOffset", 0)
        part = buffer[begin : begin + view["byteLength"]]
        content += b"\0" * (-len(content) % 4)
        view["byteOffset"] = len(content)
        accessor = accessors.get(number)
        if accessor is not None and accessor["componentType"] in (5125, 5126):
            rows = np.frombuffer(part, "<u4").reshape(-1, sizes[accessor["type"]])
            mode = "INDICES" if accessor["componentType"] == 5125 else "ATTRIBUTES"
            part = meshopt.encode_gltf_buffer(rows, mode)
            how = {"buffer": 0, "byteOffset": len(content), "byteLength": len(part),
                   "count": len(rows), "byteStride": 4 * rows.shape[1], "mode": mode}  # fmt: skip
            view |= {"buffer": 1, "extensions": {"EXT_meshopt_compression": how}, "byteOffset": 0}
        content += part
    fallback = {"EXT_meshopt_compression": {"fallback": True}}
    document["buffers"] = [{"byteLength": len(content)},
                           {"byteLength": len(buffer), "extensions": fallback}]  # fmt: skip
    return glb(document, content)


def test_textures_of_compressed_files_are_followed_and_kept(tmp_path):
    made = facade(tmp_path, edge=0.5)
    attributes = sf.MeshAttributes(texture=made.texture)
    sf.write_mesh(tmp_path / "plain.glb", made.mesh, attributes=attributes)
    data = packed_by_meshopt((tmp_path / "plain.glb").read_bytes())
    (tmp_path / "packed.glb").write_bytes(data)
    assert b"EXT_meshopt_compression" in data
    plain, packed = (
        (sf.segment(path, 60, features="texture").labels, read_attributes(path).texture)
        for path in (tmp_path / "plain.glb", tmp_path / "packed.glb")
    )
    assert_array_equal(packed[0], plain[0])
    assert_array_equal(packed[1].coordinates, plain[1].coordinates)
    assert packed[1].images[0].encoded() == plain[1].images[0].encoded()
    mesh, texture = read_mesh(tmp_path / "packed.glb"), packed[1]
    sf.write_mesh(tmp_path / "out.glb", mesh, packed[0],
                  attributes=sf.MeshAttributes(texture=texture))  # fmt: skip
    kept = read_attributes(tmp_path / "out.glb").texture
    assert kept.images[0].encoded() == plain[1].images[0].encoded()
