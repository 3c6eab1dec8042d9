"""Select, merge and search arrays, and compute bounding boxes, for other modules of `tiles`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import _core
from .._types import Array, Bools, Floats, Ints, Longs

MAX_SPAN = 1 << 26
"""`compacted` uses a lookup table if maximum minus minimum of the values is below this number."""

_MAX_SPARSE = 16
"""`index_near` uses a lookup table only if `near` contains at least one in `_MAX_SPARSE` integers
from near[0] to near[-1]."""


def rows(offsets: Longs, chosen: Array) -> tuple[Longs, Longs]:
    """Select rows of a CSR array; return their new offsets, and the indices of their entries."""
    return _core.choose_lists(offsets, np.asarray(chosen, np.int64))


def merged(lists: Sequence[Longs]) -> Longs:
    """Return all distinct values of several ascending arrays, in ascending order."""
    numbers: Longs = np.sort(np.concatenate(lists), kind="stable")  # fast on ascending lists
    is_new = np.ones(len(numbers), bool)
    is_new[1:] = numbers[1:] != numbers[:-1]
    return numbers[is_new]


def index_near(values: Array, among: Array, near: Array) -> Longs:
    """Return the same as `index_in`, but faster if most values are between near[0] and near[-1].

    `among` and `near` must be ascending.
    """
    low, high = (int(near[0]), int(near[-1]) + 1) if len(near) else (0, 0)
    if high - low > _MAX_SPARSE * len(near):
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
    """Return, for each value, its index in `among`, or -1 if `among` does not contain the value.

    `among` must be ascending, unless `order`, the result of ``np.argsort(among)``, is given.
    """
    if not len(among):
        return np.full(len(values), -1)
    at = np.minimum(np.searchsorted(among, values, sorter=order), len(among) - 1)
    at = at if order is None else order[at]
    return np.where(among[at] == values, at, -1)


def is_among(values: Array, among: Array) -> Bools:
    """Return, for each value, whether it occurs in the ascending array `among`."""
    return index_in(values, among) >= 0


def compacted(values: Array) -> tuple[Longs, Ints]:
    """Return the distinct values in ascending order, and the index of each value among them.

    The result is the same as that of `np.unique` with ``return_inverse=True``.
    """
    low, high = (int(values.min()), int(values.max()) + 1) if len(values) else (0, 0)
    if high - low > MAX_SPAN:
        used, at = np.unique(values, return_inverse=True)
        return used.astype(np.int64), at.reshape(-1).astype(np.int32)
    is_used = np.zeros(high - low, bool)
    is_used[values - low] = True
    table = np.cumsum(is_used, dtype=np.int32) - 1
    return np.flatnonzero(is_used) + low, table[values - low].astype(np.int32)


def box_of(points: Floats) -> Floats:
    """Return the bounding box of points: minimum and maximum of the coordinates, shape (2, 3)."""
    columns = [points[:, axis] for axis in range(3)]  # faster than points.min(axis=0)
    return np.array([[values.min() for values in columns], [values.max() for values in columns]])


def joined_boxes(boxes: Sequence[Floats]) -> Floats:
    """Return the smallest bounding box that contains all `boxes`, shape (2, 3)."""
    stacked = np.stack(boxes)
    return np.array([stacked[:, 0].min(axis=0), stacked[:, 1].max(axis=0)])
