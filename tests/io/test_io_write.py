"""Writing meshes and labels."""

import numpy as np
import pytest
from mesh_files import FACES, VERTICES
from numpy.testing import assert_array_equal

from superfacets import Mesh
from superfacets.files.readers.labels import read_labels
from superfacets.files.readers.read import read_mesh
from superfacets.files.writers.cells import FormatOptions
from superfacets.files.writers.write import OutputFiles, write_labels, write_mesh

LABELS = [7, 0]

COLORS = np.array([[255, 0, 10], [1, 2, 3]], dtype=np.uint8)


@pytest.fixture
def mesh():
    return Mesh(VERTICES, FACES)


@pytest.fixture
def fake_colors(monkeypatch):
    """`face_colors` returns (f, region, 0) for face f; the labels that it gets are recorded."""
    import superfacets_show.colors

    calls = []

    def face_colors(mesh, labels):
        calls.append(labels.tolist())
        colors = [np.arange(mesh.n_faces), labels, np.zeros(mesh.n_faces)]
        return np.stack(colors, axis=1).astype(np.uint8)

    monkeypatch.setattr(superfacets_show.colors, "face_colors", face_colors)
    return calls


def test_the_ascii_file_is_what_the_documentation_says(tmp_path, mesh):
    write_mesh(tmp_path / "a.ply", mesh, LABELS, colors=COLORS, ascii=True)
    assert (tmp_path / "a.ply").read_text() == (
        "ply\nformat ascii 1.0\nelement vertex 5\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\n"
        "property int label\nproperty float quality\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
        "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n9 9 9\n"
        "3 0 1 2 7 7 255 0 10 255\n3 0 2 3 0 0 1 2 3 255\n"
    )


def test_the_binary_file_is_what_the_documentation_says(tmp_path, mesh):
    write_mesh(tmp_path / "a.ply", mesh, LABELS, colors=COLORS)
    header, _, body = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    assert b"format binary_little_endian 1.0\n" in header
    row = [("n", "u1"), ("face", "<i4", 3), ("label", "<i4"), ("quality", "<f4"), ("rgba", "u1", 4)]
    rows = np.array(
        [(3, (0, 1, 2), 7, 7, (255, 0, 10, 255)), (3, (0, 2, 3), 0, 0, (1, 2, 3, 255))], dtype=row
    )
    assert body == VERTICES.astype("<f4").tobytes() + rows.tobytes()


def test_a_mesh_alone_has_no_labels_and_no_colors(tmp_path, mesh):
    write_mesh(tmp_path / "a.ply", mesh)
    header = (tmp_path / "a.ply").read_bytes().partition(b"end_header")[0]
    assert b"label" not in header
    assert b"red" not in header


def test_colors_need_no_labels(tmp_path, mesh):
    write_mesh(tmp_path / "a.ply", mesh, colors=COLORS.tolist(), ascii=True)
    text = (tmp_path / "a.ply").read_text()
    assert "label" not in text
    assert text.endswith("3 0 1 2 255 0 10 255\n3 0 2 3 1 2 3 255\n")


def test_labels_without_colors_get_colors(tmp_path, mesh, fake_colors):
    write_mesh(tmp_path / "a.ply", mesh, LABELS, ascii=True)
    assert (tmp_path / "a.ply").read_text().endswith("7 7 0 7 0 255\n3 0 2 3 0 0 1 0 0 255\n")
    assert fake_colors == [[7, 0]]


@pytest.mark.parametrize("ascii", [False, True])
@pytest.mark.parametrize(("vertices", "kind"), [
    (VERTICES.astype(np.float32) + np.float32(0.1), "float"),
    (VERTICES + 0.1, "double"),
    (np.concatenate([VERTICES, [[1e39, 0, 0]]]), "double"),  # a vertex of no face
    (VERTICES - 1e-300, "double"),
    (np.concatenate([VERTICES, [[2.0**-149, 0, 0]]]), "float"),
])  # fmt: skip
def test_coordinates_come_back_exactly_in_the_smaller_type_that_can_hold_them(
    tmp_path, ascii, vertices, kind
):
    mesh = Mesh(vertices, FACES)
    write_mesh(tmp_path / "a.ply", mesh, ascii=ascii)
    assert f"property {kind} x\n".encode() in (tmp_path / "a.ply").read_bytes()
    assert_array_equal(read_mesh(tmp_path / "a.ply").vertices, mesh.vertices)
    assert_array_equal(read_mesh(tmp_path / "a.ply").faces, mesh.faces)


@pytest.mark.parametrize("ascii", [False, True])
def test_many_rows_come_back(tmp_path, ascii, limit):
    limit("rows written at once", 1000)
    random = np.random.default_rng(1)
    mesh = Mesh(random.normal(size=(2345, 3)), random.integers(0, 2345, (4321, 3)))
    labels = random.integers(0, 2**31, 4321)
    write_mesh(tmp_path / "a.ply", mesh, labels, colors=np.zeros((4321, 3), int), ascii=ascii)
    assert_array_equal(read_mesh(tmp_path / "a.ply").vertices, mesh.vertices)
    assert_array_equal(read_mesh(tmp_path / "a.ply").faces, mesh.faces)
    assert_array_equal(read_labels(tmp_path / "a.ply"), labels)


def test_a_pair_of_arrays_is_a_mesh(tmp_path):
    write_mesh(tmp_path / "A.PLY", (VERTICES, FACES))
    assert read_mesh(tmp_path / "A.PLY").n_faces == 2


def test_label_files_hold_what_the_documentation_says(tmp_path):
    write_labels(tmp_path / "a.npy", LABELS)
    write_labels(tmp_path / "a.seg", LABELS)
    write_labels(tmp_path / "a.txt", np.array(LABELS, dtype=np.uint8))
    stored = np.load(tmp_path / "a.npy")
    assert stored.dtype == np.dtype("<i4")
    assert_array_equal(stored, LABELS)
    assert (tmp_path / "a.seg").read_bytes() == b"7\n0\n"
    assert (tmp_path / "a.txt").read_bytes() == b"7\n0\n"


@pytest.mark.parametrize(("labels", "message"), [
    ([1], r"labels must have one value per cell \(2\), got 1 value"),
    ([[1, 2]], "labels must be one-dimensional, got shape"),
    ([1.0, 2.0], "labels must contain integers, got float64"),
    ([True, False], "labels must contain integers, got bool"),
    ([0, -2], r"labels\[1\] must be -1 to 2147483647, got -2"),
    ([0, 2**31], r"labels\[1\] must be -1 to 2147483647, got 2147483648"),
    ([], "labels must have at least one value, got an empty array"),
])  # fmt: skip
def test_labels_that_are_wrong_are_refused_and_nothing_is_written(tmp_path, mesh, labels, message):
    with pytest.raises(ValueError, match=message):
        write_mesh(tmp_path / "a.ply", mesh, labels, colors=COLORS)
    with pytest.raises(ValueError, match=message):
        OutputFiles([tmp_path / "a.seg"]).write(mesh, labels)
    if len(labels) != 1 or np.ndim(labels) == 2:
        with pytest.raises(ValueError, match=message):
            write_labels(tmp_path / "a.seg", labels)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("colors", "message"), [
    ([[1, 2, 3]], r"colors must have shape \(2, 3\), got \(1, 3\)"),
    ([[0.5, 0.5, 0.5]] * 2, "colors must be integers from 0 to 255"),
    ([[0, 0, 256]] * 2, "colors must be integers from 0 to 255"),
    ([[0, 0, -1]] * 2, "colors must be integers from 0 to 255"),
])  # fmt: skip
def test_colors_that_are_wrong_are_refused(tmp_path, mesh, colors, message):
    with pytest.raises(ValueError, match=message):
        write_mesh(tmp_path / "a.ply", mesh, LABELS, colors=colors)
    assert not list(tmp_path.iterdir())


def test_unknown_endings_are_refused(tmp_path, mesh):
    meshes = (
        r"\.ply, \.vtp, \.obj, \.off, \.glb, \.ids\.png, \.stl, \.vtu, \.vtk, \.csv"
        r", \.pcd, \.las, \.laz"
    )
    ids = r"\.segs\.json, \.bin, _sp_label\.npy, \.pth, \.label\.gii, \.annot"
    ids += r", \.sstk\.json, \.aggregation\.json"
    with pytest.raises(
        ValueError, match=rf"a\.dae: expected the ending {meshes}, {ids}, \.npz, got"
    ):
        write_mesh(tmp_path / "a.dae", mesh)
    with pytest.raises(
        ValueError, match=rf"a\.ply: expected the ending \.npy, \.seg, \.txt, {ids}"
    ):
        write_labels(tmp_path / "a.ply", LABELS)
    for call in (OutputFiles.check, lambda outputs: outputs.write(mesh, LABELS)):
        with pytest.raises(ValueError, match=rf"{meshes}, \.npy, \.seg, \.txt, {ids}, \.npz, got"):
            call(OutputFiles([tmp_path / "a.npy", tmp_path / "a.dae"]))
    assert not list(tmp_path.iterdir())


def test_outputs_are_written_by_their_endings(tmp_path, mesh, fake_colors):
    names = ["a.ply", "a.npy", "a.seg", "b.TXT", "b.PLY"]
    OutputFiles([tmp_path / name for name in names]).check()
    assert not list(tmp_path.iterdir())
    options = FormatOptions(ascii=True)
    OutputFiles([str(tmp_path / name) for name in names], options).write(mesh, LABELS)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)
    for name in names:
        assert_array_equal(read_labels(tmp_path / name, 2), LABELS)
    assert (
        (tmp_path / "a.ply").read_text().endswith("3 0 1 2 7 7 0 7 0 255\n3 0 2 3 0 0 1 0 0 255\n")
    )
    assert len(fake_colors) == 1


def test_labels_alone_need_no_colors(tmp_path, mesh, fake_colors):
    OutputFiles([tmp_path / "a.seg"]).write(mesh, LABELS)
    assert fake_colors == []


def test_no_outputs_are_fine(mesh):
    OutputFiles([]).check()
    OutputFiles([]).write(mesh, LABELS)


def test_label_files_may_hold_labels_of_another_mesh(tmp_path):
    mesh, listed = tmp_path / "square.ply", tmp_path / "labels.npy"
    square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    OutputFiles([mesh, listed]).write(square, [4, 2], listed=[7])
    assert read_labels(mesh).tolist() == [4, 2]
    assert np.load(listed).tolist() == [7]
    with pytest.raises(ValueError, match=r"labels\[0\] must be -1 to 2147483647, got -2"):
        OutputFiles([mesh, listed]).write(square, [4, 2], listed=[-2])
    assert np.load(listed).tolist() == [7]
