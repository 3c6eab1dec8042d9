"""Reading PLY."""

import struct

import mesh_files as files
import numpy as np
import pytest
from mesh_files import FACES, VERTICES, ply_binary, ply_header, ply_text, text_of
from numpy.testing import assert_array_equal

from superfacets import Mesh, build_face_graph
from superfacets.files.readers.read import read_attributes, read_mesh

FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


def ply(form, **options):
    return ply_text(**options) if form == "ascii" else ply_binary(form, **options)


@pytest.mark.parametrize("form", FORMS)
def test_vertices_and_faces_are_those_of_the_file_in_their_order(read, form):
    mesh = read("a.ply", ply(form))
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)


def test_the_ending_may_be_in_upper_case(read):
    assert read("A.PLY", ply_text()).n_faces == 2


@pytest.mark.parametrize("form", FORMS)
def test_doubles_are_exact(read, form):
    vertices = np.array([[0.1, 1e-300, -1 / 3], [1e14, 2**-1074, 0.3], [123456789.123456789, 1, 2]])
    mesh = read("a.ply", ply(form, vertices=vertices, faces=[[0, 1, 2]], kind="double"))
    assert_array_equal(mesh.vertices, vertices)


@pytest.mark.parametrize("form", FORMS)
def test_floats_are_those_of_single_precision(read, form):
    mesh = read("a.ply", ply(form, vertices=VERTICES + 0.1))
    assert_array_equal(mesh.vertices, (VERTICES + 0.1).astype(np.float32))


def test_windows_line_ends_before_a_binary_body(read):
    header, _, body = ply_binary().partition(b"end_header\n")
    data = (header + b"end_header\n").replace(b"\n", b"\r\n") + body
    assert_array_equal(read("a.ply", data).vertices, VERTICES)


@pytest.mark.parametrize("newline", [b"\r\n", b"\r"])
def test_ascii_with_other_line_ends(read, newline):
    assert_array_equal(read("a.ply", ply_text().replace(b"\n", newline)).faces, FACES)


@pytest.mark.parametrize("form", FORMS)
def test_other_properties_and_elements_are_skipped(read, form):
    header = (
        f"ply\nformat {form} 1.0\nobj_info x\nelement skip 2\nproperty list int short s\n"
        "element vertex 3\nproperty uchar red\nproperty double z\nproperty float y\n"
        "property short x\nelement nothing 4000000000\nelement face 1\nproperty char flag\n"
        "property list uchar float uv\nproperty list uchar uint vertex_index\n"
        "property ushort label\nelement edge 1\nproperty int a\nproperty uint b\nend_header\n"
    )
    if form == "ascii":
        body = b"0\n2 5 6\n9 3 2 1\n9 6 5 4\n9 9 8 8\n-1 6 0 0 1 0 .5 1 3 2 1 0 77\n0 1\n"
    else:
        order = files.ORDERS[form]
        body = struct.pack(f"{order}i i2h", 0, 2, 5, 6)
        for z, y, x in ((3, 2, 1), (6, 5, 4), (9, 8, 8)):
            body += struct.pack(f"{order}Bdfh", 9, z, y, x)
        body += struct.pack(f"{order}bB6f", -1, 6, 0, 0, 1, 0, 0.5, 1)
        body += struct.pack(f"{order}B3IHiI", 3, 2, 1, 0, 77, 0, 1)
    mesh = read("a.ply", header.encode() + body)
    assert_array_equal(mesh.vertices, [[1, 2, 3], [4, 5, 6], [8, 8, 9]])
    assert_array_equal(mesh.faces, [[2, 1, 0]])


def test_triangles_between_lists_of_several_lengths_are_read(read):
    faces = "property list uchar int vertex_indices\nproperty list uchar float uv\n"
    header = ply_header("binary_little_endian", faces=faces).encode()
    body = VERTICES.astype("<f4").tobytes()
    body += struct.pack("<B3i B2f", 3, *FACES[0], 2, 0, 1) + struct.pack("<B3i B", 3, *FACES[1], 0)
    assert_array_equal(read("a.ply", header + body).faces, FACES)


COUNTS = {"char": "b", "ushort": "H", "short": "h", "uint": "I", "int": "i"}


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("kind", COUNTS)
def test_lengths_of_lists_may_be_of_any_integer_type(read, kind, order):
    faces = f"property uchar flag\nproperty list {kind} int vertex_indices\n"
    header = ply_header(f"binary_{order}_endian", faces=faces).encode()
    sign = "<" if order == "little" else ">"
    body = VERTICES.astype(f"{sign}f4").tobytes()
    for face in ([0, 1, 2, 3], [2, 1, 4]):
        body += struct.pack(f"{sign}B{COUNTS[kind]}{len(face)}i", 7, len(face), *face)
    mesh = read("a.ply", header + body)
    assert mesh.offsets.tolist() == [0, 4, 7]
    assert mesh.indices.tolist() == [0, 1, 2, 3, 2, 1, 4]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("face", [[0, 1], []])
def test_faces_of_too_few_corners_are_refused(refuse, form, face):
    message = f"faces[1] must have at least 3 corners, got {len(face)}"
    refuse("a.ply", ply(form, faces=[[0, 1, 2], face]), message)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("index", [-1, 5, 2**31 - 1])
def test_indices_out_of_range_are_refused(refuse, form, index):
    message = f"faces[1] refers to vertex {index} but the mesh has 5 vertices"
    refuse("a.ply", ply(form, faces=[[0, 1, 2], [0, 1, index]]), message)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_coordinates_that_are_not_finite_are_refused(refuse, form, value):
    vertices = VERTICES.copy()
    vertices[2, 1] = value
    message = f"vertices[2] must be finite, got {vertices[2].tolist()}"
    refuse("a.ply", ply(form, vertices=vertices), message)


def test_a_decimal_beyond_single_precision_is_refused(refuse):
    refuse("a.ply", ply_text(vertices=VERTICES * 1e39), "vertices[1] must be finite")


@pytest.mark.parametrize("form", FORMS)
def test_a_point_cloud_is_refused(refuse, form):
    refuse("a.ply", ply(form, faces=[]), "the file contains points, but no faces: use read_cloud")


def test_a_ply_file_without_the_element_face_is_refused(refuse):
    header = ply_header().replace("element face 2\nproperty list uchar int vertex_indices\n", "")
    refuse(
        "a.ply",
        header.encode() + text_of(VERTICES).encode(),
        "the file contains points, but no faces: use read_cloud",
    )


def strips(*rows: str) -> bytes:
    header = ply_header().replace("element face 2", f"element tristrips {len(rows)}")
    return (header + text_of(VERTICES) + "".join(f"{row}\n" for row in rows)).encode()


@pytest.mark.parametrize(("rows", "triangles"), [
    (["5 0 1 2 3 4"], [[0, 1, 2], [2, 1, 3], [2, 3, 4]]),
    (["8 0 1 2 3 -1 4 1 0"], [[0, 1, 2], [2, 1, 3], [4, 1, 0]]),  # alternates within each strip
    (["4 0 1 2 -1", "3 3 2 1"], [[0, 1, 2], [3, 2, 1]]),
    (["2 0 1", "0", "4 -1 -1 -1 -1", "3 1 2 3"], [[1, 2, 3]]),
    (["5 0 1 2 2 3"], [[0, 1, 2], [2, 1, 2], [2, 2, 3]]),  # flat triangles connect strips
])  # fmt: skip
def test_triangle_strips_become_their_triangles_in_order(read, rows, triangles):
    mesh = read("a.ply", strips(*rows))
    assert isinstance(mesh, Mesh)
    assert mesh.faces.tolist() == triangles


def test_strips_that_are_wrong_are_refused(refuse):
    refuse("a.ply", strips("2 0 1", "1 -1"), "the PLY file has no faces: no strip has three")
    refuse("a.ply", strips("3 0 1 9"), "faces[0] refers to vertex 9 but the mesh has 5 vertices")
    header = ply_header(faces="property int vertex_indices\n").replace("face 2", "tristrips 1")
    refuse("a.ply", (header + text_of(VERTICES) + "4\n").encode(), "the PLY triangle strips have")


def test_strips_beside_faces_are_left_out(read, tmp_path):
    header = ply_header().replace(
        "end_header", "element tristrips 1\nproperty list int int vertex_indices\nend_header"
    )
    data = header + text_of(VERTICES) + text_of([[3, *face] for face in FACES]) + "3 2 1 0\n"
    assert read("a.ply", data.encode()).faces.tolist() == FACES.tolist()
    assert read_attributes(tmp_path / "a.ply").left_out == ("element tristrips",)
    (tmp_path / "b.ply").write_bytes(strips("3 0 1 2"))
    assert read_attributes(tmp_path / "b.ply").left_out == ()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("counts", "element"),
    [({"n_faces": 4_000_000_000}, "face"), ({"n_vertices": 10**40}, "vertex")],
)
def test_claims_of_billions_are_refused_at_once(refuse, form, counts, element):
    refuse("a.ply", ply(form, **counts), f"rows of element '{element}' but the file ends after")


def test_a_list_of_billions_is_refused_at_once(refuse):
    header = ply_header(
        "binary_little_endian", n_faces=1, faces="property list uint int vertex_indices\n"
    )
    body = VERTICES.astype("<f4").tobytes() + struct.pack("<I3i", 4_000_000_000, 0, 1, 2)
    refuse("a.ply", header.encode() + body, "the file ends in row 0")


@pytest.mark.parametrize("form", FORMS[1:])
def test_a_list_of_negative_length_is_refused(refuse, form):
    header = ply_header(form, n_faces=1, faces="property list char int vertex_indices\n")
    data = header.encode() + bytes(60) + struct.pack("b3i", -3, 0, 1, 2)
    refuse("a.ply", data, "lengths of lists in the PLY file must be >= 0, got -3")


@pytest.mark.parametrize(("row", "message"), [
    (b"-3 0 1 2", "lengths of lists in the PLY file must be >= 0, got -3"),
    (b"3.5 0 1 2", "lengths of lists must be int"),
    (b"1 4", "faces[0] must have at least 3 corners, got 1"),
])  # fmt: skip
def test_wrong_lengths_of_ascii_lists_are_refused(refuse, row, message):
    refuse("a.ply", ply_text().replace(b"3 0 1 2", row), message)


def test_ascii_indices_must_be_integers(refuse):
    data = ply_text().replace(b"3 0 1 2", b"3 0 1.5 2")
    refuse("a.ply", data, "vertex indices must be integers, got 1.5")


@pytest.mark.parametrize("row", ["3 0 1", "3 0 1 2 3", "2 0", "99999999999999999999 0 1 2"])
def test_ascii_rows_of_another_length_than_declared_are_refused(refuse, row):
    data = ply_text().replace(b"3 0 1 2\n", row.encode() + b"\n")
    message = "expected as many numbers as the PLY header and the lengths of lists declare, got"
    refuse("a.ply", data, message)


def test_words_in_an_ascii_body_are_refused_with_their_line(refuse):
    data = ply_text().replace(b"0.0 1.0 0.5", b"0.0 one 0.5")
    refuse("a.ply", data, "line 14: expected a number, got 'one'")


def test_more_rows_than_declared_are_refused(refuse):
    refuse(
        "a.ply", ply_text() + b"3 0 1 2\n", "line 18: there are more lines than the header declares"
    )
    refuse("a.ply", ply_binary() + b"3", "1 byte more than the header declares")


def test_a_tab_may_follow_the_word_comment(read, tmp_path):
    read("a.ply", ply_text().replace(b"comment of", b"comment\tof"))
    assert read_attributes(tmp_path / "a.ply").comments == ("comment of nobody",)


def test_blanks_may_follow(read):
    assert read("a.ply", ply_text() + b" \n\n").n_faces == 2
    assert read("a.ply", ply_text().replace(b"ply\n", b"ply \t\n")).n_faces == 2
    assert read("a.ply", ply_binary() + b"\n\0\0").n_faces == 2


@pytest.mark.parametrize(("old", "new", "message"), [
    ("ply\n", "plx\n", "not a PLY file"),
    ("end_header\n", "", "no line end_header"),
    ("format ascii 1.0", "format ebcdic 1.0", "in the PLY header, got 'format ebcdic 1.0'"),
    ("format ascii 1.0", "",
     "expected `format` and one of ascii, binary_little_endian, binary_big_endian in the"),
    ("format ascii 1.0", "format ascii 2.0", "the PLY version must be 1.0, got '2.0'"),
    ("element face 2", "element face two",
     "expected an element with its count, or a property in the PLY header, got 'element face"
     " two'"),
    ("element face 2", "element face -2",
     "expected an element with its count, or a property in the PLY header, got 'element face"
     " -2'"),
    ("element face 2", "element face ²", "header, got 'element face ²'"),
    ("element face 2", "element vertex 2", "declares element vertex twice"),
    ("comment of nobody", "property float w",
     "expected an element with its count, or a property in the PLY header, got 'property float"
     " w'"),
    (
        "float x",
        "quadruple x",
        "expected a property with a type and a name in the PLY header, got"
        " 'property quadruple x'",
    ),
    ("property float x", "property",
     "expected a property with a type and a name in the PLY header, got 'property'"),
    ("list uchar int", "list float int",
     "expected an integer type for the length of a list in the PLY header, got 'property"
     " lis...ertex_indices'"),
    ("list uchar int", "list uchar float",
     "the type of the PLY list vertex_indices must be an integer type"),
    ("vertex_indices", "corners", "have no list vertex_indices"),
    ("float z", "float w", "element vertex has no property z"),
    ("element vertex", "element point", "has no element vertex"),
])  # fmt: skip
def test_a_header_that_declares_something_else_is_refused(refuse, old, new, message):
    data = ply_text().decode()
    assert old in data
    refuse("a.ply", data.replace(old, new, 1).encode("latin-1"), message)


def test_a_header_of_one_line_is_refused(refuse):
    refuse("a.ply", b"ply\nend_header\n", "expected `format` and one of")


def test_a_header_line_is_shown_cut_and_on_one_line(refuse):
    data = ply_text().replace(b"comment of nobody", b"x" * 5000)
    refuse(
        "a.ply",
        data,
        "expected an element with its count, or a property in the PLY header, got"
        " 'xxxxxxxxxxxx...xxxxxxxxxxxxx'",
    )


def test_strips_of_a_real_file_are_a_closed_surface(data_dir):
    mesh = read_mesh(data_dir / "meshes" / "igea_tristrips.ply")
    assert (mesh.n_vertices, mesh.n_faces) == (134345, 268686)
    counts = build_face_graph(mesh).edge_counts
    assert counts[1:] == (0, 0, 0)  # no boundary, and all triangles oriented alike


@pytest.mark.parametrize(
    ("name", "n_vertices", "n_faces"),
    [("bunny", 35947, 69451), ("hand", 53054, 105860), ("horse", 48485, 96966)],
)
def test_real_files_are_read_as_lagrange_reads_them(data_dir, name, n_vertices, n_faces):
    lagrange = pytest.importorskip("lagrange")
    path = data_dir / "meshes" / f"{name}.ply"
    mesh = read_mesh(path)
    assert (mesh.n_vertices, mesh.n_faces) == (n_vertices, n_faces)
    other = lagrange.io.load_mesh(path, quiet=True)
    assert_array_equal(mesh.vertices, other.vertices)
    assert_array_equal(mesh.faces, other.facets)
