"""Stage 1: the graph of faces that share an edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Array, Bytes, Floats, Ints, Longs
from .._validate import (
    checked_arcs,
    checked_bounds,
    checked_positions,
    checked_threads,
    exact_doubles,
    freeze,
    owned,
    restored,
)
from ..adapters.convert import MeshLike, as_mesh
from ..mesh.cells import lowest_vertices
from ..mesh.faces import (
    FaceMesh,
    FoundArcs,
    arcs_of_faces,
    arcs_of_triangles,
    measure_faces,
    measure_shapes,
)
from ..mesh.triangle_mesh import Mesh
from .cell_graph import Arcs, CellGraph


class EdgeCounts(NamedTuple):
    """Edges of a mesh by the number of faces on them."""

    edges: int
    """All edges."""
    boundary: int
    """Edges of one face."""
    non_manifold: int
    """Edges of three faces or more."""
    inconsistent: int
    """Edges that both of their faces traverse in the same direction."""


@dataclass(frozen=True, eq=False)
class FaceGraph(Arcs):
    """Faces as cells, with arcs between faces that share an edge.

    Attributes
    ----------
    positions : ndarray of float64, shape (N, 3)
        Centroids of the faces.
    measures : ndarray of float64, shape (N,)
        Areas of the faces; 0 for a degenerate face.
    offsets : ndarray of int64, shape (N + 1,)
        The arcs that leave face i are ``offsets[i]`` to ``offsets[i + 1] - 1``.
    neighbors : ndarray of int32, shape (M,)
        The target of each arc.
    sides : ndarray of uint8 (int32 for a `PolygonMesh`), shape (M,)
        The side of the face that each arc crosses. Side s joins corners s and s + 1. The last side
        joins the last corner to the first.
    same_turn : ndarray of uint8, shape (M,)
        1 if the two faces traverse their edge in the same direction, which means that they are
        inconsistently oriented; else 0.
    bounds : ndarray of float64, shape (2, 3)
        Low and high corner of the bounding box of the vertices that faces use.
    edge_counts : EdgeCounts
        Numbers of all, boundary, non-manifold and inconsistent edges.
    """

    positions: Floats
    measures: Floats
    offsets: Longs
    neighbors: Ints
    sides: Array
    same_turn: Bytes
    bounds: Floats
    edge_counts: EdgeCounts

    def __post_init__(self) -> None:
        positions = checked_positions(self.positions)
        offsets, neighbors = checked_arcs(self.offsets, self.neighbors, len(positions))
        measures = exact_doubles(np.asarray(self.measures))
        is_wide = np.asarray(self.sides).dtype == np.int32
        sides = owned(np.asarray(self.sides), np.int32 if is_wide else np.uint8)
        same_turn = owned(np.asarray(self.same_turn), np.uint8)
        if measures.shape != (len(positions),):
            raise ValueError("measures must have one number per face")
        if not sides.shape == same_turn.shape == neighbors.shape:
            raise ValueError("sides and same_turn must have one entry per arc")
        if not is_wide and sides.max(initial=0) > 2:
            raise ValueError("sides must be 0, 1 or 2 (for polygons, pass int32 sides)")
        if sides.min(initial=0) < 0:
            raise ValueError("sides must not be negative")
        freeze(
            self,
            positions=positions,
            measures=measures,
            offsets=offsets,
            neighbors=neighbors,
            sides=sides,
            same_turn=same_turn,
            bounds=checked_bounds(self.bounds, positions),
        )

    def __setstate__(self, state: Any) -> None:
        """Check the fields of a copy or a pickle like those of a new graph."""
        FaceGraph.__init__(self, *restored(state, tuple(FaceGraph.__dataclass_fields__)))

    @classmethod
    def _unchecked(cls, edge_counts: EdgeCounts, **arrays: Array) -> FaceGraph:
        """Return a graph of new arrays from kernels, without checks."""
        graph = object.__new__(cls)
        freeze(graph, **arrays)
        object.__setattr__(graph, "edge_counts", edge_counts)
        return graph

    def with_weights(self, weights: npt.ArrayLike, *, n_threads: int | None = None) -> CellGraph:
        """Return the input of the clustering, with one weight per arc (finite, >= 0)."""
        return CellGraph._of_arcs(self, weights, n_threads)

    def __repr__(self) -> str:
        return f"FaceGraph({self.n_cells} faces, {self.n_arcs} arcs)"


def build_face_graph(
    mesh: MeshLike, *, weld: bool = True, n_threads: int | None = None
) -> FaceGraph:
    """Return the graph of the faces of a mesh that share an edge.

    All pairs of faces at a non-manifold edge are neighbors. A boundary edge has no arc. Faces that
    share two edges have two arcs in each direction. A side whose ends are the same vertex is not an
    edge, and no face is its own neighbor. The arcs of a face are sorted by side, then by neighbor.
    Time and memory are linear in faces and arcs.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        As for `segment`.
    weld : bool, default True
        Treat vertices at exactly the same position as one vertex, so that triangle soup and meshes
        with seams are connected. If False, only faces with common vertex indices are neighbors.
    n_threads : int, optional
        As for `segment`.

    Raises
    ------
    MeshError
        If there are more than 16 arcs per face and more than 2**24 arcs in total, for example if
        five thousand faces share one edge.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> graph = build_face_graph(square)
    >>> graph.neighbors, graph.sides
    (array([1, 0], dtype=int32), array([2, 0], dtype=uint8))
    >>> graph.edge_counts
    EdgeCounts(edges=5, boundary=4, non_manifold=0, inconsistent=0)
    """
    mesh = as_mesh(mesh)
    threads = checked_threads(n_threads)
    arcs = arcs_of_faces(mesh, lowest_vertices(mesh.vertices, weld, threads), threads)
    return _graph_of(mesh, arcs, *measure_faces(mesh, threads))


class FaceShapes(NamedTuple):
    """Measures of faces that only weights need, separate from the graph to save memory."""

    normals: Floats | None
    """Unit normals, shape (F, 3), 0 for a degenerate face; None for polygons."""
    longest: Floats | None
    """Squared length of the longest side in each of the core's blocks of triangles."""


def graph_and_shapes(mesh: FaceMesh, *, weld: bool, n_threads: int) -> tuple[FaceGraph, FaceShapes]:
    """Return the result of `build_face_graph`, and shapes of faces measured in the same pass."""
    arcs = arcs_of_faces(mesh, lowest_vertices(mesh.vertices, weld, n_threads), n_threads)
    positions, measures, *shapes = measure_shapes(mesh, n_threads)
    return _graph_of(mesh, arcs, positions, measures), FaceShapes(*shapes)


def _graph_of(mesh: FaceMesh, arcs: FoundArcs, positions: Floats, measures: Floats) -> FaceGraph:
    return FaceGraph._unchecked(
        EdgeCounts(*arcs.counts),
        positions=positions,
        measures=measures,
        offsets=arcs.offsets,
        neighbors=arcs.neighbors,
        sides=arcs.sides,
        same_turn=arcs.same_turn,
        bounds=mesh.bounds,
    )


def arcs_at_borders(mesh: Mesh, labels: Ints, n_threads: int) -> tuple[Longs, Ints, Ints]:
    """Return the graph of the triangles at borders between labels, in CSR form, and their labels.

    This is much faster than the whole graph, because most triangles are not at borders.
    """
    lowest = _core.weld_vertices(mesh.vertices, n_threads)
    corners = lowest[mesh.faces]
    some_label = np.empty(mesh.n_vertices, dtype=np.int32)  # label of any face at each vertex
    for vertices in corners.T:
        some_label[vertices] = labels
    is_shared = np.zeros(mesh.n_vertices, dtype=bool)
    is_shared[corners[some_label[corners] != labels[:, np.newaxis]]] = True
    first, second, third = is_shared[corners].T
    # A face that shares an edge with a face of another label has two such corners.
    faces = np.flatnonzero((first & second) | (second & third) | (third & first))
    if not len(faces):
        return np.zeros(1, dtype=np.int64), np.empty(0, dtype=np.int32), labels[faces]
    arcs = arcs_of_triangles(mesh.faces[faces], lowest, n_threads)
    return arcs.offsets, arcs.neighbors, labels[faces]
