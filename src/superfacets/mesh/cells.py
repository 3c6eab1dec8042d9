"""The base classes of all kinds of cells."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from .. import _core
from .._types import Floats, Ints
from .._validate import restored


class Cells:
    """Checked cells: the input of `segment` after reading.

    To add a kind of cells, derive a dataclass with `n_cells` and `bounds`, and register it with
    `cells.kinds.register`.
    """

    bounds: Floats
    """Low and high corner of the bounding box, shape (2, 3)."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        raise NotImplementedError

    def __setstate__(self, state: Any) -> None:
        """Restore a copy or a pickle with the checks of a new object."""
        names = [each.name for each in fields(self) if each.init]  # type: ignore[arg-type]
        self.__init__(*restored(state, names))  # type: ignore[misc]


class CellsOfVertices(Cells):
    """Cells whose corners are vertices."""

    vertices: Floats

    @property
    def n_vertices(self) -> int:
        """Number of vertices, V, including vertices that no cell uses."""
        return len(self.vertices)


def lowest_vertices(vertices: Floats, weld: bool, n_threads: int) -> Ints:
    """Return the lowest vertex at the position of each vertex, or `arange(V)` without `weld`."""
    if weld:
        return _core.weld_vertices(vertices, n_threads)
    return np.arange(len(vertices), dtype=np.int32)
