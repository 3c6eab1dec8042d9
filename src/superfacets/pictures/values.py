"""Numbers of cells and regions as colors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from .._types import Bytes, Floats
from .._validate import refuse_mask
from ..adapters.results import NO_COLOR
from .colors import scale_colors

_N_COLORS = 256


def checked_values(
    given: Any, name: str, n_cells: int, n_regions: int | None
) -> tuple[Floats, Literal["cell", "region"]]:
    """Finite numbers, or NaN where there is none, and what each of them is of.

    Without regions, ``n_regions`` is None.
    """
    refuse_mask(given, name)
    array = np.asarray(given)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be numbers, got {array.dtype}")
    if array.shape not in {(n_cells,), (n_regions,)}:
        regions = "" if n_regions is None else f" or per region, {n_regions}"
        raise ValueError(
            f"{name} must have a value per cell, {n_cells}{regions}, got shape {array.shape}"
        )
    values = array.astype(np.float64)
    if np.isinf(values).any():
        raise ValueError(f"{name} has infinite values; NaN stands for none")
    return values, "cell" if len(values) == n_cells else "region"


@dataclass(frozen=True)
class Scale:
    """What colors stand for: `scale_colors` from the lowest value to the highest."""

    low: float
    high: float
    title: str
    has_missing: bool

    def shares(self, values: Floats) -> Floats:
        """Where values are from the lowest, 0, to the highest, 1; 0.5 where all are one."""
        # Halves: the distance of two numbers may be more than the largest number.
        span = self.high / 2 - self.low / 2
        return (values / 2 - self.low / 2) / span if span > 0 else values * 0 + 0.5

    def colors(self, values: Floats) -> Bytes:
        """Color of each value, (N, 3); gray for NaN."""
        shares = self.shares(values)
        is_missing = np.isnan(shares)
        steps = np.where(is_missing, 0, np.rint(shares * (_N_COLORS - 1))).astype(np.int64)
        colors = scale_colors(_N_COLORS)[steps]
        colors[is_missing] = NO_COLOR
        return colors


def scale_of(values: list[Floats], title: str) -> Scale:
    """The scale of all values of several pictures; 0 to 0 where there are none."""
    everything = np.concatenate(values)
    known = everything[~np.isnan(everything)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    return Scale(low, high, title, len(known) < len(everything))
