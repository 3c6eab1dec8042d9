"""Base classes of meshes and point clouds."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from .._types import Floats
from .._validate import restored


class Cells:
    """Base class of the meshes and point clouds that `segment` accepts; arrays are checked.

    To add a kind of cells, derive a dataclass with `n_cells` and `bounds`, and register it with
    `cells.kinds.register`.
    """

    bounds: Floats
    """Minimum and maximum corner of the bounding box, shape (2, 3)."""

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        raise NotImplementedError

    def __setstate__(self, state: Any) -> None:
        """Restore a copied or pickled object, and check its arrays again."""
        names = [each.name for each in fields(self) if each.init]  # type: ignore[arg-type]
        self.__init__(*restored(state, names))  # type: ignore[misc]


class CellsOfVertices(Cells):
    """Base class of meshes, whose cells have corners at vertices."""

    vertices: Floats

    @property
    def n_vertices(self) -> int:
        """Number of vertices, V, including vertices that no cell uses."""
        return len(self.vertices)
