"""Balance the numbers of regions of components, and the sizes of regions.

After the loop, centers of regions that are too small move into regions that are too large. Later,
`cleanup.region_sizes` moves single cells until regions have their target sizes.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field, replace

import numpy as np

from .. import _core
from .._core import Clustering, CoarseGraph, OrderedGraph
from ..base.checks import counted, exact_array
from ..base.errors import MeshError
from ..base.options import CountOptions, LoopOptions, Sizes
from ..base.types import Array, Bools, Floats, Ints, Longs
from ..cleanup.region_sizes import Goals
from ..graph.cell_graph import BaseGraph
from ..graph.constraints import KeptCells, in_order
from ..graph.sums import sums_by_label
from .plan import Plan
from .seeding import CORE_ISLANDS

JUMP_ROUNDS = 8
"""Maximum number of rounds in which centers move from regions that are too small into regions that
are too large."""

ITERATIONS_PER_JUMP = 4
"""Number of iterations of the clustering loop after each of the JUMP_ROUNDS."""

MAX_JUMPING = 0.15
"""Maximum fraction of the centers of a component that move in one of the JUMP_ROUNDS. One center
per component may always move."""

SMALL, LARGE = 0.7, 1.3
"""In the JUMP_ROUNDS, centers move from regions smaller than SMALL times the mean size into regions
larger than LARGE times the mean size. If `Sizes.strength` is below 1, SMALL is multiplied
by it, and LARGE is divided by it."""

ISLAND = 0.5
"""A component that has one region after the loop, and is smaller than this fraction of the mean
size of a region, keeps exactly one region."""

MAX_TOTAL = 1e150
"""Maximum sum of the sizes of all cells. The minimum is 1 / MAX_TOTAL. Between these limits, ratios
of sizes are finite."""

MIN_SIZE = 1e-300
"""Minimum divisor of sizes, which avoids a division by 0 if all cells of a region have size 0."""


@dataclass(frozen=True, eq=False)
class SizeRules:
    """Rules for the sizes of regions. The size of a region is the sum of the sizes of its cells."""

    options: Sizes
    sizes: Floats  # (n,) size of each cell inside the mask
    components: Ints  # (n,) connected component of each cell inside the mask

    @classmethod
    def of(
        cls, options: Sizes, graph: BaseGraph, inside: KeptCells | None,
        order: Ints | None, measures: Floats,
    ) -> SizeRules | None:  # fmt: skip
        """Return the rules for the cells inside the mask, or None if `options` restrict no sizes.

        `order` is `Prepared.input_index`, and `measures` are the measures before smoothing. Raises
        a MeshError if the sum of all sizes is 0, or out of the range of `MAX_TOTAL`.
        """
        if not options.is_used:
            return None
        sizes = measures
        if options.cells is not None:
            sizes = np.ones(graph.n_cells)
        elif options.weights is not None:
            sizes = in_order(options.checked_weights(graph.n_cells), order)
        sizes = sizes if inside is None else sizes[inside.cells]
        arcs: BaseGraph | KeptCells = graph if inside is None else inside
        one_label = np.zeros(len(sizes), np.int32)
        components, _ = _core.find_components(arcs.offsets, arcs.neighbors, one_label)
        with np.errstate(over="ignore"):
            total = float(sizes.sum())
        if not total > 0:
            raise MeshError("at least one cell must have a size above 0, but all sizes are 0")
        if not 1 / MAX_TOTAL < total < MAX_TOTAL:
            raise MeshError(
                f"the sum of Sizes.weights must be {1 / MAX_TOTAL:g} to {MAX_TOTAL:g}, got"
                f" {total:g}: rescale them"
            )
        return cls(options, exact_array(sizes, np.float64), components)

    def with_count(self, size: CountOptions) -> CountOptions:
        """Return `size`, with `n_segments` computed from `Sizes.cells` if that is given."""
        per_region = self.options.cells
        if per_region is None:
            return size
        n_segments = int((-(-np.bincount(self.components) // per_region)).sum())
        return replace(size, n_segments=n_segments)

    def check(self, n_segments: int) -> None:
        """Raise a MeshError if `n_segments` regions cannot have sizes within the limits."""
        (low, high), given = self.options.limits, self.options.shown_bounds
        total, largest = float(self.sizes.sum()), float(self.sizes.max())
        if largest > high:
            raise MeshError(
                f"{given} must allow at least {largest:g}, the size of the largest"
                " cell: raise the highest size"
            )
        slack = 1e-9 * total
        if n_segments * high < total - slack:
            raise MeshError(
                f"{given} allows {counted(n_segments, 'region')} to cover only"
                f" {n_segments * high:g} of {total:g}: use at least {math.ceil(total / high)}"
                " regions"
            )
        if low > total + slack:
            raise MeshError(
                f"{given} must allow at most {total:g}, the total size of all cells:"
                " lower the lowest size"
            )
        if n_segments * low > total + slack:
            raise MeshError(
                f"{given} needs {n_segments * low:g} for {n_segments} regions, but"
                f" the total size of all cells is {total:g}: use at most"
                f" {counted(math.floor(total / low), 'region')}"
            )

    def counts(self, found: Longs) -> Longs:
        """Return the target number of regions in each component; `found` are the present numbers.

        Raises a MeshError if the maximum size requires more regions than there are.
        """
        totals = sums_by_label(self.components, self.sizes, len(found))
        if self.options.cells is not None:
            return np.asarray(np.ceil(totals / self.options.cells), np.int64)
        low, high = self.options.limits
        mean = totals[found > 0].sum() / found.sum()
        is_shared = (found > 1) | ((found == 1) & (totals >= ISLAND * mean))
        n_cells = np.bincount(self.components, minlength=len(found))
        counts = found.copy()
        shared = np.flatnonzero(is_shared)
        most = np.minimum(n_cells, np.floor(totals / low * (1 + 1e-9)) if low > 0 else n_cells)
        least = np.maximum(1, np.ceil(totals / high * (1 - 1e-9)))
        n, n_least = int(found[shared].sum()), int(np.minimum(least, most)[shared].sum())
        if n_least > n:
            n_regions = int(found.sum())
            raise MeshError(
                f"{self.options.shown_bounds} needs at least {n_regions + n_least - n} regions,"
                " because no region can extend over two components, got"
                f" {counted(n_regions, 'region')}"
            )
        counts[shared] = _divided(n, totals[shared], least[shared], most[shared])
        return counts

    def goals(self, found: Floats, components: Ints) -> Floats:
        """Return the target size of each region, (K,), from its current size and its component."""
        counts = np.bincount(components)
        totals = sums_by_label(components, found, len(counts))
        if self.options.cells is not None:
            return _exact_goals(found, components, self.options.cells)
        means = (totals / np.maximum(counts, 1))[components]
        low, high = self.options.limits
        goals = found + self.options.balance * (means - found)
        if low > 0 or high < math.inf:
            goals = _within(goals, means, components, (low, high))
        return goals


def _divided(n: int, totals: Floats, least: Floats, most: Floats) -> Longs:
    """Divide n regions among components by the Sainte-Lague method, from `least` to `most`."""
    counts = np.minimum(least, np.maximum(most, 1)).astype(np.int64)
    rest = n - int(counts.sum())
    queue = [(-totals[i] / (counts[i] + 0.5), i) for i in range(len(counts)) if counts[i] < most[i]]
    heapq.heapify(queue)
    while rest > 0 and queue:
        _, i = heapq.heappop(queue)
        counts[i] += 1
        rest -= 1
        if counts[i] < most[i]:
            heapq.heappush(queue, (-totals[i] / (counts[i] + 0.5), i))
    return counts


def _exact_goals(found: Floats, components: Ints, per_region: int) -> Floats:
    """Return the target cell count of each region; the smallest in a component gets the rest."""
    goals = np.full(len(found), float(per_region))
    order = np.lexsort((found, components))
    is_first = np.ones(len(order), bool)
    is_first[1:] = components[order[1:]] != components[order[:-1]]
    smallest = order[is_first]
    counts = np.bincount(components)
    totals = sums_by_label(components, found, len(counts))
    which = components[smallest]
    goals[smallest] = totals[which] - per_region * (counts[which] - 1)
    return goals


def _within(goals: Floats, means: Floats, components: Ints, bounds: tuple[float, float]) -> Floats:
    """Move the target sizes in each component toward their mean until all are within `bounds`."""
    low, high = bounds
    spread = goals - means
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(spread > 0, (high - means) / spread, (low - means) / spread)
    room = np.where(spread == 0, 1.0, np.clip(room, 0.0, 1.0))
    factors = np.ones(int(components.max()) + 1)
    np.minimum.at(factors, components, room)
    return np.asarray(means + factors[components] * spread)


@dataclass(eq=False)
class Balancer:
    """Balances sizes of regions on one level. Level 0 has all cells, level 1 the finest groups."""

    rules: SizeRules
    sizes: list[Floats]  # one array per level: size of each cell
    components: list[Ints]  # one array per level: connected component of each cell
    n_threads: int
    islands: _core.Islands
    # Whether centers may be added, removed, or moved into other regions. False if the caller gave
    # the initial centers.
    may_move_centers: bool
    # Target size of each region, (K,); empty before the first call of `run`.
    targets: Floats = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(
        cls, rules: SizeRules, coarse: list[CoarseGraph], plan: Plan, loop: LoopOptions
    ) -> Balancer:
        """Make a balancer for all cells, and for coarse cells from the finest to the coarsest."""
        n_threads, islands = loop.n_threads, CORE_ISLANDS[loop.islands]
        may_move_centers = not plan.has_seeds
        sizes, components = [rules.sizes], [rules.components]
        for level in coarse:
            cells = level.coarse_cells(n_threads)
            sizes.append(sums_by_label(cells, sizes[-1], level.graph.n_cells))
            components.append(components[-1][level.centers()])
        return cls(rules, sizes, components, n_threads, islands, may_move_centers)

    def run(self, graph: OrderedGraph, clustering: Clustering, level: int) -> Clustering:
        """Return a clustering on `level` with balanced regions; only the first call changes it."""
        if len(self.targets):
            return clustering
        cells = (self.sizes[level], self.components[level])
        if self.may_move_centers:
            has = np.bincount(cells[1][clustering.centers()], minlength=cells[1].max() + 1)
            limits = (self.n_threads, self.islands)
            clustering = with_counts(graph, clustering, cells, self.rules.counts(has), limits)
            self._even_out(clustering, cells)
        found = _Regions.of(clustering, *cells)
        self.targets = self.rules.goals(found.sizes, found.components)
        return clustering

    def region_goals(self, labels: Ints, n_regions: int) -> Goals:
        """Return target sizes for the clean-up; regions without a target keep their size."""
        rules = self.rules
        found = sums_by_label(labels, rules.sizes, n_regions)
        goals = np.concatenate([self.targets, found[len(self.targets) :]])
        return Goals(rules.sizes, goals, rules.options.limits, rules.options.cells is not None)

    def _even_out(self, clustering: Clustering, cells: tuple[Floats, Ints]) -> None:
        """Move centers of small regions into large regions of the same connected component."""
        strength = self.rules.options.strength
        for _ in range(JUMP_ROUNDS if strength > 0 else 0):
            found = _Regions.of(clustering, *cells)
            ratios = found.sizes / found.means
            are_small, are_large = ratios < SMALL * strength, ratios > LARGE / strength
            pairs = found.matched(are_small, are_large)
            if not len(pairs):
                break
            centers = found.centers.copy()
            destinations = found.farthest(clustering.lengths())[pairs[:, 1]]
            is_free = ~np.isin(destinations, centers)
            centers[pairs[is_free, 0]] = destinations[is_free]
            clustering.classify(centers)
            for _ in range(ITERATIONS_PER_JUMP):
                clustering.classify(clustering.update())


def shared_seeds(
    graph: OrderedGraph, seeds: Ints, components: Ints, n_seeds: int, loop: LoopOptions
) -> Ints:
    """Add and remove seeds until each component has a share in proportion to its size.

    Each component gets at least one seed or, if ``loop.islands`` is "nearest", each component that
    already has a seed. The result has `n_seeds` seeds, unless there are more components.
    """
    sizes, n_cells = graph.measures(), np.bincount(components)
    _, firsts = np.unique(components, return_index=True)
    are_bare = np.bincount(components[seeds], minlength=len(firsts)) == 0
    targets = np.zeros(len(firsts), np.int64)
    are_seeded = ~are_bare | (loop.islands == "keep")
    totals = sums_by_label(components, sizes, len(firsts))[are_seeded]
    targets[are_seeded] = _divided(n_seeds, totals, np.ones(len(totals)), n_cells[are_seeded])
    centers = np.concatenate([seeds, firsts[are_bare & are_seeded]]).astype(np.int32)
    limits = (loop.n_threads, CORE_ISLANDS["nearest"])
    clustering = Clustering(graph, centers, math.inf, *limits)
    return with_counts(graph, clustering, (sizes, components), targets, limits).centers()


def with_counts(
    graph: OrderedGraph, clustering: Clustering, cells: tuple[Floats, Ints], targets: Longs,
    limits: tuple[int, _core.Islands],
) -> Clustering:  # fmt: skip
    """Add and remove centers until each component has its target number of regions.

    `cells` are the sizes and the components of all cells.
    """
    while True:
        found = _Regions.of(clustering, *cells)
        change = targets - np.bincount(found.components, minlength=len(targets))
        stays = found.ranks(found.sizes) >= np.maximum(-change, 0)[found.components]
        more = found.farthest(clustering.lengths())
        is_divisible = ~np.isin(more, found.centers)  # False for regions of one cell
        largest_first = found.ranks(np.where(is_divisible, -found.sizes, math.inf))
        gets = is_divisible & (largest_first < np.maximum(change, 0)[found.components])
        if stays.all() and not gets.any():
            return clustering
        # A component may need several rounds: a round adds at most one center to each region.
        centers = np.concatenate([found.centers[stays], more[gets]])
        clustering = Clustering(graph, centers, math.inf, *limits)


@dataclass(frozen=True, eq=False)
class _Regions:
    """Regions of a clustering, with their sizes and connected components."""

    labels: Ints  # (n,) region of each cell, or -1 if the cell has no region
    centers: Ints  # (K,) center of each region
    sizes: Floats  # (K,) size of each region
    components: Ints  # (K,) connected component that contains the center of each region

    @classmethod
    def of(cls, clustering: Clustering, sizes: Floats, components: Ints) -> _Regions:
        labels, centers = clustering.labels(), clustering.centers()
        if labels.min() >= 0:
            found = sums_by_label(labels, sizes, len(centers))
        else:  # cells in components without a seed have the label -1
            has_label = labels >= 0
            found = sums_by_label(labels[has_label], sizes[has_label], len(centers))
        return cls(labels, centers, found, components[centers])

    @property
    def means(self) -> Floats:
        """Mean size of the regions in the component of each region, (K,)."""
        counts = np.bincount(self.components)
        totals = sums_by_label(self.components, self.sizes, len(counts))
        means = np.asarray((totals / np.maximum(counts, 1))[self.components])
        return np.maximum(means, MIN_SIZE)

    def ranks(self, keys: Floats) -> Ints:
        """Return the rank of each region among the regions of its component, sorted by `keys`."""
        order = np.lexsort((keys, self.components))
        groups = self.components[order]
        ranks = np.empty(len(order), np.int32)
        ranks[order] = np.arange(len(order)) - np.searchsorted(groups, groups)
        return ranks

    def farthest(self, lengths: Array) -> Ints:
        """Return, for each region, the cell with the longest path in `lengths`, or the center."""
        order = np.lexsort((lengths, self.labels))
        ends = np.searchsorted(self.labels[order], np.arange(len(self.centers)), side="right")
        cells = order[np.maximum(ends - 1, 0)].astype(np.int32)
        return np.where(self.labels[cells] == np.arange(len(self.centers)), cells, self.centers)

    def matched(self, are_small: Bools, are_large: Bools) -> Longs:
        """Return pairs (P, 2) of a small and a large region in one component; extremes first."""
        limits = np.maximum(1, (MAX_JUMPING * np.bincount(self.components)).astype(np.int64))
        small, large = np.flatnonzero(are_small), np.flatnonzero(are_large)
        small = small[np.lexsort((self.sizes[small], self.components[small]))]
        large = large[np.lexsort((-self.sizes[large], self.components[large]))]
        keys = []
        for chosen in (small, large):
            groups = self.components[chosen].astype(np.int64)
            ranks = np.arange(len(groups)) - np.searchsorted(groups, groups)
            ranks[ranks >= limits[groups]] = len(self.centers)  # marks regions that get no pair
            keys.append(groups * (len(self.centers) + 1) + ranks)
            keys[-1][ranks == len(self.centers)] = -len(keys)
        _, first, second = np.intersect1d(keys[0], keys[1], return_indices=True)
        return np.stack([small[first], large[second]], axis=1)
