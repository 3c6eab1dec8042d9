"""One label per face: read from a file, and checked."""

from __future__ import annotations

import os
import re
import reprlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._validate import refuse_mask
from ...errors import MeshError
from ..guards import Content, counted, known_ending, read_content
from .ply import read_ply_labels
from .ply_header import parse_header
from .text import split_lines

__all__ = ["LABEL_ENDINGS", "checked_labels", "has_labels", "read_labels"]

MAX_LABEL = 2**31 - 1
"""Labels are int32."""


def read_labels(path: str | os.PathLike[str], n_faces: int | None = None) -> npt.NDArray[np.int32]:
    r"""Return the label of each face, in face order, that a file holds.

    Parameters
    ----------
    path : path-like
        The ending, in any case, tells the format: ``.npy`` (one-dimensional, any integer type),
        ``.seg`` and ``.txt`` (one integer per line, no header), ``.ply`` (integer face property
        ``label``; the faces may be polygons).
    n_faces : int, optional
        Faces of the mesh that the labels are for; checked where given.

    Returns
    -------
    ndarray, shape (F,), int32
        Labels from 0 up. They need not be contiguous.

    Raises
    ------
    MeshError
        If the file is empty, cut or damaged, if a label is no integer or below 0, if there are not
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
        return checked_labels(_READERS[ending](data), n_faces)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None


def has_labels(path: str | os.PathLike[str]) -> bool:
    """Whether a mesh file declares labels of its faces: a PLY with the face property ``label``."""
    path = Path(path)
    if path.suffix.lower() != ".ply":
        return False
    try:
        header = parse_header(read_content(path))
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    face = header.find("face")
    return face is not None and header.elements[face].find("label") is not None


def checked_labels(labels: Any, n_faces: int | None = None) -> npt.NDArray[np.int32]:
    """Labels as a contiguous (F,) int32 array; a MeshError if they are not one >= 0 per face."""
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
    if array.min() < 0 or array.max() > MAX_LABEL:
        first = int(np.argmax((array < 0) | (array > MAX_LABEL)))
        raise MeshError(f"labels[{first}] is {array[first]}; it must be 0 to {MAX_LABEL}")
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
    """The array of a .npy file.

    numpy.load is not used: it evaluates the header as Python, with a dozen ways to fail or warn,
    and takes the memory that a damaged header claims.
    """
    header, begin = _npy_header(data)
    kind = re.search(r"'descr': *'([<>|=]?)([iu])([1248])'", header)
    if kind is None:
        raise MeshError(f"labels must be integers: the .npy header is {reprlib.repr(header)}")
    shape = re.search(r"'shape': *\( *(\d{1,18})L?, *\)", header)
    if shape is None:
        raise MeshError(
            f"labels must be one-dimensional: the .npy header is {reprlib.repr(header)}"
        )
    dtype = np.dtype("".join(kind.groups()))
    n_labels = int(shape[1])
    if n_labels * dtype.itemsize != len(data) - begin:
        raise MeshError(
            f"the .npy header declares {n_labels * dtype.itemsize} bytes of labels but"
            f" {len(data) - begin} follow: is the file cut?"
        )
    return np.frombuffer(data, dtype=dtype, offset=begin)


def _npy_header(data: Content) -> tuple[str, int]:
    """The header's text, and where the numbers begin."""
    if data[:6] != b"\x93NUMPY":
        raise MeshError("not a .npy file: it does not begin with the word NUMPY")
    size_width = 2 if data[6:7] == b"\x01" else 4  # of version 1, and of versions 2 and 3
    text_begin = 8 + size_width
    begin = text_begin + int.from_bytes(data[8:text_begin], "little")
    if begin > len(data):
        raise MeshError("the header of the .npy file is cut")
    return data[text_begin:begin].decode("latin-1"), begin


_READERS: dict[str, Callable[[Content], npt.NDArray[Any]]] = {
    ".npy": _read_npy,
    ".ply": read_ply_labels,
    ".seg": _read_text,
    ".txt": _read_text,
}

LABEL_ENDINGS = tuple(_READERS)
