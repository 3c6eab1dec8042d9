"""Compute the spectral embedding of the weights ``"parts"`` for all cells of a mesh."""

from __future__ import annotations

import numpy as np

from superfacets import _core
from superfacets.base.checks import checked_count, checked_threads
from superfacets.base.types import Floats
from superfacets.graph.kinds import kind_of
from superfacets.graph.size import DEFAULT_N_SEGMENTS, radius_of
from superfacets.mesh.convert import MeshLike, as_cells
from superfacets.weights.formulas import WeightOptions, weights_of_kind
from superfacets.weights.parts import N_COMPARED, N_VECTORS, conducting_graph, embedding


def spectral_embedding(
    mesh: MeshLike,
    n_vectors: int = N_VECTORS,
    *,
    weld: float = True,
    n_threads: int | None = None,
) -> Floats:
    r"""Return coordinates for each face, such that different parts of a shape are far apart.

    The coordinates are the eigenvectors of the smallest eigenvalues of :math:`L \phi = \lambda A
    \phi`, with areas A and the Laplacian L of the face graph. The conductance of an arc is

    .. math:: c_{ij} = \frac{\sqrt{A_i + A_j}}{g} \exp(-20 \kappa) + 10^{-6}

    where g is the distance between the centroids of the two faces, and kappa = eta theta / pi.
    Theta is the angle between the normals. Eta is the relative cost of the edge with the weights
    ``"parts"``: usually 1 for concave edges and ridges, and 0 for other convex edges. The
    conductance across creases is therefore low. For example, coordinates of fingers are far from
    coordinates of the palm, because creases separate fingers and palm. Vector q is scaled by
    :math:`(\lambda_q / \lambda_1)^{-1/2}`.

    Eigenvectors are computed on about 700 groups of faces, interpolated to the faces, and smoothed
    by relaxation. Vectors that are constant on each component are excluded. Eigenvalues below 0.001
    times the 15th eigenvalue are raised to this value.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, PointCloud, TetMesh or mesh-like
        Same as in `segment`.
    n_vectors : int, default 8
        Number of coordinates, from 1 to 15.
    weld, n_threads
        Same as in `segment`. The result does not depend on the number of threads.

    Returns
    -------
    ndarray of float64, shape (N, n_vectors)
        Coordinates of each face. Only ratios of distances are meaningful. The sign of each column
        is chosen so that, over the groups of faces, the coordinate with the largest absolute value
        is positive. If eigenvalues are equal, as for symmetric shapes, the basis of their
        eigenvectors is arbitrary. If a mesh has too few faces for `n_vectors` eigenvectors, the
        last columns are 0. All columns are 0 for meshes with thousands of components. The run time
        is about 2 microseconds per face.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, or if a parameter is out of range or of the wrong type.

    Examples
    --------
    >>> import superfacets
    >>> bear = superfacets.sample_mesh(5_000)
    >>> spectral_embedding(bear).shape
    (4892, 8)
    """
    n_vectors = checked_count(n_vectors, "n_vectors", N_COMPARED)
    threads = checked_threads(n_threads)
    cells = as_cells(mesh)
    kind = kind_of(cells)
    graph, _ = kind.build_graph(cells, weld, threads)
    surface = kind.surface(cells, graph, threads)
    n_regions = min(DEFAULT_N_SEGMENTS, surface.n_cells)
    radius = radius_of(graph.measures, n_regions, threads, kind.dimension)
    options = WeightOptions.checked("parts", None)
    weights = weights_of_kind(kind, surface, graph, radius, options)
    lengths, unit = graph.quantized(weights.weights, threads)
    placed = _core.PlacedCells(graph.positions, graph.measures, threads)
    unit *= surface.weight_unit
    ordered = _core.OrderedGraph(placed, *surface.arcs, lengths, threads, True, unit)
    base = conducting_graph(ordered, options.crease_cost(radius), threads)
    vectors = embedding(base, ordered, threads, n_vectors)
    table = np.zeros((surface.n_cells, n_vectors))
    n_there = min(n_vectors, vectors.shape[1])
    table[:, :n_there] = vectors[:, :n_there]
    return table
