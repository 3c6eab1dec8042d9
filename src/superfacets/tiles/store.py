"""Cells on disk: sorted along the space-filling curve, and cut into tiles of whole ranges."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from .scratch import Scratch

__all__ = ["RANGE", "Job", "Run", "TileStore", "find_cells", "run_serially", "tile_starts"]

RANGE = 4096
"""Places of a range of the curve, beyond which coarse cells never extend: 2**kRangeBits in the
core's ``cell_grower.hpp``. Tiles begin at multiples of it."""

Job = tuple[Any, ...]
"""A tile, and further arguments."""


class Run(Protocol):
    """What does the same work for many jobs, in any process."""

    def __call__(
        self,
        work: Callable[..., Any],
        store: Any,
        jobs: Sequence[Job],
        /,
        *,
        n_before: int = 0,
        n_after: int = 0,
    ) -> list[Any]:
        """Return ``work(store, *job)`` for each job, in order.

        So many jobs of the same pass were done before, and so many are still to come: for whoever
        watches the run.
        """


@dataclass(frozen=True, eq=False)
class TileStore:
    """A mesh as tiles of its faces, and arrays of each tile by name.

    The faces are sorted by the code of their centroid on the curve over the box of all centroids,
    then by number; their *place* is the index in this order. Per tile there are, from the start,

    ========== ================= ==================================================
    cells      (n,) int32        number of each face in the input
    positions  (n, 3) float64    centroids
    measures   (n,) float64      areas
    corners    (n, 3) int32      of triangles: rows of the vertices; of polygons ``offsets`` and
                                 ``vertices`` in a folder ``corners``
    vertices   ids, points       numbers of vertices, welded, ascending, and their positions
    ========== ================= ==================================================

    Attributes
    ----------
    scratch : Scratch
        The folder; array `name` of tile t is ``tile{t}/{name}`` in it.
    kind : {"triangles", "polygons", "points"}
    starts : tuple of int
        First place of each tile, and the number of faces at the end. Multiples of `RANGE` but for
        the last.
    bounds : ndarray of float64, shape (2, 3)
        Low and high corner of the box of the vertices that faces use.
    curve : ndarray of float64, shape (2, 3)
        The same of the centroids.
    total_measure : float
        Sum of the areas, as the core's ``sum_of`` adds them in the order of the input.
    """

    scratch: Scratch
    kind: Literal["triangles", "polygons", "points"]
    starts: tuple[int, ...]
    bounds: npt.NDArray[np.float64]
    curve: npt.NDArray[np.float64]
    total_measure: float

    @property
    def n_tiles(self) -> int:
        """Number of tiles."""
        return len(self.starts) - 1

    @property
    def n_cells(self) -> int:
        """Number of faces, N."""
        return self.starts[-1]

    def size(self, tile: int) -> int:
        """Number of faces in a tile."""
        return self.starts[tile + 1] - self.starts[tile]

    def tiles_of(self, places: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
        """The tile that each place is in."""
        return np.searchsorted(self.starts, places, side="right").astype(np.int64) - 1

    def is_in(self, tile: int, places: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
        """Whether each place is in a tile."""
        return np.asarray((places >= self.starts[tile]) & (places < self.starts[tile + 1]))

    def read(self, tile: int, name: str) -> npt.NDArray[Any]:
        """An array of a tile, in memory."""
        return self.scratch.load(f"tile{tile}/{name}")

    def write(self, tile: int, name: str, array: npt.NDArray[Any]) -> None:
        """Write an array of a tile."""
        self.scratch.save(f"tile{tile}/{name}", array)

    def has(self, tile: int, name: str) -> bool:
        """Whether a tile has such an array."""
        return self.scratch.has(f"tile{tile}/{name}")

    def remove(self, tile: int, name: str) -> None:
        """Remove an array of a tile, if there is one, to make room on the disk."""
        self.scratch.remove(f"tile{tile}/{name}")

    def rename(self, tile: int, name: str, new: str) -> None:
        """Put an array of a tile in the place of another."""
        self.scratch.rename(f"tile{tile}/{name}", f"tile{tile}/{new}")

    def remove_from_all(self, name: str) -> None:
        """Remove an array of every tile."""
        for tile in range(self.n_tiles):
            self.remove(tile, name)

    def read_at(self, name: str, places: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Values of an array of all tiles at some places, ascending; one tile is read at a time."""
        tiles = self.tiles_of(places)
        values = [
            self.read(tile, name)[places[tiles == tile] - self.starts[tile]]
            for tile in np.unique(tiles).tolist()
        ]
        return np.concatenate(values) if values else self.read(0, name)[:0]


_LOW_BITS = (1 << 20) - 1
"""Of the numbers of cells."""


def find_cells(
    store: TileStore, tile: int, wanted: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Which of some cells are in a tile, as indices, and where in it they are."""
    cells = store.read(tile, "cells")
    is_possible = np.zeros(_LOW_BITS + 1, bool)
    is_possible[wanted & _LOW_BITS] = True
    possible = np.flatnonzero(is_possible[cells & _LOW_BITS])  # a search for all would take longer
    order = np.argsort(wanted)
    at = np.minimum(np.searchsorted(wanted, cells[possible], sorter=order), len(wanted) - 1)
    is_wanted = wanted[order[at]] == cells[possible]
    return order[at[is_wanted]], possible[is_wanted]


def tile_starts(n_cells: int, n_tiles: int) -> tuple[int, ...]:
    """First places of at most so many tiles of whole ranges, of about the same size."""
    n_ranges = -(-n_cells // RANGE)
    n_tiles = min(n_tiles, n_ranges)
    return (*(n_ranges * tile // n_tiles * RANGE for tile in range(n_tiles)), n_cells)


def run_serially(work: Callable[..., Any], store: Any, jobs: Sequence[Job], **_: int) -> list[Any]:
    """Do one job after the other, here."""
    return [work(store, *job) for job in jobs]
