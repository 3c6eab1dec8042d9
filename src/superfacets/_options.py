"""Checked arguments of `segment`, in one object per stage.

``checked`` takes arguments of `segment`, and raises an error before any work is done if one is
wrong; ``params`` are reported in the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from ._timing import OnStage
from ._validate import (
    checked_callable,
    checked_choice,
    checked_count,
    checked_flag,
    checked_number,
    checked_threads,
)

Init = Literal["geodesic", "farthest", "flood", "grid"]
INITS: tuple[str, ...] = get_args(Init)
"""Names of the methods that place seeds."""

Islands = Literal["keep", "nearest"]
ISLANDS: tuple[str, ...] = get_args(Islands)
"""Choices for cells that no center reaches, and for small regions that have no neighbor."""

Clip = Literal["x", "-x", "y", "-y", "z", "-z"]
CLIPS: tuple[str, ...] = get_args(Clip)
"""Halves of a volume that `render` can show."""

Seeds: TypeAlias = Sequence[int] | npt.NDArray[np.integer[Any]]
"""Faces that are the first centers. Not `ArrayLike`, which would accept a misspelled name."""

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class SizeOptions:
    """The number or the size of regions."""

    n_segments: int | None
    radius: float | None  # as a fraction of the diagonal of the bounding box
    seeds: Any  # None: seeds are still to be placed

    @classmethod
    def checked(cls, n_segments: int | None, radius: float | None, init: object) -> SizeOptions:
        """Raise an error if arguments contradict each other, or are wrong for any mesh."""
        if n_segments is not None and radius is not None:
            raise ValueError("give n_segments or radius, not both")
        if n_segments is not None:
            checked_count(n_segments, "n_segments")
        if radius is not None:
            radius = checked_number(radius, "radius", zero=False)
        return cls(n_segments, radius, None if isinstance(init, str) else init)


@dataclass(frozen=True)
class LoopOptions:
    """Options of the clustering loop: when it ends, and how far expansions reach."""

    max_num_iter: int
    tol: float  # as a fraction of the radius of a region
    radius_factor: float | None  # None: expansions are not limited
    islands: str
    n_threads: int
    progress: Progress | None
    on_stage: OnStage | None = None
    relocate: bool | None = False  # None: decided once the cells are known

    @classmethod
    def checked(
        cls, max_num_iter: int, tol: float, radius_factor: float | None, islands: Islands,
        n_threads: int | None, progress: Progress | None, on_stage: OnStage | None = None,
        *, relocate: bool | None = False,
    ) -> LoopOptions:  # fmt: skip
        """Return the checked options; arguments are as for `segment`."""
        if radius_factor is not None:
            radius_factor = checked_number(radius_factor, "radius_factor", zero=False)
        relocate = None if relocate is None else checked_flag(relocate, "relocate")
        if relocate and radius_factor is not None:
            raise ValueError(
                "relocate needs the shortest paths to all centers: leave radius_factor out"
            )
        return cls(
            checked_count(max_num_iter, "max_num_iter", low=0),
            checked_number(tol, "tol", zero=True),
            radius_factor,
            checked_choice(islands, "islands", ISLANDS),
            checked_threads(n_threads),
            checked_callable(progress, "progress"),
            checked_callable(on_stage, "on_stage"),
            relocate,
        )

    @property
    def params(self) -> dict[str, Any]:
        """The parameters that the result reports, by name."""
        return {
            "radius_factor": self.radius_factor,
            "max_num_iter": self.max_num_iter,
            "tol": self.tol,
            "relocate": self.relocate,
            "islands": self.islands,
        }


@dataclass(frozen=True)
class CleanupOptions:
    """Options of the clean-up of regions after the loop."""

    smooth: bool
    enforce_connectivity: bool
    min_size: float  # as a fraction of the mean area of regions
    islands: str

    @classmethod
    def checked(
        cls, smooth: bool, enforce_connectivity: bool, min_size: float, islands: Islands
    ) -> CleanupOptions:
        """Return the checked options; arguments are as for `segment`."""
        return cls(
            checked_flag(smooth, "smooth"),
            checked_flag(enforce_connectivity, "enforce_connectivity"),
            checked_number(min_size, "min_size", zero=True),
            checked_choice(islands, "islands", ISLANDS),
        )

    @property
    def is_needed(self) -> bool:
        """Whether any step of the clean-up is asked for."""
        return self.smooth or self.enforce_connectivity or self.min_size > 0

    @property
    def params(self) -> dict[str, Any]:
        """The parameters that the result reports, by name."""
        return {
            "smooth": self.smooth,
            "enforce_connectivity": self.enforce_connectivity,
            "min_size": self.min_size,
        }
