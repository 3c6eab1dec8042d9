"""Point clouds: stored arrays, and errors for invalid input."""

import pickle
from types import SimpleNamespace

import numpy as np
import pytest

from superfacets import MeshError, PointCloud, build_point_graph, cloud_info, segment
from superfacets.mesh.convert import as_cells, as_cloud

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_arrays_are_kept_read_only_and_as_they_are():
    points = np.array(SQUARE, dtype=np.float64)
    cloud = PointCloud(points, [[0, 0, 2]] * 4, np.full((4, 3), 51, np.uint8))
    assert cloud.points.base is points
    assert not cloud.points.flags.writeable
    assert points.flags.writeable
    assert cloud.normals.tolist() == [[0.0, 0.0, 1.0]] * 4
    assert cloud.colors.dtype == np.float32
    assert cloud.colors[0] == pytest.approx([0.2] * 3)
    assert repr(cloud) == "PointCloud(4 points, normals, colors)"
    again = pickle.loads(pickle.dumps(cloud))
    assert np.array_equal(again.colors, cloud.colors)
    assert not again.normals.flags.writeable


def test_normals_may_be_missing_or_huge():
    cloud = PointCloud(SQUARE, [[0, 0, 0], [1e200, 0, 0], [0, 1e-200, 0], [3, 4, 0]])
    assert cloud.normals.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.6, 0.8, 0]]


def test_colors_may_have_alpha_and_16_bits():
    assert PointCloud(SQUARE, colors=np.full((4, 4), 65535, np.uint16)).colors.min() == 1.0
    black = PointCloud(SQUARE, colors=np.zeros((4, 4)))
    assert black.colors.tolist() == [[0.0] * 3] * 4
    assert repr(black) == "PointCloud(4 points)"


@pytest.mark.parametrize(("arguments", "message"), [
    (([[0, 0]],), r"points must have shape \(N, 3\), got \(1, 2\)"),
    ((np.empty((0, 3)),), "the cloud has no points"),
    (([[0, 0, 0], [0, np.nan, 0]],), r"points\[1\] must be finite, got \[0.0, nan, 0.0\]"),
    (([[0, 0, 0], [1e-18, 0, 0]],), "rescale the cloud"),
    (([["a", "b", "c"]],), "points must contain numbers, got <U1"),
    ((SQUARE, [[0, 0, 1]]), r"normals must have shape \(4, 3\)"),
    ((SQUARE, [[0, 0, np.inf]] * 4), r"normals\[0\] must be finite, got \[0.0, 0.0, inf\]"),
    ((SQUARE, None, [[0, 0, 1]]), r"colors must have shape \(4, 3\)"),
    ((SQUARE, None, np.full((4, 3), 7)), "colors must be floats or unsigned integers"),
    ((SQUARE, None, np.full((4, 3), 1.5)),
     r"colors\[0\] must be from 0 to 1, got \[1.5, 1.5, 1.5\]"),
    ((SQUARE, None, np.full((4, 3), np.nan)),
     r"colors\[0\] must be from 0 to 1, got \[nan, nan, nan\]"),
])  # fmt: skip
def test_what_is_wrong_is_refused(arguments, message):
    with pytest.raises(MeshError, match=message):
        PointCloud(*arguments)


def test_too_many_points_are_refused():
    many = np.broadcast_to(np.zeros(3), (2**31, 3))
    with pytest.raises(MeshError, match="at most 2147483647"):
        PointCloud(_Huge(many))


class _Huge:
    """Stand-in for an array of more points than fit in memory; only its shape is checked."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return self.array


def test_clouds_of_other_libraries_are_recognized():
    points = np.array(SQUARE, dtype=np.float64)
    open3d = SimpleNamespace(
        points=points, normals=[[0, 0, 1]] * 4, colors=[],
        has_normals=lambda: True, has_colors=lambda: False,
    )  # fmt: skip
    assert repr(as_cells(open3d)) == "PointCloud(4 points, normals)"
    tensor = SimpleNamespace(cpu=lambda: SimpleNamespace(numpy=lambda: points))
    assert as_cells(SimpleNamespace(point={"positions": tensor})).n_points == 4
    cloud = SimpleNamespace(vertices=points, colors=np.full((4, 4), 255, np.uint8))  # trimesh
    assert repr(as_cells(cloud)) == "PointCloud(4 points, colors)"
    made = pytest.importorskip("pyvista").PolyData(points)
    made["RGB"] = np.full((4, 3), 9, np.uint8)
    assert repr(as_cells(made)) == "PointCloud(4 points, colors)"


def test_an_array_is_a_cloud_and_a_list_of_points_is_one_where_it_can_be_nothing_else():
    assert segment(np.array(SQUARE, dtype=np.float64), 2).n_segments == 2
    assert as_cloud(SQUARE).n_points == 4
    with pytest.raises(
        TypeError,
        match="expected a PointCloud, an array of points, a path, or a cloud of trimesh,"
        " PyVista, Open3D or meshio, got int",
    ):
        as_cloud(3)


def test_info_counts():
    grid = [[x, y, 0] for x in range(9) for y in range(9)]
    info = cloud_info([*grid, [0, 0, 0], [50, 50, 50]])
    assert (info.n_points, info.n_positions, info.n_components, info.n_isolated) == (83, 82, 2, 1)
    assert (info.has_normals, info.has_colors) == (False, False)
    assert info.bounds[1] == (50.0, 50.0, 50.0)
    assert info.spacing == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("points", [[[1, 2, 3]], [[1, 2, 3]] * 5])
def test_points_at_one_place_are_a_cloud_that_has_no_graph(points):
    cloud = PointCloud(points)
    assert cloud.bounds.tolist() == [[1, 2, 3], [1, 2, 3]]
    for function in (build_point_graph, cloud_info, lambda cloud: segment(cloud, 1)):
        with pytest.raises(MeshError, match="all points lie at one point"):
            function(cloud)
