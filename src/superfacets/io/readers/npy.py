"""NPY: one array. NPZ: a ZIP archive of arrays by name.

Headers are parsed here and not by numpy, which uses `ast`: threads that use `ast` at the same time
can fail with a SystemError in CPython 3.11 and early 3.12.
"""

from __future__ import annotations

import io
import math
import re
import reprlib
import zipfile
from typing import Any, Literal

import numpy as np

from ..._types import Array
from ...errors import MeshError
from ..guards import Content

MAX_NPY_HEADER = 10_000
"""NumPy's limit of the header's text, in bytes. Headers of labels have about 60."""

_MAGIC = b"\x93NUMPY"

_SIZE_BYTES = {1: 2, 2: 4, 3: 4}
"""Bytes of the header's length field, by version of the format."""

_FIELD = re.compile(
    r"\s*(['\"])(?P<key>descr|fortran_order|shape)\1\s*:"
    r"\s*(?P<value>'[^']*'|\"[^\"]*\"|\[.*\]|True|False|\([^()]*\))\s*(?:,\s*|(?=\}))",
    re.DOTALL,
)

_TYPE = re.compile(r"['\"]([<>|=]?[A-Za-z]\d{0,9}(?:\[\w+\])?)['\"]")

_COUNT = re.compile(r"-?\d{1,19}")

_SHAPE = re.compile(r"\(\s*(?:(?:N,\s*)+(?:N)?)?\)".replace("N", r"-?\d{1,19}L?\s*"))
"""A tuple of integers; Python 2 wrote them as ``3L``."""


def npy_array(data: Content, what: str = "numbers") -> Array:
    """The array of a .npy file.

    numpy.load would allocate the memory that a damaged header claims. Here the size that the header
    declares must be the size of the file, and arrays of objects, which are pickled, are refused.
    """
    shape, dtype, is_fortran, begin = npy_header(data)
    if dtype.hasobject:
        raise MeshError(f"expected an array of numbers: the .npy header declares {dtype}")
    n_bytes = math.prod(shape) * dtype.itemsize
    if n_bytes != len(data) - begin:
        raise MeshError(
            f"the .npy header declares {n_bytes} bytes of {what} but"
            f" {len(data) - begin} follow: the file may be truncated"
        )
    order: Literal["F", "C"] = "F" if is_fortran else "C"
    return np.frombuffer(data, dtype=dtype, offset=begin).reshape(shape, order=order)


def npz_array(data: Content, name: str) -> Array:
    """Return one array of a .npz file by name.

    A damaged archive raises errors of zipfile, of zlib, a KeyError or a MeshError.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return npy_array(archive.read(f"{name}.npy"))


def npy_header(data: Content) -> tuple[tuple[int, ...], np.dtype[Any], bool, int]:
    """Shape, type, whether the order is Fortran's, and offset of the data of a .npy file."""
    try:
        text, begin = _text_of(data)
        return *_parsed(text), begin
    except ValueError as error:
        raise MeshError(f"the header of the .npy file cannot be read: {error}") from None


def _text_of(data: Content) -> tuple[str, int]:
    """The text of the header, and its end offset."""
    if bytes(data[: len(_MAGIC)]) != _MAGIC:
        raise ValueError(f"expected it to begin with {_MAGIC!r}")
    version = bytes(data[6:8])
    if len(version) < 2 or version[0] not in _SIZE_BYTES or version[1]:
        raise ValueError(f"its version is {list(version)}; expected [1, 0], [2, 0] or [3, 0]")
    begin = 8 + _SIZE_BYTES[version[0]]
    size = int.from_bytes(data[8:begin], "little")
    if size > MAX_NPY_HEADER:
        raise ValueError(f"it has {size} bytes; expected at most {MAX_NPY_HEADER}")
    if len(data) < begin + size:
        raise ValueError(f"the file ends after {len(data)} bytes, within the header")
    return bytes(data[begin : begin + size]).decode("latin-1"), begin + size


def _parsed(text: str) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    """Parse the header, a literal of a Python dictionary, without `eval` or `ast`."""
    fields, at = dict[str, str](), 1
    inner = text.strip()
    while found := _FIELD.match(inner, at):
        fields[found["key"]] = found["value"]
        at = found.end()
    if inner[:1] + inner[at:] != "{}" or len(fields) != 3:
        raise ValueError(f"expected descr, fortran_order and shape, got {reprlib.repr(inner)}")
    shape, order = fields["shape"], fields["fortran_order"]
    if not _SHAPE.fullmatch(shape):
        raise ValueError(f"its shape is {reprlib.repr(shape)}; expected a tuple of integers")
    if order not in ("True", "False"):
        raise ValueError(f"its fortran_order is {reprlib.repr(order)}; expected True or False")
    return tuple(map(int, _COUNT.findall(shape))), _type_of(fields["descr"]), order == "True"


def _type_of(value: str) -> np.dtype[Any]:
    """Parse the type, a string. Structured types, which are lists, are refused."""
    found = _TYPE.fullmatch(value)
    if found is None:
        raise ValueError(f"its type is {reprlib.repr(value)}; expected a number, as '<i4'")
    try:
        return np.dtype(found[1])
    except TypeError:
        raise ValueError(f"numpy knows no type {value}") from None
