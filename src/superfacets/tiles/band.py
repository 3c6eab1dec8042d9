"""Stage 5 on tiles: straight borders, in a mesh of the faces around them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from ..regions.edit import BorderCosts
from ..regions.smooth import MAX_CHAIN, MAX_DISTANCE, MAX_SWEEPS
from .arcs import ArcFacts, prices_of, weighed
from .faces import NO_FACES, Faces, is_among, read_faces
from .store import Run, TileStore

__all__ = ["smooth_tiled"]

Ints = npt.NDArray[np.int32]
Places = npt.NDArray[np.int64]

RINGS = 4
"""Rings of faces around borders, and again around every face that is missing one."""


class Band:
    """The faces around borders.

    At its edge are the faces that may lack one that they share a vertex with. The weight of an arc
    depends on the neighbors of its two faces. So what is read of a face is right if it shares no
    vertex with one at the edge: the others are the rim.
    """

    def __init__(self, store: TileStore, run: Run, faces: Faces) -> None:
        self._store = store
        self._run = run
        self.faces = faces
        self._is_edge = np.ones(len(faces), bool)

    def rim(self) -> Ints:
        """Faces that share a vertex with one at the edge."""
        edge = self.faces.take(np.flatnonzero(self._is_edge))
        return self.faces.touching(edge.vertex_ids).astype(np.int32)

    def grow(self, around: npt.NDArray[np.integer]) -> None:
        """Add rings of faces behind those of the edge that share a vertex with some faces."""
        near = self.faces.touching(self.faces.take(around).vertex_ids)
        front = [self.faces.take(near[self._is_edge[near]])]
        known, edge = np.sort(self.faces.places), np.sort(self.faces.places[self._is_edge])
        added = [self.faces]
        for _ in range(RINGS):
            found = self._touching(front)
            edge = np.setdiff1d(edge, _places_of(front), assume_unique=True)
            new = [part.take(np.flatnonzero(~is_among(part.places, known))) for part in found]
            known = np.sort(np.concatenate([known, _places_of(new)]))
            edge = np.sort(np.concatenate([edge, _places_of(new)]))
            front = [part.take(np.flatnonzero(is_among(part.places, edge))) for part in found]
            added += new
        self.faces = Faces.joined(added)
        self._is_edge = np.isin(self.faces.places, edge)

    def _touching(self, front: list[Faces]) -> list[Faces]:
        """All faces that share a vertex with some, tile by tile, by place."""
        vertex_ids = np.unique(np.concatenate([part.vertex_ids for part in front]))
        jobs = [(tile, vertex_ids) for tile in range(self._store.n_tiles)]
        found: list[Faces] = self._run(_touching, self._store, jobs)
        return found


def _places_of(parts: list[Faces]) -> Places:
    return np.concatenate([part.places for part in parts])


def smooth_tiled(
    store: TileStore, facts: ArcFacts, labels: Ints, centers: Ints, scale: float, run: Run
) -> Ints:
    """Return labels with straight borders, as `straighten` makes them of all faces at once.

    Moves are considered for faces at borders, and next to faces that have moved. All that is read
    for one is around its corners. So it suffices to have the faces some rings around the borders;
    where moves of a face at the rim of these were considered, more rings are added around it, and
    all is done again.
    """
    jobs = [(tile, labels[store.read(tile, "cells")]) for tile in range(store.n_tiles)]
    ghosts = [labels[_ghost_cells(store, tile)] for tile in range(store.n_tiles)]
    found = run(
        _at_borders, store, [(*job, around) for job, around in zip(jobs, ghosts, strict=True)]
    )
    band = Band(store, run, Faces.joined(found))
    if not len(band.faces):
        return labels
    around: npt.NDArray[np.integer] = np.arange(len(band.faces))
    while len(around):
        band.grow(around)
        moved, around = _smooth(store, facts, band, labels[band.faces.cells], centers, scale)
    result = labels.copy()
    result[band.faces.cells] = moved
    return result


def _smooth(
    store: TileStore, facts: ArcFacts, band: Band, labels: Ints, centers: Ints, scale: float
) -> tuple[Ints, Ints]:
    """Labels of the band, and the faces of its rim for which moves were considered."""
    rule, unit = facts.rule, facts.unit
    surface, weights, _ = weighed(store, band.faces, rule)
    if rule.has_prices:
        weights, unit = prices_of(surface, rule), facts.price_unit
    lengths = _core.round_weights(weights, unit, rule.n_threads)
    costs = BorderCosts(surface, lengths, unit, scale)
    at = np.minimum(np.searchsorted(band.faces.cells, centers), len(band.faces) - 1)
    fixed = at[band.faces.cells[at] == centers].astype(np.int32)
    limits = (MAX_DISTANCE * costs.radius, MAX_CHAIN, MAX_SWEEPS, rule.n_threads)
    return _core.smooth_part(*costs.args, labels, fixed, *limits, band.rim())


def _ghost_cells(store: TileStore, tile: int) -> Ints:
    return store.read_at("cells", store.read(tile, "ghosts"))


def _at_borders(store: TileStore, tile: int, labels: Ints, around: Ints) -> Faces:
    """The faces of a tile that have a neighbor of another label."""
    every = np.concatenate([labels, around])
    sources = np.repeat(np.arange(len(labels)), np.diff(store.read(tile, "arc_offsets")))
    differs = every[store.read(tile, "arc_targets")] != labels[sources]
    return read_faces(store, tile).take(np.unique(sources[differs]))


def _touching(store: TileStore, tile: int, vertex_ids: Places) -> Faces:
    """The faces of a tile that have one of these vertices."""
    if not is_among(store.read(tile, "vertex_ids"), vertex_ids).any():
        return NO_FACES
    faces = read_faces(store, tile)
    return faces.take(faces.touching(vertex_ids))
