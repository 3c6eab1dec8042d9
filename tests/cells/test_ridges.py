"""Ridges: sharp convex edges between flat surfaces."""

import itertools
import math

import numpy as np
import pytest
import reference
import shapes
from shapes import subdivided

import superfacets as sf
from superfacets import Mesh, build_face_graph, crease_weights
from superfacets.graph.surface import arc_measures

QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def prices(mesh, **options):
    """Return the crease cost of each arc, in units in which a concave angle theta costs theta."""
    graph = build_face_graph(mesh)
    options = {"alpha": math.pi, **options}
    priced = crease_weights(mesh, graph, graph.diagonal, **options)
    return priced - crease_weights(mesh, graph, graph.diagonal, alpha=0.0)


def is_ridge(mesh):
    return prices(mesh) != prices(mesh, ridges=0.0)


def ball(times):
    """Return a sphere of 8 * 4**times faces, which is a subdivided octahedron."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    mesh = subdivided(Mesh(corners, faces), times)
    return Mesh(mesh.vertices / np.linalg.norm(mesh.vertices, axis=1, keepdims=True), mesh.faces)


def bent_strip(turns):
    """Return a strip of squares that bends down by these angles, in degrees, after each square."""
    return shapes.row(*np.negative(turns))


@pytest.mark.parametrize("times", [0, 1, 3])
@pytest.mark.parametrize("shape", [shapes.cube, shapes.inside_out_cube])
def test_all_edges_of_a_box_are_ridges_at_every_resolution(shape, times):
    mesh = subdivided(shape(), times)
    angles = arc_measures(mesh, build_face_graph(mesh)).angles
    is_edge = np.abs(angles) > 1
    assert is_edge.sum() == 2 * 12 * 2**times
    assert np.array_equal(is_ridge(mesh), is_edge)
    assert prices(mesh)[is_edge] == pytest.approx(0.35 * math.pi / 2)


def test_a_box_of_quads_has_the_ridges_of_one_of_triangles():
    box = shapes.quad_cube()
    assert prices(box) == pytest.approx(np.full(24, 0.35 * math.pi / 2))
    assert not prices(box, ridges=0.0).any()


@pytest.mark.parametrize("times", [0, 1, 2, 3])
def test_a_ball_has_no_ridges_however_coarse(times):
    assert not is_ridge(ball(times)).any()


@pytest.mark.parametrize(("turns", "n_ridges"), [
    ([0, 90, 0], 1),
    ([0, 41, 0], 1),
    ([0, 39, 0], 0),  # not sharp
    ([0, 90, 26, 0], 1),  # the next edge bends by less than 0.3 of this angle
    ([0, 90, 28, 0], 0),
    ([30, 30, 30], 0),  # a rounded edge
    ([90, 90], 2),  # a bar
    ([45, 45], 2),  # a chamfer
    ([90, 60, 0], 0),  # sharp, but too different
    ([90, -90], 1),  # a step; a groove is not a ridge
])  # fmt: skip
def test_what_is_a_ridge_depends_on_the_edges_beside_it(turns, n_ridges):
    assert is_ridge(bent_strip(turns)).sum() == 2 * n_ridges
    assert is_ridge(bent_strip(turns[::-1])).sum() == 2 * n_ridges


def test_ridges_cost_a_share_of_what_valleys_cost():
    ridge, valley = shapes.fold(-60), shapes.fold(60)
    assert prices(valley, ridges=0.7) == pytest.approx([math.pi / 3] * 2)
    assert prices(ridge, ridges=0.7) == pytest.approx([0.7 * math.pi / 3] * 2)
    assert prices(ridge) == pytest.approx([0.35 * math.pi / 3] * 2)
    assert prices(ridge, ridges=0) == pytest.approx([0, 0])
    assert prices(shapes.fold(-30), ridges=0.7) == pytest.approx([0, 0])


def test_ridges_count_no_less_than_other_convex_edges():
    for eta_convex in (0.5, 0.8):
        with_ridges = prices(shapes.fold(-60), eta_convex=eta_convex)
        assert np.array_equal(
            with_ridges, prices(shapes.fold(-60), eta_convex=eta_convex, ridges=0)
        )


def test_a_fin_is_a_ridge_of_no_face():
    """No edge is a ridge if more than two faces meet at it."""
    assert not is_ridge(subdivided(shapes.fins(5))).any()


def test_a_face_without_a_normal_has_no_ridges():
    assert not is_ridge(shapes.slivers()).any()


def noisy(mesh, seed, share=0.3):
    vertices = mesh.vertices + np.random.default_rng(seed).normal(0, share, mesh.vertices.shape)
    return Mesh(vertices, mesh.faces)


MESHES = {
    "cube": shapes.cube,
    "inside out": shapes.inside_out_cube,
    "gears": lambda: shapes.gears(2),
    "block": lambda: shapes.drilled_block(12),
    "fins": lambda: shapes.fins(12),
    "slivers": shapes.slivers,
    "moebius": shapes.moebius,
    "double sheet": lambda: Mesh([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]]),
    **{f"noise {seed}": lambda seed=seed: noisy(subdivided(shapes.cube(), 2), seed, 0.1)
       for seed in range(6)},
}  # fmt: skip


@pytest.mark.parametrize("hollows", [False, True])
@pytest.mark.parametrize("eta_convex", [0.0, 0.1])
@pytest.mark.parametrize("name", MESHES)
def test_weights_with_ridges_equal_their_twin(name, eta_convex, hollows):
    mesh = MESHES[name]()
    options = {"alpha": 20.0, "eta_convex": eta_convex, "ridges": 0.35, "hollows": hollows}
    weights = crease_weights(mesh, build_face_graph(mesh), 0.3, **options)
    arcs = reference.build_face_graph(mesh)
    expected = reference.superfacet_weights(mesh, arcs, crease_length=0.3, **options)
    assert np.array_equal(weights, expected)


def test_polygons_that_are_triangles_weigh_the_same():
    for name in ("gears", "noise 1", "noise 2"):
        mesh = MESHES[name]()
        polygons = sf.PolygonMesh(
            mesh.vertices, 3 * np.arange(mesh.n_faces + 1), mesh.faces.reshape(-1)
        )
        graphs = [build_face_graph(cells) for cells in (mesh, polygons)]
        weights = [
            crease_weights(cells, graph, 0.3)
            for cells, graph in zip((mesh, polygons), graphs, strict=True)
        ]
        assert weights[0] == pytest.approx(weights[1], rel=1e-12)


def flaps(turns):
    """Return a regular polygon with triangles at its sides, bent down by `turns` degrees."""
    n = len(turns)
    around = 2 * np.pi * np.arange(n) / n
    rim = np.stack([np.cos(around), np.sin(around), np.zeros(n)], axis=1)
    middles = (rim + np.roll(rim, -1, axis=0)) / 2
    outwards = middles / np.linalg.norm(middles, axis=1)[:, None]
    turned = np.radians(turns)[:, None]
    tips = middles + np.cos(turned) * outwards - np.sin(turned) * np.array([0, 0, 1])
    triangles = [[(i + 1) % n, i, n + i] for i in range(n)]
    return sf.PolygonMesh.of_faces(np.concatenate([rim, tips]), [list(range(n)), *triangles])


@pytest.mark.parametrize("n", [5, 40])
@pytest.mark.parametrize("choice", [(5, 60), (5, 20, 60), (50, 60, 70), (45, 75), (50,), (10, 30)])
def test_a_polygon_of_many_sides_has_ridges_like_one_of_few(n, choice):
    turns = np.random.default_rng(n).choice(choice, n)
    mesh = flaps(turns)
    graph = build_face_graph(mesh)
    with_ridges, without = (crease_weights(mesh, graph, 0.2, ridges=r) for r in (3.0, 0.0))
    found = (with_ridges > without)[:n]  # arcs of the polygon, sorted by side

    def is_flat_beside(side):
        turn, others = turns[side], np.delete(turns, side)
        bent = others[others >= 0.3 * turn]
        return bool(np.all((bent >= max(40, 0.7 * turn)) & (turn >= 0.7 * bent)))

    assert found.tolist() == [turns[i] >= 40 and is_flat_beside(i) for i in range(n)]


@pytest.mark.parametrize("weld", [True, False])
@pytest.mark.parametrize("n", [20, 60])
def test_the_rim_of_a_prism_is_a_ridge_whatever_its_number_of_sides(n, weld):
    around = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(around), np.sin(around), np.zeros(n)], axis=1)
    quads = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    faces = [list(range(n))[::-1], list(range(n, 2 * n)), *quads]
    vertices = np.concatenate([ring, ring + [0, 0, 1]])
    if weld:  # each face has vertices of its own
        vertices = vertices[np.concatenate(faces)]
        starts = np.cumsum([0, *map(len, faces)])
        faces = [list(range(a, b)) for a, b in itertools.pairwise(starts)]
    mesh = sf.PolygonMesh.of_faces(vertices, faces)
    graph = build_face_graph(mesh, weld=weld)
    with_ridges, without = (crease_weights(mesh, graph, 0.2, ridges=r) for r in (3.0, 0.0))
    is_cap = np.repeat(np.arange(n + 2) < 2, np.diff(graph.offsets))
    assert np.array_equal(with_ridges > 2 * without, is_cap | (graph.neighbors < 2))


def test_ridges_keep_every_bit_under_scaling_by_powers_of_two():
    mesh = noisy(subdivided(shapes.cube(), 2), 3, 0.1)
    scaled = Mesh(8 * mesh.vertices, mesh.faces)
    weights = [
        crease_weights(m, build_face_graph(m), scale * 0.2) for m, scale in ((mesh, 1), (scaled, 8))
    ]
    assert np.array_equal(*weights)


def test_regions_end_at_the_edges_of_a_box():
    mesh = subdivided(shapes.cube(), 4)
    side = np.arange(mesh.n_faces) // (2 * 4**4)
    by_default = sf.segment(mesh, 12)
    assert all(len(set(side[by_default.labels == label])) == 1 for label in range(12))
    without = sf.segment(mesh, 12, weights=sf.Weights(ridges=0))
    assert any(len(set(side[without.labels == label])) > 1 for label in range(12))
    assert (by_default.params["ridges"], without.params["ridges"]) == (1.0, 0.0)


def test_points_have_no_ridges():
    points = np.random.default_rng(0).uniform(size=(600, 3)) * [1, 1, 0]
    one, other = (sf.segment(points, 9, weights=sf.Weights(ridges=ridges)) for ridges in (0, 3.0))
    assert np.array_equal(one.labels, other.labels)


def test_a_negative_weight_of_ridges_is_refused():
    with pytest.raises(ValueError, match="ridges must be finite and not negative"):
        prices(shapes.cube(), ridges=-0.1)
    with pytest.raises(ValueError, match="ridges must be finite and not negative"):
        sf.segment(shapes.cube(), 2, weights=sf.Weights(ridges=math.nan))
