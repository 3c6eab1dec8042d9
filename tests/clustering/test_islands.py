"""Components without a seed, which become regions or join the nearest region; one-way arcs."""

import math
import time

import loops
import numpy as np
import pytest
import reference
import shapes

import superfacets as sf

INITS = ("geodesic", "farthest")


def strips(*sizes):
    """Return strips with these numbers of faces, one above the other."""
    parts = [shapes.strip(n) for n in sizes]
    return shapes.together(
        [sf.Mesh(part.vertices + [0, 10 * i, 0], part.faces) for i, part in enumerate(parts)]
    )


def expected_radius(graph, k):
    return math.sqrt(graph.measures.sum() / (math.pi * k))


def component_of(mesh):
    graph = sf.build_face_graph(mesh)
    same = np.zeros(mesh.n_faces, np.int32)
    return np.array(sf._core.find_components(graph.offsets, graph.neighbors, same)[0])


@pytest.fixture(scope="module")
def gears():
    return shapes.gears()


@pytest.mark.filterwarnings(
    "ignore::superfacets.IslandWarning", "ignore::superfacets.SliverWarning"
)
@pytest.mark.parametrize("init", INITS)
@pytest.mark.parametrize("k", [1, 2, 30, 150])
def test_k_is_k_on_a_box_of_gears(gears, init, k):
    kept = sf.segment(gears, k, init=init)
    joined = sf.segment(gears, k, init=init, islands="nearest")
    assert kept.n_segments == k + kept.n_unreached
    assert kept.n_unreached > 0 or k == 150
    assert joined.n_segments == k
    assert np.array_equal(np.unique(joined.labels), np.arange(k))
    assert np.array_equal(joined.labels[joined.centers], np.arange(k))
    seeded = len(np.unique(component_of(gears)[joined.centers]))
    assert joined.n_unreached == sf.mesh_info(gears).n_components - seeded


def test_more_regions_than_asked_for_come_with_a_warning_that_says_what_to_do(gears):
    with pytest.warns(sf.IslandWarning) as caught:
        result = sf.segment(gears, 30)
    n = result.n_unreached
    assert str(caught[0].message) == (
        f"{30 + n} regions instead of 30: {n} components got no seed;"
        " to join them to the nearest region as separate pieces, use islands='nearest'"
    )
    assert caught[0].filename == __file__


def test_there_is_no_warning_where_no_number_was_asked_for_or_all_is_as_asked(gears):
    """In tests, warnings are errors."""
    sf.segment(gears, radius=0.05 * sf.build_face_graph(gears).diagonal)  # 26 of 56 have no seed
    sf.paper.segment(gears, 30)
    sf.segment(gears, 30, islands="nearest")
    sf.segment(shapes.two_islands(), 2)
    sf.segment(shapes.soup(shapes.cube()), 12)


def test_k_is_k_where_expansions_halt(gears):
    kept = sf.paper.segment(gears, 30)
    assert kept.n_segments == 30 + kept.n_unreached > 30
    joined = sf.paper.segment(gears, 30, islands="nearest")
    assert joined.n_segments == 30
    assert np.array_equal(np.unique(joined.labels), np.arange(30))


@pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")
@pytest.mark.parametrize("init", INITS)
def test_gears_large_enough_get_regions_by_their_area(gears, init):
    k = 100
    component = component_of(gears)
    result = sf.segment(gears, k, init=init, islands="nearest", alpha=0)
    areas = np.bincount(component, sf.build_face_graph(gears).measures)
    expected = k * areas / areas.sum()
    n_seeds = np.bincount(component[result.centers], minlength=len(areas))
    assert np.all((n_seeds > 0) == (expected >= 0.5))
    large = expected >= 5
    assert large.sum() >= 5
    ratios = n_seeds[large] / expected[large]
    assert np.all((ratios > 0.4) & (ratios < 1.6))


def test_an_island_is_all_in_the_region_nearest_to_it(gears):
    result = sf.segment(gears, 30, islands="nearest", smooth=False)
    component = component_of(gears)
    seeded = np.isin(component, component[result.centers])
    positions = sf.build_face_graph(gears).positions
    for island in np.unique(component[~seeded]):
        of_island = component == island
        (label,) = np.unique(result.labels[of_island])
        steps = positions[seeded] - positions[of_island][:, None]
        squared = np.sum(steps**2, axis=2).min(axis=0)
        assert result.labels[seeded][np.argmin(squared)] == label


@pytest.mark.parametrize("init", [*INITS, "flood", "grid"])
def test_islands_make_no_difference_to_a_mesh_in_one_piece(init):
    sheet = shapes.bumpy_sheet(16)
    one, other = (loops.segment(sheet, 20, init=init, islands=i) for i in ("keep", "nearest"))
    assert np.array_equal(one.labels, other.labels)
    assert one.n_unreached == other.n_unreached == 0


def test_flood_leaves_islands_out_where_they_are_to_join():
    mesh = strips(40, 1)
    graph = shapes.unit_graph(mesh)
    assert 40 in sf.place_seeds(graph, 3, init="flood")
    seeds = sf.place_seeds(graph, 3, init="flood", islands="nearest")
    assert 40 not in seeds
    result = loops.segment(mesh, 3, init="flood", islands="nearest")
    assert (result.n_segments, result.n_unreached) == (len(seeds), 1)


@pytest.mark.parametrize(
    ("init", "n_islands", "n_regions", "labels"),
    [([5, 0], 3, 2, [1] * 3 + [0] * 3 + [1] * 3), ("grid", 3, 1, [0] * 9)],
)
@pytest.mark.filterwarnings("ignore:the radius gives only one region")
def test_what_seeds_of_ones_own_or_of_a_grid_leave_out_joins_the_nearest_too(
    init, n_islands, n_regions, labels
):
    mesh = strips(6, 1, 1, 1)
    size = {"radius": 0.6 * sf.build_face_graph(mesh).diagonal} if init == "grid" else {}
    result = loops.segment(mesh, init=init, islands="nearest", smooth=False, **size)
    assert result.n_unreached == n_islands
    assert result.n_segments == len(result.centers) == n_regions
    assert result.labels.tolist() == labels
    assert result.params["islands"] == "nearest"


def line_of_pieces(sizes, gap=10.0):
    """Return cells 1 apart, in pieces that are `gap` apart."""
    graphs = [shapes.line_graph([1.0] * (n - 1)) for n in sizes]
    starts = np.cumsum([0, *sizes[:-1]])
    x = np.concatenate([
        graph.positions[:, 0] + i * gap + start
        for i, (graph, start) in enumerate(zip(graphs, starts, strict=True))
    ])  # fmt: skip
    offsets = np.concatenate([[0], np.cumsum(np.concatenate([np.diff(g.offsets) for g in graphs]))])
    arcs = [graph.neighbors + start for graph, start in zip(graphs, starts, strict=True)]
    neighbors = np.concatenate(arcs)
    positions = np.stack([x, 0 * x, 0 * x], 1)
    return sf.CellGraph(positions, np.ones(len(x)), offsets, neighbors, np.ones(len(neighbors)))


def test_equally_near_cells_go_by_their_index():
    graph = line_of_pieces([6, 1, 6])  # x = 0 to 5, 16, and 27 to 32: both gaps are 11
    result = sf.segment_graph(graph, 2, islands="nearest")
    assert result.labels[6] == result.labels[5]
    assert result.n_unreached == 1


def test_an_island_does_not_join_another_island():
    graph = line_of_pieces([8, 1, 1, 1], gap=3.0)
    result = sf.segment_graph(graph, 1, islands="nearest")
    assert result.labels.tolist() == [0] * 11
    assert result.n_unreached == 3
    assert sf.segment_graph(graph, 1).n_segments == 4


@pytest.mark.parametrize("init", [*INITS, "flood"])
@pytest.mark.parametrize("beside_a_sheet", [True, False])
def test_a_hundred_thousand_specks_take_seconds(init, beside_a_sheet):
    rng = np.random.default_rng(0)
    n = 100_000
    specks = rng.uniform(0, 1, (n, 1, 3)) + rng.uniform(0, 1e-3, (n, 3, 3))
    mesh = shapes.soup(sf.Mesh(specks.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)))
    if beside_a_sheet:
        mesh = shapes.together([mesh, shapes.bumpy_sheet(60)])
    begin = time.process_time()
    result = loops.segment(mesh, 150, init=init, islands="nearest", smooth=False)
    assert time.process_time() - begin < 30
    if init in INITS:
        assert result.n_segments == 150
        assert result.n_unreached == n - (0 if beside_a_sheet else 150)


@pytest.mark.parametrize("n_threads", [1, 2, 5])
@pytest.mark.parametrize("seed", range(6))
def test_joined_islands_equal_the_twin(n_threads, seed):
    """Many distances are equal, and some are 0."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 3000)) if seed < 5 else 40_000
    graph = shapes.random_graph(n, n // 2, seed)
    graph = sf.CellGraph(
        np.round(graph.positions, seed % 3), graph.measures, graph.offsets, graph.neighbors,
        graph.weights,
    )  # fmt: skip
    share = 0.5 if seed < 5 else 0.02
    labels = np.where(rng.uniform(size=n) < share, -1, rng.integers(0, 9, n)).astype(np.int32)
    labels[int(rng.integers(n))] = 0
    cells = graph.ordered(n_threads)
    none = np.empty(0, np.int32)
    joined, n_islands, _ = sf._core.join_islands(cells, labels, none, n_threads)
    assert (joined.tolist(), n_islands, []) == reference.join_islands(graph, labels.tolist())


@pytest.mark.parametrize("n_threads", [1, 3])
@pytest.mark.parametrize("seed", range(6))
def test_islands_of_groups_equal_the_twin(n_threads, seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 2000))
    graph = shapes.random_graph(n, n // 3, seed)
    pieces, n_pieces = sf._core.find_components(
        graph.offsets, graph.neighbors, np.zeros(n, np.int32)
    )
    groups = rng.integers(-1, 12, n_pieces).astype(np.int32)[pieces]
    labels = np.where(rng.uniform(size=n_pieces)[pieces] < 0.7, -1, pieces % 7).astype(np.int32)
    labels[groups > 8] = -1  # groups that contain only islands
    labels[int(rng.integers(n))] = 0
    joined, n_joined, centers = sf._core.join_islands(graph.ordered(1), labels, groups, n_threads)
    expected = reference.join_islands(graph, labels.tolist(), groups.tolist())
    assert (joined.tolist(), n_joined, centers.tolist()) == expected
    assert len(centers) > 0
    assert n_joined > 0


@pytest.mark.parametrize("seed", range(20))
def test_loops_without_islands_equal_their_twins(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 100))
    if seed % 2:
        graph = shapes.random_graph(n, int(rng.integers(0, 2 * n)), seed)
    else:
        graph = shapes.random_one_way_graph(n, int(rng.integers(0, 3 * n)), seed)
    k = int(rng.integers(1, n + 1))
    radius = expected_radius(graph, k)
    islands = {"islands": "nearest"}
    flooded = reference.flood_seeds(graph, radius, k, **islands)
    assert sf.place_seeds(graph, k, init="flood", **islands).tolist() == flooded
    for init in INITS:
        seeds = sf.place_seeds(graph, k, init=init, **islands).tolist()
        twin = (
            reference.farthest_seeds(graph, k, **islands)
            if init == "farthest"
            else reference.geodesic_seeds(graph, k)
        )
        assert seeds == twin
        for factor in (None, 1.5):
            history, _ = reference.iterate(graph, seeds, radius, radius_factor=factor, **islands)
            labels, centers = history[-1]
            result = loops.segment_graph(graph, k, init=init, radius_factor=factor, **islands)
            *expected, _ = reference.join_islands(graph, labels)
            assert [result.labels.tolist(), result.n_unreached] == expected
            assert result.centers.tolist() == centers
            assert result.n_segments == k


# Arcs that lead one way.

PAIR_AND_ONE = sf.CellGraph([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [1, 1, 1], [0, 0, 1, 1], [0], [1.0])
"""An arc from cell 1 to cell 0, and an isolated cell 2."""


def test_seeds_are_distinct_where_arcs_lead_one_way():
    assert sf.place_seeds(PAIR_AND_ONE, 3).tolist() == [0, 2, 1]
    result = sf.segment_graph(PAIR_AND_ONE, 3)
    assert (result.n_segments, sorted(result.labels.tolist())) == (3, [0, 1, 2])
    for k in (1, 2, 3):
        assert sf.segment_graph(PAIR_AND_ONE, k, islands="nearest").n_segments == k


def test_flood_visits_last_what_arcs_do_not_lead_to():
    graph = sf.CellGraph(
        [[2, 0, 0], [7, 0, 0], [8, 0, 0], [4, 0, 0]], [1] * 4, [0, 0, 1, 2, 3], [0, 0, 1], [1.0] * 3
    )
    seeds = sf.place_seeds(graph, 4, init="flood").tolist()
    assert seeds == [3, 0, 2]
    assert seeds == reference.flood_seeds(graph, expected_radius(graph, 4))


@pytest.mark.parametrize("seed", range(30))
def test_seeds_and_regions_on_one_way_graphs_equal_their_twins(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 80))
    graph = shapes.random_one_way_graph(n, int(rng.integers(0, 3 * n)), seed)
    k = int(rng.integers(1, n + 1))
    radius = expected_radius(graph, k)
    geodesic = sf.place_seeds(graph, k).tolist()
    assert len(set(geodesic)) == k
    assert geodesic == reference.geodesic_seeds(graph, k)
    order = graph.ordered(1).order()
    assert sf.place_seeds(graph, k, init="curve").tolist() == reference.curve_seeds(graph, order, k)
    assert sf.place_seeds(graph, k, init="farthest").tolist() == reference.farthest_seeds(graph, k)
    flooded = sf.place_seeds(graph, k, init="flood").tolist()
    assert flooded == reference.flood_seeds(graph, radius)
    result = sf.segment_graph(graph, k)
    assert result.n_segments == k + result.n_unreached
    assert np.array_equal(np.unique(result.labels), np.arange(result.n_segments))


@pytest.mark.parametrize("seed", range(10))
def test_components_are_those_of_arcs_whichever_way_they_lead(seed):
    rng = np.random.default_rng(seed)
    graph = shapes.random_one_way_graph(200, int(rng.integers(50, 250)), seed)
    for n_labels in (1, 3):
        labels = rng.integers(0, n_labels, 200).astype(np.int32)
        components, n = sf._core.find_components(graph.offsets, graph.neighbors, labels)
        assert components.tolist() == reference.find_components(graph, labels)
        assert n == components.max() + 1
