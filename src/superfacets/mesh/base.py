"""Base classes of the mesh classes and the point cloud class."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, ClassVar, Self

from ..base.checks import restored
from ..base.types import Array, Floats, Longs


class Cells:
    """Base class of meshes and point clouds. Their cells are faces, tetrahedra or points.

    To support another kind of cells, derive a dataclass that has `n_cells` and `bounds`, and name
    it by an entry point (see `graph.kinds`).
    """

    bounds: Floats
    """Minimum and maximum corner of the bounding box, shape (2, 3)."""

    @property
    def n_cells(self) -> int:
        """Number of cells (faces, tetrahedra or points), N."""
        raise NotImplementedError

    def __setstate__(self, state: Any) -> None:
        """Restore a copied or pickled object, and check the arrays of the object again."""
        names = [each.name for each in fields(self) if each.init]  # type: ignore[arg-type]
        self.__init__(*restored(state, names))  # type: ignore[misc]


class CellsOfVertices(Cells):
    """Base class of meshes: the corners of their cells (faces or tetrahedra) are vertices."""

    corners_name: ClassVar[str] = "faces"
    """Attribute with the vertices of each cell, (N, n), if all cells have n corners."""
    sides: ClassVar[Longs | None] = None
    """Corners of each side of a cell, (n_sides, n), for cells with a volume; None for faces."""

    vertices: Floats

    @classmethod
    def _of_new(cls, *arrays: Array) -> Self:
        """Make a mesh from new arrays. They are not copied, because no other code uses them."""
        mesh = object.__new__(cls)
        for each, array in zip(fields(mesh), arrays, strict=False):  # type: ignore[arg-type]
            object.__setattr__(mesh, each.name, array)
        mesh._check(are_new=True)
        return mesh

    def __post_init__(self) -> None:
        self._check()

    def _check(self, *, are_new: bool = False) -> None:
        """Replace the fields by checked, read-only arrays, or raise a MeshError."""
        raise NotImplementedError

    @property
    def n_vertices(self) -> int:
        """Number of vertices, V, including vertices that no cell uses."""
        return len(self.vertices)
