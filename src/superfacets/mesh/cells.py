"""The base class of all kinds of cells."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Floats, Ints


class Cells:
    """Checked cells: the input of `segment` after reading.

    To add a kind of cells, derive a class with `n_cells` and `bounds`, and register it with
    `cells.kinds.register`.
    """

    bounds: Floats
    """Low and high corner of the bounding box, shape (2, 3)."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        raise NotImplementedError


def lowest_vertices(vertices: Floats, weld: bool, n_threads: int) -> Ints:
    """Lowest vertex at the position of each vertex, (V,); without `weld`, each vertex itself."""
    if weld:
        return _core.weld_vertices(vertices, n_threads)
    return np.arange(len(vertices), dtype=np.int32)
