"""Store cells on disk, sorted along a space-filling curve and split into tiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .._types import Array, Bools, Floats, Ints, Longs
from ..workers.scratch import Scratch
from .arrays import index_in

RANGE = 4096
"""Number of consecutive cells in a range of the space-filling curve. It must equal 2**kRangeBits in
the C++ file ``cell_grower.hpp``. A coarse cell lies within one range, and tiles begin at multiples
of RANGE."""

Kind = Literal["triangles", "polygons", "points"]


@dataclass(frozen=True, eq=False)
class TileStore:
    """A mesh or cloud split into tiles, with named arrays for each tile.

    Cells are sorted by the Morton code of their position in the bounding box. Faces of equal code
    are sorted by number; for points of equal code, see `sort_cloud`. The index of a cell in this
    order is its *curve index*; variables with curve indices are named `places`. After stage 1, each
    tile with n cells has these arrays:

    ========= ============== ==================================================================
    cells     (n,) int32     cell number: for faces, the index in the input; for points, the
                             rank in curve order, with all copies at the end
    positions (n, 3) float64 centroids of faces, or points
    measures  (n,) float64   areas
    corners   (n, 3) int32   triangles: rows of ``vertices``; polygons: lists of such rows
    vertices  ids, points    faces: ascending numbers of welded vertices, and their positions
    numbers   (n,) int32     points: index in the input
    normals   (n, 3) float64 points: normals of length 1, or zero
    neighbors lists          points: curve indices ``targets`` of all neighbors, ascending
    ========= ============== ==================================================================

    `find_arcs` adds the arcs of each tile, and its *ghosts*: the neighbors of its cells in other
    tiles. Array `name` of tile t is ``tile{t}/{name}`` in the scratch folder. `Part` reads several
    arrays.
    """

    scratch: Scratch
    kind: Kind
    starts: tuple[int, ...]  # first curve index of each tile (multiples of RANGE), then N
    bounds: Floats  # (2, 3) bounding box of the points, or of the vertices that faces use
    total_measure: float  # sum of all measures, added in the same order as in `segment`
    halos: list[list[int]] | None = None  # result of `find_halos`; None if it has not run

    @property
    def n_tiles(self) -> int:
        """Number of tiles."""
        return len(self.starts) - 1

    @property
    def n_cells(self) -> int:
        """Number of cells in all tiles, N."""
        return self.starts[-1]

    def size(self, tile: int) -> int:
        """Return the number of cells in a tile."""
        return self.starts[tile + 1] - self.starts[tile]

    def tiles_of(self, places: Array) -> Longs:
        """Return the tile that contains each curve index."""
        return np.searchsorted(self.starts, places, side="right").astype(np.int64) - 1

    def is_in(self, tile: int, places: Array) -> Bools:
        """Return, for each curve index, whether the cell is in a tile."""
        return np.asarray((places >= self.starts[tile]) & (places < self.starts[tile + 1]))

    def rows_of(self, tile: int, places: Ints) -> tuple[Ints, Ints]:
        """Return the row of each curve index among cells and ghosts of a tile, and the ghosts.

        Ghosts are the cells in `places` that belong to other tiles, in ascending order. Their rows
        follow the rows of the cells of the tile. The row of a curve index of -1 is -1.
        """
        is_ghost = (places >= 0) & ~self.is_in(tile, places)
        ghosts = np.unique(places[is_ghost])
        rows = np.where(places < 0, places, places - np.int32(self.starts[tile]))
        rows[is_ghost] = self.size(tile) + np.searchsorted(ghosts, places[is_ghost])
        return rows, ghosts

    def read(self, tile: int, name: str) -> Array:
        """Read an array of a tile into memory."""
        return self.scratch.load(f"tile{tile}/{name}")

    def write(self, tile: int, name: str, array: Array) -> None:
        """Write an array of a tile."""
        self.scratch.save(f"tile{tile}/{name}", array)

    def has(self, tile: int, name: str) -> bool:
        """Return whether a tile has an array with this name."""
        return self.scratch.has(f"tile{tile}/{name}")

    def remove(self, tile: int, name: str) -> None:
        """Remove an array of a tile, if it exists."""
        self.scratch.remove(f"tile{tile}/{name}")

    def remove_from_all(self, *names: str) -> None:
        """Remove the named arrays from all tiles."""
        for name in names:
            for tile in range(self.n_tiles):
                self.remove(tile, name)

    def cells_and_ghosts(self, tile: int) -> Ints:
        """Return the cell numbers of the cells of a tile, followed by those of its ghosts.

        Targets of arcs are indices in this array.
        """
        return np.concatenate([self.read(tile, "cells"), self.read(tile, "ghost_cells")])

    def arcs(self, tile: int) -> tuple[Longs, Ints, Array]:
        """Return the offsets, targets and lengths of the arcs of a tile, in CSR form."""
        offsets, targets = self.read(tile, "arcs/offsets"), self.read(tile, "arcs/targets")
        return offsets, targets, self.read(tile, "arcs/lengths")

    def read_at(self, name: str, places: Array) -> Array:
        """Return the rows of an array at ascending curve indices; one tile is read at a time."""
        tiles = self.tiles_of(places)
        values = [
            self.read(tile, name)[places[tiles == tile] - self.starts[tile]]
            for tile in np.unique(tiles).tolist()
        ]
        return np.concatenate(values) if values else self.read(0, name)[:0]

    def read_around(self, tile: int, name: str, places: Array) -> Array:
        """Return the rows of an array at curve indices in any order.

        This is fast if most of the curve indices are in `tile`.
        """
        own, is_own = self.read(tile, name), self.is_in(tile, places)
        values = np.empty((len(places), *own.shape[1:]), own.dtype)
        values[is_own] = own[places[is_own] - self.starts[tile]]
        others, which = np.unique(places[~is_own], return_inverse=True)
        values[~is_own] = self.read_at(name, others)[which.reshape(-1)]
        return values


def weighted_sum(store: TileStore, tile: int, name: str) -> Array:
    """Return the sum of the rows of an array of a tile, weighted by the areas of the cells."""
    return np.asarray(np.einsum("i,ij->j", store.read(tile, "measures"), store.read(tile, name)))


_LOW_BITS = (1 << 20) - 1
"""Mask of the lower bits of cell numbers, which `find_cells` uses as a hash value."""


def find_cells(store: TileStore, tile: int, wanted: Ints) -> tuple[Longs, Longs]:
    """Return the cells in `wanted` that are in a tile, as indices in `wanted` and as rows."""
    cells = store.read(tile, "cells")
    is_possible = np.zeros(_LOW_BITS + 1, bool)
    is_possible[wanted & _LOW_BITS] = True
    possible = np.flatnonzero(is_possible[cells & _LOW_BITS])  # usually few cells
    which = index_in(cells[possible], wanted, np.argsort(wanted))
    return which[which >= 0], possible[which >= 0]


def tile_starts(n_cells: int, n_tiles: int) -> tuple[int, ...]:
    """Return the first curve index of each tile, followed by n_cells.

    There are n_tiles tiles of similar size, but at most one per `RANGE` of cells.
    """
    n_ranges = -(-n_cells // RANGE)
    n_tiles = min(n_tiles, n_ranges)
    return (*(n_ranges * tile // n_tiles * RANGE for tile in range(n_tiles)), n_cells)
