"""Stages 1 and 2 on tiles: compute the arcs of each tile, and their weights."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._types import Array, Floats, Ints, Longs
from ..batches.mapping import Run
from ..cells.cell_graph import box_diagonal
from ..cells.kinds import kind_of
from ..cells.size import sliver_area_for_radius
from ..cells.surface import Surface, enclosed, is_negative
from ..cells.weights import (
    NO_SUMS,
    EdgeSums,
    WeightOptions,
    arc_weights,
    convex_share_of,
    creases_and_sums,
    creases_of,
)
from ..mesh.faces import signed_volume
from .arrays import rows
from .halos import OF_FACES, faces_with_halo, find_halos, points_with_halo
from .part import Part, in_order_of_cells, surface_of
from .store import TileStore, weighted_sum

Origin = tuple[float, float, float]
"""Common apex of cones over the faces. The sum of the signed volumes of these cones is the volume
of the mesh."""


@dataclass(frozen=True)
class WeightRule:
    """Parameters for the computation of arc weights."""

    radius: float  # expected radius of a region, in the unit of the positions
    options: WeightOptions
    has_border_weights: bool  # True to compute additional weights for border costs
    n_threads: int
    unit_factor: float = 1.0  # factor that increases the unit of arc lengths, see `UNIT_FACTOR`
    is_inside_out: bool = False  # True if normals point inward; swaps concave and convex
    convex_share: float = 0.0  # result of `convex_share_of`; 0 for solid shapes
    of_machine_part: bool = False  # True to compute weights for machine parts

    @property
    def has_hollows(self) -> bool:
        """Whether arc weights depend on how hollow the mesh is (see `convex_share_of`)."""
        params = self.options.params
        return bool(params["weights"] in ("creases", "parts") and params["alpha"])


class ArcFacts(NamedTuple):
    """Results of `find_arcs` for all tiles, which later stages need."""

    unit: float  # weight of an arc whose value in ``lengths`` is 1
    border_unit: float  # weight of an arc whose value in ``border_lengths`` is 1
    sliver_area: float  # total area of faces that are long and thin compared with regions
    of_machine_part: bool  # True if the mesh looks like a machine part


@dataclass(frozen=True)
class _TileSums:
    """Sums of the weights of the arcs of a tile, and properties of its faces.

    For points, the properties of faces have their default values.
    """

    weights: float
    border_weights: float
    has_boundary: bool = True
    is_inconsistent: bool = False  # True if some neighboring faces differ in orientation
    edges: EdgeSums = NO_SUMS
    volume: float = 0.0
    sliver_area: float = 0.0


def find_arcs(store: TileStore, rule: WeightRule, run: Run) -> ArcFacts:
    """Write the arcs of all tiles with their lengths, and return the `ArcFacts` of the graph.

    Each tile gets the CSR lists ``arcs``. In a tile of n cells, a target t < n is row t of the
    cells. Any other target t is row t - n of ``ghosts``, which contains the curve indices, in
    ascending order, of neighbors in other tiles. ``ghost_cells`` contains their cell numbers. Arcs
    have ``lengths``, also ``border_lengths`` if `has_border_weights` is true, and ``sides`` if
    cells are faces.
    """
    halos = find_halos(store, run) if store.halos is None else store.halos
    weigh = _weigh_points if store.kind == "points" else _weigh_faces
    origin, tiles = _centroid(store, run), range(store.n_tiles)

    def weighed(rule: WeightRule) -> list[_TileSums]:
        return run(weigh, store, [(tile, halos[tile], rule, origin) for tile in tiles])

    sums = weighed(rule)
    adapted = rule
    if not any(some.has_boundary for some in sums):
        diagonal, volume = box_diagonal(store.bounds), sum(some.volume for some in sums)
        if is_negative(volume, diagonal):
            rule = adapted = replace(rule, is_inside_out=True)
            sums = weighed(rule)
        if rule.has_hollows and not any(some.is_inconsistent for some in sums):
            turn, inside = sum(some.edges.turn for some in sums), enclosed(volume, diagonal)
            convex_share = convex_share_of(turn, inside, store.total_measure, diagonal)
            adapted = replace(rule, convex_share=convex_share)
    if rule.options.has_parts and EdgeSums.total(some.edges for some in sums).are_of_machine_part:
        adapted = replace(adapted, of_machine_part=True)
    sums = weighed(adapted) if adapted != rule else sums
    unit = rule.unit_factor * _core.unit_of_lengths(sum(some.weights for some in sums))
    border_unit = _core.unit_of_lengths(sum(some.border_weights for some in sums))
    run.all(_round_tile, store, store.n_tiles, (unit, border_unit), rule.n_threads)
    sliver_area = sum(some.sliver_area for some in sums)
    return ArcFacts(unit, border_unit, sliver_area, adapted.of_machine_part)


def _centroid(store: TileStore, run: Run) -> Origin:
    """Return the area-weighted mean of all positions, or the first position if all areas are 0."""
    moments = run.all(weighted_sum, store, store.n_tiles, "positions")
    total = store.total_measure
    x, y, z = (np.sum(moments, axis=0) / total if total else store.read(0, "positions")[0]).tolist()
    return x, y, z


def _weigh_faces(
    store: TileStore, tile: int, others: list[int], rule: WeightRule, origin: Origin
) -> _TileSums:
    own = Part.of_tile(store, tile, OF_FACES)
    faces = faces_with_halo(store, own, others)
    mesh = faces.mesh(store)
    kind = kind_of(mesh)
    graph, shapes = kind.build_graph(mesh, False, rule.n_threads)  # the vertices are already welded
    surface = Surface.of_part_of_faces(mesh, graph, rule.is_inside_out, rule.n_threads)
    weights: ArrayLike
    edges = NO_SUMS
    if rule.has_hollows:
        weights, edges = creases_and_sums(
            surface, graph, rule.radius, rule.options, None if shapes is None else shapes.normals,
            (rule.convex_share, rule.of_machine_part),
            store.is_in(tile, faces.columns["places"]).view(np.uint8),
        )  # fmt: skip
    else:
        weights = kind.weights(surface, graph, shapes, rule.radius, rule.options).weights
    offsets, arcs = _write_arcs(store, tile, faces, surface.arcs)
    store.write(tile, "arcs/sides", graph.sides[arcs])
    sums = _write_weights(store, tile, surface, (np.asarray(weights), arcs), rule)
    of_tile = own.mesh(store)
    return replace(
        sums,
        has_boundary=_has_boundary(own, graph.sides[arcs], offsets),
        is_inconsistent=bool(graph.same_turn[arcs].any()),
        edges=edges,
        volume=signed_volume(of_tile, origin, rule.n_threads),
        sliver_area=sliver_area_for_radius(of_tile, rule.radius, rule.n_threads),
    )


def _weigh_points(
    store: TileStore, tile: int, _: list[int], rule: WeightRule, __: Origin
) -> _TileSums:
    points = in_order_of_cells(points_with_halo(store, tile))
    surface = surface_of(store, points, rule.n_threads)
    weights = np.asarray(arc_weights(surface, surface, rule.radius, rule.options).weights)
    arcs = _write_arcs(store, tile, points, surface.arcs)[1]
    return _write_weights(store, tile, surface, (weights, arcs), rule)


def _write_arcs(
    store: TileStore, tile: int, cells: Part, graph: tuple[Longs, Ints]
) -> tuple[Longs, Longs]:
    """Write the arcs of a tile in CSR form; return their offsets, and their indices in `graph`.

    `cells` must contain the cells of the tile and their neighbors. `graph` contains the arcs of
    `cells`.
    """
    places, n_own = cells.columns["places"], store.size(tile)
    local = places - np.int32(store.starts[tile])
    own = np.flatnonzero((local >= 0) & (local < n_own))
    at = np.empty(n_own, np.int64)
    at[local[own]] = own
    offsets, arcs = rows(graph[0], at)
    targets = graph[1][arcs]
    is_ghost = np.zeros(len(places), bool)
    is_ghost[targets] = True
    is_ghost[own] = False
    ghosts = np.flatnonzero(is_ghost)
    ghosts = ghosts[np.argsort(places[ghosts])]
    local[ghosts] = n_own + np.arange(len(ghosts))
    store.write(tile, "arcs/offsets", offsets)
    store.write(tile, "arcs/targets", local[targets])
    store.write(tile, "ghosts", places[ghosts].astype(np.int64))
    store.write(tile, "ghost_cells", cells.columns["cells"][ghosts])
    return offsets, arcs


def _write_weights(
    store: TileStore, tile: int, surface: Surface, weighed: tuple[Floats, Longs], rule: WeightRule
) -> _TileSums:
    """Write the weights of the arcs of a tile, and return their sums.

    Also writes the weights for border costs if `rule` requires them. `weighed` contains the weights
    of all arcs of `surface`, and the indices of the arcs of the tile.
    """
    weights, arcs = weighed
    columns = {"weights": weights[arcs]}
    if rule.has_border_weights:
        columns["border_weights"] = creases_of(surface, rule.radius, ridges=0.0)[arcs]
    Part(columns).save(store.scratch, f"tile{tile}/arcs")
    sums = [_core.sum_of(column, rule.n_threads) for column in columns.values()]
    return _TileSums(sums[0], sums[1] if rule.has_border_weights else 0.0)


def _round_tile(store: TileStore, tile: int, units: tuple[float, float], n_threads: int) -> None:
    """Quantize the weights of a tile to ``lengths``, and border weights to ``border_lengths``."""
    names = (("weights", "lengths"), ("border_weights", "border_lengths"))
    for (name, rounded), unit in zip(names, units, strict=True):
        if store.has(tile, f"arcs/{name}"):
            weights = store.read(tile, f"arcs/{name}")
            store.write(tile, f"arcs/{rounded}", _core.round_weights(weights, unit, n_threads))


def _has_boundary(own: Part, sides: Array, arc_offsets: Longs) -> bool:
    """Return whether any face has a boundary edge.

    `sides` contains the side of its face that each arc crosses, and `arc_offsets` the first arc of
    each face.
    """
    offsets, corners = own.corners()
    following = np.arange(1, len(corners) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    is_crossed = np.zeros(len(corners), bool)
    is_crossed[np.repeat(offsets[:-1], np.diff(arc_offsets)) + sides] = True
    is_open = ~is_crossed & (corners != corners[following])
    if not is_open.any():
        return False
    # If two sides of a face are the same edge, arcs cross only the first side. An edge of a face is
    # on the boundary only if arcs cross none of its sides.
    faces = np.unique(np.searchsorted(offsets, np.flatnonzero(is_open), side="right") - 1)
    starts, at = rows(offsets, faces)
    low, high = np.sort([corners[at], corners[following[at]]], axis=0)
    edges = np.stack([np.repeat(faces, np.diff(starts)), low, high])
    order = np.lexsort(edges)
    firsts = np.flatnonzero(np.diff(edges[:, order], axis=1, prepend=-1).any(axis=0))
    return bool(np.logical_and.reduceat(is_open[at[order]], firsts).any())
