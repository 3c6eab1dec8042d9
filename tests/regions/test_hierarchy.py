"""Stage 5: nested levels of regions."""

import pickle

import numpy as np
import pytest
import reference
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.graph.surface import arc_measures
from superfacets_formats import build_tet_graph


def check_levels(nested, graph=None):
    """Check that levels have their counts, number regions in order, and are joined by parents."""
    for labels, count in zip(nested.levels, nested.counts, strict=True):
        assert labels.dtype == np.int32
        assert np.array_equal(np.unique(labels[labels >= 0]), np.arange(count))
        of_first = nested.finest[[np.argmax(labels == region) for region in range(count)]]
        lowest = [nested.finest[labels == region].min() for region in range(count)]
        assert sorted(lowest) == lowest
        assert (of_first >= lowest).all()
        if graph is not None:
            assert shapes.count_pieces(graph, labels) == count
    pairs = zip(nested.parents, nested.levels, nested.levels[1:], strict=False)
    for parents, fine, coarse in pairs:
        kept = fine >= 0
        assert np.array_equal(parents[fine[kept]], coarse[kept])


def test_squares_in_a_row_merge_in_pairs():
    nested = sf.hierarchy(shapes.row(0, 0, 0), [4, 3, 2, 1], labels=range(4))
    assert nested.children.tolist() == [[0, 1], [2, 3], [4, 5]]
    # a b / (a + b) |p - q| / L: 1/2 1, 1/2 1, 4/4 2
    assert nested.costs == pytest.approx([0.5, 0.5, 2.0], rel=1e-12)
    expected = [[0, 1, 2, 3], [0, 0, 1, 2], [0, 0, 1, 1], [0, 0, 0, 0]]
    assert [labels.tolist() for labels in nested.levels] == expected
    assert [parents.tolist() for parents in nested.parents] == [[0, 0, 1, 2], [0, 1, 1], [0, 0]]
    assert (nested.n_finest, nested.n_fewest, nested.segmentation) == (4, 1, None)
    assert repr(nested) == "Hierarchy(4 cells, 4 regions, levels of 4, 3, 2, 1)"


def test_regions_are_numbered_by_their_lowest_region():
    nested = sf.hierarchy(shapes.row(0, 0, 0), [2], labels=[3, 2, 1, 0])
    assert nested.children.tolist() == [[0, 1], [2, 3], [4, 5]]
    assert nested.cut(2).tolist() == [1, 1, 0, 0]


@pytest.mark.parametrize(("angle", "exponent"), [(90, 10), (-90, 3.5)])
def test_a_groove_or_a_ridge_between_flat_faces_is_merged_across_last(angle, exponent):
    nested = sf.hierarchy(shapes.row(angle, 0), [2], labels=range(3))
    assert nested.children.tolist() == [[1, 2], [0, 3]]
    # A turn by pi / 2 adds 20 r / 2 to the path, so a share of e^(-10 / 1.6) of the border is open.
    # A turn at a ridge costs 0.35 times as much.
    apart = np.hypot(0.5, 1.0) + 12 * np.sqrt(3 / np.pi) * (1 - np.exp(-exponent / 1.6))
    assert nested.costs == pytest.approx([0.5, 2 / 3 * apart], rel=1e-6)


def test_a_blunt_ridge_counts_as_smooth():
    nested = sf.hierarchy(shapes.row(-30, 0), [2], labels=range(3))
    assert nested.children[0].tolist() == [0, 1]  # nearer in space
    apart = np.hypot(0.5 + 0.5 * np.cos(np.pi / 6), 0.5 * np.sin(np.pi / 6))
    assert nested.costs[0] == pytest.approx(0.5 * apart)


def test_features_decide_what_merges():
    features = np.array([0.0, 10.0, 10.5, 20.0])
    nested = sf.hierarchy(shapes.row(0, 0, 0), [2], labels=range(4), features=features)
    assert nested.children.tolist() == [[1, 2], [3, 4], [0, 5]]
    mean = (10.0 + 10.5 + 20.0) / 3
    expected = [0.5 * 0.5**2, 2 / 3 * (20 - 10.25) ** 2, 3 / 4 * mean**2]
    assert nested.costs * features.var() == pytest.approx(expected)  # scaled by their deviation


def test_where_features_are_equal_geometry_decides():
    mesh = shapes.row(90, 0, 0)
    alike = sf.hierarchy(mesh, [1], labels=range(4), features=np.full(4, 0.1))
    assert alike.children.tolist() == sf.hierarchy(mesh, [1], labels=range(4)).children.tolist()
    assert alike.costs.tolist() == [0.0] * 3


def test_features_of_vertices_and_of_segment_are_used():
    mesh = shapes.bumpy_sheet(12)
    height = mesh.vertices[:, 0]
    nested = sf.hierarchy(mesh, [20, 4], features=height)
    expected = sf.segment(mesh, 20, features=height)
    assert np.array_equal(nested.segmentation.labels, expected.labels)
    check_levels(nested, sf.build_face_graph(mesh))
    assert not np.array_equal(nested.cut(4), sf.hierarchy(mesh, [4], labels=expected.labels).cut(4))


def test_features_may_be_names(tmp_path):
    rng = np.random.default_rng(0)
    cloud = sf.PointCloud(rng.uniform(size=(600, 3)) * [3, 2, 0.1], rng.normal(size=(600, 3)))
    by_name = sf.hierarchy(cloud, [20, 4], features=["normals", "height"])
    columns = np.concatenate([cloud.normals, cloud.points[:, 2:]], axis=1)
    by_value = sf.hierarchy(cloud, [20, 4], features=columns)
    assert np.array_equal(by_name.levels, by_value.levels)
    assert by_name.costs == pytest.approx(by_value.costs)
    path = tmp_path / "cloud.ply"
    sf.write_mesh(path, cloud, attributes=sf.MeshAttributes(vertex={"heat": cloud.points[:, 0]}))
    by_property = sf.hierarchy(path, [20, 4], features="heat")
    expected = sf.hierarchy(cloud, [20, 4], features=cloud.points[:, 0])
    assert np.array_equal(by_property.levels, expected.levels)
    with pytest.raises(sf.MeshError, match="features heat: the cloud has no property heat"):
        sf.hierarchy(cloud, [20, 4], features="heat")


@pytest.mark.parametrize("features", [False, True])
@pytest.mark.parametrize("dimension", [2, 3])
def test_merges_are_those_of_the_twin(features, dimension):
    rng = np.random.default_rng(dimension)
    for n in (1, 2, 7, 40, 90):
        areas = rng.integers(0, 4, n) / 2.0
        positions = rng.integers(0, 3, (n, 3)) / 1.0  # whole numbers, so that there are ties
        table = rng.integers(0, 3, (n, 2)) / 1.0
        pairs = sorted({tuple(sorted(pair)) for pair in rng.integers(0, n, (2 * n, 2)).tolist()})
        borders = {}
        for low, high in pairs:
            length = float(rng.integers(0, 3))
            if low < high:
                borders[low, high] = (length, length * float(rng.integers(0, 3)) / 2.0)
        expected = reference.merge_tree(
            areas.tolist(), list(positions), list(table) if features else None, borders,
            crease_weight=1.5, dimension=dimension,
        )  # fmt: skip
        ends = np.array(list(borders), np.int32).reshape(-1, 2).T
        measured = np.array(list(borders.values()), float).reshape(-1, 2).T
        children, costs = _core.merge_tree(
            areas, positions, table.ravel() if features else np.empty(0),
            *np.ascontiguousarray(ends), *np.ascontiguousarray(measured), 1.5, dimension,
        )  # fmt: skip
        assert children.reshape(-1, 2).tolist() == [list(pair) for pair in expected[0]]
        assert costs.tolist() == expected[1]


def test_a_region_with_many_neighbors_merges_like_the_twin():
    """Neighbors of the region get new costs at each merge, so the queue is rebuilt now and then."""
    rng = np.random.default_rng(5)
    n = 70
    areas, positions = rng.uniform(1, 2, n), rng.normal(size=(n, 3))
    lengths = rng.uniform(1, 2, n - 1)
    expected = reference.merge_tree(
        areas.tolist(), list(positions), None,
        {(0, i + 1): (length, 0.5 * length) for i, length in enumerate(lengths.tolist())},
        crease_weight=6.0, dimension=2,
    )  # fmt: skip
    ends = np.zeros(n - 1, np.int32), np.arange(1, n, dtype=np.int32)
    children, costs = _core.merge_tree(
        areas, positions, np.empty(0), *ends, lengths, 0.5 * lengths, 6.0, 2
    )
    assert children.reshape(-1, 2).tolist() == [list(pair) for pair in expected[0]]
    assert costs.tolist() == expected[1]


def test_bridges_are_those_of_the_twin():
    rng = np.random.default_rng(3)
    for n, n_ranks in ((2, 2), (60, 5), (400, 30)):
        positions = rng.integers(0, 8, (n, 3)) / 1.0
        ranks = np.concatenate([np.arange(n_ranks), rng.integers(0, n_ranks, n - n_ranks)])
        rng.shuffle(ranks)
        placed = _core.PlacedCells(positions, np.ones(n), 2)
        found = _core.find_bridges(placed, ranks.astype(np.int32), n_ranks)
        expected = reference.find_bridges(positions, ranks.tolist())
        assert np.transpose(found).tolist() == [list(pair) for pair in expected]


KINDS = {
    "triangles": lambda: shapes.bumpy_sheet(16), "closed": shapes.dumbbell,
    "polygons": lambda: shapes.row(*[0, 60] * 20),
    "points": lambda: sf.PointCloud(np.random.default_rng(0).uniform(size=(800, 3)) * [1, 1, 0]),
    "tets": lambda: shapes.column(30), "non-manifold": lambda: shapes.fins(24),
}  # fmt: skip


@pytest.mark.parametrize("name", KINDS)
def test_levels_of_all_kinds_of_cells_are_nested_connected_and_exact(name):
    cells = KINDS[name]()
    if isinstance(cells, sf.PointCloud):
        graph = sf.build_point_graph(cells)
    else:
        build = build_tet_graph if isinstance(cells, sf.TetMesh) else sf.build_face_graph
        graph = build(cells)
    n = min(24, graph.n_cells)
    nested = sf.hierarchy(cells, [n // 8, n, n // 3])
    assert nested.counts == (n, n // 3, n // 8)
    check_levels(nested, graph)


def test_a_graph_with_measures_gives_the_levels_of_its_mesh():
    mesh = shapes.bumpy_sheet(10)
    faces = sf.build_face_graph(mesh)
    labels = sf.segment(mesh, 15).labels
    weights = sf.crease_weights(mesh, faces, np.sqrt(faces.measures.sum() / (np.pi * 15)))
    graph = sf.CellGraph(
        faces.positions, faces.measures, faces.offsets, faces.neighbors, weights, faces.bounds,
        weight_unit=faces.diagonal, arc_measures=arc_measures(mesh, faces),
    )  # fmt: skip
    one, other = (sf.hierarchy(source, [5], labels=labels) for source in (mesh, graph))
    assert np.array_equal(one.children, other.children)
    nested = sf.hierarchy(graph, [6, 2], init="farthest")
    assert np.array_equal(nested.finest, sf.segment_graph(graph, 6, init="farthest").labels)
    check_levels(nested, faces)


def test_levels_do_not_depend_on_threads_nor_on_each_other():
    mesh = shapes.bumpy_sheet(40)
    one = sf.hierarchy(mesh, [60, 11], n_threads=1)
    two = sf.hierarchy(mesh, [60, 30, 11, 4], n_threads=2)
    assert np.array_equal(one.children, two.children)
    assert np.array_equal(one.costs, two.costs)
    assert np.array_equal(one.levels[1], two.levels[2])
    assert np.array_equal(one.levels[0], sf.segment(mesh, 60).labels)


def test_levels_do_not_depend_on_where_a_mesh_is_and_how_large():
    mesh = shapes.bumpy_sheet(12)
    labels = sf.segment(mesh, 30).labels
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    moved = sf.Mesh(7.0 * mesh.vertices @ (turn * np.linalg.det(turn)) + 5.0, mesh.faces)
    one, other = (sf.hierarchy(source, [3], labels=labels) for source in (mesh, moved))
    assert np.array_equal(one.children, other.children)
    assert other.costs == pytest.approx(7.0**2 * one.costs)


@pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")
def test_merging_stops_at_the_number_of_components():
    mesh = shapes.gears(12)
    graph = sf.build_face_graph(mesh)
    nested = sf.hierarchy(mesh, [40, 12])  # no more components than 12: no IslandWarning
    assert nested.n_fewest == shapes.count_pieces(graph, np.zeros(graph.n_cells, np.int32)) == 12
    check_levels(nested, graph)
    with pytest.raises(
        ValueError,
        match="each number in counts must be at least 12 because merging stops if no"
        " regions are neighbors, got 3",
    ):
        sf.hierarchy(mesh, [40, 3])
    with pytest.raises(
        ValueError,
        match="n must be at least 12 because merging stops if no regions are neighbors, got 11:"
        " without barriers, islands='nearest' also merges across gaps",
    ):
        nested.cut(11)


@pytest.mark.filterwarnings("ignore::superfacets.SliverWarning")
def test_gaps_are_merged_across_where_that_is_asked_for():
    mesh = shapes.gears(12)
    nested = sf.hierarchy(mesh, [40, 12, 3, 1], islands="nearest")
    check_levels(nested)
    assert nested.n_fewest == 1
    small = sf.hierarchy(mesh, [5, 1], islands="nearest")  # fewer than there are components
    assert (small.n_finest, small.n_fewest) == (5, 1)


def test_a_gap_leads_to_the_nearest_cell_of_a_larger_component():
    def patch(x, size):
        return sf.Mesh([[x, 0, 0], [x + size, 0, 0], [x, size, 0]], [[0, 1, 2]])

    mesh = shapes.together([patch(0, 3), patch(4, 1), patch(9, 4), patch(6, 0.5)])
    nested = sf.hierarchy(mesh, [1], labels=range(4), islands="nearest")
    # From the smallest: 3 joins 1, which is nearest, 1 joins 0, and 0 joins 2.
    assert sorted(map(tuple, nested.children.tolist())) == [(0, 4), (1, 3), (2, 5)]


def test_regions_without_area_merge_first():
    nested = sf.hierarchy(shapes.slivers(), [1], labels=range(4), islands="nearest")
    assert nested.n_fewest == 1
    assert np.isfinite(nested.costs).all()
    line = sf.Mesh([[x, 0, 0] for x in range(4)], [[0, 1, 2], [1, 2, 3]])
    assert sf.hierarchy(line, [2, 1], labels=[0, 1]).costs.tolist() == [0.0]


def test_cells_left_out_stay_out():
    nested = sf.hierarchy(shapes.row(0, 0, 0, 0), [3, 2], labels=[0, 1, -1, -1, 2])
    assert nested.n_fewest == 2
    assert nested.cut(2).tolist() == [0, 0, -1, -1, 1]
    check_levels(nested)
    joined = sf.hierarchy(shapes.row(0, 0, 0, 0), [1], labels=[0, 1, -1, -1, 2], islands="nearest")
    assert joined.cut(1).tolist() == [0, 0, -1, -1, 0]


def sides_and_edges(mesh):
    """Return 0 or 1 for each face of a mesh, and the edges between faces that differ."""
    graph = sf.build_face_graph(mesh)
    left = (graph.positions[:, 0] < np.median(graph.positions[:, 0])).astype(int)
    source = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    differs = left[source] != left[graph.neighbors]
    face, side = source[differs], graph.sides[differs]
    return left, np.stack([mesh.faces[face, side], mesh.faces[face, (side + 1) % 3]], axis=1)


@pytest.mark.parametrize("are_edges", [False, True])
def test_regions_never_merge_across_barriers(are_edges):
    mesh = shapes.bumpy_sheet(16)
    left, edges = sides_and_edges(mesh)
    barriers = edges if are_edges else left
    nested = sf.hierarchy(mesh, [30, 9, 2], barriers=barriers)
    assert nested.n_fewest == 2
    for labels in nested.levels:
        pairs = np.unique(np.stack([labels, left]), axis=1)
        assert pairs.shape[1] == labels.max() + 1
    again = sf.hierarchy(mesh, [9, 2], labels=nested.finest, barriers=barriers)
    assert np.array_equal(again.children, nested.children)
    graph = sf.build_face_graph(mesh)
    mask = graph.positions[:, 1] < np.median(graph.positions[:, 1])
    part = sf.hierarchy(mesh, [20, 2], barriers=barriers, mask=mask)
    check_levels(part)
    assert np.array_equal(part.cut(2) >= 0, mask)
    with pytest.raises(
        ValueError,
        match="labels must not cross barriers: region 0 has cells on both sides of a barrier",
    ):
        sf.hierarchy(mesh, [1], labels=np.zeros(mesh.n_faces, int), barriers=barriers)
    with pytest.raises(
        ValueError,
        match="each number in counts must be at least 2 because merging stops if no"
        " regions are neighbors, got 1",
    ):
        sf.hierarchy(mesh, [9, 1], barriers=barriers)
    with pytest.raises(
        ValueError,
        match="islands='nearest' cannot be combined with barriers, because a merge across"
        " a gap could bypass a barrier: leave one of them out",
    ):
        sf.hierarchy(mesh, [9], barriers=barriers, islands="nearest")


def test_a_graph_has_barriers_too():
    graph = sf.CellGraph(
        [[x, 0, 0] for x in range(5)], [1] * 5, [0, 1, 3, 5, 7, 8], [1, 0, 2, 1, 3, 2, 4, 3],
        [1] * 8, arc_measures=sf.ArcMeasures([1] * 8),
    )  # fmt: skip
    nested = sf.hierarchy(graph, [2], labels=range(5), barriers=[0, 0, 0, 7, 7])
    assert nested.cut(2).tolist() == [0, 0, 0, 1, 1]


def test_a_hierarchy_can_be_copied():
    nested = sf.hierarchy(shapes.row(0, 0, 0), [3, 2], labels=range(4))
    copied = pickle.loads(pickle.dumps(nested))
    assert copied.cut(2).tolist() == nested.cut(2).tolist()
    assert (copied.counts, copied.n_fewest) == ((3, 2), 1)


@pytest.mark.parametrize(("counts", "options", "error", "message"), [
    (3, {}, TypeError, "counts must be a sequence of numbers of regions, got 3"),
    ("3", {}, TypeError, "counts must be a sequence of numbers of regions, got '3'"),
    ([], {}, ValueError, "counts must contain at least one number of regions, but it is empty"),
    ([2, 3, 2], {}, ValueError,
     "counts must contain distinct numbers, but 2 occurs repeatedly"),
    ([0], {}, ValueError, "each number in counts must be at least 1, got 0"),
    ([1.5], {}, TypeError, "each number in counts must be an integer, got 1.5"),
    ([5], {"labels": [0, 0, 1, 1]}, ValueError,
     "each number in counts must be at most 2, the number of regions on the finest level, got 5"),
    ([9], {}, ValueError, "n_segments must be at most 4, the number of faces, got 9"),
    ([2], {"islands": "join"}, ValueError, "islands must be one of keep, nearest, got 'join'"),
    ([2], {"labels": [-1] * 4}, ValueError,
     "labels must contain at least one region, but all labels are -1"),
    ([2], {"labels": [0, 1, 3, 3]}, ValueError, "no cell has label 2"),
    ([2], {"labels": [0, 1, -2, 1]}, ValueError,
     r"labels\[2\] must be -1 to 3 for 4 cells, got -2"),
    ([2], {"labels": [0, 1]}, ValueError,
     r"labels must have one value per cell \(4\), got 2 values"),
    ([2], {"labels": [0, 0, 1, 1], "tol": 0.1}, TypeError,
     "tol would have no effect because labels are given: leave out either labels or these"
     " options"),
    ([2], {"features": [1, 2]}, ValueError,
     r"features must have one row per cell \(4\) or per vertex \(10\), got 2 rows"),
])  # fmt: skip
def test_wrong_arguments_are_named(counts, options, error, message):
    with pytest.raises(error, match=message):
        sf.hierarchy(shapes.row(0, 0, 0), counts, **options)
    with pytest.raises(
        ValueError, match="n must be at most 4, the number of regions on the finest level, got 5"
    ):
        sf.hierarchy(shapes.row(0, 0, 0), [2], labels=range(4)).cut(5)
