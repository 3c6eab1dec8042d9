"""Arrays as the text of a page: in planes of bytes, compressed, in base64."""

from __future__ import annotations

import base64
import zlib
from typing import Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

__all__ = ["Arrays", "Entry", "decode_arrays", "newest_codes"]

Coding = Literal["plain", "difference", "newest"]

# How hard zlib works: 9 makes a page of the bunny 1 % smaller and takes three times as long.
_EFFORT = 6

_SIZES = {1: np.uint8, 2: np.uint16, 4: np.uint32}


class Entry(TypedDict):
    """What a page has to know of an array."""

    name: str
    size: int  # bytes of a number
    count: int
    columns: int
    coding: Coding


class Arrays:
    """Arrays of a page by name, in the order in which they were added."""

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self._planes: list[bytes] = []

    def add(self, name: str, array: npt.NDArray[Any], coding: Coding = "plain") -> None:
        """Add unsigned integers, shape (n,) or (n, columns); columns come after each other.

        With "difference" each number but the first of a column is what is added to the one before;
        "newest" takes what `newest_codes` returns for numbers that are new in rising order.
        """
        columns = array.shape[1] if array.ndim == 2 else 1
        flat = np.ascontiguousarray(array.T).reshape(columns, -1)
        if coding == "difference" and flat.size:
            flat = np.concatenate([flat[:, :1], np.diff(flat, axis=1)], axis=1)  # it wraps around
        if coding == "newest":
            flat = newest_codes(flat[0])[np.newaxis]
        size, count = flat.dtype.itemsize, flat.size
        self.entries.append(
            {"name": name, "size": size, "count": count, "columns": columns, "coding": coding}
        )
        little = np.ascontiguousarray(flat.ravel(), dtype=flat.dtype.newbyteorder("<"))
        self._planes.append(little.view(np.uint8).reshape(count, size).T.tobytes())

    def text(self) -> str:
        """All planes of bytes after each other, compressed, in base64."""
        packer = zlib.compressobj(_EFFORT)
        parts = [packer.compress(planes) for planes in self._planes]
        return base64.b64encode(b"".join([*parts, packer.flush()])).decode("ascii")


def newest_codes(numbers: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """How far each number is below the lowest that has not been there before: 0 for that itself.

    Numbers are small where triangles that follow each other share corners.
    """
    highest = np.maximum.accumulate(numbers)
    before = np.zeros_like(numbers)
    before[1:] = highest[:-1] + np.uint32(1)
    return before - numbers


def decode_arrays(entries: list[Entry], text: str) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of a page, as its script reads them; columns are rows here."""
    data = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8)
    found: dict[str, npt.NDArray[Any]] = {}
    start = 0
    for entry in entries:
        size, count, columns = entry["size"], entry["count"], entry["columns"]
        planes = data[start : start + size * count].reshape(size, count)
        start += size * count
        values = np.ascontiguousarray(planes.T).view(f"<u{size}").ravel().astype(_SIZES[size])
        if entry["coding"] == "difference":
            values = np.cumsum(values.reshape(columns, -1), axis=1, dtype=values.dtype).ravel()
        if entry["coding"] == "newest":
            is_new = values == 0
            values = (np.cumsum(is_new) - is_new).astype(np.uint32) - values
        found[entry["name"]] = values if columns == 1 else values.reshape(columns, -1)
    return found
