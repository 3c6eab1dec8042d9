"""Build the graph of a tetrahedral mesh, and compute its counts and sizes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from superfacets import ArcMeasures, CellGraph, MeshError, kit
from superfacets.kit import BaseGraph, Bools, Floats, Ints, Kind, Longs, MeshLike, Surface

from .tet_mesh import TetBoundary, TetMesh, signed_volumes


class TriangleCounts(NamedTuple):
    """Numbers of triangles of a tetrahedral mesh. A shared triangle is counted once."""

    triangles: int
    """Number of all triangles."""
    boundary: int
    """Number of triangles that belong to exactly one tetrahedron."""
    non_manifold: int
    """Number of triangles that belong to three or more tetrahedra."""


@dataclass(frozen=True, eq=False)
class TetGraph(BaseGraph):
    """Graph of the tetrahedra of a mesh, with arcs across shared triangles.

    Attributes
    ----------
    positions : ndarray of float64, shape (N, 3)
        Centroid of each tetrahedron.
    measures : ndarray of float64, shape (N,)
        Volume of each tetrahedron, >= 0 even for inverted tetrahedra.
    offsets : ndarray of int64, shape (N + 1,)
        The arcs that leave cell i are ``offsets[i]`` to ``offsets[i + 1] - 1``.
    neighbors : ndarray of int32, shape (M,)
        Target tetrahedron of each arc.
    bounds : ndarray of float64, shape (2, 3)
        Minimum and maximum corner of the bounding box of all vertices of tetrahedra.
    arc_measures : ArcMeasures
        ``border_lengths`` are the areas of shared triangles. ``step_lengths`` are the distances
        from centroid to centroid through the centroid of the shared triangle. ``angles`` are None.
        ``sides`` are the corners, 0 to 3, opposite to the shared triangle. ``open_lengths`` is, for
        each tetrahedron, the total area of its boundary triangles.
    triangle_counts : TriangleCounts
        Numbers of all, boundary and non-manifold triangles.
    """

    positions: Floats
    measures: Floats
    offsets: Longs
    neighbors: Ints
    bounds: Floats
    arc_measures: ArcMeasures
    triangle_counts: TriangleCounts

    def with_weights(
        self, weights: npt.ArrayLike | None = None, *, n_threads: int | None = None
    ) -> CellGraph:
        """Return a `CellGraph` with one weight per arc; weights must be finite and >= 0.

        By default, the weight of an arc is its step length, divided by the diagonal of the bounding
        box.
        """
        steps = self.arc_measures.step_lengths
        assert steps is not None
        given = steps / self.diagonal if weights is None else weights
        return self._weighted(given, n_threads, self.arc_measures, 3)

    def __repr__(self) -> str:
        return f"TetGraph({kit.counted(self.n_cells, 'tet')}, {kit.counted(self.n_arcs, 'arc')})"


def build_tet_graph(
    mesh: MeshLike, *, weld: float = True, n_threads: int | None = None
) -> TetGraph:
    """Return the graph of a tetrahedral mesh, with arcs between tetrahedra that share a triangle.

    Tetrahedra that share a triangle are neighbors. If more than 64 share a triangle, only some
    pairs are neighbors, as in `build_face_graph`. A tetrahedron and its duplicate share four
    triangles, so they are joined by four arcs in each direction. Triangles with a repeated vertex
    are ignored. Time and memory are linear in the number of tetrahedra and arcs.

    Parameters
    ----------
    mesh : TetMesh or mesh-like
        Same as in `segment`.
    weld : bool, default True
        Whether vertices at exactly the same position are treated as one vertex.
    n_threads : int, optional
        Same as in `segment`.

    Raises
    ------
    MeshError
        If the mesh is not valid or has no tetrahedra, or if there are more than 16 arcs per
        tetrahedron on average and more than 2**24 arcs in total.

    Examples
    --------
    >>> from superfacets import TetMesh
    >>> points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    >>> graph = build_tet_graph(TetMesh(points, [[0, 1, 2, 3], [1, 2, 3, 4]]))
    >>> graph.neighbors, graph.triangle_counts
    (array([1, 0], dtype=int32), TriangleCounts(triangles=7, boundary=6, non_manifold=0))
    """
    cells = kit.as_cells(mesh)
    if not isinstance(cells, TetMesh):
        raise MeshError(f"expected a tetrahedral mesh, got a {type(cells).__name__}")
    found, measures = cells.arcs_and_measures(weld, kit.checked_threads(n_threads))
    offsets, neighbors, sides, _, counts = found
    positions, volumes, border_areas, step_lengths, open_areas = measures
    arcs = ArcMeasures(border_areas, step_lengths, None, sides, open_areas)
    triangles = TriangleCounts(*counts[:3])
    graph = TetGraph(positions, volumes, offsets, neighbors, cells.bounds, arcs, triangles)
    kit.freeze(graph, positions=positions, measures=volumes, offsets=offsets, neighbors=neighbors)
    return graph


class _Tets(Kind):
    name = "tetrahedra"
    noun = "tet"
    plural = "tetrahedra"
    dimension = 3

    def build_graph(self, cells: TetMesh, weld: float, n_threads: int) -> tuple[TetGraph, None]:
        return build_tet_graph(cells, weld=weld, n_threads=n_threads), None

    def surface(self, cells: TetMesh, graph: TetGraph, n_threads: int) -> Surface:
        return Surface.of_tets(cells, graph, graph.arc_measures, n_threads)

    def measures(self, cells: TetMesh, n_threads: int) -> Floats:
        return np.abs(signed_volumes(cells))

    def positions(self, cells: TetMesh) -> Floats:
        return np.asarray(cells.vertices[cells.tets].mean(axis=1))

    def nearest(
        self, cells: TetMesh, queries: Floats, max_distance: float, n_threads: int
    ) -> tuple[Ints, Floats]:
        return cells.nearest(queries, max_distance, n_threads)

    def drawn_faces(self, cells: TetMesh, keep: Bools | None = None) -> TetBoundary:
        return cells.boundary(keep)


TETS = _Tets()


_VOLUME_NOISE = 4e-16
"""A tetrahedron is flat if its volume is at most this fraction of the cube of its longest edge at
corner 0. Smaller volumes are treated as rounding errors."""


@dataclass(frozen=True)
class TetInfo:
    """Counts and sizes of a tetrahedral mesh, from `mesh_info`."""

    n_tets: int
    """Number of tetrahedra."""
    n_vertices: int
    """Number of vertices, including vertices that no tetrahedron uses."""
    n_positions: int
    """Number of different positions of vertices."""
    n_components: int
    """Number of connected components of the graph of tetrahedra."""
    n_triangles: int
    """Number of triangles. A triangle that several tetrahedra share is counted once."""
    n_boundary_triangles: int
    """Number of triangles that belong to exactly one tetrahedron."""
    n_nonmanifold_triangles: int
    """Number of triangles that belong to three or more tetrahedra."""
    n_flat_tets: int
    """Number of tetrahedra whose volume is 0, up to rounding errors."""
    n_turned_tets: int
    """Number of inverted tetrahedra: their signed volume is negative."""
    volume: float
    """Total volume, in the cubed unit of the vertices."""
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Minimum and maximum corner of the bounding box of all vertices of tetrahedra."""
    diagonal: float
    """Length of the diagonal of the bounding box."""


def tet_info(
    mesh: TetMesh, graph: TetGraph, n_positions: int, n_components: int, volume: float
) -> TetInfo:
    """Return counts and sizes of a tetrahedral mesh and its graph, for `mesh_info`."""
    low, high = graph.bounds.tolist()
    edges = mesh.vertices[mesh.tets[:, 1:]] - mesh.vertices[mesh.tets[:, :1]]
    noise = _VOLUME_NOISE * np.linalg.norm(edges, axis=2).max(axis=1) ** 3
    return TetInfo(
        n_tets=mesh.n_tets, n_vertices=mesh.n_vertices, n_positions=n_positions,
        n_components=n_components, n_triangles=graph.triangle_counts.triangles,
        n_boundary_triangles=graph.triangle_counts.boundary,
        n_nonmanifold_triangles=graph.triangle_counts.non_manifold,
        n_flat_tets=int(np.count_nonzero(graph.measures <= noise)),
        n_turned_tets=int(np.count_nonzero(signed_volumes(mesh) < -noise)), volume=volume,
        bounds=(tuple(low), tuple(high)), diagonal=graph.diagonal,
    )  # fmt: skip
