"""Faces that are left out, and barriers, from files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from ..export.ids import VERTEX_OUTPUTS
from ..io.guards import known_ending, read_content
from ..io.readers.labels import LABEL_ENDINGS, checked_labels, read_labels
from ..io.readers.npy import npy_array
from .options import FILE

_OPTIONS = (
    click.option(
        "--mask",
        metavar="FILE",
        type=FILE,
        help="Leave faces or points out where this .npy, .seg or .txt, or the labels in a .ply or"
        " another file that holds more, are 0 (or False): they get label -1.",
    ),
    click.option(
        "--barriers",
        metavar="FILE",
        type=FILE,
        help="One whole number per face or point, as a file of labels: no region has different"
        " ones.",
    ),
)


def constraint_options(command: Any) -> Any:
    """Give a command the options ``--mask`` and ``--barriers``."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def check_mask(mask: Path | None, endings: Iterable[str]) -> None:
    """Raise a usage error if what a mask leaves out has no place in a file with these endings."""
    refusing = sorted({*endings} & {*VERTEX_OUTPUTS})
    if mask is not None and refusing:
        raise click.UsageError(
            f"ids in {refusing[0]} are 0 and up, and what --mask leaves out has none: leave one out"
        )


def constraints_of(
    mask: Path | None, barriers: Path | None, n_cells: int, name: str
) -> dict[str, Any]:
    """The keywords of `segment` that the files stand for; the name is as for `read_labels`."""
    keywords: dict[str, Any] = {}
    if mask is not None:
        keywords["mask"] = _read_mask(mask, n_cells, name)
    if barriers is not None:
        keywords["barriers"] = read_labels(barriers, n_cells, name=name)
    return keywords


def _read_mask(path: Path, n_cells: int, name: str) -> npt.NDArray[np.bool_]:
    """Whether each cell is kept: not 0 in a file of labels, or True in a .npy."""
    if known_ending(path, LABEL_ENDINGS) != ".npy":
        return np.asarray(read_labels(path, n_cells, name=name) != 0)
    data = read_content(path)
    try:
        values = npy_array(data, "labels")
        if values.dtype == bool:
            values = values.view(np.uint8)
        return np.asarray(checked_labels(values, n_cells) != 0)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
