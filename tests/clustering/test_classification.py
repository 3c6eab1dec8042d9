"""Stage 4a: labels on graphs small enough to follow every path."""

import heapq
import os
import subprocess
import sys

import numpy as np
import pytest
import shapes

from superfacets import CellGraph, build_face_graph, classify, segment_graph


def test_each_cell_gets_the_center_with_the_shortest_path():
    line = shapes.line_graph([1.0, 5.0, 1.0, 1.0])
    labels, centers, distances = classify(line, [0, 4])
    assert labels.tolist() == [0, 0, 1, 1, 1]
    assert centers.tolist() == [0, 4]
    assert distances.tolist() == [0, 1, 2, 1, 0]
    assert labels.dtype == centers.dtype == np.int32


def test_equal_distances_go_to_the_lower_label():
    line = shapes.line_graph([1.0, 1.0])
    assert classify(line, [0, 2]).labels.tolist() == [0, 0, 1]
    assert classify(line, [2, 0]).labels.tolist() == [1, 0, 0]
    assert classify(line, [2, 0], reach=10).labels.tolist() == [1, 0, 0]


def test_a_tie_is_passed_on_to_the_cells_behind_it():
    """Cell 2 is equally far from 0 and 1. Cell 3 is behind 2, and must get the label of 2."""
    star = CellGraph(
        np.arange(12).reshape(4, 3), [1] * 4, [0, 1, 2, 5, 6], [2, 2, 0, 1, 3, 2], [1.0] * 6
    )
    for centers in ([0, 1], [1, 0]):
        for reach in (None, 100.0):
            labels = classify(star, centers, reach=reach).labels
            assert labels[2] == labels[3] == 0


def test_a_component_without_a_center_becomes_one_region_of_its_own():
    graph = build_face_graph(shapes.two_islands())
    cells = graph.with_weights(np.ones(graph.n_arcs))
    labels, centers, distances = classify(cells, [1])
    assert labels.tolist() == [0] * 4 + [1] * 4
    assert centers.tolist() == [1, 4]
    assert distances.tolist() == [1, 0, 1, 2, 0, 1, 2, 3]


def test_an_expansion_labels_the_first_cells_out_of_reach_and_halts():
    line = shapes.line_graph([1.0] * 6)
    labels, centers, _ = classify(line, [0], reach=1.0)
    # Cells 0 and 1 are within reach of center 0, so 2 gets its label, and 3 becomes a center. It
    # reaches 1 to 5, and is nearer to 2. Then 6 becomes a center, and is nearer to 5.
    assert labels.tolist() == [0, 0, 1, 1, 1, 2, 2]
    assert centers.tolist() == [0, 3, 6]


def test_an_orphan_takes_cells_that_it_is_nearer_to():
    line = shapes.line_graph([1.0, 9.0, 1.0])
    labels, centers, _ = classify(line, [0], reach=1.0)
    assert centers.tolist() == [0, 3]
    assert labels.tolist() == [0, 0, 1, 1]


def test_the_bound_is_euclidean_and_not_along_the_path():
    """Arcs that weigh a thousand times their length do not halt an expansion."""
    line = shapes.line_graph([1000.0] * 4)
    assert classify(line, [0], reach=3.0).centers.tolist() == [0]


def test_a_reach_of_zero_labels_the_neighbors_of_each_center():
    line = shapes.line_graph([1.0] * 4)
    assert classify(line, [2], reach=0).labels.tolist() == [1, 0, 0, 0, 2]


def test_every_cell_can_be_a_center():
    line = shapes.line_graph([1.0] * 4)
    for reach in (None, 3.0):
        assert classify(line, [4, 3, 2, 1, 0], reach=reach).labels.tolist() == [4, 3, 2, 1, 0]


def test_one_unit_decides_between_paths_longer_than_a_float_can_count():
    """Both ends of a row of 40 arcs of at least 2^23 units are equally far from the middle."""
    weights = [1.0] * 40
    graph = shapes.line_graph(weights)
    assert classify(graph, [0, 40]).labels[20] == 0
    assert graph.unit <= 2.0**-23
    weights[3] += 2.0**-23  # the last bit of 1.0 as a float
    assert classify(shapes.line_graph(weights), [0, 40]).labels[20] == 1


@pytest.mark.parametrize("heavy", [1e3, 1e6, 1e9, 1e30])
def test_a_few_huge_weights_cost_no_time(heavy):
    graph = build_face_graph(shapes.bumpy_sheet(60))
    rng = np.random.default_rng(0)
    weights = rng.uniform(1, 2, graph.n_arcs)
    weights[rng.uniform(size=graph.n_arcs) < 0.01] *= heavy
    cells = graph.with_weights(weights)
    check_labels(cells, [0, 99, 5000])


def test_cells_behind_a_heavy_arc_are_reached_in_order():
    ends = [(i, j, (j - i) ** 2.0) for i in range(300) for j in range(i + 1, min(300, i + 41))]
    low, high, costs = np.array([*ends, (299, 300, 1e8), (300, 301, 1), (301, 302, 1)]).T
    arcs = np.array([[*low, *high], [*high, *low], [*costs, *costs]])
    sources, targets, weights = arcs[:, np.lexsort(arcs[1::-1])]
    offsets = np.searchsorted(sources, np.arange(304))
    graph = CellGraph(np.zeros((303, 3)), np.ones(303), offsets, targets.astype(int), weights)
    check_labels(graph, [0, 150])


def test_cells_behind_arcs_thousands_of_times_the_mean_wait_for_their_turn():
    """A row of short arcs, with three cells at one end that are connected by very long arcs."""
    n = 5000
    row = shapes.line_graph([1.0] * (n - 1))
    hanging = [3e5, 1e5, 2e5]
    offsets = np.concatenate([[0], row.offsets[1:] + 3, row.n_arcs + 3 + np.arange(1, 4)])
    neighbors = np.concatenate([[n, n + 1, n + 2], row.neighbors, [0, 0, 0]])
    weights = np.concatenate([hanging, row.weights, hanging])
    graph = CellGraph(np.zeros((n + 3, 3)), np.ones(n + 3), offsets, neighbors, weights)
    check_labels(graph, [0, n - 1])


OUT_OF_MEMORY_IN_THREADS = """
import resource
import numpy as np
from superfacets import CellGraph, classify
n = 4_000_000
graph = CellGraph(np.zeros((n, 3)), np.ones(n), np.zeros(n + 1, int), [], [])
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 150_000_000,) * 2)
try:
    classify(graph, np.arange(64), reach=1.0, n_threads=4)
except MemoryError:
    print("MemoryError")
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits memory as Linux does")
@pytest.mark.skipif("san.so" in os.environ.get("LD_PRELOAD", ""), reason="a sanitizer aborts then")
def test_running_out_of_memory_in_a_thread_is_a_memory_error():
    done = subprocess.run(
        [sys.executable, "-c", OUT_OF_MEMORY_IN_THREADS], capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (done.stdout, done.stderr, done.returncode) == ("MemoryError\n", "", 0)


def check_labels(graph, centers):
    labels, lengths = reference_labels(graph, centers)
    result = classify(graph, centers)
    assert result.labels.tolist() == labels
    assert np.array_equal(result.distances, np.array(lengths) * graph.unit)


def reference_labels(graph, centers):
    """Return labels and path lengths in units, computed with a binary heap."""
    best = {}
    queue = [(0, label, center) for label, center in enumerate(centers)]
    while queue:
        length, label, cell = heapq.heappop(queue)
        if cell in best:
            continue
        best[cell] = (length, label)
        for arc in range(graph.offsets[cell], graph.offsets[cell + 1]):
            step = int(graph.lengths[arc])
            heapq.heappush(queue, (length + step, label, int(graph.neighbors[arc])))
    lengths, labels = zip(*(best[cell] for cell in range(graph.n_cells)), strict=True)
    return list(labels), list(lengths)


def test_one_way_arcs_leave_orphans_that_become_centers():
    chain = CellGraph(
        [[x, 0, 0] for x in range(6)], [1] * 6, [0, 1, 2, 3, 4, 5, 5], [1, 2, 3, 4, 5], [1.0] * 5
    )
    assert classify(chain, [2]).centers.tolist() == [2, 0]
    result = segment_graph(chain, init=[0], tol=0)
    again = classify(chain, result.centers)
    assert np.array_equal(result.labels, again.labels)
    assert np.array_equal(result.centers, again.centers)


def test_wrong_centers_and_reach_are_refused():
    line = shapes.line_graph([1.0] * 4)
    with pytest.raises(ValueError, match=r"centers\[0\] must be 0 to 4, got 9"):
        classify(line, [9])
    with pytest.raises(ValueError, match="reach must be finite and not negative"):
        classify(line, [0], reach=-1)


@pytest.mark.parametrize("reach", [None, 0.5])
def test_labels_do_not_depend_on_the_number_of_threads(reach):
    graph = shapes.random_graph(3000, 9000, seed=3, weight_values=[1.0, 2.0])
    centers = np.arange(0, 3000, 20)
    one, *others = (classify(graph, centers, reach=reach, n_threads=n) for n in (1, 2, 8))
    for other in others:
        assert np.array_equal(one.labels, other.labels)
        assert np.array_equal(one.centers, other.centers)
        assert np.array_equal(one.distances, other.distances)
