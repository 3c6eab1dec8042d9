"""Superpoints of OneFormer3D and UniDet3D: an id per vertex, without a gap."""

from __future__ import annotations

from typing import IO, Any

import numpy as np
import numpy.lib.format as npy_format
import numpy.typing as npt

__all__ = ["write_npy", "write_superpoints"]


def write_superpoints(file: IO[bytes], ids: npt.NDArray[np.integer], ending: str) -> None:
    """Write ids from 0 up, in the order of the given ones, as 64-bit numbers, low byte first.

    ``.bin`` is the numbers alone; ``_sp_label.npy`` has the header of an array.
    """
    _, contiguous = np.unique(ids, return_inverse=True)
    numbers = contiguous.astype("<i8")
    if ending == ".bin":
        file.write(numbers.data)
    else:
        write_npy(file, numbers)


def write_npy(file: IO[bytes], array: npt.NDArray[Any]) -> None:
    """Write an array; numpy.save asks a file where it stands, which pipes cannot tell."""
    npy_format.write_array_header_1_0(file, npy_format.header_data_from_array_1_0(array))
    file.write(array.data)
