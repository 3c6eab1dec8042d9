"""The graph of the faces of a mesh, with arcs between faces that share an edge."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_threads, counted, freeze
from ..base.errors import MeshError
from ..base.types import ArcLists, Array, Bytes, Floats, Ints, Longs
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, corners_of, measure_shapes
from ..mesh.meshes import Mesh
from ..mesh.weld import lowest_vertices
from .cell_graph import BaseGraph, CellGraph


class EdgeCounts(NamedTuple):
    """Numbers of edges of a mesh. An edge that several faces share is counted once."""

    edges: int
    """Number of all edges."""
    boundary: int
    """Number of edges that belong to exactly one face."""
    non_manifold: int
    """Number of edges that belong to three or more faces."""
    inconsistent: int
    """Number of edges whose two faces traverse the edge in the same direction."""


@dataclass(frozen=True, eq=False)
class FaceGraph(BaseGraph):
    """Result of `build_face_graph`: faces of a mesh, and arcs between faces that share an edge.

    Its arrays are read-only, but not checked. `CellGraph` checks arrays of any origin.

    Attributes
    ----------
    positions : ndarray of float64, shape (N, 3)
        Centroid of each face.
    measures : ndarray of float64, shape (N,)
        Area of each face; 0 for a degenerate face.
    offsets : ndarray of int64, shape (N + 1,)
        The arcs that leave face i are ``offsets[i]`` to ``offsets[i + 1] - 1``.
    neighbors : ndarray of int32, shape (M,)
        Target face of each arc.
    sides : ndarray of uint8 (int32 for a `PolygonMesh`), shape (M,)
        Side of the face that each arc crosses. Side s joins corners s and s + 1, and the last side
        joins the last corner to the first corner.
    same_turn : ndarray of uint8, shape (M,)
        1 if both faces traverse the common edge in the same direction, so that they are
        inconsistently oriented, and 0 otherwise.
    bounds : ndarray of float64, shape (2, 3)
        Minimum and maximum corner of the bounding box of all vertices of faces.
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
        self.__setstate__(self.__dict__)

    def __setstate__(self, state: dict[str, Any]) -> None:
        object.__setattr__(self, "edge_counts", state["edge_counts"])
        freeze(self, **{name: value for name, value in state.items() if name != "edge_counts"})

    @property
    def has_turns(self) -> bool:
        """Whether some faces are inconsistently oriented."""
        return self.same_turn.strides != (0,) and bool(self.same_turn.any())

    def with_weights(self, weights: npt.ArrayLike, *, n_threads: int | None = None) -> CellGraph:
        """Return a `CellGraph` with one weight per arc; weights must be finite and >= 0."""
        return self._weighted(weights, n_threads)

    def __repr__(self) -> str:
        return f"FaceGraph({counted(self.n_cells, 'face')}, {counted(self.n_arcs, 'arc')})"


def core_surface(
    mesh: FaceMesh, graph: FaceGraph, is_inside_out: bool, n_threads: int
) -> _core.TriangleSurface | _core.PolygonSurface:
    """Make the object of `_core` that computes lengths and angles of the arcs between faces.

    If `is_inside_out` is true, concave and convex edges are swapped. Raises a ValueError if the
    graph was made from another mesh.
    """
    corners, is_of_triangles = corners_of(mesh), graph.sides.dtype == np.uint8
    same_turn = graph.same_turn if graph.has_turns else np.empty(0, np.uint8)
    if corners.offsets is None:
        if not is_of_triangles:
            raise ValueError("the graph was built for polygons, but the mesh has triangles")
        faces = corners.vertices.reshape(-1, 3)
        return _core.TriangleSurface(
            mesh.vertices, faces, *graph.arcs, graph.sides, same_turn, is_inside_out
        )
    if is_of_triangles:
        raise ValueError("the graph was built for triangles, but the mesh has polygons")
    if np.any(graph.sides >= np.repeat(corners.sizes, np.diff(graph.offsets))):
        raise ValueError("the graph was built for another mesh, whose faces have more sides")
    return _core.PolygonSurface(
        mesh.vertices, corners.offsets, corners.vertices, *graph.arcs, graph.sides, same_turn,
        is_inside_out, n_threads,
    )  # fmt: skip


def build_face_graph(
    mesh: MeshLike, *, weld: float = True, n_threads: int | None = None
) -> FaceGraph:
    """Return the graph of the faces of a mesh, with arcs between faces that share an edge.

    All pairs of faces at a non-manifold edge are neighbors, unless the edge has more than 64 faces.
    Then its n faces are numbered in ascending order, and two faces are neighbors if their numbers
    differ by a power of two modulo n. A boundary edge has no arc. Two faces that share two edges
    are joined by two arcs in each direction. A side whose two corners are the same vertex is not an
    edge, and no face is its own neighbor. The arcs of a face are sorted by side, then by neighbor.
    Time and memory are linear in the number of faces and arcs.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`.
    weld : bool, default True
        Whether vertices at exactly the same position are treated as one vertex. Without welding,
        triangle soup and meshes with seams are disconnected, because only faces with common vertex
        indices are neighbors.
    n_threads : int, optional
        Same as in `segment`.

    Raises
    ------
    MeshError
        If the mesh is not valid or has no faces, or if there are more than 16 arcs per face on
        average and more than 2**24 arcs in total. This happens for example if a million faces share
        one edge.

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
    faces, threads = as_mesh(mesh), checked_threads(n_threads)
    return FaceArcs.of(faces, weld, threads).measured(faces, threads)[0]


class FaceArcs(NamedTuple):
    """The arrays of a `FaceGraph` that do not depend on positions, and the welded vertices."""

    offsets: Longs
    neighbors: Ints
    sides: Array
    same_turn: Bytes
    edge_counts: EdgeCounts
    lowest: Ints
    """Lowest index of the vertices at the position of each vertex, (V,)."""

    @classmethod
    def of(cls, mesh: FaceMesh, weld: float, n_threads: int) -> FaceArcs:
        """Find the arcs between faces that share an edge; see `build_face_graph`."""
        corners, lowest = corners_of(mesh), lowest_vertices(mesh.vertices, weld, n_threads)
        found: tuple[Longs, Ints, Array, Bytes, tuple[int, int, int, int]]
        try:
            if corners.offsets is None:
                faces = corners.vertices.reshape(-1, 3)
                found = _core.build_triangle_graph(faces, lowest, n_threads)
            else:
                lists = corners.offsets, corners.vertices
                found = _core.build_polygon_graph(*lists, lowest, n_threads)
        except ValueError as error:  # `_core` raises this error for too many arcs
            raise MeshError(str(error)) from None
        offsets, neighbors, sides, same_turn, counts = found
        if not len(same_turn):  # no face is inconsistently oriented: all values are one 0
            same_turn = np.broadcast_to(np.uint8(0), neighbors.shape)
        return cls(offsets, neighbors, sides, same_turn, EdgeCounts(*counts), lowest)

    def measured(self, mesh: FaceMesh, n_threads: int) -> tuple[FaceGraph, Floats | None]:
        """Return the graph of the mesh, whose vertices may have moved, and sides for slivers."""
        positions, measures, longest = measure_shapes(mesh, n_threads)
        graph = FaceGraph(
            positions, measures, *self[:4], bounds=mesh.bounds, edge_counts=self.edge_counts
        )
        return graph, longest


def arcs_at_borders(mesh: Mesh, labels: Ints, n_threads: int) -> tuple[ArcLists, Ints]:
    """Return arcs in CSR form between triangles at borders of regions, and their labels."""
    lowest = _core.weld_vertices(mesh.vertices, n_threads)
    corners = lowest[mesh.faces]
    some_label = np.empty(mesh.n_vertices, dtype=np.int32)  # label of one face at each vertex
    for vertices in corners.T:
        some_label[vertices] = labels
    is_shared = np.zeros(mesh.n_vertices, dtype=bool)
    is_shared[corners[some_label[corners] != labels[:, np.newaxis]]] = True
    first, second, third = is_shared[corners].T
    # At both ends of a border edge, there are faces with different labels, so `is_shared` is true.
    faces = np.flatnonzero((first & second) | (second & third) | (third & first))
    if not len(faces):
        return (np.zeros(1, dtype=np.int64), np.empty(0, dtype=np.int32)), labels[faces]
    arcs = _core.build_triangle_graph(mesh.faces[faces], lowest, n_threads)
    return arcs[:2], labels[faces]
