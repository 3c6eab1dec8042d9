"""Meshes from files and from standard input."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from ..io.attributes import MeshAttributes
from ..io.guards import Content, known_ending, read_content
from ..io.readers.labels import has_labels, read_labels
from ..io.readers.npy import npy_array
from ..io.readers.read import cell_ending, parse_cells_and_attributes, recognized_ending
from ..mesh.cells import Cells
from .options import STANDARD_STREAM

__all__ = [
    "VALUE_ENDINGS",
    "check_inputs",
    "labels_beside",
    "load_cells",
    "load_cells_and_attributes",
    "name_of",
    "read_values",
]

VALUE_ENDINGS = (".npy", ".txt")


def check_inputs(inputs: tuple[str, ...]) -> None:
    """Raise a usage error if inputs cannot be combined, or one is not a file name."""
    for text in inputs:
        if text != STANDARD_STREAM and not Path(text).name:
            raise click.UsageError(f"{text or repr(text)} is not a file")
    if STANDARD_STREAM in inputs and len(inputs) > 1:
        raise click.UsageError("standard input (-) has to be the only input")


def name_of(text: str) -> str:
    """What messages call an input."""
    return "standard input" if text == STANDARD_STREAM else text


def load_cells(text: str, format: str | None) -> Cells:
    """The mesh or the cloud of a file, or of standard input for ``-``.

    Its format is the one given, or that of the file's ending, or that of the content.
    """
    return load_cells_and_attributes(text, format, keep=False)[0]


def load_cells_and_attributes(
    text: str, format: str | None, *, keep: bool = True
) -> tuple[Cells, MeshAttributes | None]:
    """What `load_cells` returns, and the attributes of a PLY or a cloud if they are to be kept."""
    data, ending, folder = _content(text, None if format is None else f".{format}")
    try:
        return parse_cells_and_attributes(data, ending, folder, keep=keep)
    except MeshError as error:
        raise MeshError(f"{name_of(text)}: {error}") from None


def labels_beside(
    mesh: Path, labels: Path | None, n_cells: int, name: str
) -> npt.NDArray[np.int32] | None:
    """The labels of a file, or those that the file of the mesh holds; None if there are neither.

    The name is that of the labels in files that hold more.
    """
    if labels is None and not has_labels(mesh, name=name):
        return None
    return read_labels(labels or mesh, n_cells, name=name)


def _content(text: str, ending: str | None) -> tuple[Content, str, Path | None]:
    """Bytes, the ending that tells their format, and the folder that they lie in."""
    if text != STANDARD_STREAM:
        path = Path(text)
        return read_content(path), ending or cell_ending(path), path.parent
    if sys.stdin is None:
        raise OSError("standard input is closed")
    data = sys.stdin.buffer.read()
    if not data:
        raise MeshError("standard input is empty")
    ending = ending or recognized_ending(data)
    if ending is None:
        raise MeshError("standard input is of no known format: name it with --format")
    return data, ending, None


def read_values(path: Path) -> npt.NDArray[Any]:
    """The numbers in a file, one per cell or region."""
    ending = known_ending(path, VALUE_ENDINGS)
    data = read_content(path)
    try:
        if ending == ".npy":
            return npy_array(data, "values")
        return np.array(bytes(data).split(), dtype=np.float64)
    except ValueError as error:
        raise MeshError(f"{path}: {error}") from None
