"""Points of a room without normals: estimated ones do not know on which side one stands."""

import numpy as np
import pytest

import superfacets as sf

pytestmark = pytest.mark.filterwarnings("ignore::superfacets.IslandWarning")


def rectangles():
    """Floor, walls and a table with four legs: a corner and two sides of each rectangle."""
    width, depth, height = 4.0, 5.0, 2.6
    across, along, up = np.diag([width, depth, height])
    found = [(0, across, along), (0, across, up), (along, across, up), (0, along, up)]
    found.append((across, along, up))
    for low, size in [([1.2, 1.8, 0.7], [1.6, 0.9, 0.05])] + [
        ([1.25 + 1.45 * i, 1.85 + 0.75 * j, 0], [0.05, 0.05, 0.7]) for i in (0, 1) for j in (0, 1)
    ]:
        sides = np.diag(size)
        for axis in range(3 if low[2] else 2):  # legs have no ends
            one, other = np.delete(sides, axis, axis=0)
            found += [(low, one, other), (low + sides[axis], one, other)]
    return [(np.broadcast_to(corner, 3), one, other) for corner, one, other in found]


def room(n, noise=0.002, seed=0):
    """Points of the room, and the rectangle that each is on."""
    rng = np.random.default_rng(seed)
    areas = [np.linalg.norm(np.cross(one, other)) for _, one, other in rectangles()]
    counts = np.maximum(n * np.array(areas) / sum(areas), 1).astype(int)
    points = [
        corner + rng.random((count, 1)) * one + rng.random((count, 1)) * other
        for (corner, one, other), count in zip(rectangles(), counts, strict=True)
    ]
    surfaces = np.repeat(np.arange(len(counts)), counts)
    return np.concatenate(points) + noise * rng.normal(size=(counts.sum(), 3)), surfaces


def wrong_share(labels, surfaces):
    """Share of the points in a region of which most are on another surface."""
    table = np.zeros((labels.max() + 1, surfaces.max() + 1), int)
    np.add.at(table, (labels, surfaces), 1)
    return 1 - table.max(axis=1).sum() / len(labels)


@pytest.mark.parametrize("k", [150, 400])
def test_regions_of_a_room_end_at_its_edges(k):
    points, surfaces = room(380_000)
    result = sf.segment(points, k)
    assert result.params["eta_convex"] == 0.5
    assert wrong_share(result.labels, surfaces) < 0.02


def test_turns_count_both_ways_only_where_nothing_tells_them_apart():
    points, _ = room(20_000)
    bear = sf.sample_mesh(20_000).vertices
    normals = sf.estimate_normals(points, viewpoint=[2, 2.5, 1.5])
    given = sf.PointCloud(points, normals)
    for cloud, is_known in ((points, False), (bear, True), (given, True)):
        eta = sf.segment(cloud, 30).params["eta_convex"]
        assert eta == (0 if is_known else 0.5)
        assert sf.cloud_info(cloud).knows_turns == is_known
    assert sf.segment(points, 30, eta_convex=0.1).params["eta_convex"] == 0.1


def test_tiles_know_it_too():
    points, _ = room(20_000)
    tiled = sf.segment_tiled(points, 30, tile_size=8192)
    assert tiled.params["eta_convex"] == 0.5
    assert np.array_equal(tiled.labels, sf.segment(points, 30, weights="creases").labels)


@pytest.fixture
def splats(tmp_path):
    """A file of Gaussian splats on a floor and a wall, without normals, red and blue by halves."""
    rng = np.random.default_rng(0)
    floor, wall = rng.random((2, 4000, 3)) * [[[1, 1, 0]], [[1, 0, 1]]]
    points = np.concatenate([floor, wall]).astype("<f4")
    names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"]
    names += [f"scale_{axis}" for axis in range(3)] + [f"rot_{axis}" for axis in range(4)]
    table = np.zeros((len(points), len(names)), "<f4")
    table[:, :3] = points
    table[:, 6:9] = np.where(points[:, :1] < 0.5, [[1.77, -1.77, -1.77]], [[-1.77, -1.77, 1.77]])
    table[:, 9] = np.where(points[:, 1] < 0.5, 2.0, -2.0)  # 0.88 and 0.12
    table[:, 10:] = rng.random((len(points), 7))
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    lines += [*(f"property float {name}" for name in names), "end_header", ""]
    path = tmp_path / "splats.ply"
    path.write_bytes("\n".join(lines).encode() + table.tobytes())
    return path, table, names


def test_splats_are_segmented_by_their_shape_and_color(splats):
    path, table, _ = splats
    cloud = sf.read_cloud(path)
    assert cloud.normals is None
    assert np.allclose(cloud.colors[table[:, 0] < 0.5], [1, 0, 0], atol=0.01)
    labels = sf.segment(path, 20).labels
    assert wrong_share(labels, np.repeat([0, 1], 4000)) < 0.02
    by_color = sf.segment(path, 2, features="color", feature_weight=50).labels
    assert wrong_share(by_color, (table[:, 0] < 0.5).astype(int)) < 0.02
    tiled = sf.segment_tiled(path, 20, tile_size=4096).labels
    assert np.array_equal(tiled, sf.segment(path, 20, weights="creases").labels)


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
    """A room with a ceiling looks like a solid, and the points of the file stay as they are."""
    points, _ = room(20_000)
    ceiling = np.random.default_rng(1).random((4000, 3)) * [4, 5, 0] + [0, 0, 2.6]
    np.save(tmp_path / "room.npy", np.concatenate([points, ceiling]))
    inside = [2, 2.5, 1.5]
    result = sf.batch(
        tmp_path / "room.npy", tmp_path / "out", formats=["npy"], n_segments=40, viewpoint=inside
    )
    assert result.n_failed == 0
    labels = sf.read_labels(tmp_path / "out" / "room.superfacets.npy")
    cloud = np.load(tmp_path / "room.npy")
    normals = sf.estimate_normals(cloud, viewpoint=inside)
    expected = sf.segment(sf.PointCloud(cloud, normals), 40).labels
    assert np.array_equal(labels, expected)
    assert not np.array_equal(labels, sf.segment(cloud, 40).labels)


def test_a_viewpoint_is_only_for_clouds_without_normals(tmp_path):
    points, _ = room(1_000)
    sf.write_mesh(tmp_path / "bear.ply", sf.sample_mesh(3_000))
    sf.write_mesh(tmp_path / "known.ply", sf.PointCloud(points, points - [2, 2.5, 1]))
    for name in ("bear.ply", "known.ply"):
        result = sf.batch(tmp_path / name, tmp_path / "out", viewpoint=[0, 0, 9])
        assert "a viewpoint is for point clouds without normals" in result.records[0]["error"]
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
    assert "there is no opacity of each point" in failed.records[0]["error"]
    with pytest.raises(ValueError, match="min_opacity"):
        sf.batch(path, tmp_path / "out", min_opacity=2, **options)
