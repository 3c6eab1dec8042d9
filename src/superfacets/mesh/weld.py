"""Weld vertices: treat all vertices at the same position as one vertex."""

from __future__ import annotations

import numpy as np

from .. import _core
from ..base.types import Floats, Ints


def lowest_vertices(vertices: Floats, weld: bool, n_threads: int) -> Ints:
    """Return, for each vertex, the lowest index of the vertices at the same position.

    If `weld` is false, return the index of each vertex itself. Apps use it to merge vertices.
    """
    if weld:
        return _core.weld_vertices(vertices, n_threads)
    return np.arange(len(vertices), dtype=np.int32)
