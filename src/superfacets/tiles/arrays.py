"""Array searches and bounding boxes that several modules of tiles share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import _core
from .._types import Array, Bools, Floats, Ints, Longs

MAX_SPAN = 1 << 26
"""Largest range of values for which `compacted` makes a lookup table."""

_MOST_SPARSE = 16
"""Largest range of the values `near`, in multiples of their number, for which `index_near` makes a
lookup table."""


def rows(offsets: Longs, chosen: Array) -> tuple[Longs, Longs]:
    """Offsets of the chosen rows of a CSR array, and the indices of the entries of these rows."""
    return _core.choose_lists(offsets, np.asarray(chosen, np.int64))


def merged(lists: Sequence[Longs]) -> Longs:
    """The union of ascending lists, ascending, without duplicates."""
    numbers: Longs = np.sort(np.concatenate(lists), kind="stable")  # fast on ascending runs
    is_new = np.ones(len(numbers), bool)
    is_new[1:] = numbers[1:] != numbers[:-1]
    return numbers[is_new]


def index_near(values: Array, among: Array, near: Array) -> Longs:
    """Result of `index_in`; fast if most values are in the range of the ascending `near`."""
    low, high = (int(near[0]), int(near[-1]) + 1) if len(near) else (0, 0)
    if high - low > _MOST_SPARSE * len(near):
        high = low
    begin, end = np.searchsorted(among, [low, high])
    table = np.full(high - low, -1, np.int32)
    table[among[begin:end] - low] = np.arange(begin, end)
    is_near = (values >= low) & (values < high)
    at = np.empty(len(values), np.int64)
    at[is_near] = table[values[is_near] - low]
    at[~is_near] = index_in(values[~is_near], among)
    return at


def index_in(values: Array, among: Array, order: Longs | None = None) -> Longs:
    """The index of each value in an array that is ascending, or sorted by `order`; -1 if absent."""
    if not len(among):
        return np.full(len(values), -1)
    at = np.minimum(np.searchsorted(among, values, sorter=order), len(among) - 1)
    at = at if order is None else order[at]
    return np.where(among[at] == values, at, -1)


def is_among(values: Array, among: Array) -> Bools:
    """Whether each value is in an ascending array."""
    return index_in(values, among) >= 0


def compacted(values: Array) -> tuple[Longs, Ints]:
    """Sorted distinct integers and the index of each value in them, as `np.unique`, but faster."""
    low, high = (int(values.min()), int(values.max()) + 1) if len(values) else (0, 0)
    if high - low > MAX_SPAN:
        used, at = np.unique(values, return_inverse=True)
        return used.astype(np.int64), at.reshape(-1).astype(np.int32)
    is_used = np.zeros(high - low, bool)
    is_used[values - low] = True
    table = np.cumsum(is_used, dtype=np.int32) - 1
    return np.flatnonzero(is_used) + low, table[values - low].astype(np.int32)


def box_of(points: Floats) -> Floats:
    """The box around points, (2, 3)."""
    columns = [points[:, axis] for axis in range(3)]  # many times faster than min(axis=0)
    return np.array([[values.min() for values in columns], [values.max() for values in columns]])


def joined_boxes(boxes: Sequence[Floats]) -> Floats:
    """The box around boxes, (2, 3)."""
    stacked = np.stack(boxes)
    return np.array([stacked[:, 0].min(axis=0), stacked[:, 1].max(axis=0)])
