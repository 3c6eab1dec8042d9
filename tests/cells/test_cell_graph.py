"""Checks of cell graphs that users pass."""

import copy
import pickle

import numpy as np
import pytest

from superfacets import CellGraph, classify

PAIR = {
    "positions": [[0, 0, 0], [3, 4, 0]], "measures": [1, 1], "offsets": [0, 1, 2],
    "neighbors": [1, 0], "weights": [1, 1],
}  # fmt: skip


def test_lists_become_arrays_of_exact_types():
    graph = CellGraph(**PAIR)
    types = [graph.positions, graph.measures, graph.offsets, graph.neighbors, graph.weights]
    assert [a.dtype.name for a in types] == ["float64", "float64", "int64", "int32", "float64"]
    assert graph.diagonal == 5
    assert repr(graph) == "CellGraph(2 cells, 2 arcs)"


@pytest.mark.parametrize(("change", "message"), [
    ({"positions": [[0, 0]]}, r"positions must have shape \(N, 3\)"),
    ({"positions": np.zeros((0, 3))}, r"positions must have shape \(N, 3\) with N >= 1"),
    ({"positions": [[0, 0, 0], [np.nan, 0, 0]]},
     r"positions\[1\] must be finite, got \[nan, 0.0, 0.0\]"),
    ({"measures": [1]}, r"measures must have one value per cell, shape \(2,\), got \(1,\)"),
    ({"measures": [1, -1]}, r"measures\[1\] must be finite and not negative, got -1.0"),
    ({"offsets": [0, 1]}, r"offsets must have shape \(3,\)"),
    ({"offsets": [0, 2, 1]}, "offsets must increase from 0 to 2, the number of arcs"),
    ({"offsets": [1, 1, 2]}, "offsets must increase from 0"),
    ({"offsets": [0, 1, 3]}, "offsets must increase from 0"),
    ({"neighbors": [1, 2]}, r"neighbors\[1\] must be 0 to 1, got 2"),
    ({"neighbors": [1, -1]}, r"neighbors\[1\] must be 0 to 1, got -1"),
    ({"neighbors": [1, 2**40]}, r"neighbors\[1\] must be 0 to 1, got 1099511627776"),
    ({"neighbors": np.array([1, 2**64 - 1], np.uint64)},
     r"neighbors\[1\] must be 0 to 1, got 18446744073709551615"),
    ({"offsets": np.array([0, 2**63, 2], np.uint64)}, "offsets must increase from 0"),
    ({"bounds": [[0, 0, 0], [-1, 0, 0]]},
     r"bounds must be finite low and high corners of shape \(2, 3\), got \[\[0.0, 0.0, 0.0\],"
     r" \[-1.0, 0.0, 0.0\]\]"),
    ({"positions": np.array([[0, 0, 0], [1e200, 0, 0]])},
     r"the extent of positions must be 1e-15 to 1e\+15, got 1e\+200: rescale the positions"),
    ({"positions": [["a", "b", "c"]]}, "positions must contain numbers, got <U1"),
    ({"measures": [1, 1e200]},
     r"the largest value of measures must be 1e-150 to 1e\+150, got 1e\+200: rescale the values"),
    ({"weights": [1e308, 1e308]},
     r"the largest value of weights must be 1e-150 to 1e\+150, got 1e\+308: rescale the values"),
    ({"weights": [0, 1e-320]},
     r"the largest value of weights must be 1e-150 to 1e\+150, got 1e-320: rescale the values"),
    ({"bounds": [0, 1]},
     r"bounds must be finite low and high corners of shape \(2, 3\), got \[0.0, 1.0\]"),
])  # fmt: skip
def test_inconsistent_arrays_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        CellGraph(**(PAIR | change))


def test_graphs_can_be_copied_and_pickled_after_use():
    graph = CellGraph(**PAIR)
    classify(graph, [0])
    for twin in (copy.deepcopy(graph), pickle.loads(pickle.dumps(graph))):
        assert np.array_equal(twin.lengths, graph.lengths)
        assert classify(twin, [1]).labels.tolist() == [0, 0]
