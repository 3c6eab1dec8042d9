"""Labels that clients have been shown, by number, so that they can speak of their regions."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..cells.region_adjacency import RegionGraph, region_graph_of
from ..cells.surface import Surface
from ..io.guards import shortened
from .changes import Partition

MAX_KEPT = 6

Ints = npt.NDArray[np.int32]


class GoneError(LookupError):
    """The labels that a client speaks of are not kept any more: it must ask for new ones."""


@dataclass
class Revision:
    """The labels of a partition.

    Attributes
    ----------
    number : int
        No other labels have it, also of earlier runs of the server.
    partition : Partition
    labels : ndarray of int32, shape (N,)
        0..K-1.
    n_regions : int
    """

    number: int
    partition: Partition
    labels: Ints
    n_regions: int

    @cached_property
    def _by_region(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint32]]:
        """Offsets of regions, and the cells of each, ascending."""
        counts = np.bincount(self.labels, minlength=self.n_regions)
        offsets = np.concatenate([[0], np.cumsum(counts)])
        return offsets, np.argsort(self.labels, kind="stable").astype(np.uint32)

    def cells_of(self, region: int) -> npt.NDArray[np.uint32]:
        """The cells of a region, ascending; a ValueError if there is no such region."""
        if not 0 <= region < self.n_regions:
            raise ValueError(f"there is no region {region}: there are {self.n_regions}")
        offsets, cells = self._by_region
        return cells[offsets[region] : offsets[region + 1]]

    def cells_of_all(self, regions: list[int]) -> npt.NDArray[np.uint32]:
        """The cells of several regions, ascending."""
        parts = [self.cells_of(region) for region in sorted(set(regions))]
        return np.sort(np.concatenate(parts)) if parts else np.empty(0, np.uint32)

    def graph(self, surface: Surface) -> RegionGraph:
        """The region graph, made when it is first asked for."""
        if "_graph" not in self.__dict__:
            self.__dict__["_graph"] = region_graph_of(surface, self.labels, self.n_regions)
        graph: RegionGraph = self.__dict__["_graph"]
        return graph


@dataclass
class Revisions:
    """The last few revisions."""

    _kept: OrderedDict[int, Revision] = field(default_factory=OrderedDict)
    _last: int = field(default_factory=lambda: time.time_ns() // 1_000_000)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, partition: Partition, labels: Ints, n_regions: int) -> Revision:
        """Keep labels under a new number, or under that which the same partition has."""
        with self._lock:
            for revision in self._kept.values():
                if revision.partition == partition:
                    self._kept.move_to_end(revision.number)
                    return revision
            self._last += 1
            revision = Revision(self._last, partition, labels, n_regions)
            self._kept[revision.number] = revision
            while len(self._kept) > MAX_KEPT:
                self._kept.popitem(last=False)
            return revision

    def get(self, number: object) -> Revision:
        """Return the revision of a number; a GoneError if it is not there (any more)."""
        with self._lock:
            revision = self._kept.get(number) if isinstance(number, int) else None
            if revision is None:
                name = shortened(str(number))  # a request may hold anything
                raise GoneError(f"revision {name} is gone: ask for the state, and its labels")
            self._kept.move_to_end(revision.number)
            return revision
