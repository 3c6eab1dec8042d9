"""Stage 5: straight borders between regions."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Ints, Singles
from .._validate import checked_number, checked_seeds
from ..adapters.convert import MeshLike
from ..cells.cell_graph import CellGraph
from .edit import BorderCosts, LabeledPart

MAX_DISTANCE = 1.0
"""Default of `max_distance`, in r. On the benchmark models compactness is 4.59 at 0.6, 4.49 at 1
and 4.44 at 1.3, and the undersegmentation error 0.1232, 0.1237 and 0.1254."""

MAX_CHAIN = 8
"""Largest number of faces that move at once. Compactness is 4.80 with 1, 4.60 with 4, 4.57 with 8,
4.56 with 16."""

MAX_SWEEPS = 10
"""Largest number of sweeps. Most meshes need 4; the limit keeps time linear on all."""


ROUNDNESS = 0.13
"""Weight of second moments relative to changes of area, in 1 / r^2. With 0, the undersegmentation
error is lower by 0.0006 at k = 150 and compactness higher by 0.01, and the regions of a square grid
are longer: the median elongation is 1.25 in place of 1.19."""


SmoothArgs: TypeAlias = tuple[
    _core.Surface, Singles, float, float, Ints, Ints, float, int, int, float, float, int
]
"""Border costs, labels, fixed cells, limits, stiffness, roundness, and threads."""


class SmoothOptions(NamedTuple):
    """How far borders move, how many cells move at once, and how stiff regions are."""

    max_distance: float = MAX_DISTANCE  # in r
    max_chain: int = MAX_CHAIN
    stiffness: float = 0.0  # in 1 / r

    def args(self, costs: BorderCosts, labels: Ints, fixed: Ints) -> SmoothArgs:
        """Return the arguments of the kernels."""
        radius, n_threads = costs.radius, costs.surface.n_threads
        stiffness = self.stiffness / radius
        roundness = ROUNDNESS * stiffness / radius / radius
        if not math.isfinite(roundness):  # regions this small are single cells
            stiffness = roundness = 0.0
        limits = self.max_distance * radius, self.max_chain, MAX_SWEEPS
        return (*costs.args, labels, fixed, *limits, stiffness, roundness, n_threads)


OF_PARTS = SmoothOptions(max_distance=2.75, max_chain=16, stiffness=1.5)
"""Options for weights ``"parts"``. On the benchmark models at k = 150, the undersegmentation error
is 0.1079 and compactness 4.410; 0.1095 and 4.433 with stiffness 0, max_distance 3 and chains of 8;
0.1084 and 4.396 with max_distance 3."""


def smooth_borders(
    mesh: MeshLike | CellGraph,
    labels: npt.ArrayLike,
    *,
    weights: npt.ArrayLike | None = None,
    centers: npt.ArrayLike | None = None,
    max_distance: float = MAX_DISTANCE,
    stiffness: float = 0.0,
    weld: bool = True,
    n_threads: int | None = None,
) -> Ints:
    r"""Return labels with straight borders where the surface is smooth, and in creases elsewhere.

    Chains of up to eight faces move from one region to the next as long as that makes the borders
    cheaper, where a border costs the sum over its edges of

    .. math:: |e| \exp\left(-\frac{w - g}{6 r}\right)

    with w the weight of the arc across the edge, g the distance between the two centroids over its
    midpoint (eq. 1) and r the expected radius of a region. The difference w - g is the cost of
    crossing the crease, so borders in creases are cheap. Short borders alone make small regions
    smaller, and on regular grids they are as short around long regions as around round ones. To
    prevent both, a stiffness s adds, with the areas A of the regions, and their areas
    :math:`A_0` and centroids :math:`x_0` at first,

    .. math:: \frac{s}{r} \sum_i \left( \frac{(A_i - A_{0,i})^2}{2 A_{0,i}}
        + \frac{0.13}{r^2} \int_i |x - x_{0,i}|^2 dA \right)

    Connected faces of a region stay connected, and no region vanishes. The test for that is local:
    at edges of three faces or more, some moves are not made although they would be possible.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        As for `segment`, or a graph of any cells. A cell of a graph moves only if its neighbors in
        its region are connected among themselves.
    labels : array_like of int, shape (N,)
        0..K-1, each at least once; cells labeled -1 are left alone: they are in no region.
    weights : array_like, shape (M,), optional
        Arc weights of ``build_face_graph(mesh, weld=weld)`` in units of d; `crease_weights`
        for r = sqrt(A / (pi K)) if not given.
    centers : array_like of int, optional
        Distinct faces that keep their labels.
    max_distance : float, default 1.0
        Maximum distance, in r and as a path length in the given weights, of a face from the border
        of the region that it moves to, >= 0. Creases make paths long, so borders stay in them.
    stiffness : float, default 0.0
        How firmly regions keep their area and place, >= 0. `segment` uses 1.5.
    weld, n_threads
        As for `segment`. The labels do not depend on the number of threads.

    Returns
    -------
    ndarray of int32, shape (N,)
        0..K-1, each at least once, and -1 where it was. Groups of neighboring regions move their
        faces in turn; groups far from each other move at the same time. Of moves that gain the
        same, the move of the face with the lower index comes first.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If the labels are not integers, not one per face, below -1, with gaps or all -1, or another
        parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(N + M), and for each of up to ten sweeps a constant time per face at a border.

    Examples
    --------
    A border that zigzags through a flat strip is made straight:

    >>> from superfacets import Mesh
    >>> vertices = [[x, y, 0] for y in range(3) for x in range(3)]
    >>> quads = [(v, v + 1, v + 4, v + 3) for v in (0, 1, 3, 4)]
    >>> mesh = Mesh(vertices, [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])
    >>> smooth_borders(mesh, [0, 0, 1, 0, 0, 0, 1, 1])
    array([0, 0, 1, 1, 0, 0, 1, 1], dtype=int32)
    """
    max_distance = checked_number(max_distance, "max_distance", zero=True)
    stiffness = checked_number(stiffness, "stiffness", zero=True)
    part = LabeledPart.read(mesh, labels, weights, weld, n_threads)
    fixed = np.empty(0, np.int32)
    if centers is not None:
        fixed = part.numbers_of(checked_seeds(centers, len(part.whole)))
    options = SmoothOptions(max_distance, stiffness=stiffness)
    return part.whole_labels(straighten(part.costs, part.labels, fixed, options))


def straighten(costs: BorderCosts, labels: Ints, fixed: Ints, options: SmoothOptions) -> Ints:
    """Return smoothed labels; arguments are checked."""
    return _core.smooth_borders(*options.args(costs, labels, fixed))
