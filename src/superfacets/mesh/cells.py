"""The base of all classes of cells."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Floats, Ints


class Cells:
    """Checked cells: the input of `segment` after reading.

    A class of one's own derives from this one, has `n_cells` and `bounds`, and is made known by
    `cells.kinds.register`.
    """

    bounds: Floats
    """Low and high corner of the bounding box, shape (2, 3)."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N: one label each."""
        raise NotImplementedError


def lowest_vertices(vertices: Floats, weld: bool, n_threads: int) -> Ints:
    """The lowest vertex at the position of each vertex; each vertex itself without welding."""
    if weld:
        return _core.weld_vertices(vertices, n_threads)
    return np.arange(len(vertices), dtype=np.int32)
