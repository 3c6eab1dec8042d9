"""Rings of faces around vertices of a tile, and rows of arrays."""

import numpy as np

from superfacets import _core
from superfacets.io.tables import ArrayRows, take_rows
from superfacets.tiles.arrays import rows

# A strip of triangles: face i has the vertices i, i + 1 and i + 2.
N = 12
CORNERS = (np.arange(N)[:, None] + np.arange(3)).astype(np.int32).reshape(-1)
OFFSETS = np.arange(0, 3 * N + 1, 3)


def marks(**known):
    rings = np.zeros(N + 2, np.uint8)
    for vertex, n in known.items():
        rings[int(vertex[1:])] = n
    return rings


def test_each_ring_is_one_less():
    rings = _core.spread_rings(OFFSETS, CORNERS, marks(v0=3))
    assert rings.tolist() == [3, 2, 2, 1, 1] + 9 * [0]
    both = _core.spread_rings(OFFSETS, CORNERS, marks(v0=3, v4=3))
    assert both.tolist() == [3, 2, 2, 2, 3, 2, 2, 1, 1] + 5 * [0]


def test_what_is_given_stays():
    rings = marks(v5=2)
    _core.spread_rings(OFFSETS, CORNERS, rings)
    assert rings.tolist() == marks(v5=2).tolist()


def test_rows_in_any_order():
    offsets, entries = rows(np.array([0, 2, 2, 5]), np.array([2, 0, 1], np.int32))
    assert offsets.tolist() == [0, 3, 5, 5]
    assert entries.tolist() == [2, 3, 4, 0, 1]
    offsets, entries = rows(np.array([0, 2]), np.empty(0, np.int64))
    assert (offsets.tolist(), entries.tolist()) == ([0], [])


def test_rows_of_arrays_in_any_layout():
    table = np.asfortranarray(np.arange(12.0).reshape(4, 3))
    for rows_of in (ArrayRows(table), ArrayRows(table.copy(order="C"))):
        assert take_rows(rows_of, np.array([3, 0]), 9).tolist() == [[9, 10, 11], [0, 1, 2]]
