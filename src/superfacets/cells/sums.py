"""Sums of areas and lengths by label."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._types import Floats

__all__ = ["positive_total", "sums_by_label"]


def positive_total(areas: Floats) -> float:
    """Sum of areas; a ValueError if it is 0."""
    total = float(areas.sum())
    if not total > 0:
        raise ValueError("there is no area to measure by")
    return total


def sums_by_label(labels: npt.NDArray[np.integer], values: Floats, n_labels: int) -> Floats:
    """Sum of the values of each label, shape (n_labels,)."""
    sums = np.bincount(labels, weights=values, minlength=n_labels)
    return np.asarray(sums, dtype=np.float64)
