"""Writing a mesh with its labels, or labels alone, so that the file appears whole or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._validate import refuse_mask
from ...adapters.convert import as_mesh
from ...mesh.triangle_mesh import Mesh
from ..atomic import StrPath, atomic_outputs, checked_targets
from ..guards import known_ending
from ..readers.labels import checked_labels
from .ply import write_ply

__all__ = ["check_outputs", "write_labels", "write_mesh", "write_outputs"]

MESH_OUTPUTS = (".ply",)
LABEL_OUTPUTS = (".npy", ".seg", ".txt")

LABELS_AT_ONCE = 1 << 16
"""Labels turned into text at a time."""


def write_mesh(
    path: StrPath,
    mesh: Any,
    labels: npt.ArrayLike | None = None,
    *,
    colors: npt.ArrayLike | None = None,
    ascii: bool = False,
) -> None:
    """Write a mesh, with labels and colors of its faces, as PLY.

    Vertices are ``float`` where that is exact for every coordinate, else ``double``. Faces are
    ``list uchar int vertex_indices``; labels add ``int label`` and ``float quality`` (the same,
    exact below 2**24, for MeshLab); labels or colors add ``uchar red green blue alpha``.

    Parameters
    ----------
    path : path-like
        Ends in ``.ply``. A file there is replaced once all is written, and keeps its permissions.
    mesh : Mesh, or what `as_mesh` accepts
    labels : array_like of integers, shape (F,), optional
        0 and up.
    colors : array_like of uint8, shape (F, 3), optional
        Red, green, blue. With labels and no colors, those of `face_colors`.
    ascii : bool, default False
        Text instead of binary little-endian, for readers that need it.

    Raises
    ------
    ValueError
        If the ending, a shape or a dtype is wrong, or a label is negative.
    OSError
        If the file cannot be written.

    Notes
    -----
    Linear in V + F; the file is made in memory.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.ply")
    ...     write_mesh(path, square, colors=[[255, 0, 0], [0, 0, 255]], ascii=True)
    ...     print(path.read_text().splitlines()[-1])
    3 0 2 3 0 0 255 255
    """
    known_ending(Path(path), MESH_OUTPUTS)
    mesh = as_mesh(mesh)
    face_labels = None if labels is None else checked_labels(labels, mesh.n_faces)
    face_colors = _checked_colors(colors, mesh, face_labels)
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        write_ply(file, mesh, face_labels, face_colors, ascii=ascii)


def write_labels(path: StrPath, labels: npt.ArrayLike) -> None:
    r"""Write one label per face, in face order.

    Parameters
    ----------
    path : path-like
        Ends in ``.npy`` (int32), or in ``.seg`` or ``.txt`` (one integer per line, no header). A
        file there is replaced once all is written, and keeps its permissions.
    labels : array_like of integers, shape (F,)
        0 and up.

    Raises
    ------
    ValueError
        If the ending, the shape or the dtype is wrong, or a label is negative.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.seg")
    ...     write_labels(path, [0, 1])
    ...     path.read_text()
    '0\n1\n'
    """
    ending = known_ending(Path(path), LABEL_OUTPUTS)
    face_labels = checked_labels(labels)
    with atomic_outputs([path]) as (temporary,):
        _write_labels_to(temporary, ending, face_labels)


def write_outputs(
    paths: Sequence[StrPath],
    mesh: Any,
    labels: npt.ArrayLike,
    *,
    ascii: bool = False,
    listed: npt.ArrayLike | None = None,
) -> None:
    """Write several files, each by its ending, such that all appear, or none.

    Parameters
    ----------
    paths : sequence of path-like
        ``.ply`` for the mesh with labels, see `write_mesh`; ``.npy``, ``.seg`` and ``.txt`` for the
        labels alone, see `write_labels`.
    mesh : Mesh, or what `as_mesh` accepts
    labels : array_like of integers, shape (F,)
        0 and up.
    ascii : bool, default False
        Whether PLY is text.
    listed : array_like of integers, optional
        Labels for the files of labels alone, 0 and up, where these are of another mesh.

    Raises
    ------
    ValueError
        If an ending, a shape or a dtype is wrong, a label is negative, or a file is given twice.
    OSError
        If a file cannot be written.
    """
    endings = [known_ending(Path(path), MESH_OUTPUTS + LABEL_OUTPUTS) for path in paths]
    mesh = as_mesh(mesh)
    face_labels = checked_labels(labels, mesh.n_faces)
    listed_labels = face_labels if listed is None else checked_labels(listed)
    has_mesh = any(ending in MESH_OUTPUTS for ending in endings)
    face_colors = _checked_colors(None, mesh, face_labels) if has_mesh else None
    with atomic_outputs(paths) as temporaries:
        for temporary, ending in zip(temporaries, endings, strict=True):
            if ending in LABEL_OUTPUTS:
                _write_labels_to(temporary, ending, listed_labels)
                continue
            with temporary.open("wb") as file:
                write_ply(file, mesh, face_labels, face_colors, ascii=ascii)


def check_outputs(paths: Sequence[StrPath]) -> None:
    """Find out before the long work whether `write_outputs` could write these files.

    Raises
    ------
    ValueError
        If an ending is not one of those that `write_outputs` knows, or a file is given twice.
    OSError
        If a folder does not exist or is not writable, or something other than a file is there.
    """
    for path in paths:
        known_ending(Path(path), MESH_OUTPUTS + LABEL_OUTPUTS)
    checked_targets(paths)


def _checked_colors(
    colors: Any, mesh: Mesh, labels: npt.NDArray[np.int32] | None
) -> npt.NDArray[np.uint8] | None:
    """The colors as given, or those of the labels, or None where there are neither."""
    if colors is None:
        if labels is None:
            return None
        from ...view.colors import face_colors

        return face_colors(mesh, labels)
    refuse_mask(colors, "colors")
    array = np.asarray(colors)
    if array.shape != (mesh.n_faces, 3):
        raise ValueError(f"colors must have shape ({mesh.n_faces}, 3), got {array.shape}")
    if array.dtype.kind not in "iu" or array.min() < 0 or array.max() > 255:
        raise ValueError("colors must be integers from 0 to 255")
    return array.astype(np.uint8)


def _write_labels_to(path: Path, ending: str, labels: npt.NDArray[np.int32]) -> None:
    if ending == ".npy":
        with path.open("wb") as file:
            np.save(file, labels, allow_pickle=False)
    else:
        with path.open("wb") as file:
            for begin in range(0, len(labels), LABELS_AT_ONCE):
                part = labels[begin : begin + LABELS_AT_ONCE].tolist()
                file.write(b"%d\n" * len(part) % tuple(part))
