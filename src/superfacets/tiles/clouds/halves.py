"""Points on one step of the curve that do not fit into memory: divided by halving their box."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from ..arrays import box_of, joined_boxes
from ..part import Columns, load_columns, save_columns, taken
from ..scratch import Scratch

__all__ = ["in_halves", "joined_columns"]

DIGIT = 16
"""Bits of a coordinate that are looked at in one pass."""

NAMES = ("numbers", "lowest", "cells", "positions", "normals")


def in_halves(scratch: Scratch, names: list[str], most: int) -> Iterator[Columns]:
    """Divide points as the core's `refined_morton_order` does, until at most so many are together.

    Parameters
    ----------
    scratch : Scratch
    names : list of str
        Folders of columns, which are removed.
    most : int

    Yields
    ------
    Columns
        Each part in the order of the numbers; one after the other they are in the final order.
    """
    sizes = [len(scratch.load(f"{name}/numbers")) for name in names]
    if sum(sizes) <= most:
        if sizes:
            columns = joined_columns([load_columns(scratch, name, NAMES) for name in names])
            for name in names:
                scratch.remove_folder(name)
            yield taken(columns, np.argsort(columns["numbers"]))
        return
    axis = _longest_axis(scratch, names)
    key, number = _middle(scratch, names, axis, sum(sizes) // 2)
    halves: tuple[list[str], list[str]] = ([], [])
    for name in names:
        columns = load_columns(scratch, name, NAMES)
        keys = _keys(columns["positions"][:, axis])
        is_low = (keys < key) | ((keys == key) & (columns["numbers"] < number))
        for half, chosen in enumerate((is_low, ~is_low)):
            if chosen.any():
                halves[half].append(f"{name}.{half}")  # no name that is given: after 1 comes 10
                save_columns(scratch, halves[half][-1], taken(columns, np.flatnonzero(chosen)))
        scratch.remove_folder(name)
    for part in halves:
        yield from in_halves(scratch, part, most)


def joined_columns(parts: Sequence[Columns]) -> Columns:
    """The rows of all parts, one after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _longest_axis(scratch: Scratch, names: list[str]) -> int:
    """The axis along which the box around all points is longest, the first among equals."""
    box = joined_boxes([box_of(scratch.load(f"{name}/positions")) for name in names])
    return int(np.argmax(box[1] - box[0]))


def _keys(coordinates: npt.NDArray[np.float64]) -> npt.NDArray[np.uint64]:
    """Whole numbers in the order of the coordinates."""
    bits = (coordinates + 0.0).view(np.uint64)  # -0.0 becomes 0.0
    is_negative = bits >> np.uint64(63) != 0
    return np.where(is_negative, ~bits, bits | np.uint64(1 << 63))


def _middle(scratch: Scratch, names: list[str], axis: int, n_low: int) -> tuple[int, int]:
    """The key and the number that the point with so many before it has, by both."""
    prefix, n_left = 0, n_low
    for shift in range(64 - DIGIT, -1, -DIGIT):
        counts = np.zeros(1 << DIGIT, np.int64)
        for name in names:
            keys = _keys(scratch.load(f"{name}/positions")[:, axis])
            if shift + DIGIT < 64:
                keys = keys[keys >> np.uint64(shift + DIGIT) == prefix]
            digits = keys >> np.uint64(shift) & np.uint64((1 << DIGIT) - 1)
            counts += np.bincount(digits.astype(np.int64), minlength=len(counts))
        digit = int(np.searchsorted(np.cumsum(counts), n_left, side="right"))
        n_left -= int(counts[:digit].sum())
        prefix = prefix << DIGIT | digit
    equal = []
    for name in names:
        is_equal = _keys(scratch.load(f"{name}/positions")[:, axis]) == prefix
        equal.append(scratch.load(f"{name}/numbers")[is_equal])
    return prefix, int(np.partition(np.concatenate(equal), n_left)[n_left])
