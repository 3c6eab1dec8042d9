"""Stage 5: smooth the borders between regions."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_number, checked_seeds
from ..base.types import Floats, Ints
from ..graph.cell_graph import CellGraph
from ..mesh.convert import MeshLike
from .edit import BorderCosts, LabeledPart

MAX_DISTANCE = 1.0
"""Default of `max_distance` in `smooth_borders`, in units of r. Distances of 0.6 and 1.3 change the
compactness on the benchmark models by 0.10 and -0.05."""

MAX_CHAIN = 8
"""Maximum number of adjacent faces that move to another region in one step. With maximums of 1, 4,
8 and 16, the compactness on the benchmark models is 4.80, 4.60, 4.57 and 4.56."""

MAX_SWEEPS = 10
"""Maximum number of sweeps over all border faces. Most meshes need 4 sweeps."""

ROUNDNESS = 0.13
"""Factor of the integral in the stiffness cost of `smooth_borders`, in units of 1 / r^2. With a
factor of 0 and 150 regions, the undersegmentation error falls by 0.0006 and the compactness rises
by 0.01, but regions on a square grid have a median elongation of 1.25 instead of 1.19."""

BALANCED_STIFFNESS = 15.0
"""Stiffness of regions with target sizes, in units of 1 / r, in place of `SmoothOptions.stiffness`.
With 5, 15 and 30, the coefficient of variation of areas before `move_to_goals` is 0.16, 0.13 and
0.12. With 30, the compactness is 0.1 higher."""

BALANCED_SWEEPS = 20
"""Maximum number of sweeps for regions with target sizes."""

NO_SIZES = np.empty(0)
"""Value for the C++ core if there are no target sizes."""


class SmoothOptions(NamedTuple):
    """Parameters of border smoothing; see `smooth_borders`."""

    max_distance: float = MAX_DISTANCE  # maximum distance that a border moves, in units of r
    max_chain: int = MAX_CHAIN  # maximum number of faces that move in one step
    stiffness: float = 0.0  # resistance to changes of area and position, in units of 1 / r

    def for_core(
        self, radius: float, targets: tuple[Floats, Floats] | None = None
    ) -> _core.SmoothOptions:
        """Convert the options for the C++ core, which measures lengths in the unit of positions.

        `targets` are two arrays: the size of each cell, and the target size of each region.
        The total of the target sizes must equal the total of the measures of cells.
        """
        stiffness = self.stiffness / radius
        roundness = ROUNDNESS * stiffness / radius / radius
        if not math.isfinite(roundness):  # 1 / r^3 overflows only if regions are single cells
            stiffness = roundness = 0.0
        sizes, goals = (NO_SIZES, NO_SIZES) if targets is None else targets
        return _core.SmoothOptions(
            max_distance=self.max_distance * radius, max_chain=self.max_chain,
            max_sweeps=MAX_SWEEPS if targets is None else BALANCED_SWEEPS,
            stiffness=stiffness if targets is None else BALANCED_STIFFNESS / radius,
            roundness=roundness, sizes=sizes, goals=goals,
        )  # fmt: skip


OF_PARTS = SmoothOptions(max_distance=3.0, max_chain=16, stiffness=1.25)
"""Options for weights ``"parts"``. On the benchmark models with 150 regions, the undersegmentation
error is 0.002 higher if the stiffness is 0, and equal if it is 1.6."""


def smooth_borders(
    mesh: MeshLike | CellGraph, labels: npt.ArrayLike, *, weights: npt.ArrayLike | None = None,
    centers: npt.ArrayLike | None = None, max_distance: float = MAX_DISTANCE,
    stiffness: float = 0.0, weld: float = True, n_threads: int | None = None,
) -> Ints:  # fmt: skip
    r"""Straighten borders between regions where the surface is smooth, but keep them in creases.

    Chains of up to eight adjacent faces move to a neighboring region as long as moves reduce the
    total cost of borders. The cost of a border is the sum over its edges e of

    .. math:: |e| \exp\left(-\frac{w - g}{6 r}\right)

    where w is the weight of the arc across the edge, g is the length of the path between the two
    centroids through the midpoint of the edge, and r is the expected radius of a region. So borders
    in creases have a low cost. A stiffness s keeps small regions from shrinking: it penalizes
    changes of their initial areas :math:`A_{0,i}` and centroids :math:`x_{0,i}`:

    .. math:: \frac{s}{r} \sum_i \left( \frac{\bar A}{2} \left(\frac{A_i}{A_{0,i}} - 1\right)^2
        + \frac{0.13}{r^2} \int_i |x - x_{0,i}|^2 dA \right)

    where :math:`\bar A` is the mean of the initial areas.

    Connected faces of a region stay connected, and no region vanishes. Connectivity is tested
    locally, which rejects some valid moves at edges of three or more faces. Faces with more than
    256 arcs keep their labels.

    Parameters
    ----------
    mesh : Mesh or mesh-like, or CellGraph with ArcMeasures
        Same as in `segment`, or a graph of any cells. A cell of a graph moves only if its neighbors
        in its region are connected with each other.
    labels : array_like of int, shape (N,)
        Labels of regions. Each label from 0 to K - 1 must occur. Cells labeled -1 keep this label.
    weights : array_like, shape (M,), optional
        One weight per arc of ``build_face_graph(mesh, weld=weld)``, in units of the diagonal of the
        bounding box. The default is `crease_weights` for the radius r = sqrt(A / (pi K)), with
        ``hollows=False``. For a `CellGraph`, the default is its own weights.
    centers : array_like of int, optional
        Indices of distinct cells that keep their labels.
    max_distance : float, default 1.0
        Maximum distance that a border moves, >= 0, in units of r, along the path from a moved face
        to the initial border of its new region. Creases on the path count as distance.
    stiffness : float, default 0.0
        Resistance of regions to changes of their area and position, >= 0. With weights
        ``"parts"``, `segment` uses 1.25.
    weld, n_threads
        Same as in `segment`. The labels do not depend on the number of threads.

    Returns
    -------
    ndarray of int32, shape (N,)
        New label of each cell. Each label from 0 to K - 1 occurs, and cells labeled -1 keep this
        label. If several moves reduce the cost equally, the face with the lowest index moves first.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, if labels are not one integer >= -1 per cell, if a label from 0 to
        K - 1 is missing or all labels are -1, or if another parameter is not valid.

    Examples
    --------
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


def straighten(
    costs: BorderCosts, labels: Ints, fixed: Ints, options: SmoothOptions,
    targets: tuple[Floats, Floats] | None = None,
) -> Ints:  # fmt: skip
    """Smooth borders as `smooth_borders` does, without checks; for `targets`, see `for_core`."""
    n_threads = costs.surface.n_threads
    if targets is not None:
        sizes, goals = targets
        unit = _core.sum_of(costs.surface.measures, n_threads) / goals.sum() if goals.any() else 0.0
        targets = (unit * sizes, unit * goals) if unit else None
    return _core.smooth_borders(
        *costs.args, labels, fixed, options.for_core(costs.radius, targets), n_threads
    )
