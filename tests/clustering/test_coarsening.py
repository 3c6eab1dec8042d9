"""Coarse to fine: coarse cells, their arcs, and the loop on them and then on all cells."""

import loops
import numpy as np
import pytest
import reference
import shapes
from shapes import unit_graph

import superfacets as sf

THREADS = (1, 2, 3, 8)
INITS = ("geodesic", "curve", "farthest", "flood", "grid")


def weighted(mesh):
    graph = sf.build_face_graph(mesh)
    return graph.with_weights(sf.crease_weights(mesh, graph, 0.1 * graph.diagonal))


def specks(n=60, seed=1):
    """Return a sheet and separate specks of one to three triangles, in random order."""
    sheet = shapes.bumpy_sheet(24)
    parts = [
        sf.Mesh(0.01 * part.vertices + [2 + 0.1 * i, 0, 0], part.faces)
        for i, part in enumerate(shapes.strip(1 + i % 3) for i in range(n))
    ]
    mesh = shapes.together([sheet, *parts])
    order = np.random.default_rng(seed).permutation(mesh.n_faces)
    return sf.Mesh(mesh.vertices, mesh.faces[order])


GRAPHS = {
    "one cell": lambda: shapes.line_graph([]), "line": lambda: shapes.line_graph([1.0] * 40),
    "strip": lambda: unit_graph(shapes.strip(50)),
    "sheet": lambda: weighted(shapes.bumpy_sheet(60)), "fins": lambda: unit_graph(shapes.fins(9)),
    "slivers": lambda: weighted(shapes.slivers()), "specks": lambda: weighted(specks()),
    "random": lambda: shapes.random_graph(300, 900, seed=5, weight_values=[1.0, 2.0, 1000.0]),
    "dense": lambda: shapes.random_graph(60, 1500, seed=6),
}  # fmt: skip


@pytest.mark.parametrize("spacing", [1, 2, 4, 16, 5000])
@pytest.mark.parametrize("name", GRAPHS)
def test_coarse_cells_and_their_arcs_equal_their_twins(name, spacing):
    graph = GRAPHS[name]()
    ordered = graph.ordered(1)
    order = ordered.order()
    centers, coarse_of, lengths = reference.coarse_cells(graph, order, spacing)
    arcs = reference.coarse_arcs(graph, coarse_of, lengths)
    for n_threads in THREADS:
        coarse = sf._core.CoarseGraph(ordered, spacing, n_threads)
        assert coarse.centers().tolist() == centers
        assert coarse.coarse_cells(n_threads).tolist() == coarse_of
        offsets, neighbors, steps = coarse.arcs()
        origin = np.repeat(np.arange(len(centers)), np.diff(offsets))
        assert dict(zip(zip(origin, neighbors, strict=True), steps, strict=True)) == arcs
        assert len(neighbors) == len(arcs)


@pytest.mark.parametrize("name", GRAPHS)
def test_coarse_cells_are_connected_and_no_arc_is_lost(name):
    graph = GRAPHS[name]()
    coarse = sf._core.CoarseGraph(graph.ordered(1), 8, 1)
    labels = coarse.coarse_cells(1)
    assert shapes.count_pieces(graph, labels) == coarse.graph.n_cells
    origin = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    touching = {
        (a, b) for a, b in zip(labels[origin], labels[graph.neighbors], strict=True) if a != b
    }
    offsets, neighbors, steps = coarse.arcs()
    origin = np.repeat(np.arange(coarse.graph.n_cells), np.diff(offsets))
    arcs = dict(zip(zip(origin, neighbors, strict=True), steps, strict=True))
    assert set(arcs) == touching
    assert all(arcs[b, a] == step for (a, b), step in arcs.items())


def test_a_line_in_groups_of_four_by_hand():
    """Cells 0 to 11 with steps of 1 form three coarse cells with the centers 1, 5 and 9."""
    line = shapes.line_graph([1.0] * 11, measures=[1.0] * 4 + [0.0] * 4 + [1.0, 1.0, 1.0, 3.0])
    coarse = sf._core.CoarseGraph(line.ordered(1), 4, 1)
    assert coarse.centers().tolist() == [1, 5, 9]
    assert coarse.coarse_cells(1).tolist() == [0] * 4 + [1] * 4 + [2] * 4
    offsets, neighbors, steps = coarse.arcs()
    assert offsets.tolist() == [0, 1, 3, 4]
    assert neighbors.tolist() == [1, 0, 2, 1]
    assert (steps * line.unit).tolist() == [4.0] * 4
    positions = coarse.graph.positions_of(np.arange(3, dtype=np.int32))
    assert positions[:, 0].tolist() == [1.5, 5.5, (8 + 9 + 10 + 3 * 11) / 6]
    assert coarse.graph.measures().sum() == line.measures.sum()


def test_a_coarse_center_is_refined_to_the_cell_nearest_to_the_mean():
    line = shapes.line_graph([1.0] * 11, measures=[1.0] * 8 + [1.0, 1.0, 1.0, 9.0])
    coarse = sf._core.CoarseGraph(line.ordered(1), 4, 1)
    labels = np.array([0, 0, 1], dtype=np.int32)
    centers = coarse.refine(labels, np.array([0, 2], dtype=np.int32), 1)
    assert centers.tolist() == [3, 10]  # means at 3.5 and 10.5, the lowest cell among equals


def test_islands_survive_every_level():
    mesh = specks()
    ordered = unit_graph(mesh).ordered(1)
    pieces = shapes.count_pieces(sf.build_face_graph(mesh), np.zeros(mesh.n_faces, np.int32))
    sizes = []
    for _ in range(4):
        coarse = sf._core.CoarseGraph(ordered, 16, 1)
        assert coarse.graph.n_cells >= pieces
        ordered = coarse.graph
        sizes.append(ordered.n_cells)
    assert sizes[-1] == sizes[-2] == pieces


def check_classification(graph, result):
    labels, centers = reference.classify_exact(graph, result.centers.tolist())
    assert result.centers.tolist() == centers
    assert result.labels.tolist() == labels


@pytest.mark.parametrize("init", INITS)
@pytest.mark.parametrize("name", ["line", "sheet", "random", "specks"])
def test_labels_are_the_classification_of_the_centers_on_any_number_of_threads(name, init):
    graph = shapes.line_graph([1.0] * 400) if name == "line" else GRAPHS[name]()
    result = sf.segment_graph(graph, 2, init=init, n_threads=1)
    assert len(result.levels) > 1
    assert result.levels[-1].n_cells == graph.n_cells
    assert result.levels[-1].n_iter == 1
    assert result.n_iter == sum(level.n_iter for level in result.levels)
    check_classification(graph, result)
    for n_threads in THREADS[1:]:
        other = sf.segment_graph(graph, 2, init=init, n_threads=n_threads)
        assert np.array_equal(other.labels, result.labels)
        assert np.array_equal(other.centers, result.centers)


def test_k_regions_where_components_are_many():
    mesh = specks()
    result = sf.segment(mesh, 3, islands="nearest", smooth=False)
    assert len(result.levels) > 1
    assert (result.n_segments, result.n_unreached) == (3, 60)
    with pytest.warns(UserWarning, match="components"):
        kept = sf.segment(mesh, 3, smooth=False)
    assert (kept.n_segments, kept.n_unreached) == (63, 60)


def test_cells_of_islands_do_not_count_as_those_of_regions():
    """Despite 9,000 faces in specks, 100 regions on a sheet of 1,152 faces need only one level."""
    mesh = specks(4500)
    options = {"weights": "creases", "islands": "nearest", "smooth": False}
    result = sf.segment(mesh, 100, **options)
    assert (result.n_segments, result.n_unreached) == (100, 4500)
    assert len(result.levels) == 1
    assert len(sf.segment(mesh, 4, **options).levels) > 1


@pytest.mark.parametrize("options", [
    {"paper": True}, {"tol": 0}, {"max_num_iter": 1}, {"radius_factor": 3.0},
    {"init": [0, 700, 1400]},
])  # fmt: skip
def test_some_options_keep_the_loop_on_all_faces(options):
    mesh = shapes.bumpy_sheet(60)
    result = loops.segment(mesh, None if "init" in options else 3, **options)
    assert [level.n_cells for level in result.levels] == [mesh.n_faces]
    assert result.levels[0].n_iter == result.n_iter
    assert result.levels[0].stop_reason == result.stop_reason


def test_arcs_that_lead_one_way_keep_the_loop_on_all_cells():
    graph = shapes.random_one_way_graph(600, 2000, seed=3)
    assert len(sf.segment_graph(graph, 2).levels) == 1


def test_regions_of_few_faces_keep_the_loop_on_all_faces():
    mesh = shapes.bumpy_sheet(60)
    assert [level.n_cells for level in sf.segment(mesh, 100).levels] == [mesh.n_faces]


def test_cells_that_are_all_alone_have_no_levels():
    cells = sf.CellGraph(np.arange(900.0).reshape(300, 3), np.ones(300), np.zeros(301, int), [], [])
    assert len(sf.segment_graph(cells, 1, islands="nearest").levels) == 1


def test_progress_counts_through_the_levels_and_ends_all_of_them():
    mesh = shapes.bumpy_sheet(130)
    for weights in ("creases", "parts"):
        told = []
        result = sf.segment(
            mesh, 4, weights=weights, callback=lambda *call, to=told: to.append(call)
        )
        told = [n_iter for _, n_iter, _ in told if n_iter]
        assert told == list(range(1, len(told) + 1))
        assert result.levels[-1].n_cells == mesh.n_faces
        n_spread = sum(level.n_cells == mesh.n_faces for level in result.levels)
        assert len(told) == result.n_iter - n_spread  # the last iteration only labels all faces
    cancelled = sf.segment(
        mesh, 4, weights="creases", callback=lambda *_: False, smooth=False, denoise=0
    )
    assert cancelled.stop_reason == "cancelled"
    assert {level.n_iter for level in cancelled.levels} == {1}
    check_classification(weighted_as_segmented(mesh, 4), cancelled)


def test_a_cancel_in_the_iteration_that_converges_is_a_cancel():
    mesh = shapes.bumpy_sheet(60)
    first = sf.segment(mesh, 4).levels[0].n_iter
    result = sf.segment(mesh, 4, callback=lambda stage, n_iter, n_moved: n_iter < first)
    assert result.stop_reason == "cancelled"
    assert {level.n_iter for level in result.levels[1:]} == {1}


def weighted_as_segmented(mesh, k):
    graph = sf.build_face_graph(mesh)
    radius = np.sqrt(graph.measures.sum() / (np.pi * k))
    return graph.with_weights(sf.crease_weights(mesh, graph, radius))


def test_the_loop_on_coarse_cells_ends_as_near_to_the_best_as_that_on_faces():
    """Their mean path lengths differ by less than between different seeds."""
    mesh = shapes.bumpy_sheet(60)
    graph = weighted_as_segmented(mesh, 12)
    coarse = sf.segment_graph(graph, 12)
    assert len(coarse.levels) > 1
    fine = sf.segment_graph(graph, init=sf.place_seeds(graph, 12))
    assert len(fine.levels) == 1

    def energy(result):
        clustering = sf._core.Clustering(
            graph.ordered(1), result.centers, np.inf, 1, sf._core.Islands.KEEP
        )
        return np.average(clustering.lengths().astype(float), weights=graph.measures)

    assert energy(coarse) < 1.05 * energy(fine)
