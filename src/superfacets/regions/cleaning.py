"""Stage 5: regions as the loop left them, made one piece each, large enough, and straight."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._validate import checked_choice, checked_number
from ..clustering.loop import Segmentation
from .regions import ISLANDS, LabeledSurface, connect_surface, merge_surface
from .smooth import MAX_DISTANCE, smooth_surface

__all__ = ["Cleaning", "clean"]


@dataclass(frozen=True)
class Cleaning:
    """Checked options of the clean-up."""

    smooth: bool
    enforce_connectivity: bool
    min_size: float  # as a fraction of the mean area of regions
    islands: str

    @classmethod
    def checked(
        cls, smooth: bool, enforce_connectivity: bool, min_size: float, islands: str
    ) -> Cleaning:
        """Arguments as for `segment`."""
        for name, value in {"smooth": smooth, "enforce_connectivity": enforce_connectivity}.items():
            if not isinstance(value, (bool, np.bool_)):
                raise TypeError(f"{name} must be True or False, got {value!r}")
        return cls(
            bool(smooth),
            bool(enforce_connectivity),
            checked_number(min_size, "min_size", zero=True),
            checked_choice(islands, "islands", ISLANDS),
        )

    @property
    def is_needed(self) -> bool:
        """Whether there is anything to do."""
        return self.smooth or self.enforce_connectivity or self.min_size > 0

    @property
    def params(self) -> dict[str, Any]:
        """As they are reported."""
        return {
            "smooth": self.smooth,
            "enforce_connectivity": self.enforce_connectivity,
            "min_size": self.min_size,
            "islands": self.islands,
        }


def clean(surface: LabeledSurface, result: Segmentation, cleaning: Cleaning) -> Segmentation:
    """Return the result with its regions cleaned up; `surface` holds its labels."""
    if cleaning.enforce_connectivity:
        edit = connect_surface(surface, result.centers)
        # Paths lead from its center to each face of a region, so its pieces are in one component.
        assert not edit.n_islands
        result = replace(result, labels=edit.labels, n_joined=edit.n_joined)
        surface = surface.relabeled(edit.labels)
    if cleaning.min_size > 0:
        edit = merge_surface(surface, cleaning.min_size, cleaning.islands)
        result = replace(
            result,
            labels=edit.labels,
            centers=result.centers[edit.sources],
            n_merged=edit.n_joined,
            n_islands=edit.n_islands,
        )
        surface = surface.relabeled(edit.labels)
    if cleaning.smooth:
        labels = smooth_surface(surface, result.centers, MAX_DISTANCE)
        result = replace(result, labels=labels)
    return result
