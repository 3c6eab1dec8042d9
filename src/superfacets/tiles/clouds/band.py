"""Stage 5 for clouds on tiles: straight borders, among the points around them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ... import _core
from ...regions.edit import BorderCosts
from ...regions.smooth import MAX_CHAIN, MAX_DISTANCE, MAX_SWEEPS
from ..arcs import ArcFacts
from ..band import with_labels
from ..faces import is_among
from ..store import Run, TileStore
from .points import PointCells, Points

__all__ = ["smooth_points"]

Ints = npt.NDArray[np.int32]

RINGS = 4
"""Steps from borders, and again from every point that is missing one."""


class PointBand:
    """The points around borders.

    At its edge are points that a neighbor of is missing. What is read of a point depends on the
    neighbors of its neighbors, so it is right if the point is not at the edge, and no neighbor is:
    the others are the rim.
    """

    def __init__(self, store: TileStore, run: Run, points: Points) -> None:
        self._store = store
        self._run = run
        self.points = points

    def _is_edge(self) -> npt.NDArray[np.bool_]:
        places, targets = self.points.columns["places"], self.points.arcs["targets"]
        missing = np.append(0, np.cumsum(~is_among(targets, places)))
        return missing[self.points.offsets[1:]] > missing[self.points.offsets[:-1]]

    def _touching(self, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
        """Whether each point is one of those chosen, or a neighbor of one."""
        places = self.points.columns["places"]
        targets = self.points.take(np.flatnonzero(chosen)).arcs["targets"]
        return np.asarray(chosen | np.isin(places, targets))

    def rim(self) -> npt.NDArray[np.bool_]:
        """Points at the edge, and their neighbors."""
        return self._touching(self._is_edge())

    def grow(self, around: npt.NDArray[np.bool_]) -> None:
        """Add so many rings of points behind those of the edge that are near some points."""
        front = self.points.take(np.flatnonzero(self._touching(around) & self._is_edge()))
        for _ in range(RINGS):
            targets = front.arcs["targets"]
            missing = np.unique(targets[~is_among(targets, self.points.columns["places"])])
            if not len(missing):
                return
            front = self._read(missing)
            self.points = Points.joined([self.points, front])

    def _read(self, places: Ints) -> Points:
        tiles = self._store.tiles_of(places)
        jobs = [(tile, places[tiles == tile]) for tile in np.unique(tiles).tolist()]
        return Points.joined(self._run(_points_at, self._store, jobs))


def smooth_points(
    store: TileStore, facts: ArcFacts, labels: Ints, centers: Ints, scale: float, run: Run,
    n_threads: int,
) -> None:  # fmt: skip
    """Change labels to straight borders, as `smooth_tiled` does for faces."""
    found = with_labels(_at_borders, store, labels, run)
    band = PointBand(store, run, Points.joined(found))
    if not len(band.points):
        return
    around = np.ones(len(band.points), bool)
    while around.any():
        band.grow(around)
        cells = band.points.columns["cells"]
        moved, around = _smooth(store, facts, band, labels[cells], centers, scale, n_threads)
    labels[cells] = moved


def _smooth(
    store: TileStore, facts: ArcFacts, band: PointBand, labels: Ints, centers: Ints, scale: float,
    n_threads: int,
) -> tuple[Ints, npt.NDArray[np.bool_]]:  # fmt: skip
    """Labels of the points of the band, and those of its rim that moves were considered for."""
    cells = PointCells.of(store, band.points, n_threads)
    name, unit = "lengths", facts.unit
    if facts.rule.has_prices:
        name, unit = "border_lengths", facts.price_unit
    costs = BorderCosts(cells.surface, band.points.arcs[name][cells.arcs], unit, scale)
    numbers = band.points.columns["cells"][cells.order]
    at = np.minimum(np.searchsorted(numbers, centers), len(numbers) - 1)
    fixed = at[numbers[at] == centers].astype(np.int32)
    rim = np.flatnonzero(band.rim()[cells.order]).astype(np.int32)
    limits = (MAX_DISTANCE * costs.radius, MAX_CHAIN, MAX_SWEEPS, n_threads)
    moved, examined = _core.smooth_part(*costs.args, labels[cells.order], fixed, *limits, rim)
    result, around = np.empty_like(labels), np.zeros(len(labels), bool)
    result[cells.order] = moved
    around[cells.order[examined]] = True
    return result, around


def _at_borders(store: TileStore, tile: int) -> Points:
    """The points of a tile that have a neighbor of another label."""
    labels, offsets = store.read(tile, "labels"), store.read(tile, "arc_offsets")
    sources = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    differs = labels[store.read(tile, "arc_targets")] != labels[sources]
    return _points_at(store, tile, np.unique(sources[differs]) + store.starts[tile])


def _points_at(store: TileStore, tile: int, places: npt.NDArray[np.integer]) -> Points:
    """The points at some places of a tile."""
    own = np.arange(store.starts[tile], store.starts[tile + 1])
    around = np.concatenate([own, store.read(tile, "ghosts")])
    columns = {name: store.read(tile, name) for name in ("cells", "positions", "measures")}
    arcs = {"targets": around[store.read(tile, "arc_targets")]}
    for name in ("lengths", "border_lengths"):
        if store.has(tile, name):
            arcs[name] = store.read(tile, name)
    every = Points(columns | {"places": own}, store.read(tile, "arc_offsets"), arcs)
    return every.at(places)
