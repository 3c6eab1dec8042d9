"""Reading STL."""

import numpy as np
import pytest
from mesh_files import CORNERS, SOUP_FACES, stl_binary, stl_text
from numpy.testing import assert_array_equal

from superfacets import read_attributes


@pytest.mark.parametrize("data", [stl_binary(), stl_text()], ids=["binary", "ascii"])
def test_every_face_has_three_vertices_of_its_own(read, data):
    mesh = read("a.stl", data)
    assert_array_equal(mesh.vertices, CORNERS)
    assert_array_equal(mesh.faces, SOUP_FACES)


def test_binary_coordinates_are_those_of_single_precision(read):
    assert_array_equal(
        read("a.stl", stl_binary(CORNERS + 0.1)).vertices, (CORNERS + 0.1).astype(np.float32)
    )


def test_ascii_coordinates_are_doubles(read):
    assert_array_equal(read("a.stl", stl_text(CORNERS + 0.1)).vertices, CORNERS + 0.1)


def test_a_binary_header_may_begin_with_solid(read):
    assert_array_equal(read("a.stl", stl_binary(head=b"solid foo")).vertices, CORNERS)


@pytest.mark.parametrize("change", [bytes.upper, lambda data: data.replace(b"\n", b"\r\n")])
def test_ascii_in_upper_case_and_with_other_line_ends(read, change):
    assert_array_equal(read("a.stl", change(stl_text())).vertices, CORNERS)


def test_several_solids_are_one_mesh_in_file_order(read):
    mesh = read("a.stl", stl_text(CORNERS[3:], "b") + stl_text(CORNERS[:3], "with facet vertex"))
    assert_array_equal(mesh.vertices, np.concatenate([CORNERS[3:], CORNERS[:3]]))


@pytest.mark.parametrize("block", [1, 50])
def test_the_size_of_blocks_does_not_matter(read, limit, block):
    limit("block of text", block)
    assert_array_equal(read("a.stl", stl_text()).vertices, CORNERS)


@pytest.mark.parametrize("n_faces", [0, 1, 3, 4_000_000_000])
def test_a_binary_count_that_does_not_fit_the_size_is_refused(refuse, n_faces):
    size = 84 + 50 * n_faces
    noun = "triangle" if n_faces == 1 else "triangles"
    message = f"the size must be {size} bytes for {n_faces} declared {noun}, got 184"
    refuse("a.stl", stl_binary(n_faces=n_faces), message)


def test_blanks_may_follow_a_binary_file(read):
    assert read("a.stl", stl_binary() + b"\0\0\r\n").n_faces == 2


def test_no_faces_are_refused(refuse):
    refuse("a.stl", stl_binary(np.empty((0, 9))), "the mesh has no faces")
    refuse("a.stl", b"solid\nendsolid\n", "the mesh has no faces")


@pytest.mark.parametrize(("old", "new", "message"), [
    ("vertex 1.0 0.0 0.0", "vertex 1.0 0.0", "line 5: a vertex needs 3 coordinates, got 2"),
    ("vertex 1.0 0.0 0.0", "vertex", "line 5: a vertex needs 3 coordinates, got 0"),
    ("vertex 1.0 0.0 0.0", "vertex 1.0 zz 0.0", "line 5: expected a number, got 'zz'"),
    ("      vertex 1.0 0.0 0.0\n", "", "line 6: expected the keyword vertex"),
    ("    endloop\n", "vertex 3 3 3\nendloop\n", "line 7: faces[0] has more than 3 corners"),
    ("outer loop", "inner loop", "line 3: expected the keyword outer"),
    ("endsolid square\n", "endsolidity\n", "line 16: the file ends, but not after a facet"),
    ("  endfacet\nendsolid", "endsolid", "the last facet is incomplete"),
    ("solid square\n", "solids square\n", "line 1: expected the keyword facet"),
])  # fmt: skip
def test_ascii_files_of_another_structure_are_refused(refuse, old, new, message):
    data = stl_text().decode()
    assert old in data
    refuse("a.stl", data.replace(old, new, 1).encode(), message)


def test_foreign_content_is_refused(refuse):
    refuse("a.stl", b"hello\n", "not an STL file: it has 6 bytes and no word solid")
    refuse("a.stl", b"\xff\xd8\xff\xe0\0\x10JFIF\0" * 20, "the file is a picture, not a mesh")
    refuse("a.stl", b"solid\0" + b"x" * 200, "not an STL file, or damaged")


@pytest.mark.parametrize(("old", "new", "is_noted"), [
    ("endsolid square\n", "", True), ("endsolid square\n", "solid b\nendsolid\n", True),
    ("endsolid square\n", "end solid\n", False), ("endloop\n", "end loop\n", False),
])  # fmt: skip
def test_solids_without_an_end_are_read_with_a_note(tmp_path, old, new, is_noted):
    path = tmp_path / "a.stl"
    path.write_text(stl_text().decode().replace(old, new))
    attributes = read_attributes(path)
    note = "end of a solid, which is missing: the file may be truncated"
    assert attributes.left_out == ((note,) if is_noted else ())
