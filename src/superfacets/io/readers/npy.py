"""NPY: one array of numbers."""

from __future__ import annotations

import io
import math
import reprlib
import warnings
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from numpy.lib import format as npy

from ...errors import MeshError
from ..guards import Content

__all__ = ["npy_array", "npy_header"]

MAX_NPY_HEADER = 10_000
"""Bytes of text, numpy's own bound; labels need some 60. It is evaluated, so it must be short."""

_NPY_FIXED = 12
"""The bytes before that text: magic, version and the length of the text."""


def npy_array(data: Content, what: str = "numbers") -> npt.NDArray[Any]:
    """The array of a .npy file.

    numpy.load would take the memory that a damaged header claims, and would run what a pickle
    holds: only the header is left to numpy, and compared with the size of the file.
    """
    shape, dtype, is_fortran, begin = npy_header(data)
    if dtype.hasobject:
        raise MeshError(f"expected an array of numbers: the .npy header declares {dtype}")
    n_bytes = math.prod(shape) * dtype.itemsize
    if n_bytes != len(data) - begin:
        raise MeshError(
            f"the .npy header declares {n_bytes} bytes of {what} but"
            f" {len(data) - begin} follow: is the file cut?"
        )
    order: Literal["F", "C"] = "F" if is_fortran else "C"
    return np.frombuffer(data, dtype=dtype, offset=begin).reshape(shape, order=order)


def npy_header(data: Content) -> tuple[tuple[int, ...], np.dtype[Any], bool, int]:
    """Shape, type and order that a .npy file declares, and where the numbers begin."""
    start = io.BytesIO(data[: _NPY_FIXED + MAX_NPY_HEADER])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Python 2's integers, and of odd escapes in strings
            version = npy.read_magic(start)
            read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, is_fortran, dtype = read(start, max_header_size=MAX_NPY_HEADER)
    except Exception as error:  # numpy evaluates the header: a damaged one may raise anything
        reason = reprlib.repr(str(error))
        raise MeshError(f"the header of the .npy file cannot be read: {reason}") from None
    return shape, dtype, is_fortran, start.tell()
