"""Encoding of arrays for the front end, as one block of bytes, or as base64 text for pages."""

from __future__ import annotations

import base64
import zlib
from typing import Literal, TypedDict

import numpy as np
import numpy.typing as npt

from ..._types import Array

Coding = Literal["plain", "planes", "difference", "newest"]

# Compression level of zlib. Level 9 takes three times as long, for 1 % less on a page of the bunny.
_EFFORT = 6

_ALIGNMENT = 4
"""Alignment of arrays in the block, in bytes, so that plain arrays are used in place."""


class Entry(TypedDict):
    """Entry of an array in the table of contents."""

    name: str
    dtype: str  # uint8, uint16, uint32, int32 or float32
    shape: list[int]
    offset: int  # first byte in the block
    coding: Coding


class Arrays:
    """Named arrays, in the order of addition."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self._blocks: list[bytes] = []
        self._size = 0

    def add(self, name: str, array: Array, coding: Coding) -> None:
        """Add an array of numbers, shape (n,) or (n, columns).

        "plain" stores the memory of the array. The other codings compress better. They store
        numbers column by column, and bytes in planes: all lowest bytes, then all second bytes, and
        so on. "difference" replaces each number of a column, except the first, by its difference
        to the previous number. "newest" stores the `newest_codes` of the numbers, row by row.
        """
        self.entries.append(
            {
                "name": name, "dtype": array.dtype.name, "shape": list(array.shape),
                "offset": self._size, "coding": coding,
            }
        )  # fmt: skip
        block = little_endian(array).tobytes() if coding == "plain" else _planes(array, coding)
        self._blocks.append(block + b"\0" * (-len(block) % _ALIGNMENT))
        self._size += len(self._blocks[-1])

    @property
    def data(self) -> bytes:
        """The block: all arrays, concatenated."""
        return b"".join(self._blocks)

    def text(self) -> str:
        """The block, compressed, in base64."""
        packer = zlib.compressobj(_EFFORT)
        parts = [packer.compress(block) for block in self._blocks]
        return base64.b64encode(b"".join([*parts, packer.flush()])).decode("ascii")


def _planes(array: Array, coding: Coding) -> bytes:
    columns = array.shape[1] if array.ndim == 2 and coding != "newest" else 1
    flat = np.ascontiguousarray(array.reshape(-1, columns).T)
    if coding == "difference" and flat.size:
        flat = np.concatenate([flat[:, :1], np.diff(flat, axis=1)], axis=1)  # integers wrap around
    if coding == "newest":
        flat = newest_codes(flat[0])
    size = flat.dtype.itemsize
    return little_endian(flat.ravel()).view(np.uint8).reshape(-1, size).T.tobytes()


def newest_codes(numbers: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """High-watermark encoding: one more than the highest number so far, minus each number.

    Codes are small if consecutive triangles share corners.
    """
    highest = np.maximum.accumulate(numbers)
    before = np.zeros_like(numbers)
    before[1:] = highest[:-1] + np.uint32(1)
    return before - numbers


def little_endian(array: Array) -> Array:
    """The array in little-endian order, which needs no copy on most machines."""
    return array.astype(array.dtype.newbyteorder("<"), copy=False)
