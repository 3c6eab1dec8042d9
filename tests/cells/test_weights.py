"""Stage 2: equations 1 to 3, computed by hand."""

import dataclasses
import math
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import _core
from superfacets.graph.kinds import graph_and_surface
from superfacets.graph.surface import Surface, arc_measures
from superfacets.paper import superfacet_weights
from superfacets.weights import formulas as weights_module
from superfacets.weights.formulas import WEIGHTS, ArcWeights, EdgeFactors, WeightOptions


def weights_of(mesh, **options):
    return superfacet_weights(mesh, sf.build_face_graph(mesh), **options)


GEODESIC_OF_FOLD = 2.0  # length of the path: both centroids are 1 from the midpoint of the edge


def diagonal_of_fold(degrees):
    angle = math.radians(degrees)
    return math.hypot(3 + max(3 * math.cos(angle), 0), 2, 3 * math.sin(angle))


@pytest.mark.parametrize(("degrees", "angular"), [
    (0, 0.0),
    (90, 200 * 1.0 * 2 * 0.5),  # concave: alpha eta |e| theta / pi
    (-90, 200 * 0.2 * 2 * 0.5),  # convex
    (60, 200 * 1.0 * 2 / 3),
    (-60, 200 * 0.2 * 2 / 3),
    (179, 200 * 1.0 * 2 * 179 / 180),
    (1e-6, 200 * 1.0 * 2 * 1e-6 / 180),
])  # fmt: skip
def test_a_fold_weighs_what_eq_3_says(degrees, angular):
    expected = (GEODESIC_OF_FOLD + angular) / diagonal_of_fold(degrees)
    assert weights_of(shapes.fold(degrees)) == pytest.approx([expected, expected], rel=1e-13)


@pytest.mark.parametrize("slack", [10.0, 60.0, 100.0])
@pytest.mark.parametrize("degrees", [60, -60])
def test_a_slack_is_subtracted_from_angles(degrees, slack):
    mesh = shapes.fold(degrees)
    polygons = sf.PolygonMesh.of_faces(mesh.vertices, mesh.faces)
    for cells in (mesh, polygons):
        graph, surface = graph_and_surface(cells, True, 1)
        arrays = (graph.positions, graph.measures)
        factors = EdgeFactors(200.0, 0.2, 0.0, slack=math.radians(slack))
        eta = 1.0 if degrees > 0 else 0.2
        angular = 200 * eta * 2 * max(60 - slack, 0) / 180
        expected = (GEODESIC_OF_FOLD + angular) / diagonal_of_fold(degrees)
        found = weights_module.weights_of(surface, arrays, factors)
        assert found == pytest.approx([expected, expected], rel=1e-9)


def test_concave_convex_and_flat_differ_by_eta_alone():
    def crease(degrees):
        return weights_of(shapes.fold(degrees))[0] * diagonal_of_fold(degrees) - 2

    assert crease(90) == pytest.approx(5 * crease(-90), rel=1e-13)
    assert crease(0) == 0


def test_alpha_zero_leaves_the_distance_alone():
    expected = 2 / diagonal_of_fold(90)
    assert weights_of(shapes.fold(90), alpha=0).tolist() == pytest.approx([expected] * 2)


def test_eta_can_make_ridges_free_or_dear():
    assert weights_of(shapes.fold(-90), eta_convex=0)[0] == pytest.approx(2 / diagonal_of_fold(90))
    assert weights_of(shapes.fold(-90), eta_convex=1)[0] == weights_of(shapes.fold(90))[0]


def test_a_cube_has_convex_edges_and_flat_diagonals():
    mesh = shapes.cube()
    graph = sf.build_face_graph(mesh)
    sources = np.repeat(np.arange(12), np.diff(graph.offsets))
    is_diagonal = sources // 2 == graph.neighbors // 2
    weights = superfacet_weights(mesh, graph)
    # Midpoints of legs are sqrt(1/9 + 1/36) from the centroid; of the hypotenuse, sqrt(2)/6.
    flat = 2 * math.sqrt(2) / 6 / math.sqrt(3)
    convex = (2 * math.sqrt(5) / 6 + 200 * 0.2 * 1 * 0.5) / math.sqrt(3)
    assert weights[is_diagonal] == pytest.approx([flat] * 12, rel=1e-13)
    assert weights[~is_diagonal] == pytest.approx([convex] * 24, rel=1e-13)


def test_an_inside_out_closed_mesh_weighs_the_same():
    def pairs(mesh):
        graph = sf.build_face_graph(mesh)
        sources = np.repeat(np.arange(mesh.n_faces), np.diff(graph.offsets))
        arcs = zip(sources.tolist(), graph.neighbors.tolist(), strict=True)
        return dict(zip(arcs, superfacet_weights(mesh, graph).tolist(), strict=True))

    assert pairs(shapes.cube()) == pytest.approx(pairs(shapes.inside_out_cube()), rel=1e-14)


def test_an_open_mesh_is_never_inside_out():
    inside_out = shapes.inside_out_cube()
    opened = sf.Mesh(inside_out.vertices, inside_out.faces[:-1])
    sharpest = (2 * math.sqrt(5) / 6 + 200 * 1.0 * 0.5) / math.sqrt(3)  # concave now
    assert weights_of(opened).max() == pytest.approx(sharpest)


def test_both_arcs_of_a_pair_have_the_same_bits():
    mesh = shapes.bumpy_sheet(16)
    graph = sf.build_face_graph(mesh)
    weights = superfacet_weights(mesh, graph)
    sources = np.repeat(np.arange(mesh.n_faces), np.diff(graph.offsets))
    there = dict(zip(zip(sources, graph.neighbors, strict=True), weights, strict=True))
    assert all(there[j, i] == weight for (i, j), weight in there.items())


@pytest.mark.parametrize("turned", [0, 1])
@pytest.mark.parametrize("degrees", [90, -90])
def test_of_faces_as_large_the_one_with_the_lower_index_says_where_up_is(turned, degrees):
    mesh = shapes.fold(degrees)
    faces = mesh.faces.copy()
    faces[turned] = faces[turned][::-1]
    expected = weights_of(shapes.fold(degrees if turned == 1 else -degrees))[0]
    assert weights_of(sf.Mesh(mesh.vertices, faces)) == pytest.approx([expected] * 2, rel=1e-14)


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_larger_face_says_where_up_is(order):
    valley = shapes.fold(90)
    vertices = valley.vertices.copy()
    vertices[2] *= [2, 1, 1]  # the first face is twice as large
    flipped = valley.faces.copy()
    flipped[1] = flipped[1][::-1]
    expected = weights_of(sf.Mesh(vertices, valley.faces))[0]
    assert weights_of(sf.Mesh(vertices, flipped[order])) == pytest.approx([expected] * 2, rel=1e-14)


def test_the_seam_of_a_moebius_band_weighs_about_what_its_other_edges_do():
    mesh = shapes.moebius(60)
    graph = sf.build_face_graph(mesh)
    weights = superfacet_weights(mesh, graph)
    seam = weights[graph.same_turn == 1]
    assert len(seam) == 2
    assert seam[0] == seam[1]
    assert seam[0] < 1.5 * np.median(weights) + weights.max() / 2


def test_faces_without_a_normal_weigh_their_distance_alone():
    mesh = shapes.slivers()
    weights = weights_of(mesh)
    assert np.array_equal(weights, weights_of(mesh, alpha=0))
    # Centroids are (2/3, 2/3, 0) and (1, 1, 0); the second is also the midpoint of the edge.
    assert weights[1] == pytest.approx(math.sqrt(2) / 3 / math.sqrt(75))


def test_a_collinear_face_has_no_normal_for_all_its_rounding_errors():
    direction = np.array([0.1, 0.7, 0.3])
    vertices = np.array([0 * direction, direction, direction * 3.3, [1, 0, 0]])
    mesh = sf.Mesh(vertices, [[0, 1, 2], [1, 0, 3]])
    assert np.linalg.norm(np.cross(vertices[1], vertices[2])) > 0
    assert np.array_equal(weights_of(mesh), weights_of(mesh, alpha=0))


def test_a_needle_keeps_its_normal():
    """A triangle of length 1 and height 1e-9 has an accurate normal."""
    vertices = [[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0.5, 0, 1]]
    mesh = sf.Mesh(vertices, [[0, 1, 2], [1, 0, 3]])
    theta = weights_of(mesh)[0] - weights_of(mesh, alpha=0)[0]
    assert theta * sf.build_face_graph(mesh).diagonal / 200 == pytest.approx(0.5, rel=1e-6)


def test_two_coincident_sheets_are_not_inside_out_by_rounding():
    vertices = np.random.default_rng(1).uniform(-1, 1, (3, 3)) + 1000
    sheet = sf.Mesh(vertices, [[0, 1, 2], [2, 1, 0]])
    assert np.isfinite(weights_of(sheet)).all()
    # theta is pi, and centroids coincide. An edge neither concave nor convex counts as convex.
    edges = np.linalg.norm(vertices - np.roll(vertices, -1, axis=0), axis=1)
    angular = weights_of(sheet)[:3] - weights_of(sheet, alpha=0)[:3]
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    assert angular == pytest.approx(200 * 0.2 * edges / diagonal, rel=1e-9)


@pytest.mark.parametrize("is_inside_out", [False, True])
def test_an_edge_that_rises_by_exactly_nothing_is_not_concave(is_inside_out):
    """Two faces have the same corners, so the angle is pi, and the centroids coincide."""
    sheet = sf.Mesh([[3, 0, 0], [6, 0, 0], [3, 4, 0]], [[0, 1, 2], [2, 1, 0]])
    box = shapes.inside_out_cube() if is_inside_out else shapes.cube()
    mesh = shapes.together([box, sheet])
    assert sf.mesh_info(mesh).is_inside_out == is_inside_out
    graph = sf.build_face_graph(mesh)
    of_sheet = slice(graph.offsets[12], graph.offsets[14])
    angular = superfacet_weights(mesh, graph) - superfacet_weights(mesh, graph, alpha=0)
    convex = 200 * 0.2 * np.array([3, 3, 4, 4, 5, 5]) / graph.diagonal  # |e| is 3, 4 and 5
    assert sorted(angular[of_sheet]) == pytest.approx(convex.tolist(), rel=1e-12)
    assert arc_measures(mesh, graph).angles[of_sheet] == pytest.approx([-math.pi] * 6)


@pytest.mark.parametrize("options", [{"alpha": -1}, {"alpha": math.nan}, {"eta_convex": -0.1}])
def test_negative_or_missing_factors_are_refused(options):
    with pytest.raises(ValueError, match="must be finite and not negative"):
        weights_of(shapes.cube(), **options)


def test_a_graph_of_another_mesh_is_refused():
    with pytest.raises(ValueError, match="the graph has 12 cells but the mesh has 4 faces"):
        superfacet_weights(shapes.strip(4), sf.build_face_graph(shapes.cube()))


def test_weights_and_lengths_do_not_depend_on_the_number_of_threads():
    mesh = shapes.bumpy_sheet(150)
    graph = sf.build_face_graph(mesh)
    one, *others = (superfacet_weights(mesh, graph, n_threads=n) for n in (1, 2, 8))
    assert all(np.array_equal(one, other) for other in others)
    one_thread, *more = (graph.with_weights(one, n_threads=n) for n in (1, 2, 8))
    assert all(np.array_equal(one_thread.lengths, cells.lengths) for cells in more)
    assert all(one_thread.unit == cells.unit for cells in more)


def weights_one_way(mesh, graph):
    """Return weights that are computed on two graphs without reverse arcs."""
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    weights = np.empty(graph.n_arcs)
    for is_kept in (sources < graph.neighbors, sources > graph.neighbors):
        offsets = np.concatenate(
            [[0], np.cumsum(np.bincount(sources[is_kept], None, mesh.n_faces))]
        )
        half = dataclasses.replace(
            graph, offsets=offsets, neighbors=graph.neighbors[is_kept], sides=graph.sides[is_kept],
            same_turn=graph.same_turn[is_kept],
        )  # fmt: skip
        weights[is_kept] = superfacet_weights(mesh, half)
    return weights


@pytest.mark.parametrize("mesh", [
    shapes.bumpy_sheet(16),
    shapes.moebius(12),
    shapes.fins(4),
    shapes.fins(12),  # too many arcs for a search of the reverse arc
    shapes.slivers(),
    sf.Mesh([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]]),  # three arcs per direction
])  # fmt: skip
def test_an_arc_weighs_the_same_with_and_without_an_arc_back(mesh):
    graph = sf.build_face_graph(mesh)
    assert np.array_equal(superfacet_weights(mesh, graph), weights_one_way(mesh, graph))


@pytest.mark.parametrize("make", [lambda mesh: mesh, lambda mesh: sf.PointCloud(mesh.vertices)])
def test_large_graphs_get_the_same_lengths_and_coarse_cells_with_less_memory(make):
    graph, surface = graph_and_surface(make(shapes.bumpy_sheet(363)), True, 2)
    arrays, factors = (graph.positions, graph.measures), EdgeFactors(12.0, 0.1, 0.02, 1.0)
    lengths, unit = graph.quantized(weights_module.weights_of(surface, arrays, factors), 2, 4.0)
    found = weights_module.weights_of(surface, arrays, factors._replace(unit_factor=4.0))
    assert (found.unit, found.values.tobytes()) == (unit, lengths.tobytes())
    coarse = []
    for are_shared in (False, True):
        placed = _core.PlacedCells(*arrays, 2, True)
        ordered = _core.OrderedGraph(placed, *graph.arcs, lengths, 2, True, 0.01, are_shared)
        coarse.append(_core.CoarseGraph(ordered, 8, 2).arcs())
    assert all(map(np.array_equal, *coarse))


def test_lengths_are_whole_units_of_which_all_arcs_have_48_bits():
    graph = sf.build_face_graph(shapes.bumpy_sheet(16)).with_weights(
        weights_of(shapes.bumpy_sheet(16))
    )
    assert np.array_equal(graph.lengths, np.rint(graph.lengths))
    assert 2**47 <= graph.weights.sum() / graph.unit < 2**48
    assert np.abs(graph.lengths * graph.unit - graph.weights).max() <= graph.weights.max() * 2**-20


def test_a_weight_of_zero_is_one_unit_so_that_paths_grow():
    graph = shapes.line_graph([0.0, 1.0])
    assert graph.lengths.tolist() == [1, 1, 2**46, 2**46]
    assert shapes.line_graph([0.0, 0.0]).lengths.tolist() == [1, 1, 1, 1]


def test_weights_are_checked_where_the_arcs_need_not_be():
    graph = sf.build_face_graph(shapes.fold(90))
    with pytest.raises(ValueError, match=r"weights\[1\] must be finite and not negative, got nan"):
        graph.with_weights([1.0, math.nan])
    with pytest.raises(ValueError, match=r"weights\[0\] must be finite and not negative, got inf"):
        graph.with_weights([math.inf, 1.0])
    with pytest.raises(ValueError, match=r"one value per arc, shape \(2,\), got \(3,\)"):
        graph.with_weights([1.0] * 3)
    with pytest.raises(
        ValueError,
        match=r"the largest value of weights must be 1e-150 to 1e\+150, got 1e\+200:"
        r" rescale the values",
    ):
        graph.with_weights([1e200, 1.0])


def test_weights_of_a_graph_must_be_finite_and_not_negative():
    for bad in (-1.0, math.nan, math.inf):
        message = rf"weights\[0\] must be finite and not negative, got {bad}"
        with pytest.raises(ValueError, match=message):
            shapes.line_graph([bad])
    with pytest.raises(TypeError, match="weights must contain numbers, got complex128"):
        shapes.line_graph([1j])
    with pytest.raises(ValueError, match=r"one value per arc, shape \(2,\), got \(1,\)"):
        sf.CellGraph([[0, 0, 0], [1, 0, 0]], [1, 1], [0, 1, 2], [1, 0], [1.0])


def test_a_crease_length_takes_the_place_of_that_of_every_edge():
    mesh = shapes.fold(90)  # an edge of 2
    own = weights_of(mesh, alpha=10)
    assert weights_of(mesh, alpha=10, crease_length=2.0) == pytest.approx(own)
    assert weights_of(mesh, alpha=10, crease_length=4.0) == pytest.approx(
        weights_of(mesh, alpha=20)
    )
    with pytest.raises(ValueError, match="crease_length must be finite and positive"):
        weights_of(mesh, crease_length=0)


def refined(mesh):
    """Split each triangle into four at the midpoints of its edges."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
    corners = np.stack([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]).transpose(2, 0, 1, 3)
    return sf.Mesh(corners.reshape(-1, 3), np.arange(12 * mesh.n_faces).reshape(-1, 3))


@pytest.mark.parametrize(("weights", "ratio"), [("creases", 1.0), ("superfacets", 0.5)])
def test_a_crease_costs_the_same_on_a_finer_mesh_with_creases_alone(weights, ratio):
    """Compare the cost of crossing the fold, minus the cost of distance."""
    prices = []
    for mesh in (shapes.fold(90), refined(shapes.fold(90))):
        graph = sf.build_face_graph(mesh)
        chosen = [
            weights_module.arc_weights(
                Surface.of_faces(mesh, graph, 1),
                graph,
                0.3,
                WeightOptions.checked(sf.Weights(weights, alpha=alpha, eta_convex=1.0), None),
            ).weights
            for alpha in (0.0, 100.0)
        ]
        prices.append(np.max(chosen[1] - chosen[0]))
    assert prices[1] / prices[0] == pytest.approx(ratio)


def test_segment_uses_the_expected_radius_for_creases():
    mesh = shapes.bumpy_sheet(16)
    graph = sf.build_face_graph(mesh)
    creases = sf.Weights("creases", eta_convex=0.1)
    result = sf.segment(mesh, 9, weights=creases, alpha=30.0, denoise=0)
    radius = result.params["radius"]
    weights = superfacet_weights(mesh, graph, alpha=30.0, eta_convex=0.1, crease_length=radius)
    assert np.array_equal(sf.segment(mesh, 9, weights=weights, denoise=0).labels, result.labels)
    assert result.params["weights"] == "creases"
    flat = sf.Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])  # without area, r is 0
    assert sf.segment(flat, 1, weights="creases").labels.tolist() == [0]


def test_crease_weights_have_the_radius_for_the_edge():
    for degrees in (0, 90, -90, 30):
        mesh = shapes.fold(degrees)
        eta = 1.0 if degrees > 0 else 0.25
        angular = 20 * eta * 7.0 * abs(degrees) / 180  # alpha eta r theta / pi
        weights = sf.crease_weights(mesh, sf.build_face_graph(mesh), 7.0, eta_convex=0.25, ridges=0)
        expected = (GEODESIC_OF_FOLD + angular) / diagonal_of_fold(degrees)
        assert weights == pytest.approx([expected, expected])


@pytest.mark.parametrize(
    ("radius", "options"),
    [(-1.0, {}), (math.inf, {}), (1.0, {"alpha": -1}), (1.0, {"eta_convex": math.nan})],
)
def test_crease_weights_refuse_wrong_numbers(radius, options):
    mesh = shapes.fold(30)
    with pytest.raises(ValueError, match="must be finite and"):
        sf.crease_weights(mesh, sf.build_face_graph(mesh), radius, **options)


def test_one_entry_of_the_table_makes_a_weight_known_everywhere(monkeypatch):
    from superfacets_cli.segment import segment_command

    assert get_args(weights_module.WeightName) == tuple(WEIGHTS)
    option = next(o for o in segment_command.params if o.name == "weights")
    assert option.type.choices == tuple(WEIGHTS)
    page = Path(__file__).parents[2].joinpath("docs/parameters.md").read_text(encoding="utf-8")
    texts = {"--weights": option.help, "Weights": sf.Weights.__doc__, "parameters.md": page}
    for name, weight in WEIGHTS.items():
        assert [where for where, text in texts.items() if name not in text] == [], name
        assert f"- ``{name!r}``: {weight.about.split()[0]}" in sf.segment.__doc__
    paper = WEIGHTS["superfacets"]
    doubled = dataclasses.replace(
        paper, compute=lambda *given: ArcWeights(2 * paper.compute(*given).weights)
    )
    monkeypatch.setattr(weights_module, "WEIGHTS", {**WEIGHTS, "doubled": doubled})
    mesh = shapes.bumpy_sheet()
    result = sf.segment(mesh, 3, weights="doubled")
    assert result.params["weights"] == "doubled"
    assert np.array_equal(result.labels, sf.segment(mesh, 3, weights="superfacets").labels)
    with pytest.raises(ValueError, match=r"weights must be one of parts,.* doubled"):
        sf.segment(mesh, 3, weights="other")
