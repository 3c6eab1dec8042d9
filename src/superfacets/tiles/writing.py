"""Labels of tiles in the order of the input, in one file."""

from __future__ import annotations

import os

import numpy as np
import numpy.typing as npt

from ..io.atomic import StrPath, atomic_outputs
from .scratch import header_of, write_all
from .store import TileStore

__all__ = ["write_labels"]

WINDOW = 1 << 26
"""Labels of the file that are in memory at a time: 256 MB."""


def write_labels(store: TileStore, name: str, out: StrPath) -> None:
    """Write an int32 array of all tiles as one .npy in the order of the input; it appears whole.

    Parameters
    ----------
    store : TileStore
    name : str
        Of the array: a label for each place of a tile.
    out : path-like
        Ends in ``.npy``.

    Raises
    ------
    OSError
        If the file cannot be written: then nothing is there but what was before.
    """
    with atomic_outputs([out]) as (partial,), partial.open("wb", buffering=0) as file:
        write_all(file, header_of(np.dtype(np.int32), (store.n_cells,)))
        for first in range(0, store.n_cells, WINDOW):
            labels = _window(store, name, first, min(first + WINDOW, store.n_cells))
            write_all(file, labels.view(np.uint8))
        os.fsync(file.fileno())


def _window(store: TileStore, name: str, first: int, end: int) -> npt.NDArray[np.int32]:
    labels = np.empty(end - first, np.int32)
    for tile in range(store.n_tiles):
        cells, values = store.read(tile, "cells"), store.read(tile, name)
        if end - first < store.n_cells:
            is_in = (cells >= first) & (cells < end)
            cells, values = cells[is_in], values[is_in]
        labels[cells - first] = values
    return labels
