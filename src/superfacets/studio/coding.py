"""Coding of cells and arrays: in the journal, in JSON, and in binary answers."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Array
from ..pictures.page.coding import Arrays, little_endian

MAGIC = b"SFSTUDIO"  # the first bytes of a binary answer with several arrays

CellNumbers = npt.NDArray[np.uint32]

_MAX_BYTES = 5  # a difference below 2**32, with 7 bits per byte


def pack_cells(cells: CellNumbers) -> bytes:
    """Pack ascending cells: differences as varints, compressed.

    Cells of a region take at most about one byte each, because neighboring cells mostly have close
    numbers. A run of consecutive cells takes a few bytes.
    """
    deltas = np.diff(cells, prepend=np.uint32(0))
    sizes = np.ones(len(deltas), np.int64)
    for n in range(1, _MAX_BYTES):
        sizes += deltas >= np.uint32(1 << (7 * n))
    starts = np.cumsum(sizes) - sizes
    data = np.zeros(int(sizes.sum()), np.uint8)
    for n in range(_MAX_BYTES):
        holds = sizes > n
        septets = (deltas[holds] >> np.uint32(7 * n)) & np.uint32(0x7F)
        goes_on = (sizes[holds] > n + 1) * np.uint32(0x80)
        data[starts[holds] + n] = septets | goes_on
    return zlib.compress(data.tobytes(), level=1)


def unpack_cells(packed: bytes, n_cells: int) -> CellNumbers:
    """Return the cells given to `pack_cells`; a ValueError if they are not below `n_cells`."""
    data = np.frombuffer(inflated(packed, _MAX_BYTES * n_cells), np.uint8)
    if not len(data):
        return np.empty(0, np.uint32)
    is_last = data < 0x80
    starts = np.concatenate([[0], np.flatnonzero(is_last)[:-1] + 1])
    sizes = np.diff(np.append(starts, len(data)))
    if not is_last[-1] or sizes.max() > _MAX_BYTES:
        raise ValueError("cells are damaged: a number has no end")
    shifts = 7 * (np.arange(len(data)) - np.repeat(starts, sizes))
    deltas = np.add.reduceat((data & 0x7F).astype(np.int64) << shifts, starts)
    cells = np.cumsum(deltas)
    if cells[-1] >= n_cells or deltas[1:].min(initial=1) < 1:
        raise ValueError(f"cells are damaged: they must ascend, up to {n_cells - 1}")
    return cells.astype(np.uint32)


def inflated(packed: bytes, max_bytes: int) -> bytes:
    """Decompressed bytes; a ValueError if they are damaged, or more than allowed."""
    reader = zlib.decompressobj()
    try:
        data = reader.decompress(packed, max_bytes + 1)
    except zlib.error:
        data = b""
    if not reader.eof or len(data) > max_bytes:
        raise ValueError("packed numbers are damaged")
    return data


def base64_of(array: Array | bytes) -> str:
    """Little-endian bytes of an array, or bytes, in base64."""
    data = array if isinstance(array, bytes) else little_endian(array).tobytes()
    return base64.b64encode(data).decode("ascii")


def cells_from(text: object, n_cells: int) -> CellNumbers:
    """Ascending cells without duplicates, sent by a client as uint32 in base64; or a ValueError."""
    data = bytes_from(text, "cells")
    if len(data) % 4:
        raise ValueError(f"cells must be uint32 numbers: {len(data)} bytes are no multiple of 4")
    cells = np.unique(np.frombuffer(data, "<u4"))
    if len(cells) and cells[-1] >= n_cells:
        raise ValueError(f"there is no cell {cells[-1]}: there are {n_cells}")
    return cells.astype(np.uint32)


def bytes_from(text: object, name: str = "data") -> bytes:
    """Bytes sent by a client in base64; a ValueError if they are not valid."""
    try:
        if isinstance(text, str):
            return base64.b64decode(text, validate=True)
    except ValueError:  # base class of binascii.Error
        pass
    raise ValueError(f"{name} must be base64")


def packet(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> bytes:
    """A header and arrays as one block of bytes.

    The block has `MAGIC`, the length of the JSON as uint32, the JSON padded with spaces, and the
    arrays, each of which begins at a multiple of 4. The header gets the entry ``arrays``: an
    `Entry` of each array, with its offset from the end of the header.
    """
    block = Arrays()
    for name, array in arrays.items():
        block.add(name, array, "plain")
    text = json.dumps({**header, "arrays": block.entries}, separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    return b"".join([MAGIC, len(text).to_bytes(4, "little"), text, block.data])
