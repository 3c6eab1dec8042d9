"""Stage 5: regions in one piece, and none too small."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from .._validate import (
    checked_choice,
    checked_labels,
    checked_number,
    checked_seeds,
    checked_threads,
)
from ..adapters.convert import as_mesh
from ..cells.cell_graph import checked_weights
from ..cells.face_graph import FaceGraph, build_face_graph
from ..cells.weights import crease_weights
from ..mesh.triangle_mesh import Mesh

__all__ = [
    "CREASE_SCALE",
    "ISLANDS",
    "LabeledSurface",
    "RegionEdit",
    "connect_surface",
    "enforce_connectivity",
    "merge_small_regions",
    "merge_surface",
]

CREASE_SCALE = 6.0
"""What crossing an edge must cost beyond distance, in r, for a border in it to count 1/e.

From 4 to 8 the undersegmentation error of smoothed benchmark models changes by 0.0002.
"""

ISLANDS = ("keep", "nearest")
"""What may be done with small regions that touch no other."""

Ints = npt.NDArray[np.int32]
Borders = list[dict[int, float]]
"""Of each region: what its border with each neighbor counts."""


@dataclass(frozen=True, eq=False)
class LabeledSurface:
    """A mesh in regions, with all that kernels of stage 5 need of it, checked."""

    mesh: Mesh
    graph: FaceGraph
    weights: npt.NDArray[np.float64]  # of the arcs, in units of d
    labels: Ints
    n_regions: int
    radius: float  # r, in the unit of the vertices; d where the faces have no area
    n_threads: int

    @classmethod
    def checked(
        cls,
        mesh: object,
        labels: npt.ArrayLike,
        weights: npt.ArrayLike | None,
        weld: bool,
        n_threads: int | None,
    ) -> LabeledSurface:
        """Check a mesh, its labels and its weights; make weights where None are given."""
        threads = checked_threads(n_threads)
        surface = as_mesh(mesh)
        array, n_regions = checked_labels(labels, surface.n_faces)
        graph = build_face_graph(surface, weld=weld, n_threads=threads)
        area = float(graph.measures.sum())
        radius = math.sqrt(area / (math.pi * n_regions)) or graph.diagonal
        if weights is None:
            weights = crease_weights(surface, graph, radius, n_threads=threads)
        lengths = checked_weights(weights, graph.n_arcs, threads)
        return cls(surface, graph, lengths, array, n_regions, radius, threads)

    @property
    def arcs(self) -> tuple[npt.NDArray[Any], ...]:
        """The arrays that kernels take arcs, their geometry and their weights by, in order."""
        graph = self.graph
        return (
            self.mesh.vertices, self.mesh.faces, graph.positions, graph.measures, graph.offsets,
            graph.neighbors, graph.sides, graph.same_turn, self.weights,
        )  # fmt: skip

    def relabeled(self, labels: Ints) -> LabeledSurface:
        """Return the surface with other labels, 0..K-1, each at least once."""
        return replace(self, labels=labels, n_regions=int(labels.max()) + 1)

    def areas(self, regions: Ints, n_regions: int) -> list[float]:
        """Area of each region."""
        areas: list[float] = np.bincount(regions, self.graph.measures, n_regions).tolist()
        return areas

    def borders(self, regions: Ints, n_regions: int) -> Borders:
        """Who touches whom, and for how long: a border in a crease counts less."""
        low, high, costs = _core.region_borders(
            *self.arcs,
            regions,
            self.graph.diagonal,
            CREASE_SCALE * self.radius,
            self.n_threads,
        )
        borders: Borders = [{} for _ in range(n_regions)]
        for a, b, cost in zip(low.tolist(), high.tolist(), costs.tolist(), strict=True):
            borders[a][b] = borders[b][a] = cost
        return borders


class RegionEdit(NamedTuple):
    """Labels after regions were joined, and what became of them.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        0..K'-1, each at least once.
    sources : ndarray of int32, shape (K',)
        The region, before, that each region is or was a piece of.
    n_joined : int
        How many pieces or regions joined another one.
    n_islands : int
        How many of those that had to join one touch none, and stayed.
    """

    labels: Ints
    sources: Ints
    n_joined: int
    n_islands: int


def enforce_connectivity(
    mesh: object,
    labels: npt.ArrayLike,
    *,
    centers: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None,
    weld: bool = True,
    n_threads: int | None = None,
) -> RegionEdit:
    """Return labels whose regions are in one piece each.

    A region keeps the piece that its center is in, or its largest. Each other piece, the smallest
    first, joins the neighbor that it shares most border with, where a border in a crease counts
    less, as in `smooth_borders`. A piece that touches nothing becomes a region of its own.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    labels : array_like of int, shape (N,)
        0..K-1, each at least once.
    centers : array_like of int, shape (K,), optional
        A face of each region.
    weights : array_like, shape (M,), optional
        As for `smooth_borders`.
    weld, n_threads
        As for `segment`.

    Returns
    -------
    RegionEdit
        Regions keep their labels; those of islands follow, in the order of their lowest faces.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If the labels are not integers, not one per face, negative or with gaps, a center is not in
        its region, or another parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(N + M), and O(P log P) for P pieces, some 40 microseconds for each: labels that are
    scattered at random take longer than what a segmentation leaves.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> vertices = [[x // 2, x % 2, 0] for x in range(8)]
    >>> strip = Mesh(vertices, [[f, f + 1, f + 2] for f in range(6)])
    >>> enforce_connectivity(strip, [0, 0, 0, 1, 1, 0]).labels
    array([0, 0, 0, 1, 1, 1], dtype=int32)
    """
    surface = LabeledSurface.checked(mesh, labels, weights, weld, n_threads)
    return connect_surface(surface, centers)


def connect_surface(surface: LabeledSurface, centers: npt.ArrayLike | None) -> RegionEdit:
    """Join the pieces of regions to neighbors; see `enforce_connectivity`."""
    graph = surface.graph
    pieces, n_pieces = _core.find_components(graph.offsets, graph.neighbors, surface.labels)
    region_of_piece = np.empty(n_pieces, np.int32)
    region_of_piece[pieces] = surface.labels
    areas = surface.areas(pieces, n_pieces)
    kept = _kept_pieces(surface, region_of_piece, pieces, areas, centers)
    stays = np.zeros(n_pieces, bool)
    stays[kept] = True
    borders = surface.borders(pieces, n_pieces)
    roots = _join_neighbors(areas, borders, lambda piece: not stays[piece])
    islands = np.setdiff1d(roots, kept)
    label_of_piece = np.empty(n_pieces, np.int32)
    label_of_piece[kept] = np.arange(surface.n_regions)
    label_of_piece[islands] = surface.n_regions + np.arange(len(islands))
    return RegionEdit(
        label_of_piece[roots][pieces],
        np.concatenate([np.arange(surface.n_regions, dtype=np.int32), region_of_piece[islands]]),
        n_pieces - surface.n_regions - len(islands),
        len(islands),
    )


def _kept_pieces(
    surface: LabeledSurface,
    region_of_piece: Ints,
    pieces: Ints,
    areas: list[float],
    centers: npt.ArrayLike | None,
) -> npt.NDArray[np.int64]:
    """The piece that each region keeps: that of its center, or the largest, first of equals."""
    if centers is None:
        order = np.lexsort((-np.arange(len(areas)), np.array(areas)))
        kept = np.empty(surface.n_regions, np.int64)
        kept[region_of_piece[order]] = order  # the last one written is the largest
        return kept
    faces = checked_seeds(centers, len(surface.labels))
    if len(faces) != surface.n_regions:
        raise ValueError(f"there are {len(faces)} centers for {surface.n_regions} regions")
    is_wrong = surface.labels[faces] != np.arange(surface.n_regions)
    if is_wrong.any():
        region = int(np.argmax(is_wrong))
        raise ValueError(
            f"centers[{region}] is face {faces[region]}, which has label"
            f" {surface.labels[faces[region]]}"
        )
    return pieces[faces].astype(np.int64)


def merge_small_regions(
    mesh: object,
    labels: npt.ArrayLike,
    min_size: float,
    *,
    islands: str = "keep",
    weights: npt.ArrayLike | None = None,
    weld: bool = True,
    n_threads: int | None = None,
) -> RegionEdit:
    """Return labels without small regions.

    The smallest region, as long as it is too small, joins the neighbor that it shares most border
    with, where a border in a crease counts less, as in `smooth_borders`. The mean area is that of
    the regions given.

    Parameters
    ----------
    mesh : Mesh or mesh-like
        As for `segment`.
    labels : array_like of int, shape (N,)
        0..K-1, each at least once.
    min_size : float
        The least area of a region, >= 0, as a fraction of the mean area of regions.
    islands : {"keep", "nearest"}
        Small regions that touch no other stay, or join the region that has the face nearest
        (Euclidean) to their center, and then are not in one piece with it. Where there are only
        small islands, they stay.
    weights : array_like, shape (M,), optional
        As for `smooth_borders`.
    weld, n_threads
        As for `segment`.

    Returns
    -------
    RegionEdit
        Regions are in the order of their labels before. ``sources`` holds the label, before, of
        the one that others joined: with the centers of a segmentation,
        ``centers[edit.sources]`` are faces of their regions.

    Raises
    ------
    MeshError
        If the mesh is not a valid triangle mesh.
    ValueError, TypeError
        If the labels are not integers, not one per face, negative or with gaps, or another
        parameter is out of range or of the wrong type.

    Notes
    -----
    Time O(N + M), and O(K log K) for K regions.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> vertices = [[x // 2, x % 2, 0] for x in range(8)]
    >>> strip = Mesh(vertices, [[f, f + 1, f + 2] for f in range(6)])
    >>> edit = merge_small_regions(strip, [0, 0, 0, 1, 1, 2], 0.6)
    >>> edit.labels, edit.sources, edit.n_joined
    (array([0, 0, 0, 1, 1, 1], dtype=int32), array([0, 1], dtype=int32), 1)
    """
    min_size = checked_number(min_size, "min_size", zero=True)
    checked_choice(islands, "islands", ISLANDS)
    surface = LabeledSurface.checked(mesh, labels, weights, weld, n_threads)
    return merge_surface(surface, min_size, islands)


def merge_surface(surface: LabeledSurface, min_size: float, islands: str) -> RegionEdit:
    """Join small regions to neighbors; see `merge_small_regions`."""
    areas = surface.areas(surface.labels, surface.n_regions)
    least = min_size * sum(areas) / surface.n_regions
    borders = surface.borders(surface.labels, surface.n_regions)
    roots = _join_neighbors(areas, borders, lambda region: areas[region] < least)
    small = np.array([root for root in np.unique(roots) if areas[root] < least], np.int32)
    if islands == "nearest" and len(small):
        roots = _join_nearest(surface, roots, small)
    sources, compact = np.unique(roots, return_inverse=True)
    return RegionEdit(
        compact.astype(np.int32)[surface.labels],
        sources.astype(np.int32),
        surface.n_regions - len(sources),
        int(np.isin(small, sources).sum()),
    )


def _join_neighbors(
    areas: list[float], borders: Borders, must_join: Callable[[int], bool]
) -> npt.NDArray[np.int64]:
    """Join regions to neighbors, smallest first, and return the one that each ends in.

    `areas` and `borders` are kept up to date. A region without a neighbor stays.
    """
    joined_to = np.arange(len(areas))
    queue = [(area, region) for region, area in enumerate(areas) if must_join(region)]
    heapq.heapify(queue)
    while queue:
        area, region = heapq.heappop(queue)
        is_outdated = joined_to[region] != region or area != areas[region]
        if is_outdated or not must_join(region) or not borders[region]:
            continue
        shared = borders[region]
        target = max(shared, key=lambda neighbor: (shared[neighbor], -neighbor))
        joined_to[region] = target
        _hand_over_borders(borders, region, target)
        areas[target] += area
        heapq.heappush(queue, (areas[target], target))
    while not np.array_equal(joined_to, joined_to[joined_to]):
        joined_to = joined_to[joined_to]
    return joined_to


def _hand_over_borders(borders: Borders, region: int, target: int) -> None:
    for neighbor, cost in borders[region].items():
        del borders[neighbor][region]
        if neighbor != target:
            total = borders[target].get(neighbor, 0.0) + cost
            borders[target][neighbor] = borders[neighbor][target] = total
    borders[region] = {}


def _join_nearest(
    surface: LabeledSurface, roots: npt.NDArray[np.int64], islands: Ints
) -> npt.NDArray[np.int64]:
    """Join islands to the region with the face nearest to their centers; return all roots."""
    region_of_face = roots[surface.labels]
    is_wanted = ~np.isin(region_of_face, islands)
    if not is_wanted.any():
        return roots
    graph = surface.graph
    lengths = np.ones(graph.n_arcs, np.float32)  # no path is looked for
    cells = _core.OrderedGraph(
        graph.positions, graph.measures, graph.offsets, graph.neighbors, lengths, surface.n_threads
    )
    regions, compact = np.unique(region_of_face, return_inverse=True)
    centers = _core.update_centers(cells, compact.astype(np.int32), len(regions), surface.n_threads)
    island_centers = centers[np.searchsorted(regions, islands)]
    nearest = _core.nearest_wanted(cells, island_centers, is_wanted.astype(np.uint8))
    joined_to = np.arange(surface.n_regions)
    joined_to[islands] = region_of_face[nearest]
    return joined_to[roots]
