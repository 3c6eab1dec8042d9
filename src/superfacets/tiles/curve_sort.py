"""Cells sorted on the disk: chunks in the order of their codes, cut into ranges, and merged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .arrays import Array, Ints, Longs, stable_order
from .part import Part
from .scratch import Scratch

__all__ = ["find_cuts", "read_cut", "save_run"]

LOW_BITS = 15
"""Codes have twice as many. They are counted by their upper bits first, then by the lower ones of
codes on a border of tiles."""


def save_run(scratch: Scratch, chunk: int, part: Part, codes: Array) -> Ints:
    """Write a chunk in the order of codes as ``runs/{chunk}``; counts of the codes' upper bits."""
    order = stable_order(codes)
    part = part.take(order)
    part.columns["codes"] = codes[order]
    part.save(scratch, f"runs/{chunk}")
    return np.bincount(codes >> LOW_BITS, minlength=1 << LOW_BITS).astype(np.int32)


def find_cuts(scratch: Scratch, counts: Ints, starts: Longs) -> Longs:
    """Where each tile begins in each run, shape (T + 1, chunks).

    `counts`, (chunks, 2^15), are those of the upper bits of codes in each run.
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
    """How many of a range of each run belong to the first n_left by code, run and place.

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
    code = int(np.searchsorted(ends, n_left))  # the last that the first n_left reach
    n_equal = n_left - int(ends[code] - totals[code])
    taken = np.zeros(len(ranges), np.int64)
    for chunk in chunks:
        first, last = np.searchsorted(codes_of(chunk), [code, code + 1]).tolist()
        n_more = min(n_equal, last - first)
        n_equal -= n_more
        taken[chunk] = first + n_more
    return taken


def read_cut(scratch: Scratch, cuts: Longs, columns: Sequence[str], lists: Any) -> Part:
    """What a tile takes of each run, in the order of codes, then of runs; with ``codes``."""
    parts = [
        Part.load(scratch, f"runs/{chunk}", ("codes", *columns), lists, *cuts[:, chunk].tolist())
        for chunk in np.flatnonzero(cuts[0] < cuts[1]).tolist()
    ]
    part = Part.joined(parts)
    del parts
    return part.take(stable_order(part.columns["codes"]))
