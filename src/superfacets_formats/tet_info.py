"""Compute counts and sizes of tetrahedral meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .tet_graph import TetGraph
from .tet_mesh import TetMesh, signed_volumes

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
        n_tets=mesh.n_tets,
        n_vertices=mesh.n_vertices,
        n_positions=n_positions,
        n_components=n_components,
        n_triangles=graph.triangle_counts.triangles,
        n_boundary_triangles=graph.triangle_counts.boundary,
        n_nonmanifold_triangles=graph.triangle_counts.non_manifold,
        n_flat_tets=int(np.count_nonzero(graph.measures <= noise)),
        n_turned_tets=int(np.count_nonzero(signed_volumes(mesh) < -noise)),
        volume=volume,
        bounds=(tuple(low), tuple(high)),
        diagonal=graph.diagonal,
    )
