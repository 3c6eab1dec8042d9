"""Checks of the core's arguments, in builds with assertions (CMake option SUPERFACETS_ASSERT)."""

import os
import subprocess
import sys

import pytest

from superfacets import _core

WITHOUT = "the core was built without assertions (make lowest, newest and sanitize have them)"

# Calls that checked functions of the package never make, and the check each fails: in
# find_components, in the arcs of a surface, and in the span of the standard library.
BROKEN_CALLS = {
    "_core.find_components(offsets, neighbors, np.zeros(5, np.int32))": (
        "src/core/cells/components.cpp",
        "arcs.are_valid() && std::cmp_equal(labels.size(), arcs.n_cells())"),
    "_core.find_components(offsets, neighbors + 1, np.zeros(2, np.int32))": (
        "src/core/cells/components.cpp",
        "arcs.are_valid() && std::cmp_equal(labels.size(), arcs.n_cells())"),
    "_core.OrderedGraph(cells, offsets, neighbors, halves, 1)": (
        "src/core/cells/ordered_graph.cpp",
        "input.arcs.n_arcs() == ssize(input.lengths) && are_quantized(input.lengths)"),
    "_core.OrderedGraph(three_cells, offsets, neighbors, ones, 1)": (
        "src/core/cells/ordered_graph.cpp",
        "input.arcs.are_valid() && input.arcs.n_cells() == n_cells()"),
    "_core.update_centers(ordered, np.array([0, 2], np.int32), 2, 1)": (
        "src/core/clustering/update.cpp", "all_below(labels, n_regions)"),
    "_core.farthest_seeds(ordered, 0, 3, keep, 1)": (
        "src/core/clustering/farthest.cpp", "all.farthest_squared > kIsCenter"),
}  # fmt: skip

SETUP = """
import numpy as np
from superfacets import _core
offsets, neighbors = np.array([0, 1, 2]), np.array([1, 0], np.int32)
ones, halves = np.ones(2, np.float32), np.full(2, 0.5, np.float32)
cells, more_cells = (_core.PlacedCells(np.eye(2, 3), np.ones(2), 1) for _ in range(2))
three_cells = _core.PlacedCells(np.eye(3), np.ones(3), 1)
ordered = _core.OrderedGraph(more_cells, offsets, neighbors, ones, 1)
keep = next(iter(_core.Islands))
print("so far all is well", flush=True)
"""


def call(code):
    command = [sys.executable, "-c", SETUP + code]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.skipif(not _core.has_assertions(), reason=WITHOUT)
@pytest.mark.parametrize("code", BROKEN_CALLS, ids=lambda code: code.split("(")[0])
def test_a_broken_assertion_ends_the_process_and_says_where(code):
    done = call(code)
    file, condition = BROKEN_CALLS[code]
    assert done.stdout == "so far all is well\n"
    assert f"superfacets: {file}:" in done.stderr
    assert f": assertion failed: {condition}\n" in done.stderr
    assert done.returncode != 0
    if os.name == "posix":
        assert done.returncode == -6  # SIGABRT


def test_what_is_as_demanded_goes_through():
    done = call("print(_core.farthest_seeds(ordered, 0, 2, keep, 1))")
    assert done.stdout.splitlines()[-1] == "[0 1]"
    assert done.returncode == 0
