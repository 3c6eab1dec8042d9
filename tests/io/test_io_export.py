"""Formats of other tools, read by the rules of the tool or by the tool itself."""

import json
import struct
import tracemalloc
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapes
from mesh_files import FACES, VERTICES
from numpy.testing import assert_allclose, assert_array_equal

from superfacets import (
    Mesh,
    MeshAttributes,
    MeshError,
    PointCloud,
    read_attributes,
    read_cloud,
    read_labels,
    read_mesh,
    region_graph,
    split_regions,
    vertex_labels,
    write_labels,
    write_mesh,
    write_regions,
)
from superfacets.files.formats import FORMATS
from superfacets.files.writers.cells import FormatOptions
from superfacets.files.writers.write import OutputFiles
from superfacets_scans import write_graphs
from superfacets_scans.scannet import scene_of

SEGMENTS = "scene0000_00_vh_clean_2.0.010000.segs.json"
NEW_ID = "^in {}, new ids for 1 vertex without a face or region$"

TETS = shapes.two_tets()


@pytest.fixture
def square():
    """Return two triangles, of which the second is larger, and an unused vertex."""
    return Mesh(VERTICES, FACES)


@pytest.fixture
def house():
    return shapes.house()


class TestScanNet:
    def test_segments_are_one_line_without_spaces(self, square, tmp_path):
        with pytest.warns(UserWarning, match=NEW_ID.format(".segs.json")):
            write_mesh(tmp_path / SEGMENTS, square, [7, 0])
        assert (tmp_path / SEGMENTS).read_bytes() == (
            b'{"params":{"software":"superfacets","nSegments":3},"sceneId":"scene0000_00",'
            b'"segIndices":[0,7,0,0,8]}'
        )

    def test_segments_are_found_and_read_as_mask3d_does(self, tmp_path):
        mesh = shapes.bumpy_sheet(12)
        labels = np.arange(mesh.n_faces) % 144 // 48
        write_mesh(tmp_path / SEGMENTS, mesh, labels)
        (path,) = tmp_path.glob("*[0-9].segs.json")
        segments = np.array(json.loads(path.read_text())["segIndices"])
        assert len(segments) == mesh.n_vertices
        assert all(segments[mesh.faces[face]].max() <= labels.max() for face in range(9))
        of_faces = labels.repeat(3)
        for vertex in range(mesh.n_vertices):
            around = {*of_faces[mesh.faces.ravel() == vertex]}
            assert len(around) > 1 or around == {segments[vertex]}

    def test_given_labels_are_those_of_vertices(self, tmp_path):
        write_labels(tmp_path / "a.0.010000.segs.json", [3, 1, 1])
        document = json.loads((tmp_path / "a.0.010000.segs.json").read_text())
        assert (document["sceneId"], document["segIndices"]) == ("a", [3, 1, 1])

    def test_points_keep_their_labels(self, tmp_path):
        write_mesh(tmp_path / "a.segs.json", PointCloud(VERTICES), [4, 3, 2, 1, 0])
        assert json.loads((tmp_path / "a.segs.json").read_text())["segIndices"] == [4, 3, 2, 1, 0]

    @pytest.mark.parametrize(
        ("name", "scene"),
        [
            ("scene0000_00_vh_clean_2.0.010000.segs.json", "scene0000_00"),
            ("scene0000_00_vh_clean.segs.json", "scene0000_00"),
            ("my.scan.0.010000.segs.json", "my.scan"),
            ("_vh_clean_2.segs.json", "_vh_clean_2"),
            ("room.SEGS.json", "room"),
        ],
    )
    def test_the_scene_is_in_the_name_of_the_file(self, name, scene):
        assert scene_of(Path(name), ".segs.json") == scene

    def test_a_name_that_is_no_ascii_stays_json(self, tmp_path):
        write_labels(tmp_path / 'a"é.segs.json', [0, 1])
        assert json.loads((tmp_path / 'a"é.segs.json').read_text())["sceneId"] == 'a"é'

    def test_every_segment_of_the_skeleton_is_a_group(self, square, tmp_path):
        write_mesh(tmp_path / "scene0000_00.aggregation.json", square, [7, 0])
        assert json.loads((tmp_path / "scene0000_00.aggregation.json").read_text()) == {
            "sceneId": "scannet.scene0000_00",
            "appId": "superfacets",
            "segGroups": [
                {"id": 0, "objectId": 0, "segments": [0], "label": "unknown"},
                {"id": 1, "objectId": 1, "segments": [7], "label": "unknown"},
            ],
            "segmentsFile": f"scannet.{SEGMENTS}",
        }

    def test_groups_have_classes(self, square, tmp_path):
        write_mesh(tmp_path / "a.aggregation.json", square, [-1, 3], classes=["couch"])
        groups = json.loads((tmp_path / "a.aggregation.json").read_text())["segGroups"]
        assert groups == [{"id": 0, "objectId": 0, "segments": [3], "label": "couch"}]

    def test_ids_that_float32_does_not_hold_are_refused(self, tmp_path):
        write_labels(tmp_path / "a.segs.json", [2**24 - 1])
        for ending in (".segs.json", ".aggregation.json"):
            with pytest.raises(
                MeshError,
                match=r"labels must be below 2\*\*24 in this format, got 16777216: renumber them",
            ):
                write_labels(tmp_path / f"b{ending}", [2**24, 0])

    def test_labels_are_checked_before_a_file_is_made(self, square, tmp_path):
        for name in ("a.segs.json", "a.bin", "a_sp_label.npy"):
            why = rf"^labels\[1\] must be >= 0 in {name[1:]}, got -1"
            with pytest.raises(MeshError, match=f"{why}$"):
                write_mesh(tmp_path / name, square, [0, -1])
            with pytest.raises(MeshError, match=f"{why}: vertices without a face or region get"):
                write_labels(tmp_path / name, [0, -1])
        assert not list(tmp_path.iterdir())


def sstk_hierarchy(document):
    """Return levels from fine to coarse: the segment of each triangle, then of each finer segment.

    The rules are those of `Segments.js` of the Scene Toolkit for indexed segmentations.
    """
    by_name = {segmentation["name"]: segmentation for segmentation in document["segmentation"]}
    indices = [by_name[name]["index"] for name in document["hierarchies"][0]["levels"]]
    levels = [indices[0]]
    for fine, coarse in pairwise(indices):
        converted = {}
        for segment, parent in zip(fine, coarse, strict=True):
            assert converted.setdefault(segment, parent) == parent
        levels.append(converted)
    return levels


class TestSstk:
    def test_a_segmentation_has_an_entry_per_triangle(self, square, tmp_path):
        write_mesh(tmp_path / "a.sstk.json", square, [7, -1])
        document = json.loads((tmp_path / "a.sstk.json").read_text())
        assert (document["elementType"], document["elementCount"]) == ("triangles", 2)
        assert sstk_hierarchy(document) == [[7, -1]]

    def test_levels_go_from_fine_to_coarse(self, tmp_path):
        write_labels(tmp_path / "a.sstk.json", [[0, 1, 2, 3], [0, 0, 1, 1], [5, 5, 5, 5]])
        document = json.loads((tmp_path / "a.sstk.json").read_text())
        assert document["elementCount"] == 4
        assert {part["elementType"] for part in document["segmentation"]} == {"triangles"}
        assert sstk_hierarchy(document) == [[0, 1, 2, 3], {0: 0, 1: 0, 2: 1, 3: 1}, {0: 5, 1: 5}]

    def test_levels_that_are_not_nested_are_refused(self, tmp_path):
        with pytest.raises(
            MeshError, match=r"region 4 of level 0 is in several regions of level 1"
        ):
            write_labels(tmp_path / "a.sstk.json", [[4, 4, 2], [0, 1, 1]])

    def test_only_triangles_have_one(self, house, tmp_path):
        for cells, what in (
            (house, ", not polygons: segment the result of PolygonMesh.triangulate"),
            (TETS, ", but the cells are tets"),
        ):
            with pytest.raises(MeshError, match=f"needs labels of triangles{what}"):
                write_mesh(tmp_path / "a.sstk.json", cells, [0, 1])


class TestSuperpoints:
    def test_ids_are_64_bit_numbers_without_gaps(self, square, tmp_path):
        for name in ("a.bin", "a_sp_label.npy"):
            with pytest.warns(UserWarning, match=NEW_ID.format(name[1:])):
                write_mesh(tmp_path / name, square, [7, 0])
        expected = [0, 1, 0, 0, 2]  # 0, 7, 0, 0 and one of its own
        assert_array_equal(np.fromfile(tmp_path / "a.bin", "<i8"), expected)
        stored = np.load(tmp_path / "a_sp_label.npy")
        assert stored.dtype == np.int64
        assert_array_equal(stored, expected)

    def test_given_ids_are_renumbered_in_their_order(self, tmp_path):
        write_labels(tmp_path / "a.bin", [30, 10, 20])
        assert np.fromfile(tmp_path / "a.bin", "<i8").tolist() == [2, 0, 1]

    def test_tetrahedra_have_vertices_too(self, tmp_path):
        write_mesh(tmp_path / "a.bin", TETS, [1, 0])
        assert np.fromfile(tmp_path / "a.bin", "<i8").tolist()[::4] == [1, 0]


GRAPH = {
    "edge_index": np.array([[0, 1, 1, 2], [1, 0, 2, 1]], dtype=np.int32),
    "edge_attr": np.array([[1.0, 0.5]] * 4, dtype=np.float32),
    "pos": np.eye(3, dtype=np.float32),
    "super_index": [0, 0, 1, 2, 2],
}
COARSE = {"edge_index": np.empty((2, 0)), "pos": [[0.5, 0.5, 0.5]], "super_index": [0, 0, 0]}


def data_of(file):
    """Return the arguments of torch_geometric.data.Data, which makes no more checks than this."""
    data = dict(file)
    assert data["edge_index"].dtype == data["super_index"].dtype == np.int64
    assert data["edge_index"].max(initial=-1) < len(data["pos"])
    return data


class TestPyTorchGeometric:
    def test_a_graph_keeps_the_names_of_its_arrays(self, tmp_path):
        write_graphs(tmp_path / "a.npz", GRAPH)
        with np.load(tmp_path / "a.npz") as file:
            data = data_of(file)
        assert data.keys() == GRAPH.keys()
        assert data["edge_attr"].dtype == data["pos"].dtype == np.float32
        for name, values in GRAPH.items():
            assert_array_equal(data[name], values)

    def test_a_mesh_and_its_labels_make_one_whose_nodes_are_superpoints(self, tmp_path):
        sheet = shapes.bumpy_sheet(12)
        labels = np.arange(288) // 24 * 5  # with gaps; regions of few vertices, which grow
        labels[:24] = -1
        write_mesh(tmp_path / "a.npz", sheet, labels)
        with np.load(tmp_path / "a.npz") as file:
            data = data_of(file)
        ids = vertex_labels(sheet, labels, method="creases", min_vertices=20)
        assert data["region"].tolist() == np.unique(ids[ids >= 0]).tolist()
        nodes = data["vertex_super_index"]
        for name, values in region_graph(sheet, nodes).to_pyg().items():
            assert_array_equal(data[name], values)
        write_mesh(tmp_path / "a.npz", sheet, nodes)
        with np.load(tmp_path / "a.npz") as file:
            assert_array_equal(file["vertex_super_index"], nodes)
            assert_array_equal(file["x"], data["x"])
        assert np.append(data["region"], -1)[nodes].tolist() == ids.tolist()
        write_mesh(tmp_path / "a.npz", Mesh([*sheet.vertices, [0, 0, 9]], sheet.faces), labels)
        with np.load(tmp_path / "a.npz") as file:
            assert file["vertex_super_index"].tolist() == [*nodes.tolist(), -1]
        files = OutputFiles([tmp_path / name for name in ("a.npz", SEGMENTS, "a.bin")])
        lone = Mesh([*sheet.vertices, [0, 0, 9]], sheet.faces)
        (note,) = files.write(lone, np.arange(288) // 24 * 5).notes()
        assert note == NEW_ID[1:-1].format(".npz and .segs.json and .bin")
        with np.load(tmp_path / "a.npz") as file:  # nodes are the same as in files of ids
            nodes = file["vertex_super_index"].tolist()
            assert (nodes, file["region"][-1]) == ([*np.fromfile(tmp_path / "a.bin", "<i8")], 56)
        write_mesh(tmp_path / "b.npz", PointCloud(sheet.vertices), np.arange(169) // 13)
        with np.load(tmp_path / "b.npz") as file:  # a point is a cell
            assert "vertex_super_index" not in file

    def test_nothing_is_no_graph(self, square, tmp_path):
        with pytest.raises(
            MeshError, match="a graph needs at least one region, but all labels are -1"
        ):
            write_mesh(tmp_path / "a.npz", square, [-1, -1])

    def test_each_level_points_into_the_next(self, tmp_path):
        write_graphs(tmp_path / "a.npz", [GRAPH, COARSE])
        with np.load(tmp_path / "a.npz") as file:
            levels = [
                {key[7:]: file[key] for key in file if key.startswith(f"level{level}_")}
                for level in range(3)
            ]
        assert levels[0].keys() == {"super_index"}
        assert levels[1].keys() == GRAPH.keys()
        assert "super_index" not in levels[2]
        for below, above in pairwise(levels):
            assert below["super_index"].max() < len(above["pos"])
            assert len(below["super_index"]) == len(below.get("pos", GRAPH["super_index"]))
        assert levels[1]["super_index"][levels[0]["super_index"]].tolist() == [0] * 5

    @pytest.mark.parametrize(
        ("graphs", "message"),
        [
            ([], "graphs must contain at least one graph"),
            ({"pos": [[0, 0, 0]]}, "edge_index is missing"),
            ({"edge_index": [[], []]}, "pos is missing"),
            ([GRAPH, {"edge_index": [[], []], "super_index": []}], r"graphs\[1\]: pos is missing"),
            ([{"edge_index": [[], []], "pos": [[0]]}],
             "super_index is missing: nested graphs need it"),
            ({**GRAPH, "pos": [["a"]]}, "pos must be an array of numbers, got <U1"),
            ({**GRAPH, "super_index": [0.5]}, "super_index must be integers, got float64"),
            ({**GRAPH, "edge_index": [[0, 1]]}, r"edge_index must have shape \(2, E\), got"),
            ({**GRAPH, "edge_attr": [[1]]},
             r"edge_attr must have one row per edge \(4\), got 1 row"),
            ({**GRAPH, "super_index": [3]}, "super_index must be regions from -1 to 2, got 3 to 3"),
            ({**GRAPH, "edge_index": [[-1], [0]], "edge_attr": [1]},
             "edge_index must be regions from 0 to 2, got -1 to 0"),
            ([GRAPH, {**COARSE, "super_index": [0]}],
             r"graphs\[1\]: super_index must have one value per region of the previous graph \(3\),"
             r" got 1 value"),
        ],
    )  # fmt: skip
    def test_graphs_that_do_not_fit_are_refused(self, tmp_path, graphs, message):
        with pytest.raises(MeshError, match=message):
            write_graphs(tmp_path / "a.npz", graphs)
        assert not list(tmp_path.iterdir())

    def test_they_are_written_as_npz(self, tmp_path):
        with pytest.raises(MeshError, match=r"expected the ending \.npz, got \.pt"):
            write_graphs(tmp_path / "a.pt", GRAPH)


class TestObj:
    def test_each_region_is_a_group(self, tmp_path):
        mesh = shapes.cube()
        labels = np.arange(12) // 2 % 3
        write_mesh(tmp_path / "a.obj", mesh, labels)
        group, faces = None, {}
        for line in (tmp_path / "a.obj").read_text().splitlines():
            kind, *values = line.split()
            if kind == "g":
                (group,) = values
                assert group not in faces
            if kind == "f":
                faces.setdefault(group, []).append([int(value) - 1 for value in values])
        assert list(faces) == ["region_0", "region_1", "region_2"]
        for region in range(3):
            assert faces[f"region_{region}"] == mesh.faces[labels == region].tolist()

    def test_polygons_stay_polygons(self, house, tmp_path):
        write_mesh(tmp_path / "a.obj", house, [17, -1])
        lines = (tmp_path / "a.obj").read_text().splitlines()
        assert lines[5:] == ["g unlabeled", "f 4 3 5", "g region_17", "f 1 2 3 4"]
        write_mesh(tmp_path / "c.obj", house, [17, 2], classes=["a #1\\", "a #1\\"])
        lines = (tmp_path / "c.obj").read_text().splitlines()
        assert lines[5:] == ["g a__1_", "f 4 3 5", "f 1 2 3 4"]  # one group per class
        mesh = Mesh(house.vertices, [[0, 1, 2], [3, 2, 4], [0, 1, 4]])
        write_mesh(tmp_path / "d.obj", mesh, [0, 1, 2], classes=["wall", "lid", "wall"])
        groups = (tmp_path / "d.obj").read_text().splitlines()[5:]
        assert groups == ["g wall", "f 1 2 3", "f 1 2 5", "g lid", "f 4 3 5"]
        for name, third in (("e.obj", "a#b"), ("e.stl", "a  b")):
            write_mesh(tmp_path / name, mesh, [0, 1, 2], classes=["a b", "a_b", third])
            (words,) = read_attributes(tmp_path / name).names.values()
            assert words == ("a_b_2", "a_b", "a_b_3")  # names that differ stay different
        write_mesh(tmp_path / "b.obj", house)
        assert (tmp_path / "b.obj").read_text().splitlines()[5:] == ["f 1 2 3 4", "f 4 3 5"]
        assert read_mesh(tmp_path / "b.obj").sizes.tolist() == [4, 3]

    def test_coordinates_come_back_exactly(self, square, tmp_path):
        for name, shift in (("a.obj", 1 / 3), ("a.off", 1 / 3), ("a.obj", 467362.332)):
            moved = Mesh(square.vertices + shift, FACES)
            write_mesh(tmp_path / name, moved)
            assert_array_equal(read_mesh(tmp_path / name).vertices, moved.vertices)
            assert_array_equal(read_mesh(tmp_path / name).faces, FACES)
        assert (tmp_path / "a.obj").read_text().startswith("v 467362.332 467362.332 467362.332\n")


class TestOff:
    def test_faces_have_colors(self, house, tmp_path):
        write_mesh(tmp_path / "a.off", house, [1, 0], colors=[[1, 2, 3], [4, 5, 6]])
        assert (tmp_path / "a.off").read_text() == (
            "OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 2 0\n4 0 1 2 3 1 2 3\n3 3 2 4 4 5 6\n"
        )


def parsed_glb(path):
    """Return the document of a GLB, and a function that returns the numbers of a buffer view."""
    data = Path(path).read_bytes()
    magic, version, size, n_text, kind = struct.unpack_from("<4s4I", data)
    assert (magic, version, size, kind) == (b"glTF", 2, len(data), 0x4E4F534A)
    document = json.loads(data[20 : 20 + n_text])
    begin = 20 + n_text + 8
    assert begin % 8 == 0

    def numbers(view, dtype, n_columns=1):
        start = begin + document["bufferViews"][view]["byteOffset"]
        n_bytes = document["bufferViews"][view]["byteLength"]
        assert start % 8 == 0
        values = np.frombuffer(data[start : start + n_bytes], dtype)
        return values.reshape(-1, n_columns) if n_columns > 1 else values

    return document, numbers


class TestGlb:
    def test_vertices_are_doubled_at_borders_and_have_the_id_of_their_region(self, tmp_path):
        mesh = shapes.cube()
        labels = np.arange(12) // 2 * 10
        write_mesh(tmp_path / "a.glb", mesh, labels)
        document, numbers = parsed_glb(tmp_path / "a.glb")
        (primitive,) = document["meshes"][0]["primitives"]
        views = [accessor["bufferView"] for accessor in document["accessors"]]
        indices = numbers(views[primitive["indices"]], "<u4", 3)
        ids = numbers(views[primitive["attributes"]["_FEATURE_ID_0"]], "<f4")
        positions = numbers(views[primitive["attributes"]["POSITION"]], "<f4", 3)
        assert len(positions) == 24  # four vertices per side
        assert_array_equal(ids[indices], np.repeat(labels[:, None] / 10, 3, axis=1))
        assert_array_equal(positions[indices], mesh.vertices[mesh.faces])
        assert primitive["extensions"]["EXT_mesh_features"]["featureIds"] == [
            {"featureCount": 6, "attribute": 0, "label": "region", "propertyTable": 0}
        ]
        assert document["extensionsUsed"] == ["EXT_mesh_features", "EXT_structural_metadata"]

    def test_the_table_has_label_area_normal_and_class_of_each_region(self, tmp_path):
        mesh = shapes.cube()
        labels = np.arange(12) // 2 * 10
        classes = ["low", "high", "front", "back", "left", "left"]
        write_mesh(tmp_path / "a.glb", mesh, labels, classes=classes)
        document, numbers = parsed_glb(tmp_path / "a.glb")
        metadata = document["extensions"]["EXT_structural_metadata"]
        (table,) = metadata["propertyTables"]
        views = {name: value["values"] for name, value in table["properties"].items()}
        assert table["count"] == 6
        assert_array_equal(numbers(views["label"], "<i4"), [0, 10, 20, 30, 40, 50])
        assert_allclose(numbers(views["area"], "<f4"), 1)
        assert_array_equal(numbers(views["normal"], "<f4", 3)[:2], [[0, 0, -1], [0, 0, 1]])
        values = metadata["schema"]["enums"]["region_class"]["values"]
        names = {value["value"]: value["name"] for value in values}
        assert [names[number] for number in numbers(views["class"], "<u4").tolist()] == classes

    def test_cells_in_no_region_have_the_null_id(self, square, tmp_path):
        write_mesh(tmp_path / "a.glb", square, [-1, 5])
        document, numbers = parsed_glb(tmp_path / "a.glb")
        (primitive,) = document["meshes"][0]["primitives"]
        (feature_ids,) = primitive["extensions"]["EXT_mesh_features"]["featureIds"]
        assert feature_ids["nullFeatureId"] == 1
        view = document["accessors"][primitive["attributes"]["_FEATURE_ID_0"]]["bufferView"]
        assert Counter(numbers(view, "<f4").tolist()) == {0.0: 3, 1.0: 3}
        write_mesh(tmp_path / "b.glb", square, [-1, -1])
        document, _ = parsed_glb(tmp_path / "b.glb")
        assert "extensions" not in document

    def test_a_mesh_alone_has_neither_ids_nor_colors(self, square, tmp_path):
        write_mesh(tmp_path / "a.glb", square)
        document, _ = parsed_glb(tmp_path / "a.glb")
        assert document["meshes"][0]["primitives"][0]["attributes"] == {"POSITION": 0}
        assert "extensionsUsed" not in document

    def test_faces_of_a_region_may_differ_in_color(self, square, tmp_path):
        write_mesh(tmp_path / "a.glb", square, [0, 0], colors=[[1, 2, 3], [4, 5, 6]])
        document, numbers = parsed_glb(tmp_path / "a.glb")
        (primitive,) = document["meshes"][0]["primitives"]
        view = document["accessors"][primitive["attributes"]["COLOR_0"]]["bufferView"]
        of_vertices = (1e5 * numbers(view, "<f4", 3)).round().astype(int)  # linear light
        assert Counter(map(tuple, of_vertices.tolist())) == {
            (30, 61, 91): 3, (121, 152, 182): 3,
        }  # fmt: skip  # linear light

    def test_far_coordinates_keep_their_digits(self, tmp_path):
        sheet = shapes.bumpy_sheet(4)
        far = Mesh(sheet.vertices + [4.5e6, 1e5, 300], sheet.faces)
        write_mesh(tmp_path / "a.glb", far, np.zeros(far.n_faces, int))
        read = read_mesh(tmp_path / "a.glb")
        assert_allclose(read.vertices[read.faces], far.vertices[far.faces], rtol=0, atol=1e-6)

    def test_polygons_become_triangles(self, house, tmp_path):
        write_mesh(tmp_path / "a.glb", house, [0, 1])
        assert read_mesh(tmp_path / "a.glb").n_faces == 3

    def test_trimesh_reads_shape_and_colors(self, tmp_path):
        trimesh = pytest.importorskip("trimesh")
        mesh = shapes.cube()
        colors = np.arange(36).reshape(12, 3) * 7
        write_mesh(tmp_path / "a.glb", mesh, np.arange(12) // 2, colors=colors)
        read = trimesh.load_mesh(tmp_path / "a.glb", process=False)
        assert_allclose(read.vertices[read.faces], mesh.vertices[mesh.faces])
        shades = read.visual.vertex_colors[read.faces[:, 0], :3] / 255  # linear light
        srgb = np.where(shades > 0.0031308, 1.055 * shades ** (1 / 2.4) - 0.055, 12.92 * shades)
        assert_allclose(srgb[3:], colors[3:] / 255, atol=0.05)


class TestNamesAndVertices:
    def test_a_ply_may_have_labels_of_its_vertices(self, square, tmp_path):
        write_mesh(tmp_path / "a.ply", square, [7, 0], vertex_labels=True)
        assert read_attributes(tmp_path / "a.ply").vertex["label"].tolist() == [0, 7, 0, 0, -1]
        assert read_labels(tmp_path / "a.ply").tolist() == [7, 0]
        assert_array_equal(read_mesh(tmp_path / "a.ply").faces, FACES)
        write_mesh(tmp_path / "a.ply", square, [4, 7, 4, 2, -1], vertex_labels=True)
        assert read_attributes(tmp_path / "a.ply").vertex["label"].tolist() == [4, 7, 4, 2, -1]

    def test_labels_of_cells_left_out_come_back(self, square, tmp_path):
        for name in ("a.ply", "a.npy", "a.seg"):
            OutputFiles([tmp_path / name]).write(square, [-1, 3])
            assert read_labels(tmp_path / name).tolist() == [-1, 3]

    @pytest.mark.parametrize(
        ("name", "keywords", "error", "message"),
        [
            ("a.ply", {"label_name": "Label"}, ValueError,
             r"label_name needs an output with the ending \.vtp or \.vtu or \.vtk"),
            ("a.msh", {}, MeshError, r"a\.msh: meshio writes \.msh; expected"),
            ("a.shp", {}, MeshError, r"a\.shp: geopandas writes \.shp; "),
            ("a.json", {}, MeshError, r"ending .segs.json, .sstk.json, .aggregation.json, got"),
            ("a.vtp", {"label_name": ""}, ValueError,
             "label_name must be one line of printable text, got ''"),
            ("a.vtp", {"label_name": 3}, ValueError,
             "label_name must be one line of printable text, got 3"),
            ("a.vtp", {"vertex_labels": True}, ValueError,
             r"vertex_labels needs an output with the ending \.ply"),
            ("a.ply", {"classes": ["a"]}, ValueError,
             r"classes needs an output with the ending \.glb or \.obj or \.stl or"
             r" \.aggregation\.json"),
            ("a.glb", {"classes": [1.5, 2]}, TypeError,
             r"classes must be strings or integers, got 1\.5"),
            ("a.glb", {"classes": [1]}, MeshError,
             r"classes must have one value per region \(2\), got 1 value"),
            ("a.aggregation.json", {"classes": ["a"]}, MeshError,
             r"classes must have one value per region \(2\), got 1 value"),
        ],
    )  # fmt: skip
    def test_options_of_no_use_are_refused(self, square, tmp_path, name, keywords, error, message):
        with pytest.raises(error, match=message):
            write_mesh(tmp_path / name, square, [0, 1], **keywords)
        assert not list(tmp_path.iterdir())

    def test_options_that_need_labels_are_refused_without(self, square, tmp_path):
        with pytest.raises(MeshError, match="vertex_labels needs faces with labels"):
            write_mesh(tmp_path / "a.ply", square, vertex_labels=True)
        with pytest.raises(MeshError, match="vertex_labels needs faces with labels"):
            write_mesh(tmp_path / "a.ply", PointCloud(VERTICES), [0] * 5, vertex_labels=True)
        with pytest.raises(
            MeshError, match="classes need labels, because there is one value per region"
        ):
            write_mesh(tmp_path / "a.glb", square, classes=["a"])
        with pytest.raises(
            MeshError, match=r"a \.segs\.json file needs labels, but none are given"
        ):
            write_mesh(tmp_path / "a.segs.json", square)

    def test_cells_are_written_to_files_that_hold_them(self, tmp_path):
        faces = r"\.ply, \.vtp, \.obj, \.off, \.glb, \.ids\.png or \.stl"
        with pytest.raises(MeshError, match=rf"faces are written as {faces}, not as \.vtu"):
            write_mesh(tmp_path / "a.vtu", shapes.cube())
        written = r"points are written as \.ply, \.csv, .* or \.laz, not as"
        with pytest.raises(MeshError, match=written):
            write_mesh(tmp_path / "a.glb", PointCloud(VERTICES))
        with pytest.raises(MeshError, match=r"tetrahedra are written as \.vtu or \.vtk, not"):
            write_mesh(tmp_path / "a.obj", TETS)
        with pytest.raises(ValueError, match=r"\.vtu and \.vtk cannot store colors: omit them"):
            write_mesh(tmp_path / "a.vtu", TETS, colors=[[1, 2, 3]])


def test_a_glb_of_more_than_4_gib_is_refused(tmp_path, square, limit):
    path = tmp_path / "a.glb"
    write_mesh(path, square, [0, 1])
    size = path.stat().st_size
    for n_bytes in (size - 1, 100):  # the file, and what is in it
        limit("bytes of a GLB file", n_bytes)
        with pytest.raises(
            MeshError,
            match=r"the mesh needs more than 4 GiB, the limit of GLB: write \.ply or \.obj",
        ):
            write_mesh(tmp_path / "b.glb", square, [0, 1])
        assert [*tmp_path.iterdir()] == [path]
    limit("bytes of a GLB file", size)
    write_mesh(tmp_path / "b.glb", square, [0, 1])


@pytest.mark.parametrize("ending", [".obj", ".off"])
class TestTextInBlocks:
    @pytest.mark.parametrize("kind", ["triangles", "polygons"])
    def test_the_file_does_not_depend_on_the_size_of_blocks(
        self, tmp_path, monkeypatch, limit, house, ending, kind
    ):
        mesh = house if kind == "polygons" else shapes.bumpy_sheet(5)
        n = mesh.n_faces
        for labels in (None, np.arange(n) % 4 - 1, np.arange(n) // 7):
            write_mesh(tmp_path / f"a{ending}", mesh, labels)
            for size in (1, 3, 7):
                limit("rows written at once", size)
                write_mesh(tmp_path / f"b{ending}", mesh, labels)
                blocks = [(tmp_path / f"{name}{ending}").read_bytes() for name in "ab"]
                assert blocks[0] == blocks[1]
            monkeypatch.undo()

    def test_memory_is_that_of_a_block(self, tmp_path, limit, ending):
        mesh = shapes.bumpy_sheet(60)
        limit("rows written at once", 256)
        labels = np.zeros(mesh.n_faces, np.int32)
        colors = np.zeros((mesh.n_faces, 3), np.uint8)
        tracemalloc.start()
        try:
            write_mesh(tmp_path / f"a{ending}", mesh, labels, colors=colors)
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert peak < 120 * mesh.n_faces  # bytes; lines as objects take twice as many


class TestRegions:
    @pytest.mark.parametrize("ending", [".ply", ".obj", ".off", ".glb"])
    def test_the_files_together_are_the_mesh(self, tmp_path, ending):
        mesh = shapes.bumpy_sheet(5)
        labels = np.arange(mesh.n_faces) // 7
        paths = write_regions(tmp_path / "parts", mesh, labels, ending=ending)
        assert [path.name for path in paths] == [f"region_{k}{ending}" for k in range(8)]
        assert sorted(paths) == sorted((tmp_path / "parts").iterdir())
        for region, path in enumerate(paths):
            part = read_mesh(path)
            assert_allclose(
                part.vertices[part.faces], mesh.vertices[mesh.faces[labels == region]], atol=1e-7
            )
            assert len(np.unique(part.faces)) == part.n_vertices

    def test_polygons_and_tetrahedra_have_parts_too(self, house, tmp_path):
        write_regions(tmp_path, house, [4, -1])
        assert read_mesh(tmp_path / "region_4.ply").sizes.tolist() == [4]
        pytest.importorskip("meshio")
        (path,) = write_regions(tmp_path, TETS, [-1, 0])
        part = read_mesh(path)
        assert path.name == "region_0.vtu"
        assert_array_equal(part.vertices[part.tets], TETS.vertices[TETS.tets[1:]])

    def test_clouds_have_parts_too(self, tmp_path):
        normals = np.tile([[0.0, 0.0, 1.0]], (5, 1))
        cloud = PointCloud(VERTICES, normals)
        paths = write_regions(tmp_path, cloud, [6, 2, 6, 2, -1])
        assert [path.name for path in paths] == ["region_2.ply", "region_6.ply"]
        part = read_cloud(paths[0])
        assert_array_equal(part.points, cloud.points[[1, 3]])
        assert_array_equal(part.normals, normals[:2])

    def test_parts_keep_the_attributes_of_their_vertices_and_faces(self, house, tmp_path):
        heat, kinds = np.arange(house.n_vertices), np.array([3, 8])
        attributes = MeshAttributes(
            vertex={"heat": heat}, face={"kind": kinds},
            comments=["comment by hand", "comment TextureFile wall.png"],
        )  # fmt: skip
        paths = write_regions(tmp_path, house, [0, 1], attributes=attributes)
        parts = split_regions(house, [0, 1])
        for path, part, kind in zip(paths, parts, kinds, strict=True):
            written = read_attributes(path)
            assert written.comments == ("comment by hand",)
            assert_array_equal(written.vertex["heat"], heat[part.vertices])
            assert_array_equal(written.face["kind"], [kind])
        lost = "^.obj does not store: vertex property heat; face property kind; comments$"
        with pytest.warns(UserWarning, match=lost):
            write_regions(tmp_path / "a", house, [0, 1], ending=".obj", attributes=attributes)
        with pytest.raises(ValueError, match="the face property kind"):
            write_regions(tmp_path, house, [0, 1], attributes=MeshAttributes(face={"kind": [3]}))

    def test_leading_zeros_sort_the_files_by_region(self, tmp_path):
        labels = [0, 2, 10, -1, 100]
        names = [path.name for path in write_regions(tmp_path, PointCloud(VERTICES), labels)]
        assert names == [f"region_{digits}.ply" for digits in ("000", "002", "010", "100")]

    def test_files_of_other_regions_are_never_mixed_with_the_new_files(self, tmp_path, house):
        for name in ("region_1.obj", "region_of_interest.ply", "region_1.ply.bak"):
            (tmp_path / name).write_text("another file")
        write_regions(tmp_path, house, [0, 1])
        (path,) = write_regions(tmp_path / "one", house, [0, 0])
        assert write_regions(tmp_path / "one", house, [0, -1]) == [path]  # replaces the file
        assert read_mesh(path).n_faces == 1
        before = {path: path.read_bytes() for path in tmp_path.glob("*.*")}
        with pytest.raises(FileExistsError, match=r"such as region_1\.ply: give a new or empty"):
            write_regions(tmp_path, house, [0, 0])
        with pytest.raises(FileExistsError, match=r"already contains .*, such as region_0\.ply:"):
            write_regions(tmp_path, house, [1, 12])
        assert {path: path.read_bytes() for path in tmp_path.glob("*.*")} == before

    def test_either_all_are_written_or_none(self, tmp_path, house, monkeypatch):
        (tmp_path / "region_0.ply").write_text("old")
        calls = []

        def fail(*_, **__):
            calls.append(1)
            if len(calls) > 1:
                raise OSError("disk full")

        monkeypatch.setitem(FORMATS["write_polygons"], ".ply", fail)
        with pytest.raises(OSError, match="disk full"):
            write_regions(tmp_path, house, [0, 1])
        assert [path.name for path in tmp_path.iterdir()] == ["region_0.ply"]
        assert (tmp_path / "region_0.ply").read_text() == "old"

    def test_what_makes_no_files_is_refused(self, tmp_path, house):
        with pytest.raises(MeshError, match="no cell is in a region: all labels are -1"):
            write_regions(tmp_path / "a", house, [-1, -1])
        with pytest.raises(MeshError, match="region 7: "):
            write_regions(tmp_path / "b", shapes.slivers(), [0, 0, 7, 0])
        assert not (tmp_path / "b").exists()
        with pytest.raises(MeshError, match=r"more than three corners are .*, not as \.stl"):
            write_regions(tmp_path / "a", house, [0, 1], ending=".stl")
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("change", "is_binary"), [(0, True), (1e-9, False)])
def test_stl_without_labels_is_binary_if_float32_is_exact(tmp_path, square, change, is_binary):
    mesh = Mesh(square.vertices + change, square.faces)
    paths = write_regions(tmp_path / "parts", mesh, [0, 7], ending=".stl")
    write_mesh(tmp_path / "whole.stl", mesh)
    for path, faces in [(paths[0], [0]), (paths[1], [1]), (tmp_path / "whole.stl", [0, 1])]:
        data = path.read_bytes()
        assert (len(data) == 84 + 50 * len(faces)) == is_binary
        assert data.startswith(b"solid") != is_binary
        again = read_mesh(path)
        assert_array_equal(again.vertices[again.faces], mesh.vertices[mesh.faces[faces]])
    if is_binary:
        assert np.frombuffer(data, "<f4", 3, offset=84).tolist() == [0, 0, 1]


def test_a_region_of_one_point_is_a_file_of_its_own(tmp_path):
    names = write_regions(tmp_path, PointCloud(VERTICES), [0, 0, 0, 0, 4])
    assert read_cloud(names[1]).points.tolist() == [VERTICES[4].tolist()]


def test_more_regions_than_glb_has_ids_for_are_refused(tmp_path, limit, square):
    limit("ids in a GLB file", 2)
    write_mesh(tmp_path / "a.glb", square, [5, 9])
    with pytest.raises(
        MeshError,
        match=r"GLB can store at most 2 ids, but there are 12 regions \(faces without a region"
        r" count as one\): write \.ply or \.npy instead",
    ):
        write_mesh(tmp_path / "a.glb", shapes.cube(), np.arange(12))


def test_labels_of_vertices_may_be_of_the_mesh_before_it_was_subdivided(tmp_path, square):
    fine = shapes.cube()
    endings = ("segs.json", "ply", "sstk.json", "aggregation.json")
    paths, options = [tmp_path / f"a.{ending}" for ending in endings], FormatOptions(ascii=True)
    OutputFiles(paths, options).write(fine, np.arange(12), listed=[7, 0], listed_mesh=square)
    assert json.loads(paths[3].read_text())["segmentsFile"] == "scannet.a.segs.json"
    assert json.loads(paths[0].read_text())["segIndices"] == [0, 7, 0, 0, 8]
    assert json.loads(paths[2].read_text())["elementCount"] == 2
    assert read_mesh(paths[1]).n_faces == 12
