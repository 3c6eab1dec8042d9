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
