"""Weld vertices: treat vertices at the same position, or at almost the same, as one vertex."""

from __future__ import annotations

from itertools import product

import numpy as np

from .. import _core
from ..base.checks import checked_flag, checked_number
from ..base.types import Floats, Ints


def checked_weld(weld: object) -> float:
    """Check a parameter: return True, False, or a tolerance, a number > 0."""
    if isinstance(weld, (bool, np.bool_)) or not isinstance(weld, (int, float, np.number)):
        return checked_flag(weld, "weld")
    return checked_number(weld, "weld", zero=False)


def lowest_vertices(vertices: Floats, weld: float, n_threads: int) -> Ints:
    """Return, for each vertex, the lowest index of the vertices at the same position.

    If `weld` is false, return the index of each vertex itself. If it is a number, vertices whose
    coordinates differ by at most this number are at the same position, and so are vertices that a
    chain of such vertices connects. Apps use it to merge vertices.
    """
    if weld is True:
        return _core.weld_vertices(vertices, n_threads)
    lowest = np.arange(len(vertices), dtype=np.int32)
    if weld is False:
        return lowest
    # Two vertices within the tolerance are in one cell of at least one of eight shifted grids.
    steps = vertices / (2.0 * weld)
    grids = [
        _core.weld_vertices(np.floor(steps + shift), n_threads)
        for shift in product((0.0, 0.5), repeat=3)
    ]
    before = None
    while before is None or not np.array_equal(before, lowest):
        before = lowest
        for first in grids:
            found = lowest.copy()
            np.minimum.at(found, first, lowest)
            lowest = found[first]
    return lowest
