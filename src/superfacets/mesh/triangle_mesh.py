"""Stage 0: triangle meshes, as two checked arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .._types import Array, Floats, Ints
from .._validate import checked_mesh, freeze, restored
from .cells import Cells


@dataclass(frozen=True, eq=False)
class Mesh(Cells):
    """A triangle mesh: checked, and safe to hand to every stage.

    Open, non-manifold, inconsistently oriented, degenerate and disconnected meshes and soups of
    triangles are all accepted. Faces are kept as they are, in their order.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Positions, finite; kept as float64, read-only. Faces need not use every vertex. An array
        that is contiguous float64 already is not copied (a memory map is): leave it as it is while
        the mesh is in use.
    faces : array_like of integers, shape (F, 3)
        Vertex indices, 0 to V - 1, counterclockwise seen from outside; copied as int32, read-only.
        F >= 1.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Low and high corner of the bounding box of the vertices that faces use.

    Raises
    ------
    MeshError
        If a shape, an index or a coordinate is wrong (the first offender is named), if there is
        no face, or if all faces lie at one point.

    Examples
    --------
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> square.n_faces
    2
    """

    vertices: Floats
    faces: Ints
    bounds: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        vertices, faces, bounds = checked_mesh(self.vertices, self.faces)
        freeze(self, vertices=vertices, faces=faces, bounds=bounds)

    @classmethod
    def _of_new(cls, vertices: Array, faces: Array) -> Mesh:
        """Make a mesh of arrays that nothing else refers to, as readers make them: not copied."""
        mesh = object.__new__(cls)
        vertices, faces, bounds = checked_mesh(vertices, faces, are_new=True)
        freeze(mesh, vertices=vertices, faces=faces, bounds=bounds)
        return mesh

    def __setstate__(self, state: Any) -> None:
        """Take what a copy or a pickle holds as if it were new: checked, and read-only."""
        Mesh.__init__(self, *restored(state, ("vertices", "faces")))

    @property
    def n_cells(self) -> int:
        """Number of cells, which are the faces."""
        return len(self.faces)

    @property
    def n_faces(self) -> int:
        """Number of faces, F."""
        return len(self.faces)

    @property
    def n_vertices(self) -> int:
        """Number of vertices, V, used or not."""
        return len(self.vertices)

    def __repr__(self) -> str:
        return f"Mesh({self.n_vertices} vertices, {self.n_faces} faces)"
