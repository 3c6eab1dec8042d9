"""Attributes of PLY files, copied from one file to another."""

import copy
import pickle
import re
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from mesh_files import FACES, ORDERS, VERTICES
from numpy.testing import assert_array_equal

import superfacets
from superfacets import Mesh, MeshAttributes, MeshError, read_attributes, read_mesh, write_mesh
from superfacets.files.input import Input

FORMS = ["ascii", *ORDERS]

VERTEX = np.array(
    [
        ((x, y, z), (0.0, 0.6, -0.8), (10 * n, 255 - n, n, 128), n / 4, 1 - n / 4, -n)
        for n, (x, y, z) in enumerate(VERTICES)
    ],
    dtype=[
        ("xyz", "f4", 3), ("n", "f4", 3), ("rgba", "u1", 4), ("s", "f8"), ("t", "f8"),
        ("height", "i2"),
    ],
)  # fmt: skip

FACE = np.array(
    [(3, FACES[0], 7, 6, (0, 0, 1, 0, 1, 1), 4e9), (3, FACES[1], 1, 6, (0, 0.5) * 3, 5)],
    dtype=[
        ("count", "u1"), ("corners", "i4", 3), ("material", "u2"), ("n_uv", "u1"), ("uv", "f4", 6),
        ("id", "u4"),
    ],
)  # fmt: skip

HEADER = """ply
format {form} 1.0
comment made by hand, with  two spaces and an \u00e9
obj_info num_cols 512
element vertex 5
property float x
property float y
property float z
property float nx
property float ny
property float nz
property uchar red
property uchar green
property uchar blue
property uchar alpha
property double s
property double t
property short height
comment TextureFile bark.png
element face 2
property list uchar int vertex_indices
property ushort material
property list uchar float texcoord
property uint id
{more}end_header
"""

COMMENTS = (
    "comment made by hand, with  two spaces and an \u00e9",
    "obj_info num_cols 512",
    "comment TextureFile bark.png",
)


def rich_ply(form, more=""):
    """Return a PLY file of the bent square with normals, colors, texture coordinates and more."""
    header = HEADER.format(form=form, more=more).encode()
    if form != "ascii":
        order = ORDERS[form]
        parts = [rows.astype(rows.dtype.newbyteorder(order)).tobytes() for rows in (VERTEX, FACE)]
        return header + b"".join(parts)
    lines = []
    for rows in (VERTEX, FACE):
        for row in rows:
            numbers = np.concatenate([np.ravel(part).astype(float) for part in row])
            lines.append(" ".join(f"{number:.9g}" for number in numbers))
    return header + "\n".join([*lines, ""]).encode()


@pytest.fixture(params=FORMS)
def rich(request, tmp_path):
    path = tmp_path / "rich.ply"
    path.write_bytes(rich_ply(request.param))
    return path


def assert_rich(attributes):
    assert list(attributes.vertex) == ["nx", "ny", "nz", "red", "green", "blue", "alpha", "s", "t",
                                       "height"]  # fmt: skip
    assert list(attributes.face) == ["material", "texcoord", "id"]
    expected = {"nx": VERTEX["n"][:, 0], "nz": VERTEX["n"][:, 2], "red": VERTEX["rgba"][:, 0],
                "alpha": VERTEX["rgba"][:, 3], "s": VERTEX["s"], "t": VERTEX["t"],
                "height": VERTEX["height"]}  # fmt: skip
    expected_of_faces = {"material": FACE["material"], "texcoord": FACE["uv"], "id": FACE["id"]}
    for values, found in ((expected, attributes.vertex), (expected_of_faces, attributes.face)):
        for name, array in values.items():
            assert_array_equal(found[name], array, err_msg=name)
            assert found[name].dtype == array.dtype, name
            assert found[name].flags.c_contiguous
    assert attributes.comments == COMMENTS


def test_all_that_a_file_stores_is_read_in_its_types(rich):
    attributes = read_attributes(rich)
    assert_rich(attributes)
    assert attributes.left_out == ("image 'bark.png', which is missing",)
    assert_array_equal(read_mesh(rich).vertices, VERTICES)


@pytest.mark.parametrize("ascii", [False, True])
def test_what_was_read_is_written_beside_labels(rich, tmp_path, ascii):
    output = tmp_path / "labeled.ply"
    mesh = read_mesh(rich)
    write_mesh(output, mesh, [1, 0], attributes=read_attributes(rich), ascii=ascii)
    again = read_attributes(output)
    assert list(again.face)[:6] == ["label", "quality", "red", "green", "blue", "alpha"]
    assert_rich(
        MeshAttributes(
            again.vertex,
            {name: again.face[name] for name in ("material", "texcoord", "id")},
            again.comments,
        )
    )
    assert_array_equal(read_mesh(output).faces, mesh.faces)
    assert_array_equal(superfacets.read_labels(output), [1, 0])
    assert b"property list uchar float texcoord\n" in output.read_bytes()


def test_the_header_declares_what_the_rows_hold(tmp_path):
    attributes = MeshAttributes(
        {"w": np.arange(5.0, dtype="f4")}, {"pair": np.array([[1, 2], [3, 4]], "u1")}, ["comment c"]
    )
    write_mesh(tmp_path / "a.ply", Mesh(VERTICES, FACES), attributes=attributes, ascii=True)
    assert (tmp_path / "a.ply").read_text() == (
        "ply\nformat ascii 1.0\ncomment c\nelement vertex 5\n"
        "property float x\nproperty float y\nproperty float z\nproperty float w\n"
        "element face 2\nproperty list uchar int vertex_indices\n"
        "property list uchar uchar pair\nend_header\n"
        "0 0 0 0\n1 0 0 1\n1 1 0 2\n0 1 0.5 3\n9 9 9 4\n3 0 1 2 2 1 2\n3 0 2 3 2 3 4\n"
    )


def test_long_lists_declare_a_longer_count(tmp_path):
    long = np.arange(600.0).reshape(2, 300)
    path = tmp_path / "a.ply"
    write_mesh(path, Mesh(VERTICES, FACES), attributes=MeshAttributes(face={"row": long}))
    assert b"property list int double row\n" in path.read_bytes()
    assert_array_equal(read_attributes(path).face["row"], long)


def test_other_elements_and_uneven_lists_are_named_as_left_out(tmp_path):
    path = tmp_path / "a.ply"
    rows = "0 0 0\n1 0 0\n1 1 0\n3 0 1 2 0\n3 0 2 1 2 5 6\n7 8\n"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_index\n"
        "property list uchar int tags\nelement edge 1\nproperty int a\nproperty int b\n"
        "element range_grid 0\nproperty int a\nend_header\n" + rows
    )
    attributes = read_attributes(path)
    assert (dict(attributes.vertex), dict(attributes.face)) == ({}, {})
    assert attributes.left_out == (
        "element edge",
        "face property tags, whose lists differ in length",
    )


def test_names_that_come_twice_are_kept_once(tmp_path):
    path = tmp_path / "a.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nproperty int w\nproperty int w\nproperty int \u0081\n"
        "element face 1\nproperty list uchar int vertex_index\nend_header\n"
        "0 0 0 1 2 3\n1 0 0 1 2 3\n1 1 0 1 2 3\n3 0 1 2\n",
        encoding="latin-1",
    )
    attributes = read_attributes(path)
    assert_array_equal(attributes.vertex["w"], [1, 1, 1])
    assert [what.split(",")[0] for what in attributes.left_out] == [
        "vertex property w (2)", "vertex property \u0081",
    ]  # fmt: skip


def test_integers_that_do_not_fit_the_declared_type_become_doubles(tmp_path):
    path = tmp_path / "a.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\n"
        "element face 1\nproperty list uchar int vertex_index\nend_header\n"
        "0 0 0 300 1\n1 0 0 0.5 2\n1 1 0 -1 3\n3 0 1 2\n"
    )
    vertex = read_attributes(path).vertex
    assert vertex["red"].dtype == np.float64
    assert_array_equal(vertex["red"], [300, 0.5, -1])
    assert vertex["green"].dtype == np.uint8


def test_names_of_the_labels_win(tmp_path):
    path = tmp_path / "a.ply"
    mesh = Mesh(VERTICES, FACES)
    attributes = MeshAttributes(
        {"x": [9.0] * 5, "label": [1, 2, 3, 4, 5]},
        {"label": [8, 8], "red": [1.0, 2.0], "vertex_index": [0, 0], "kept": [5, 6]},
    )
    with pytest.warns(UserWarning, match="store: vertex property label; face property vertex_index$"
    ), pytest.warns(UserWarning, match="^in .ply, new values replace vertex property x; new values"
    " replace face properties label, red$"):  # fmt: skip
        write_mesh(path, mesh, [1, 0], attributes=attributes)
    assert_array_equal(read_mesh(path).vertices, VERTICES)
    assert_array_equal(superfacets.read_labels(path), [1, 0])
    found = read_attributes(path)
    assert found.face["red"].dtype == np.uint8
    assert_array_equal(found.face["kept"], [5, 6])
    assert "label" not in found.vertex  # they belong to old regions
    with pytest.warns(UserWarning, match="^in .vtp, new values replace face property label$"):
        write_mesh(tmp_path / "a.vtp", mesh, [2, 0], attributes=found)  # no old colors
    assert read_attributes(tmp_path / "a.vtp").face.keys() == {"kept", "label", "colors"}
    write_mesh(path, mesh, attributes=MeshAttributes(face={"label": [8, 8]}))
    assert_array_equal(superfacets.read_labels(path), [8, 8])  # from another program, so it is kept
    write_mesh(path, mesh, [1, 0], attributes=MeshAttributes({"label": [1, 2, 3, 4, 5]}))
    assert_array_equal(read_attributes(path).vertex["label"], [1, 2, 3, 4, 5])  # no other labels
    with pytest.warns(UserWarning, match="^in .glb, new values replace vertex property red$"):
        write_mesh(tmp_path / "a.glb", mesh, [1, 0], attributes=MeshAttributes({"red": [9] * 5}))


def test_labels_of_vertices_stay_where_those_of_the_faces_do(tmp_path):
    path = tmp_path / "a.ply"
    attributes = MeshAttributes({"label": [1, 2, 3, 4, 5]}, {"label": [8, 9]})
    write_mesh(path, Mesh(VERTICES, FACES), [8, 9], attributes=attributes)
    assert_array_equal(read_attributes(path).vertex["label"], [1, 2, 3, 4, 5])


def test_names_and_types_are_kept_where_the_format_can_and_otherwise_the_change_is_named(tmp_path):
    ids, path = np.array([2**60 + 1, 7]), tmp_path / "a.ply"
    given = {
        "m (S/m)": [0.5, 1.5], "\u00b5": [1, 2], "flag": [True, False], "id": ids,
        "many": np.array([2**32 - 1, 0]), "small": np.array([-1, 2]), "half": np.float16([1, 2]),
        "big": np.array([1.5, 2], ">f8"), "two words": [1, 2], "two_words": [3, 4],
    }  # fmt: skip
    attributes, mesh = MeshAttributes(face=given), Mesh(VERTICES, FACES)
    assert attributes.face["big"].dtype.isnative
    lost = (
        ".ply does not store: face property m (S/m) by this name, but as m_(S/m); face property"
        " \u00b5; face property id as integers, but as float64; face property two words"
    )
    with pytest.warns(UserWarning, match=re.escape(lost)):
        write_mesh(path, mesh, attributes=attributes)
    found = read_attributes(path).face
    assert {name: values.dtype.str[1:] for name, values in found.items()} == {
        "m_(S/m)": "f8", "flag": "u1", "id": "f8", "many": "u4", "small": "i4", "half": "f4",
        "big": "f8", "two_words": "i4",
    }  # fmt: skip
    write_mesh(tmp_path / "a.vtp", mesh, attributes=attributes)
    found = read_attributes(tmp_path / "a.vtp").face
    assert list(found) == list(given)
    for name, values in found.items():
        assert values.dtype == attributes.face[name].dtype
        assert_array_equal(values, attributes.face[name])
    assert_array_equal(superfacets.read_labels(path, name="two words"), [3, 4])


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"vertex": {"two\nlines": [1]}}, ValueError, "the name must be one line of printable text"),
    ({"vertex": {" ": [1]}}, ValueError, "must be one line"),
    ({"vertex": {7: [1]}}, ValueError, "must be one line"),
    ({"face": {"a": ["x"]}}, TypeError, "face property 'a' must be real numbers, got <U1"),
    ({"face": {"a": [[[1]]]}}, ValueError, "one or two dimensions, got shape (1, 1, 1)"),
    ({"comments": ["made by hand"]}, ValueError,
     "comments must be lines that begin with comment or obj_info, got 'made by hand'"),
    ({"comments": ["comment a\nend_header"]}, ValueError,
     "must be lines that begin with comment or obj_info"),
    ({"comments": [3]}, ValueError, "must be lines that begin with comment or obj_info, got 3"),
    ({"vertex": [1]}, TypeError, "vertex must be a mapping of names to arrays"),
    ({"face": {"a": np.ma.masked_equal([1, 2], 2)}}, ValueError,
     "face property 'a' must not have masked entries: fill or remove these entries"),
    ({"comments": ["comment \ud800"]}, ValueError,
     r"comments must be lines that begin with comment or obj_info, got 'comment \ud800'"),
])  # fmt: skip
def test_attributes_that_no_file_can_hold_are_refused(arguments, error, message):
    with pytest.raises(error) as caught:
        MeshAttributes(**arguments)
    assert message in str(caught.value)


def test_attributes_of_another_mesh_are_refused(tmp_path):
    mesh = Mesh(VERTICES, FACES)
    path = tmp_path / "a.ply"
    with pytest.raises(
        ValueError, match=r"^the face property a must have one value per face \(2\), got 3 values$"
    ):
        write_mesh(path, mesh, attributes=MeshAttributes(face={"a": [1, 2, 3]}))
    with pytest.raises(TypeError, match=r"^attributes must be MeshAttributes, got dict$"):
        write_mesh(path, mesh, attributes={"a": [1, 2]})
    assert not path.exists()


def test_comments_in_latin_1_are_read(tmp_path):
    content = rich_ply("ascii").replace(
        "made by hand, with  two spaces and an é".encode(), b"\xa9 me"
    )
    (tmp_path / "a.ply").write_bytes(content)
    assert read_attributes(tmp_path / "a.ply").comments[0] == "comment © me"


def test_some_formats_have_attributes(tmp_path):
    (tmp_path / "a.seg").write_text("0\n")
    with pytest.raises(MeshError, match=r"a\.seg: a label file: give the mesh"):
        read_attributes(tmp_path / "a.seg")
    (tmp_path / "a.ply").write_text("junk")
    with pytest.raises(MeshError, match=r"a\.ply: not a PLY file"):
        read_attributes(tmp_path / "a.ply")


def test_attributes_do_not_keep_the_file_in_memory(tmp_path):
    n = 50_000
    vertices = np.random.default_rng(1).random((n, 3))
    faces = np.arange(n // 3 * 3).reshape(-1, 3)
    path = tmp_path / "a.ply"
    write_mesh(
        path,
        Mesh(vertices, faces),
        attributes=MeshAttributes(vertex={"a": np.zeros(n), "t": np.zeros(n, "u1")}),
    )
    tracemalloc.start()
    attributes = read_attributes(path)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(attributes.vertex["t"]) == n
    assert 9 * n <= kept < 9 * n + 50_000


def test_trimesh_reads_what_was_carried_over(rich, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    pytest.importorskip("scipy")
    path = tmp_path / "out.ply"
    read = read_attributes(rich)
    write_mesh(path, read_mesh(rich), attributes=read)
    textured = trimesh.load_mesh(path, process=False)
    assert_array_equal(textured.visual.uv[textured.faces.ravel()], FACE["uv"].reshape(-1, 2))
    vertex = {name: values for name, values in read.vertex.items() if name not in "st"}
    face = {name: values for name, values in read.face.items() if name != "texcoord"}
    write_mesh(path, read_mesh(rich), attributes=MeshAttributes(vertex, face))
    colored = trimesh.load_mesh(path, process=False)
    assert_array_equal(colored.visual.vertex_colors, VERTEX["rgba"])
    raw = colored.metadata["_ply_raw"]
    assert_array_equal(np.ravel(raw["vertex"]["data"]["height"]), VERTEX["height"])
    assert_array_equal(np.ravel(raw["face"]["data"]["material"]), FACE["material"])


def test_attributes_are_copies_that_cannot_be_written():
    heat = np.arange(3.0)
    attributes = MeshAttributes(vertex={"heat": heat})
    heat[0] = 9.0
    assert attributes.vertex["heat"][0] == 0.0
    for again in (copy.deepcopy(attributes), pickle.loads(pickle.dumps(attributes))):
        assert again.vertex["heat"].tolist() == [0.0, 1.0, 2.0]
        with pytest.raises(ValueError, match="read-only"):
            again.vertex["heat"][0] = 1.0


@pytest.mark.parametrize(("dtype", "top"), [("u1", 255), ("u2", 65535), ("f4", 1), ("i4", 255)])
def test_colors_are_bytes_whatever_their_type_and_those_of_faces_come_first(dtype, top):
    red = np.array([top, top // 2 if top > 1 else 0.5, 0], dtype)
    shades = {"red": red, "green": 0 * red, "blue": 0 * red + np.array(top, dtype)}
    of_vertices = MeshAttributes(vertex=shades)
    assert of_vertices.colors.dtype == np.uint8
    assert of_vertices.colors[:, 1:].tolist() == [[0, 255]] * 3
    assert_array_equal(of_vertices.colors[:, 0], [255, 128 if dtype == "f4" else 127, 0])
    both = replace(of_vertices, face={name: values[:2] for name, values in shades.items()})
    assert both.colors.tolist() == of_vertices.colors[:2].tolist()


def test_there_are_no_colors_if_one_of_them_is_missing_or_all_are_black():
    zeros = np.zeros(3, np.uint8)
    assert MeshAttributes(vertex={"red": zeros + 9, "green": zeros}).colors is None
    assert MeshAttributes(vertex={"red": zeros, "green": zeros, "blue": zeros}).colors is None
    gap = MeshAttributes(vertex={"red": zeros - np.nan, "green": zeros, "blue": zeros + 1.0})
    assert gap.colors.tolist() == [[0, 0, 255]] * 3


def test_colors_of_regions_in_a_labeled_file_are_no_colors_of_the_scan(tmp_path):
    mesh = Mesh(VERTICES, FACES)
    shades = {name: np.arange(mesh.n_vertices) for name in ("red", "green", "blue")}
    for attributes in (MeshAttributes(), MeshAttributes(vertex=shades)):
        write_mesh(tmp_path / "a.ply", mesh, [0, 1], attributes=attributes)
        found = read_attributes(tmp_path / "a.ply")
        assert "red" in found.face
        assert_array_equal(found.colors, attributes.colors)
    cloud = superfacets.PointCloud(VERTICES[:4], colors=np.eye(4)[:, :3])
    write_mesh(tmp_path / "b.ply", cloud, np.arange(4) % 2)
    assert read_attributes(tmp_path / "b.ply").colors is None
    write_mesh(tmp_path / "b.ply", cloud)
    assert read_attributes(tmp_path / "b.ply").colors.tolist() == [
        [255, 0, 0], [0, 255, 0], [0, 0, 255], [0, 0, 0],
    ]  # fmt: skip


def test_items_that_a_file_declares_more_than_once_are_numbered():
    source = Input(b"", ".ply")
    for item in ("a (2)", "a", "a", *["b"] * 50_000):  # quickly, also in a hostile file
        source.declare(item)
    assert [*source.declared][:5] == ["a (2)", "a", "a (3)", "b", "b (2)"]
    assert len(source.declared) == 50_003
