"""Compiled stages equal the reference implementation, bit for bit."""

import loops
import numpy as np
import pytest
import reference
import shapes
from models import read_off

from superfacets import Mesh, build_face_graph, classify, place_seeds, sample_mesh
from superfacets.base.options import CountOptions
from superfacets.clustering.update import update_centers
from superfacets.graph.size import region_size
from superfacets.paper import superfacet_weights

BEAR = sample_mesh(3000)
HEIGHTS = BEAR.vertices[BEAR.faces[:, 0], 2]
AWKWARD = {
    "strip": lambda: shapes.strip(9),
    "one face": lambda: shapes.strip(1),
    "cube": shapes.cube,
    "inside-out cube": shapes.inside_out_cube,
    "inside-out cube, and a sheet of two faces": lambda: shapes.together(
        [shapes.inside_out_cube(), Mesh([[3, 0, 0], [6, 0, 0], [3, 4, 0]], [[0, 1, 2], [2, 1, 0]])]
    ),
    "valley": lambda: shapes.fold(90),
    "ridge": lambda: shapes.fold(-90),
    "islands": shapes.two_islands,
    "moebius": shapes.moebius,
    "bowtie": shapes.bowtie,
    "fins": lambda: shapes.fins(5),
    "slivers": shapes.slivers,
    "soup": lambda: shapes.soup(shapes.cube()),
    "sheet": lambda: shapes.bumpy_sheet(12),
    "flipped faces": lambda: with_flipped_faces(shapes.bumpy_sheet(8)),
    "part of the sample": lambda: Mesh(BEAR.vertices, BEAR.faces[np.argsort(HEIGHTS)[:1500]]),
}


def size_of(graph, n_segments=None, radius=None, init="geodesic"):
    options = CountOptions.checked(n_segments, radius, init)
    return region_size(options, graph.measures, 1)


def with_flipped_faces(mesh):
    faces = mesh.faces.copy()
    turned = np.random.default_rng(2).uniform(size=len(faces)) < 0.3
    faces[turned] = faces[turned, ::-1]
    return Mesh(mesh.vertices, faces)


def check_mesh_stages(mesh, weld=True):
    """Check graph, measures, weights and lengths; return the weighted graph."""
    graph = build_face_graph(mesh, weld=weld)
    arcs = reference.build_face_graph(mesh, weld=weld)
    assert [arc.side for arc in arcs] == graph.sides.tolist()
    assert [arc.neighbor for arc in arcs] == graph.neighbors.tolist()
    assert [arc.same_turn for arc in arcs] == graph.same_turn.astype(bool).tolist()
    counts = np.bincount([arc.face for arc in arcs], minlength=mesh.n_faces)
    assert np.array_equal(counts, np.diff(graph.offsets))

    centroids, areas = reference.measure_faces(mesh)
    assert np.array_equal(centroids, graph.positions)
    assert np.array_equal(areas, graph.measures)

    weights = superfacet_weights(mesh, graph)
    expected = reference.superfacet_weights(mesh, arcs, alpha=200.0, eta_convex=0.2, weld=weld)
    assert np.array_equal(weights, expected)
    options = {"alpha": 20.0, "eta_convex": 0.1, "crease_length": 0.3}
    creases = reference.superfacet_weights(mesh, arcs, weld=weld, **options)
    assert np.array_equal(superfacet_weights(mesh, graph, **options), creases)
    cells = graph.with_weights(weights)
    lengths, unit = reference.quantize_weights(weights)
    assert unit == cells.unit
    assert np.array_equal(lengths, cells.lengths)
    return cells


def check_loop(graph, k, **options):
    """Check labels and centers of every iteration, and the stop reason."""
    radius = size_of(graph, k).radius
    seeds = place_seeds(graph, k).tolist()
    history, stop_reason = reference.iterate(graph, seeds, radius, **options)
    centers = seeds
    reach = options["radius_factor"] * radius if options.get("radius_factor") else None
    for expected_labels, expected_centers in history:
        labels, centers, _ = classify(graph, centers, reach=reach)
        assert labels.tolist() == expected_labels
        assert centers.tolist() == expected_centers
        centers = update_centers(graph, labels)
    result = loops.segment_graph(graph, init=seeds, **options)  # without coarse levels
    assert (result.n_iter, result.stop_reason) == (len(history), stop_reason)
    assert result.labels.tolist() == history[-1][0]
    assert result.centers.tolist() == history[-1][1]


def curve_seeds(graph, k):
    return reference.curve_seeds(graph, graph.ordered(1).order(), k)


@pytest.mark.parametrize("name", AWKWARD)
def test_stages_of_awkward_meshes_equal_their_twins(name):
    mesh = AWKWARD[name]()
    check_mesh_stages(mesh, weld=False)
    graph = check_mesh_stages(mesh)
    for k in {1, min(7, mesh.n_faces), min(150, mesh.n_faces)}:
        farthest = place_seeds(graph, k, init="farthest").tolist()
        assert farthest == reference.farthest_seeds(graph, k)
        radius = size_of(graph, k).radius
        few = min(k, 20)
        geodesic = place_seeds(graph, few, init="geodesic").tolist()
        assert geodesic == reference.geodesic_seeds(graph, few)
        assert curve_seeds(graph, few) == place_seeds(graph, few, init="curve").tolist()
        flooded = reference.flood_seeds(graph, radius)
        assert place_seeds(graph, k, init="flood").tolist() == flooded
        assert place_seeds(graph, k, init="grid").tolist() == reference.grid_seeds(graph, radius)
        check_loop(graph, k)
        check_loop(graph, k, radius_factor=2.0, tol=0.0)
        check_loop(graph, k, radius_factor=0.5, max_num_iter=5)


@pytest.mark.parametrize("seed", range(30))
def test_loops_on_random_graphs_with_ties_equal_their_twins(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 120))
    n_edges = int(rng.integers(0, 3 * n))
    values = None if seed % 3 == 0 else [0.0, 1.0, 2.0][: 1 + seed % 3]
    graph = shapes.random_graph(n, n_edges, seed, weight_values=values)
    k = int(rng.integers(1, n + 1))
    check_loop(graph, k, tol=0.0)
    check_loop(graph, k, radius_factor=float(rng.uniform(0.1, 2)), tol=0.0)
    assert place_seeds(graph, k, init="geodesic").tolist() == reference.geodesic_seeds(graph, k)
    assert place_seeds(graph, k, init="curve").tolist() == curve_seeds(graph, k)
    assert place_seeds(graph, k, init="flood").tolist() == reference.flood_seeds(
        graph, size_of(graph, k).radius
    )


@pytest.mark.parametrize("place", [0, 9])
def test_real_models_equal_the_twins_through_all_iterations(benchmark_paths, place):
    """Only small models are used, because the reference is slow."""
    graph = check_mesh_stages(read_off(benchmark_paths[place]))
    farthest = place_seeds(graph, 150, init="farthest").tolist()
    assert farthest == reference.farthest_seeds(graph, 150)
    if place < 3:
        geodesic = place_seeds(graph, 9, init="geodesic").tolist()
        assert geodesic == reference.geodesic_seeds(graph, 9)
        assert place_seeds(graph, 99, init="curve").tolist() == curve_seeds(graph, 99)
    radius = size_of(graph, 150).radius
    assert place_seeds(graph, 150, init="flood").tolist() == reference.flood_seeds(graph, radius)
    assert place_seeds(graph, 150, init="grid").tolist() == reference.grid_seeds(graph, radius)
    check_loop(graph, 150)
    # The reference of the halted mode takes a second per iteration: only one model runs to the end.
    check_loop(graph, 150, radius_factor=2.0, tol=0.0, max_num_iter=50 if place == 0 else 8)
