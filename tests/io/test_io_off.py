"""Reading OFF."""

import pytest
from mesh_files import FACES, VERTICES, off
from numpy.testing import assert_array_equal

V4 = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


@pytest.mark.parametrize("block", [1, 30, None])
def test_vertices_and_faces_are_those_of_the_file_in_blocks_of_any_size(read, limit, block):
    if block:
        limit("block of text", block)
    mesh = read("a.off", off())
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)


@pytest.mark.parametrize(
    "head",
    ["OFF\n4 1 0\n", "OFF 4 1 5\n", "OFF\n4 1\n", "OFF4 1 0\n", "\n OFF # x\n\n#y\n 4 1 0 # z\n"],
)
def test_headers_as_they_are_found(read, head):
    mesh = read("a.off", f"{head}{V4}# faces\n 3 0 1 2 # the only one\n\n".encode())
    assert mesh.faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("word", ["COFF", "NOFF", "CNOFF", "STOFF", "STCNOFF"])
def test_colors_and_normals_of_vertices_are_skipped(read, word):
    vertices = "0 0 0 1 2 3 255\n1 0 0 1 2 3 255\n1 1 0 .1 .2 .3 1\n0 1 0 1 2 3\n"
    mesh = read("a.off", f"{word}\n4 1 0\n{vertices}3 1 2 3\n".encode())
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


@pytest.mark.parametrize("color", ["", " 7", " 255 0 0", " 0.5 0.25 0.125 1"])
def test_colors_of_faces_are_skipped(read, color):
    mesh = read("a.off", f"OFF\n4 2 0\n{V4}3 0 1 2{color}\n3 0 2 3{color}\n".encode())
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_only_some_faces_may_have_colors(read):
    mesh = read("a.off", f"OFF\n4 3 0\n{V4}3 0 1 2\n3 0 2 3 9 9 9\n3 0 1 3 .5 .5 .5 1\n".encode())
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3]]


@pytest.mark.parametrize("color", ["", " 0.5 0.5 0.5"])
def test_polygons_keep_their_corners_and_their_order(read, color):
    data = f"OFF\n4 3 0\n{V4}3 0 1 2{color}\n4 0 1 2 3{color}\n4 3 2 1 0\n"
    mesh = read("a.off", data.encode())
    assert mesh.offsets.tolist() == [0, 3, 7, 11]
    assert mesh.indices.tolist() == [0, 1, 2, 0, 1, 2, 3, 3, 2, 1, 0]
    quads = read("b.off", f"OFF\n4 2 0\n{V4}4 0 1 2 3{color}\n4 3 2 1 0{color}\n".encode())
    assert quads.indices.tolist() == [0, 1, 2, 3, 3, 2, 1, 0]


@pytest.mark.parametrize(("old", "new", "message"), [
    ("OFF\n", "OOF\n", "not an OFF file"), ("OFF\n", "", "not an OFF file"),
    ("OFF\n", "4OFF\n", "not an OFF file"), ("OFF\n", "OFFICE\n", "not an OFF file"),
    ("OFF\n", "OFF BINARY\n", "binary OFF files are not supported"),
    ("4 2 0", "4 two 0", "expected the counts of vertices, faces and edges, got '4 two 0'"),
    ("4 2 0", "4", "expected the counts of vertices, faces and edges, got '4'"),
    ("4 2 0", "4 -2 0", "expected the counts"), ("4 2 0", "4 2 0 0", "expected the counts"),
    ("4 2 0", "4 3 0", "declares 4 vertices and 3 faces, but 20 numbers in 6 lines follow"),
    ("4 2 0", f"4 {'9' * 5000} 0", f"declares 4 vertices and {'9' * 30} faces, but 20 numbers"),
    ("4 2 0", "4000000000 1 0", "declares 4000000000 vertices and 1 face, but 20 numbers"),
    ("4 2 0", "4 1 0", "declares 4 vertices and 1 face, but 20 numbers in 6 lines follow"),
    ("1 1 0\n", "1 1\n", "line 5: a vertex needs 3 coordinates, got 2"),
    ("1 1 0\n", "1 one 0\n", "line 5: expected a number, got 'one'"),
    ("1 1 0\n", "1 nan 0\n", "vertices[2] must be finite, got [1.0, nan, 0.0]"),
    ("1 1 0\n", "1 1e999 0\n", "vertices[2] must be finite, got [1.0, inf, 0.0]"),
    ("3 0 2 3", "3 0 2", "line 8: a face with 3 corners must have 3 indices, got 2"),
    ("3 0 2 3", "1", "faces[1] must have at least 3 corners, got 1"),
    ("3 0 2 3", "3.5 0 2 3", "corner counts must be integers, got 3.5"),
    ("3 0 2 3", "3 0 2.5 3", "vertex indices must be integers, got 2.5"),
    ("3 0 2 3", "3 0 2 x", "line 8: expected a number, got 'x'"),
    ("3 0 2 3", "3 0 2 -", "line 8: expected a number, got '-'"),
    ("3 0 2 3", "2 0 2 3", "faces[1] must have at least 3 corners, got 2"),
    ("3 0 2 3", "-3 0 2 3", "faces[1] must have at least 3 corners, got -3"),
    ("3 0 1 2\n3 0 2 3", "3 0 1\n2\n-3", "faces[1] must have at least 3 corners, got -3"),
    ("3 0 2 3", "3 0 2 4", "faces[1] refers to vertex 4 but the mesh has 4 vertices"),
    ("3 0 2 3", "3 0 2 -1", "faces[1] refers to vertex -1 but the mesh has 4 vertices"),
    ("3 0 2 3", "3 0 2 1e300", "vertex indices must be integers, got 1e+300"),
    ("3 0 2 3", "3 0 2 nan", "vertex indices must be integers, got nan"),
    ("3 0 2 3", "nan 0 2\n3", "20 numbers in 7 lines follow"),
    ("3 0 2 3", "inf 0 2\n3", "20 numbers in 7 lines follow"),
    ("3 0 2 3", "1e30 0 2\n3", "20 numbers in 7 lines follow"),
])  # fmt: skip
def test_off_files_that_are_wrong_are_refused(refuse, old, new, message):
    data = f"OFF\n4 2 0\n{V4}3 0 1 2\n3 0 2 3\n"
    assert old in data
    refuse("a.off", data.replace(old, new, 1).encode(), message)


@pytest.mark.parametrize("data", [b"OFF", b"OFF\n", b"OFF\n0 0 0\n", b"OFF\n4 0 0\n" + V4.encode()])
def test_off_files_without_faces_are_refused(refuse, data):
    refuse("a.off", data, "expected the counts" if len(data) < 5 else "no faces")
    if len(data) > 20:  # four points, also in one line
        refuse("a.off", data[:10] + data[10:].replace(b"\n", b" "), "no faces")
