"""Welding: vertices at the same position are treated as one vertex."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Floats, Ints


def lowest_vertices(vertices: Floats, weld: bool, n_threads: int) -> Ints:
    """For each vertex, return the lowest index of the vertices at the same position.

    Without `weld`, each vertex gets its own index.
    """
    if weld:
        return _core.weld_vertices(vertices, n_threads)
    return np.arange(len(vertices), dtype=np.int32)
