"""Points of a room without normals: estimated normals may point to either side."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

import superfacets as sf

pytestmark = pytest.mark.filterwarnings("ignore::superfacets.IslandWarning")


INSIDE = [2, 2.5, 1.5]


def rectangles(has_ceiling=False):
    """Return a corner and two sides of each rectangle of floor, walls and a four-legged table."""
    width, depth, height = 4.0, 5.0, 2.6
    across, along, up = np.diag([width, depth, height])
    found = [(0, across, along), (0, across, up), (along, across, up), (0, along, up)]
    found.append((across, along, up))
    found += [(up, across, along)] if has_ceiling else []
    for low, size in [([1.2, 1.8, 0.7], [1.6, 0.9, 0.05])] + [
        ([1.25 + 1.45 * i, 1.85 + 0.75 * j, 0], [0.05, 0.05, 0.7]) for i in (0, 1) for j in (0, 1)
    ]:
        sides = np.diag(size)
        for axis in range(3 if low[2] else 2):  # legs have no ends
            one, other = np.delete(sides, axis, axis=0)
            found += [(low, one, other), (low + sides[axis], one, other)]
    return [(np.broadcast_to(corner, 3), one, other) for corner, one, other in found]


def room(n, noise=0.002, seed=0, has_ceiling=False):
    """Return points of the room, and the rectangle of each."""
    rng = np.random.default_rng(seed)
    found = rectangles(has_ceiling)
    areas = [np.linalg.norm(np.cross(one, other)) for _, one, other in found]
    counts = np.maximum(n * np.array(areas) / sum(areas), 1).astype(int)
    points = [
        corner + rng.random((count, 1)) * one + rng.random((count, 1)) * other
        for (corner, one, other), count in zip(found, counts, strict=True)
    ]
    surfaces = np.repeat(np.arange(len(counts)), counts)
    return np.concatenate(points) + noise * rng.normal(size=(counts.sum(), 3)), surfaces


def wrong_share(labels, surfaces):
    """Return the share of points that are not on the main surface of their region."""
    table = np.zeros((labels.max() + 1, surfaces.max() + 1), int)
    np.add.at(table, (labels, surfaces), 1)
    return 1 - table.max(axis=1).sum() / len(labels)


@pytest.mark.parametrize("has_ceiling", [False, True], ids=["open", "closed"])
def test_regions_of_a_room_end_at_its_edges(has_ceiling):
    """In a closed room, estimated normals point out of the room, so that its corners are convex."""
    points, surfaces = room(380_000, has_ceiling=has_ceiling)
    for k in (150, 400):
        result = sf.segment(points, k)
        assert result.params["eta_convex"] == (0 if has_ceiling else 0.5)
        assert wrong_share(result.labels, surfaces) < 0.02
    assert (
        wrong_share(
            sf.segment(points, 150, weights=sf.Weights(eta_convex=0, ridges=0)).labels, surfaces
        )
        > 0.05
    )


def test_regions_of_a_room_that_was_seen_from_within_end_at_its_edges():
    points, surfaces = room(380_000, has_ceiling=True)
    for k in (150, 400):
        result = sf.segment(sf.PointCloud(points, viewpoints=INSIDE), k)
        assert wrong_share(result.labels, surfaces) < 0.02


def sphere(n):
    points = np.random.default_rng(0).normal(size=(n, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def cost_of_ridges(points, radius):
    """Return the share of arcs that ridges lengthen."""
    with_ridges, without = (
        sf.build_point_graph(points, radius=radius, ridges=ridges).weights for ridges in (1, 0)
    )
    assert np.all(with_ridges >= without)
    return np.mean(with_ridges > without)


def test_ridges_are_edges_between_flat_sides_that_are_resolved():
    """A box has ridges; a ball, a rod, and points too sparse for regions of this size have none."""
    box = np.random.default_rng(0).random((40_000, 3))
    box[np.arange(40_000), np.arange(40_000) % 3] = np.arange(40_000) // 3 % 2
    assert 0.02 < cost_of_ridges(box, 0.3) < 0.2
    assert cost_of_ridges(box, 0.02) == 0
    assert cost_of_ridges(sphere(20_000), 0.3) == 0
    rod = sphere(20_000)
    rod[:, 2] = 30 * np.random.default_rng(1).random(20_000)
    rod[:, :2] /= np.linalg.norm(rod[:, :2], axis=1, keepdims=True)
    assert cost_of_ridges(rod, 3) < 0.003  # at the ends


def test_duplicates_cost_no_more_time_around_ridges():
    points = np.concatenate([room(5_000)[0], np.repeat([[2.0, 2.5, 0.0]], 50_000, axis=0)])
    assert cost_of_ridges(points, 1.0) < 0.2


def test_turns_count_both_ways_only_where_nothing_tells_them_apart():
    points, _ = room(20_000)
    bear = sf.sample_mesh(20_000).vertices
    normals = shapes.estimated_normals(points, viewpoint=[2, 2.5, 1.5])
    given = sf.PointCloud(points, normals)
    for cloud, is_known in ((points, False), (bear, True), (given, True)):
        assert sf.segment(cloud, 30).params["eta_convex"] == (0 if is_known else 0.5)
        assert sf.cloud_info(cloud).knows_turns == is_known
    assert sf.segment(points, 30, weights=sf.Weights(eta_convex=0.1)).params["eta_convex"] == 0.1


def splat_table(rng, *, flatness=4.0):
    """Return splats near a floor and a wall: centers, scales, and quaternions (z to normal)."""
    floor, wall = rng.random((2, 4000, 3)) * [[[1, 1, 0]], [[1, 0, 1]]]
    points = np.concatenate([floor, wall]) + 0.02 * rng.normal(size=(8000, 3))
    half = np.pi / 4
    turns = np.repeat([[1, 0, 0, 0], [np.cos(half), np.sin(half), 0, 0]], 4000, axis=0)
    flipped = rng.random(8000) < 0.5  # half of the axes point to the other side
    turns[flipped] = turns[flipped][:, [1, 0, 3, 2]] * [-1, 1, -1, 1]  # another half turn about x
    scales = np.log([[0.02, 0.02, 0.02 / flatness]]) + 0.01 * rng.normal(size=(8000, 3))
    return points, scales, turns * rng.uniform(0.5, 3.0, (8000, 1))


def columns_of(points, scales):
    named = {f"scale_{axis}": values for axis, values in enumerate(scales.T)}
    return {**dict(zip("xyz", points.T, strict=True)), **named}


def write_ply(path, columns):
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns['x'])}"]
    lines += [*(f"property float {name}" for name in columns), "end_header", ""]
    table = np.column_stack(list(columns.values())).astype("<f4")
    path.write_bytes("\n".join(lines).encode() + table.tobytes())
    return table


@pytest.fixture
def splats(tmp_path):
    """Write Gaussian splats on a floor and a wall, without normals, half red and half blue."""
    points, scales, turns = splat_table(np.random.default_rng(0))
    shades = np.where(points[:, :1] < 0.5, [[1.77, -1.77, -1.77]], [[-1.77, -1.77, 1.77]])
    columns = dict(zip("xyz", points.T, strict=True))
    columns |= {name: np.zeros(8000) for name in ("nx", "ny", "nz")}
    columns |= {f"f_dc_{axis}": shades[:, axis] for axis in range(3)}
    columns["opacity"] = np.where(points[:, 1] < 0.5, 2.0, -2.0)  # 0.88 and 0.12
    columns |= {f"scale_{axis}": scales[:, axis] for axis in range(3)}
    columns |= {f"rot_{axis}": turns[:, axis] for axis in range(4)}
    path = tmp_path / "splats.ply"
    return path, write_ply(path, columns), list(columns)


def test_the_shortest_axes_of_splats_are_normals_of_unknown_sign(splats):
    path, _, _ = splats
    cloud = sf.read_cloud(path)
    assert cloud.normals is None
    up = np.repeat([[0, 0, 1], [0, 1, 0]], 4000, axis=0)
    assert np.abs(np.einsum("ij,ij->i", cloud.axes, up)) == pytest.approx(np.ones(8000), abs=1e-5)
    normals = shapes.estimated_normals(cloud, viewpoint=[0.5, 1, 1])  # in the angle of the two
    is_away = cloud.points[:, 1:].max(axis=1) > 0.15
    assert np.einsum("ij,ij->i", normals, up)[is_away].min() > 0.99
    rough = shapes.estimated_normals(cloud.points, viewpoint=[0.5, 1, 1])
    assert np.einsum("ij,ij->i", rough, up)[is_away].min() < 0.7
    assert sf.cloud_info(cloud).has_axes
    assert not sf.cloud_info(cloud).knows_turns


def test_splats_without_rotations_or_that_are_round_have_no_axes(tmp_path):
    points, scales, turns = splat_table(np.random.default_rng(0), flatness=1.0)
    columns = columns_of(points, scales)
    write_ply(tmp_path / "turned.ply", columns | {f"rot_{i}": turns[:, i] for i in range(4)})
    write_ply(tmp_path / "bare.ply", columns)
    assert sf.read_cloud(tmp_path / "bare.ply").axes is None
    round_ones = sf.read_cloud(tmp_path / "turned.ply")
    assert not round_ones.axes.any()
    expected = sf.segment(round_ones.points, 20).labels  # normals estimated from neighbors
    for cloud in (round_ones, tmp_path / "bare.ply"):
        assert np.array_equal(sf.segment(cloud, 20).labels, expected)


def test_damaged_rotations_of_splats_are_no_axes(tmp_path):
    points, scales, turns = splat_table(np.random.default_rng(0))
    turns[:3] = [[0, 0, 0, 0], [np.nan, 0, 0, 1], [np.inf, 0, 0, 1]]
    scales[3] = np.nan
    columns = columns_of(points, scales)
    write_ply(tmp_path / "damaged.ply", columns | {f"rot_{i}": turns[:, i] for i in range(4)})
    axes = sf.read_cloud(tmp_path / "damaged.ply").axes
    assert axes.any(axis=1).tolist() == [False] * 4 + [True] * 7996


def test_flat_splats_of_two_scales_have_the_axis_z(tmp_path):
    points, scales, turns = splat_table(np.random.default_rng(0))
    columns = columns_of(points, scales[:, :2])
    write_ply(tmp_path / "flat.ply", columns | {f"rot_{i}": turns[:, i] for i in range(4)})
    cloud = sf.read_cloud(tmp_path / "flat.ply")
    assert np.abs(cloud.axes[:4000, 2]) == pytest.approx(np.ones(4000), abs=1e-5)


def test_splats_are_segmented_by_their_shape_and_color(splats):
    path, table, _ = splats
    cloud = sf.read_cloud(path)
    assert cloud.normals is None
    assert np.allclose(cloud.colors[table[:, 0] < 0.5], [1, 0, 0], atol=0.01)
    is_wall = np.repeat([0, 1], 4000)
    labels = sf.segment(path, 30).labels
    assert wrong_share(labels, is_wall) < 0.04  # centers are noisy
    by_color = sf.segment(path, 2, features=sf.Features("color", weight=50)).labels
    assert wrong_share(by_color, (table[:, 0] < 0.5).astype(int)) < 0.02


def test_labels_go_back_into_a_file_of_splats_with_all_that_it_holds(splats):
    path, table, names = splats
    cloud, attributes = sf.read_cloud(path), sf.read_attributes(path)
    labels = sf.segment(cloud, 20).labels
    out = path.with_name("labeled.ply")
    sf.write_mesh(out, cloud, labels, attributes=attributes)
    kept = sf.read_attributes(out).vertex
    assert np.array_equal(kept["label"], labels)
    assert all(np.array_equal(kept[name], table[:, 3 + i]) for i, name in enumerate(names[3:]))
    assert np.array_equal(sf.read_cloud(out).points, cloud.points)


def test_a_viewpoint_tells_the_sides_of_a_cloud(tmp_path):
    """A file or a cloud has one viewpoint, or one per point; outputs are made with it, too."""
    points, _ = room(20_000, has_ceiling=True)
    np.save(tmp_path / "room.npy", points)
    to = {"formats": ["npy", "npz", "pcd"], "viewpoint": INSIDE}
    assert sf.batch(tmp_path / "room.npy", tmp_path, n_segments=40, **to).n_failed == 0
    labels = sf.read_labels(tmp_path / "room.superfacets.npy")
    assert sf.read_cloud(tmp_path / "room.superfacets.pcd").viewpoints.tolist() == [*INSIDE]
    seen = sf.region_graph(sf.PointCloud(points, viewpoints=INSIDE), labels).to_pyg()
    with np.load(tmp_path / "room.superfacets.npz") as graph:
        assert all(np.array_equal(graph[name], values) for name, values in seen.items())
    normals = shapes.estimated_normals(points, viewpoint=INSIDE)
    assert np.array_equal(labels, sf.segment(sf.PointCloud(points, normals), 40).labels)
    assert not np.array_equal(labels, sf.segment(points, 40).labels)
    for viewpoints in (INSIDE, np.tile(INSIDE, (len(points), 1))):
        cloud = sf.PointCloud(points, viewpoints=viewpoints)
        assert np.array_equal(sf.segment(cloud, 40).labels, labels)
        assert sf.cloud_info(cloud).knows_turns
        assert np.array_equal(shapes.estimated_normals(cloud), normals)


def test_each_scanner_sees_its_side():
    """For two walls back to back, no single place sees both."""
    rng = np.random.default_rng(0)
    walls = rng.random((2, 2000, 3)) * [0, 1, 1] + [[[0, 0, 0]], [[0.5, 0, 0]]]
    points, places = np.concatenate(walls), np.repeat([[-3, 0.5, 0.5], [3, 0.5, 0.5]], 2000, axis=0)
    normals = shapes.estimated_normals(sf.PointCloud(points, viewpoints=places))
    assert np.all(normals[:2000, 0] < 0)
    assert np.all(normals[2000:, 0] > 0)
    part = sf.PointCloud(points, axes=normals, viewpoints=places).taken(np.arange(1500, 2500))
    assert np.array_equal(part.viewpoints, places[1500:2500])
    assert np.array_equal(part.axes, replace(part).axes)


@pytest.mark.parametrize(("viewpoints", "message"), [
    ([0, 0], r"viewpoints must have shape \(3,\) or \(2, 3\), got \(2,\)"),
    ([[0, 0, 0]], r"viewpoints must have shape .* got \(1, 3\)"),
    ([0, np.nan, 0], r"viewpoints\[0\] must be finite, got \[0.0, nan, 0.0\]"),
    (["a", "b", "c"], "viewpoints must contain numbers, got <U1"),
])  # fmt: skip
def test_wrong_viewpoints_are_refused(viewpoints, message):
    with pytest.raises(sf.MeshError, match=message):
        sf.PointCloud([[0, 0, 0], [1, 0, 0]], viewpoints=viewpoints)
    with pytest.raises(sf.MeshError, match=r"axes\[1\] must be finite, got \[0.0, inf, 1.0\]"):
        sf.PointCloud([[0, 0, 0], [1, 0, 0]], axes=[[0, 0, 1], [0, np.inf, 1]])


def test_a_viewpoint_is_only_for_clouds_without_normals(tmp_path):
    points, _ = room(1_000)
    sf.write_mesh(tmp_path / "bear.ply", sf.sample_mesh(3_000))
    sf.write_mesh(tmp_path / "known.ply", sf.PointCloud(points, points - [2, 2.5, 1]))
    for name in ("bear.ply", "known.ply"):
        result = sf.batch(tmp_path / name, tmp_path / "out", viewpoint=[0, 0, 9])
        assert (
            "omit viewpoint: it is only for point clouds without normals"
            in result.records[0]["error"]
        )
    with pytest.raises(ValueError, match="viewpoint must be three finite numbers"):
        sf.batch(tmp_path / "bear.ply", tmp_path / "out", viewpoint=[0, 1])


def test_faint_splats_are_left_out(splats, tmp_path):
    path, table, _ = splats
    options = {"formats": ["npy"], "n_segments": 20}
    sf.batch(path, tmp_path / "out", min_opacity=0.5, **options)
    labels = sf.read_labels(tmp_path / "out" / "splats.superfacets.npy")
    assert np.array_equal(labels >= 0, table[:, 9] > 0)
    np.save(tmp_path / "points.npy", table[:, :3])
    failed = sf.batch(tmp_path / "points.npy", tmp_path / "other", min_opacity=0.5, **options)
    assert "the file has no property opacity" in failed.records[0]["error"]
    failed = sf.batch(path, tmp_path / "none", min_opacity=1, **options)
    assert "no splat has an opacity >= 1" in failed.records[0]["error"]
    with pytest.raises(ValueError, match="min_opacity"):
        sf.batch(path, tmp_path / "out", min_opacity=2, **options)
