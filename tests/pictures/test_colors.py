"""Colors of regions: different for neighbors, evenly used, and reproducible."""

import time
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from shapes import bumpy_sheet, cube, fins, moebius, slivers, soup, strip

from superfacets import (  # fmt: skip
    PointCloud,
    build_face_graph,
    build_point_graph,
    face_colors,
    segment,
)
from superfacets_show import colors as of_colors
from superfacets_show.colors import (
    MIN_COLOR_DISTANCE,
    NO_COLOR,
    PALETTE,
    VISIONS,
    color_distances,
    from_oklab,
    oklab,
    scale_colors,
    seen_as,
)


def region_colors(graph, labels):
    return of_colors.region_colors((graph.offsets, graph.neighbors), np.asarray(labels, np.int32))


def graph_of_pairs(n, pairs):
    """Return an undirected graph in CSR form."""
    arcs = np.array([arc for a, b in pairs for arc in ((a, b), (b, a))]).reshape(-1, 2)
    arcs = arcs[np.lexsort((arcs[:, 1], arcs[:, 0]))]
    offsets = np.searchsorted(arcs[:, 0], np.arange(n + 1))
    return SimpleNamespace(offsets=offsets, neighbors=arcs[:, 1].astype(np.int32))


def grid_of_blocks(n, block, seed=None):
    """Return an n x n grid of cells, and square blocks in random order as regions."""
    cell = np.arange(n * n).reshape(n, n)
    pairs = np.concatenate(
        [
            np.stack([cell[:, :-1].ravel(), cell[:, 1:].ravel()], axis=1),
            np.stack([cell[:-1].ravel(), cell[1:].ravel()], axis=1),
        ]
    )
    middles = np.random.default_rng(seed).uniform(0, n, (n * n // block**2, 2))
    places = np.stack(np.divmod(np.arange(n * n), n), axis=1)
    nearest = ((places[:, None] - middles[None]) ** 2).sum(axis=2).argmin(axis=1)
    return graph_of_pairs(n * n, pairs), np.unique(nearest, return_inverse=True)[1]


def distance_across_arcs(graph, labels, colors):
    """Return the color distance across each arc between regions, in the worst vision."""
    sources = np.repeat(labels, np.diff(graph.offsets))
    targets = labels[graph.neighbors]
    crossing = (sources != targets) & (sources >= 0) & (targets >= 0)
    ends = colors[sources[crossing]], colors[targets[crossing]]
    apart = [np.subtract(*(seen_as(end, vision) for end in ends)) for vision in VISIONS]
    return np.linalg.norm(apart, axis=2).min(axis=0)


def identity(n):
    return np.arange(n)


def test_oklab_of_known_colors():
    colors = np.array([[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 0, 255]])
    known = [[1, 0, 0], [0, 0, 0], [0.62796, 0.22486, 0.12585], [0.45201, -0.03246, -0.31153]]
    np.testing.assert_allclose(oklab(colors), known, atol=2e-5)


@pytest.mark.parametrize("vision", VISIONS)
def test_grays_look_the_same_to_everyone(vision):
    grays = np.repeat(np.arange(0, 256, 15)[:, None], 3, axis=1)
    np.testing.assert_allclose(seen_as(grays, vision), oklab(grays), atol=1e-4)


@pytest.mark.parametrize(("vision", "one", "other"), [
    ("protanopia", [193, 64, 64], [101, 101, 60]), ("deuteranopia", [180, 110, 60], [143, 130, 60]),
    ("tritanopia", [60, 150, 220], [60, 168, 168]),
])  # fmt: skip
def test_colors_on_a_confusion_line_look_nearly_the_same(vision, one, other):
    pair = np.array([one]), np.array([other])
    assert color_distances(*pair, (vision,)) < 0.45 * color_distances(*pair, ("normal",))


def test_colors_come_back_from_oklab():
    colors = np.random.default_rng(0).integers(0, 256, (100, 3))
    np.testing.assert_array_equal(from_oklab(oklab(colors)), colors)


def test_palette_colors_are_as_different_as_promised():
    apart = color_distances(PALETTE, PALETTE)[np.triu_indices(len(PALETTE), 1)]
    assert 0.08 < MIN_COLOR_DISTANCE <= apart.min() < MIN_COLOR_DISTANCE + 0.001
    normal = color_distances(PALETTE, PALETTE, ("normal",))[np.triu_indices(len(PALETTE), 1)]
    assert normal.min() > 0.119


def test_the_gray_of_no_region_is_no_color_of_a_region():
    assert color_distances(PALETTE, np.array([NO_COLOR])).min() > 0.089


def test_palette_colors_are_light_enough_to_be_shaded():
    lightness = oklab(PALETTE)[:, 0]
    assert lightness.min() > 0.65
    assert lightness.max() < 0.96


@pytest.mark.parametrize("seed", range(5))
def test_regions_that_touch_differ_by_at_least_the_promised_distance(seed):
    graph, labels = grid_of_blocks(60, 5, seed)
    colors = region_colors(graph, labels)
    assert colors.dtype == np.uint8
    assert colors.shape == (labels.max() + 1, 3)
    assert distance_across_arcs(graph, labels, colors).min() >= MIN_COLOR_DISTANCE


def test_ten_regions_that_all_touch_get_the_whole_palette():
    graph = graph_of_pairs(10, combinations(range(10), 2))
    colors = region_colors(graph, identity(10))
    assert {tuple(c) for c in colors} == {tuple(c) for c in PALETTE}


@pytest.mark.parametrize(("n", "least"), [(11, 0.05), (40, 0.015), (100, 0.001)])
def test_more_regions_that_all_touch_still_differ(n, least):
    graph = graph_of_pairs(n, combinations(range(n), 2))
    colors = region_colors(graph, identity(n))
    assert distance_across_arcs(graph, identity(n), colors).min() > least


def test_a_region_with_a_thousand_neighbors_differs_from_them_all():
    graph = graph_of_pairs(1001, [(500, other) for other in range(1001) if other != 500])
    colors = region_colors(graph, identity(1001))
    assert distance_across_arcs(graph, identity(1001), colors).min() >= MIN_COLOR_DISTANCE


def test_all_colors_are_used_about_equally_often():
    graph, labels = grid_of_blocks(80, 4, seed=1)
    colors = region_colors(graph, labels)
    _, uses = np.unique(colors, axis=0, return_counts=True)
    assert len(uses) == len(PALETTE)
    assert uses.min() > len(colors) / len(PALETTE) / 2
    assert uses.max() < len(colors) / len(PALETTE) * 1.5


def test_a_planar_map_is_colored_within_the_palette_whatever_the_order_of_its_regions():
    """In a wheel, sorting by number of neighbors would color 24 regions right after the hub."""
    rim = [(i, i % 24 + 1) for i in range(1, 25)]
    for seed in range(10):
        names = np.random.default_rng(seed).permutation(25)
        pairs = [(names[a], names[b]) for a, b in [*rim, *((0, i) for i in range(1, 25))]]
        graph = graph_of_pairs(25, pairs)
        colors = region_colors(graph, identity(25))
        assert distance_across_arcs(graph, identity(25), colors).min() >= MIN_COLOR_DISTANCE


def test_regions_of_points_and_of_a_volume_differ_for_everyone():
    cloud = PointCloud(np.random.default_rng(1).normal(size=(3_000, 3)))
    labels = segment(cloud, 60).labels
    colors = region_colors(build_point_graph(cloud), labels)
    assert distance_across_arcs(build_point_graph(cloud), labels, colors).min() >= 0.08
    blocks = np.arange(12**3).reshape(12, 12, 12)
    ends = [(blocks.take(range(11), axis).ravel(), blocks.take(range(1, 12), axis).ravel())
            for axis in range(3)]  # fmt: skip
    graph = graph_of_pairs(12**3, np.concatenate([np.stack(pair, axis=1) for pair in ends]))
    places = np.stack(np.unravel_index(np.arange(12**3), (12,) * 3), axis=1)
    middles = np.random.default_rng(2).uniform(0, 12, (80, 3))
    nearest = np.linalg.norm(places[:, None] - middles, axis=2).argmin(axis=1)
    labels = np.unique(nearest, return_inverse=True)[1]
    colors = region_colors(graph, labels)
    assert distance_across_arcs(graph, labels, colors).min() >= MIN_COLOR_DISTANCE


def test_a_hundred_thousand_regions_are_colored_in_seconds():
    n = 320
    cell = np.arange(n * n).reshape(n, n)
    slanted = (cell[:-1, :-1], cell[1:, 1:])
    ends = [(cell[:, :-1], cell[:, 1:]), (cell[:-1], cell[1:]), slanted]
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
    arcs = np.concatenate([pairs, pairs[:, ::-1]])
    arcs = arcs[np.lexsort((arcs[:, 1], arcs[:, 0]))]
    offsets = np.searchsorted(arcs[:, 0], np.arange(n * n + 1))
    graph = SimpleNamespace(offsets=offsets, neighbors=arcs[:, 1].astype(np.int32))
    start = time.process_time()
    colors = region_colors(graph, identity(n * n))
    assert time.process_time() - start < 5
    assert (colors[pairs[:, 0]] != colors[pairs[:, 1]]).any(axis=1).all()


def test_cells_in_no_region_are_gray_and_take_no_color():
    labels = np.array([0, 1, -1, 2, 2, -1])
    colors = face_colors(strip(6), labels)
    assert (colors[labels < 0] == NO_COLOR).all()
    np.testing.assert_array_equal(
        colors[labels >= 0], region_colors(build_face_graph(strip(6)), labels)[[0, 1, 2, 2]]
    )
    assert (face_colors(strip(4), [-1] * 4) == NO_COLOR).all()


def test_steps_of_the_scale_look_about_equally_large():
    steps = np.linalg.norm(np.diff(oklab(scale_colors(18)), axis=0), axis=1)
    assert steps.max() < 1.2 * steps.min()


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.6, 1.0])
def test_up_to_24_regions_have_distinct_colors_however_they_touch(share):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        pairs = [pair for pair in combinations(range(24), 2) if rng.random() < share]
        colors = region_colors(graph_of_pairs(24, pairs), identity(24))
        assert len({tuple(color) for color in colors}) == 24


def test_one_region_has_the_first_color():
    np.testing.assert_array_equal(region_colors(graph_of_pairs(2, [(0, 1)]), [0, 0]), PALETTE[:1])


def test_cells_without_arcs_are_colored():
    np.testing.assert_array_equal(region_colors(graph_of_pairs(3, []), [0, 1, 2]), PALETTE[:3])


def test_the_same_input_gives_the_same_colors():
    graph, labels = grid_of_blocks(40, 4, seed=2)
    once, again = region_colors(graph, labels), region_colors(graph, labels.copy())
    np.testing.assert_array_equal(once, again)


def test_labels_are_left_as_they_are():
    labels = np.arange(4)
    labels.setflags(write=False)
    face_colors(strip(4), labels)
    np.testing.assert_array_equal(labels, np.arange(4))


@pytest.mark.parametrize(("labels", "error", "message"), [
    ([0, 1, 2], ValueError, r"labels must have one value per cell \(4\), got 3 values"),
    ([[0, 1, 2, 3]], ValueError, "one-dimensional"),
    ([0.0, 1.0, 0.0, 1.0], TypeError, "labels must contain integers, got float64"),
])  # fmt: skip
def test_labels_that_are_not_one_number_a_face_are_refused(labels, error, message):
    with pytest.raises(error, match=message):
        face_colors(strip(4), labels)


@pytest.mark.parametrize("n_regions", [1, 2, 7, 60])
@pytest.mark.parametrize(
    "mesh",
    [bumpy_sheet(), fins(), moebius(), slivers(), cube(), soup(bumpy_sheet())],
    ids=["sheet", "fins", "moebius", "slivers", "cube", "soup"],
)
def test_colors_of_faces_are_those_of_the_whole_graph(mesh, n_regions):
    """`face_colors` uses only the faces on borders."""
    labels = np.random.default_rng(n_regions).integers(0, n_regions, mesh.n_faces)
    compact = np.unique(labels, return_inverse=True)[1]
    expected = region_colors(build_face_graph(mesh), compact)[compact]
    assert_array_equal(face_colors(mesh, labels), expected)
    assert_array_equal(face_colors(mesh, labels * 3 - 8), expected)
