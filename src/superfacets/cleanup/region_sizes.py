"""Stage 5: move single cells between regions until the regions have their target sizes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.checks import counted
from ..base.errors import MeshError
from ..base.types import Floats, Ints
from ..graph.sums import sums_by_label
from .edit import BorderCosts
from .smooth import MAX_DISTANCE, SmoothOptions, straighten

SPREAD = 0.2
"""Accepted relative difference between the size of a region and its target size. The difference may
be larger if cells are large. On 12 benchmark models with 150 regions, the undersegmentation error
is 0.095 and the coefficient of variation of areas 0.070. With 0.15, they are 0.095 and 0.066, but
some regions are less compact."""

ROUNDS = 4
"""Number of times that borders are smoothed and cells are moved again."""


class Goals(NamedTuple):
    """Target sizes of regions. The size of a region is the sum of the sizes of its cells."""

    sizes: Floats  # (N,) size of each cell
    targets: Floats  # (K,) target size of each region
    bounds: tuple[float, float] = (0.0, math.inf)  # minimum and maximum size of any region
    is_exact: bool = False  # True if sizes must equal `targets`, even if regions get disconnected

    @property
    def limits(self) -> tuple[Floats, Floats]:
        """Accepted minimum and maximum size of each region, as two arrays (K,)."""
        if self.is_exact:
            return self.targets, self.targets
        low, high = self.bounds
        lows, highs = (1.0 - SPREAD) * self.targets, (1.0 + SPREAD) * self.targets
        return np.clip(lows, low, high), np.clip(highs, low, high)

    def out_of_bounds(self, labels: Ints) -> Ints:
        """Return the regions whose size is not in `bounds` or, if `is_exact`, is not its target."""
        low, high = self.limits if self.is_exact else self.bounds
        found = sums_by_label(labels, self.sizes, len(self.targets))
        slack = 1e-9 * float(found.mean())
        return np.flatnonzero((found < low - slack) | (found > high + slack)).astype(np.int32)

    def check(self, labels: Ints) -> None:
        """Raise a MeshError if the size of a region is out of bounds (see `out_of_bounds`)."""
        low, high = self.bounds
        for region in self.out_of_bounds(labels)[:1].tolist():
            size = float(self.sizes[labels == region].sum())
            if self.is_exact:
                wanted = self.targets[region]
                raise MeshError(
                    f"Sizes(cells={self.targets.max():g}) cannot be met: region {region} has"
                    f" {counted(int(size), 'cell')} instead of {wanted:g}"
                )
            name, bound = ("least", low) if size < low else ("most", high)
            raise MeshError(
                f"Sizes(bounds=...) cannot be met: region {region} has the size {size:g} instead"
                f" of at {name} {bound:g}; try less strict bounds or another number of regions"
            )


def settle(
    costs: BorderCosts, labels: Ints, centers: Ints, goals: Goals, smoothing: SmoothOptions | None
) -> tuple[Ints, Ints]:
    """Move cells between regions to bring sizes within `goals.limits`; return labels and centers.

    If `smoothing` is given, borders are smoothed and cells moved again, up to `ROUNDS` times.
    Raises a MeshError if sizes stay out of bounds.
    """
    positions, measures = costs.surface.positions, costs.surface.measures
    labels = move_to_goals(costs, labels, goals)
    centers = recentered(centers, labels, positions, measures)
    if smoothing is not None:
        near = smoothing._replace(max_distance=MAX_DISTANCE)
        for _ in range(ROUNDS):
            smooth = straighten(costs, labels, centers, near, (goals.sizes, goals.targets))
            again = move_to_goals(costs, smooth, goals)
            if len(goals.out_of_bounds(again)):
                break
            labels = again
            centers = recentered(centers, labels, positions, measures)
    goals.check(labels)
    return labels, centers


def move_to_goals(costs: BorderCosts, labels: Ints, goals: Goals) -> Ints:
    """Move cells along shortest paths from large to small regions; return new labels.

    Some sizes may remain outside the limits. Regions stay connected unless `goals.is_exact`.
    """
    lows, highs = goals.limits
    return _core.move_cells(
        *costs.args, labels, goals.sizes, lows, highs, goals.is_exact, costs.surface.n_threads
    )


def recentered(centers: Ints, labels: Ints, positions: Floats, measures: Floats) -> Ints:
    """Replace each center outside its region by the cell nearest to the centroid of the region."""
    centers = centers.copy()
    for region in np.flatnonzero(labels[centers] != np.arange(len(centers))).tolist():
        cells = np.flatnonzero(labels == region)
        weights = measures[cells] if measures[cells].sum() > 0 else None
        offsets = positions[cells] - np.average(positions[cells], axis=0, weights=weights)
        centers[region] = cells[np.argmin((offsets * offsets).sum(axis=1))]
    return centers
