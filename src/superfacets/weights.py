"""Stage 2: one length per arc, from the geometry of its two faces."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _core
from ._validate import checked_number, checked_threads
from .face_graph import FaceGraph
from .mesh import Mesh, as_mesh

__all__ = ["is_inside_out", "scale_free_weights", "superfacet_weights"]

_VOLUME_NOISE = 1e-12
"""Part of the cubed diagonal below which a volume is rounding error: a double sheet has none."""


def superfacet_weights(
    mesh: object,
    graph: FaceGraph,
    *,
    alpha: float = 200.0,
    eta_convex: float = 0.2,
    n_threads: int | None = None,
) -> npt.NDArray[np.float64]:
    r"""Return the weight of each arc: surface distance plus a price for crossing a crease.

    For faces i and j with centroids c, across an edge e with midpoint m that they share,

    .. math:: w_{ij} = \frac{|c_i - m| + |m - c_j| + \alpha\,\eta\,|e|\,\theta / \pi}{d}

    where theta is the angle between the normals, eta is 1 on a concave edge and `eta_convex` on a
    convex one, and d is the diagonal of the bounding box. The edge is concave if each centroid
    lies above the plane of the other face, in the sum over both. The weights do not change under
    rigid motion and uniform scaling. Time is linear in the arcs.

    Where two neighbors are inconsistently oriented, the normal of the smaller one (of the one with
    the higher index, if they are as large) is turned for their arc. On a closed mesh that is inside
    out, concave and convex swap. Where a face has no normal, theta is 0.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    graph : FaceGraph
        Of the same mesh, from `build_face_graph`.
    alpha : float, default 200.0
        Weight of the angular term, >= 0. 0: distance alone.
    eta_convex : float, default 0.2
        What a convex edge counts against a concave one, >= 0.
    n_threads : int, optional
        As for `segment`.

    Returns
    -------
    ndarray of float64, shape (M,)
        In units of d; finite, >= 0, the same for both arcs of a pair. theta is in [0, pi] radians:
        0 on a flat edge, pi where a surface folds back on itself.

    Raises
    ------
    ValueError
        If `alpha` or `eta_convex` is negative or not finite, or the graph is of another mesh.

    References
    ----------
    Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014, eq. 1-3.

    Examples
    --------
    A square of edge 1, folded along its diagonal by 90 degrees, as a ridge and as a valley:

    >>> from superfacets import build_face_graph
    >>> vertices = [[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]]
    >>> for faces in ([0, 1, 2], [0, 2, 3]), ([2, 1, 0], [3, 2, 0]):
    ...     mesh = Mesh(vertices, faces)
    ...     superfacet_weights(mesh, build_face_graph(mesh), alpha=10).round(3).tolist()
    [1.008, 1.008]
    [3.317, 3.317]
    """
    alpha = checked_number(alpha, "alpha", zero=True)
    return _weights(mesh, graph, alpha, eta_convex, 0.0, n_threads)


def scale_free_weights(
    mesh: object,
    graph: FaceGraph,
    expected_radius: float,
    *,
    beta: float = 20.0,
    eta_convex: float = 0.0,
    n_threads: int | None = None,
) -> npt.NDArray[np.float64]:
    r"""Return the weight of each arc, with a price for creases that no resolution changes.

    .. math:: w_{ij} = \frac{|c_i - m| + |m - c_j| + \beta\,\eta\,r\,\theta / \pi}{d}

    is eq. 2 with the expected radius r of a region in place of the length of the edge, which
    shrinks as a mesh is refined: a path that turns by theta in all costs the same on fine and on
    coarse meshes. The rest is as for `superfacet_weights`.

    Parameters
    ----------
    mesh, graph, n_threads
        As for `superfacet_weights`.
    expected_radius : float
        r = sqrt(A / (pi k)), > 0, in the unit of the vertices: what a
        segmentation has as ``params["expected_radius"]``.
    beta : float, default 20.0
        How many radii it costs to turn by pi, >= 0.
    eta_convex : float, default 0.0
        What a convex edge counts against a concave one, >= 0.

    Returns
    -------
    ndarray of float64, shape (M,)
        In units of d; finite, >= 0, the same for both arcs of a pair.

    Raises
    ------
    ValueError
        If a number is negative or not finite, or the graph is of another mesh.

    Examples
    --------
    >>> from superfacets import build_face_graph
    >>> valley = Mesh([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> scale_free_weights(valley, build_face_graph(valley), 0.5, beta=10).round(3).tolist()
    [1.874, 1.874]
    """
    radius = checked_number(expected_radius, "expected_radius", zero=False)
    beta = checked_number(beta, "beta", zero=True)
    return _weights(mesh, graph, beta, eta_convex, radius, n_threads)


def _weights(
    mesh: object,
    graph: FaceGraph,
    factor: float,
    eta_convex: float,
    fold_length: float,
    n_threads: int | None,
) -> npt.NDArray[np.float64]:
    """Eq. 1-3 with `fold_length` in place of the length of the edge in eq. 2, unless it is 0."""
    mesh = as_mesh(mesh)
    threads = checked_threads(n_threads)
    eta_convex = checked_number(eta_convex, "eta_convex", zero=True)
    if graph.n_cells != mesh.n_faces:
        raise ValueError(f"the graph has {graph.n_cells} cells but the mesh {mesh.n_faces} faces")
    return _core.superfacet_weights(
        mesh.vertices,
        mesh.faces,
        graph.positions,
        graph.measures,
        graph.offsets,
        graph.neighbors,
        graph.sides,
        graph.same_turn,
        factor,
        eta_convex,
        fold_length,
        graph.diagonal,
        is_inside_out(mesh, graph, n_threads=threads),
        threads,
    )


def is_inside_out(mesh: Mesh, graph: FaceGraph, *, n_threads: int | None = None) -> bool:
    """Whether the mesh is closed and its normals point inwards: its signed volume is negative."""
    if graph.edge_counts.boundary:
        return False
    # Where faces are inconsistently oriented the volume depends on the origin; the centroid moves
    # and turns with the mesh.
    # Not graph.measures @ graph.positions: threads of a BLAS go on spinning for a while after it.
    total = float(graph.measures.sum())
    moment = np.einsum("i,ij->j", graph.measures, graph.positions)
    x, y, z = (moment / total if total else graph.positions[0]).tolist()
    volume = _core.signed_volume(mesh.vertices, mesh.faces, (x, y, z), checked_threads(n_threads))
    return volume < -_VOLUME_NOISE * graph.diagonal**3
