"""Instances, skins, morph weights, strips, fans, sparse accessors and colors of glTF."""

import numpy as np
import pytest
from mesh_files import glb
from numpy.testing import assert_allclose, assert_array_equal

from superfacets import read_attributes, read_cloud, read_labels, read_mesh, write_mesh

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
CORNERS = np.array([0, 1, 2, 0, 2, 3], "<u2")
CODES = {"f4": 5126, "u2": 5123, "u1": 5121}
KINDS = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class Document:
    """A glTF document to which arrays are added."""

    def __init__(self):
        self.buffer, self.views, self.accessors = b"", [], []

    def view(self, array):
        self.views.append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": array.nbytes})
        self.buffer += array.tobytes() + bytes(-array.nbytes % 4)
        return len(self.views) - 1

    def add(self, array, **more):
        array = np.asarray(array)
        self.accessors.append({
            "bufferView": self.view(array), "componentType": CODES[array.dtype.str[1:]],
            "count": len(array), "type": KINDS[array.shape[1:]], **more,
        })  # fmt: skip
        return len(self.accessors) - 1

    def content(self, primitive, nodes=({"mesh": 0},), **more):
        mesh = {"primitives": [primitive], **more.pop("mesh", {})}
        document = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [*range(len(nodes))]}],
            "nodes": [*nodes], "meshes": [mesh], "accessors": self.accessors,
            "bufferViews": self.views, "buffers": [{"byteLength": len(self.buffer)}], **more,
        }  # fmt: skip
        return glb({key: each for key, each in document.items() if each}, self.buffer)

    def write(self, path, *args, **more):
        path.write_bytes(self.content(*args, **more))
        return path

    def square(self, **attributes):
        indices = {"indices": self.add(CORNERS)}
        return {"attributes": {"POSITION": self.add(SQUARE), **attributes}, **indices}


@pytest.fixture
def document():
    return Document()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.glb"


def test_each_instance_is_a_copy(document, path):
    moves = np.array([[0, 0, 0], [5, 0, 0], [0, 0, 7]], "<f4")
    turn = np.array([[0, 0, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]], "<f4")  # a half turn about z
    rows = {"TRANSLATION": document.add(moves), "ROTATION": document.add(turn)}
    extension = {"EXT_mesh_gpu_instancing": {"attributes": rows}}
    node = {"mesh": 0, "translation": [0, 10, 0], "extensions": extension}
    mesh = read_mesh(document.write(path, document.square(), [node], extensionsUsed=[*extension]))
    assert mesh.n_faces == 6
    signs = np.array([[1, 1, 1], [-1, -1, 1], [1, 1, 1]])
    copies = SQUARE * signs[:, np.newaxis] + moves[:, np.newaxis] + [0, 10, 0]
    assert_allclose(mesh.vertices, copies.reshape(-1, 3), atol=1e-12)


def test_joints_place_a_skinned_mesh_and_its_node_does_not(document, path):
    bind = np.array([np.eye(4)] * 2, "<f4")
    bind[1, 3, 0] = -1  # column-major: a translation by -1 along x
    shares = document.add(np.float32([[1, 0, 0, 0], [0, 1, 0, 0], [0.5, 0, 0, 0], [0.25, 0, 0, 0]]))
    rest = document.add(np.float32(np.outer([0, 0, 0.5, 0], [0, 1, 0, 0])))
    joints = document.add(np.tile(np.array([0, 1, 0, 0], "u1"), (4, 1)))
    primitive = document.square(JOINTS_0=joints, WEIGHTS_0=shares, JOINTS_1=joints, WEIGHTS_1=rest)
    nodes = [
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"translation": [0, 0, 2]},
        {"translation": [1, 0, 4]},
    ]  # fmt: skip
    skin = {"joints": [1, 2], "inverseBindMatrices": document.add(bind)}
    mesh = read_mesh(document.write(path, primitive, nodes, skins=[skin]))
    assert_allclose(mesh.vertices, SQUARE + np.outer([2, 4, 3, 2], [0, 0, 1]), atol=1e-12)


@pytest.mark.parametrize("owner", ["mesh", "node"])
def test_morph_weights_move_vertices(document, path, owner):
    up = document.add(np.array([[0, 0, 1]] * 4, "<f4"))
    primitive = {**document.square(), "targets": [{"POSITION": up}]}
    given = {"node": {"weights": [0.25]}, "mesh": {"weights": [0.25]}}[owner]
    node = {"mesh": 0, **(given if owner == "node" else {})}
    more = {"mesh": given} if owner == "mesh" else {}
    assert_allclose(
        read_mesh(document.write(path, primitive, [node], **more)).vertices, SQUARE + [0, 0, 0.25]
    )


@pytest.mark.parametrize(("mode", "order", "faces"), [
    (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
    (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
])  # fmt: skip
def test_strips_and_fans_are_triangles(document, path, mode, order, faces):
    primitive = {**document.square(), "mode": mode, "indices": document.add(np.array(order, "<u2"))}
    assert_array_equal(read_mesh(document.write(path, primitive)).faces, faces)


@pytest.mark.parametrize("has_base", [True, False])
def test_sparse_rows_replace_others(document, path, has_base):
    primitive = document.square()
    places = document.view(np.array([1, 3], "<u2"))
    rows = np.array([[4, 5, 6], [7, 8, 9]], "<f4")
    accessor = document.accessors[primitive["attributes"]["POSITION"]]
    accessor["sparse"] = {
        "count": 2, "indices": {"bufferView": places, "componentType": 5123},
        "values": {"bufferView": document.view(rows), "componentType": 5121, "count": 1},
    }  # fmt: skip
    if not has_base:
        del accessor["bufferView"]
    expected = SQUARE * has_base
    expected[[1, 3]] = rows
    assert_array_equal(read_mesh(document.write(path, primitive)).vertices, expected)


def test_colors_are_read_as_srgb(document, path):
    linear = np.array([[0, 0.002, 0.2140411], [1, 0.5, 0.0331048], [2, -1, 0], [0] * 3], "<f4")
    found = read_attributes(document.write(path, document.square(COLOR_0=document.add(linear))))
    rows = np.column_stack([found.vertex[name] for name in ("red", "green", "blue")])
    assert rows.tolist() == [[0, 7, 127], [255, 188, 51], [255, 0, 0], [0, 0, 0]]


def test_points_are_a_cloud_and_declared(document, path):
    primitive = {"attributes": {"POSITION": document.add(SQUARE)}, "mode": 0}
    assert_array_equal(read_cloud(document.write(path, primitive)).points, SQUARE)
    assert read_attributes(path).left_out == ()


@pytest.mark.parametrize(("scenes", "nodes"), [
    (None, ({"mesh": 0},)), (None, ()), ([{"nodes": []}, {"nodes": [0]}], ({"mesh": 0},)),
])  # fmt: skip
def test_meshes_without_a_scene_are_read(document, path, scenes, nodes):
    assert read_mesh(document.write(path, document.square(), nodes, scenes=scenes)).n_faces == 2


def test_own_files_come_back_with_labels_and_without_colors_of_regions(path):
    write_mesh(path, (SQUARE, CORNERS.reshape(-1, 3)), [7, -1], classes=["lid"])
    assert read_labels(path).tolist() == [7, -1]
    attributes = read_attributes(path)
    assert attributes.left_out == (
        "column class of the table of regions",
        "vertex attribute COLOR_0, which are colors of regions",
    )
    assert not attributes.vertex
