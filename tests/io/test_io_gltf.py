"""Reading glTF and GLB."""

import base64
import json
import struct
import tracemalloc

import numpy as np
import pytest
from mesh_files import FACES, VERTICES, glb, gltf_buffer, gltf_document
from numpy.testing import assert_allclose, assert_array_equal

from superfacets import MeshError
from superfacets.files.guards import read_content
from superfacets.files.readers.read import read_mesh

HALF_TURN = [0, 0, 0.5**0.5, 0.5**0.5]
"""A quarter turn about z, as a quaternion."""


def changed(path, value, document=None):
    """Return a copy of a document with one value changed, or removed if the value is None."""
    document = json.loads(json.dumps(document or gltf_document()))
    *above, last = path
    item = document
    for key in above:
        item = item[key]
    if value is None:
        del item[last]
    else:
        item[last] = value
    return document


def test_vertices_and_faces_are_those_of_the_file_in_their_order(read):
    mesh = read("a.glb", glb())
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)


def test_a_document_with_its_buffer_inside(read):
    address = "data:application/octet-stream;base64," + base64.b64encode(gltf_buffer()).decode()
    document = gltf_document(buffers=[{"byteLength": 72, "uri": address}])
    assert_array_equal(read("a.gltf", json.dumps(document).encode()).vertices, VERTICES)


def test_a_document_with_its_buffer_beside_it(read, tmp_path):
    (tmp_path / "my buffer.bin").write_bytes(gltf_buffer())
    document = gltf_document(buffers=[{"byteLength": 72, "uri": "my%20buffer.bin"}])
    assert_array_equal(read("a.gltf", json.dumps(document).encode()).faces, FACES)


def test_a_glb_file_named_gltf_is_read(read):
    assert read("a.gltf", glb()).n_faces == 2


@pytest.mark.parametrize(("node", "moved"), [
    ({"translation": [1, 2, 3]}, VERTICES + [1, 2, 3]),
    ({"scale": [2, 3, 4]}, VERTICES * [2, 3, 4]),
    ({"rotation": HALF_TURN}, VERTICES[:, [1, 0, 2]] * [-1, 1, 1]),
    ({"rotation": [0, 0, 5, 5]}, VERTICES[:, [1, 0, 2]] * [-1, 1, 1]),
    ({"rotation": [1, 0, 0, 0]}, VERTICES * [1, -1, -1]),
    ({"rotation": [0, 1, 0, 0]}, VERTICES * [-1, 1, -1]),
    ({"rotation": [0.5, 0.5, 0.5, 0.5]}, VERTICES[:, [2, 0, 1]]),
    ({"translation": [1, 2, 3], "rotation": HALF_TURN, "scale": [2, 1, 1]},
     (VERTICES * [2, 1, 1])[:, [1, 0, 2]] * [-1, 1, 1] + [1, 2, 3]),
    ({"matrix": [0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 5, 6, 7, 1]},
     VERTICES[:, [2, 0, 1]] + [5, 6, 7]),
])  # fmt: skip
def test_nodes_move_their_meshes(read, node, moved):
    mesh = read("a.glb", glb(gltf_document([{"mesh": 0, **node}])))
    assert_allclose(mesh.vertices, moved, atol=1e-15)
    assert_array_equal(mesh.faces, FACES)


def test_parents_move_their_children(read):
    nodes = [{"children": [1], "translation": [1, 0, 0], "rotation": HALF_TURN}]
    nodes += [{"mesh": 0, "translation": [10, 0, 0]}]
    mesh = read("a.glb", glb(gltf_document(nodes, scenes=[{"nodes": [0]}])))
    assert_allclose(mesh.vertices, (VERTICES + [10, 0, 0])[:, [1, 0, 2]] * [-1, 1, 1] + [1, 0, 0])


def test_faces_of_a_mirrored_mesh_still_face_outward(read):
    mesh = read("a.glb", glb(gltf_document([{"mesh": 0, "scale": [-1, 1, 1]}])))
    assert_array_equal(mesh.vertices, VERTICES * [-1, 1, 1])
    assert_array_equal(mesh.faces, FACES[:, [0, 2, 1]])


def test_a_mesh_comes_once_per_node_and_meshes_in_file_order(read):
    document = gltf_document(
        [
            {"mesh": 1},
            {"mesh": 0, "translation": [0, 0, 1]},
            {"mesh": 0, "translation": [0, 0, 2]},
            {"mesh": 1},
        ],
        scenes=[{"nodes": []}, {"nodes": [2, 0, 1]}],
        scene=1,
        meshes=gltf_document()["meshes"]
        + [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 2}]}],
    )
    document["accessors"].append({**document["accessors"][1], "byteOffset": 6, "count": 3})
    mesh = read("a.glb", glb(document))
    expected = [VERTICES + [0, 0, 2], VERTICES + [0, 0, 1], VERTICES]
    assert_array_equal(mesh.vertices, np.concatenate(expected))
    assert_array_equal(mesh.faces, np.concatenate([FACES, FACES + 5, FACES[1:] + 10]))


def test_primitives_of_one_mesh_share_the_vertices_that_they_share_in_the_file(read):
    document = gltf_document()
    document["accessors"][1]["count"] = 3
    document["accessors"].append({**document["accessors"][1], "byteOffset": 6})
    shared, other = {"POSITION": 0}, {"POSITION": 3}
    document["accessors"].append(dict(document["accessors"][0]))
    document["meshes"][0]["primitives"] = [
        {"attributes": shared, "indices": 1},
        {"attributes": other, "indices": 1},
        {"attributes": shared, "indices": 2},
    ]
    mesh = read("a.glb", glb(document))
    assert_array_equal(mesh.vertices, np.concatenate([VERTICES, VERTICES]))
    assert_array_equal(mesh.faces, [FACES[0], FACES[0] + 5, FACES[1]])


def test_vertices_without_indices_are_corners_in_their_order(read):
    document = changed(["meshes", 0, "primitives", 0, "indices"], None)
    document["accessors"][0]["count"] = 3
    mesh = read("a.glb", glb(document))
    assert_array_equal(mesh.vertices, VERTICES[:3])
    assert_array_equal(mesh.faces, [[0, 1, 2]])


@pytest.mark.parametrize(("code", "dtype"), [(5121, "<u1"), (5125, "<u4")])
def test_indices_of_other_types(read, code, dtype):
    buffer = np.asarray(VERTICES, "<f4").tobytes() + FACES.astype(dtype).tobytes()
    document = changed(["accessors", 1, "componentType"], code)
    document["bufferViews"][1]["byteLength"] = len(buffer) - 60
    document["buffers"][0]["byteLength"] = len(buffer)
    assert_array_equal(read("a.glb", glb(document, buffer)).faces, FACES)


def test_positions_between_other_data(read):
    rows = np.zeros(5, dtype=[("before", "<f4"), ("position", "<f4", 3), ("after", "<f4", 2)])
    rows["position"] = VERTICES
    document = gltf_document(
        bufferViews=[
            {"buffer": 0, "byteOffset": 0, "byteLength": 120, "byteStride": 24},
            {"buffer": 0, "byteOffset": 120, "byteLength": 12},
        ],
        buffers=[{"byteLength": 132}],
    )
    document["accessors"][0]["byteOffset"] = 4
    buffer = rows.tobytes() + FACES.astype("<u2").tobytes()
    assert_array_equal(read("a.glb", glb(document, buffer)).vertices, VERTICES)


@pytest.mark.parametrize(
    ("code", "dtype", "normalized", "scale"),
    [(5122, "<i2", True, 1 / 32767), (5123, "<u2", False, 1), (5120, "<i1", True, 1 / 127)],
)
def test_quantized_positions_become_what_they_stand_for(read, code, dtype, normalized, scale):
    stored = np.array([[0, 0, 0], [100, 0, 0], [0, 127, 0], [0, 0, 1], [1, 2, 3]], dtype)
    document = changed(["accessors", 0, "componentType"], code)
    document["accessors"][0]["normalized"] = normalized
    document["bufferViews"][0]["byteLength"] = stored.nbytes
    document["bufferViews"][1]["byteOffset"] = stored.nbytes
    document["buffers"][0]["byteLength"] = stored.nbytes + 12
    mesh = read("a.glb", glb(document, stored.tobytes() + FACES.astype("<u2").tobytes()))
    assert_allclose(mesh.vertices, stored * scale, rtol=1e-15)


def test_an_empty_node_and_an_empty_mesh_are_skipped(read):
    document = gltf_document([{"name": "light"}, {"mesh": 1}, {"mesh": 0}])
    document["meshes"].append({"primitives": []})
    assert_array_equal(read("a.glb", glb(document)).faces, FACES)


PRIMITIVE = ["meshes", 0, "primitives", 0]


@pytest.mark.parametrize(("path", "value", "message"), [
    (["asset"], None, "not a glTF file: the JSON has no asset"),
    (["asset", "version"], "1.0", "the glTF version must be 2.0, got '1.0'"),
    (["asset", "version"], 2, "the glTF version must be 2.0, got 2"),
    (["extensionsRequired"], ["EXT_mesh_shreds"], "EXT_mesh_shreds is not supported"),
    (["scene"], 1, "there is no scenes[1]"),
    (["scene"], -1, "there is no scenes[-1]"),
    (["scene"], True, "there is no scenes[True]"),
    (["scenes", 0], 5, "scenes is not a list of objects"),
    (["scenes", 0, "nodes"], 5, "nodes is not a list"),
    (["scenes", 0, "nodes"], [], "no scene of the glTF file has a mesh"),
    (["scenes", 0, "nodes"], [0, 0], "nodes[0] has two parents or is in a loop"),
    (["nodes", 0, "children"], [0], "nodes[0] has two parents or is in a loop"),
    (["nodes", 0, "children"], [7], "there is no nodes[7]"),
    (["nodes", 0, "mesh"], 7, "there is no meshes[7]"),
    (["nodes", 0, "mesh"], "0", "there is no meshes['0']"),
    (["nodes", 0, "mesh"], None, "no scene of the glTF file has a mesh"),
    (["nodes", 0, "scale"], [1, 1], "scale must be a list of 3 numbers"),
    (["nodes", 0, "scale"], [1, 1, "1"], "scale must be a list of 3 numbers"),
    (["nodes", 0, "translation"], 4, "translation must be a list of 3 numbers"),
    (["nodes", 0, "translation"], [0, 0, 10**400], "which does not fit into 64 bits"),
    (["nodes", 0, "rotation"], [0, 0, 0, 0], "the rotation of a node is the zero quaternion"),
    (["nodes", 0, "matrix"], [1, 2, 3], "matrix must be a list of 16 numbers"),
    (["nodes", 0, "scale"], [1e300] * 3, "bounding box"),
    (["nodes", 0, "matrix"], [1.7e308] * 16, "vertices[1] must be finite, got [inf, inf, inf]"),
    (["meshes", 0, "primitives"], {}, "primitives is not a list of objects"),
    ([*PRIMITIVE, "attributes"], [], "meshes[0] has a primitive without positions"),
    ([*PRIMITIVE, "attributes"], {}, "meshes[0] has a primitive without positions"),
    ([*PRIMITIVE, "attributes", "POSITION"], 9, "there is no accessors[9]"),
    ([*PRIMITIVE, "attributes", "POSITION"], 1, "accessors[1] must have the type VEC3"),
    ([*PRIMITIVE, "indices"], 0, "accessors[0] must have the type SCALAR"),
    ([*PRIMITIVE, "mode"], 0, "the file contains points, but no faces: use read_cloud"),
    ([*PRIMITIVE, "mode"], -4, "mode must be an integer >= 0, got -4"),
    ([*PRIMITIVE, "indices"], None, "a multiple of 3 corners is expected, got 5"),
    (["accessors", 0, "bufferView"], None, "all faces lie at one point"),
    (["accessors", 0, "sparse"], {"count": 1}, "accessors[0] has no indices or values of"),
    (["accessors", 0, "bufferView"], 2, "there is no bufferViews[2]"),
    (["accessors", 0, "componentType"], 5124, "accessors[0] has an unknown type of numbers"),
    (["accessors", 0, "type"], ["VEC3"], "accessors[0] has an unknown type of numbers"),
    (["accessors", 0, "componentType"], [], "componentType must be an integer >= 0, got []"),
    (["accessors", 0, "count"], 4_000_000_000, "accessors[0] is longer than its buffer view"),
    (["accessors", 0, "count"], 6, "accessors[0] is longer than its buffer view"),
    (["accessors", 0, "count"], -1, "count must be an integer >= 0, got -1"),
    (["accessors", 0, "count"], 5.0, "count must be an integer >= 0, got 5.0"),
    (["accessors", 0, "count"], 0,
     "a face refers to vertex 3, but its primitive has 0 vertices"),
    (["accessors", 0, "byteOffset"], 10**18, "accessors[0] is longer than its buffer view"),
    (["accessors", 1, "count"], 5, "a multiple of 3 corners is expected, got 5"),
    (["accessors", 1, "count"], 0, "the file contains points, but no faces: use read_cloud"),
    (["accessors", 1, "count"], 9, "accessors[1] is longer than its buffer view"),
    (["accessors", 1, "componentType"], 5122, "vertex indices must be unsigned integers"),
    (["bufferViews", 0, "byteStride"], 8, "the rows of accessors[0] overlap"),
    (["bufferViews", 0, "byteLength"], 5000, "a buffer view is longer than its buffer"),
    (["bufferViews", 1, "byteOffset"], 61, "a buffer view is longer than its buffer"),
    (["bufferViews", 0, "buffer"], 1, "there is no buffers[1]"),
    (["buffers"], None, "there is no buffers[0]"),
    (["buffers", 0, "byteLength"], 73, "buffers[0] declares 73 bytes but has 72"),
    (["buffers", 0, "byteLength"], None, "byteLength must be an integer >= 0, got None"),
    (["buffers", 0, "uri"], 7, "buffers[0] must have a uri"),
    (["buffers", 0, "uri"], "absent.bin",
     "the buffer file 'absent.bin' of the glTF file cannot be read"),
    (["buffers", 0, "uri"], "http://x.org/a",
     "the buffer 'http://x.org/a' is not in the folder of the glTF file"),
    (["buffers", 0, "uri"], "/etc/hosts",
     "the buffer '/etc/hosts' is not in the folder of the glTF file"),
    (["buffers", 0, "uri"], "a%00b",
     "the buffer 'a%00b' is not in the folder of the glTF file"),
    (["buffers", 0, "uri"], "data:;base64,?", "'data:;base64,?' is not base64"),
    (["buffers", 0, "uri"], "data:x", "'data:x' is not base64"),
])  # fmt: skip
def test_documents_that_are_wrong_are_refused(refuse, path, value, message):
    refuse("a.glb", glb(changed(path, value)), message)


def test_a_second_buffer_needs_an_address(refuse):
    document = gltf_document(buffers=[{"byteLength": 72}, {"byteLength": 72}])
    document["bufferViews"][0]["buffer"] = 1
    refuse("a.glb", glb(document), "buffers[1] must have a uri")


def test_an_empty_buffer_beside_the_document_is_refused(refuse, tmp_path):
    (tmp_path / "empty.bin").write_bytes(b"")
    document = gltf_document(buffers=[{"byteLength": 72, "uri": "empty.bin"}])
    refuse("a.glb", glb(document), "empty.bin: the file is empty")


@pytest.fixture
def secret(tmp_path):
    """Write a file outside of the folder of meshes, and return its path."""
    (tmp_path / "secret").write_bytes(gltf_buffer())
    (tmp_path / "scene").mkdir()
    return tmp_path / "secret"


@pytest.mark.parametrize(
    "address",
    ["../secret", "%2e%2e/secret", "..%2Fsecret", "%2e%2e%2fsecret", "a/../../secret", "link"],
)
def test_buffers_outside_of_the_folder_are_refused(secret, address):
    folder = secret.parent / "scene"
    (folder / "a").mkdir()
    (folder / "link").symlink_to(secret)
    check_refused(folder, address, "is not in the folder of the glTF file")


def test_an_absolute_path_that_is_escaped_is_refused(secret):
    escaped = str(secret).replace("/", "%2F")
    check_refused(secret.parent / "scene", escaped, "is not in the folder of the glTF file")
    check_refused(secret.parent / "scene", ".", "of the glTF file cannot be read")


@pytest.mark.parametrize("address", ["\ud800", "%ff", "%ed%a0%80", "a" * 5000])
def test_addresses_that_name_no_file_anywhere_are_refused(tmp_path, address):
    check_refused(tmp_path, address, "of the glTF file cannot be read")


def check_refused(folder, address, message):
    path = folder / "a.gltf"
    path.write_text(json.dumps(gltf_document(buffers=[{"byteLength": 72, "uri": address}])))
    with pytest.raises(MeshError, match=message) as caught:
        read_mesh(path)
    assert len(str(caught.value)) < 400
    str(caught.value).encode()


@pytest.mark.parametrize("address", ["sub/a.bin", "sub/../sub/a.bin", "./sub%2Fa.bin", "inner"])
def test_buffers_below_the_folder_are_read(tmp_path, address):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.bin").write_bytes(gltf_buffer())
    (tmp_path / "inner").symlink_to(tmp_path / "sub" / "a.bin")
    (tmp_path / "linked").symlink_to(tmp_path, target_is_directory=True)
    document = gltf_document(buffers=[{"byteLength": 72, "uri": address}])
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    assert_array_equal(read_mesh(tmp_path / "a.gltf").faces, FACES)
    assert_array_equal(read_mesh(tmp_path / "linked" / "a.gltf").faces, FACES)


def test_a_file_that_many_buffers_name_is_read_once(read, tmp_path, monkeypatch):
    (tmp_path / "a.bin").write_bytes(gltf_buffer())
    calls = []

    def counting(path):
        calls.append(path)
        return read_content(path)

    monkeypatch.setattr("superfacets.files.guards.read_content", counting)
    names = ["a.bin", "./a.bin", "%61.bin"] * 100
    document = gltf_document(buffers=[{"byteLength": 72, "uri": name} for name in names])
    assert read("a.gltf", json.dumps(document).encode()).n_faces == 2
    assert len(calls) == 1


@pytest.mark.parametrize("repeats", ["nodes", "primitives", "both"])
def test_a_scene_that_repeats_its_meshes_without_end_is_refused(refuse, limit, repeats):
    limit("bytes of a small scene", 100_000)
    limit("growth of a scene", 2)
    document = gltf_document()
    if repeats != "primitives":
        document["nodes"] *= 100
        document["scenes"] = [{"nodes": list(range(100))}]
    if repeats != "nodes":
        document["meshes"][0]["primitives"] *= 5000 if repeats == "primitives" else 60
        limit("growth of a scene", 0)
    else:
        limit("bytes of a small scene", 1000)
    refuse("a.glb", glb(document), "the arrays, including copies of meshes[0], have more than")


def test_a_bomb_is_refused_before_it_takes_memory(refuse):
    corners = np.arange(19_600 * 3, dtype="<u2") % 5
    buffer = np.asarray(VERTICES, "<f4").tobytes() + corners.tobytes()
    document = gltf_document([{"mesh": 0}] * 4000, scenes=[{"nodes": list(range(4000))}])
    document["accessors"][1]["count"] = len(corners)
    document["bufferViews"][1]["byteLength"] = corners.nbytes
    document["buffers"][0]["byteLength"] = len(buffer)
    tracemalloc.start()
    refuse("a.glb", glb(document, buffer), "more than 100 times the size of the files")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6


def test_a_small_scene_may_repeat_a_part_a_thousand_times(read):
    document = gltf_document([{"mesh": 0}] * 1000, scenes=[{"nodes": list(range(1000))}])
    assert read("a.glb", glb(document)).n_faces == 2000


def test_indices_out_of_range_are_refused(refuse):
    faces = FACES.copy()
    faces[1, 1] = 5
    message = "a face refers to vertex 5, but its primitive has 5 vertices"
    refuse("a.glb", glb(buffer=gltf_buffer(faces=faces)), message)


@pytest.mark.parametrize(("data", "message"), [
    (b"hello", "the glTF file is not valid JSON"),
    (b"\xff\xd8\xff\xe0\0\x10JFIF\0" * 20, "the file is a picture, not a mesh"),
    (b"[" * 200_000, "the glTF file is nested too deeply"),
    (b'{"asset": NaN}', "the glTF file has the number NaN, which"),
    (b"[]", "not a glTF file: the JSON has no asset"),
    (b"glTF", "the file ends after 4 bytes, but 8 more are declared at byte 4"),
    (glb()[:-1], "bytes but has"), (glb() + b"\0", "bytes but has"),
    (b"glTF\1" + glb()[5:], "the GLB version must be 2, got 1"),
    (glb()[:12] + b"\xff\xff\xff\x7f" + glb()[16:], "2147483647 more are declared at byte 20"),
    (glb()[:16] + b"NOSJ" + glb()[20:], "there is no JSON chunk"),
    (glb().replace(b"BIN\0", b"BOX\0"), "buffers[0] declares 72 bytes but has 0"),
    (glb().replace(b"\x48\0\0\0BIN\0", b"\x49\0\0\0BIN\0"), "73 more are declared at byte"),
])  # fmt: skip
def test_containers_that_are_wrong_are_refused(refuse, data, message):
    refuse("a.glb", data, message)


def test_the_header_of_the_second_chunk_may_not_be_cut(refuse):
    end = glb().index(b"BIN\0")
    refuse(
        "a.glb",
        glb()[:8] + struct.pack("<I", end) + glb()[12:end],
        f"8 more are declared at byte {end - 4}",
    )


def test_a_glb_without_a_second_chunk(read, tmp_path):
    (tmp_path / "b.bin").write_bytes(gltf_buffer())
    whole = glb(gltf_document(buffers=[{"byteLength": 72, "uri": "b.bin"}]))
    end = whole.index(b"BIN\0") - 4
    assert read("a.glb", whole[:8] + struct.pack("<I", end) + whole[12:end]).n_faces == 2


def test_a_scene_that_trimesh_wrote_is_read_in_the_order_of_its_meshes(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(2)
    box = trimesh.creation.box()
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3], [4, 5, 6])
    scene.add_geometry(ball, "ball", geom_name="ball")
    scene.add_geometry(box, "box", geom_name="box", transform=turn)
    path = tmp_path / "scene.glb"
    scene.export(path)
    mesh = read_mesh(path)
    parts = [ball, box.apply_transform(turn)]
    assert mesh.n_faces == sum(len(part.faces) for part in parts)
    vertices = np.concatenate([part.vertices for part in parts])
    assert_allclose(mesh.vertices, vertices, atol=1e-6)
    assert_array_equal(mesh.faces, np.concatenate([ball.faces, box.faces + len(ball.vertices)]))
