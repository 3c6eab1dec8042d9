"""External merge sort of cells by code: sorted runs, cuts at the starts of tiles, merging."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._types import Array, Ints, Longs
from .._validate import MAX_CELLS
from ..errors import MeshError
from ..io.tables import Rows
from .arrays import stable_order
from .opening import Pieces
from .part import NO_LISTS, ListNames, Part
from .scratch import Scratch
from .store import RANGE, Run
from .welding import weld

LOW_BITS = 15
"""Half of the bits of a code. Codes are counted by their upper bits; then, where a tile begins
within such a group, by their lower bits."""


@dataclass(frozen=True)
class Chunks:
    """The input in chunks of `size` cells."""

    pieces: Pieces
    lowest: Rows | None  # lowest vertex or point at the position of each; None if all differ
    size: int
    n_threads: int

    @classmethod
    def welded(
        cls, pieces: Pieces, scratch: Scratch, tile_cells: int, run: Run, n_threads: int
    ) -> Chunks:
        """Check all positions, and weld them; chunks are as large as tiles.

        A MeshError if there are too many cells, or a coordinate is not finite.
        """
        mesh, cells, points = ("mesh", "faces", "vertices")
        if pieces.corners is None:
            mesh, cells, points = ("cloud", "points", "points")
        if pieces.n_cells > MAX_CELLS:
            raise MeshError(
                f"the {mesh} has {pieces.n_cells} {cells}; at most {MAX_CELLS} are supported"
            )
        size = -(-tile_cells // RANGE) * RANGE
        lowest = weld(run, scratch, pieces.points, size, n_threads, points)
        return cls(pieces, lowest, size, n_threads)

    @property
    def n_chunks(self) -> int:
        """Number of chunks, and of tiles."""
        return -(-self.pieces.n_cells // self.size)

    @property
    def most(self) -> int:
        """Largest number of vertices in memory at a time."""
        return 2 * self.size

    def range(self, chunk: int) -> tuple[int, int]:
        """The first cell of a chunk, and the first of the next."""
        return chunk * self.size, min((chunk + 1) * self.size, self.pieces.n_cells)


def save_run(scratch: Scratch, chunk: int, part: Part, codes: Array) -> Ints:
    """Write a chunk as the sorted run ``runs/{chunk}``; count the upper bits of its codes."""
    order = stable_order(codes)
    part = part.take(order)
    part.columns["codes"] = codes[order]
    part.save(scratch, f"runs/{chunk}")
    return np.bincount(codes >> LOW_BITS, minlength=1 << LOW_BITS).astype(np.int32)


def find_cuts(scratch: Scratch, counts: Ints, starts: Longs) -> Longs:
    """Where each tile begins in each run, shape (T + 1, chunks).

    `counts`, (chunks, 2^15), are how often each value of the upper bits occurs in each run.
    """
    before = np.zeros((len(counts), counts.shape[1] + 1), np.int32)
    np.cumsum(counts, axis=1, out=before[:, 1:])
    all_before = before.sum(axis=0, dtype=np.int64)
    cuts = np.zeros((len(starts), len(counts)), np.int64)
    cuts[-1] = before[:, -1]
    for tile in range(1, len(starts) - 1):
        upper = int(np.searchsorted(all_before, starts[tile], side="right")) - 1
        n_left = int(starts[tile] - all_before[upper])
        cuts[tile] = before[:, upper]
        if n_left:
            ranges = before[:, upper : upper + 2].astype(np.int64)
            cuts[tile] += _cut_within(scratch, ranges, n_left)
    return cuts


def _cut_within(scratch: Scratch, ranges: Longs, n_left: int) -> Longs:
    """How many cells of each range are among the first n_left of all, by (code, run, place).

    The codes in all ranges have the same upper bits.
    """

    def codes_of(chunk: int) -> Array:
        codes: Array = scratch.load(f"runs/{chunk}/codes", *ranges[chunk].tolist())
        return codes & np.uint32((1 << LOW_BITS) - 1)

    chunks = np.flatnonzero(ranges[:, 0] < ranges[:, 1]).tolist()
    totals = np.zeros(1 << LOW_BITS, np.int64)
    for chunk in chunks:
        totals += np.bincount(codes_of(chunk), minlength=len(totals))
    ends = np.cumsum(totals)
    code = int(np.searchsorted(ends, n_left))  # code of the last of the first n_left
    n_equal = n_left - int(ends[code] - totals[code])
    taken = np.zeros(len(ranges), np.int64)
    for chunk in chunks:
        first, last = np.searchsorted(codes_of(chunk), [code, code + 1]).tolist()
        n_more = min(n_equal, last - first)
        n_equal -= n_more
        taken[chunk] = first + n_more
    return taken


def read_cut(
    scratch: Scratch, cuts: Longs, columns: Sequence[str], lists: ListNames = NO_LISTS
) -> Part:
    """The cells of a tile, merged from all runs by (code, run); with the column ``codes``."""
    parts = [
        Part.load(scratch, f"runs/{chunk}", ("codes", *columns), lists, *cuts[:, chunk].tolist())
        for chunk in np.flatnonzero(cuts[0] < cuts[1]).tolist()
    ]
    part = Part.joined(parts)
    del parts
    return part.take(stable_order(part.columns["codes"]))
