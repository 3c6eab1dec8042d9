"""Columns of a table in the scratch folder: arrays of equal length, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..scratch import Scratch

__all__ = ["Columns", "joined_columns", "load_columns", "save_columns", "taken"]

Columns = dict[str, npt.NDArray[Any]]
"""Arrays of equal length."""


def save_columns(scratch: Scratch, folder: str, columns: Columns) -> None:
    """Write all columns."""
    for name, column in columns.items():
        scratch.save(f"{folder}/{name}", column)


def load_columns(
    scratch: Scratch, folder: str, names: Sequence[str], begin: int = 0, end: int | None = None
) -> Columns:
    """Rows of the columns of these names that there are."""
    found = [name for name in names if scratch.has(f"{folder}/{name}")]
    return {name: scratch.load(f"{folder}/{name}", begin, end) for name in found}


def joined_columns(parts: Sequence[Columns]) -> Columns:
    """The rows of all parts, one after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def taken(columns: Columns, chosen: npt.NDArray[Any]) -> Columns:
    """Some rows, in this order."""
    return {name: column[chosen] for name, column in columns.items()}
