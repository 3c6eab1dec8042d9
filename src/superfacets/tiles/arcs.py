"""Stages 1 and 2 on tiles: the arcs of each tile, and their weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .. import _core
from ..cells.cell_graph import box_diagonal
from ..cells.face_graph import FaceGraph
from ..cells.hollows import evened_share
from ..cells.kinds import kind_of
from ..cells.slivers import area_of_slivers
from ..cells.surface import Surface, enclosed, is_negative
from ..cells.weights import WeightOptions, creases_and_turn, creases_of
from ..mesh.faces import signed_volume
from .faces import Faces, read_faces, rows
from .rims import find_rims, halo_of
from .store import Run, TileStore

__all__ = [
    "ArcFacts", "WeightRule", "find_arcs", "prices_of", "round_all", "weighed", "write_arcs",
]  # fmt: skip


@dataclass(frozen=True)
class WeightRule:
    """What weights depend on beside the faces.

    Attributes
    ----------
    radius : float
        Expected radius of regions.
    options : WeightOptions
    is_turned : bool
        Whether normals point inwards.
    has_prices : bool
        Whether the default weights are needed as well, for borders.
    n_threads : int
    evened : float
        What smooth concave edges count less, and convex ones count: see `evened_share`.
    """

    radius: float
    options: WeightOptions
    is_turned: bool
    has_prices: bool
    n_threads: int
    evened: float = 0.0


@dataclass(frozen=True)
class ArcFacts:
    """What is known of all arcs together.

    Attributes
    ----------
    rule : WeightRule
    unit : float
        Of lengths, as `quantize_weights` chooses it.
    price_unit : float
        The same for the default weights, if they are needed.
    sliver_area : float
        Area of long and thin faces.
    """

    rule: WeightRule
    unit: float
    price_unit: float
    sliver_area: float


@dataclass(frozen=True)
class _TileSums:
    """What a tile adds to the facts."""

    weights: float
    prices: float
    has_boundary: bool
    is_inconsistent: bool
    turn: int
    volume: float
    sliver_area: float


def find_arcs(store: TileStore, rule: WeightRule, run: Run) -> ArcFacts:
    """Write the arcs of all tiles with their lengths, and return what is common to all.

    Per tile: ``arc_offsets`` (n + 1,) and ``arc_targets`` of its faces, by place in the tile, where
    numbers from n on stand for the places in ``ghosts``, ascending, whose cells are
    ``ghost_cells``; ``arc_sides``; and ``lengths``, or ``border_lengths`` where borders have their
    own.
    """
    meeting = find_rims(store, run)
    origin = _centroid(store, run)
    tiles = range(store.n_tiles)

    def weigh(rule: WeightRule) -> list[_TileSums]:
        return run(_weigh_tile, store, [(tile, meeting[tile], rule, origin) for tile in tiles])

    sums = weigh(rule)
    diagonal = box_diagonal(store.bounds)
    volume = sum(some.volume for some in sums)
    is_closed = not any(some.has_boundary for some in sums)
    if is_closed and is_negative(volume, diagonal):
        rule = replace(rule, is_turned=True)
        sums = weigh(rule)
    if _are_creases(rule) and is_closed and not any(some.is_inconsistent for some in sums):
        turn = sum(some.turn for some in sums)
        inside = enclosed(volume, diagonal)
        rule = replace(rule, evened=evened_share(turn, inside, store.total_measure, diagonal))
    if rule.evened:
        sums = weigh(rule)
    unit, price_unit = round_all(store, rule, sums, run)
    return ArcFacts(rule, unit, price_unit, sum(some.sliver_area for some in sums))


class Sums(Protocol):
    """What weights, and prices if there are any, of a tile come to."""

    @property
    def weights(self) -> float: ...
    @property
    def prices(self) -> float: ...


def round_all(
    store: TileStore, rule: WeightRule, sums: Sequence[Sums], run: Run
) -> tuple[float, float]:
    """Write ``lengths`` and ``border_lengths`` in place of weights and prices; their units."""
    units = []
    for name, rounded, total in (
        ("weights", "lengths", sum(some.weights for some in sums)),
        ("prices", "border_lengths", sum(some.prices for some in sums)),
    ):
        units.append(_core.unit_of_lengths(total))
        if store.has(0, name):
            jobs = [
                (tile, name, rounded, units[-1], rule.n_threads) for tile in range(store.n_tiles)
            ]
            run(_round_lengths, store, jobs)
            store.remove_from_all(name)
    return units[0], units[1]


def prices_of(surface: Surface, rule: WeightRule) -> npt.NDArray[np.float64]:
    """What borders go by where weights are in another unit, as in `segment`."""
    return creases_of(surface, rule.radius, ridges=0.0)


def _are_creases(rule: WeightRule) -> bool:
    """Whether weights are those that depend on how hollow a shape is."""
    return bool(rule.options.params["weights"] == "creases" and rule.options.params["alpha"])


def weighed(
    store: TileStore, faces: Faces, rule: WeightRule, is_own: npt.NDArray[np.bool_]
) -> tuple[Surface, npt.NDArray[np.float64], FaceGraph, int]:
    """The surface of some faces, which are in the order of the input, and weights of its arcs.

    And the turn of the arcs from own faces, where weights depend on it.
    """
    mesh = faces.mesh(store)
    kind = kind_of(mesh)
    graph, shapes = kind.build_graph(mesh, False, rule.n_threads)  # vertices are welded
    surface = Surface.of_turned_faces(mesh, graph, rule.is_turned, rule.n_threads)
    if not _are_creases(rule):
        weights = kind.weights(surface, graph, shapes, rule.radius, rule.options)
        return surface, np.asarray(weights), graph, 0
    normals = None if shapes is None else shapes.normals
    priced, turn = creases_and_turn(
        surface, graph, rule.radius, rule.options, normals, rule.evened, is_own.view(np.uint8)
    )
    return surface, priced, graph, turn


def _centroid(store: TileStore, run: Run) -> tuple[float, float, float]:
    """The area-weighted mean of all faces; that of the first tile where there is no area."""
    moments = run(_moment, store, [(tile,) for tile in range(store.n_tiles)])
    total = store.total_measure
    x, y, z = (np.sum(moments, axis=0) / total if total else store.read(0, "positions")[0]).tolist()
    return x, y, z


def _moment(store: TileStore, tile: int) -> npt.NDArray[np.float64]:
    measures, positions = store.read(tile, "measures"), store.read(tile, "positions")
    moment: npt.NDArray[np.float64] = np.einsum("i,ij->j", measures, positions)
    return moment


def _weigh_tile(
    store: TileStore,
    tile: int,
    others: list[int],
    rule: WeightRule,
    origin: tuple[float, float, float],
) -> _TileSums:
    own = read_faces(store, tile)
    faces = Faces.joined([own, *halo_of(store, own, others)])
    first = store.starts[tile]
    is_own = (faces.places >= first) & (faces.places < store.starts[tile + 1])
    surface, weights, graph, turn = weighed(store, faces, rule, is_own)
    at = np.empty(len(own), np.int64)  # of each place of the tile
    at[faces.places[is_own] - first] = np.flatnonzero(is_own)
    offsets, arcs = rows(graph.offsets, at)
    weights = weights[arcs]
    write_arcs(store, tile, offsets, faces.places, faces.cells, graph.neighbors[arcs])
    store.write(tile, "arc_sides", graph.sides[arcs])
    store.write(tile, "weights", weights)
    prices = 0.0
    if rule.has_prices:
        default = prices_of(surface, rule)[arcs]
        store.write(tile, "prices", default)
        prices = _core.sum_of(default, rule.n_threads)
    mesh = own.mesh(store)
    return _TileSums(
        _core.sum_of(weights, rule.n_threads),
        prices,
        _has_boundary(own, graph.sides[arcs], offsets),
        bool(graph.same_turn[arcs].any()),
        turn,
        signed_volume(mesh, origin, rule.n_threads),
        area_of_slivers(mesh, rule.radius, rule.n_threads),
    )


def _round_lengths(
    store: TileStore, tile: int, weights: str, lengths: str, unit: float, n_threads: int
) -> None:
    """Write the lengths of the arcs of a tile under a name, from weights of another."""
    store.write(tile, lengths, _core.round_weights(store.read(tile, weights), unit, n_threads))


def write_arcs(
    store: TileStore,
    tile: int,
    offsets: npt.NDArray[np.int64],
    places: npt.NDArray[np.integer],
    cells: npt.NDArray[np.integer],
    targets: npt.NDArray[np.integer],
) -> None:
    """Write arcs of a tile to some of the cells at these places, those of the tile and others."""
    local = places - store.starts[tile]
    is_ghost = np.zeros(len(places), bool)
    is_ghost[targets] = True
    is_ghost &= (local < 0) | (local >= store.size(tile))
    ghosts = np.flatnonzero(is_ghost)
    ghosts = ghosts[np.argsort(places[ghosts])]
    local[ghosts] = store.size(tile) + np.arange(len(ghosts))
    store.write(tile, "arc_offsets", offsets)
    store.write(tile, "arc_targets", local.astype(np.int32)[targets])
    store.write(tile, "ghosts", places[ghosts].astype(np.int64))
    store.write(tile, "ghost_cells", cells[ghosts])


def _has_boundary(
    own: Faces, sides: npt.NDArray[np.integer], offsets: npt.NDArray[np.int64]
) -> bool:
    """Whether an edge of these faces, whose arcs leave by these sides, has one face alone."""
    following = np.arange(1, len(own.corners) + 1)
    following[own.offsets[1:] - 1] = own.offsets[:-1]
    is_crossed = np.zeros(len(own.corners), bool)
    is_crossed[np.repeat(own.offsets[:-1], np.diff(offsets)) + sides] = True
    open_sides = np.flatnonzero(~is_crossed)
    is_edge = own.corners[open_sides] != own.corners[following[open_sides]]
    open_sides = open_sides[is_edge]
    if not len(open_sides):
        return False
    # A face that runs through an edge twice has the arcs at the first of the two sides.
    face = np.searchsorted(own.offsets, open_sides, side="right") - 1
    all_sides = rows(own.offsets, np.unique(face))[1]
    crossed = all_sides[is_crossed[all_sides]]
    return not _edges(own, following, open_sides) <= _edges(own, following, crossed)


def _edges(
    own: Faces, following: npt.NDArray[np.int64], sides: npt.NDArray[np.int64]
) -> set[tuple[int, int, int]]:
    """The faces of some sides, and the lower and the higher vertex of each."""
    face = np.searchsorted(own.offsets, sides, side="right") - 1
    ends = np.sort(np.stack([own.corners[sides], own.corners[following[sides]]]), axis=0)
    return set(zip(face.tolist(), *ends.tolist(), strict=True))
