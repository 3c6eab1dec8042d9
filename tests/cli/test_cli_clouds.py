"""Point clouds and features at the command line."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import superfacets as sf
from superfacets_cli.main import commands, main


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    xy = np.random.default_rng(0).random((3000, 2))
    points = np.column_stack([xy, 0.2 * (xy[:, 0] > 0.5)])
    colors = np.where(xy[:, :1] + 0.3 * xy[:, 1:] > 0.6, [[255, 0, 0]], [[0, 0, 255]])
    sf.write_mesh("cloud.ply", sf.PointCloud(points, colors=colors.astype(np.uint8)))
    sf.write_mesh("bear.ply", sf.sample_mesh(5000))
    return tmp_path


def run(*arguments, status=0):
    result = CliRunner().invoke(commands, [str(argument) for argument in arguments])
    assert result.exit_code == status, result.output
    return result.output


def test_a_cloud_is_segmented_and_described(folder):
    output = run("segment", "cloud.ply", "-n", 20, "-o", "labels.npy", "-o", "out.ply")
    assert "cloud.ply: 20 regions of 3,000 points in" in output
    assert "does not store" not in output
    assert np.array_equal(sf.read_labels("out.ply"), np.load("labels.npy"))
    assert json.loads(run("info", "--json", "cloud.ply"))["n_points"] == 3000
    facts = json.loads(run("segment", "--json", "cloud.ply", "-n", 20, "-o", "labels.npy"))
    assert facts["n_points"] == 3000
    assert "n_faces" not in facts
    assert "isolated             0" in run("info", "cloud.ply")


def test_a_cloud_is_evaluated(folder):
    run("segment", "cloud.ply", "-n", 20, "-q", "-o", "cloud.csv", "-o", "few.npy")
    facts = json.loads(run("evaluate", "cloud.csv", "cloud.csv", "--json"))
    assert facts["n_regions"] == 20
    printed = run("evaluate", "cloud.ply", "few.npy", "--gt", "cloud.csv")
    assert "undersegmentation_error    0" in printed


@pytest.mark.parametrize("names", [["color"], ["red", "blue"], ["color", "height", "normals"]])
def test_features_by_name(folder, names):
    run("segment", "cloud.ply", "-n", 12, "-q", "--to", "npy")
    options = [word for name in names for word in ("--features", name)]
    run("segment", "cloud.ply", "-n", 12, "-q", "-o", "with.npy", *options, "--feature-weight", 9)
    is_red = sf.read_cloud("cloud.ply").colors[:, 0] > 0.5
    mixed = [
        np.minimum(np.bincount(labels, is_red), np.bincount(labels, ~is_red)).sum()
        for labels in (np.load("cloud.superfacets.npy"), np.load("with.npy"))
    ]
    assert mixed[1] < 0.3 * mixed[0]


def test_properties_of_faces_and_vertices(folder):
    mesh = sf.sample_mesh(5000)
    height = mesh.vertices[:, 1]
    of_faces = height[mesh.faces].mean(axis=1)
    attributes = sf.MeshAttributes(vertex={"h": height}, face={"g": of_faces})
    sf.write_mesh("fields.ply", mesh, attributes=attributes)
    np.save("values.npy", height)
    for name in ("h", "g", "values.npy"):
        run("segment", "fields.ply", "-n", 9, "-q", "-o", f"{name}.seg", "--features", name)
        assert np.array_equal(sf.read_labels("h.seg"), sf.read_labels(f"{name}.seg"))
    run("segment", "fields.ply", "-n", 9, "-q", "-o", "a.ply", "--features", "g", "--subdivide")


def test_what_the_file_does_not_have_is_an_error(folder):
    output = run("segment", "bear.ply", "--features", "color", status=1)
    assert (
        "features color: the mesh has no property red, green, blue; it has normals, height"
        in output
    )
    output = run("segment", "cloud.ply", "--features", "heat", status=1)
    assert "the cloud has no property heat; it has color, normals, height, alpha, blue" in output


def test_scans_of_an_e57_become_one_cloud(folder):
    pye57 = pytest.importorskip("pye57")
    cloud = sf.read_cloud("cloud.ply")
    columns = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), cloud.points.T, strict=True))
    shades = np.round(255 * cloud.colors).astype(np.uint8).T
    columns |= zip(("colorRed", "colorGreen", "colorBlue"), shades, strict=True)
    columns["cartesianInvalidState"] = (np.arange(3000) % 10 == 0).astype(np.int8)
    with pye57.E57("scans.e57", mode="w") as file:
        file.write_scan_raw(columns)
        file.write_scan_raw(columns, translation=np.array([2.0, 0, 0]))
    assert json.loads(run("info", "--json", "scans.e57"))["n_points"] == 5400
    output = run("segment", "scans.e57", "-n", 20, "--features", "color")
    assert "scans.e57: 20 regions of 5,400 points in" in output
    stored = sf.read_attributes("scans.superfacets.ply").vertex
    assert stored["scan"].tolist() == [0] * 2700 + [1] * 2700
    assert stored["record"][:3].tolist() == [1, 2, 3]


def test_more_regions_than_points(folder):
    np.save("few.npy", np.eye(3))
    output = run("segment", "few.npy", "-n", 9, "-o", "labels.npy")
    assert "9 regions were requested, but there are only 3 points" in output


def test_a_mask_tells_how_many_points_it_leaves_out(folder):
    labels = np.ones(3000, int)
    np.save("mask.npy", labels)
    arguments = ["segment", "cloud.ply", "-n", 20, "-o", "labels.npy", "--mask", "mask.npy"]
    assert "the mask leaves out no point" in run(*arguments)
    labels[:1200] = 0
    np.save("mask.npy", labels)
    output = run(*arguments)
    assert "leaves out no point" not in output
    assert " of 3,000 points (1,200 left out) in " in output


def test_info_has_the_digits_of_coordinates_far_from_the_origin(folder):
    corners = [[400000, 5600000, 117.796], [400999.5, 5600000, 118], [400000, 5600999, 120]]
    points = np.vstack([corners, corners])
    sf.write_mesh("far.ply", sf.PointCloud(points))
    output = run("info", "far.ply")
    assert "400000 5600000 117.796 to 400999.5 5600999 120\n" in output
    assert "colors               no\n" in output


def test_errors_name_the_option_that_was_typed(folder):
    message = "viewpoint must be three finite numbers, got (0.0, 0.0)"
    assert message in run("segment", "cloud.ply", "--viewpoint", "0,0", status=2)


def test_scans_are_no_preset_for_clouds(folder, run_main):
    status, _, err = run_main(main, "superfacets", "segment", "cloud.ply", "--scans")
    assert (status, "point clouds: leave out --scans and --denoise" in err) == (2, True)
