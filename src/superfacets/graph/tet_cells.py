"""Base class of tetrahedral meshes: checks of the arrays, and the compiled functions on them."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..base.checks import checked_mask, checked_simplices, checked_threads, freeze
from ..base.errors import MeshError
from ..base.types import Array, Floats, Ints
from ..mesh.base import CellsOfVertices
from ..mesh.weld import lowest_vertices


class TetCells(CellsOfVertices):
    """Base class of a mesh of tetrahedra, for the app that reads, writes and draws them.

    A derived dataclass has the fields `vertices`, (V, 3), `tets`, (N, 4), and `bounds`.
    """

    corners_name: ClassVar[str] = "tets"

    tets: Ints

    @property
    def n_cells(self) -> int:
        """Number of cells. The cells of this mesh are its tetrahedra."""
        return len(self.tets)

    def _check(self, *, are_new: bool = False) -> None:
        given = self.vertices, self.tets
        vertices, tets, bounds = checked_simplices(*given, "tets", 4, are_new=are_new)
        freeze(self, vertices=vertices, tets=tets, bounds=bounds)

    def arcs_and_measures(self, weld: float, n_threads: int) -> tuple[Any, tuple[Floats, ...]]:
        """Return arcs between tetrahedra that share a triangle, and measures.

        Arcs: offsets, neighbors and sides, an unused array, and numbers of all, boundary and
        non-manifold triangles. Measures: centroids, volumes, areas of shared triangles, lengths of
        steps, and areas of boundary triangles. Raises a MeshError if there are too many arcs.
        """
        lowest = lowest_vertices(self.vertices, weld, n_threads)
        try:
            return _core.build_tet_graph(self.vertices, self.tets, lowest, n_threads)
        except ValueError as error:
            raise MeshError(str(error)) from None

    def boundary_sides(self, keep: Any, weld: float) -> tuple[Array, Array]:
        """Return the triangles that belong to exactly one of the tetrahedra that `keep` marks.

        A triangle is given by its tetrahedron and by the opposite corner, 0 to 3.
        """
        kept = checked_mask(keep, self.n_cells, "keep")
        offsets, neighbors, sides = self.arcs_and_measures(weld, checked_threads(None))[0][:3]
        is_outside = np.repeat(kept[:, np.newaxis], 4, axis=1)
        sources = np.repeat(np.arange(self.n_cells), np.diff(offsets))
        inner = kept[neighbors]
        is_outside[sources[inner], sides[inner]] = False
        tets, opposite = np.nonzero(is_outside)
        if not len(tets):
            why = "every triangle belongs to two or more tetrahedra"
            if not kept.any():
                why = "no tetrahedron is kept"
            raise MeshError(f"the mesh has no boundary, because {why}")
        return tets, opposite

    def nearest(self, queries: Floats, max_distance: float, n_threads: int) -> tuple[Ints, Floats]:
        """Return the nearest tetrahedron of each query point; see `Kind.nearest`."""
        return _core.nearest_tets(self.vertices, self.tets, queries, max_distance, n_threads)
