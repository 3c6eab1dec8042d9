"""Stages 4a and 4b in turn: label all cells and move the centers, first on coarse cells."""

from __future__ import annotations

import hashlib
import math
import time
from dataclasses import dataclass, field

import numpy as np

from .._core import Clustering, OrderedGraph
from .._options import LoopOptions
from .._timing import timed
from .._types import Array, Ints
from .graphs import AnyGraph, CoarseCells, Levels, Regions, is_straight, regions_of
from .seeding import CORE_ISLANDS
from .segmentation import Level, StopReason

RELOCATED_SHARES = (0.13, 0.0975, 0.065, 0.0325)
"""Largest share of centers that move in each round of relocation; at least one may move."""

ITERATIONS_PER_ROUND = 8
"""Most iterations after each round of relocation."""


@dataclass
class Iteration:
    """The loop, and a record of each level that it has run on."""

    radius: float  # expected, of regions
    options: LoopOptions
    timings: dict[str, float]  # seconds of "classify" and "update" are added
    levels: list[Level] = field(default_factory=list)
    is_cancelled: bool = False  # `progress` returned False

    @property
    def stop_reason(self) -> StopReason:
        """The rule that ended the iterations on the last level."""
        return self.levels[-1].stop_reason

    def run(self, levels: Levels, graph: AnyGraph, centers: Ints) -> tuple[Ints, Ints]:
        """Run on the coarse graphs, from the last to the first, and then on all cells.

        `centers` are cells of the graph that the loop begins on. The result is labels and centers,
        for the classification by these centers: the last move is dropped, whatever ends the loop.
        """
        if self.options.on_stage is not None:
            self.options.on_stage("classify")
        coarse = levels.coarse
        while len(coarse) > levels.n_finer:
            level = coarse.pop()
            clustering = self._run_level(level.graph, centers)
            with timed(self.timings, "update"):
                labels, centers = clustering.labels(), clustering.centers()
                centers = level.refine(labels, centers, self.options.n_threads)
        if levels.on_all or not is_straight(graph):
            clustering = self._run_level(graph, centers, must_stay=not levels.on_all)
            return clustering.labels(), clustering.centers()
        assert isinstance(clustering, Clustering)
        paths = clustering.lengths(), clustering.labels()
        coarse.append(level)
        del level, clustering  # each graph is freed after its use
        return self._spread(coarse, paths, centers)

    def _spread(
        self, coarse: list[CoarseCells], paths: tuple[Array, Ints], centers: Ints
    ) -> tuple[Ints, Ints]:
        """Label all cells by paths on the last of these graphs, which are rounder than on cells.

        `centers` are cells of the graph that the last one was made of. The list is emptied.
        """
        while coarse:
            start = time.perf_counter()
            level = coarse.pop()
            with timed(self.timings, "classify"):
                paths = level.spread(*paths, centers, self.options.n_threads)
            seconds = time.perf_counter() - start
            self.levels.append(Level(len(paths[1]), 1, self.stop_reason, seconds))
            if coarse:
                with timed(self.timings, "update"):
                    centers = coarse[-1].refine(paths[1], centers, self.options.n_threads)
        return paths[1], centers

    def _run_level(self, graph: AnyGraph, centers: Ints, *, must_stay: bool = False) -> Regions:
        """Classify by these centers, and iterate until one of the stop rules holds."""
        start = time.perf_counter()
        reach = math.inf
        if self.options.radius_factor is not None:
            reach = self.options.radius_factor * self.radius
        with timed(self.timings, "classify"):
            islands, n_threads = CORE_ISLANDS[self.options.islands], self.options.n_threads
            clustering = regions_of(graph, centers, reach, n_threads, islands)
        is_first = not self.levels
        n_iter, reason = self._iterate(graph, clustering, must_stay=must_stay)
        if is_first and self.options.relocate:
            assert isinstance(clustering, Clustering)  # tiles have coarse cells first
            n_iter, reason = self._relocate(graph, clustering, n_iter, reason)
        self.levels.append(Level(graph.n_cells, n_iter, reason, time.perf_counter() - start))
        return clustering

    def _relocate(
        self, graph: AnyGraph, clustering: Clustering, n_iter: int, reason: StopReason
    ) -> tuple[int, StopReason]:
        """Move centers to where they are needed, and iterate again, until none moves.

        Takes and returns the number of iterations on this level, and the rule that ended the last.
        """
        for share in RELOCATED_SHARES:
            max_num_iter = min(self.options.max_num_iter - n_iter, ITERATIONS_PER_ROUND)
            if self.is_cancelled or max_num_iter <= 0:
                break
            centers = clustering.centers()
            with timed(self.timings, "update"):
                moved_to = clustering.relocate(max(1, round(share * len(centers))))
            if np.array_equal(moved_to, centers):
                break
            with timed(self.timings, "classify"):
                clustering.classify(moved_to)
            n_more, reason = self._iterate(
                graph, clustering, max_num_iter=max_num_iter, n_before=n_iter
            )
            n_iter += n_more
        return n_iter, reason

    def _iterate(
        self,
        graph: AnyGraph,
        clustering: Regions,
        *,
        must_stay: bool = False,
        max_num_iter: int | None = None,
        n_before: int = 0,
    ) -> tuple[int, StopReason]:
        """Return the number of iterations, and the rule that ended them.

        `n_before` iterations have run on this level before. With `must_stay`, none runs: the stop
        reason is that of the previous level.
        """
        if self.is_cancelled:
            return 1, "cancelled"
        if must_stay:
            return 1, self.stop_reason
        assert isinstance(graph, OrderedGraph)
        assert isinstance(clustering, Clustering)  # all cells of tiles are classified once
        if max_num_iter is None:
            max_num_iter = self.options.max_num_iter
        seen: set[bytes] = set()
        n_before += sum(level.n_iter for level in self.levels)
        for n_iter in range(1, max_num_iter + 1):
            centers = clustering.centers()
            with timed(self.timings, "update"):
                moved_to = clustering.update()
            seen.add(_fingerprint(centers))
            n_moved = int(np.count_nonzero(moved_to != centers))
            self._tell(n_before + n_iter, n_moved)
            move = _root_mean_square_move(graph, centers, moved_to)
            if n_moved == 0 or move <= self.options.tol * self.radius:
                return n_iter, "converged"
            if self.is_cancelled:
                return n_iter, "cancelled"
            if _fingerprint(moved_to) in seen:
                return n_iter, "settled"
            if n_iter < max_num_iter:
                with timed(self.timings, "classify"):
                    clustering.classify(moved_to)
        return max_num_iter, "max_num_iter"

    def _tell(self, n_iter: int, n_moved: int) -> None:
        answer = None if self.options.progress is None else self.options.progress(n_iter, n_moved)
        if isinstance(answer, (bool, np.bool_)) and not answer:
            self.is_cancelled = True


def _root_mean_square_move(graph: OrderedGraph, centers: Ints, moved_to: Ints) -> float:
    moves = graph.positions_of(moved_to) - graph.positions_of(centers)
    return math.sqrt(float(np.mean(np.sum(moves * moves, axis=1))))


def _fingerprint(centers: Ints) -> bytes:
    """128-bit hash of a set of centers, kept in place of the set."""
    return hashlib.blake2b(np.sort(centers).tobytes(), digest_size=16).digest()
