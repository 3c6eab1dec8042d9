"""PCD: text, records and compressed columns; packed colors, organized clouds, damaged files."""

import random
import struct

import damage
import numpy as np
import pytest

from superfacets import MeshError, PointCloud, read_cloud, read_labels, segment, write_mesh
from superfacets.tools.cell_file import CellFile

POINTS = np.array([[0, 0, 0], [1.5, 0, 0], [1, 1, 0.25], [0, 1, -3]])
COLORS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [51, 52, 53]], np.uint8)
PACKED = COLORS.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)


def header(fields, form, n_points=4, **others):
    """Return a header; fields are (name, type and size, count)."""
    names, kinds, counts = zip(*fields, strict=True)
    words = {
        "VERSION": "0.7", "FIELDS": " ".join(names), "SIZE": " ".join(kind[1:] for kind in kinds),
        "TYPE": " ".join(kind[0] for kind in kinds), "COUNT": " ".join(map(str, counts)),
        "WIDTH": n_points, "HEIGHT": 1, "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": n_points,
    } | others  # fmt: skip
    lines = [f"{key} {value}" for key, value in words.items() if value is not None]
    return "\n".join(["# .PCD v0.7", *lines, f"DATA {form}\n"]).encode()


def text(fields, columns, **others):
    rows = zip(*(column.tolist() for column in columns), strict=True)
    body = "".join(" ".join(map(str, row)) + "\n" for row in rows)
    return header(fields, "ascii", len(columns[0]), **others) + body.encode()


XYZ = [(axis, "F4", 1) for axis in "xyz"]


@pytest.fixture
def cloud_of(tmp_path):
    def read(data):
        path = tmp_path / "cloud.pcd"
        path.write_bytes(data)
        return CellFile.read(path).cells_and_attributes()

    return read


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
def test_a_file_of_another_library_is_read(tmp_path, form):
    pypcd4 = pytest.importorskip("pypcd4")
    rng = np.random.default_rng(0)
    points = np.repeat(rng.random((50, 3)), 20, axis=0).astype(np.float32)  # can be compressed
    packed = rng.integers(0, 1 << 24, 1000, dtype=np.uint32)
    labels, times = np.arange(1000, dtype=np.uint32), np.arange(1000) + 1.7e18
    fields = ("x", "y", "z", "normal_x", "normal_y", "normal_z", "rgb", "label", "t")
    types = (*[np.float32] * 6, np.uint32 if form == "ascii" else np.float32, np.uint32, np.float64)
    columns = [*points.T, *np.eye(3, dtype=np.float32)[labels % 3].T]
    columns += [packed if form == "ascii" else packed.view(np.float32), labels, times]
    other = pypcd4.PointCloud.from_points(columns, fields, types)
    other.save(tmp_path / "other.pcd", pypcd4.Encoding(form))
    cloud, attributes = CellFile.read(tmp_path / "other.pcd").cells_and_attributes()
    assert cloud.points == pytest.approx(points, rel=1e-6)
    assert np.array_equal(cloud.normals, np.eye(3)[labels % 3])
    expected = np.stack([packed >> 16, packed >> 8 & 255, packed & 255], axis=1)
    assert np.array_equal(np.rint(cloud.colors * 255), expected)
    assert np.array_equal(read_labels(tmp_path / "other.pcd"), labels)
    assert attributes.vertex["t"] == pytest.approx(times, rel=1e-15)
    assert cloud.viewpoints is None


@pytest.mark.parametrize("ascii", [False, True])
def test_another_library_reads_what_is_written(tmp_path, ascii):
    pypcd4 = pytest.importorskip("pypcd4")
    cloud = PointCloud(POINTS, normals=np.eye(3)[[0, 1, 2, 0]], colors=COLORS)
    write_mesh(tmp_path / "cloud.pcd", cloud, [3, 0, 3, 1], ascii=ascii, colors=COLORS[::-1])
    other = pypcd4.PointCloud.from_path(tmp_path / "cloud.pcd")
    assert other.fields == (*"xyz", "normal_x", "normal_y", "normal_z", "rgb", "label")
    assert np.array_equal(other.numpy(("x", "y", "z")), POINTS)
    rgb = other.pc_data["rgb"] if ascii else other.pc_data["rgb"].view(np.uint32)
    assert np.array_equal(rgb, PACKED[::-1])
    assert other.pc_data["label"].tolist() == [3, 0, 3, 1]
    assert other.pc_data["label"].dtype == np.uint32  # as in the library's PointXYZL


@pytest.mark.parametrize("ascii", [False, True])
def test_the_viewpoint_is_written_again(tmp_path, cloud_of, ascii):
    cloud, attributes = cloud_of(text(XYZ, POINTS.T, VIEWPOINT="1 2 3 1 0 0 0"))
    write_mesh(tmp_path / "again.pcd", cloud, attributes=attributes, ascii=ascii)
    assert cloud.viewpoints.tolist() == read_cloud(tmp_path / "again.pcd").viewpoints.tolist()
    assert cloud.viewpoints.tolist() == [1, 2, 3]


def test_colors_are_packed_in_floats_or_integers(cloud_of):
    fields, packed = [*XYZ, ("rgb", "F4", 1)], PACKED | 0xFF000000
    as_bits = [*POINTS.T, PACKED.view(np.float32)]
    for data in (
        text(fields, as_bits),
        text(fields, [*POINTS.T, PACKED]),  # older versions: integers, declared as floats
        text([*XYZ, ("rgba", "U4", 1)], [*POINTS.T, packed]),
        text([*XYZ, ("rgb", "I4", 1)], [*POINTS.T, packed.view(np.int32)]),
        text([*XYZ, ("r", "U1", 1), ("g", "U1", 1), ("b", "U1", 1)], [*POINTS.T, *COLORS.T]),
    ):
        assert np.array_equal(np.rint(cloud_of(data)[0].colors * 255), COLORS)


def test_points_of_an_organized_cloud_without_a_position_are_left_out(cloud_of):
    points = np.insert(POINTS, 2, np.nan, axis=0)
    points = np.concatenate([points, [[np.inf, 0, 0]]])
    data = text([*XYZ, ("label", "I4", 1)], [*points.T, np.arange(6)], WIDTH=3, HEIGHT=2)
    cloud, attributes = cloud_of(data)
    assert np.array_equal(cloud.points, POINTS)
    assert attributes.vertex["label"].tolist() == [0, 1, 3, 4]
    assert attributes.records.tolist() == [True, True, False, True, True, False]
    assert attributes.left_out == ("2 of 6 points, which have no position",)
    assert len(segment(cloud, 2).labels) == 4


def test_padding_and_repeated_fields_are_left_out(cloud_of):
    record = struct.pack("<3fB7xHHe", 1, 2, 3, 9, 4, 5, 0)
    fields = [*XYZ, ("a", "U1", 1), ("_", "U1", 7), ("c", "U2", 1), ("c", "U2", 1), ("_", "U2", 1)]
    cloud, attributes = cloud_of(header(fields, "binary", 1) + record)
    assert cloud.points.tolist() == [[1, 2, 3]]
    assert {n: values.tolist() for n, values in attributes.vertex.items()} == {"a": [9], "c": [4]}
    assert attributes.left_out == ("another point property c, whose name is repeated",)


def test_names_in_upper_case_are_read(cloud_of):
    fields = [(name.upper(), kind, n) for name, kind, n in [*XYZ, ("intensity", "F4", 1)]]
    cloud, attributes = cloud_of(text(fields, [*POINTS.T, np.arange(4)]))
    assert np.array_equal(cloud.points, POINTS)
    assert attributes.vertex["intensity"].tolist() == [0, 1, 2, 3]


def test_normals_that_are_nan_are_estimated_with_a_note(cloud_of):
    normals = np.float32([[0, 0, 1], [np.nan] * 3, [0, 1, 0], [1, 0, 0]])
    fields = [*XYZ, *((f"normal_{axis}", "F4", 1) for axis in "xyz")]
    cloud, attributes = cloud_of(text(fields, [*POINTS.T, *normals.T]))
    assert cloud.normals.tolist() == [[0, 0, 1], [0, 0, 0], [0, 1, 0], [1, 0, 0]]
    assert attributes.left_out == ("normals of 1 point, which are not finite",)


def test_copies_that_overlap_are_unpacked(cloud_of):
    columns = np.repeat(np.float32([2, 0, 1]), 100).tobytes()  # x, y, z of 100 points
    run = b"\x03%s\xe0\xff\x03\xe0\x7a\x03"  # 4 bytes; 264 and 131 bytes from 4 before
    packed = b"".join(
        run.replace(b"%s", np.float32(value).tobytes()) + b"\x00" + np.float32(value).tobytes()[3:]
        for value in (2, 0, 1)
    )
    sizes = struct.pack("<II", len(packed), len(columns))
    cloud, _ = cloud_of(header(XYZ, "binary_compressed", 100) + sizes + packed)
    assert np.array_equal(cloud.points, np.tile([2.0, 0, 1], (100, 1)))


RECORDS = np.float32(POINTS).tobytes()
COMPRESSED = struct.pack("<II", 50, 48) + b"\x1f" + RECORDS[:32] + b"\x0f" + RECORDS[32:]


@pytest.mark.parametrize(("data", "message"), [
    (b"VERSION .7\nPOINTS 1\n", "no line DATA"),
    (header(XYZ, "morse"), "expected DATA ascii, binary, binary_compressed, got 'morse'"),
    (header(XYZ[:2], "ascii"), "FIELDS must contain z, with COUNT 1"),
    (header([*XYZ, ("w", "F2", 1)], "ascii"), "a SIZE such as 4, got ['f4', 'f4', 'f4', 'f2']"),
    (header([*XYZ[:2], ("z", "F4", 2)], "ascii"), "FIELDS must contain z, with COUNT 1"),
    (header(XYZ, "ascii", COUNT="1 1"), "must have the same length"),
    (header(XYZ, "ascii", WIDTH=5), "POINTS is 4, but WIDTH times HEIGHT is 5"),
    (header(XYZ, "ascii", 0), "the file has no points"),
    (header(XYZ, "ascii", VIEWPOINT="here"), "VIEWPOINT of the header is not valid: 'here'"),
    (text(XYZ, POINTS.T, WIDTH=5, POINTS=5), "declares 5 points, but the file has 4"),
    (text(XYZ, POINTS.T) + b"1 2\n", "line 16: expected 3 numbers, got 2"),
    (text([*XYZ, ("n", "U1", 1)], [*POINTS.T, POINTS[:, 0]]),
     "the field n must have integers of 1 byte"),
    (text(XYZ, POINTS.T * np.nan), "no point of the file has a position"),
    (header(XYZ, "binary", 5) + RECORDS,
     "declares 5 points, but the file has 4: the file may be truncated"),
    (header([*XYZ, ("w", "F4", 10**17)], "binary") + RECORDS, "at most 10,000 numbers"),
    (header(XYZ, "binary_compressed"),
     "4 points must have 48 bytes, but the file declares 0 bytes, compressed to 0, and has 0"
     " compressed bytes: it may be truncated or damaged"),
    (header(XYZ, "binary_compressed") + COMPRESSED[:-1],
     "declares 48 bytes, compressed to 50, and has 49 compressed bytes: it may be truncated or"
     " damaged"),
    (header(XYZ, "binary_compressed", 10**9) + COMPRESSED,
     "1000000000 points must have 12000000000 bytes, but the file declares 48 bytes"),
    (header(XYZ, "binary_compressed") + COMPRESSED.replace(b"\x1f", b"\x20"),
     "the points cannot be read, the file may be damaged"),
    (header(XYZ, "binary_compressed") + COMPRESSED.replace(b"\x0f", b"\x0e"),
     "the points cannot be read, the file may be damaged"),
])  # fmt: skip
def test_what_is_wrong_with_a_file_is_said(cloud_of, data, message):
    with pytest.raises(MeshError, match=r"cloud\.pcd: ") as caught:
        cloud_of(data)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", [np.inf, np.nan, 1e300])
def test_colors_that_are_no_packed_integers_give_no_warning(cloud_of, number):
    cloud, _ = cloud_of(text([*XYZ, ("rgb", "F4", 1)], [*POINTS.T, np.array([number, 1, 2, 3])]))
    assert np.array_equal(cloud.points, POINTS)


def test_compressed_points_without_compression_are_read(cloud_of):
    sizes, columns = COMPRESSED[:8], np.float32(POINTS).T.tobytes()
    packed = b"\x1f" + columns[:32] + b"\x0f" + columns[32:]
    cloud, _ = cloud_of(header(XYZ, "binary_compressed") + sizes + packed)
    assert np.array_equal(cloud.points, POINTS)


def test_randomly_damaged_files_are_read_or_refused(tmp_path):
    source = random.Random(5)
    files = [text([*XYZ, ("rgb", "F4", 1)], [*POINTS.T, PACKED]), header(XYZ, "binary") + RECORDS]
    files.append(header(XYZ, "binary_compressed") + COMPRESSED)
    n_read = sum(
        damage.check(read_cloud, tmp_path / "damaged.pcd", damage.damaged(data, source))
        for data in files
        for _ in range(300)
    )
    assert 100 < n_read < 800
