"""Reading OBJ."""

import numpy as np
import pytest
from mesh_files import FACES, VERTICES, obj
from numpy.testing import assert_array_equal

from superfacets import PolygonMesh
from superfacets.files.readers.read import read_attributes, read_mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def test_vertices_and_faces_are_those_of_the_file_in_their_order(read):
    mesh = read("a.obj", obj())
    assert_array_equal(mesh.vertices, VERTICES)
    assert_array_equal(mesh.faces, FACES)


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\r"])
def test_line_ends_of_every_system(read, newline):
    assert_array_equal(read("a.obj", obj().replace(b"\n", newline)).faces, FACES)


def test_a_byte_order_mark_and_a_missing_last_newline(read):
    assert_array_equal(read("a.obj", b"\xef\xbb\xbf" + obj().rstrip()).vertices, VERTICES)


def test_texture_seams_and_normals_do_not_split_vertices(read):
    extra = "vt 0 0\nvt 1 0\nvt .5 .5\nvn 0 0 1\nvn 0 1 0\nvp 1 2\n"
    faces = "f 1/1/1 2/2/1 3/3/1\nf 1/3/2 3/1/2 4/2/2\nf 1//1 2//1 4//2\nf 2/1 3/2 4/3\nf 1/ 2/ 4\n"
    mesh = read("a.obj", (SQUARE + extra + faces).encode())
    assert mesh.n_vertices == 4
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3], [0, 1, 3]]


def test_groups_objects_and_materials_are_one_mesh_in_file_order(read, tmp_path):
    data = (
        f"mtllib no.mtl\no a\n{SQUARE}usemtl x\nf 1 2 3\no b\nv 5 5 5\nf 1 2 5\ng c\nusemtl x\n"
        "s off\nf 3 4 5\no a\nf 1 2 4\nl 1 2\np 1\n"
    )
    mesh = read("a.obj", data.encode())
    assert mesh.n_vertices == 5
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 1, 4], [2, 3, 4], [0, 1, 3]]
    assert read_attributes(tmp_path / "a.obj").fates["texture"] == ("materials",)  # no texture


def test_negative_indices_count_back_from_the_vertices_so_far(read):
    mesh = read("a.obj", (SQUARE + "f -4 -3 -2\nv 2 2 2\nf -1/1 -2//7 -3/2/2\n").encode())
    assert mesh.faces.tolist() == [[0, 1, 2], [4, 3, 2]]


def test_faces_may_come_before_their_vertices(read):
    assert read("a.obj", ("f 1 2 3\n" + SQUARE).encode()).faces.tolist() == [[0, 1, 2]]


def test_numbers_after_some_positions_are_left_out(read, tmp_path):
    data = "v 0 0 0 1\nv 1 0 0 .1 .2 .3\nv 0 1 0\nv 1 1 1 1 .1 .2 .3\nf 1 2 3\nf 2 3 4\n"
    assert read("a.obj", data.encode()).vertices[:, 0].tolist() == [0, 1, 0, 1]
    left_out = read_attributes(tmp_path / "a.obj").left_out
    assert left_out == ("numbers after the positions of vertices",)


def test_comments_indents_tabs_and_continued_lines(read):
    data = f"# a\n\n  {SQUARE}\tf\t1 2 \\\n 3 # and why\nf 1 \\\r\n3 4 \t\n#f 1 2 4\n"
    assert read("a.obj", data.encode()).faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_a_comment_does_not_go_on_in_the_next_line(read):
    data = b"v 0 0 0\n# C:\\scans\\\nv 1 0 0\nv 0 1 0 # a \\\nf 1 \\\n2 3\n"
    mesh = read("a.obj", data)
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 2]]


def test_degenerate_faces_are_kept(read):
    assert read("a.obj", (SQUARE + "f 1 1 2\nf 1 2 3\n").encode()).faces[0].tolist() == [0, 0, 1]


@pytest.mark.parametrize("block", [1, 7, 64])
def test_the_size_of_blocks_does_not_matter(read, limit, block):
    data = obj() + b"vt 0 0\nf -1/1 2/1 3/1\nv 7 7 7\nf 1/1/1 -1/1/1 2\n" + b" " * 100
    expected = read("a.obj", data)
    limit("block of text", block)
    mesh = read("a.obj", data)
    assert_array_equal(mesh.vertices, expected.vertices)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [4, 1, 2], [0, 5, 1]]


@pytest.mark.parametrize("block", [1, 1 << 23])
def test_polygons_keep_their_corners_and_their_order(read, limit, block):
    limit("block of text", block)
    data = SQUARE + "f 1 2 3\nf 1/1 2/1 3/1 4/1\nf 4 3 2 1\nf 1 2 3 4 1\n"
    mesh = read("a.obj", data.encode())
    assert isinstance(mesh, PolygonMesh)
    assert mesh.offsets.tolist() == [0, 3, 7, 11, 16]
    assert mesh.indices.tolist() == [0, 1, 2, 0, 1, 2, 3, 3, 2, 1, 0, 0, 1, 2, 3, 0]


def test_a_wrong_index_of_a_polygon_is_refused_as_it_is_written(refuse):
    data = SQUARE + "f 1 2 3 # 4\n\nf 1 2 3 4\nf 1 2 3 -9\n"
    refuse(
        "a.obj",
        data.encode(),
        "line 8: the face refers to vertex -9, but the vertices have the numbers 1 to 4",
    )


@pytest.mark.parametrize(("line", "n_corners"), [("f", 0), ("f 1", 1), ("f 1 2", 2)])
def test_a_last_face_that_was_cut_is_refused(refuse, line, n_corners):
    text = (SQUARE + "f 1 2 3\n" + line).encode()
    refuse("a.obj", text, f"faces[1] must have at least 3 corners, got {n_corners}")


@pytest.mark.parametrize("index", [0, 5, -5, 9223372036854775807, -9223372036854775807])
def test_indices_out_of_range_are_refused_as_the_file_writes_them(refuse, index):
    data = SQUARE + f"f 1 2 3\nf 1 2 {index}\n"
    message = f"line 6: the face refers to vertex {index}, but the vertices have the numbers 1 to 4"
    refuse("a.obj", data.encode(), message)


@pytest.mark.parametrize("digits", [20, 5000])
@pytest.mark.parametrize("sign", ["", "-"])
def test_indices_of_many_digits_are_refused(refuse, digits, sign):
    refuse("a.obj", f"{SQUARE}f 1 2 {sign}{'9' * digits}\n".encode(), "line 5: the face refers to")


def test_a_vertex_of_two_coordinates_is_refused(refuse):
    data = (SQUARE + "v 1 2\nf 1 2 3\n").encode()
    refuse("a.obj", data, "line 5: a vertex needs 3 coordinates, got 2")


@pytest.mark.parametrize("data", [b"hello\nworld\n", b"\n \n"])
def test_foreign_content_is_refused(refuse, data):
    refuse("a.obj", data, "not an OBJ file: it has no `v` and no `f` lines")


def test_a_point_cloud_is_refused(refuse):
    refuse("a.obj", SQUARE.encode(), "the file contains points, but no faces: use read_cloud")


@pytest.mark.parametrize("name", ["spot", "cow", "fandisk"])
def test_real_files_are_read_as_lagrange_reads_them(data_dir, name):
    lagrange = pytest.importorskip("lagrange")
    path = data_dir / "meshes" / f"{name}.obj"
    mesh = read_mesh(path)
    other = lagrange.io.load_mesh(path, quiet=True)
    assert_array_equal(mesh.faces, other.facets)
    # lagrange rounds some decimals wrongly, by one unit in the last place.
    np.testing.assert_allclose(mesh.vertices, other.vertices, rtol=1e-15, atol=0)
