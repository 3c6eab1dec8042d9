"""Stages 1 to 6 on polygons: exact cases, and triangles given as polygons."""

import math

import loops
import numpy as np
import pytest
import reference
import shapes

import superfacets as sf
from superfacets import MeshError, PolygonMesh, build_face_graph, metrics
from superfacets.graph.surface import Surface, arc_measures
from superfacets.paper import superfacet_weights

CUBE = shapes.quad_cube()
CORNERS = CUBE.vertices


def as_polygons(mesh):
    return PolygonMesh.of_faces(mesh.vertices, mesh.faces)


def test_a_cube_of_six_quads():
    graph = build_face_graph(CUBE)
    assert graph.edge_counts == (12, 0, 0, 0)
    assert graph.n_arcs == 24
    assert graph.measures.tolist() == [1.0] * 6
    normals = graph.positions - np.full(3, 0.5)
    assert np.array_equal(np.abs(normals).sum(axis=1), np.full(6, 0.5))
    # The sides of the bottom, 0-2, 2-3, 3-1, 1-0, touch left, back, right and front.
    assert graph.neighbors[:4].tolist() == [4, 3, 5, 2]
    assert graph.sides[:4].tolist() == [0, 1, 2, 3]
    found = arc_measures(CUBE, graph)
    assert found.border_lengths.tolist() == [1.0] * 24
    assert found.step_lengths.tolist() == [1.0] * 24
    assert found.angles == pytest.approx(np.full(24, -math.pi / 2))
    assert found.open_lengths.tolist() == [0.0] * 6


def test_the_weights_of_a_cube_by_hand():
    """Centroids are 1/2 from each edge, theta is 90 degrees, and all edges are convex."""
    graph, diagonal = build_face_graph(CUBE), math.sqrt(3)
    weights = superfacet_weights(CUBE, graph, alpha=10, eta_convex=0.2)
    assert weights == pytest.approx(np.full(24, (1 + 10 * 0.2 * 0.5) / diagonal))
    weights = sf.crease_weights(CUBE, graph, 0.25, alpha=10, eta_convex=0.5)
    assert weights == pytest.approx(np.full(24, (1 + 10 * 0.5 * 0.25 * 0.5) / diagonal))
    inside_out = PolygonMesh.of_faces(CORNERS, CUBE.indices.reshape(6, 4)[:, ::-1])
    graph = build_face_graph(inside_out)
    assert superfacet_weights(inside_out, graph, alpha=10, eta_convex=0.2) == pytest.approx(
        np.full(24, (1 + 10 * 0.2 * 0.5) / diagonal)
    )
    assert sf.mesh_info(inside_out).is_inside_out
    assert not sf.mesh_info(CUBE).is_inside_out


def test_what_is_known_of_a_cube():
    info = sf.mesh_info(CUBE)
    assert (info.n_faces, info.n_vertices, info.n_edges, info.n_components) == (6, 8, 12, 1)
    assert (info.n_boundary_edges, info.n_degenerate_faces, info.area) == (0, 0, 6.0)
    assert metrics.compactness(CUBE, range(6)) == 4.0
    assert metrics.compactness(CUBE, [0] * 5 + [1]) == pytest.approx((4 / math.sqrt(5) + 4) / 2)
    assert metrics.evaluate(CUBE, range(6))["explained_variation"] == 1.0
    assert metrics.evaluate(CUBE, [0] * 6)["explained_variation"] == 0.0
    result = sf.segment(CUBE, 6)
    assert sorted(result.labels.tolist()) == list(range(6))
    assert result.params["radius"] == pytest.approx(math.sqrt(1 / math.pi))
    assert sf.segment(CUBE).n_segments == 6  # the number of faces is the maximum
    with pytest.raises(
        ValueError, match="n_segments must be at most 6, the number of faces, got 7"
    ):
        sf.segment(CUBE, 7)


def test_a_grid_of_quads_falls_into_its_halves():
    strip = shapes.squares(8, 2)
    result = sf.segment(strip, 2)
    halves = np.tile([0] * 4 + [1] * 4, 2)
    assert np.array_equal(result.labels, halves) or np.array_equal(result.labels, 1 - halves)
    assert metrics.compactness(strip, result) == 12 / math.sqrt(8)
    values = metrics.evaluate(strip, result, [halves])
    assert (values["boundary_recall"], values["boundary_precision"]) == (1.0, 1.0)
    assert values["cut_discrepancy"] == 0.0
    assert metrics.undersegmentation_error(strip, result, halves) == 0.0


def test_distances_of_borders_run_along_the_edges_of_quads():
    """In a strip of 8 x 1, the borders are at x = 4 and x = 2; there are no diagonals to follow."""
    strip = shapes.squares(8, 1)
    four, two = [0] * 4 + [1] * 4, [0] * 2 + [1] * 6
    radius = np.abs(np.arange(8) + 0.5 - 4).mean()
    values = metrics.evaluate(strip, four, [two])
    assert values["cut_discrepancy"] == pytest.approx((2 + 2) / radius)


@pytest.mark.parametrize("shape", [
    shapes.cube(), shapes.fold(50), shapes.fold(-50), shapes.strip(6), shapes.fins(4),
    shapes.moebius(), shapes.two_islands(), shapes.bumpy_sheet(12), shapes.inside_out_cube(),
])  # fmt: skip
def test_triangles_given_as_polygons_are_the_same_cells(shape):
    given = as_polygons(shape)
    expected, graph = build_face_graph(shape), build_face_graph(given)
    for name in ("positions", "measures", "offsets", "neighbors", "sides", "same_turn", "bounds"):
        assert np.array_equal(getattr(graph, name), getattr(expected, name)), name
    assert graph.edge_counts == expected.edge_counts
    assert sf.mesh_info(given) == sf.mesh_info(shape)
    for weigh in (
        superfacet_weights,
        lambda *cells: sf.crease_weights(*cells, 0.3, eta_convex=0.4),
    ):
        assert np.array_equal(weigh(given, graph), weigh(shape, expected))
    one, other = arc_measures(given, graph), arc_measures(shape, expected)
    for name in ("border_lengths", "step_lengths", "angles", "sides", "open_lengths"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


@pytest.mark.parametrize("n_threads", [1, 3])
@pytest.mark.parametrize(
    "options",
    [{}, {"weights": "superfacets"}, {"paper": True}],
    ids=["default", "superfacets", "paper"],
)
def test_triangles_given_as_polygons_get_the_same_labels(options, n_threads):
    mesh = sf.sample_mesh(5_000)
    expected = loops.segment(mesh, 25, **options)
    result = loops.segment(as_polygons(mesh), 25, n_threads=n_threads, **options)
    assert np.array_equal(result.labels, expected.labels)
    assert np.array_equal(result.centers, expected.centers)
    assert result.sliver_share == expected.sliver_share
    assert result.params == expected.params


def test_triangles_given_as_polygons_have_the_same_metrics_colors_and_clean_up():
    mesh = shapes.bumpy_sheet(16)
    given = as_polygons(mesh)
    rng = np.random.default_rng(0)
    labels = np.unique(rng.integers(0, 9, mesh.n_faces), return_inverse=True)[1]
    truth = sf.segment(mesh, 4).labels
    assert metrics.evaluate(given, labels, truth) == pytest.approx(
        metrics.evaluate(mesh, labels, truth)
    )
    assert np.array_equal(sf.face_colors(given, truth), sf.face_colors(mesh, truth))
    for edit in (sf.enforce_connectivity, lambda *a: sf.merge_small_regions(*a, 0.9)):
        assert np.array_equal(edit(given, labels).labels, edit(mesh, labels).labels)
    assert np.array_equal(sf.smooth_borders(given, labels), sf.smooth_borders(mesh, labels))
    with pytest.raises(ValueError, match="the ground truths were prepared for another mesh"):
        metrics.evaluate(given, labels, metrics.GroundTruths(mesh, truth))


def test_a_border_between_quads_is_made_straight():
    """A square of the tooth shares at most one side with its own region."""
    sheet = shapes.squares(6, 6)
    labels = np.repeat([0, 1], 18)
    labels[20] = 0  # a tooth
    assert sf.smooth_borders(sheet, labels).tolist() == np.repeat([0, 1], 18).tolist()


def test_a_vertex_that_only_some_faces_know_does_not_join_the_others():
    """A square beside two half squares has a T-junction on its side, so they share no edge."""
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0.5, 0], [2, 0, 0], [2, 0.5, 0],
              [2, 1, 0]]  # fmt: skip
    halves = [[1, 5, 6, 4], [4, 6, 7, 2]]
    apart = PolygonMesh.of_faces(points, [[0, 1, 2, 3], *halves])
    assert build_face_graph(apart).neighbors.tolist() == [2, 1]
    graph = build_face_graph(PolygonMesh.of_faces(points, [[0, 1, 4, 2, 3], *halves]))
    assert graph.neighbors.tolist() == [1, 2, 2, 0, 1, 0]
    assert graph.measures.tolist() == [1.0, 0.5, 0.5]


def test_seams_are_welded_unless_told_not_to():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0],
              [1, 1, -0.0]]  # fmt: skip
    mesh = PolygonMesh.of_faces(points, [[0, 1, 2, 3], [4, 5, 6, 7]])
    assert build_face_graph(mesh).edge_counts == (7, 6, 0, 0)
    assert build_face_graph(mesh, weld=False).edge_counts == (8, 8, 0, 0)
    assert sf.segment(mesh, 1).n_segments == 1


def test_all_pairs_around_an_edge_are_neighbors():
    fins = [[0, 1, 2 + 2 * i, 3 + 2 * i] for i in range(4)]
    points = [[0, 0, 0], [0, 0, 1]]
    for i in range(4):
        x, y = math.cos(i), math.sin(i)
        points += [[x, y, 1], [x, y, 0]]
    graph = build_face_graph(PolygonMesh.of_faces(points, fins))
    assert graph.neighbors.tolist() == [1, 2, 3, 0, 2, 3, 0, 1, 3, 0, 1, 2]
    assert graph.edge_counts == (13, 12, 1, 0)


def test_too_many_arcs_are_refused():
    with pytest.raises(MeshError, match="one edge is shared by 64 faces"):
        build_face_graph(PolygonMesh.of_faces(*shapes.crowded_sides(2)))


def test_ugly_faces_are_cells_like_others():
    """A sheet of quads has a bow tie, repeated corners, a bent face, and a face without area."""
    sheet = shapes.squares(4, 4)
    faces = [sheet.face(i).tolist() for i in range(16)]
    faces[5] = [faces[5][i] for i in (0, 1, 3, 2)]
    faces[6] = [faces[6][i] for i in (0, 0, 1, 2, 2, 3, 3)]
    faces[15] = [faces[15][0]] * 4
    points = sheet.vertices.copy()
    points[18, 2] = 3.0
    mesh = PolygonMesh.of_faces(points, faces)
    for weights in ("creases", "superfacets"):
        result = sf.segment(mesh, 3, weights=weights, islands="nearest")
        assert result.n_segments == 3
        assert len(result.labels) == 16
    assert np.isfinite(list(metrics.evaluate(mesh, result.labels).values())).all()
    graph = build_face_graph(mesh)
    assert (graph.measures[[5, 15]] == 0).all()
    # A side between corners at one vertex has no arc; the other sides keep their numbers.
    assert set(graph.sides[graph.offsets[6] : graph.offsets[7]].tolist()) <= {1, 2, 4, 6}
    assert graph.n_arcs == len(arc_measures(mesh, graph).angles)


def test_neighbors_in_the_same_direction_are_flipped_for_their_arc():
    faces = [CUBE.face(i).tolist() for i in range(6)]
    faces[1] = faces[1][::-1]
    mesh = PolygonMesh.of_faces(CORNERS, faces)
    graph = build_face_graph(mesh)
    assert graph.edge_counts == (12, 0, 0, 4)
    assert graph.same_turn.sum() == 8
    angles = arc_measures(mesh, graph).angles
    assert np.abs(angles) == pytest.approx(np.full(24, math.pi / 2))


def test_a_graph_of_another_mesh_is_refused():
    sheet, other = shapes.squares(2, 3), shapes.squares(3, 2)
    assert Surface.of_faces(sheet, build_face_graph(sheet), 1).n_cells == 6
    triangles = shapes.strip(6)
    with pytest.raises(
        ValueError, match="the graph was built for triangles, but the mesh has polygons"
    ):
        superfacet_weights(sheet, build_face_graph(triangles))
    with pytest.raises(
        ValueError, match="the graph was built for polygons, but the mesh has triangles"
    ):
        superfacet_weights(triangles, build_face_graph(sheet))
    fans = PolygonMesh.of_faces(sheet.vertices, [[0, 1, 2]] * 5 + [[3, 4, 5]])
    with pytest.raises(
        ValueError, match="the graph was built for another mesh, whose faces have more sides"
    ):
        superfacet_weights(fans, build_face_graph(other))
    with pytest.raises(ValueError, match="the graph has 6 cells but the mesh has 4 faces"):
        arc_measures(shapes.squares(2, 2), build_face_graph(other))


def test_labels_do_not_depend_on_the_order_of_faces_and_corners():
    rng = np.random.default_rng(1)
    sheet = shapes.bumpy_sheet(10)
    halves = sheet.faces.reshape(2, -1, 3)
    faces = np.column_stack([halves[0], halves[1][:, 2]]).tolist()
    mesh = PolygonMesh.of_faces(sheet.vertices, faces)
    seeds = np.array([3, 50, 77])
    expected = sf.segment(mesh, init=seeds).labels
    order = rng.permutation(len(faces))
    moved = [np.roll(faces[i], int(rng.integers(4))).tolist() for i in order]
    places = np.argsort(order)
    other = sf.segment(PolygonMesh.of_faces(sheet.vertices, moved), init=places[seeds]).labels
    assert np.mean(other[places] == expected) > 0.97  # ties, and bent faces, may differ


def test_a_subdivided_polygon_gives_its_labels_back():
    plank = PolygonMesh.of_faces(
        [[0, 0, 0], [9, 0, 0], [9, 1, 0], [1, 1, 0], [1, 3, 0], [0, 3, 0]], [[0, 1, 2, 3, 4, 5]]
    )
    parts = sf.subdivide(plank, 0.5)
    assert parts.n_sources == 1
    areas = build_face_graph(parts.mesh).measures
    assert areas.sum() == pytest.approx(11.0)
    assert np.exp2(-parts.depths.astype(float)) * parts.cut_areas == pytest.approx(areas)
    centers = parts.mesh.vertices[parts.mesh.faces].mean(axis=1)
    assert parts.labels_back((centers[:, 0] > 1).astype(int)).tolist() == [1]
    assert parts.labels_back((centers[:, 0] > 5.6).astype(int)).tolist() == [0]


def test_slivers_of_quads_are_noticed():
    """Planks are 40 long and 1 wide, but regions should have a radius of 3.6."""
    planks = PolygonMesh.of_faces(
        [[x, y, 0] for x in (0, 40) for y in range(11)],
        [[i, 11 + i, 12 + i, i + 1] for i in range(10)],
    )
    with pytest.warns(sf.SliverWarning, match="100% of the area"):
        assert sf.segment(planks, 10).sliver_share == 1.0


def random_polygons(seed):
    """Return faces of 3 to 7 corners among few vertices, some of them at equal positions."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 3, (14, 3)).astype(float)
    return PolygonMesh.of_faces(
        points, [rng.integers(0, 14, n).tolist() for n in rng.integers(3, 8, 40)]
    )


@pytest.mark.parametrize("weld", [True, False])
@pytest.mark.parametrize("seed", range(8))
def test_arcs_are_those_of_the_reference(seed, weld):
    mesh = random_polygons(seed)
    graph = build_face_graph(mesh, weld=weld)
    sources = np.repeat(np.arange(mesh.n_faces), np.diff(graph.offsets))
    found = zip(sources, graph.sides, graph.neighbors, graph.same_turn, strict=True)
    expected = reference.build_face_graph(mesh, weld=weld)
    assert [tuple(map(int, arc)) for arc in found] == [tuple(map(int, arc)) for arc in expected]


def test_measures_are_those_of_the_reference():
    rng = np.random.default_rng(3)
    faces, points = [], []
    for n in range(3, 12):  # slightly bent stars around an inner point
        angles = np.sort(rng.uniform(0, 2 * np.pi / n, n)) + 2 * np.pi * np.arange(n) / n
        radii = rng.uniform(0.3, 1.0, n)
        faces.append(list(range(len(points), len(points) + n)))
        points += [
            [r * math.cos(a) + n, r * math.sin(a), 0.02 * rng.normal()]
            for r, a in zip(radii, angles, strict=True)
        ]
    mesh = PolygonMesh.of_faces(points, faces)
    graph = build_face_graph(mesh)
    centroids, areas = reference.measure_polygons(mesh)
    assert graph.measures == pytest.approx(areas, rel=1e-12)
    assert graph.positions[:, :2] == pytest.approx(centroids[:, :2], rel=1e-12)
