"""Stage 4b: centers of regions with known means."""

import numpy as np
import pytest
import reference
import shapes

from superfacets import CellGraph
from superfacets.clustering.update import update_centers


def test_the_center_is_the_cell_nearest_to_the_mean():
    line = shapes.line_graph([1.0] * 6)
    centers = update_centers(line, [0, 0, 0, 1, 1, 1, 1])
    assert centers.tolist() == [1, 4]  # the second mean, 4.5, is equally near to 5
    assert centers.dtype == np.int32


def test_the_mean_is_weighted_by_area():
    line = shapes.line_graph([1.0] * 4, measures=[1, 1, 1, 1, 8])
    assert update_centers(line, [0] * 5).tolist() == [3]  # the mean is (0+1+2+3+32)/12 = 3.17


def test_a_region_without_area_has_a_plain_mean():
    line = shapes.line_graph([1.0] * 4, measures=[1, 1, 0, 0, 0])
    assert update_centers(line, [0, 0, 1, 1, 1]).tolist() == [0, 3]


def test_a_center_may_lie_outside_the_region_it_came_from_but_never_of_its_own():
    line = shapes.line_graph([1.0] * 4)
    assert update_centers(line, [0, 1, 1, 1, 0]).tolist() == [0, 2]


@pytest.mark.parametrize(("labels", "error", "message"), [
    ([0, 0, 2, 2, 2], ValueError, "no cell has label 1"),
    ([0, 0, -1, 0, 0], ValueError, r"labels\[2\] must be 0 to 4 for 5 cells, got -1"),
    ([0, 0, 0, 0, 9], ValueError, r"labels\[4\] must be 0 to 4 for 5 cells, got 9"),
    ([0, 0, 0], ValueError, r"labels must have one value per cell \(5\), got 3 values"),
    ([0.0] * 5, TypeError, "labels must contain integers, got float64"),
    ([2**60] * 5, ValueError,
     r"labels\[0\] must be 0 to 4 for 5 cells, got 1152921504606846976"),
    ([2**63] * 5, ValueError,
     r"labels\[0\] must be 0 to 4 for 5 cells, got 9223372036854775808"),
])  # fmt: skip
def test_labels_with_gaps_or_faults_are_refused(labels, error, message):
    with pytest.raises(error, match=message):
        update_centers(shapes.line_graph([1.0] * 4), labels)


def test_many_cells_at_the_same_distance_have_the_center_of_the_twin():
    """Regions have points at few positions, so the tree search is abandoned for most regions."""
    rng = np.random.default_rng(0)
    n, k = 6000, 1500
    positions = rng.integers(0, 2, (n, 3))
    none = np.zeros(0, int)
    graph = CellGraph(positions, rng.integers(1, 4, n), np.zeros(n + 1, int), none, none)
    labels = np.concatenate([np.arange(k), rng.integers(0, k, n - k)])
    assert update_centers(graph, labels).tolist() == reference.update_centers(graph, labels)
