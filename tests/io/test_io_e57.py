"""E57: scans with poses, colors and invalid points as one cloud; damaged files are refused."""

import os

import numpy as np
import pytest
import shapes

from superfacets import MeshError, read_cloud, segment
from superfacets.files.writers.write import OutputFiles
from superfacets.kit import Input
from superfacets.tools.cell_file import CellFile
from superfacets_formats.e57 import read_e57

QUARTER_TURN = np.sqrt([0.5, 0, 0, 0.5])  # about z, as a quaternion w, x, y, z
POINTS = np.array([[0, 0, 0], [1.5, 0, 0], [1, 1, 0.25], [0, 1, -3]])
COLORS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [51, 51, 51]], np.uint8)


@pytest.fixture
def pye57():
    return pytest.importorskip("pye57")


def scan(points=POINTS, colors=None, **others):
    """Return the columns of a scan, as pye57 expects them."""
    columns = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T, strict=True), **others)
    if colors is not None:
        columns |= zip(("colorRed", "colorGreen", "colorBlue"), colors.T, strict=True)
    return columns


@pytest.fixture
def write(pye57, tmp_path):
    """Return a function that writes scans, with options of `write_scan_raw`, to a file."""

    def write_scans(*scans):
        path = tmp_path / "scans.e57"
        with pye57.E57(str(path), mode="w") as file:
            for columns, options in scans:
                file.write_scan_raw(columns, **options)
        return path

    return write_scans


def test_points_and_colors(write):
    cloud = read_cloud(write((scan(colors=COLORS), {})))
    assert np.array_equal(cloud.points, POINTS)
    assert cloud.colors == pytest.approx(COLORS / 255)
    assert cloud.normals is None


def test_scans_are_joined_in_their_poses(write):
    path = write(
        (scan(colors=COLORS), {"rotation": QUARTER_TURN, "translation": np.array([10.0, 0, 0])}),
        (scan(colors=COLORS[::-1]), {"translation": np.array([0, 0, 5.0])}),
    )
    cloud, attributes = read_e57(Input(path.read_bytes(), ".e57"))
    turned = np.column_stack([10 - POINTS[:, 1], POINTS[:, 0], POINTS[:, 2]])
    assert cloud.points == pytest.approx(np.concatenate([turned, POINTS + [0, 0, 5]]), abs=1e-12)
    assert cloud.colors == pytest.approx(np.concatenate([COLORS, COLORS[::-1]]) / 255)
    assert attributes.vertex["scan"].tolist() == [0] * 4 + [1] * 4
    assert attributes.vertex["record"].tolist() == [0, 1, 2, 3] * 2


def test_poses_are_viewpoints(write):
    placed = {"rotation": QUARTER_TURN, "translation": np.array([10.0, 0, 0])}
    assert read_cloud(write((scan(), placed))).viewpoints.tolist() == [10, 0, 0]
    two = read_cloud(write((scan(), placed), (scan(), {"translation": np.array([0, 0, 5.0])})))
    assert two.viewpoints.tolist() == [[10, 0, 0]] * 4 + [[0, 0, 5]] * 4
    assert read_cloud(write((scan(), {"rotation": QUARTER_TURN}))).viewpoints.tolist() == [0, 0, 0]
    assert read_cloud(write((scan(), {}), (scan(), {}))).viewpoints is None  # nothing is moved


def test_normals_of_scans_face_their_scanners(write):
    """Two walls are scanned from opposite sides."""
    wall = np.random.default_rng(0).random((500, 3)) * [0, 1, 1]
    behind = {"translation": np.array([4.0, 0, 0])}
    path = write((scan(wall + [1, 0, 0]), {"translation": np.zeros(3)}), (scan(wall - 1), behind))
    cloud = read_cloud(path)
    assert cloud.points[[0, -1], 0].tolist() == [1, 3]
    normals = shapes.estimated_normals(cloud)
    assert np.all(normals[:500, 0] < -0.99)
    assert np.all(normals[500:, 0] > 0.99)


def test_any_rotation_is_that_of_pye57(write, pye57):
    quaternion = np.array([0.1, -0.7, 0.5, 0.2])  # normalized by pye57 and by the reader
    path = write((scan(), {"rotation": quaternion, "translation": np.array([1.0, 2, 3])}))
    with pye57.E57(str(path)) as file:
        columns = file.read_scan(0, ignore_missing_fields=True)
    expected = np.column_stack([columns[f"cartesian{axis}"] for axis in "XYZ"])
    assert read_cloud(path).points == pytest.approx(expected, abs=1e-12)


def test_invalid_points_are_left_out(write):
    state = np.array([0, 2, 0, 1], np.int8)
    rates = np.array([0.5, 0.25, 1, 0], np.float32)
    columns = scan(colors=COLORS, cartesianInvalidState=state, intensity=rates)
    path = write((columns, {}), (scan(colors=COLORS, intensity=rates), {}))
    cloud, attributes = read_e57(Input(path.read_bytes(), ".e57"))
    kept = [0, 2, 0, 1, 2, 3]
    assert np.array_equal(cloud.points, POINTS[kept])
    assert cloud.colors == pytest.approx(COLORS[kept] / 255)
    assert attributes.vertex["record"].tolist() == kept
    assert attributes.vertex["scan"].tolist() == [0, 0, 1, 1, 1, 1]
    assert attributes.vertex["intensity"].tolist() == rates[kept].tolist()
    assert len(segment(path, 2).labels) == 6


def test_a_scan_without_a_field_has_missing_values_there(write):
    rates = np.array([0.5, 0.25, 1, 0], np.float32)
    path = write((scan(colors=COLORS, intensity=rates), {}), (scan(), {}))
    cloud, attributes = read_e57(Input(path.read_bytes(), ".e57"))
    assert cloud.colors == pytest.approx(np.concatenate([COLORS / 255, np.zeros((4, 3))]))
    assert np.array_equal(attributes.vertex["intensity"], [*rates, *[np.nan] * 4], equal_nan=True)
    missing = ("intensity", "red", "green", "blue")
    assert attributes.left_out == tuple(
        f"{name} of 4 points, of scans that have none" for name in missing
    )


def test_labels_alone_have_one_row_per_record_of_all_scans(write, tmp_path):
    state = np.array([0, 2, 0, 1], np.int8)
    file = CellFile.read(write((scan(cartesianInvalidState=state), {}), (scan(POINTS + 9), {})))
    cloud, attributes = file.cells_and_attributes()
    assert attributes.records.tolist() == [True, False, True, False, *[True] * 4]
    OutputFiles([tmp_path / "a.npy"]).write(cloud, np.arange(6), attributes=attributes)
    assert np.load(tmp_path / "a.npy").tolist() == [0, -1, 1, -1, 2, 3, 4, 5]
    assert file.labels_in(tmp_path / "a.npy", cloud, "label")[0].tolist() == [0, 1, 2, 3, 4, 5]


def test_all_fields_of_points_are_read(pye57, tmp_path):
    def build(nodes, image, tree, prototype):
        pose, rotation = nodes.StructureNode(image), nodes.StructureNode(image)
        for axis, value in zip("wxyz", QUARTER_TURN, strict=True):
            rotation.set(axis, nodes.FloatNode(image, float(value)))
        pose.set("rotation", rotation)
        tree.set("pose", pose)
        image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
        names = (*AXES, "timeStamp", "nor:normalX", "nor:normalY", "nor:normalZ")
        table = np.hstack([POINTS, 1e9 + POINTS[:, :1], np.eye(3)[[0, 0, 1, 2]]])
        columns = _doubles(nodes, image, prototype, names, table)
        for name in ("rowIndex", "returnCount"):
            prototype.set(name, nodes.IntegerNode(image, 0, 0, 2**20))
            columns[name] = np.array([7, 0, 3, 2**20], np.longlong)
        return columns

    path = build_file(pye57, tmp_path / "a.e57", build)
    cloud, attributes = read_e57(Input(path.read_bytes(), ".e57"))
    assert attributes.left_out == ()
    assert cloud.normals == pytest.approx(np.array([[0, 1, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    assert np.array_equal(attributes.vertex["timeStamp"], 1e9 + POINTS[:, 0])
    for name in ("rowIndex", "returnCount"):
        assert attributes.vertex[name].dtype == np.int32
        assert attributes.vertex[name].tolist() == [7, 0, 3, 2**20]


def build_file(pye57, path, fill):
    """Write a file of one scan; `fill` makes its tree and prototype, and returns the columns."""
    nodes = pye57.libe57
    with pye57.E57(str(path), mode="w") as file:
        image = file.image_file
        tree = nodes.StructureNode(image)
        prototype = nodes.StructureNode(image)
        columns = fill(nodes, image, tree, prototype)
        points = nodes.CompressedVectorNode(image, prototype, nodes.VectorNode(image, True))
        tree.set("points", points)
        file.data3d.append(tree)
        buffers = nodes.VectorSourceDestBuffer()
        for name, values in columns.items():
            buffers.append(nodes.SourceDestBuffer(image, name, values, len(values), True, True))
        writer = points.writer(buffers)
        writer.write(len(next(iter(columns.values()))))
        writer.close()
    return path


def _doubles(nodes, image, prototype, names, table):
    for name in names:
        prototype.set(name, nodes.FloatNode(image, 0.0))
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def test_spherical_coordinates(pye57, tmp_path):
    def build(nodes, image, _tree, prototype):
        names = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
        table = np.array([[2, 0, 0], [2, np.pi / 2, 0], [3, 1.0, np.pi / 2], [1, 1, 1]])
        prototype.set("sphericalInvalidState", nodes.IntegerNode(image, 0, 0, 2))
        columns = _doubles(nodes, image, prototype, names, table)
        return columns | {"sphericalInvalidState": np.array([0, 0, 0, 2], np.int8)}

    cloud = read_cloud(build_file(pye57, tmp_path / "a.e57", build))
    assert cloud.points == pytest.approx(np.array([[2, 0, 0], [0, 2, 0], [0, 0, 3]]), abs=1e-12)


AXES = ("cartesianX", "cartesianY", "cartesianZ")


@pytest.mark.parametrize("has_limits", [False, True])
def test_colors_have_the_range_that_is_declared(pye57, tmp_path, has_limits):
    def build(nodes, image, tree, prototype):
        columns = _doubles(nodes, image, prototype, AXES, POINTS)
        limits = nodes.StructureNode(image)
        for name in ("colorRed", "colorGreen", "colorBlue"):
            prototype.set(name, nodes.IntegerNode(image, 0, 0, 65535))
            limits.set(f"{name}Minimum", nodes.IntegerNode(image, 0))
            limits.set(f"{name}Maximum", nodes.IntegerNode(image, 1023))
            columns[name] = np.array([0, 341, 682, 1023], np.uint16)
        if has_limits:
            tree.set("colorLimits", limits)
        return columns

    red = read_cloud(build_file(pye57, tmp_path / "a.e57", build)).colors[:, 0]
    whole = 1023 if has_limits else 65535
    assert red == pytest.approx(np.array([0, 341, 682, 1023]) / whole)


def test_colors_without_a_range_are_left_out(pye57, tmp_path):
    def build(nodes, image, _tree, prototype):
        columns = _doubles(nodes, image, prototype, AXES, POINTS)
        for name in ("colorRed", "colorGreen", "colorBlue"):
            prototype.set(name, nodes.IntegerNode(image, 7, 7, 7))
            columns[name] = np.full(4, 7, np.uint8)
        return columns

    assert read_cloud(build_file(pye57, tmp_path / "a.e57", build)).colors is None


def test_scaled_integers(pye57, tmp_path):
    def build(nodes, image, _tree, prototype):
        for name in AXES:
            prototype.set(name, nodes.ScaledIntegerNode(image, 0, -100_000, 100_000, 0.001, 0.0))
        return {name: np.ascontiguousarray(POINTS[:, i]) for i, name in enumerate(AXES)}

    cloud = read_cloud(build_file(pye57, tmp_path / "a.e57", build))
    assert cloud.points == pytest.approx(POINTS, abs=1e-9)


def test_a_scan_without_coordinates_is_refused(pye57, tmp_path):
    def build(nodes, image, _tree, prototype):
        return _doubles(nodes, image, prototype, ("intensity",), POINTS)

    with pytest.raises(
        MeshError, match=r"a\.e57: scan 0 has neither cartesian nor spherical coordinates"
    ):
        read_cloud(build_file(pye57, tmp_path / "a.e57", build))


def test_a_rotation_that_is_none_is_refused(write):
    path = write((scan(), {"rotation": np.zeros(4)}))
    with pytest.raises(
        MeshError, match=r"scan 0 has an invalid rotation: \[0\.0, 0\.0, 0\.0, 0\.0\]"
    ):
        read_cloud(path)


def test_a_file_without_scans_is_refused(write):
    with pytest.raises(MeshError, match="the E57 file has no scans"):
        read_cloud(write())


def test_a_point_that_is_not_finite_is_refused(pye57, tmp_path):
    def build(nodes, image, _tree, prototype):
        points = POINTS.copy()
        points[2, 1] = np.nan
        return _doubles(nodes, image, prototype, AXES, points)

    with pytest.raises(
        MeshError, match=r"a.e57: points\[2\] must be finite, got \[1.0, nan, 0.25\]"
    ):
        read_cloud(build_file(pye57, tmp_path / "a.e57", build))


@pytest.mark.parametrize(
    ("declared", "message"),
    [(5, "scan 0 declares 5 points but has 4"), (10**12, "the scans declare 1000000000000 points")],
)
def test_wrong_counts_are_refused(write, monkeypatch, pye57, declared, message):
    path = write((scan(), {}))
    monkeypatch.setattr(pye57.ScanHeader, "point_count", property(lambda _: declared))
    with pytest.raises(MeshError, match=message):
        read_cloud(path)


@pytest.mark.parametrize("content", [b"ASTM-E57", b"\0" * 4000])
def test_what_is_no_e57_is_refused(pye57, tmp_path, content):
    (tmp_path / "a.e57").write_bytes(content)
    with pytest.raises(MeshError, match=r"a\.e57: the E57 file cannot be read: [^\n]*$"):
        read_cloud(tmp_path / "a.e57")


def test_a_damaged_or_cut_file_is_refused(write, tmp_path):
    whole = write((scan(colors=COLORS), {})).read_bytes()
    damaged = bytearray(whole)
    damaged[1100] ^= 0x10  # libE57 compares the checksum of each page
    for content in (damaged, whole[:1024], whole[:-1]):
        (tmp_path / "b.e57").write_bytes(content)
        with pytest.raises(MeshError, match=r"b\.e57: the E57 file cannot be read"):
            read_cloud(tmp_path / "b.e57")


def test_memory_that_runs_out_is_no_fault_of_the_file(write, broken, pye57):
    path = write((scan(), {}))

    broken("pye57.E57.get_header", MemoryError)
    with pytest.raises(MemoryError):
        read_cloud(path)


@pytest.mark.skipif(os.name != "posix", reason="Windows opens files by name alone")
def test_no_file_is_left_by_a_killed_process(write, tmp_path, monkeypatch, temporary, pye57):
    path = write((scan(), {}))
    seen = []

    def look(*_):
        seen.append(list((tmp_path / "temporary").iterdir()))
        raise MemoryError  # in place of the signal

    (tmp_path / "temporary").mkdir()
    temporary(tmp_path / "temporary")
    monkeypatch.setattr(pye57.E57, "get_header", look)
    with pytest.raises(MemoryError):
        read_cloud(path)
    assert seen == [[]]


def test_messages_of_the_library_are_short(write, tmp_path):
    (tmp_path / "b.e57").write_bytes(write((scan(), {})).read_bytes() + bytes(1024))
    with pytest.raises(MeshError) as caught:
        read_cloud(tmp_path / "b.e57")
    assert len(str(caught.value)) < len(str(tmp_path)) + 300


@pytest.mark.parametrize(
    ("old", "new"), [(b"<e57Root ", b"<!DOCTYPE"), (b'"UTF-8"', b"'UTF-7'"), (b"<?xml", b"<\0?xm")]
)
def test_xml_that_e57_does_not_know_is_refused(write, tmp_path, old, new):
    content = write((scan(), {})).read_bytes()
    assert old in content
    (tmp_path / "b.e57").write_bytes(content.replace(old, new))
    with pytest.raises(MeshError, match="its XML must be UTF-8 without a DOCTYPE"):
        read_cloud(tmp_path / "b.e57")
