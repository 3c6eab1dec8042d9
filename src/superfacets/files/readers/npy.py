"""Read arrays from NPY files, and from NPZ files, which are ZIP archives of NPY files."""

from __future__ import annotations

import io
import json
import math
import re
from typing import Any

import numpy as np

from ...base.checks import counted
from ...base.errors import MeshError
from ...base.text import shortened
from ...base.types import Array
from ..guards import BinaryReader, Content, most_bytes_of

MAX_NPY_HEADER = 10_000
"""Maximum length of the header text in bytes, the same as in NumPy. The usual length is 60."""

_SIZES = {b"\1\0": "H", b"\2\0": "I", b"\3\0": "I"}
"""Type of the length of the header, for each version of the format."""

_AS_JSON = {ord("'"): '"', ord("("): "[", ord(")"): "]"}
_NOT_JSON = re.compile(r"(?<=\d)L|,(?=\s*[\]}])")
"""Matches text that JSON does not allow: a comma before a closing bracket, and L after digits."""


def npy_array(data: Content, what: str = "numbers") -> Array:
    """Return the array of a .npy file. Readers of labels, values and masks use it.

    numpy.load allocates the memory that the header declares, even if the header is damaged. This
    function first checks that the declared size matches the file. Pickled arrays of objects are
    refused.
    """
    shape, dtype, is_fortran, begin = npy_header(data)
    if dtype.hasobject:
        raise MeshError(f"expected an array of numbers: the .npy header declares {dtype}")
    n_bytes = math.prod(shape) * dtype.itemsize
    if n_bytes != len(data) - begin or min(shape, default=0) < 0:
        raise MeshError(
            f"the .npy header declares {counted(n_bytes, 'byte')} of {what}, but is followed by"
            f" {len(data) - begin}: the file may be truncated or damaged"
        )
    return np.frombuffer(data, dtype, offset=begin).reshape(shape, order="F" if is_fortran else "C")


def npz_array(data: Content, name: str) -> Array:
    """Return one array of a .npz file; damage raises a MeshError, KeyError, or a zip error."""
    import zipfile  # slow to import

    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entry = archive.getinfo(f"{name}.npy")
        if entry.file_size > most_bytes_of(len(data)):
            raise MeshError(f"{name} declares {entry.file_size} bytes, too many for the file size")
        return npy_array(archive.read(entry))


def npy_header(data: Content) -> tuple[tuple[int, ...], np.dtype[Any], bool, int]:
    """Return shape, dtype, whether the array is in Fortran order, and the offset of its data."""
    reader = BinaryReader(data, begin=8)
    try:
        if data[:6] != b"\x93NUMPY" or data[6:8] not in _SIZES:
            raise ValueError("expected the magic bytes \\x93NUMPY and version 1.0, 2.0 or 3.0")
        (size,) = reader.take(_SIZES[data[6:8]])
        if size > MAX_NPY_HEADER:
            raise ValueError(f"its length must be at most {MAX_NPY_HEADER} bytes, got {size}")
        (text,) = reader.take(f"{size}s")
        return *_parsed(text.decode("latin-1")), reader.at
    except (ValueError, TypeError, RecursionError, SyntaxError) as error:
        why = shortened(str(error))
        raise MeshError(f"the header of the .npy file cannot be read: {why}") from None


def _parsed(text: str) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
    """Parse the header, a dict, as JSON, because `ast.literal_eval` is not thread-safe."""
    plain = text.translate(_AS_JSON).replace("True", "true").replace("False", "false")
    match json.loads(_NOT_JSON.sub("", plain)):
        case {"descr": str(kind), "fortran_order": bool(is_fortran), "shape": [*shape], **others}:
            are_integers = all(type(side) is int for side in shape)
            if are_integers and not others and "," not in kind:  # a comma means a structured type
                return tuple(shape), np.dtype(kind), is_fortran
    expected = "expected descr, a type such as '<i4', fortran_order, and shape, a tuple of integers"
    raise ValueError(f"{expected}, got {text.strip()}")
