"""Stage 3: seeds on small graphs, and invalid arguments."""

import math

import numpy as np
import pytest
import shapes

from superfacets import CellGraph, Mesh, _core, build_face_graph, place_seeds
from superfacets.base.options import CountOptions
from superfacets.graph.size import region_size
from superfacets.paper import superfacet_weights


def size_of(graph, n_segments=None, radius=None, init="geodesic"):
    options = CountOptions.checked(n_segments, radius, init)
    return region_size(options, graph.measures, 1)


def graph_of(mesh):
    graph = build_face_graph(mesh)
    return graph.with_weights(superfacet_weights(mesh, graph))


def test_farthest_takes_the_middle_then_the_ends():
    line = shapes.line_graph([1.0] * 8)
    assert place_seeds(line, 5).tolist() == [4, 0, 8, 2, 6]  # ties go to the lower cell


def test_farthest_gives_distinct_cells_up_to_all_of_them():
    graph = graph_of(shapes.bumpy_sheet(12))
    assert sorted(place_seeds(graph, graph.n_cells).tolist()) == list(range(graph.n_cells))


def test_farthest_takes_each_of_many_coincident_cells_once():
    n = 100
    graph = CellGraph(np.zeros((n, 3)), np.ones(n), np.zeros(n + 1, int), np.zeros(0, int), [])
    assert place_seeds(graph, n).tolist() == list(range(n))


def test_farthest_equals_the_naive_way_on_thousands_of_cells():
    rng = np.random.default_rng(5)
    positions = np.round(rng.uniform(0, 1, (5000, 3)), 2)  # many equal distances
    graph = CellGraph(positions, np.ones(5000), np.zeros(5001, int), np.zeros(0, int), [])
    seeds = place_seeds(graph, 400, init="farthest")
    expected = [int(seeds[0])]
    squared = np.full(5000, np.inf)
    while len(expected) < 400:
        step = positions - positions[expected[-1]]
        squared = np.minimum(squared, step[:, 0] ** 2 + step[:, 1] ** 2 + step[:, 2] ** 2)
        squared[expected[-1]] = -1
        expected.append(int(np.argmax(squared)))
    assert seeds.tolist() == expected


def test_geodesic_equals_the_naive_way_on_a_grid_of_thousands_of_cells():
    """Steps of 1 along the axes give path lengths of |dx| + |dy|, and many ties."""
    n_rows, n_columns = 90, 70
    order = np.random.default_rng(2).permutation(n_rows * n_columns)  # cell index by grid place
    cells = order.reshape(n_rows, n_columns)
    pairs = np.concatenate([
        np.stack([cells[:-1].ravel(), cells[1:].ravel()], axis=1),
        np.stack([cells[:, :-1].ravel(), cells[:, 1:].ravel()], axis=1),
    ])  # fmt: skip
    arcs = np.concatenate([pairs, pairs[:, ::-1]])
    arcs = arcs[np.lexsort((arcs[:, 1], arcs[:, 0]))]
    xy = np.empty((cells.size, 3))
    xy[order] = np.stack(np.divmod(np.arange(cells.size), n_columns), axis=1) @ np.eye(2, 3)
    offsets = np.concatenate([[0], np.cumsum(np.bincount(arcs[:, 0]))])
    graph = CellGraph(xy, np.ones(cells.size), offsets, arcs[:, 1], np.ones(len(arcs)))
    seeds = place_seeds(graph, 300, init="geodesic").tolist()
    lengths = np.full(cells.size, np.inf)
    expected = seeds[:1]
    while len(expected) < 300:
        lengths = np.minimum(lengths, np.abs(xy - xy[expected[-1]]).sum(axis=1))
        expected.append(int(np.argmax(lengths)))
    assert seeds == expected


def test_the_first_seed_is_nearest_to_the_centroid_by_area():
    line = shapes.line_graph([1.0] * 4, measures=[1, 0, 0, 0, 9])
    assert place_seeds(line, 1).tolist() == [4]  # the centroid is at 3.6


def test_without_any_area_the_plain_centroid_counts():
    line = shapes.line_graph([1.0] * 4, measures=[0] * 5)
    assert place_seeds(line, 2).tolist() == [2, 0]


def test_flood_starts_a_region_where_none_has_reached():
    # r = 0.5: regions expand through cells within 1, and label the cells at 2.
    line = shapes.line_graph([1.0] * 8)
    assert place_seeds(line, radius=0.5, init="flood").tolist() == [4, 1, 7]


def test_flood_visits_cells_in_the_order_of_their_path_length():
    line = shapes.line_graph([9.0, 9.0, 1.0, 1.0, 1.0, 1.0])
    assert place_seeds(line, radius=0.4, init="flood").tolist() == [3, 5, 1]


def test_flood_goes_on_in_every_component():
    graph = graph_of(shapes.two_islands())
    assert place_seeds(graph, radius=1, init="flood").tolist() == [1, 4]


def test_grid_takes_the_center_of_each_occupied_cube():
    line = shapes.line_graph([1.0] * 8)
    # Cubes of edge 3 from x = 0: cells 0 1 2, 3 4 5 and 6 7 8.
    assert place_seeds(line, radius=1.5, init="grid").tolist() == [1, 4, 7]


def test_grid_counts_from_the_corner_of_the_bounds():
    cells = CellGraph([[0.5, 0, 0], [1.5, 0, 0]], [1, 1], [0, 0, 0], [], [], [[0, 0, 0], [2, 0, 0]])
    assert place_seeds(cells, radius=1.0, init="grid").tolist() == [0]
    assert place_seeds(cells, radius=0.5, init="grid").tolist() == [0, 1]


def test_a_grid_of_unthinkably_small_cubes_gives_each_cell_its_own():
    graph = graph_of(shapes.cube())
    assert sorted(place_seeds(graph, radius=1e-30, init="grid").tolist()) == list(range(12))


def test_given_seeds_are_kept_in_their_order():
    seeds = place_seeds(shapes.line_graph([1.0] * 4), init=[3, 0])
    assert seeds.tolist() == [3, 0]
    assert seeds.dtype == np.int32


def test_region_size_is_that_of_disks_with_the_whole_area():
    line = shapes.line_graph([1.0] * 7)
    assert size_of(line, 2) == (2, math.sqrt(8 / (2 * math.pi)), 8.0)
    assert size_of(line, radius=0.7) == (5, 0.7, 8.0)
    assert size_of(line, radius=700) == (1, 700, 8.0)
    assert size_of(line, radius=1e-9).n_segments == 8
    assert size_of(line).n_segments == 8
    assert size_of(line, init=[1, 2]).n_segments == 2
    assert size_of(graph_of(shapes.bumpy_sheet(10))).n_segments == 150


@pytest.mark.parametrize(("arguments", "error", "message"), [
    ({"n_segments": 0}, ValueError, "n_segments must be at least 1, got 0"),
    ({"n_segments": -3}, ValueError, "n_segments must be at least 1, got -3"),
    ({"n_segments": 6}, ValueError, "n_segments must be at most 5, the number of cells, got 6"),
    ({"n_segments": 2.0}, TypeError, r"n_segments must be an integer, got 2\.0"),
    ({"n_segments": True}, TypeError, "n_segments must be an integer, got True"),
    ({"n_segments": 2, "radius": 0.1}, ValueError,
     "n_segments is 2 and radius is 0.1: give only one of them"),
    ({"radius": 0}, ValueError, "radius must be finite and positive, got 0"),
    ({"radius": math.inf}, ValueError, "radius must be finite and positive, got inf"),
    ({"radius": "wide"}, TypeError, "radius must be a number, got 'wide'"),
    ({"init": "random"}, ValueError,
     "init must be one of geodesic, curve, farthest, flood, grid, got 'random'"),
    ({"init": [0, 5]}, ValueError, r"init\[1\] must be 0 to 4, got 5"),
    ({"init": [-1]}, ValueError, r"init\[0\] must be 0 to 4, got -1"),
    ({"init": [1, 2, 1]}, ValueError,
     "but cell 1 occurs more than once; labels need a value per cell \\(5\\), not 3"),
    ({"init": []}, ValueError, "init must contain at least one cell, but it is empty"),
    ({"init": [0.5]}, TypeError, "init must contain integers, got float64"),
    ({"init": [[0]]}, ValueError, "init must be one-dimensional"),
    ({"init": [0], "n_segments": 2}, ValueError,
     "n_segments must be the number of seeds in init, 1, got 2: leave n_segments out"),
])  # fmt: skip
def test_wrong_arguments_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        place_seeds(shapes.line_graph([1.0] * 4), **arguments)


@pytest.mark.parametrize("init", ["flood", "grid"])
def test_a_radius_cannot_come_from_no_area(init):
    line = shapes.line_graph([1.0] * 4, measures=[0] * 5)
    with pytest.raises(
        ValueError, match=f"init='{init}' needs a radius above 0, but all cells have area 0"
    ):
        place_seeds(line, 2, init=init)


def test_geodesic_seeds_are_the_ends_of_the_longest_paths():
    """A row of cells has a long step between the second and the third cell."""
    graph = shapes.line_graph([1.0, 10.0, 1.0, 1.0])
    assert place_seeds(graph, 3, init="geodesic").tolist() == [2, 0, 4]


def test_curve_seeds_divide_a_line_equally_then_fill_its_gaps():
    """Three seeds are in the middles of thirds of ten cells, the others at ends of long paths."""
    line = shapes.line_graph([1.0] * 9)
    assert place_seeds(line, 5, init="curve").tolist() == [1, 5, 8, 3, 0]


def test_curve_seeds_are_denser_where_steps_are_long():
    line = shapes.line_graph([1.0] * 50 + [16.0] * 49)
    seeds = np.sort(place_seeds(line, 20, init="curve"))
    assert np.count_nonzero(seeds > 50) == 17  # 9 of the first 12, and all others


@pytest.mark.parametrize("find", [_core.geodesic_seeds, _core.curve_seeds])
def test_the_paths_of_seeds_are_those_of_their_classification(find):
    for mesh in (shapes.bumpy_sheet(60), shapes.two_islands()):
        cells = graph_of(mesh).ordered(1)
        seeds, paths = find(cells, 3, 4, 2)
        given = _core.Clustering(cells, seeds, math.inf, 2, paths=paths)
        expected = _core.Clustering(cells, seeds, math.inf, 1)
        assert np.array_equal(given.labels(), expected.labels())
        assert np.array_equal(given.lengths(), expected.lengths())
        assert np.array_equal(given.update(), expected.update())


@pytest.mark.parametrize("init", ["geodesic", "curve"])
def test_seeds_are_in_the_components_that_are_worth_a_region(init):
    mesh = shapes.two_islands()  # 4 faces and an area of 2 each
    speck = Mesh(
        np.concatenate([mesh.vertices, [[9, 9, 0], [9.1, 9, 0], [9, 9.1, 0]]]),
        np.concatenate([[[12, 13, 14]], mesh.faces]),
    )
    graph = build_face_graph(speck).with_weights(np.ones(12))
    for k in (2, 3, 8):
        seeds = place_seeds(graph, k, init=init)
        assert len(set(seeds.tolist())) == k
        assert 0 not in seeds  # the speck
        firsts = seeds[:2] if init == "geodesic" else seeds
        assert {*((firsts - 1) // 4).tolist()} == {0, 1}  # both islands
    assert set(place_seeds(graph, 9, init=init).tolist()) == set(range(9))
    assert place_seeds(graph, 1, init=init).tolist()[0] > 0


@pytest.mark.parametrize("init", ["geodesic", "curve"])
def test_seeds_of_soup_are_distinct(init):
    soup = Mesh([[x, y, z] for x in range(40) for y, z in ((0, 0), (1, 0), (0, 1))],
                np.arange(120).reshape(-1, 3))  # fmt: skip
    graph = build_face_graph(soup).with_weights([])
    for k in (1, 20, 40):
        assert len(set(place_seeds(graph, k, init=init).tolist())) == k


def test_islands_have_to_be_kept_or_join_the_nearest():
    with pytest.raises(ValueError, match="islands must be one of keep, nearest, got 'sink'"):
        place_seeds(shapes.line_graph([1.0]), 1, islands="sink")
