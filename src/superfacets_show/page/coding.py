"""Encode arrays for the JavaScript viewer as one block of bytes, which may be converted to text."""

from __future__ import annotations

import base64
import zlib
from typing import Literal, TypedDict

import numpy as np
import numpy.typing as npt

from superfacets.kit import Array

Coding = Literal["plain", "planes", "difference", "newest"]

# Compression level of zlib. Level 9 takes three times as long, and saves only 1 % of the bytes.
_EFFORT = 6

_ALIGNMENT = 4
"""Each array starts at a multiple of this number of bytes in the block. JavaScript can use aligned
arrays without copying them."""


class Entry(TypedDict):
    """Description of one array in the block."""

    name: str
    dtype: str  # uint8, uint16, uint32, int32 or float32
    shape: list[int]
    offset: int  # offset in the block, in bytes
    coding: Coding


class Arrays:
    """Named arrays, encoded one after the other into one block of bytes."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self._blocks: list[bytes] = []
        self._size = 0

    def add(self, name: str, array: Array, coding: Coding) -> None:
        """Add an array of numbers, shape (n,) or (n, columns).

        "plain" stores the bytes of the numbers in little-endian order. The other codings compress
        better, because they store byte planes: the lowest bytes of all numbers, then their second
        bytes, and so on. "planes" stores the numbers column by column. "difference" is like
        "planes", but first replaces each number of a column, except the first, by its difference
        from the previous number. "newest" stores the `newest_codes` of the numbers, row by row.
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
        """Block of all encoded arrays."""
        return b"".join(self._blocks)

    def text(self) -> str:
        """Return the block, compressed with zlib and encoded in base64."""
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
    """Encode each number as the highest previous number plus 1, minus the number.

    The first number is encoded as 0 minus the number. Codes of corners of triangles are small if
    vertices are numbered by first use, and consecutive triangles have common corners.
    """
    highest = np.maximum.accumulate(numbers)
    before = np.zeros_like(numbers)
    before[1:] = highest[:-1] + np.uint32(1)
    return before - numbers


def little_endian(array: Array) -> Array:
    """Return the array in little-endian byte order, without copying on most machines."""
    return array.astype(array.dtype.newbyteorder("<"), copy=False)
