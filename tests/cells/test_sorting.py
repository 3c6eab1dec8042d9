"""Meshes in a bad order are sorted before segmentation, which changes only the time."""

import warnings

import loops
import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.graph import sorting
from superfacets.graph.kinds import kind_of
from superfacets.mesh.faces import corners_of


@pytest.fixture(autouse=True)
def few_cells_are_enough(limit):
    limit("cells that are sorted", 1_000)


def shuffled(mesh, seed=0):
    """Return the mesh with vertices and cells in random order."""
    rng = np.random.default_rng(seed)
    corners = corners_of(mesh)
    new_vertices, order = rng.permutation(mesh.n_vertices), rng.permutation(corners.n_cells)
    place = np.argsort(new_vertices).astype(np.int32)
    lists, offsets = corners.of(order)
    return kind_of(mesh).with_corners(mesh, mesh.vertices[new_vertices], place[lists], offsets)


def in_curve_order(mesh, weld=True):
    """Return the sorted mesh that is segmented instead, and the original index of each cell."""
    found = sorting.sorted_corners(mesh.vertices, corners_of(mesh), weld, 1)
    make = kind_of(mesh).with_corners
    return make(mesh, found.vertices, found.corners, found.offsets), found.order


def quads():
    squares = shapes.squares(40)
    x, y, _ = squares.vertices.T
    vertices = np.stack([x, y, 3 * np.sin(x / 5) * np.cos(y / 4)], axis=1)
    return sf.PolygonMesh(vertices, squares.offsets, squares.indices)


BEAR = shuffled(sf.sample_mesh(5_000))
MESHES = {
    "triangles": BEAR, "soup": shuffled(shapes.soup(sf.sample_mesh(5_000))),
    "polygons": shuffled(quads()), "tets": shuffled(shapes.block(18)),
}  # fmt: skip


@pytest.mark.parametrize("weld", [True, False])
@pytest.mark.parametrize("name", MESHES)
def test_sorted_cells_are_those_of_the_input_in_another_order(name, weld):
    mesh = MESHES[name]
    placed, order = in_curve_order(mesh, weld)
    assert np.array_equal(np.sort(order), np.arange(mesh.n_cells))
    before, _ = corners_of(mesh).of(order)
    assert np.array_equal(placed.vertices[corners_of(placed).vertices], mesh.vertices[before])
    assert np.array_equal(placed.bounds, mesh.bounds)


def test_vertices_are_sorted_by_code_and_cells_by_their_lowest_vertex():
    found = sorting.sorted_corners(BEAR.vertices, corners_of(BEAR), True, 1)
    low, high = BEAR.bounds
    steps = np.minimum(1023, (found.vertices - low) * (1024 / (high - low).max())).astype(int)
    bits = steps[:, :, None] >> np.arange(10) & 1
    codes = (bits << 3 * np.arange(10) << np.arange(3)[:, None]).sum(axis=(1, 2))
    assert np.all(np.diff(codes) >= 0)
    lowest = found.corners.reshape(-1, 3).min(axis=1)
    assert np.array_equal(np.lexsort([found.order, lowest]), np.arange(BEAR.n_faces))


def test_nothing_depends_on_the_number_of_threads():
    large = shuffled(sf.sample_mesh(60_000))
    one, many = (
        sorting.sorted_corners(large.vertices, corners_of(large), True, n_threads)
        for n_threads in (1, 7)
    )
    assert all(np.array_equal(a, b) for a, b in zip(one, many, strict=True))
    labels = [sf.segment(large, 90, n_threads=n_threads).labels for n_threads in (1, 2, 4)]
    assert np.array_equal(labels[0], labels[1])
    assert np.array_equal(labels[0], labels[2])


def test_welding_leaves_one_vertex_at_each_position():
    soup = MESHES["soup"]
    assert soup.n_vertices == 3 * soup.n_faces
    assert in_curve_order(soup)[0].n_vertices == sf.sample_mesh(5_000).n_vertices
    assert in_curve_order(soup, weld=False)[0].n_vertices == soup.n_vertices


def test_vertices_on_one_step_of_the_curve_are_apart_in_space():
    """Because of one distant vertex, all other vertices share a few steps of the curve."""
    bear = shuffled(sf.sample_mesh(60_000))
    far = sf.Mesh(np.append(bear.vertices, [[1e9, 0, 0]], axis=0), bear.faces)
    found = sorting.sorted_corners(far.vertices, corners_of(far), True, 1)
    assert sorting.far_steps(lambda some: found.vertices[some], far.n_vertices - 1) < 0.2


def test_far_steps_are_none_along_a_line_and_most_at_random():
    line = np.arange(30_000.0)[:, np.newaxis] * [1, 2, 3]
    anyhow = np.random.default_rng(0).permutation(line)
    in_pairs = np.random.default_rng(0).permutation(line.reshape(-1, 6)).reshape(-1, 3)
    shares = [sorting.far_steps(lambda i, p=p: p[i], 30_000) for p in (line, anyhow, in_pairs)]
    assert shares[0] == 0
    assert shares[1] > 0.85
    assert shares[2] == pytest.approx(shares[1] / 2, abs=0.07)


def test_cells_at_one_place_are_not_scattered():
    assert sorting.far_steps(lambda i: np.zeros((len(i), 3)), 5_000) == 0


@pytest.mark.parametrize("name", MESHES)
def test_a_bad_order_is_known_by_cells_or_by_vertices(name):
    mesh = MESHES[name]
    placed, _ = in_curve_order(mesh)
    corners = corners_of(placed)
    assert sorting.is_scattered(mesh.vertices, corners_of(mesh))
    assert not sorting.is_scattered(placed.vertices, corners)
    order = np.random.default_rng(1).permutation(placed.n_vertices)
    place = np.argsort(order).astype(np.int32)
    vertices_alone = type(corners)(place[corners.vertices], corners.size, corners.offsets)
    assert sorting.is_scattered(placed.vertices[order], vertices_alone)


def test_small_meshes_are_left_in_any_order(limit):
    limit("cells that are sorted", BEAR.n_faces + 1)
    assert not sorting.is_scattered(BEAR.vertices, corners_of(BEAR))


def test_the_order_of_the_samples_and_of_subdivided_meshes_is_good():
    bear = sf.sample_mesh(60_000)
    diagonal = np.linalg.norm(np.ptp(bear.bounds, axis=0))
    for mesh in (bear, sf.subdivide(bear, max_edge=diagonal / 500).mesh):
        assert not sorting.is_scattered(mesh.vertices, corners_of(mesh))


def numbers_of(mesh, placed):
    """Return, for each vertex of `placed`, the vertex of `mesh` at the same position."""
    found = np.empty(placed.n_vertices, int)
    found[np.lexsort(placed.vertices.T)] = np.lexsort(mesh.vertices.T)
    return found


PLACED, ORDER = in_curve_order(BEAR)
NUMBERS = numbers_of(BEAR, PLACED)
X = BEAR.vertices[BEAR.faces].mean(axis=1)[:, 0]
X = (X - X.min()) / (X.max() - X.min())
SEEDS = np.arange(0, BEAR.n_faces, 199)
EDGES = BEAR.faces[np.abs(X - 0.5) < 0.02][:, :2]

# Options of `segment` with indices of the input, and with indices of the sorted mesh.
GIVEN = {
    "defaults": ({"n_segments": 40},) * 2,
    "weights": ({"n_segments": 40, "weights": "superfacets", "smooth": False},) * 2,
    "farthest": ({"n_segments": 40, "init": "farthest", "tol": 0.0},) * 2,
    "features": ({"n_segments": 40, "features": sf.Features(X, 50.0)},
                 {"n_segments": 40, "features": sf.Features(X[ORDER], 50.0)}),
    "features of vertices": (
        {"n_segments": 40, "features": sf.Features(BEAR.vertices, 50.0)},
        {"n_segments": 40, "features": sf.Features(PLACED.vertices, 50.0)}),
    "mask": ({"n_segments": 40, "mask": X < 0.4, "islands": "nearest"},
             {"n_segments": 40, "mask": (X < 0.4)[ORDER], "islands": "nearest"}),
    "barriers": ({"n_segments": 40, "barriers": (5 * X).astype(int), "islands": "nearest"},
                 {"n_segments": 40, "barriers": (5 * X).astype(int)[ORDER], "islands": "nearest"}),
    "edges": ({"n_segments": 40, "barriers": EDGES},
              {"n_segments": 40, "barriers": np.argsort(NUMBERS)[EDGES]}),
    "seeds": ({"init": SEEDS}, {"init": np.argsort(ORDER)[SEEDS]}),
    "labels": ({"init": (30 * X).astype(int)}, {"init": (30 * X).astype(int)[ORDER]}),
    "seeds in a mask": (
        {"init": SEEDS[X[SEEDS] < 0.4], "mask": X < 0.4},
        {"init": np.argsort(ORDER)[SEEDS[X[SEEDS] < 0.4]], "mask": (X < 0.4)[ORDER]}),
}  # fmt: skip


@pytest.mark.parametrize("name", GIVEN)
def test_labels_are_those_of_the_sorted_mesh_put_back(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.IslandWarning)
        given, at_place = GIVEN[name]
        expected = sf.segment(PLACED, **at_place)
        for n_threads in (1, 3):
            result = sf.segment(BEAR, **given, n_threads=n_threads)
            assert np.array_equal(result.labels[ORDER], expected.labels)
            assert np.array_equal(result.centers, ORDER[expected.centers])
            assert result.cells is BEAR


@pytest.mark.parametrize("name", MESHES)
def test_cells_of_every_kind_get_the_labels_of_the_sorted_mesh(name):
    mesh = MESHES[name]
    placed, order = in_curve_order(mesh)
    result, expected = sf.segment(mesh, 30), sf.segment(placed, 30)
    assert np.array_equal(result.labels[order], expected.labels)
    assert np.array_equal(result.centers, order[expected.centers])


def test_a_segmentation_may_begin_another():
    first = sf.segment(BEAR, 40)
    again = sf.segment(BEAR, init=first, max_num_iter=0, smooth=False)
    assert np.array_equal(again.centers, first.centers)
    nearer = sf.segment(PLACED, init=np.argsort(ORDER)[first.centers], max_num_iter=0, smooth=False)
    assert np.array_equal(again.labels[ORDER], nearer.labels)


def test_facts_and_calls_are_those_of_the_sorted_mesh():
    calls = {"given": [], "sorted": []}
    results = {}
    for name, mesh in (("given", BEAR), ("sorted", PLACED)):
        take = calls[name].append
        results[name] = sf.segment(mesh, 40, callback=lambda *facts, take=take: take(facts))
    given, expected = results["given"], results["sorted"]
    assert calls["given"] == calls["sorted"]
    assert list(given.timings) == list(expected.timings)
    assert given.params == expected.params
    assert given.sliver_share == expected.sliver_share
    assert [level.n_cells for level in given.levels] == [level.n_cells for level in expected.levels]


def test_regions_and_levels_are_those_of_the_input():
    result = sf.segment(BEAR, 40)
    areas = _core.measure_faces(BEAR.vertices, BEAR.faces, 1)[1]
    assert np.allclose(result.regions.areas, np.bincount(result.labels, areas))
    nested = sf.hierarchy(BEAR, [40, 9])
    assert np.array_equal(nested.levels[0], result.labels)
    assert len(np.unique(nested.levels[1])) == 9


def test_regions_are_as_good_as_in_the_order_of_the_input(limit):
    by_place = sf.segment(BEAR, 80).labels
    limit("cells that are sorted", 1 << 30)
    plain = sf.segment(BEAR, 80).labels
    scores = [sf.metrics.compactness(BEAR, labels) for labels in (by_place, plain)]
    assert scores[0] == pytest.approx(scores[1], rel=0.03)


@pytest.mark.parametrize("options", [{"paper": True}, {"radius_factor": 2.0}, {"weights": "given"}])
def test_the_halted_mode_and_given_weights_keep_the_order_of_the_input(limit, options):
    if options.get("weights") == "given":
        graph = sf.build_face_graph(BEAR)
        options = {"weights": sf.crease_weights(BEAR, graph, 0.1)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", sf.IslandWarning)
        found = loops.segment(BEAR, 40, **options)
        limit("cells that are sorted", 1 << 30)
        expected = loops.segment(BEAR, 40, **options)
    assert np.array_equal(found.labels, expected.labels)


def test_errors_tell_numbers_of_the_input():
    mask = np.ones(BEAR.n_faces, bool)
    mask[17] = False
    with pytest.raises(ValueError, match=r"init\[1\] is cell 17, but the mask excludes this cell"):
        sf.segment(BEAR, init=[3, 17, 5], mask=mask)
    with pytest.raises(
        ValueError, match=r"barriers\[0\] must be an edge of the mesh, got \[5, 5\]"
    ):
        sf.segment(BEAR, 9, barriers=[[5, 5]])
