"""Run the clustering loop, which alternately labels all cells and moves the centers of regions."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

import numpy as np

from .. import _core
from .._core import Clustering, CoarseGraph, OrderedGraph, PathArrays
from ..base.options import LoopOptions
from ..base.timing import timed
from ..base.types import Array, Ints
from ..weights.parts import MIN_GROUPED
from .balance import Balancer
from .coarsening import Coarsening, gets_part_costs
from .result import LoopLevel, StopReason
from .seeding import CORE_ISLANDS

RELOCATED_FRACTIONS: tuple[float, ...] = (0.13, 0.0975)
"""Maximum fraction of all centers that are relocated, for each round of relocation. Relocated
centers move into regions with long paths. One center may always be relocated."""

ITERATIONS_PER_ROUND = 8
"""Maximum number of iterations of the loop after each round of relocation."""

SHORT_FRACTIONS, SHORT_ITERATIONS = (0.13,), 3
"""Values that replace RELOCATED_FRACTIONS and ITERATIONS_PER_ROUND in a short loop (see
`Coarsening.is_short`). SHORT_ITERATIONS is also the maximum number of iterations before relocation.
Further iterations would move only one center in 300."""

LAST_ITERATIONS = 5
"""Maximum number of iterations on all cells, if the loop has run on coarse cells before and there
are at least `MIN_GROUPED` cells. On 19 subdivided benchmark models with 3,000 regions, this
maximum and `SHORT_STEPS` together change the undersegmentation error from 0.0193 to 0.0194, and the
compactness from 4.309 to 4.303."""


@dataclass
class Loop:
    """Options and state of the clustering loop, which runs on coarse cells and on all cells."""

    radius: float  # expected radius of a region, in the unit of the positions
    options: LoopOptions
    timings: dict[str, float]  # wall time in seconds, keyed by the name of the stage
    levels: list[LoopLevel] = field(default_factory=list)  # one record per finished level
    balancer: Balancer | None = None  # None if sizes of regions are neither balanced nor limited
    # (n,) component of each cell of the first level; components keep their number of centers
    components: Ints | None = None
    is_short: bool = False  # whether there are only a few iterations; see `SHORT_ITERATIONS`

    @property
    def stop_reason(self) -> StopReason:
        """Reason why the loop stopped on the last finished level."""
        return self.levels[-1].stop_reason

    def run(
        self, coarsening: Coarsening, graph: OrderedGraph, centers: Ints, paths: PathArrays | None
    ) -> tuple[Ints, Ints]:
        """Run the loop on the coarse graphs, from coarsest to finest; then label all cells.

        `centers` are the seeds, as cells of the coarsest graph, and `paths` the paths from them, or
        None. Returns the label of each cell, and the centers. The list `coarsening.graphs` and
        `paths` are emptied to free memory.
        """
        self.options.report("classify")
        coarse = coarsening.graphs
        while len(coarse) > coarsening.n_without_loop:
            level = coarse.pop()
            clustering = self._run_level(level.graph, centers, paths)
            paths = None
            if len(coarse) == coarsening.n_without_loop and not coarsening.loops_on_all:
                clustering = self._balanced(level.graph, clustering, coarsening.n_without_loop + 1)
            with timed(self.timings, "update"):
                labels, centers = clustering.labels(), clustering.centers()
                centers = level.refine(labels, centers, self.options.n_threads)
        if coarsening.loops_on_all or not gets_part_costs(graph):
            must_stay = not coarsening.loops_on_all  # then all cells are only labeled once
            clustering = self._run_level(graph, centers, paths, is_last=True, must_stay=must_stay)
            clustering = self._balanced(graph, clustering, 0)  # acts only if not done above
            return clustering.labels(), clustering.centers()
        found = clustering.lengths(), clustering.labels()
        coarse.append(level)  # the last level; `loops_on_all` is False only if there is one
        del level, clustering  # these references would keep the graph in memory in `_spread`
        return self._spread(coarse, found, centers)

    def _balanced(self, graph: OrderedGraph, clustering: Clustering, level: int) -> Clustering:
        """Return the clustering on `level` after balancing sizes, if requested and not yet done."""
        if self.balancer is None:
            return clustering
        with timed(self.timings, "balance"):
            return self.balancer.run(graph, clustering, level)

    def _spread(
        self, coarse: list[CoarseGraph], paths: tuple[Array, Ints], centers: Ints
    ) -> tuple[Ints, Ints]:
        """Label all cells by extending the paths on coarse cells to finer and finer cells.

        This gives rounder regions than paths on all cells. `paths` are length and label of each
        cell of the last graph in `coarse`, which is emptied; `centers` are cells of the next finer
        graph.
        """
        while coarse:
            start = time.perf_counter()
            level = coarse.pop()
            with timed(self.timings, "classify"):
                n_threads = self.options.n_threads
                paths = level.spread(*paths, centers, n_threads, needs_lengths=len(coarse) > 0)
            seconds = time.perf_counter() - start
            self.levels.append(LoopLevel(len(paths[1]), 1, self.stop_reason, seconds))
            if coarse:
                with timed(self.timings, "update"):
                    centers = coarse[-1].refine(paths[1], centers, self.options.n_threads)
        return paths[1], centers

    def _run_level(
        self, graph: OrderedGraph, centers: Ints, paths: PathArrays | None,
        *, is_last: bool = False, must_stay: bool = False,
    ) -> Clustering:  # fmt: skip
        """Run the loop on one level, starting from `centers`, and from `paths` if not None.

        If `must_stay`, label the cells once.
        """
        start = time.perf_counter()
        reach = math.inf
        if self.options.radius_factor is not None:
            reach = self.options.radius_factor * self.radius
        with timed(self.timings, "classify"):
            islands, n_threads = CORE_ISLANDS[self.options.islands], self.options.n_threads
            clustering = _core.Clustering(graph, centers, reach, n_threads, islands, paths)
        # only on the first, coarsest level
        relocates = self.options.relocates and not self.levels
        most = self.options.max_num_iter
        if self.is_short:
            most = min(most, SHORT_ITERATIONS)
        elif self.levels and is_last and graph.n_cells >= MIN_GROUPED:
            most = min(most, LAST_ITERATIONS)
        elif relocates:
            most -= most // 3  # leaves a third of the iterations for relocation
        n_iter, reason = self._iterate(graph, clustering, most, must_stay=must_stay)
        if relocates:
            n_iter, reason = self._relocate(graph, clustering, n_iter, reason)
        if reason == "max_num_iter" and n_iter < self.options.max_num_iter:
            reason = "enough"
        self.levels.append(LoopLevel(graph.n_cells, n_iter, reason, time.perf_counter() - start))
        return clustering

    def _relocate(
        self, graph: OrderedGraph, clustering: Clustering, n_iter: int, reason: StopReason
    ) -> tuple[int, StopReason]:
        """Move some centers to the farthest cells of regions with long paths, and iterate again.

        `n_iter` is the number of earlier iterations on this level. Returns the number of all
        iterations on this level, and the stop reason.
        """
        fractions, most = RELOCATED_FRACTIONS, ITERATIONS_PER_ROUND
        if self.is_short:
            fractions, most = SHORT_FRACTIONS, SHORT_ITERATIONS
        for fraction in fractions:
            max_num_iter = min(self.options.max_num_iter - n_iter, most)
            if self.options.report.is_cancelled or max_num_iter <= 0:
                break
            centers = clustering.centers()
            with timed(self.timings, "update"):
                n_moves = max(1, round(fraction * len(centers)))
                moved_to = clustering.relocate(n_moves, self.options.n_threads)
            if self.components is not None:
                is_inside = self.components[moved_to] == self.components[centers]
                moved_to = np.where(is_inside, moved_to, centers)
            if np.array_equal(moved_to, centers):
                break
            with timed(self.timings, "classify"):
                clustering.classify(moved_to)
            n_more, reason = self._iterate(graph, clustering, max_num_iter, n_before=n_iter)
            n_iter += n_more
        return n_iter, reason

    def _iterate(
        self, graph: OrderedGraph, clustering: Clustering, max_num_iter: int, *,
        must_stay: bool = False, n_before: int = 0,
    ) -> tuple[int, StopReason]:  # fmt: skip
        """Alternately move centers and label cells; return number of iterations and stop reason.

        If `must_stay`, centers do not move, and the stop reason is that of the previous level.
        """
        if self.options.report.is_cancelled:
            return 1, "cancelled"
        if must_stay:
            return 1, self.stop_reason
        seen: set[int] = set()  # hashes of sets of centers
        n_before += sum(level.n_iter for level in self.levels)
        for n_iter in range(1, max_num_iter + 1):
            centers = clustering.centers()
            with timed(self.timings, "update"):
                moved_to = clustering.update()
            seen.add(hash(np.sort(centers).tobytes()))
            n_moved = int(np.count_nonzero(moved_to != centers))
            self.options.report("classify", n_before + n_iter, n_moved)
            moves = graph.positions_of(moved_to) - graph.positions_of(centers)
            root_mean_square = math.sqrt(float(np.mean(np.sum(moves * moves, axis=1))))
            if n_moved == 0 or root_mean_square <= self.options.tol * self.radius:
                return n_iter, "converged"
            if self.options.report.is_cancelled:
                return n_iter, "cancelled"
            if hash(np.sort(moved_to).tobytes()) in seen:
                return n_iter, "settled"
            if n_iter < max_num_iter:
                with timed(self.timings, "classify"):
                    clustering.classify(moved_to)
        return max_num_iter, "max_num_iter"
