"""Point clouds in files: reading, writing, and errors."""

import datetime
import io
import pickle
import re
import struct
import sys
import uuid
import warnings
from dataclasses import replace

import numpy as np
import pytest

from superfacets import (
    MeshAttributes,
    MeshError,
    MissingExtraError,
    PointCloud,
    read_attributes,
    read_cloud,
    read_mesh,
    sample_mesh,
    write_mesh,
)
from superfacets.kit import Input
from superfacets.mesh.convert import as_cells, as_mesh
from superfacets.tools.cell_file import CellFile
from superfacets_formats.las import read_las
from superfacets_formats.las_frame import LasDimension, LasFrame

POINTS = np.array([[0, 0, 0], [1.5, 0, 0], [1, 1, 0.25], [0, 1, -3]])
COLORS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [51, 51, 51]], np.uint8)
NORMALS = [[0, 0, 1.0]] * 4
LABELS = [0, 1, 1, 0]
GEO_KEYS = struct.pack("<16H", 1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, 32632, 3076, 0, 1, 9001)
"""GeoTIFF keys of UTM zone 32N, in meters."""


def las_cloud(data):
    return read_las(Input(data, ".las"))


@pytest.fixture
def cloud():
    return PointCloud(POINTS, NORMALS, COLORS)


def test_text_has_a_line_of_names(cloud, tmp_path):
    attributes = MeshAttributes(vertex={"intensity": np.array([1, 2, 3, 4], np.uint16)})
    write_mesh(tmp_path / "cloud.csv", cloud, LABELS, attributes=attributes)
    lines = (tmp_path / "cloud.csv").read_text().splitlines()
    assert lines[0] == "x,y,z,label,intensity,nx,ny,nz,red,green,blue"
    assert lines[2] == "1.5,0,0,1,2,0,0,1,0,255,0"


def test_text_of_several_kinds(tmp_path):
    path = tmp_path / "cloud.xyz"
    for text, expected in (
        ("0 0 0\n1 2 3\n", "PointCloud(2 points)"),
        ("# made by hand\n0,0,0,255,0,7\n1,2,3,0,1,2\n", "PointCloud(2 points, colors)"),
        ("0;0;0;0;0;1\n1;2;3;1;0;0\n\n", "PointCloud(2 points, colors)"),
        ("0 0 0 0.6 0.8 0\n1 2 3 0 0 1\n", "PointCloud(2 points, normals)"),
        ("0 0 0 0.5 7 9\n1 2 3 0 0 1\n", "PointCloud(2 points)"),
        ("//X Y Z R G B\n0 0 0 1 2 3\n1 1 1 4 5 6\n", "PointCloud(2 points, colors)"),
        ('"x","y","z","nx","ny","nz"\n0,0,0,2,0,0\n1,1,1,0,2,0\n', "PointCloud(2 points, normals)"),
        ("z y x\n3 2 1\n0 0 0\n", "PointCloud(2 points)"),
    ):
        path.write_text(text)
        assert repr(read_cloud(path)) == expected, text
    assert read_cloud(path).points.tolist() == [[1, 2, 3], [0, 0, 0]]


def test_npy(tmp_path):
    path = tmp_path / "cloud.npy"
    np.save(path, POINTS.astype(np.float32))
    assert np.array_equal(read_cloud(path).points, POINTS)
    np.save(path, np.asfortranarray(np.hstack([POINTS, COLORS])))
    again = read_cloud(path)
    assert np.array_equal(again.points, POINTS)
    assert np.array_equal(again.colors, PointCloud(POINTS, colors=COLORS).colors)


def test_colors_of_las_may_have_8_bits(tmp_path):
    laspy = pytest.importorskip("laspy")
    las = las_points(laspy, 2, "1.2")
    las.red, las.green, las.blue = COLORS.T
    las.write(tmp_path / "old.las")
    assert read_cloud(tmp_path / "old.las").colors[0].tolist() == [1.0, 0.0, 0.0]


def test_the_vertices_of_a_mesh_are_a_cloud_too(tmp_path):
    mesh = sample_mesh(5000)
    write_mesh(tmp_path / "mesh.ply", mesh)
    assert read_cloud(tmp_path / "mesh.ply").n_points == mesh.n_vertices
    assert as_cells(tmp_path / "mesh.ply").n_faces == mesh.n_faces


@pytest.mark.parametrize(("name", "content", "message"), [
    ("a.xyz", b"\n", "the file has no points"),
    ("a.xyz", b"x y z\n", "the file has no points"),
    ("a.xyz", b"1 2\n3 4\n", "expected 3 or more numbers per point, got 2"),
    ("a.xyz", b"1 2 3\n4 5 6 7\n", "line 2: expected 3 numbers as in the previous lines, got 4"),
    ("a.xyz", b"x y z w\n4 5 6\n", "has 4 column names, but the next has 3 numbers"),
    ("a.xyz", b"x\ry\rs\n4 5 6\n", "line must name columns x, y and z, or be numbers, got x, y, s"),
    ("a.xyz", b"p q s\n4 5 6\n", "line must name columns x, y and z, or be numbers, got p, q, s"),
    ("a.xyz", b"1 2 3\n4 five 6\n", "line 2: expected a number"),
    ("a.csv", b"1,2,3\n4,nan,6\n", r"a.csv: points\[1\] must be finite, got \[4.0, nan, 6.0\]"),
    ("a.npy", b"no array", "header of the .npy file cannot be read"),
    ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
     "the PLY element vertex has no property y"),
    ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "the PLY file has no element vertex"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError, match=message):
        read_cloud(path)


@pytest.fixture
def laspy():
    return pytest.importorskip("laspy")


def las_of(laspy, point_format, n_points=50):
    """Return a LAS file with random numbers in all fields and in extra dimensions."""
    rng = np.random.default_rng(point_format)
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = [0.01, 0.1, 1e-3], [5.0, -7.0, 1e6]
    las = laspy.LasData(header)
    las.x, las.y, las.z = rng.random((3, n_points)) * 100 + [[0], [0], [1e6]]
    las.add_extra_dim(laspy.ExtraBytesParams(name="two words", type="i2"))
    las.add_extra_dim(laspy.ExtraBytesParams(name="list", type="3u2"))
    las.add_extra_dim(laspy.ExtraBytesParams(name="long", type="u8"))
    scale, offset = np.array([0.5]), np.array([3.0])
    scaled = laspy.ExtraBytesParams(name="scaled", type="i4", scales=scale, offsets=offset)
    las.add_extra_dim(scaled)
    for dimension in las.point_format.dimensions:
        if dimension.name not in ("X", "Y", "Z"):
            n_bits = min(dimension.num_bits or 8, 6)
            shape = (n_points, 3) if dimension.name == "list" else n_points
            las[dimension.name] = rng.integers(0, 1 << n_bits, shape)
    return las


def las_points(laspy, point_format=6, version="1.4"):
    """Return a LAS file with the points of this module."""
    las = laspy.LasData(laspy.LasHeader(point_format=point_format, version=version))
    las.x, las.y, las.z = POINTS.T
    return las


def begin_of(content):
    """Return the offset of the points."""
    return int.from_bytes(content[96:100], "little")


def content_of(las, compressed):
    stream = io.BytesIO()
    las.write(stream, do_compress=compressed)
    return bytearray(stream.getvalue())


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("point_format", range(11))
def test_las_holds_what_laspy_reads(laspy, point_format, compressed):
    las = las_of(laspy, point_format)
    cloud, attributes = las_cloud(bytes(content_of(las, compressed)))
    columns = attributes.vertex
    assert attributes.header.point_format == point_format
    assert attributes.left_out == (("wave packets",) if point_format in (4, 5, 9, 10) else ())
    assert np.array_equal(cloud.points, np.transpose([las.x, las.y, las.z]))
    waves = ("wavepacket", "return_point_wave", "x_t", "y_t", "z_t", "X", "Y", "Z")
    names = [name for name in las.point_format.dimension_names if not name.startswith(waves)]
    assert list(columns) == names
    for name in names:
        assert np.array_equal(columns[name], las[name]), name


def test_chunks_of_any_size_are_read(laspy):
    lazrs = pytest.importorskip("lazrs")
    las = las_of(laspy, 6)
    whole = bytes(content_of(las, True))
    size = las.point_format.size
    records = np.frombuffer(bytes(content_of(las, False))[-50 * size :], np.uint8)
    vlr = lazrs.LazVlr.new_for_compression(6, las.point_format.num_extra_bytes, True)
    head = whole[: begin_of(whole)].replace(las_description(whole), bytes(vlr.record_data()))
    stream = io.BytesIO(head)
    stream.seek(0, 2)
    compressor = lazrs.LasZipCompressor(stream, vlr)
    for part in np.split(records, [20 * size]):
        compressor.compress_many(part)
        compressor.finish_current_chunk()
    compressor.done()
    cloud, _ = las_cloud(stream.getvalue())
    assert np.array_equal(cloud.points[:, 0], las.x)


def las_description(content):
    at = content.index(b"laszip encoded") - 2
    return bytes(content[at + 54 : at + 54 + int.from_bytes(content[at + 20 : at + 22], "little")])


def test_a_table_of_chunks_at_the_end_is_found(laspy):
    content = content_of(las_of(laspy, 3), True)
    begin = begin_of(content)
    moved = content[:begin] + b"\xff" * 8 + content[begin + 8 :] + content[begin : begin + 8]
    expected, _ = las_cloud(bytes(content))
    assert np.array_equal(las_cloud(bytes(moved))[0].points, expected.points)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("point_format", [3, 6])
def test_a_cut_file_is_refused_wherever_it_is_cut(laspy, point_format, compressed):
    content = bytes(content_of(las_of(laspy, point_format), compressed))
    begin, sizes = begin_of(content), range(0, len(content), 7)
    if compressed:
        table = int.from_bytes(content[begin : begin + 8], "little")
        sizes = [begin // 2, *np.linspace(begin, table + 7, 4).astype(int)]
    for size in sizes:
        with pytest.raises(MeshError):
            las_cloud(content[:size])


def changed(content, place, number, size=4):
    content[place : place + size] = number.to_bytes(size, "little")
    return bytes(content)


@pytest.mark.parametrize(("place", "number", "size", "message"), [
    (0, 0, 4, "the header is missing or truncated"), (100, 9, 4, "overlaps the points"),
    (104, 99, 1, "expected point format 0 to 10, got 35"),
    (104, 128 + 63, 1, "expected point format 0 to 10, got 63"),
    (105, 20, 2, "points of format 6 need 30 or more bytes, got 20"),
    (105, 42, 2, "the extra dimensions of a point do not fit in 42 bytes"),
    (247, 0, 8, "the file has no points"),
    (247, 10**8, 8, "100000000 points of 50 bytes, but the file has only 2500 bytes of points"),
    (375 + 54 + 2, 99, 1, "has the unknown type 99"),
])  # fmt: skip
def test_a_header_of_las_that_is_wrong_is_named(laspy, place, number, size, message):
    content = content_of(las_of(laspy, 6), False)
    with pytest.raises(MeshError, match=message):
        las_cloud(changed(content, place, number, size))


@pytest.mark.parametrize(("place", "number", "message"), [
    (
        "points",
        10**8,
        "the header declares 100000000 points of 50 bytes, more than 1000 times the"
        r" size of the file, \d+ bytes",
    ),
    ("points", 51, "does not match the 51 points|truncated or damaged: LazrsError|crashed"),
    ("format", 128 + 7, "the extra dimensions of a point do not fit in 50 bytes"),
    ("compressor", 1, r"LASzip \d\.\d compressed .* without chunks, .*: decompress the file"),
    ("item", 77, "truncated or damaged: LazrsError|does not match their format"),
    ("chunk size", 0, "the chunk table does not match the 50 points"),
    ("place of the table", 2**31, "truncated or damaged: LazrsError|crashed"),
    ("chunks", 2**32 - 1, "truncated or damaged: LazrsError|crashed|too much memory"),
    ("chunks", 0, "the chunk table does not match the 50 points"),
    ("layer", 2**32 - 1, "truncated or damaged: LazrsError|crashed|too much memory"),
])  # fmt: skip
def test_numbers_of_laz_are_compared_with_the_file(laspy, place, number, message):
    content = content_of(las_of(laspy, 6), True)
    begin = begin_of(content)
    described = content.index(las_description(content))
    places = {
        "points": 247, "format": 104, "compressor": described, "item": described + 34,
        "chunk size": described + 12, "place of the table": begin,
        "chunks": int.from_bytes(content[begin : begin + 8], "little") + 4,
        "layer": begin + 8 + 50 + 4,
    }  # fmt: skip
    size = 1 if place == "format" else 2 if place in ("compressor", "item") else 4
    with pytest.raises(MeshError, match=message):
        las_cloud(changed(content, places[place], number, size))


def test_names_that_are_no_words_are_left_out(laspy):
    content = content_of(las_of(laspy, 6), False)
    content[content.index(b"scaled")] = 7
    _, found = las_cloud(bytes(content))
    assert "long" in found.vertex
    assert "scaled" not in found.vertex
    assert found.left_out == ("point property \x07caled, whose name is repeated or not one line",)


def test_dimensions_with_a_taken_name_or_without_a_description_are_left_out(laspy):
    las = las_of(laspy, 6)
    content = content_of(las, False)
    at = content.index(b"scaled")
    content[at : at + 9] = b"intensity"
    _, found = las_cloud(bytes(content))
    assert np.array_equal(found.vertex["intensity"], las.intensity)
    assert found.left_out == ("extra dimension 'intensity'",)
    _, found = las_cloud(bytes(content.replace(b"LASF_Spec", b"LASF_None")))
    assert found.left_out == ("20 bytes per point, which have no names", "record 4 of 'LASF_None'")


def test_extra_dimensions_go_back_into_las_as_they_are(laspy, tmp_path):
    las = las_points(laspy)
    scale, offset = np.array([0.01]), np.array([-1.0])
    for name, kind, more in [
        ("Pulse width", "u2", {"description": "width in ns", "scales": scale, "offsets": offset}),
        ("normal", "3f4", {"description": "of the surface"}), ("id", "u8", {}),
        ("pair", "2i4", {"scales": np.array([0.5, 2.0]), "offsets": np.array([1.0, -1.0])}),
        ("long", "i8", {}), ("label", "u1", {"description": "of another program"}),
    ]:  # fmt: skip
        las.add_extra_dim(laspy.ExtraBytesParams(name=name, type=kind, **more))
    las["Pulse width"] = np.arange(4) * 0.01 - 1
    las["normal"] = np.arange(12).reshape(4, 3) + [0, 0.5, np.nan]
    las["id"] = np.arange(4, dtype=np.uint64) + np.uint64(2**63)
    las["pair"] = np.arange(8).reshape(4, 2)
    las["long"] = np.arange(4) - 2**60
    las.write(tmp_path / "in.laz")
    cloud, attributes = read_cloud(tmp_path / "in.laz"), read_attributes(tmp_path / "in.laz")
    assert attributes.left_out == ()
    assert attributes.vertex["normal"].shape == (4, 3)
    assert attributes.vertex["pair"][3].tolist() == [6.0, 7.0]
    attributes = pickle.loads(pickle.dumps(attributes))
    with pytest.warns(UserWarning, match="in .laz, new values replace vertex property label"):
        write_mesh(tmp_path / "out.laz", cloud, LABELS, attributes=attributes)
    made = laspy.read(tmp_path / "out.laz")
    given = [*las.point_format.extra_dimensions][:-1]
    *kept, label = made.point_format.extra_dimensions
    assert kept == given
    assert [some.description for some in kept] == [some.description for some in given]
    assert (label.name, label.dtype, label.description) == ("label", np.int32, "")
    assert made["label"].tolist() == LABELS
    for dimension in given:
        stored, expected = (some.points.array[dimension.name] for some in (made, las))
        assert stored.tobytes() == expected.tobytes()


@pytest.mark.parametrize(("values", "kind"), [
    (np.array([102, 200, 9, 0]) * 0.01 - 1, "u2"), ([0.025, 1, 0, 0], "f8"),
    ([[0.02, 1]] * 4, "2f8"),
])  # fmt: skip
def test_changed_values_keep_the_type_only_if_they_fit(laspy, tmp_path, values, kind):
    dimension = LasDimension("a b", "<u2", 1, "", (0.01,), (-1.0,))
    frame = LasFrame(4, 6, (0.01,) * 3, (0.0,) * 3, extra=(dimension,))
    attributes = MeshAttributes(vertex={"a b": values}, header=frame)
    write_mesh(tmp_path / "a.las", PointCloud(POINTS), attributes=attributes)
    made = laspy.read(tmp_path / "a.las")
    (found,) = made.point_format.extra_dimensions
    assert (found.name, found.dtype) == ("a b", np.dtype(kind))
    assert np.array_equal(made[found.name], values)


def test_more_than_three_numbers_per_point_do_not_fit_into_las(laspy, tmp_path):
    given = {"wide": np.ones((4, 5)), "one": np.ones((4, 1)), "\u00f6" * 20: np.ones(4)}
    with pytest.warns(UserWarning, match=r"\.las does not store: .*property wide.* as \u00f6{15}$"):
        write_mesh(tmp_path / "a.las", PointCloud(POINTS), attributes=MeshAttributes(vertex=given))
    names = laspy.read(tmp_path / "a.las").point_format.extra_dimension_names
    assert [*names] == ["one", "\u00f6" * 15]


@pytest.mark.parametrize("n_bytes", [40, 70_000])
@pytest.mark.parametrize("ending", [".las", ".laz"])
def test_a_reference_system_after_the_points_goes_back_into_las(laspy, tmp_path, ending, n_bytes):
    las = las_points(laspy, 8)
    las.header.global_encoding.wkt = True
    content = b"PROJCS[]".ljust(n_bytes - 1) + b"\0"
    records = [("someone else", 2112, b"?"), ("LASF_Projection", 2112, content)]
    las.evlrs = laspy.vlrs.vlrlist.VLRList(
        laspy.VLR(user, number, record_data=data) for user, number, data in records
    )
    path = tmp_path / f"in{ending}"
    las.write(path)
    cloud, attributes = read_cloud(path), read_attributes(path)
    assert attributes.header.reference_system == "WKT"
    write_mesh(tmp_path / f"out{ending}", cloud, LABELS, attributes=attributes)
    made = laspy.read(tmp_path / f"out{ending}")
    large, small = [*(made.evlrs or ())], made.header.vlrs.get_by_id("LASF_Projection")
    assert [len(small), len(large)] == ([0, 1] if n_bytes > 65535 else [1, 0])
    assert (small or large)[0].record_data_bytes() == content
    assert made.header.global_encoding.wkt
    data = path.read_bytes()
    for n_missing in (1, n_bytes, n_bytes + 1, n_bytes + 60):
        with pytest.raises(MeshError, match=r"extended record 1 of 2 exceeds the file"):
            las_cloud(data[:-n_missing])


@pytest.mark.parametrize(("numbers", "is_wkt", "expected"), [
    ((), True, None), ((2112,), False, "WKT"), ((34735, 34736), True, "GeoTIFF"),
    ((2112, 34735), True, "WKT"), ((2112, 34735), False, "GeoTIFF"),
])  # fmt: skip
def test_the_format_of_the_reference_system_is_known(numbers, is_wkt, expected):
    records = tuple((number, b"") for number in numbers)
    assert LasFrame(4, 6, (1.0,) * 3, (0.0,) * 3, records, is_wkt).reference_system == expected


def test_a_text_with_an_odd_name_of_a_column_is_read(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"x,y,z,\x01\n0,0,0,1\n1,0,0,2\n")
    assert read_cloud(tmp_path / "a.csv").n_points == 2


def test_what_laspy_cannot_write_is_an_error(cloud, tmp_path, broken):
    pytest.importorskip("laspy")
    broken("laspy.LasData.write", ValueError("no room"))
    with pytest.raises(MeshError, match=r"cannot be written as \.las: ValueError: no room"):
        write_mesh(tmp_path / "a.las", cloud)


def test_without_lazrs_the_extra_is_named(laspy, monkeypatch):
    content = bytes(content_of(las_of(laspy, 0), True))
    monkeypatch.setitem(sys.modules, "lazrs", None)
    with pytest.raises(MissingExtraError, match=r"superfacets\[las\]"):
        las_cloud(content)


@pytest.mark.parametrize(("ending", "package"), [(".las", "laspy"), (".pcd", "pypcd4")])
def test_the_package_of_a_format_is_named(cloud, tmp_path, monkeypatch, ending, package):
    pytest.importorskip(package)
    write_mesh(tmp_path / f"a{ending}", cloud)
    monkeypatch.setattr(
        "superfacets.files.formats.find_spec", lambda name: None if name == package else name
    )
    with pytest.raises(MissingExtraError, match=rf"superfacets\[{ending[1:]}\]"):
        read_cloud(tmp_path / f"a{ending}")
    monkeypatch.setitem(sys.modules, "laspy", None)
    with pytest.raises(MissingExtraError, match=r"superfacets\[las\]"):
        write_mesh(tmp_path / "b.las", cloud)


def test_clouds_are_no_meshes(cloud, tmp_path):
    write_mesh(tmp_path / "a.ply", cloud)
    with pytest.raises(MeshError, match="use read_cloud"):
        read_mesh(tmp_path / "a.ply")
    with pytest.raises(MeshError, match="expected a surface mesh, got a PointCloud, which has no"):
        as_mesh(cloud)


def test_records_of_extra_dimensions_are_joined_in_their_order(laspy):
    las = las_points(laspy, 0, "1.2")
    for name, kind in (("first", "u2"), ("second", "f4")):
        las.add_extra_dim(laspy.ExtraBytesParams(name=name, type=kind))
    las.first, las.second = [1, 2, 3, 4], [0.5, 1.5, 2.5, 3.5]
    content = content_of(las, compressed=False)
    begin = begin_of(content)
    head, both = content[:227], content[227 + 54 : 227 + 54 + 384]
    record = struct.pack("<2x16sHH32x", b"LASF_Spec", 4, 192)
    records = record + both[:192] + record + both[192:]
    head[96:104] = struct.pack("<II", 227 + len(records), 2)
    _, attributes = las_cloud(bytes(head + records + content[begin:]))
    assert attributes.vertex["first"].tolist() == [1, 2, 3, 4]
    assert attributes.vertex["second"].tolist() == [0.5, 1.5, 2.5, 3.5]
    assert attributes.left_out == ()


@pytest.mark.parametrize(("name", "values", "kept"), [
    ("intensity", [0.25, 0.5, 1, 0], False), ("intensity", [65535.0, 2, 1, 0], True),
    ("intensity", [70000, 2, 1, 0], False), ("scan_angle", [-15.0, 2, 1, 0], False),
    ("scan_angle", [-2500, 2, 1, 0], True), ("classification", [2.0, 6, 255, 0], True),
    ("return_number", [16, 1, 1, 1], False), ("user_data", [np.nan, 1, 1, 1], False),
    ("gps_time", [0.5, 1, 2, 3], True),
])  # fmt: skip
def test_values_that_las_would_round_get_a_dimension(laspy, cloud, tmp_path, name, values, kept):
    attributes, path = MeshAttributes(vertex={name: np.array(values)}), tmp_path / "a.las"
    if kept:
        write_mesh(path, cloud, attributes=attributes)
    else:
        with pytest.warns(UserWarning, match=f"property {name} by this name, but as {name}_value"):
            write_mesh(path, cloud, attributes=attributes)
    stored = laspy.read(path)[name if kept else f"{name}_value"]
    assert np.array_equal(np.asarray(stored), values, equal_nan=True)


def test_colors_that_are_fractions_are_scaled_for_las(laspy, cloud, tmp_path):
    stored = dict(zip(("red", "green", "blue"), cloud.colors.T, strict=True))
    write_mesh(tmp_path / "a.las", cloud, attributes=MeshAttributes(vertex=stored))
    assert read_cloud(tmp_path / "a.las").colors == pytest.approx(cloud.colors, abs=1e-4)


KEYS = struct.pack("<12H", 1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 4326)


@pytest.mark.parametrize(("records", "is_wkt", "name", "is_geographic"), [
    ({2112: b'PROJCS["UTM 32",GEOGCS["WGS 84"],ID["EPSG",4326]]'}, True, "UTM 32", False),
    ({2112: b'GEOGCS["WGS 84",DATUM["x"],AUTHORITY["EPSG","4326"]]\0'}, True, "WGS 84", True),
    ({2112: b'COMPD_CS["a + b",GEOGCS["a"],VERT_CS["b"]]'}, True, "a + b", True),
    ({2112: b'COMPD_CS["a + b",PROJCS["a",GEOGCS["c"]],VERT_CS["b"]]'}, True, "a + b", False),
    ({2112: b'GEOGCRS["ETRS89"]'}, True, "ETRS89", True),
    ({34735: GEO_KEYS}, False, "EPSG:32632", False), ({34735: KEYS}, False, "EPSG:4326", True),
    ({34735: KEYS + struct.pack("<4H", 1026, 34737, 4, 1), 34737: b"xUTM|"}, False, "UTM", True),
    ({34735: b"", 34737: b""}, False, "GeoTIFF", False), ({}, False, None, False),
])  # fmt: skip
def test_the_reference_system_is_named_and_degrees_are_found(
    laspy, tmp_path, records, is_wkt, name, is_geographic
):
    frame = LasFrame(4, 6, (1e-7,) * 3, (0.0,) * 3, tuple(records.items()), is_wkt)
    assert frame.facts["reference_system"] == (name or "none")
    keys = records.get(34735)
    is_4326 = keys or b"4326" in records.get(2112, b"")
    code = 32632 if keys == GEO_KEYS else 4326 if is_4326 else None
    assert frame.facts.get("EPSG") == code
    write_mesh(tmp_path / "a.las", PointCloud(POINTS), attributes=MeshAttributes(header=frame))
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        read_cloud(tmp_path / "a.las")
    assert [str(each.message).partition(",")[0] for each in noted] == (
        [f"x and y are degrees of {name}"] * is_geographic
    )


def test_a_record_that_is_not_kept_is_named(laspy):
    las = las_points(laspy)
    las.header.vlrs.append(laspy.VLR("someone else", 5, record_data=b"?"))
    _, attributes = las_cloud(bytes(content_of(las, compressed=True)))
    assert attributes.left_out == ("record 5 of 'someone else'",)


def test_quoted_names_of_columns_may_have_spaces(tmp_path):
    for text in (
        '"X","Y","Z","M3C2 distance"\n1,2,3,0.5\n', "x;y;z;M3C2 distance\n1;2;3;.5\n",
        '//X Y Z "M3C2 distance"\n1 2 3 0.5\n', "x\ty\tz\tM3C2 distance\n1\t2\t3\t.5",
    ):  # fmt: skip
        (path := tmp_path / "a.csv").write_text(text)
        assert read_cloud(path).points.tolist() == [[1, 2, 3]]
        assert read_attributes(path).vertex["m3c2 distance"].tolist() == [0.5]


PACKED_SPLATS = (
    "ply\nformat binary_little_endian 1.0\nelement chunk 1\n"
    + "".join(f"property float {end}_{axis}\n" for axis in
              ("x", "y", "z", "scale_x", "scale_y", "scale_z") for end in ("min", "max"))
    + "element vertex 2\n"
    + "".join(f"property uint packed_{name}\n" for name in
              ("position", "rotation", "scale", "color"))
    + "end_header\n"
).encode()  # fmt: skip


def test_compressed_splats_are_unpacked(tmp_path):
    limits = struct.pack("<12f", 0, 2, -1, 1, 5, 6, -8, 0, -4, 0, -2, 0)
    low = struct.pack("<4I", 0, 512 << 20 | 512 << 10 | 512, 0, 0x00FF0000)
    high = struct.pack(
        "<4I", 2**32 - 1, 3 << 30 | 512 << 20 | 512 << 10 | 512, 2**32 - 1, 2**32 - 1
    )
    path = tmp_path / "a.ply"
    path.write_bytes(PACKED_SPLATS + limits + low + high)
    cloud, attributes = CellFile.read(path).cells_and_attributes()
    found = {name: values.tolist() for name, values in attributes.vertex.items()}
    assert cloud.points.tolist() == [[0, -1, 5], [2, 1, 6]]
    assert cloud.colors == pytest.approx(np.array([[0, 1, 0], [1, 1, 1]]), abs=1e-6)
    assert [found[f"scale_{axis}"] for axis in range(3)] == [[-8, 0], [-4, 0], [-2, 0]]
    assert np.transpose([found[f"rot_{i}"] for i in range(4)]) == pytest.approx(
        np.array([[1, 0, 0, 0], [0, 0, 0, 1]]), abs=1e-3
    )
    assert found["opacity"] == [-40, 40]
    assert attributes.left_out == ()
    path.write_bytes(PACKED_SPLATS.replace(b"packed_scale", b"packed_scala") + limits + low + high)
    with pytest.raises(MeshError, match="compressed splats need packed_position, packed_rotation"):
        read_cloud(path)


@pytest.mark.parametrize("point_format", [0, 1, 3, 6, 7, 8])
def test_labels_go_back_into_las_as_it_is(laspy, tmp_path, point_format):
    """Version, point format, scales, offsets and 8-bit colors are unchanged."""
    version = "1.4" if point_format > 5 else "1.2"
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales, header.offsets = [0.01, 0.02, 0.05], [100.0, 0.0, -5.0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = np.random.default_rng(0).random((3, 60)) * 90
    las.intensity = np.arange(60)
    has_color = "red" in set(las.point_format.dimension_names)
    if has_color:
        las.red = las.green = las.blue = np.arange(60)
    path, out = tmp_path / "in.las", tmp_path / "out.las"
    las.write(path)
    cloud, attributes = read_cloud(path), read_attributes(path)
    write_mesh(out, cloud, np.arange(60) // 20, attributes=attributes)
    made = laspy.read(out)
    assert (made.header.point_format.id, str(made.header.version)) == (point_format, version)
    assert made.header.scales.tolist() == [0.01, 0.02, 0.05]
    assert made.header.offsets.tolist() == [100.0, 0.0, -5.0]
    assert all(np.array_equal(made[axis], las[axis]) for axis in "XYZ")
    assert np.array_equal(made.intensity, np.arange(60))
    assert np.array_equal(made["label"], np.arange(60) // 20)
    if has_color:
        assert np.array_equal(made.red, np.arange(60))


@pytest.mark.parametrize(("point_format", "ending", "records"), [
    (7, ".laz", {2112: b'PROJCS["WGS 84 / UTM zone 32N"]\0'}),
    (1, ".las", {34735: GEO_KEYS, 34736: b"\0" * 16, 34737: b"UTM 32N|\0"}),
])  # fmt: skip
@pytest.mark.parametrize("scale", [0.01, 1e-9])  # 1e-9 is too small to write the points
def test_the_coordinate_reference_system_goes_back_into_las(
    laspy, tmp_path, point_format, ending, records, scale
):
    las = las_points(laspy, point_format)
    if point_format == 7:  # laspy 2.5 also sets this flag if the assigned value is False
        las.header.global_encoding.wkt = True
    for number, content in records.items():
        las.header.vlrs.append(laspy.VLR("LASF_Projection", number, record_data=content))
    las.header.vlrs.append(laspy.VLR("someone else", 5, record_data=b"?"))
    las.write(tmp_path / "in.las")
    cloud, attributes = read_cloud(tmp_path / "in.las"), read_attributes(tmp_path / "in.las")
    frame = attributes.header._replace(scales=(scale, scale, scale))
    attributes = pickle.loads(pickle.dumps(replace(attributes, header=frame)))
    moved = PointCloud(cloud.points * 100)
    write_mesh(tmp_path / f"out{ending}", moved, LABELS, attributes=attributes)
    made = laspy.read(tmp_path / f"out{ending}").header
    found = {v.record_id: v.record_data_bytes() for v in made.vlrs.get_by_id("LASF_Projection")}
    assert found == records
    assert made.global_encoding.wkt == (point_format == 7)
    assert not made.vlrs.get_by_id("someone else")


@pytest.mark.parametrize("is_standard", [False, True])
def test_the_source_and_the_meaning_of_times_go_back_into_las(laspy, tmp_path, is_standard):
    las = las_points(laspy)
    header = las.header
    origin = {"file_source_id": 4242, "uuid": uuid.UUID(int=7), "system_identifier": "a plane"}
    origin["creation_date"] = datetime.date(2019, 5, 6)
    for name, value in origin.items():
        setattr(header, name, value)
    if is_standard:
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    las.write(tmp_path / "in.laz")
    cloud, attributes = read_cloud(tmp_path / "in.laz"), read_attributes(tmp_path / "in.laz")
    write_mesh(tmp_path / "out.laz", cloud, LABELS, attributes=attributes)
    made = laspy.read(tmp_path / "out.laz").header
    assert {name: getattr(made, name) for name in origin} == origin
    assert made.global_encoding.gps_time_type == header.global_encoding.gps_time_type


def test_a_frame_that_does_not_hold_the_points_is_replaced(laspy, tmp_path):
    frame = LasFrame(2, 4, (1e-9, 1e-9, 1e-9), (0.0, 0.0, 0.0))
    cloud = PointCloud(POINTS * 1e3)
    write_mesh(tmp_path / "a.las", cloud, LABELS, attributes=MeshAttributes(header=frame))
    made = laspy.read(tmp_path / "a.las")
    assert (made.header.point_format.id, str(made.header.version)) == (1, "1.2")
    assert np.allclose(made.xyz, POINTS * 1e3, atol=1e-6)


@pytest.mark.parametrize(("array", "message"), [
    *((np.zeros(shape), f"expected shape (N, n) with n from 3 to 12, got {shape}: if this is a"
       " height grid, convert it to a mesh first")
      for shape in [(301, 301), (40, 13), (9, 2), (4, 5, 3)]),
    (np.zeros(3, int), "an array of labels, use --barriers, or superfacets regions MESH LABELS"),
    (np.zeros((2, 3), complex), "expected an array of numbers"),
    (np.array([{}]), "expected an array of numbers"),
])  # fmt: skip
def test_arrays_that_are_no_points_are_refused(tmp_path, array, message):
    np.save(tmp_path / "a.npy", array, allow_pickle=True)
    with pytest.raises(MeshError, match=re.escape(message)):
        read_cloud(tmp_path / "a.npy")


@pytest.mark.parametrize(("name", "message"), [
    ("a.tif", "a raster file is not a mesh"), ("a.ASC", "a raster file is not a mesh"),
    ("a.gpkg", "a vector file is not a mesh"), ("a.curv", "it has values for --features"),
    ("a.las", "the file contains points, use read_cloud"), ("a.nii.gz", "a.nii.gz: voxels are not"),
    ("a.city.json", "run cjio IN export obj OUT.obj"), ("lh.curv", "give their mesh first"),
])  # fmt: skip
def test_files_that_are_no_mesh_say_what_to_do(tmp_path, name, message):
    with pytest.raises(MeshError, match=message):
        read_mesh(tmp_path / name)
