"""GIFTI and FreeSurfer: surfaces and labels as nibabel writes and reads them; damaged files."""

import random
import struct
import tracemalloc

import damage
import numpy as np
import pytest
import shapes

from superfacets import (
    MeshError,
    face_colors,
    read_attributes,
    read_labels,
    read_mesh,
    segment,
    vertex_labels,
    write_labels,
    write_mesh,
)
from superfacets.files.readers.read import recognized_ending
from superfacets_formats.cortex import label_names

nibabel = pytest.importorskip("nibabel")
gifti, freesurfer = nibabel.gifti, nibabel.freesurfer

MESH = shapes.cube()
SURFACE = np.float32(MESH.vertices), np.int32(MESH.faces)
LABELS = np.arange(MESH.n_faces) // 2 * 3  # a region per side, with gaps


def gifti_bytes(arrays, **options):
    """Return a GIFTI file with these arrays, keyed by intent."""
    image = gifti.GiftiImage()
    for intent, values in arrays.items():
        kinds = f"NIFTI_INTENT_{intent}", f"NIFTI_TYPE_{values.dtype.name.upper()}"
        image.add_gifti_data_array(gifti.GiftiDataArray(values, *kinds, **options))
    return image.to_bytes()


def surface_bytes(**options):
    arrays = {"POINTSET": SURFACE[0], "TRIANGLE": SURFACE[1], "SHAPE": np.uint8([9] * 8)}
    return gifti_bytes(arrays, **options)


@pytest.fixture
def freesurfer_file(tmp_path):
    freesurfer.write_geometry(tmp_path / "lh.white", *SURFACE, create_stamp="made by a test")
    return (tmp_path / "lh.white").read_bytes()


@pytest.mark.parametrize("encoding", ["ASCII", "B64BIN", "B64GZ"])
@pytest.mark.parametrize("options", [{}, {"endian": "big"}, {"ordering": "F"}])
def test_surfaces_of_gifti(read, tmp_path, encoding, options):
    if encoding == "ASCII" and "ordering" in options:
        pytest.skip("nibabel writes text in the other order than it declares")
    data = surface_bytes(encoding=encoding, **options)
    mesh = read("cube.surf.gii", data)
    assert np.array_equal(mesh.vertices, MESH.vertices)
    assert np.array_equal(mesh.faces, MESH.faces)
    assert recognized_ending(data) == ".gii"
    assert read_attributes(tmp_path / "cube.surf.gii").vertex["shape"].dtype == np.uint8


def test_surfaces_of_freesurfer(read, freesurfer_file):
    for name in ("lh.white", "rh.pial", "LH.INFLATED"):
        mesh = read(name, freesurfer_file)
        assert np.array_equal(mesh.vertices, MESH.vertices)
        assert np.array_equal(mesh.faces, MESH.faces)
    assert recognized_ending(freesurfer_file) == ".white"


def test_labels_are_read_as_gifti_by_others(tmp_path):
    path = tmp_path / "cube.label.gii"
    write_mesh(path, MESH, LABELS)
    image = nibabel.load(path)
    of_vertices = read_labels(path)
    assert np.array_equal(image.agg_data("NIFTI_INTENT_LABEL"), of_vertices + 1)
    names = image.labeltable.get_labels_as_dict()
    assert names[0] == "???"
    assert {key: name for key, name in names.items() if key} == {
        label + 1: f"region_{label}" for label in np.unique(of_vertices).tolist()
    }
    colors = {one.key: (one.red, one.green, one.blue) for one in image.labeltable.labels}
    for label, color in zip(LABELS.tolist(), face_colors(MESH, LABELS) / 255, strict=True):
        if label in of_vertices:
            assert colors[label + 1] == pytest.approx(color, abs=1e-5)


def test_labels_are_read_as_annotations_by_others(tmp_path):
    path = tmp_path / "lh.cube.annot"
    write_mesh(path, MESH, LABELS)
    rows, table, names = freesurfer.read_annot(path)
    of_vertices = vertex_labels(MESH, LABELS, min_vertices=1)
    assert [names[row] for row in rows] == [b"region_%d" % label for label in of_vertices]
    assert names[0] == b"unknown"
    assert [label_names(path)[row - 1].encode() for row in rows] == [names[row] for row in rows]
    assert len(np.unique(table[:, -1])) == len(names)


@pytest.mark.parametrize("name", ["a.annot", "a.label.gii"])
def test_labels_of_vertices_and_their_names_come_back(tmp_path, name):
    for largest in (7, 7_000_000):
        labels = [5, -1, 0, 5, largest, 0]
        write_labels(tmp_path / name, labels)
        assert read_labels(tmp_path / name, 6).tolist() == labels
        names = label_names(tmp_path / name)
        assert all(names[label] == f"region_{label}" for label in (0, 5, largest))
        assert names[-1] in ("???", "unknown")
    write_mesh(tmp_path / name, MESH, [5, -1, 0, 5, 7, 0, 0, 0], classes=["a<b", "\u00e9", 9])
    assert label_names(tmp_path / name).items() >= {0: "a<b", 5: "\u00e9", 7: "9"}.items()
    with pytest.raises(
        MeshError, match=r"labels must be below 2\*\*24 in this format, got 16777216: renumber them"
    ):
        write_labels(tmp_path / name, [1 << 24])
    with pytest.raises(MeshError, match="but these are labels per face: convert them with superf"):
        write_labels(tmp_path / name, segment(MESH, 2))


@pytest.mark.parametrize("name", ["a.annot", "a.label.gii"])
def test_vertices_of_faces_in_no_region_have_no_label(tmp_path, name):
    vertices = np.concatenate([MESH.vertices, [[2, 2, 2]]])
    write_mesh(tmp_path / name, (vertices, MESH.faces), np.where(LABELS < 9, -1, LABELS))
    found = read_labels(tmp_path / name, 9)
    assert found[8] == -1
    assert set(found[:8].tolist()) <= {-1, 9, 12, 15}
    assert found[:8].max() >= 0
    with pytest.warns(UserWarning, match=r"has [78] of 12 regions: the others have no vertex"):
        write_mesh(tmp_path / name, MESH, np.arange(12))


def test_regions_have_colors_of_their_own(tmp_path):
    labels = np.arange(600) % 300
    write_labels(tmp_path / "a.annot", labels)
    rows, table, names = freesurfer.read_annot(tmp_path / "a.annot")
    assert np.array_equal(rows, labels + 1)
    assert len(np.unique(table[:, -1])) == len(names) == 301
    palette = table[1:11, :3]
    nearest = np.abs(table[11:, None, :3] - palette).max(axis=2).min(axis=1)
    assert nearest.max() < 16  # similar to the colors of the palette


def test_annotations_of_others_are_read(tmp_path):
    table = np.array([[25, 5, 25, 0], [20, 30, 40, 0], [20, 30, 41, 0]])
    rows, path = np.array([2, 0, 1, -1]), tmp_path / "lh.aparc.annot"
    freesurfer.write_annot(path, rows, table, ["unknown", "a", "b"], fill_ctab=True)
    assert read_labels(path).tolist() == [1, -1, 0, -1]
    data = path.read_bytes()
    begin = 4 + 8 * 4
    parts = [data[:begin], struct.pack(">ii", 1, 3), struct.pack(">i", 1) + b"\0"]  # version 1
    for name, color in (("unknown", table[0]), ("a", table[1]), ("b", table[2])):
        parts += [struct.pack(">i", len(name)), name.encode(), struct.pack(">4i", *color)]
    path.write_bytes(b"".join(parts))
    assert read_labels(path).tolist() == [1, -1, 0, -1]


@pytest.mark.parametrize(("name", "change", "message"), [
    ("a.gii", lambda data: data[:-9], "the XML is truncated or damaged: "),
    ("a.gii", lambda data: data.replace(b"GIFTI", b"NIFTI"), "of the type GIFTI, got"),
    ("a.gii", lambda data: data.replace(b"POINTSET", b"SHAPE"),
     "the GIFTI file has no surface"),
    ("a.gii", lambda data: data.replace(b'Dim0="8"', b'Dim0="9"'),
     "an array declares 108 bytes, but its data has 96"),
    ("a.gii", lambda data: data.replace(b'Dim0="8"', b'Dim0="7"'),
     "an array declares 84 bytes, but its data has more"),
    ("a.gii", lambda data: data.replace(b'Dim0="8"', b'Dim0="99999999"'),
     "1199999988 bytes, too many for the file size"),
    ("a.gii", lambda data: data.replace(b'Dim1="3"', b'Dim1="1"'),
     "an array declares 32 bytes, but its data has more"),
    ("a.gii", lambda data: data.replace(b"FLOAT32", b"COMPLEX"), "got 'NIFTI_TYPE_COMPLEX'"),
    ("a.gii", lambda data: data.replace(b"GZipBase64", b"ExternalFile"),
     "save all arrays in one file"),
    ("a.gii", lambda data: data.replace(b"<Data>", b"<Data>AAAA"),
     "the GIFTI file is damaged: Error"),
    ("a.gii", lambda data: data.replace(b'"8"', b'"24"').replace(b'Dim1="3"', b'Dim1="1"', 1),
     "must have 3 numbers"),
    ("a.label.gii", lambda data: data, "the GIFTI file has no labels of vertices"),
    ("a.label", lambda _: b"2\n1 0 0 0 0", "expected the number of listed vertices, 1, before"),
    ("a.label", lambda _: b"1\n1 0 0 0 0", "pass the number of vertices as n_faces"),
    ("9.label", lambda _: b"1\n9 0 0 0 0", "listed vertices[0] must be 0 to 8, got 9"),
])  # fmt: skip
def test_what_is_wrong_with_a_gifti_file_is_said(tmp_path, name, change, message):
    path = tmp_path / name
    path.write_bytes(change(surface_bytes()))
    with pytest.raises(MeshError) as caught:
        read_labels(path, 9 if name[0] == "9" else None) if "label" in name else read_mesh(path)
    assert message in str(caught.value)


def test_entities_are_not_expanded_without_limit(refuse):
    declared = b'<!ENTITY a0 "aaaaaaaaaa">' + b"".join(
        b'<!ENTITY a%d "%s">' % (n + 1, b"&a%d;" % n * 10) for n in range(9)
    )
    text = b"<!DOCTYPE GIFTI [" + declared + b"]><GIFTI><MetaData>&a9;</MetaData></GIFTI>"
    refuse("a.gii", b'<?xml version="1.0"?>' + text, "must not define entities")


@pytest.mark.parametrize(("change", "message"), [
    (lambda data: b"\xff\xff\xfd" + data[3:], "the magic number is missing"),
    (lambda data: b"# text\n" + data, "not a FreeSurfer surface of triangles"),
    (lambda data: data[:30], "it may be truncated or damaged"),
    (lambda data: data[: 3 + 16 + 8 + 96 + 100], "it may be truncated or damaged"),
    (lambda data: data.replace(struct.pack(">i", 8), b"\xff" * 4, 1),
     "it may be truncated or damaged"),
])  # fmt: skip
def test_what_is_wrong_with_a_surface_is_said(refuse, freesurfer_file, change, message):
    refuse("lh.pial", change(freesurfer_file), message)


@pytest.mark.parametrize(("change", "message"), [
    (lambda data: data[:20], "it may be truncated or damaged"),
    (lambda data: data[: 4 + 48], "it may be truncated or damaged"),
    (lambda data: data[:-8], "it may be truncated or damaged"),
    (lambda data: data.replace(b"\x00\x0csuper", b"\x7f\x0csuper"),
     "it may be truncated or damaged"),
    (lambda data: data[: 4 + 48 + 28] + bytes(4), "has no color table"),
])  # fmt: skip
def test_what_is_wrong_with_an_annotation_is_said(tmp_path, change, message):
    path = tmp_path / "lh.a.annot"
    write_labels(path, [0, 1, 2, 2, 1, 0])
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(MeshError, match=message):
        read_labels(path)


def test_randomly_damaged_files_are_read_or_refused(tmp_path, freesurfer_file):
    source, n_read = random.Random(5), 0
    for name in ("a.annot", "a.label.gii"):
        write_labels(tmp_path / name, [0, 1, -1, 2])
    files = [(read_mesh, "lh.white", freesurfer_file)]
    files += [(read_mesh, "a.gii", surface_bytes(encoding=one)) for one in ("ASCII", "B64GZ")]
    files += [
        (read, name, (tmp_path / name).read_bytes())
        for name in ("a.annot", "a.label.gii") for read in (read_labels, label_names)
    ]  # fmt: skip
    for read, name, data in files:
        for _ in range(200):
            n_read += damage.check(read, tmp_path / name, damage.damaged(data, source))
    assert 100 < n_read < 1200


def test_an_annotation_takes_memory_by_its_size_and_not_by_its_header(tmp_path):
    def integers(*numbers):
        return struct.pack(f">{len(numbers)}i", *numbers)

    head = integers(2, 0, 0, 1, 0, 1, -2, 2**31 - 1, 2) + b"c\0" + integers(1, 0, 2) + b"a\0"
    (tmp_path / "a.annot").write_bytes(head + integers(10, 20, 30, 0))
    tracemalloc.start()
    assert read_labels(tmp_path / "a.annot").tolist() == [-1, -1]
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()


def test_a_gifti_array_is_not_decompressed_beyond_its_declared_size(tmp_path):
    path = tmp_path / "a.label.gii"
    write_labels(path, np.zeros(10_000_000, int))
    path.write_bytes(path.read_bytes().replace(b'Dim0="10000000"', b'Dim0="9"'))
    tracemalloc.start()
    with pytest.raises(MeshError, match="an array declares 36 bytes, but its data has more"):
        read_labels(path)
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()


def test_the_anatomical_structure_is_kept(tmp_path):
    pair = b"<MD><Name>AnatomicalStructurePrimary</Name><Value>CortexLeft</Value></MD>"
    path = tmp_path / "lh.surf.gii"
    path.write_bytes(
        surface_bytes().replace(b"<MetaData />", b"<MetaData>" + pair + b"</MetaData>", 1)
    )
    attributes = read_attributes(path)
    write_mesh(tmp_path / "lh.ply", MESH, attributes=attributes)
    for given in (attributes, read_attributes(tmp_path / "lh.ply")):
        write_mesh(tmp_path / "lh.label.gii", MESH, LABELS, attributes=given)
        meta = nibabel.load(tmp_path / "lh.label.gii").meta
        assert dict(meta) == {"AnatomicalStructurePrimary": "CortexLeft"}
