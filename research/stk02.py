"""Arc weights of Shlafman, Tal and Katz, with which the paper compares its weights."""

from __future__ import annotations

import numpy as np

from superfacets import FaceGraph, build_face_graph
from superfacets.base.types import Floats
from superfacets.graph.surface import arc_measures
from superfacets.mesh.faces import FaceMesh


def stk02_weights(mesh: FaceMesh, graph: FaceGraph | None = None, *, alpha: float = 0.5) -> Floats:
    r"""Return the weight of each arc, shape (M,), an argument `weights` of `segment`.

    For faces i and j with centroids c, unit normals n, and a common edge with midpoint m,

    .. math:: w_{ij} = (1 - \alpha) (|c_i - m| + |m - c_j|) + \alpha (1 - (n_i \cdot n_j)^2)

    Weights are >= 0. `alpha` is from 0 (only distances) to 1 (only angles). Lengths are in the unit
    of the vertices, so regions change when the mesh is scaled or refined. The angular term is 0 on
    a flat edge, 1 at a right angle, and 0 if one of the faces has no normal.

    References
    ----------
    Shlafman, Tal and Katz, "Metamorphosis of Polyhedral Surfaces using Decomposition", 2002, in the
    form of equation 6 of Simari, Picciau and De Floriani, 2014.

    Examples
    --------
    Two faces meet at a right angle, and their centroids are 1/3 away from the common edge:

    >>> from superfacets import Mesh
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 0, 1]], [[0, 1, 2], [1, 0, 3]])
    >>> stk02_weights(mesh, alpha=0.25).round(3).tolist()
    [0.75, 0.75]
    """
    measures = arc_measures(mesh, build_face_graph(mesh) if graph is None else graph)
    assert measures.angles is not None
    assert measures.step_lengths is not None  # both exist for faces
    bends: Floats = np.sin(measures.angles) ** 2
    return (1.0 - alpha) * measures.step_lengths + alpha * bends
