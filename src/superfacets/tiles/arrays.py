"""Lookups in arrays that several modules of tiles need."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Array, Bools, Floats, Longs

__all__ = ["box_of", "index_near", "is_among", "joined_boxes", "merged", "rows", "stable_order"]

_MOST_SPARSE = 16
"""Numbers in the range of a table, for each one in use."""


def rows(offsets: Longs, chosen: Array) -> tuple[Longs, Longs]:
    """Offsets of the rows chosen from an array in CSR form, and where their entries are in it."""
    return _core.choose_lists(offsets, np.asarray(chosen, np.int64))


def merged(lists: Sequence[Longs]) -> Longs:
    """All numbers of some ascending lists, ascending, each once."""
    numbers: Longs = np.sort(np.concatenate(lists), kind="stable")  # fast, as it finds ascents
    is_new = np.ones(len(numbers), bool)
    is_new[1:] = numbers[1:] != numbers[:-1]
    return numbers[is_new]


def index_near(values: Array, among: Array, near: Array) -> Longs:
    """The index of each value in an ascending array; -1 where it is not there.

    Fast where most values are between the first and the last number of `near`.
    """
    low, high = (int(near[0]), int(near[-1]) + 1) if len(near) else (0, 0)
    if high - low > _MOST_SPARSE * len(near):
        high = low
    begin, end = np.searchsorted(among, [low, high])
    table = np.full(high - low, -1, np.int32)
    table[among[begin:end] - low] = np.arange(begin, end)
    is_near = (values >= low) & (values < high)
    at = np.empty(len(values), np.int64)
    at[is_near] = table[values[is_near] - low]
    far = values[~is_near]
    found = np.searchsorted(among, far)
    at[~is_near] = np.where(is_among(far, among), found, -1)
    return at


def is_among(values: Array, wanted: Array) -> Bools:
    """Whether each value is in an ascending array."""
    at = np.searchsorted(wanted, values)
    is_hit = at < len(wanted)
    is_hit[is_hit] = wanted[at[is_hit]] == values[is_hit]
    return is_hit


def stable_order(codes: npt.NDArray[np.uint32]) -> Longs:
    """As ``argsort``, in two passes by 16 bits, for which numpy counts in place of comparing."""
    order = np.argsort((codes & 0xFFFF).astype(np.uint16), kind="stable")
    upper = (codes >> 16).astype(np.uint16)
    return order[np.argsort(upper[order], kind="stable")]


def box_of(points: Floats) -> Floats:
    """The box around points, (2, 3)."""
    columns = [points[:, axis] for axis in range(3)]  # many times faster than along axis 0
    return np.array([[values.min() for values in columns], [values.max() for values in columns]])


def joined_boxes(boxes: Sequence[Floats]) -> Floats:
    """The box around some boxes, (2, 3)."""
    stacked = np.stack(boxes)
    return np.array([stacked[:, 0].min(axis=0), stacked[:, 1].max(axis=0)])
