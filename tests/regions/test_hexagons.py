"""Stages 3 to 6 on cells that are not triangles: hexagons of side 1, with values computed by hand.

A hexagon has an area of 3 sqrt(3) / 2, sides of length 1, and centers of neighbors are sqrt(3)
apart. A cell is named by its row and its place in the row; each row is shifted by half a cell.
"""

import math
import time

import numpy as np
import pytest
import shapes

import superfacets as sf
from superfacets import ArcMeasures, CellGraph, _core, metrics
from superfacets.cleanup.edit import read_labeled
from superfacets.graph.surface import arc_measures
from superfacets_show.colors import region_colors

AREA = 1.5 * math.sqrt(3.0)
STEP = math.sqrt(3.0)

# Steps from a cell to its neighbors, in rows and places.
TURNS = [(0, 1), (1, 0), (1, -1), (0, -1), (-1, 0), (-1, 1)]


def honeycomb(cells, crease=None, price=0.0):
    """Return the graph of hexagons; arcs within a set of `crease` cost `price` more."""
    index = {cell: i for i, cell in enumerate(cells)}
    offsets, neighbors, weights = [0], [], []
    for row, place in cells:
        for down, right in TURNS:
            other = (row + down, place + right)
            if other in index:
                neighbors.append(index[other])
                is_crease = crease is not None and {(row, place), other} in crease
                weights.append(STEP + price * is_crease)
        offsets.append(len(neighbors))
    positions = [[STEP * (place + 0.5 * row), 1.5 * row, 0.0] for row, place in cells]
    given = ArcMeasures(np.ones(len(neighbors)), open_lengths=6.0 - np.diff(offsets))
    return CellGraph(
        positions, np.full(len(cells), AREA), offsets, neighbors, weights, arc_measures=given
    )


def flower(row, place):
    return [(row, place)] + [(row + down, place + right) for down, right in TURNS]


def test_a_cell_has_six_sides_and_a_flower_eighteen():
    graph = honeycomb(flower(0, 0))
    assert metrics.compactness(graph, np.arange(7)) == pytest.approx(6 / math.sqrt(AREA))
    assert metrics.compactness(graph, np.zeros(7, int)) == pytest.approx(18 / math.sqrt(7 * AREA))
    petals = [0] + [1] * 6  # the ring of petals has an inner border too
    expected = 0.5 * (6 / math.sqrt(AREA) + 24 / math.sqrt(6 * AREA))
    assert metrics.compactness(graph, petals) == pytest.approx(expected)


def test_two_flowers_are_two_regions_around_their_middles():
    cells = flower(0, 0) + flower(-1, 3)  # the flowers touch along three sides
    graph = honeycomb(cells)
    result = sf.segment_graph(graph, 2, init=[0, 10])  # the center of one, a petal of the other
    assert result.labels.tolist() == [0] * 7 + [1] * 7
    assert result.centers.tolist() == [0, 7]
    assert result.params["radius"] == pytest.approx(math.sqrt(7 * AREA / math.pi))
    assert metrics.compactness(graph, result) == pytest.approx(18 / math.sqrt(7 * AREA))


ROW = [(0, place) for place in range(6)]


def test_a_piece_joins_the_neighbor_with_more_border():
    cells = [*ROW, (1, 2), (1, 3)]
    # Cell 3 touches cells 2 and 4 in the row, and cells 6 and 7 above it.
    edit = sf.enforce_connectivity(honeycomb(cells), [0, 0, 0, 1, 2, 1, 2, 2], centers=[0, 5, 4])
    assert edit.labels.tolist() == [0, 0, 0, 2, 2, 1, 2, 2]
    assert (edit.n_joined, edit.n_islands) == (1, 0)


def test_a_small_region_joins_over_a_plane_rather_than_a_crease():
    labels = [0, 0, 0, 1, 2, 2]
    assert sf.merge_small_regions(honeycomb(ROW), labels, 0.6).labels.tolist() == [0] * 4 + [1] * 2
    creased = honeycomb(ROW, crease=[{(0, 2), (0, 3)}], price=10.0)
    assert sf.merge_small_regions(creased, labels, 0.6).labels.tolist() == [0] * 3 + [1] * 3


def test_what_a_border_in_a_crease_costs():
    """With three regions, r = sqrt(6 A / (3 pi)), and a border counts exp(-price / (6 r))."""
    graph = honeycomb(ROW, crease=[{(0, 2), (0, 3)}], price=2.0)
    _, costs, labels, _ = read_labeled(graph, [0, 0, 0, 1, 1, 2], None, True, 1)
    low, high, lengths = _core.region_borders(*costs.args, labels, 1)
    assert (low.tolist(), high.tolist()) == ([0, 1], [1, 2])
    radius = math.sqrt(2 * AREA / math.pi)
    assert lengths == pytest.approx([math.exp(-2.0 / (6 * radius)), 1.0])


SHEET = [(row, place) for row in range(4) for place in range(6)]


def test_a_tooth_is_drawn_in():
    """The tooth has four sides to the other region and two to its own, so moving it saves two."""
    labels = np.array([0 if row < 2 else 1 for row, _ in SHEET])
    tooth = SHEET.index((2, 2))
    labels[tooth] = 0
    others = np.delete(np.arange(len(SHEET)), tooth)  # the outline costs nothing, so they stay
    smoothed = sf.smooth_borders(honeycomb(SHEET), labels, centers=others)
    assert smoothed.tolist() == [0] * 12 + [1] * 12


def test_cells_that_hold_their_region_together_stay():
    """In a bar of one row, each cell would shorten the border by leaving, but divide the bar."""
    bar = [SHEET.index((1, place)) for place in range(5)]
    labels = np.zeros(len(SHEET), int)
    labels[bar] = 1
    around = np.flatnonzero(labels == 0).tolist()
    graph = honeycomb(SHEET)
    smoothed = sf.smooth_borders(graph, labels, centers=[*around, bar[0], bar[-1]])
    assert np.flatnonzero(smoothed == 1).tolist() == bar
    smoothed = sf.smooth_borders(graph, labels, centers=[*around, bar[0]])
    assert np.flatnonzero(smoothed == 1).tolist() == bar[:1]  # one by one, from the end


def test_regions_of_hexagons_that_touch_have_different_colors():
    graph = honeycomb(SHEET)
    labels = sf.segment_graph(graph, 5).labels
    colors = region_colors(graph.arcs, labels)
    assert np.array_equal(sf.face_colors(graph, labels), colors[labels])
    sources = np.repeat(np.arange(graph.n_cells), np.diff(graph.offsets))
    across = labels[sources] != labels[graph.neighbors]
    pairs = zip(labels[sources][across], labels[graph.neighbors][across], strict=True)
    assert all((colors[a] != colors[b]).any() for a, b in pairs)


@pytest.mark.parametrize("use", [
    lambda graph: sf.smooth_borders(graph, [0, 1]),
    lambda graph: sf.enforce_connectivity(graph, [0, 1]),
    lambda graph: sf.merge_small_regions(graph, [0, 1], 0.5),
    lambda graph: metrics.compactness(graph, [0, 1]),
])  # fmt: skip
def test_a_graph_without_lengths_of_borders_is_refused(use):
    graph = CellGraph([[0, 0, 0], [1, 0, 0]], [1, 1], [0, 1, 2], [1, 0], [1, 1])
    with pytest.raises(
        ValueError,
        match=r"the CellGraph must have border lengths: make it with"
        r" arc_measures=ArcMeasures\(\.\.\.\)",
    ):
        use(graph)


@pytest.mark.parametrize(("given", "error", "message"), [
    ({"border_lengths": [1.0]}, ValueError, "border_lengths must have one value per arc"),
    ({"border_lengths": None}, TypeError, "border_lengths must contain numbers, got object"),
    ({"step_lengths": [1.0, -1.0]}, ValueError,
     r"step_lengths\[1\] must be finite and not negative, got -1.0"),
    ({"open_lengths": [1.0]}, ValueError, "open_lengths must have one value per cell"),
    ({"angles": [0.0]}, ValueError, "angles must have one value per arc"),
    ({"angles": [0.0, 4.0]}, ValueError, r"angles\[1\] must be from -pi to pi, got 4.0"),
    ({"angles": ["a", "b"]}, ValueError, "angles must contain numbers, got <U1"),
    ({"sides": [0]}, ValueError, r"sides must have shape \(2,\)"),
    ({"sides": [0, -1]}, ValueError, r"sides\[1\] must be not negative, got -1"),
    ({"sides": [0.0, 1.0]}, TypeError, "sides must contain integers, got float64"),
])  # fmt: skip
def test_wrong_measures_of_arcs_are_refused(given, error, message):
    measures = ArcMeasures(**{"border_lengths": [1.0, 1.0], **given})
    with pytest.raises(error, match=message):
        CellGraph([[0, 0, 0], [1, 0, 0]], [1, 1], [0, 1, 2], [1, 0], [1, 1], arc_measures=measures)


def test_sides_of_a_cell_must_rise():
    measures = ArcMeasures(np.ones(4), sides=[0, 1, 0, 0])
    with pytest.raises(
        ValueError, match="sides must be in ascending order for the arcs of each cell"
    ):
        CellGraph(
            np.eye(3), np.ones(3), [0, 1, 3, 4], [1, 0, 2, 1], np.ones(4), arc_measures=measures
        )


@pytest.mark.parametrize("shape", [shapes.bumpy_sheet(16), shapes.cube(), shapes.fins(4)])
def test_faces_given_as_cells_are_cleaned_as_those_of_the_mesh(shape):
    faces = sf.build_face_graph(shape)
    given = arc_measures(shape, faces)
    k = min(7, shape.n_faces // 2)
    radius = math.sqrt(faces.measures.sum() / (math.pi * k))
    weights = sf.crease_weights(shape, faces, radius)
    graph = CellGraph(
        faces.positions, faces.measures, faces.offsets, faces.neighbors, weights, faces.bounds,
        weight_unit=faces.diagonal, arc_measures=given,
    )  # fmt: skip
    rng = np.random.default_rng(0)
    labels = np.unique(rng.integers(0, k, shape.n_faces), return_inverse=True)[1]
    for edit in (sf.enforce_connectivity, lambda *a, **b: sf.merge_small_regions(*a, 0.9, **b)):
        expected = edit(shape, labels, weights=weights)
        assert edit(graph, labels).labels.tolist() == expected.labels.tolist()
    assert metrics.compactness(graph, labels) == pytest.approx(metrics.compactness(shape, labels))


def test_many_pieces_without_area_are_joined_in_next_to_no_time():
    """A strip and a tooth on each of its faces are all on one line, so the strip touches all teeth.

    Time used to grow with the square of their number: 24 seconds for 32,000 faces.
    """
    n = 40_000  # teeth 1 to n; behind the first is one more cell, which stays
    offsets = np.concatenate([[0, n, n + 2], n + 2 + np.arange(1, n), [2 * n + 2]])
    teeth = np.arange(1, n + 1)
    neighbors = np.concatenate([teeth, [0, n + 1], np.zeros(n - 1, int), [1]])
    positions = np.zeros((n + 2, 3))
    positions[:, 0] = np.arange(n + 2)
    graph = CellGraph(
        positions, np.zeros(n + 2), offsets, neighbors, np.ones(2 * n + 2),
        arc_measures=ArcMeasures(np.ones(2 * n + 2)),
    )  # fmt: skip
    labels = np.concatenate([[0], 1 + np.arange(n) % 2, [0]])
    begin = time.process_time()
    edit = sf.enforce_connectivity(graph, labels, centers=[n + 1, 1, 2])
    assert time.process_time() - begin < 5.0
    assert edit.n_joined == n - 1
    assert shapes.count_pieces(graph, edit.labels) == 3


def test_measures_of_arcs_are_copied_and_of_their_own_type():
    lengths = np.ones(2)
    graph = CellGraph(
        [[0, 0, 0], [1, 0, 0]], [1, 1], [0, 1, 2], [1, 0], [1, 1],
        arc_measures=ArcMeasures(lengths),
    )  # fmt: skip
    lengths[:] = np.nan
    assert graph.arc_measures.border_lengths.tolist() == [1.0, 1.0]
    with pytest.raises(TypeError, match="arc_measures must be an ArcMeasures object, got dict"):
        CellGraph([[0, 0, 0]], [1], [0, 0], [], [], arc_measures={})
