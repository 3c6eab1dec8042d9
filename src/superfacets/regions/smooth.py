"""Stage 5: straighten borders between regions."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Floats, Ints, Singles
from .._validate import checked_number, checked_seeds
from ..adapters.convert import MeshLike
from ..cells.cell_graph import CellGraph
from .edit import BorderCosts, LabeledPart

MAX_DISTANCE = 1.0
"""Default of `max_distance`, in r. On the benchmark models with 0.6, 1 and 1.3, compactness is
4.59, 4.49 and 4.44, and the undersegmentation error is 0.1232, 0.1237 and 0.1254."""

MAX_CHAIN = 8
"""Largest number of faces that move at once. With 1, 4, 8 and 16, compactness is 4.80, 4.60, 4.57
and 4.56."""

MAX_SWEEPS = 10
"""Largest number of sweeps. Most meshes need 4 sweeps. The limit makes the time linear."""


ROUNDNESS = 0.13
"""Weight of second moments relative to changes of area, in 1 / r^2. With 0 at k = 150, the
undersegmentation error is 0.0006 lower and compactness is 0.01 higher, but the median elongation of
regions of a square grid is 1.25 instead of 1.19."""


SmoothArgs: TypeAlias = tuple[
    _core.Surface, Singles, float, float, Ints, Ints, float, int, int, float, float, int
]
"""Arguments of the kernels: border costs, labels, fixed cells, limits, stiffness, roundness and
threads."""


class SmoothOptions(NamedTuple):
    """Parameters of smoothing: how far borders move, how many cells at once, and stiffness."""

    max_distance: float = MAX_DISTANCE  # in r
    max_chain: int = MAX_CHAIN
    stiffness: float = 0.0  # in 1 / r

    def args(self, costs: BorderCosts, labels: Ints, fixed: Ints) -> SmoothArgs:
        """Return the arguments of the kernels."""
        radius, n_threads = costs.radius, costs.surface.n_threads
        stiffness = self.stiffness / radius
        roundness = ROUNDNESS * stiffness / radius / radius
        if not math.isfinite(roundness):  # r is so small that regions are single cells
            stiffness = roundness = 0.0
        limits = self.max_distance * radius, self.max_chain, MAX_SWEEPS
        return (*costs.args, labels, fixed, *limits, stiffness, roundness, n_threads)


OF_PARTS = SmoothOptions(max_distance=2.75, max_chain=16, stiffness=1.5)
"""Options for weights ``"parts"``. On the benchmark models at k = 150, the undersegmentation error
and compactness are 0.1079 and 4.410. They are 0.1095 and 4.433 with stiffness 0, max_distance 3 and
chains of 8, and 0.1084 and 4.396 with max_distance 3."""


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
    r"""Return labels with straight borders on smooth surface, and with borders in creases.

    Chains of up to eight faces move to a neighboring region while this lowers the cost of the
    borders. The cost of a border is the sum over its edges of

    .. math:: |e| \exp\left(-\frac{w - g}{6 r}\right)

    with w the weight of the arc across the edge, g the distance between the two centroids via its
    midpoint (eq. 1) and r the expected radius of a region. The difference w - g is the cost of
    crossing the crease, so borders in creases are cheap. This cost alone shrinks small regions, and
    on regular grids allows long regions. A stiffness s prevents both by an additional cost, which
    depends on the areas A of the regions and on their initial areas :math:`A_0` and centroids
    :math:`x_0`:

    .. math:: \frac{s}{r} \sum_i \left( \frac{(A_i - A_{0,i})^2}{2 A_{0,i}}
        + \frac{0.13}{r^2} \int_i |x - x_{0,i}|^2 dA \right)

    Connected faces of a region stay connected, and no region vanishes. The test for connectivity is
    local, so it rejects some valid moves at edges of three or more faces.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        As for `segment`, or a graph of any cells. A cell of a graph moves only if its neighbors in
        its region are connected with each other.
    labels : array_like of int, shape (N,)
        0..K-1, each at least once. Cells labeled -1 are in no region and keep this label.
    weights : array_like, shape (M,), optional
        Arc weights of ``build_face_graph(mesh, weld=weld)`` in units of d; by default
        `crease_weights` for r = sqrt(A / (pi K)).
    centers : array_like of int, optional
        Distinct faces that keep their labels.
    max_distance : float, default 1.0
        Largest distance that a border moves, >= 0, in r. It is the path length, in the given
        weights, from a moved face to the initial border of its new region. Creases make paths long,
        so borders stay in creases.
    stiffness : float, default 0.0
        Resistance, >= 0, of regions to changes of their area and position. `segment` uses 1.5.
    weld, n_threads
        As for `segment`. The labels do not depend on the number of threads.

    Returns
    -------
    ndarray of int32, shape (N,)
        0..K-1, each at least once, and -1 where the given label is -1. Among moves with equal gain,
        the face with the lowest index moves first.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If labels are not integers >= -1, one per face, a label 0..K-1 is missing or all are -1, or
        another parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(N + M), plus constant time per border face for each of up to ten sweeps.

    Examples
    --------
    Straighten a zigzag border in a flat strip:

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


BALANCED_STIFFNESS = 15.0
"""Stiffness of regions with target sizes, in 1 / r. With 5, 15 and 30, the coefficient of variation
of areas before `move_to_goals` is 0.16, 0.13 and 0.12. With 30, compactness is 0.1 higher."""

BALANCED_SWEEPS = 20
"""Largest number of sweeps for regions with target sizes."""

NO_SIZES = np.empty(0)
"""Argument for the core: no target sizes."""


def straighten(
    costs: BorderCosts,
    labels: Ints,
    fixed: Ints,
    options: SmoothOptions,
    goals: tuple[Floats, Floats] | None = None,
) -> Ints:
    """Return smoothed labels; the arguments are checked.

    `goals` holds the sizes of cells and the target sizes of regions.
    """
    args = options.args(costs, labels, fixed)
    if goals is None or not goals[1].sum() > 0:
        return _core.smooth_borders(*args, NO_SIZES, NO_SIZES)
    unit = _core.sum_of(costs.surface.measures, costs.surface.n_threads) / goals[1].sum()
    stiff = BALANCED_SWEEPS, BALANCED_STIFFNESS / costs.radius, *args[10:]
    return _core.smooth_borders(*args[:8], *stiff, unit * goals[0], unit * goals[1])
