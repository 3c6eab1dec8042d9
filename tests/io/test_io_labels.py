"""Reading labels."""

import io

import numpy as np
import pytest
from mesh_files import ORDERS, VERTICES, ply_header, ply_text, stl_binary
from numpy.testing import assert_array_equal

from superfacets import Mesh, MeshAttributes, MeshError
from superfacets.files.readers.labels import read_labels
from superfacets.files.writers.write import write_labels, write_mesh
from superfacets.tools.cell_file import CellFile

LABELS = np.array([3, 0, 2**31 - 1], dtype=np.int32)


def labels_in(path, name="label"):
    own = CellFile.read(path, path.suffix).own_labels(None, name)
    return own.values if own and not own.are_parts else None


def npy(array, **options) -> bytes:
    file = io.BytesIO()
    np.save(file, array, **options)
    return file.getvalue()


def ply_with_labels(form="ascii", kind="int", labels=(3, 0)) -> bytes:
    faces = (
        f"property list uchar int vertex_indices\nproperty {kind} label\nproperty float quality\n"
    )
    header = ply_header(form, faces=faces).encode()
    if form == "ascii":
        rows = "".join(f"4 0 1 2 3 {label} 0.5\n" for label in labels)
        return header + ("0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n" + rows).encode()
    order = ORDERS[form]
    code = {"int": "i4", "uchar": "u1", "short": "i2", "uint32": "u4", "double": "f8"}[kind]
    row = np.dtype(
        [("n", "u1"), ("face", order + "i4", 4), ("label", order + code), ("q", order + "f4")]
    )
    table = np.array([(4, (0, 1, 2, 3), label, 0.5) for label in labels], dtype=row)
    return header + VERTICES.astype(order + "f4").tobytes() + table.tobytes()


@pytest.fixture
def read(tmp_path):
    def read_content(name, data, n_faces=None):
        path = tmp_path / name
        path.write_bytes(data)
        return read_labels(path, n_faces)

    return read_content


@pytest.fixture
def refuse(read, tmp_path):
    def expect_refusal(name, data, message, n_faces=None):
        with pytest.raises(MeshError) as caught:
            read(name, data, n_faces)
        text = str(caught.value)
        assert text.startswith(f"{tmp_path / name}: ")
        assert "\n" not in text
        assert message in text

    return expect_refusal


@pytest.mark.parametrize("ending", [".npy", ".seg", ".txt"])
def test_labels_come_back_as_they_were_written(tmp_path, ending):
    path = tmp_path / f"a{ending.upper()}"
    write_labels(path, LABELS)
    labels = read_labels(path, 3)
    assert labels.dtype == np.int32
    assert_array_equal(labels, LABELS)


@pytest.mark.parametrize("dtype", ["i1", "u1", "<i2", ">i2", "<u4", ">i4", "<i8", ">u8"])
def test_npy_of_any_integer_type(read, dtype):
    assert_array_equal(read("a.npy", npy(np.array([5, 0, 7], dtype))), [5, 0, 7])


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_npy_of_any_version(read, version):
    np.lib.format.write_array(file := io.BytesIO(), LABELS, version=version)
    assert_array_equal(read("a.npy", file.getvalue()), LABELS)


def test_npy_of_python_2(read):
    data = npy(LABELS).replace(b"(3,), }  ", b"(3L,), } ")
    assert b"3L" in data
    assert_array_equal(read("a.npy", data), LABELS)


@pytest.mark.parametrize("data", [b"3\n0\n2\n", b"3\r\n0\r\n2", b" 3 \n\n0\n+2\n\n"])
def test_text_as_it_is_found(read, data):
    assert_array_equal(read("a.seg", data, 3), [3, 0, 2])
    assert_array_equal(read("a.txt", data), [3, 0, 2])


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("kind", ["int", "uchar", "short", "uint32"])
def test_ply_of_any_integer_type_and_with_polygons(read, form, kind):
    assert_array_equal(read("a.ply", ply_with_labels(form, kind), 2), [3, 0])


@pytest.mark.parametrize(("name", "data"), [("a.npy", npy(LABELS)), ("a.seg", b"1\n2\n3\n")])
def test_another_number_of_faces_is_refused(refuse, name, data):
    refuse(name, data, "labels must have one value per cell (1), got 3 values", n_faces=1)
    refuse(name, data, "labels must have one value per cell (4), got 3 values", n_faces=4)


@pytest.mark.parametrize(("array", "message"), [
    (np.array([[1, 2]]), "labels must be one-dimensional, got shape"),
    (np.array(1), "labels must be one-dimensional, got shape"),
    (np.array([1.0, 2.0]), "labels must contain integers, got float64"),
    (np.array([True]), "labels must contain integers, got bool"),
    (np.array(["a"]), "labels must contain integers, got <U1"),
    (np.array([(1, 2)], dtype="i4,i4"),
     "shape, a tuple of integers, got {'descr': [('f0', '<i4'), ('f1', '<i4')], "),
    (np.array([1, -2]), "labels[1] must be -1 to 2147483647, got -2"),
    (np.array([1, 2**31]), "labels[1] must be -1 to 2147483647, got 2147483648"),
    (np.array([2**64 - 1], dtype="u8"),
     "labels[0] must be -1 to 2147483647, got 18446744073709551615"),
    (np.array([], dtype=int), "labels must have at least one value, got an empty array"),
])  # fmt: skip
def test_npy_of_something_else_is_refused(refuse, array, message):
    refuse("a.npy", npy(array), message)


@pytest.mark.parametrize(("data", "message"), [
    (b"hello", "the header of the .npy file cannot be read: "),
    (npy(LABELS)[:7],
     r"cannot be read: expected the magic bytes \x93NUMPY and version 1.0, 2.0 or 3.0"),
    (npy(LABELS)[:9], "the header of the .npy file cannot be read: "),
    (npy(LABELS)[:60], "the file ends after 60 bytes, but 118 more are declared at byte 10"),
    (npy(LABELS).replace(b"(3,)", b"(3,,"), "the header of the .npy file cannot be read: "),
    (npy(LABELS).replace(b"(3,)", b"(-) "), "the header of the .npy file cannot be read: "),
    (npy(LABELS).replace(b"(3,)", b"True"), "expected descr, a type such as '<i4', "),
    (npy(LABELS).replace(b"(3,)", b"(1.)"), "the header of the .npy file cannot be read: "),
    (npy(LABELS).replace(b"False", b"(0,) "), "shape, a tuple of integers, got {'descr': '<i4', "),
    (npy(LABELS).replace(b"'<i4'", b"'<i3'"), "the header of the .npy file cannot be read: "),
    (npy(LABELS).replace(b"'<i4'", b"'i,i'"), "shape, a tuple of integers, got {'descr': 'i,i', "),
    (npy(LABELS).replace(b"'<i4'", b"b'\\d'"), "the header of the .npy file cannot be read: "),
    (npy(LABELS).replace(b"'<i4'", b"[]*99"), "the header of the .npy file cannot be read: "),
    (npy(LABELS).replace(b"'shape'", b"'order'"), "expected descr, a type such as '<i4', "),
    (npy(LABELS).replace(b"{'descr'", b"{[]:1,  "),
     "the header of the .npy file cannot be read"),
    (b"\x93NUMPY\4\0" + npy(LABELS)[8:], "version 1.0, 2.0 or 3.0"),
    (b"\x93NUMPY\2\0\x58\x1b\0\0" + 7_000 * b"[", "the header of the .npy file cannot be read"),
    (b"\x93NUMPY\2\0\xff\xff\xff\xff" + 90_000 * b" ",
     "its length must be at most 10000 bytes, got 4294967295"),
    (npy(np.array([1, None]), allow_pickle=True), "numbers: the .npy header declares object"),
    (npy(LABELS)[:-1],
     "the .npy header declares 12 bytes of numbers, but is followed by 11: the file may be"
     " truncated"),
    (npy(LABELS) + b"1",
     "the .npy header declares 12 bytes of numbers, but is followed by 13: the file may be"
     " truncated"),
    (npy(LABELS).replace(b"(3,)", b"(9999999999,)"),
     "the .npy header declares 39999999996 bytes of numbers, but is followed by 21: the file may"
     " be truncated or damaged"),
    (npy(LABELS).replace(b"(3,)", b"(-3,)"),
     "the .npy header declares -12 bytes of numbers, but is followed by 13: the file may be"
     " truncated or damaged"),
])  # fmt: skip
def test_npy_that_is_wrong_is_refused(refuse, data, message):
    refuse("a.npy", data, message)


@pytest.mark.parametrize("text", [
    b"{'descr': '<i4', 'fortran_order': False, 'shape': (3,), }",
    b"{'shape':(3,),'fortran_order':False,'descr':'<i4'}",
    b' {"descr" : "<i4" , "fortran_order" : True , "shape" : ( 3 , ) } \n',
])  # fmt: skip
def test_npy_headers_of_other_writers(read, text):
    data = b"\x93NUMPY\1\0" + len(text).to_bytes(2, "little") + text + LABELS.tobytes()
    assert_array_equal(read("a.npy", data), LABELS)


def test_npy_headers_are_read_without_ast(read, broken):
    """In CPython 3.11, `ast` fails if several threads use it at the same time."""

    broken("ast.literal_eval", SystemError("AST constructor recursion depth mismatch"))
    assert_array_equal(read("a.npy", npy(LABELS)), LABELS)


@pytest.mark.parametrize(("data", "message"), [
    (b"1\n2.0\n", "line 2: expected an integer, got '2.0'"),
    (b"1\n\nx\n", "line 3: expected an integer, got 'x'"),
    (b"1\n-\n", "line 2: expected an integer, got '-'"),
    (b"1\n2 3\n", "line 2: expected 1 number, got 2"),
    (b"1\n-2\n", "labels[1] must be -1 to 2147483647, got -2"),
    (b"99999999999999999999\n", "labels[0] must be -1 to 2147483647, got 9223372036854775807"),
    (b"\n \n", "labels must have at least one value, got an empty array"),
    (b"\xff\xd8\xff\xe0\0\x10JFIF\0" * 20, "the file is a picture, not a mesh"),
])  # fmt: skip
def test_text_of_something_else_is_refused(refuse, data, message):
    refuse("a.seg", data, message)


@pytest.mark.parametrize(("data", "message"), [
    (ply_text(), "the faces have no property label"),
    (ply_with_labels(kind="float", labels=(0.5, 1)), "labels must be integers"),
    (ply_with_labels(labels=(1.5, 2)), "labels must be integers, got 1.5"),
    (ply_with_labels(labels=(1, -2)), "labels[1] must be -1 to 2147483647, got -2"),
    (ply_text(faces=[]), "the points have no property label"), (b"1\n2\n", "not a PLY file"),
])  # fmt: skip
def test_ply_without_labels_is_refused(refuse, data, message):
    refuse("a.ply", data, message)


def test_labels_of_another_name_are_read(tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(ply_with_labels().replace(b"int label", b"int Part"))
    assert_array_equal(read_labels(path, name="Part"), [3, 0])
    assert_array_equal(labels_in(path, "Part"), read_labels(path, name="Part"))
    assert labels_in(path) is None
    message = r"the faces have no property label: choose --labels-named \(name=\) from Part$"
    with pytest.raises(MeshError, match=message):
        read_labels(path)
    of_vertices = MeshAttributes(vertex={"label": [5, 0, 0, 7, 9]})
    write_mesh(path, Mesh(VERTICES, [[0, 1, 2], [1, 2, 3]]), attributes=of_vertices)
    assert_array_equal(read_labels(path), [5, 0, 0, 7, 9])


@pytest.mark.parametrize("ending", [".stl", ".obj"])
def test_regions_come_back_from_solids_and_groups(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    mesh = Mesh(VERTICES, [[0, 1, 2], [1, 2, 3], [0, 2, 3], [0, 1, 3]])
    write_mesh(path, mesh, [17, -1, 4, 17])
    assert_array_equal(read_labels(path, 4), [-1, 4, 17, 17])  # faces are in the order of regions
    assert_array_equal(labels_in(path), read_labels(path))
    write_mesh(path, mesh)
    assert labels_in(path) is None


def test_named_parts_are_numbered_in_their_order(tmp_path):
    path = tmp_path / "a.stl"
    facet = (
        "facet normal 0 0 0\nouter loop\n"
        + "vertex 0 0 0\nvertex 1 0 0\n"
        + "vertex 0 1 0\nendloop\nendfacet\n"
    )
    names = ("inlet", "wall", "Inlet", "wall", "")
    path.write_text("".join(f"SOLID {name}\n{2 * facet}endsolid\n" for name in names))
    assert_array_equal(read_labels(path), [0, 0, 1, 1, 2, 2, 1, 1, 3, 3])
    assert labels_in(path) is None
    path, vertices = tmp_path / "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    path.write_text(f"{vertices}f 1 2 3\no car\nf 1 2 3\ng front \\\n door # left\nf 1 2 3\n")
    assert_array_equal(read_labels(path), [-1, 0, 1])
    assert_array_equal(read_labels(path, name="object"), [-1, 0, 0])
    path.write_text(f"{vertices}g car\nf 1 2 3\ng region_7\nf 1 2 3\n")
    assert_array_equal(read_labels(path), [0, 1])


def test_files_without_parts_are_refused(refuse):
    refuse("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "the faces have no property label")
    refuse("a.stl", stl_binary(), "the faces have no property label")


def test_a_real_segmentation(data_dir):
    path = next((data_dir / "psb" / "seg" / "Benchmark" / "1").glob("*.seg"))
    assert read_labels(path).tolist() == [int(line) for line in path.read_text().split()]


def test_ids_of_vertices_come_back_from_scannets_files(tmp_path):
    write_labels(tmp_path / "a.0.010000.segs.json", [7, 0, 7])
    read = read_labels(tmp_path / "a.0.010000.segs.json", 3)
    assert (read.tolist(), read.dtype) == ([7, 0, 7], np.int32)


@pytest.mark.parametrize(("data", "message"), [
    (b'{"segIndices": [1, 2', "the file is not valid JSON: "),
    (b"[1, 2]", "must have segIndices, a list of integers >= 0"),
    (b'{"segIndices": [1, [2]]}', "must have segIndices, a list of integers >= 0"),
    (b'{"segIndices": [1, -1]}', "must have segIndices, a list of integers >= 0"),
    (b'{"segIndices": [1, 3000000000, 0, 0]}',
     "labels[1] must be -1 to 2147483647, got 3000000000"),
    (b'{"segIndices": [1, 2]}', "labels must have one value per cell (4), got 2 values"),
])  # fmt: skip
def test_damaged_files_of_segments_are_refused(refuse, data, message):
    refuse("a.segs.json", data, message, 4)
