"""Encode cell indices and arrays for the journal, for JSON, and for binary replies to clients."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets.kit import Array, counted
from superfacets_show import Arrays

MAGIC = b"SFSTUDIO"  # first bytes of a binary reply with several arrays

CellNumbers = npt.NDArray[np.uint32]

_MAX_BYTES = 5  # maximum number of bytes for a 32-bit number, with 7 bits per byte


def pack_cells(cells: CellNumbers) -> bytes:
    """Compress sorted cell indices: encode the differences as varints, and apply zlib.

    The cells of a region take at most about one byte each, because neighboring cells mostly have
    similar indices. A run of consecutive indices takes only a few bytes in total.
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
    """Decode what `pack_cells` made; raise a ValueError if a cell is not below `n_cells`."""
    data = np.frombuffer(inflated(packed, _MAX_BYTES * n_cells), np.uint8)
    if not len(data):
        return np.empty(0, np.uint32)
    is_last = data < 0x80
    starts = np.concatenate([[0], np.flatnonzero(is_last)[:-1] + 1])
    sizes = np.diff(np.append(starts, len(data)))
    if not is_last[-1] or sizes.max() > _MAX_BYTES:
        raise ValueError("the list of cells is damaged: a number is incomplete or too long")
    shifts = 7 * (np.arange(len(data)) - np.repeat(starts, sizes))
    deltas = np.add.reduceat((data & 0x7F).astype(np.int64) << shifts, starts)
    if deltas.sum(dtype=np.float64) >= n_cells or deltas[1:].min(initial=1) < 1:
        raise ValueError(f"cells must be ascending numbers between 0 and {n_cells - 1}")
    return np.cumsum(deltas).astype(np.uint32)


def inflated(packed: bytes, max_bytes: int) -> bytes:
    """Decompress bytes; raise a ValueError for damaged data or a result above `max_bytes`."""
    reader = zlib.decompressobj()
    try:
        data = reader.decompress(packed, max_bytes + 1)
    except zlib.error:
        data = b""
    if not reader.eof or len(data) > max_bytes:
        raise ValueError("packed numbers are damaged")
    return data


def base64_of(array: Array | bytes) -> str:
    """Encode bytes, or the little-endian bytes of an array, as base64 text."""
    if not isinstance(array, bytes):
        array = array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes()
    return base64.b64encode(array).decode("ascii")


def cells_from(text: object, n_cells: int) -> CellNumbers:
    """Return the sorted cells in base64 of uint32; raise a ValueError if it is not valid."""
    data = bytes_from(text, "cells")
    if len(data) % 4:
        raise ValueError(
            f"cells must be uint32, so the number of bytes must be a multiple of 4, got {len(data)}"
        )
    cells = np.unique(np.frombuffer(data, "<u4"))
    if len(cells) and cells[-1] >= n_cells:
        whole = counted(n_cells, "cell")
        raise ValueError(f"cell {cells[-1]} does not exist: the mesh has {whole}")
    return cells.astype(np.uint32)


def bytes_from(text: object, name: str = "data") -> bytes:
    """Decode base64 text from a client, or raise a ValueError if it is not valid."""
    try:
        if isinstance(text, str):
            return base64.b64decode(text, validate=True)
    except ValueError:  # binascii.Error is a ValueError
        pass
    raise ValueError(f"{name} must be base64")


def packet(header: Mapping[str, Any], arrays: Mapping[str, Array]) -> bytes:
    """Pack a header and arrays into one block of bytes.

    The block contains `MAGIC`, the length of the JSON header as uint32, the header padded with
    spaces, and the arrays, each at an offset that is a multiple of 4. The entry ``arrays`` of the
    header describes each array by an `Entry`, with its offset from the end of the header.
    """
    block = Arrays()
    for name, array in arrays.items():
        block.add(name, array, "plain")
    text = json.dumps({**header, "arrays": block.entries}, separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    return b"".join([MAGIC, len(text).to_bytes(4, "little"), text, block.data])
