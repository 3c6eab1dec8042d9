"""Faces that are left out, and barriers, from files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..io.readers.labels import read_labels
from .options import FILE

__all__ = ["constraint_options", "constraints_of"]

_OPTIONS = (
    click.option(
        "--mask",
        metavar="FILE",
        type=FILE,
        help="Leave faces or points out where this .npy, .seg or .txt holds 0: they get label -1.",
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


def constraints_of(mask: Path | None, barriers: Path | None, n_cells: int) -> dict[str, Any]:
    """The keywords of `segment` that the files stand for."""
    keywords: dict[str, Any] = {}
    if mask is not None:
        keywords["mask"] = read_labels(mask, n_cells) != 0
    if barriers is not None:
        keywords["barriers"] = read_labels(barriers, n_cells)
    return keywords
