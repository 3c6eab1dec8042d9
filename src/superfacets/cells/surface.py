"""Cells of any kind with what stages 5 to 7 need of them: arcs, and measures of these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import checked_threads
from ..adapters.convert import MeshLike, as_mesh
from ..mesh.triangle_mesh import Mesh
from .cell_graph import CellGraph, box_diagonal
from .face_graph import EdgeCounts, FaceGraph, build_face_graph

__all__ = ["Surface", "as_surface", "triangle_surface"]


@dataclass(frozen=True, eq=False)
class Surface:
    """Checked cells, the arcs between them, and what kernels of stages 5 to 7 take."""

    handle: _core.Surface  # knows the lengths of borders, and what lies around corners
    offsets: npt.NDArray[np.int64]  # (N + 1,)
    neighbors: npt.NDArray[np.int32]  # (M,)
    bounds: npt.NDArray[np.float64]  # (2, 3)
    weight_unit: float  # of arc weights, in the unit of the positions
    n_threads: int
    mesh: Mesh | None = None  # that the cells are the faces of
    edge_counts: EdgeCounts | None = None  # of that mesh
    weights: npt.NDArray[np.float64] | None = None  # of the arcs, where the cells came with some

    @classmethod
    def of_faces(cls, mesh: Mesh, graph: FaceGraph, n_threads: int) -> Surface:
        """Return the faces of a mesh as cells."""
        handle = triangle_surface(mesh, graph)
        return cls(
            handle, graph.offsets, graph.neighbors, graph.bounds, graph.diagonal, n_threads,
            mesh, graph.edge_counts,
        )  # fmt: skip

    @classmethod
    def of_graph(cls, graph: CellGraph, n_threads: int) -> Surface:
        """Return the cells of a graph; a ValueError if it has no measures of arcs."""
        given = graph.arc_measures
        if given is None:
            raise ValueError(
                "the CellGraph has no lengths of borders: give it arc_measures=ArcMeasures(...)"
            )
        handle = _core.GraphSurface(
            graph.positions,
            graph.measures,
            graph.offsets,
            graph.neighbors,
            given.border_lengths,
            np.empty(0) if given.step_lengths is None else given.step_lengths,
            np.empty(0, np.int32) if given.sides is None else given.sides,
            np.empty(0) if given.open_lengths is None else given.open_lengths,
        )
        return cls(
            handle, graph.offsets, graph.neighbors, graph.bounds, graph.weight_unit, n_threads,
            weights=graph.weights,
        )  # fmt: skip

    @property
    def n_cells(self) -> int:
        """Number of cells, N."""
        return len(self.offsets) - 1

    @property
    def n_arcs(self) -> int:
        """Number of arcs, M."""
        return len(self.neighbors)

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, in the unit of the positions."""
        return box_diagonal(self.bounds)

    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """Where each cell is, shape (N, 3)."""
        return self._cells[0]

    @property
    def measures(self) -> npt.NDArray[np.float64]:
        """Area of each cell, shape (N,)."""
        return self._cells[1]

    @cached_property
    def _cells(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        return self.handle.cells(self.n_threads)


def as_surface(source: MeshLike | CellGraph, *, weld: bool, n_threads: int | None) -> Surface:
    """Return the cells of a mesh, or of a graph with `ArcMeasures`; arguments as for `segment`."""
    threads = checked_threads(n_threads)
    if isinstance(source, CellGraph):
        return Surface.of_graph(source, threads)
    mesh = as_mesh(source)
    return Surface.of_faces(mesh, build_face_graph(mesh, weld=weld, n_threads=threads), threads)


def triangle_surface(mesh: Mesh, graph: FaceGraph) -> _core.TriangleSurface:
    """Return what the kernels take for a mesh and its graph; a ValueError if it is another's."""
    if graph.n_cells != mesh.n_faces:
        raise ValueError(f"the graph has {graph.n_cells} cells but the mesh {mesh.n_faces} faces")
    same_turn = graph.same_turn if graph.same_turn.any() else np.empty(0, np.uint8)
    return _core.TriangleSurface(
        mesh.vertices, mesh.faces, graph.offsets, graph.neighbors, graph.sides, same_turn
    )
