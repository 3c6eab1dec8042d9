"""The graph of a point cloud: neighbors, areas, normals, borders, weights."""

from dataclasses import replace

import numpy as np
import pytest
import reference
import shapes
from scipy.spatial import ConvexHull
from shapes import count_pieces

import superfacets as sf
from superfacets import PointCloud, build_point_graph, segment
from superfacets.graph.point_graph import find_point_graph


def sphere(n, seed=0):
    """Return random points on the unit sphere."""
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def plane(n, seed=0):
    """Return random points in the unit square."""
    return np.column_stack([np.random.default_rng(seed).random((n, 2)), np.zeros(n)])


def ring(n):
    """Return equally spaced points on the unit circle."""
    angles = 2 * np.pi * np.arange(n) / n
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(n)])


def rows_of(graph):
    return [row.tolist() for row in np.split(graph.neighbors, graph.offsets[1:-1])]


def test_a_ring_of_points():
    """Each point has two neighbors, so all numbers are known."""
    n = 12
    graph = build_point_graph(ring(n), 2)
    assert rows_of(graph) == [sorted([(i - 1) % n, (i + 1) % n]) for i in range(n)]
    step = 2 * np.sin(np.pi / n)
    area = 2 * np.pi * step**2 / 3  # two neighbors at this distance
    assert graph.measures == pytest.approx(np.full(n, area))
    assert graph.weights == pytest.approx(np.full(2 * n, step / graph.diagonal))
    assert graph.diagonal == pytest.approx(8**0.5)
    measures = graph.arc_measures
    assert measures.border_lengths == pytest.approx(np.full(2 * n, np.pi * area / (2 * step)))
    assert measures.step_lengths == pytest.approx(np.full(2 * n, step))
    assert measures.open_lengths.tolist() == [0.0] * n
    labels = sf.segment_graph(graph, 3, init=[0, 4, 8]).labels
    assert sorted(np.bincount(labels).tolist()) == [3, 4, 5]  # in ties, the lower label wins


def test_equally_near_points_are_taken_along_the_curve():
    cross = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    one, other = (
        find_point_graph(PointCloud(points), 1, n_neighbors=2, is_sorted=True)
        for points in (cross, cross[::-1])
    )
    assert np.array_equal(one.positions, other.positions)
    assert rows_of(one) == rows_of(other)
    assert sorted(len(row) for row in rows_of(one)) != [4] * 5  # two of four equally near points


@pytest.mark.parametrize("points", [sphere(400), plane(300), ring(50), np.repeat(plane(60), 3, 0)])
def test_it_equals_its_twin(points):
    points = points[find_point_graph(PointCloud(points), 1, is_sorted=True).points]
    graph = build_point_graph(points, 5)
    expected = reference.build_point_graph(points, 5, cutoff=4.0)
    assert np.array_equal(graph.offsets, expected.offsets)
    assert np.array_equal(graph.neighbors, expected.neighbors)
    assert graph.measures == pytest.approx(expected.measures, rel=1e-12)
    borders = graph.arc_measures.border_lengths
    assert borders == pytest.approx(expected.border_lengths, rel=1e-9)
    normals = shapes.estimated_normals(points)
    of_twin = reference.point_normals(points, 12)
    along = np.abs(np.einsum("ij,ij->i", normals, of_twin))
    assert along == pytest.approx(np.linalg.norm(of_twin, axis=1), abs=1e-6)


def test_neighbors_equal_those_of_a_search_in_a_tree():
    spatial = pytest.importorskip("scipy.spatial")
    points = np.concatenate([sphere(4000), [[1e6, 0, 0]]])  # the outlier makes the curve coarse
    graph = build_point_graph(points, 6, cutoff=1e9)
    _, nearest = spatial.cKDTree(points).query(points, 7)
    wanted = [set() for _ in points]
    for point, others in enumerate(nearest[:, 1:].tolist()):
        for other in others:
            wanted[point].add(other)
            wanted[other].add(point)
    assert rows_of(graph) == [sorted(row) for row in wanted]


def test_areas_and_borders_are_those_of_the_surface():
    graph = build_point_graph(sphere(20_000))
    assert graph.measures.sum() == pytest.approx(4 * np.pi, rel=0.01)
    equator = graph.positions[:, 2] > 0
    source = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    is_crossing = equator[source] & ~equator[graph.neighbors]
    length = graph.arc_measures.border_lengths[is_crossing].sum()
    assert length == pytest.approx(2 * np.pi, rel=0.05)


def test_arcs_lead_both_ways_with_the_same_measures():
    graph = build_point_graph(sphere(3000), radius=0.2)
    source = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    order = np.lexsort((source, graph.neighbors))
    assert np.array_equal(source[order], graph.neighbors)
    assert np.array_equal(graph.neighbors[order], source)
    assert np.array_equal(graph.weights[order], graph.weights)
    assert np.array_equal(
        graph.arc_measures.border_lengths[order], graph.arc_measures.border_lengths
    )
    assert np.array_equal(graph.arc_measures.angles[order], graph.arc_measures.angles)


def test_noise_makes_areas_larger_by_as_much_as_the_page_of_clouds_says():
    rng = np.random.default_rng(0)
    roof = np.insert(rng.uniform(0, 8, (9_000, 2)), 2, 0, axis=1)  # one point per square of 8 cm
    assert build_point_graph(roof).measures.sum() == pytest.approx(64, rel=0.03)
    roof[:, 2] += rng.normal(0, 0.03, len(roof))
    assert build_point_graph(roof).measures.sum() == pytest.approx(1.22 * 64, rel=0.03)


def test_perimeters_are_exact_for_a_circle_but_too_low_for_regions_as_documented():
    points = plane(30_000)
    circle = (np.hypot(*(points[:, :2] - 0.5).T) < 0.3).astype(int)
    assert sf.region_graph(points, circle).perimeters == pytest.approx(0.6 * np.pi, rel=0.1)
    regions = segment(points, 50)
    hulls = [ConvexHull(points[regions.labels == i, :2]).area for i in range(50)]
    assert np.median(regions.regions.perimeters / hulls) == pytest.approx(0.675, rel=0.05)


@pytest.mark.parametrize(
    ("spacing", "jitter", "expected"),
    [(1, 0, 1.20), (1, 0.5, 1.15), (2, 0, 1.35), (3, 0, 1.40), (5, 0, 0.84), (10, 0, 0.42)],
)
def test_areas_of_grids_and_scan_lines_are_as_far_off_as_documented(spacing, jitter, expected):
    """Points are 1 apart on lines `spacing` apart. Points near the boundary are ignored."""
    rng = np.random.default_rng(0)
    across, along = np.mgrid[0:100, 0:200].reshape(2, -1)
    points = np.stack([spacing * across, along, 0 * along], axis=1).astype(float)
    points[:, :2] += rng.uniform(-jitter, jitter, (len(points), 2))
    is_inside = (across >= 10) & (across < 90) & (along >= 20) & (along < 180)
    areas = build_point_graph(points).measures[is_inside]
    assert areas.mean() == pytest.approx(expected * spacing, rel=0.015)


def test_duplicates_share_the_area_and_hang_on_the_lowest():
    points = plane(200)
    alone = build_point_graph(points)
    doubled = build_point_graph(np.concatenate([points, points[:50], points[:50]]))
    assert doubled.measures.sum() == pytest.approx(alone.measures.sum())
    assert doubled.measures[:50] == pytest.approx(alone.measures[:50] / 3)
    assert rows_of(doubled)[200:250] == [[i] for i in range(50)]
    assert rows_of(doubled)[0] == [*rows_of(alone)[0], 200, 250]
    assert segment(np.repeat(points, 3, axis=0), 10).n_segments == 10


def test_isolated_points_have_no_arcs_and_no_area():
    points = np.concatenate([plane(500), [[9.0, 9.0, 9.0], [-7.0, 0.0, 0.0]]])
    graph = build_point_graph(points)
    assert rows_of(graph)[500:] == [[], []]
    assert graph.measures[500:].tolist() == [0.0, 0.0]
    assert graph.measures.sum() == pytest.approx(1.0, rel=0.2)
    with pytest.warns(sf.IslandWarning):
        assert segment(points, 8).n_segments == 10
    assert segment(points, 8, islands="nearest").n_segments == 8
    line = [[9.0 * place, 9.0, 9.0] for place in range(9)]  # noise, whose points are neighbors
    assert build_point_graph([*plane(2000), *line]).measures.sum() < 1.5


@pytest.mark.parametrize("has_normals", [False, True])
def test_sorted_cells_are_the_points_in_another_order(has_normals):
    points = np.concatenate([sphere(500), sphere(40), [[9.0, 9.0, 9.0]]])  # 40 points occur twice
    cloud = PointCloud(points, points if has_normals else None)
    plain, by_place = find_point_graph(cloud, 1), find_point_graph(cloud, 1, is_sorted=True)
    order = by_place.points
    assert sorted(order.tolist()) == list(range(len(points)))
    assert not np.array_equal(order, np.arange(len(points)))
    assert np.array_equal(by_place.positions, points[order])
    assert np.array_equal(by_place.measures, plain.measures[order])
    assert np.array_equal(by_place.normals, plain.normals[order])
    rows = rows_of(plain)
    assert [sorted(order[row].tolist()) for row in rows_of(by_place)] == [rows[i] for i in order]


X = sphere(3000)[:, 0]

# Arguments of `segment` with one value per point, each used at least once.
GIVEN = [
    {"n_segments": 40}, {"n_segments": 40, "weights": "superfacets"},
    {"n_segments": 40, "features": sf.Features(X, weight=50.0)},
    {"n_segments": 40, "mask": X < 0.4, "islands": "nearest"},
    {"n_segments": 40, "barriers": np.sign(X).astype(int), "islands": "nearest"},
    {"init": (8 * X).astype(int) + 7},
    {"init": (8 * X).astype(int) + 7, "mask": X < 0.4, "barriers": (3 * X).astype(int)},
]  # fmt: skip


@pytest.mark.parametrize("options", GIVEN, ids="-".join)
def test_results_are_in_the_order_of_the_input(options):
    """Expected are the results for sorted points, in the order of the input."""
    points = sphere(3000)
    order = find_point_graph(PointCloud(points), 1, is_sorted=True).points
    at_place = {
        name: value[order]
        if isinstance(value, np.ndarray)
        else replace(value, table=value.table[order])
        if isinstance(value, sf.Features)
        else value
        for name, value in options.items()
    }
    result, expected = segment(points, **options), segment(points[order], **at_place)
    assert np.array_equal(result.labels[order], expected.labels)
    assert np.array_equal(result.centers, order[expected.centers])


@pytest.mark.parametrize("mask", [None, X < 0.4], ids=["all", "some"])
def test_seeds_are_numbers_in_the_input(mask):
    points = sphere(3000)
    seeds = np.flatnonzero(X < 0.4)[::170]
    options = {"max_num_iter": 0, "islands": "nearest", "smooth": False}
    result = segment(points, init=seeds, mask=mask, **options)
    assert np.array_equal(result.centers, seeds)
    assert np.array_equal(result.labels[seeds], np.arange(len(seeds)))


def test_a_gap_is_not_crossed():
    points = np.concatenate([plane(800), plane(800, 1) + [1.4, 0, 0]])
    graph = build_point_graph(points)
    assert count_pieces(graph, np.zeros(1600, np.int32)) == 2


def test_points_on_a_line_and_few_points_work():
    line = np.column_stack([np.arange(30.0), np.zeros(30), np.zeros(30)])
    assert segment(line, 5).n_segments == 5
    assert shapes.estimated_normals(line).tolist() == np.zeros((30, 3)).tolist()
    assert sorted(segment(line[:3], 3).labels.tolist()) == [0, 1, 2]
    assert segment(line[:2]).n_segments == 2
    with pytest.raises(
        ValueError, match="n_segments must be at most 3, the number of points, got 4"
    ):
        segment(line[:3], 4)


def test_normals_point_out_of_a_solid_and_to_a_viewpoint():
    points = sphere(3000)
    normals = shapes.estimated_normals(points)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(3000))
    assert np.all(np.einsum("ij,ij->i", normals, points) > 0.99)
    inward = shapes.estimated_normals(points, viewpoint=[0, 0, 0])
    assert inward == pytest.approx(-normals)
    ground = plane(300)
    assert np.all(shapes.estimated_normals(ground, viewpoint=[0, 0, -5])[:, 2] < 0)


@pytest.mark.parametrize("viewpoint", [[0, 0, 1.1], [3, 4, 0], [0, 0, 1e6], [0, -1e200, 0]])
def test_normals_of_a_closed_shape_point_out_of_it_wherever_the_viewpoint_is_outside(viewpoint):
    ball, ground = sphere(3000), 3.0 * plane(2000) - [3, 3, 5]
    normals = shapes.estimated_normals(np.concatenate([ball, ground]), viewpoint=viewpoint)
    assert np.all(np.einsum("ij,ij->i", normals[:3000], ball) > 0.99)
    is_below = viewpoint[2] < -5
    assert np.all((normals[3000:, 2] < 0) == is_below)
    facing = shapes.estimated_normals(sf.PointCloud(ball, viewpoints=ball * 0.5))
    assert np.all(np.einsum("ij,ij->i", facing, ball) < -0.99)


def valley(n, seed=0):
    """Return points on two squares at a right angle, with normals into the angle."""
    points = plane(n, seed)
    is_wall = np.arange(n) % 2 == 1
    points[is_wall] = points[is_wall][:, [2, 1, 0]]
    normals = np.where(is_wall[:, None], [[1.0, 0, 0]], [[0, 0, 1.0]])
    return points, normals


def test_a_valley_costs_and_a_ridge_does_not():
    points, normals = valley(4000)
    turned = {}
    for name, sign in ("valley", 1), ("ridge", -1):
        cloud = PointCloud(points, sign * normals)
        graph = build_point_graph(cloud, radius=0.3, ridges=0)
        flat = build_point_graph(cloud)
        turned[name] = (graph.weights - flat.weights).sum()
        angles = graph.arc_measures.angles
        assert np.abs(angles).max() == pytest.approx(np.pi / 2)
        assert np.sign(angles[np.abs(angles) > 0.1]).tolist() == [sign] * np.sum(
            np.abs(angles) > 0.1
        )
    assert turned["valley"] > 20
    assert turned["ridge"] < 0.05 * turned["valley"]  # least squares normals round off the edge
    sharp = build_point_graph(PointCloud(points, -normals), radius=0.3, ridges=0.35)
    assert 0.25 < (sharp.weights - flat.weights).sum() / turned["valley"] < 0.4
    both = build_point_graph(PointCloud(points, -normals), radius=0.3, eta_convex=1.0)
    assert (both.weights - flat.weights).sum() == pytest.approx(sum(turned.values()))


def test_regions_follow_the_valley():
    points, normals = valley(6000)
    is_wall = points[:, 0] == 0
    for k in (4, 16, 40):
        labels = segment(PointCloud(points, normals), k).labels
        purity = np.maximum(np.bincount(labels, is_wall), np.bincount(labels, ~is_wall))
        assert purity.sum() / 6000 > 0.98


@pytest.mark.parametrize("weights", ["creases", "superfacets"])
def test_labels_do_not_depend_on_the_number_of_threads(weights):
    points = np.concatenate([sphere(40_000), sphere(30_000, 1) * 0.5 + [3, 0, 0], plane(100)])
    first = segment(points, 60, n_threads=1, weights=weights)
    for n_threads in 2, 3, 8:
        again = segment(points, 60, n_threads=n_threads, weights=weights)
        assert np.array_equal(again.labels, first.labels)


def test_labels_do_not_depend_on_the_unit_or_the_place():
    points = np.round(sphere(5000), 3)
    first = segment(points, 40).labels
    assert np.array_equal(segment(8 * points, 40).labels, first)


def test_regions_are_connected_and_clean_up_knows_clouds():
    points = sphere(20_000)
    result = segment(points, 100)
    graph = build_point_graph(points)
    assert result.n_segments == 100
    assert count_pieces(graph, result.labels) == 100
    assert result.sliver_share == 0.0
    rough = segment(points, 100, smooth=False).labels
    assert sf.metrics.compactness(points, result.labels) < sf.metrics.compactness(points, rough)
    assert 0 < sf.merge_small_regions(points, result.labels, 0.8).n_joined < 60
    radius = (graph.measures.sum() / (100 * np.pi)) ** 0.5
    weighted = build_point_graph(points, radius=radius)
    assert np.array_equal(sf.smooth_borders(points, rough), sf.smooth_borders(weighted, rough))


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"n_neighbors": 0}, ValueError, "n_neighbors must be at least 1"),
    ({"n_neighbors": 2.5}, TypeError, "n_neighbors must be an integer"),
    ({"cutoff": 0}, ValueError, "cutoff must be finite and positive"),
    ({"radius": -1}, ValueError, "radius must be finite"),
    ({"alpha": np.nan}, ValueError, "alpha must be finite"),
    ({"eta_convex": -1}, ValueError, "eta_convex must be finite"),
    ({"ridges": -1}, ValueError, "ridges must be finite"),
])  # fmt: skip
def test_wrong_arguments_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        build_point_graph(plane(20), **arguments)


def test_normals_that_are_all_zero_are_none():
    points = np.random.default_rng(0).normal(size=(200, 3))
    cloud = sf.PointCloud(points, np.zeros((200, 3)))
    assert cloud.normals is None
    assert np.array_equal(sf.segment(cloud, 9).labels, sf.segment(points, 9).labels)


@pytest.mark.parametrize("away", [1e2, 1e100, 1e200, 1e308])
def test_normals_face_a_viewpoint_however_far_it_is(away):
    grid = np.stack(np.meshgrid(range(12), range(12), [0.0]), axis=-1).reshape(-1, 3)
    for side in (-1.0, 1.0):
        normals = shapes.estimated_normals(grid, viewpoint=[0.0, 0.0, side * away])
        assert (np.sign(normals[:, 2]) == side).all()
