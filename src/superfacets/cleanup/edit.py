"""Stage 5: define classes for labeled cells, costs of borders, and results of changed regions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import checked_regions, checked_threads, counted
from ..base.types import Floats, Ints, Singles
from ..graph.cell_graph import BaseGraph, CellGraph, checked_weights
from ..graph.constraints import NO_GROUPS, KeptCells
from ..graph.kinds import as_known, graph_and_surface
from ..graph.size import radius_of
from ..graph.surface import Surface
from ..mesh.base import Cells
from ..mesh.convert import MeshLike
from ..weights.formulas import creases_of

CREASE_SCALE = 6.0
"""Crease cost, in units of the radius of a region, at which an edge adds only 1/e of its length to
the cost of a border. With scales from 4 to 8, the undersegmentation error of smoothed benchmark
models changes by 0.0002."""


@dataclass(frozen=True, eq=False)
class BorderCosts:
    """Data to compute the cost of a border: its length, where edges in creases count as shorter."""

    surface: Surface
    lengths: Singles  # (M,) weight of each arc, as a whole number of `unit`
    unit: float  # unit of `lengths`, as a multiple of ``surface.weight_unit``
    radius: float  # expected radius r of regions in the unit of the positions, > 0
    crease_scale: float = CREASE_SCALE  # see `CREASE_SCALE`; in units of `radius`

    @classmethod
    def of_weights(cls, surface: Surface, weights: Floats, radius: float) -> BorderCosts:
        """Make the costs from checked arc weights in units of ``surface.weight_unit``."""
        lengths, unit = _core.quantize_weights(weights, surface.n_threads)
        return cls(surface, lengths, unit, radius)

    def of_kept(self, kept: KeptCells) -> BorderCosts:
        """Return the costs restricted to the kept cells."""
        return replace(self, surface=kept.surface_of(self.surface), lengths=self.lengths[kept.arcs])

    @property
    def args(self) -> tuple[_core.Surface, _core.BorderCosts]:
        """The surface and the border costs as C++ objects; lengths are in the unit of positions."""
        unit, scale = self.unit * self.surface.weight_unit, self.crease_scale * self.radius
        return self.surface.handle, _core.BorderCosts(self.lengths, unit, scale)


class RegionEdit(NamedTuple):
    """Result of `merge_small_regions` or `enforce_connectivity`.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        New label of each cell. Each label from 0 to K' - 1 occurs.
    sources : ndarray of int32, shape (K',)
        Old label of each new region. If several regions were merged, it is the old label of the
        region that the other regions joined.
    n_joined : int
        Number of regions (of pieces for `enforce_connectivity`) that joined another region.
    n_islands : int
        Number of regions (of pieces) that should have joined a region, but have no neighbor.
    """

    labels: Ints
    sources: Ints
    n_joined: int
    n_islands: int

    def __repr__(self) -> str:
        counts = f"{self.n_joined} joined, {counted(self.n_islands, 'island')}"
        return f"RegionEdit({counted(len(self.sources), 'region')}, {counts}, .labels, .sources)"


def read_labeled(
    cells: Cells | CellGraph, labels: npt.ArrayLike, weights: npt.ArrayLike | None, weld: float,
    n_threads: int,
) -> tuple[BaseGraph, BorderCosts, Ints, int]:  # fmt: skip
    """Check labels and weights; return graph, border costs, labels, and the number of regions."""
    array, n_regions = checked_regions(labels, cells.n_cells)
    graph, surface = graph_and_surface(cells, weld, n_threads, array >= 0)
    measures = surface.measures if array.min() >= 0 else surface.measures[array >= 0]
    radius = radius_of(measures, n_regions, surface.n_threads, surface.dimension)
    radius = radius or surface.diagonal or 1.0
    if weights is None:
        weights = creases_of(surface, radius) if surface.weights is None else surface.weights
    checked = checked_weights(weights, surface.n_arcs, surface.n_threads)
    return graph, BorderCosts.of_weights(surface, checked, radius), array, n_regions


@dataclass(frozen=True, eq=False)
class LabeledPart:
    """The cells of a mesh, cloud or graph that have a label >= 0, and their border costs."""

    costs: BorderCosts
    labels: Ints  # (n,) label of each labeled cell
    n_regions: int
    whole: Ints  # (N,) label of each cell, -1 included
    kept: KeptCells | None  # selection of the labeled cells; None if no label is -1

    @classmethod
    def read(
        cls, source: MeshLike | CellGraph, labels: npt.ArrayLike,
        weights: npt.ArrayLike | None, weld: float, n_threads: int | None,
    ) -> LabeledPart:  # fmt: skip
        """Check the arguments of functions like `smooth_borders`, and select the labeled cells."""
        cells = as_known(source)
        threads = checked_threads(n_threads)
        _, costs, array, n_regions = read_labeled(cells, labels, weights, weld, threads)
        if array.min() >= 0:
            return cls(costs, array, n_regions, array, None)
        is_kept, surface = array >= 0, costs.surface
        sources = surface.sources
        keeps_arc = is_kept[sources] & is_kept[surface.neighbors]
        kept = KeptCells.of(surface, is_kept, keeps_arc, sources, NO_GROUPS)
        return cls(costs.of_kept(kept), array[is_kept], n_regions, array, kept)

    def numbers_of(self, cells: Ints) -> Ints:
        """Convert indices of cells to indices among labeled cells; cells labeled -1 are dropped."""
        if self.kept is None:
            return cells
        return np.searchsorted(self.kept.cells, cells[self.whole[cells] >= 0]).astype(np.int32)

    def whole_labels(self, labels: Ints) -> Ints:
        """Convert new labels of the labeled cells to labels of all cells; other cells get -1."""
        return labels if self.kept is None else self.kept.whole_labels(labels)
