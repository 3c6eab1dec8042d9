"""One label per face: read from a file, and checked."""

from __future__ import annotations

import io
import math
import os
import reprlib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from numpy.lib import format as npy

from ..._validate import refuse_mask
from ...errors import MeshError
from ..guards import Content, counted, known_ending, read_content
from .ply import read_ply_labels
from .ply_header import parse_header
from .tets import TET_ENDINGS, has_tet_labels, read_tet_labels
from .text import split_lines
from .vtp import has_vtp_labels, read_vtp_labels

__all__ = ["LABEL_ENDINGS", "checked_labels", "has_labels", "npy_array", "read_labels"]

MAX_LABEL = 2**31 - 1
"""Labels are int32."""

NO_REGION = -1
"""The label of cells that are in no region."""

MAX_NPY_HEADER = 10_000
"""Bytes of text, numpy's own bound; labels need some 60. It is evaluated, so it must be short."""

_NPY_FIXED = 12
"""The bytes before that text: magic, version and the length of the text."""


def read_labels(path: str | os.PathLike[str], n_faces: int | None = None) -> npt.NDArray[np.int32]:
    r"""Return the label of each face, in face order, that a file holds.

    Parameters
    ----------
    path : path-like
        The ending, in any case, tells the format: ``.npy`` (one-dimensional, any integer type),
        ``.seg`` and ``.txt`` (one integer per line, no header), ``.ply`` (integer face property
        ``label``; the faces may be polygons; where there are none, of the vertices), ``.vtp``,
        ``.vtu``, ``.vtk``, ``.msh`` and ``.mesh`` (integer cell data ``label``; they need the extra
        ``io``).
    n_faces : int, optional
        Faces of the mesh that the labels are for; checked where given.

    Returns
    -------
    ndarray, shape (F,), int32
        Labels from 0 up, and -1 where a face is in no region. They need not be contiguous.

    Raises
    ------
    MeshError
        If the file is empty, cut or damaged, if a label is no integer or below -1, if there are not
        `n_faces` labels, or if the ending is unknown. One line that begins with the path.
    OSError
        If there is no such file, or it cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.seg")
    ...     _ = path.write_text("0\n1\n")
    ...     read_labels(path, n_faces=2)
    array([0, 1], dtype=int32)
    """
    path = Path(path)
    ending = known_ending(path, LABEL_ENDINGS)
    data = read_content(path)
    try:
        if ending in TET_ENDINGS:
            return checked_labels(read_tet_labels(data, ending), n_faces)
        return checked_labels(_READERS[ending](data), n_faces)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def has_labels(path: str | os.PathLike[str]) -> bool:
    """Whether a mesh file has labels of its faces: a property ``label`` of a PLY or VTP."""
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in _LABEL_FINDERS and ending not in TET_ENDINGS:
        return False
    data = read_content(path)
    try:
        if ending in TET_ENDINGS:
            return has_tet_labels(data, ending)
        return _LABEL_FINDERS[ending](data)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def _has_ply_labels(data: Content) -> bool:
    header = parse_header(data)
    place = header.find("face")
    if place is None or not header.elements[place].n_rows:
        place = header.find("vertex")
    return place is not None and header.elements[place].find("label") is not None


def checked_labels(labels: Any, n_faces: int | None = None) -> npt.NDArray[np.int32]:
    """Labels as a contiguous (F,) int32 array; a MeshError if they are not one >= -1 per face."""
    refuse_mask(labels, "labels", MeshError)
    array = np.asarray(labels)
    if array.ndim != 1:
        raise MeshError(f"labels must be one-dimensional, got shape {array.shape}")
    if not len(array):
        raise MeshError("there are no labels")
    if array.dtype.kind not in "iu":
        raise MeshError(f"labels must be integers, got {array.dtype}")
    if n_faces is not None and len(array) != n_faces:
        raise MeshError(
            f"there are {counted(len(array), 'label')} but the mesh has {counted(n_faces, 'face')}"
        )
    if array.min() < NO_REGION or array.max() > MAX_LABEL:
        first = int(np.argmax((array < NO_REGION) | (array > MAX_LABEL)))
        raise MeshError(f"labels[{first}] is {array[first]}; it must be {NO_REGION} to {MAX_LABEL}")
    return np.ascontiguousarray(array, dtype=np.int32)


def _read_text(data: Content) -> npt.NDArray[Any]:
    lines = split_lines(data)
    crowded = np.flatnonzero(lines.counts != 1)
    if len(crowded):
        line = int(crowded[0])
        shown = reprlib.repr(lines.content(line).decode("latin-1").strip())
        raise MeshError(f"line {lines.number(line)}: expected one integer, got {shown}")
    return lines.parse(np.int64)


def _read_npy(data: Content) -> npt.NDArray[Any]:
    shape, dtype, _, _ = _npy_header(data)
    if dtype.kind not in "iu":
        raise MeshError(f"labels must be integers: the .npy header declares {dtype}")
    if len(shape) != 1:
        raise MeshError(f"labels must be one-dimensional: the .npy header declares {list(shape)}")
    return npy_array(data, "labels")


def npy_array(data: Content, what: str = "numbers") -> npt.NDArray[Any]:
    """The array of a .npy file.

    numpy.load would take the memory that a damaged header claims, and would run what a pickle
    holds: only the header is left to numpy, and compared with the size of the file.
    """
    shape, dtype, is_fortran, begin = _npy_header(data)
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


def _npy_header(data: Content) -> tuple[tuple[int, ...], np.dtype[Any], bool, int]:
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


_READERS: dict[str, Callable[[Content], npt.NDArray[Any]]] = {
    ".npy": _read_npy,
    ".ply": read_ply_labels,
    ".seg": _read_text,
    ".txt": _read_text,
    ".vtp": read_vtp_labels,
}

_LABEL_FINDERS: dict[str, Callable[[Content], bool]] = {
    ".ply": _has_ply_labels,
    ".vtp": has_vtp_labels,
}

LABEL_ENDINGS = (*_READERS, *TET_ENDINGS)
