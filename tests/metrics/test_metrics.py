"""Test metrics against values computed by hand, and their invariance to scale and face order."""

import math
import re

import numpy as np
import pytest
import shapes

from superfacets import Mesh, MeshError, PointCloud, TetMesh, build_face_graph, sample_mesh, segment
from superfacets.metrics import (
    GroundTruths,
    achievable_accuracy,
    achievable_iou,
    area_overlap,
    compactness,
    evaluate,
    evaluate_vertices,
    undersegmentation_error,
)
from superfacets.metrics.borders import MeshEdges
from superfacets.metrics.overlap import consistency_error, hamming_distance, rand_index

# Regions 0 (area 4) and 1 (area 6) against segments 0 (area 7) and 1 (area 3):
#             segment 0   segment 1
# region 0        4           0
# region 1        3           3
HALVED = area_overlap([0, 1, 1], [0, 0, 1], [4.0, 3.0, 3.0])


def explained_variation(mesh, labels):
    return evaluate(mesh, labels)["explained_variation"]


def cut_discrepancy(mesh, labels, truth):
    return evaluate(mesh, labels, [truth])["cut_discrepancy"]


def boundary_agreement(mesh, labels, truth, **options):
    values = evaluate(mesh, labels, [truth], **options)
    return values["boundary_recall"], values["boundary_precision"]


def test_overlap_is_a_sparse_table():
    assert HALVED.regions.tolist() == [0, 1, 1]
    assert HALVED.segments.tolist() == [0, 0, 1]
    assert HALVED.areas.tolist() == [4, 3, 3]
    assert HALVED.region_areas.tolist() == [4, 6]
    assert HALVED.segment_areas.tolist() == [7, 3]
    assert HALVED.total == 10


def test_a_table_of_many_labels_is_the_same_as_of_few():
    rng = np.random.default_rng(0)
    labels, truth = rng.integers(0, 200, (2, 3000))
    areas = rng.random(3000)
    sparse = area_overlap(labels, truth, areas)  # 200 * 200 pairs: more than 4 per face
    table = np.zeros((200, 200))
    np.add.at(table, (labels, truth), areas)
    assert np.array_equal(np.argwhere(table), np.stack([sparse.regions, sparse.segments], 1))
    assert sparse.areas == pytest.approx(table[table > 0])


def test_undersegmentation_error_by_hand():
    # Segment 0: region 0 leaks 0, region 1 leaks 3. Segment 1: region 1 leaks 3.
    assert undersegmentation_error(HALVED) == pytest.approx(6 / 10)
    # An overlap of exactly half does not exceed half.
    assert undersegmentation_error(HALVED, tolerance=0.5) == 0


@pytest.mark.parametrize(("overlap", "error"), [(0.049, 0.049), (0.051, 1.0)])
def test_an_overlap_of_less_than_a_twentieth_of_the_region_does_not_count(overlap, error):
    table = area_overlap([0, 0], [0, 1], [1 - overlap, overlap])
    assert undersegmentation_error(table) == pytest.approx(error)


def test_the_metrics_of_the_princeton_benchmark_by_hand():
    assert achievable_accuracy(HALVED) == pytest.approx((4 + 3) / 10)
    # Segment 0 is best covered by region 0 (4 of 7), segment 1 by region 1 (3 of 3).
    assert hamming_distance(HALVED) == pytest.approx((0.3, 0.3, 0.3))
    # P(two points together): in regions 0.16 + 0.36, in segments 0.49 + 0.09, both 0.16 + 2 * 0.09.
    assert rand_index(HALVED) == pytest.approx(1 - 0.52 - 0.58 + 2 * 0.34)
    # Of regions: 6 of 10 points at 1/2. Of segments: 4 at 3/7, 3 at 4/7. The lower one: 0, 3/6, 0.
    of_whole, of_points = consistency_error(HALVED)
    assert of_whole == pytest.approx(min(0.3, (4 * 3 / 7 + 3 * 4 / 7) / 10))
    assert of_points == pytest.approx(3 * 0.5 / 10)


def test_the_achievable_iou_counts_what_regions_add_to_a_segment_and_take_from_it():
    # Both regions get segment 0, which is 7 of their 10. No region gets segment 1.
    assert achievable_iou(HALVED) == pytest.approx(np.mean([7 / 10, 0]))
    lost = area_overlap([0, 0, 1], [0, 1, 0], [2.0, 1.0, 1.0])
    assert achievable_iou(lost) == pytest.approx(np.mean([3 / 4, 0]))
    tied = area_overlap([0, 0], [0, 1], [1.0, 1.0])
    assert achievable_iou(tied) == pytest.approx(np.mean([1 / 2, 0]))  # the lower segment
    gone = area_overlap([0, 1, 2], [0, 1, 2], [1.0, 0.0, 2.0])
    assert achievable_iou(gone) == 1  # a segment of area 0 does not count
    areas = np.random.default_rng(47).random(6)  # their sums differ by rounding
    assert achievable_iou(area_overlap(np.arange(6) // 2, np.zeros(6, int), areas)) == 1


def test_labels_that_refine_the_truth_have_no_error():
    refined = area_overlap([0, 1, 2, 2], [0, 0, 1, 1], [1.0, 2.0, 3.0, 4.0])
    assert undersegmentation_error(refined) == 0
    assert achievable_accuracy(refined) == 1
    assert consistency_error(refined) == (0, 0)
    assert hamming_distance(refined) == pytest.approx((0.05, 0.1, 0))


def test_labels_that_are_the_truth_are_perfect():
    mesh = shapes.bumpy_sheet(8)
    truth = segment(mesh, 4).labels
    values = evaluate(mesh, truth[::1] + 5, [truth])
    for name in (
        "achievable_accuracy", "achievable_iou", "rand_index", "boundary_recall",
        "boundary_precision",
    ):  # fmt: skip
        assert values[name] == pytest.approx(1), name
    for name in (
        "undersegmentation_error", "hamming_distance", "missing_rate", "false_alarm_rate",
        "global_consistency_error", "local_consistency_error", "cut_discrepancy",
    ):  # fmt: skip
        assert values[name] == pytest.approx(0), name
    assert values["n_regions"] == 4
    assert values["n_extra_pieces"] == 0


def test_compactness_of_a_cube_by_hand():
    sides = np.arange(12) // 2
    assert compactness(shapes.cube(), sides) == pytest.approx(4)
    assert compactness(shapes.cube(), 1 * (sides == 0)) == pytest.approx((4 / math.sqrt(5) + 4) / 2)
    assert compactness(shapes.cube(), np.zeros(12, dtype=int)) == 0  # closed: no border


def test_the_boundary_of_an_open_mesh_counts_as_perimeter():
    strip = shapes.strip(4)  # 2 by 1
    assert compactness(strip, [0, 0, 0, 0]) == pytest.approx(6 / math.sqrt(2))
    assert compactness(strip, [0, 0, 1, 1]) == pytest.approx(4)


def test_an_edge_counts_once_for_each_region_around_it_even_if_it_is_not_manifold():
    """Three right triangles on one edge: two of one region, one of another."""
    vertices = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0]]
    fan = Mesh(vertices, [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    of_two = (2 * (1 + math.sqrt(2)) + 1) / 1.0
    of_one = (2 + math.sqrt(2)) / math.sqrt(0.5)
    assert compactness(fan, [0, 0, 1]) == pytest.approx((of_two + of_one) / 2)
    of_all = 3 * (1 + math.sqrt(2)) / math.sqrt(1.5)  # it has all of the faces on the edge
    assert compactness(fan, [0, 0, 0]) == pytest.approx(of_all)


def test_regions_without_area_have_no_compactness():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]], [[0, 1, 2], [0, 1, 3]])
    assert compactness(mesh, [0, 1]) == compactness(Mesh(mesh.vertices, [[0, 1, 2]]), [0])


def test_explained_variation_by_hand():
    cube = shapes.cube()
    assert explained_variation(cube, np.arange(12) // 2) == pytest.approx(1)
    assert explained_variation(cube, np.zeros(12, dtype=int)) == pytest.approx(0)
    # The normals of three pairs of opposite sides cancel: nothing explained by any such pair.
    assert explained_variation(cube, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2]) == pytest.approx(0)
    # Three sides at a corner: area 3, sum of normals (1, 1, 1): variation 3 - 3 / 3 = 2 of 3 each.
    corner = np.array([0, 1, 0, 1, 0, 1]).repeat(2)
    assert explained_variation(cube, corner) == pytest.approx(1 - 4 / 6)
    assert explained_variation(shapes.strip(4), [0, 1, 0, 1]) == 1  # flat


def cylinder_rows(n_around=12, n_rows=9, height=0.1):
    """A closed strip of rows of quads around a prism, row by row from below; faces by row."""
    angles = 2 * math.pi * np.arange(n_around) / n_around
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    vertices = [[*xy, height * row] for row in range(n_rows + 1) for xy in ring.tolist()]
    faces = []
    for row in range(n_rows):
        for step in range(n_around):
            a, b = row * n_around + step, row * n_around + (step + 1) % n_around
            faces += [[a, b, b + n_around], [a, b + n_around, a + n_around]]
    return Mesh(vertices, faces), np.arange(n_rows).repeat(2 * n_around)


def test_borders_a_row_apart_are_found_within_its_height():
    mesh, rows = cylinder_rows()
    diagonal = build_face_graph(mesh).diagonal
    found, true = 1 * (rows >= 4), 1 * (rows >= 5)  # one ring each, 0.1 apart
    for tolerance, share in [(0.099, 0.0), (0.101, 1.0)]:
        agreement = boundary_agreement(mesh, found, true, tolerance=tolerance / diagonal)
        assert agreement == (share, share)


def test_recall_and_precision_go_by_length():
    mesh, rows = cylinder_rows()
    agreement = boundary_agreement(
        mesh, rows // 3, 1 * (rows >= 3), tolerance=0
    )  # rings at 3, 6; at 3
    assert agreement == pytest.approx((1.0, 0.5))
    agreement = boundary_agreement(mesh, 1 * (rows >= 3), rows // 3, tolerance=0)
    assert agreement == pytest.approx((0.5, 1.0))


def test_cut_discrepancy_by_hand():
    mesh, rows = cylinder_rows()
    radius = MeshEdges.of(mesh, weld=True, n_threads=1).mean_radius
    assert cut_discrepancy(mesh, 1 * (rows >= 4), 1 * (rows >= 5)) == pytest.approx(0.2 / radius)
    # There: rings at 3 (0) and 6 (0.3), on the mean 0.15. Back: 0.
    assert cut_discrepancy(mesh, rows // 3, 1 * (rows >= 3)) == pytest.approx(0.15 / radius)


def test_where_there_is_no_way_to_a_border_the_diagonal_counts():
    islands = shapes.two_islands()
    surface = MeshEdges.of(islands, weld=True, n_threads=1)
    far = surface.graph.diagonal / surface.mean_radius
    one, other = np.zeros((2, 8), dtype=int)
    one[2:4], other[6:] = 1, 1  # a border on one island each
    assert cut_discrepancy(islands, one, other) == pytest.approx(2 * far)
    assert cut_discrepancy(islands, one, np.zeros(8, dtype=int)) == pytest.approx(far)
    none = np.zeros(8, dtype=int)
    assert cut_discrepancy(islands, none, none) == 0
    assert boundary_agreement(islands, none, one) == (0, 1)
    assert boundary_agreement(islands, one, none) == (1, 0)


def test_extra_pieces_are_counted():
    mesh = shapes.strip(6)
    assert evaluate(mesh, [0, 1, 0, 1, 1, 0])["n_extra_pieces"] == 3
    assert evaluate(shapes.two_islands(), [3] * 8)["n_extra_pieces"] == 1


def test_nothing_depends_on_names_of_labels_order_of_faces_scale_or_threads():
    mesh = sample_mesh(3_000)
    labels, truth = segment(mesh, 40).labels, segment(mesh, 7).labels
    expected = evaluate(mesh, labels, [truth], n_threads=1)
    rng = np.random.default_rng(1)
    order = rng.permutation(mesh.n_faces)
    changed = Mesh(7.5 * mesh.vertices[:, [1, 2, 0]] + 3, mesh.faces[order])
    renamed = rng.permutation(40)[labels] * 10
    values = evaluate(changed, renamed[order], [9 - truth[order]], n_threads=3)
    assert values == pytest.approx(expected, rel=1e-6)  # paths keep 24 bits of each edge's length


def test_soup_is_measured_as_if_welded():
    mesh = sample_mesh(3_000)
    labels, truth = segment(mesh, 40).labels, segment(mesh, 7).labels
    soup = Mesh(
        mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3)
    )
    assert evaluate(soup, labels, [truth]) == pytest.approx(evaluate(mesh, labels, [truth]))
    assert evaluate(soup, labels, weld=False)["n_extra_pieces"] == mesh.n_faces - 40


def test_several_ground_truths_are_averaged_and_may_be_prepared():
    mesh = sample_mesh(3_000)
    labels = segment(mesh, 40).labels
    truths = [segment(mesh, k).labels for k in (5, 9)]
    each = [evaluate(mesh, labels, [truth]) for truth in truths]
    prepared = GroundTruths(mesh, truths)
    assert repr(prepared) == f"GroundTruths(2 of {mesh.n_faces} faces)"
    both = evaluate(mesh, labels, prepared)
    assert both == evaluate(mesh, labels, truths)
    assert both == evaluate((mesh.vertices, mesh.faces), labels, prepared)
    assert both == pytest.approx({k: (each[0][k] + each[1][k]) / 2 for k in both})


def test_single_metrics_are_those_of_evaluate():
    mesh = sample_mesh(3_000)
    labels, truth = segment(mesh, 40).labels, segment(mesh, 7).labels
    values = evaluate(mesh, labels, [truth])
    overlap = area_overlap(labels, truth, build_face_graph(mesh).measures)
    assert undersegmentation_error(overlap) == values["undersegmentation_error"]
    assert compactness(mesh, labels) == values["compactness"]


def test_what_cannot_be_measured_is_refused():
    mesh = shapes.strip(4)
    flat = Mesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    for labels, truths in (([0] * 3, ()), ([0] * 4, [[0] * 3])):
        with pytest.raises(ValueError, match=r"one value per cell \(4\), got 3 values"):
            evaluate(mesh, labels, truths)
    per_vertex = [0] * mesh.n_vertices
    for call in (
        lambda: evaluate(mesh, per_vertex), lambda: evaluate(mesh, [0] * 4, [per_vertex]),
        lambda: undersegmentation_error(mesh, per_vertex, [0] * 4),
        lambda: undersegmentation_error(mesh, [0] * 4, per_vertex),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"\(4\), got 6 values\. For one label per vertex"):
            call()
    with pytest.raises(TypeError, match="labels must contain integers, got float64"):
        compactness(mesh, [0.5] * 4)
    with pytest.raises(ValueError, match="tolerance must be finite and not negative"):
        boundary_agreement(mesh, [0] * 4, [0] * 4, tolerance=-1)
    with pytest.raises(ValueError, match=r"tolerance must be from 0 to 1, got 1\.5"):
        undersegmentation_error(HALVED, tolerance=1.5)
    with pytest.raises(ValueError, match="prepared for another mesh"):
        evaluate(mesh, [0] * 4, GroundTruths(shapes.moebius(2), [[0] * 4]))
    other = segment(mesh, 2, max_num_iter=1)
    assert evaluate(mesh, other.labels, other)["achievable_accuracy"] == 1
    for truths in ([0] * 4, 5):
        message = "ground_truths must be an array of one label per face, or a sequence of such"
        with pytest.raises(TypeError, match=re.escape(f"{message} arrays, got {truths}")):
            evaluate(mesh, [0] * 4, truths)
    no_area = "the total area must be positive, but all cells have area 0"
    for measure in (compactness, evaluate):
        with pytest.raises(ValueError, match=no_area):
            measure(flat, [0])
    with pytest.raises(ValueError, match=no_area):
        area_overlap([0], [0], [0.0])


def test_one_triangle_has_all_metrics():
    values = evaluate(Mesh([[0, 0, 0], [3, 0, 0], [0, 4, 0]], [[0, 1, 2]]), [0], [[5]])
    assert values["cut_discrepancy"] == 0
    assert values["undersegmentation_error"] == 0
    assert values["compactness"] == pytest.approx(12 / math.sqrt(6))


def test_a_mesh_whose_faces_have_one_centroid_is_measured_by_its_diagonal():
    vertices = [[0.1, 0.2, 0.3], [3.1, 0.2, 0.3], [0.1, 4.2, 0.7]]
    double = Mesh(vertices, [[0, 1, 2], [0, 2, 1]])
    # The distance to labels without a border is the length of the diagonal.
    assert cut_discrepancy(double, [0, 1], [0, 0]) == pytest.approx(1)


@pytest.mark.parametrize("unit", [1.0, 0.7, 1.1, 0.1, 3e-7, 1 / 3, 1e20])
def test_an_overlap_of_exactly_the_tolerance_does_not_count_in_any_unit(unit):
    labels, truth = [0] * 20, [0] + [1] * 19
    overlap = area_overlap(labels, truth, np.full(20, unit))
    assert undersegmentation_error(overlap) == pytest.approx(0.05)
    more = area_overlap(labels, truth, unit * np.array([1 + 1e-6] + [1] * 19))
    assert undersegmentation_error(more) == pytest.approx(1, rel=1e-6)


def test_the_explained_variation_of_a_surface_that_is_all_but_flat_is_right():
    for height in (1e-3, 1e-4, 1e-5):
        mesh = shapes.bumpy_sheet(12)
        mesh = Mesh(mesh.vertices * [1, 1, height], mesh.faces)
        assert 0 <= explained_variation(mesh, np.zeros(mesh.n_faces, int)) < 1e-12
        labels = np.arange(mesh.n_faces) % 2
        steep = Mesh(mesh.vertices * [1, 1, 2], mesh.faces)
        expected = explained_variation(steep, labels)
        assert explained_variation(mesh, labels) == pytest.approx(expected, rel=1e-4)


def test_cells_in_no_region_are_no_region():
    mesh = shapes.strip(4)
    tets = TetMesh(shapes.two_tets().vertices, [[0, 1, 2, 3], [1, 2, 3, 4]])
    hole = [3, -1, 5, 5]
    values = evaluate(mesh, hole, [[0, 0, 0, 1]])
    assert compactness(mesh, hole) == values["compactness"]
    for metric in (undersegmentation_error, achievable_accuracy, achievable_iou):
        assert metric(mesh, hole, [0, 0, 0, 1]) == values[metric.__name__]
    for cells, n in ((mesh, 4), (tets, 2)):
        with pytest.raises(
            MeshError, match="labels must be 0 or greater for at least one cell, but all are -1"
        ):
            evaluate(cells, [-1] * n)
    with pytest.raises(
        MeshError, match="labels must be 0 or greater for at least one cell, but all are -1"
    ):
        evaluate_vertices(mesh, [-1] * 6)


@pytest.mark.parametrize("prepare", [lambda mesh, truth: [truth], GroundTruths])
def test_cells_in_no_region_are_left_out_and_counted(prepare):
    mesh = shapes.bumpy_sheet(6)
    labels, truth = np.arange(mesh.n_faces) // 9, np.arange(mesh.n_faces) // 15
    labels[:10], truth[20:22] = -1, -1
    values = evaluate(mesh, labels, prepare(mesh, truth))
    alone = evaluate(Mesh(mesh.vertices, mesh.faces[10:]), labels[10:], [truth[10:]])
    assert (values.pop("n_left_out"), alone.pop("n_left_out")) == (12, 2)
    assert values == pytest.approx(alone)
    body = PointCloud(mesh.vertices)
    of_points = np.r_[[-1] * 3, np.arange(body.n_points - 3) // 9]
    assert evaluate(body, of_points)["n_left_out"] == 3
    values = evaluate_vertices(mesh, of_points, [np.maximum(of_points, 0)])
    assert (repr(values["n_left_out"]), values["achievable_accuracy"]) == ("3", 1)


def test_unannotated_cells_are_left_out_of_every_comparison():
    mesh = shapes.strip(8)
    labels = np.array([0, 0, 0, 1, 1, 2, 2, 3])
    truth = np.array([0, 0, 1, 1, 1, 1, -1, -1])
    annotated = Mesh(mesh.vertices, mesh.faces[:6])
    areas = build_face_graph(mesh).measures
    values = evaluate(mesh, labels, [truth])
    alone = evaluate(annotated, labels[:6], [truth[:6]])
    scale = MeshEdges.of(mesh, weld=True, n_threads=1)
    scale_alone = MeshEdges.of(annotated, weld=True, n_threads=1)
    for name in sorted({*alone} - {*evaluate(mesh, labels)}):
        value = values[name]
        if name == "cut_discrepancy":  # relative to the radius of the whole surface
            value *= scale.mean_radius / scale_alone.mean_radius
        assert value == pytest.approx(alone[name]), name
    # The true border has one common vertex with the first of the two annotated borders.
    assert values["boundary_precision"] == pytest.approx(1 / 4)
    for overlap in (
        area_overlap(labels, truth, areas), area_overlap(labels[:6], truth[:6], areas[:6]),
    ):  # fmt: skip
        assert overlap.total == pytest.approx(areas[:6].sum())
        assert undersegmentation_error(overlap) == values["undersegmentation_error"]
    assert undersegmentation_error(mesh, labels, truth) == values["undersegmentation_error"]
    both = evaluate(mesh, labels, [truth, labels])
    assert both["undersegmentation_error"] == values["undersegmentation_error"] / 2


def test_a_truth_without_annotation_is_refused():
    mesh = shapes.strip(4)
    tets = TetMesh(np.r_[np.eye(3), [[0, 0, 0]]], [[0, 1, 2, 3]])
    for compare in (boundary_agreement, cut_discrepancy, undersegmentation_error):
        with pytest.raises(
            MeshError, match="truth must be 0 or greater for at least one cell, but all are -1"
        ):
            compare(mesh, [0] * 4, [-1] * 4)
        with pytest.raises(MeshError, match=r"truth\[1\] must be at least -1, got -2"):
            compare(mesh, [0] * 4, [0, -2, 0, 0])
    with pytest.raises(
        MeshError, match="truth must be 0 or greater for at least one cell, but all are -1"
    ):
        evaluate(tets, [0], [[-1]])
    with pytest.raises(
        ValueError, match="the total area must be positive, but all cells have area 0"
    ):
        area_overlap([0, 0], [0, -1], [0.0, 1.0])


def test_vertices_and_points_are_counted_and_faces_weighted_by_area():
    mesh = shapes.bumpy_sheet(8)
    stretched = Mesh(mesh.vertices * [1, 9, 1] + mesh.vertices**2, mesh.faces)
    rng = np.random.default_rng(0)
    for cells, n, compare in (
        (stretched, mesh.n_vertices, evaluate_vertices),
        (PointCloud(stretched.vertices), mesh.n_vertices, evaluate),
        (stretched, mesh.n_faces, evaluate),
    ):
        labels, truth = rng.integers(0, 9, n), rng.integers(-1, 4, n)
        areas = build_face_graph(stretched).measures if n == mesh.n_faces else np.ones(n)
        overlap = area_overlap(labels, truth, areas)
        values = compare(cells, labels, [truth])
        for metric in (undersegmentation_error, achievable_accuracy, achievable_iou, rand_index):
            assert values[metric.__name__] == pytest.approx(metric(overlap))
            if compare is evaluate and metric is not rand_index:
                assert metric(cells, labels, truth) == pytest.approx(metric(overlap))


def test_labels_of_vertices_are_compared_at_the_vertices():
    square = shapes.strip(4)
    truth = np.array([0, 0, 1, 1, -1, 1])
    labels = np.array([0, 0, 0, 1, 1, 2])
    values = evaluate_vertices(square, labels, [truth])
    overlap = area_overlap(labels, truth, np.ones(6))
    assert values["undersegmentation_error"] == pytest.approx(undersegmentation_error(overlap))
    assert values["rand_index"] == pytest.approx(rand_index(overlap))
    assert (values["n_regions"], values["n_extra_pieces"]) == (3, 0)
    assert "boundary_recall" not in values
    with pytest.raises(
        ValueError, match=r"truth must have one value per vertex \(6\), got 4 values"
    ):
        evaluate_vertices(square, labels, [[0] * 4])
    why = r"{} must have one value per cell \(4\), got one per vertex \(6\): use evaluate_v"
    with pytest.raises(MeshError, match=why.format("labels")):
        achievable_iou(square, labels, truth)
    with pytest.raises(MeshError, match=why.format("truth")):
        evaluate(square, labels[:4], [truth])
    with pytest.raises(MeshError, match="which evaluate_vertices needs: use evaluate"):
        evaluate_vertices(square.vertices, labels)


def test_regions_of_vertices_are_connected_along_edges_and_across_seams():
    mesh = shapes.bumpy_sheet(8)
    soup = Mesh(
        mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(3 * mesh.n_faces).reshape(-1, 3)
    )
    labels = (mesh.vertices[:, 0] > np.median(mesh.vertices[:, 0])).astype(int)
    assert evaluate_vertices(mesh, labels)["n_extra_pieces"] == 0
    assert evaluate_vertices(soup, labels[mesh.faces].ravel())["n_extra_pieces"] == 0
    labels[np.argmin(mesh.vertices[:, 0])] = 1
    assert evaluate_vertices(mesh, labels)["n_extra_pieces"] == 1
    loose = Mesh(np.r_[mesh.vertices, [[9, 9, 9]]], mesh.faces)
    values = evaluate_vertices(loose, [*labels, 7], [[*labels, 0]])
    assert (values["n_regions"], values["n_extra_pieces"]) == (2, 1)
    assert values["achievable_accuracy"] == 1
