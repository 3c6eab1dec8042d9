"""Names of array types, and lookups in arrays that several rooms of tiles need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import _core

__all__ = [
    "Array", "Bools", "Bytes", "Floats", "Ints", "Longs",
    "box_of", "index_of", "is_among", "joined_boxes", "merged", "rows", "stable_order",
]  # fmt: skip

Array: TypeAlias = npt.NDArray[Any]
Bools: TypeAlias = npt.NDArray[np.bool_]
Bytes: TypeAlias = npt.NDArray[np.uint8]
Floats: TypeAlias = npt.NDArray[np.float64]
Ints: TypeAlias = npt.NDArray[np.int32]
Longs: TypeAlias = npt.NDArray[np.int64]


def rows(offsets: Longs, chosen: Array) -> tuple[Longs, Longs]:
    """Offsets of the rows chosen from an array in CSR form, and where their entries are in it."""
    return _core.choose_lists(offsets, np.asarray(chosen, np.int64))


def merged(lists: Sequence[Longs]) -> Longs:
    """All numbers of some ascending lists, ascending, each once."""
    numbers: Longs = np.sort(np.concatenate(lists), kind="stable")  # fast, as it finds ascents
    is_new = np.ones(len(numbers), bool)
    is_new[1:] = numbers[1:] != numbers[:-1]
    return numbers[is_new]


def index_of(values: Array, among: Array) -> Longs:
    """The index of each value in an ascending array; -1 where it is not there."""
    at: Longs = np.searchsorted(among, values)
    at[at == len(among)] = -1
    if len(among):
        at[among[at] != values] = -1
    return at


def is_among(values: Array, wanted: Array) -> Bools:
    """Whether each value is in an ascending array."""
    return index_of(values, wanted) >= 0


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
