"""Facts about a mesh that decide what can be done with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from .._validate import checked_threads
from ..adapters.convert import MeshLike, as_mesh
from .face_graph import FaceGraph, graph_and_shapes
from .size import checked_n_segments, radius_of
from .slivers import sliver_share
from .surface import is_inside_out

__all__ = ["MeshInfo", "mesh_info"]


@dataclass(frozen=True)
class MeshInfo:
    """Counts and sizes of a mesh."""

    n_faces: int
    """Faces."""
    n_vertices: int
    """Vertices, used or not."""
    n_positions: int
    """Different positions of vertices: fewer than vertices in soup and on seams."""
    n_components: int
    """Sets of faces that are connected by edges."""
    n_edges: int
    """Edges."""
    n_boundary_edges: int
    """Edges of one face."""
    n_nonmanifold_edges: int
    """Edges of three faces or more."""
    n_inconsistent_edges: int
    """Edges whose two faces run through them in the same direction."""
    n_degenerate_faces: int
    """Faces that have no normal: two corners in one place, or all three on a line."""
    is_inside_out: bool
    """Closed, and with normals that point inwards."""
    area: float
    """Total area, in the squared unit of the vertices."""
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Low and high corner of the bounding box of the vertices that faces use."""
    diagonal: float
    """Length of the diagonal of that box."""
    sliver_share: float
    """Share of the area, 0 to 1, in faces so long and thin that 150 regions (one per face, if these
    are fewer) become stripes; see `Segmentation`."""


def mesh_info(mesh: MeshLike, *, weld: bool = True) -> MeshInfo:
    """Return counts and sizes of a mesh.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    weld : bool, default True
        Count vertices at exactly the same position as one when edges are found.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> info = mesh_info(square)
    >>> info.n_components, info.n_boundary_edges, info.area
    (1, 4, 1.0)
    """
    mesh = as_mesh(mesh)
    n_threads = checked_threads(None)
    graph, shapes = graph_and_shapes(mesh, weld=weld, n_threads=n_threads)
    edges, boundary, non_manifold, inconsistent = graph.edge_counts
    low, high = graph.bounds.tolist()
    return MeshInfo(
        n_faces=mesh.n_faces,
        n_vertices=mesh.n_vertices,
        n_positions=len(np.unique(_core.weld_vertices(mesh.vertices, n_threads))),
        n_components=_count_components(graph),
        n_edges=edges,
        n_boundary_edges=boundary,
        n_nonmanifold_edges=non_manifold,
        n_inconsistent_edges=inconsistent,
        n_degenerate_faces=_core.count_degenerate(mesh.vertices, mesh.faces),
        is_inside_out=is_inside_out(mesh, graph),
        area=_core.sum_of(graph.measures, n_threads),
        bounds=(tuple(low), tuple(high)),
        diagonal=graph.diagonal,
        sliver_share=sliver_share(
            mesh, graph, shapes.longest, _default_radius(graph, n_threads), n_threads
        ),
    )


def _default_radius(graph: FaceGraph, n_threads: int) -> float:
    """Of as many regions as `segment` makes by default."""
    n_segments = checked_n_segments(None, graph.n_cells)
    return radius_of(graph.measures, n_segments, n_threads)


def _count_components(graph: FaceGraph) -> int:
    same_label = np.zeros(graph.n_cells, np.int32)
    _, n_components = _core.find_components(graph.offsets, graph.neighbors, same_label)
    return n_components
