"""Cells are sorted before segmentation, so that regions do not depend on the order of the input."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.graph import sorting
from superfacets.graph.kinds import kind_of
from superfacets.mesh.faces import corners_of


def reordered(cells, seed=0):
    """Return vertices and cells in random order, with faces rotated, and the order of the cells."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(cells.n_cells).astype(np.int32)
    corners = corners_of(cells) if not isinstance(cells, sf.PointCloud) else None
    if corners is None:
        return cells.taken(order), order
    new_vertices = rng.permutation(cells.n_vertices)
    place = np.argsort(new_vertices).astype(np.int32)
    lists, offsets = corners.of(order)
    for begin, end in pairwise(offsets):
        turn = rng.permutation if isinstance(cells, sf.TetMesh) else np.roll
        turns = () if isinstance(cells, sf.TetMesh) else (rng.integers(end - begin),)
        lists[begin:end] = turn(lists[begin:end], *turns)
    vertices = cells.vertices[new_vertices]
    return kind_of(cells).with_corners(cells, vertices, place[lists], offsets), order


def shuffled(mesh, seed=0):
    return reordered(mesh, seed)[0]


def in_curve_order(mesh, weld=True):
    """Return the sorted mesh that is segmented instead, and the original index of each cell."""
    found = sorting.sorted_corners(
        mesh.vertices, corners_of(mesh), weld, 1, are_faces=kind_of(mesh).has_faces
    )
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
    before, offsets = corners_of(mesh).of(order)
    after = placed.vertices[corners_of(placed).vertices]
    for begin, end in list(pairwise(offsets))[:500]:
        rows, turned = mesh.vertices[before[begin:end]].tolist(), after[begin:end].tolist()
        if name == "tets":
            assert sorted(rows) == sorted(turned)
        else:
            assert turned in [rows[i:] + rows[:i] for i in range(len(rows))]
    assert np.array_equal(placed.bounds, mesh.bounds)


def codes_of(points):
    low, high = points.min(axis=0), points.max(axis=0)
    steps = np.minimum(1023, (points - low) * (1024 / (high - low).max())).astype(int)
    bits = steps[:, :, None] >> np.arange(10) & 1
    return (bits << 3 * np.arange(10) << np.arange(3)[:, None]).sum(axis=(1, 2))


def test_vertices_and_faces_are_sorted_by_code_and_faces_begin_with_the_lowest():
    found = sorting.sorted_corners(BEAR.vertices, corners_of(BEAR), True, 1, are_faces=True)
    faces = found.corners.reshape(-1, 3)
    centers = found.vertices[faces].sum(axis=1) / 3
    for points in (found.vertices, centers):
        assert np.all(np.diff(codes_of(points)) >= 0)
    assert np.array_equal(faces[:, 0], faces.min(axis=1))


def test_nothing_depends_on_the_number_of_threads():
    large = shuffled(sf.sample_mesh(60_000))
    one, many = (
        sorting.sorted_corners(large.vertices, corners_of(large), True, n_threads, are_faces=True)
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
    found = sorting.sorted_corners(far.vertices, corners_of(far), True, 1, are_faces=True)
    steps = np.linalg.norm(np.diff(found.vertices[:-1], axis=0), axis=1)
    assert np.median(steps) < 0.03 * np.linalg.norm(np.ptp(bear.vertices, axis=0))


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


SQUARE = np.stack(np.meshgrid(np.arange(40.0), np.arange(40.0), [0.0]), -1).reshape(-1, 3)
CORNERS = shapes.soup(shapes.flat(20))
POINTS = np.random.default_rng(2).normal(size=(3_000, 3))
ANY_CELLS = {
    **MESHES, "grid": shapes.squares(30), "points": sf.PointCloud(POINTS),
    "points on a grid": sf.PointCloud(SQUARE),
    "points twice": sf.PointCloud(np.repeat(POINTS[:1_500], 2, axis=0)),
    "noise": sf.Mesh(BEAR.vertices + 0.01 * POINTS[: BEAR.n_vertices], BEAR.faces),
    "near corners": sf.Mesh(CORNERS.vertices + 1e-4 * POINTS[: CORNERS.n_vertices], CORNERS.faces),
}  # fmt: skip


@pytest.mark.parametrize("options", [{}, {"weights": "creases", "denoise": "auto"}], ids=str)
@pytest.mark.parametrize("name", ANY_CELLS)
def test_the_partition_does_not_depend_on_the_order_of_the_input(name, options):
    cells, weld = ANY_CELLS[name], 1e-3 if name == "near corners" else True
    expected = sf.segment(sf.prepare(cells, weld=weld), 40, **options).labels
    for seed in range(2):
        again, order = reordered(cells, seed + 1)
        labels = sf.segment(sf.prepare(again, weld=weld), 40, **options).labels
        pairs = np.unique(np.stack([labels, expected[order]]), axis=1)
        assert pairs.shape[1] == len(np.unique(labels)) == len(np.unique(expected))


@pytest.mark.parametrize("corners", [[4, 9, 4, 2], [5, 5, 5], [3, 1, 1], [1, 2, 1, 1, 2], [7]])
def test_a_polygon_begins_with_its_least_rotation(corners):
    rotations = [corners[i:] + corners[:i] for i in range(len(corners))]
    places = np.arange(10.0)[:, np.newaxis] * [1, 0, 0]
    for turned in rotations:
        found = _core.sort_mesh(
            places, np.arange(10, dtype=np.int32), np.array(turned, np.int32),
            np.array([0, len(turned)]), 0, True, 1,
        )  # fmt: skip
        assert found[1].tolist() == min(rotations)


def test_errors_tell_numbers_of_the_input():
    mask = np.ones(BEAR.n_faces, bool)
    mask[17] = False
    with pytest.raises(ValueError, match=r"init\[1\] is cell 17, but the mask excludes this cell"):
        sf.segment(BEAR, init=[3, 17, 5], mask=mask)
    with pytest.raises(
        ValueError, match=r"barriers\[0\] must be an edge of the mesh, got \[5, 5\]"
    ):
        sf.segment(BEAR, 9, barriers=[[5, 5]])
