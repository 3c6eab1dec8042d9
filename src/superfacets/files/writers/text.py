"""Format rows of numbers as text, many rows at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, Any

import numpy as np
import numpy.lib.format as npy_format

from ...base.types import Array, Floats

ROWS_AT_ONCE = 1 << 14
"""Number of rows that are formatted at a time; small enough to fit in the processor cache."""


def text_rows(row: str, columns: Sequence[Array]) -> bytes:
    """Format all rows with a single format operation; `row` is the format string of one row."""
    lists = [column.tolist() for column in columns]
    n_rows = len(lists[0])
    flat: list[Any] = [None] * (n_rows * len(lists))
    for place, values in enumerate(lists):
        flat[place :: len(lists)] = values
    return (row * n_rows % tuple(flat)).encode("ascii")


def write_rows(file: IO[bytes], row: str, columns: Sequence[Array]) -> None:
    """Write columns of equal length as rows of text; `row` is the format string of one row.

    Writers of text formats use it, because it formats many rows at a time.
    """
    for begin in range(0, len(columns[0]), ROWS_AT_ONCE):
        file.write(text_rows(row, [column[begin : begin + ROWS_AT_ONCE] for column in columns]))


def coordinate_format(values: Floats) -> str:
    """Return the shortest number format that preserves all values exactly."""
    return "%.9g" if fits_single(values) else "%.17g"


def fits_single(values: Floats) -> bool:
    """Return whether float32 represents all values exactly."""
    with np.errstate(over="ignore"):  # overflow gives infinity, which differs from the value
        return all(
            np.array_equal(part.astype(np.float32), part)
            for part in np.array_split(values, max(1, len(values) // ROWS_AT_ONCE))
        )


def write_npy(file: IO[bytes], array: Array) -> None:
    """Write an array as .npy to any stream; `numpy.save` calls ``tell``, which fails on pipes."""
    npy_format.write_array_header_1_0(file, npy_format.header_data_from_array_1_0(array))
    file.write(array.data)


def number_format(values: Array) -> str:
    """Return a format string with enough digits to restore values of this type exactly."""
    return "%d" if values.dtype.kind in "iu" else "%.9g" if values.dtype.itemsize == 4 else "%.17g"
