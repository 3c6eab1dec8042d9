"""Input and output of stage 5: cells in regions, costs of borders, and edits of regions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Floats, Ints, Singles
from .._validate import checked_partial_labels
from ..adapters.convert import CloudLike, MeshLike
from ..cells.cell_graph import CellGraph, checked_weights
from ..cells.constraints import NO_GROUPS, Cut
from ..cells.kinds import as_surface
from ..cells.size import radius_of
from ..cells.surface import Surface
from ..cells.weights import creases_of

CREASE_SCALE = 6.0
"""Crease cost of an edge, in r, at which a border along this edge costs 1/e of its length.

Between 4 and 8, the undersegmentation error of smoothed benchmark models changes by 0.0002.
"""


@dataclass(frozen=True, eq=False)
class BorderCosts:
    """Cost of borders between regions: the length of a border, reduced in creases."""

    surface: Surface
    lengths: Singles  # one per arc, in multiples of `unit`
    unit: float  # in units of the weights
    radius: float  # r, in the unit of the positions; > 0
    crease_scale: float = CREASE_SCALE  # in r

    @classmethod
    def of_weights(cls, surface: Surface, weights: Floats, radius: float) -> BorderCosts:
        """Return costs for checked arc weights, in units of ``surface.weight_unit``."""
        lengths, unit = _core.quantize_weights(weights, surface.n_threads)
        return cls(surface, lengths, unit, radius)

    def of_part(self, cut: Cut) -> BorderCosts:
        """Return the same costs for the kept cells."""
        return replace(self, surface=cut.surface_of(self.surface), lengths=self.lengths[cut.arcs])

    @property
    def args(self) -> tuple[_core.Surface, Singles, float, float]:
        """Arguments of kernels: surface, lengths, the unit of these lengths, and crease scale."""
        surface = self.surface
        unit = self.unit * surface.weight_unit
        return surface.handle, self.lengths, unit, self.crease_scale * self.radius


class RegionEdit(NamedTuple):
    """Labels after regions were joined, and the old region of each new region.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        0..K'-1, each at least once.
    sources : ndarray of int32, shape (K',)
        For each new region, the old region that equals or contains it.
    n_joined : int
        Number of pieces or regions that joined another region.
    n_islands : int
        Number of pieces or regions that could not join another region, because they have no
        neighbor.
    """

    labels: Ints
    sources: Ints
    n_joined: int
    n_islands: int


def read_regions(
    surface: Surface, labels: npt.ArrayLike, weights: npt.ArrayLike | None = None
) -> tuple[BorderCosts, Ints, int]:
    """Check labels and weights, and return costs of borders, labels and the number of regions.

    Cells labeled -1 are in no region. Default weights are the weights of a graph, or
    `crease_weights` for a mesh.
    """
    array, n_regions = checked_partial_labels(labels, surface.n_cells)
    if n_regions == 0:
        raise ValueError("all labels are -1: there is no region")
    measures = surface.measures if array.min() >= 0 else surface.measures[array >= 0]
    radius = radius_of(measures, n_regions, surface.n_threads, surface.dimension)
    radius = radius or surface.diagonal or 1.0
    if weights is None:
        weights = creases_of(surface, radius) if surface.weights is None else surface.weights
    checked = checked_weights(weights, surface.n_arcs, surface.n_threads)
    return BorderCosts.of_weights(surface, checked, radius), array, n_regions


@dataclass(frozen=True, eq=False)
class LabeledPart:
    """The labeled cells: all cells except cells labeled -1."""

    costs: BorderCosts
    labels: Ints  # (n,) labels of these cells
    n_regions: int
    whole: Ints  # (N,) labels of all cells
    cut: Cut | None  # None: all cells are labeled

    @classmethod
    def read(
        cls,
        source: MeshLike | CloudLike | CellGraph,
        labels: npt.ArrayLike,
        weights: npt.ArrayLike | None,
        weld: bool,
        n_threads: int | None,
    ) -> LabeledPart:
        """Check cells, their labels and weights; arguments as for `smooth_borders`."""
        surface = as_surface(source, weld=weld, n_threads=n_threads)
        costs, array, n_regions = read_regions(surface, labels, weights)
        if array.min() >= 0:
            return cls(costs, array, n_regions, array, None)
        is_kept = array >= 0
        sources = surface.sources
        keeps_arc = is_kept[sources] & is_kept[surface.neighbors]
        cut = Cut.of(surface, is_kept, keeps_arc, sources, NO_GROUPS)
        return cls(costs.of_part(cut), array[is_kept], n_regions, array, cut)

    def numbers_of(self, cells: Ints) -> Ints:
        """Map indices of cells to indices of labeled cells; cells labeled -1 are dropped."""
        if self.cut is None:
            return cells
        return np.searchsorted(self.cut.cells, cells[self.whole[cells] >= 0]).astype(np.int32)

    def whole_labels(self, labels: Ints) -> Ints:
        """Return labels of all cells, -1 for cells that were labeled -1."""
        return labels if self.cut is None else self.cut.whole_labels(labels)
