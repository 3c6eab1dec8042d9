"""Classes for options of `segment`, grouped by stage or subject.

The method ``checked`` of each class validates arguments before any work is done. The property
``params``, which most classes have, returns the options as entries of `Segmentation.params`. Other
classes of options are next to the code that uses the options: `WeightOptions` and `FeatureOptions`
in `weights`, `ConstraintOptions` in `graph`, and `stages.options.SegmentOptions`, which contains
all options.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from .checks import (
    checked_callable,
    checked_choice,
    checked_count,
    checked_flag,
    checked_fraction,
    checked_number,
    checked_threads,
    exact_doubles,
    refuse_first,
    refuse_mask,
)
from .timing import OnStage
from .types import Floats

Init = Literal["geodesic", "curve", "farthest", "flood", "grid"]
INITS: tuple[str, ...] = get_args(Init)
"""Names of the seeding methods."""

Islands = Literal["keep", "nearest"]
ISLANDS: tuple[str, ...] = get_args(Islands)
"""Treatment of connected components without a seed, and of small regions without a neighbor: each
of them is kept as a region, or joins the nearest region."""

Seeds: TypeAlias = Sequence[int] | npt.NDArray[np.integer[Any]]
"""Indices of seed faces. The type is not `ArrayLike`, because type checkers would then accept a
misspelled name of a seeding method."""

Progress = Callable[[int, int], object]
"""Function that is called after each iteration with (iteration number, number of moved centers). If
it returns False, the loop stops."""


@dataclass(frozen=True)
class SizeOptions:
    """Options for the number of regions, or for their size."""

    n_segments: int | None
    radius: float | None  # radius of a region, as a fraction of the bounding box diagonal
    expected_radius: float | None  # radius of a region, in the unit of the positions
    seeds: Any  # argument `init`, but None if `init` is the name of a method

    @classmethod
    def checked(
        cls, n_segments: int | None, radius: float | None, expected_radius: float | None,
        init: object,
    ) -> SizeOptions:  # fmt: skip
        """Check arguments of `segment`, and return them as options; `init` is checked later."""
        sizes = {"n_segments": n_segments, "radius": radius, "expected_radius": expected_radius}
        given = [f"{name} is {value}" for name, value in sizes.items() if value is not None]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)}: give only one of them")
        if n_segments is not None:
            checked_count(n_segments, "n_segments")
        if radius is not None:
            radius = checked_number(radius, "radius", zero=False)
        if expected_radius is not None:
            expected_radius = checked_number(expected_radius, "expected_radius", zero=False)
        seeds = None if init is None or isinstance(init, str) else init
        return cls(n_segments, radius, expected_radius, seeds)

    @property
    def has_radius(self) -> bool:
        """Whether the caller gave the radius of regions."""
        return self.radius is not None or self.expected_radius is not None

    def radius_in(self, diagonal: float) -> float | None:
        """Return the given radius in the unit of the positions, or None if no radius was given."""
        return self.expected_radius if self.radius is None else self.radius * diagonal


@dataclass(frozen=True)
class LoopOptions:
    """Options of the clustering loop."""

    max_num_iter: int
    tol: float  # the loop stops if the RMS move of centers is at most `tol` * r
    radius_factor: float | None  # paths end at this multiple of r from the center; None: no limit
    islands: str
    n_threads: int
    progress: Progress | None
    on_stage: OnStage | None = None
    relocate: bool | None = False  # None: `segment` chooses the default later

    @classmethod
    def checked(
        cls, max_num_iter: int, tol: float, radius_factor: float | None, islands: Islands,
        n_threads: int | None, progress: Progress | None, on_stage: OnStage | None = None,
        *, relocate: bool | None = False,
    ) -> LoopOptions:  # fmt: skip
        """Check arguments of `segment` and return them as options."""
        if radius_factor is not None:
            radius_factor = checked_number(radius_factor, "radius_factor", zero=False)
        relocate = None if relocate is None else checked_flag(relocate, "relocate")
        if relocate and radius_factor is not None:
            raise ValueError(
                "relocate=True cannot be combined with radius_factor, which limits the paths from"
                " centers: leave one of them out"
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
        """The entries of `Segmentation.params` for these options."""
        names = ("radius_factor", "max_num_iter", "tol", "relocate", "islands")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True)
class BalanceOptions:
    """Options for the sizes of regions."""

    balance: float = 0.0
    max_measure: float | None = None
    min_measure: float | None = None
    cells_per_region: int | None = None
    cell_weights: Any = None  # size of each cell, checked later by `checked_cell_weights`

    @classmethod
    def checked(
        cls, balance: float, bounds: tuple[float | None, float | None],
        cells_per_region: int | None, cell_weights: Any,
    ) -> BalanceOptions:  # fmt: skip
        """Check arguments of `segment`, and return them as options.

        `bounds` is the pair (`min_measure`, `max_measure`).
        """
        low, high = bounds
        balance = checked_fraction(balance, "balance")
        low = None if low is None else checked_number(low, "min_measure", zero=True)
        high = None if high is None else checked_number(high, "max_measure", zero=False)
        if low is not None and high is not None and low > high:
            raise ValueError(f"min_measure must be at most max_measure, {high:g}, got {low:g}")
        if cells_per_region is not None:
            cells_per_region = checked_count(cells_per_region, "cells_per_region")
            given = {"balance": balance or None, "min_measure": low, "max_measure": high}
            for name, value in (given | {"cell_weights": cell_weights}).items():
                if value is not None:
                    raise ValueError(f"cells_per_region already sets all sizes: leave {name} out")
        options = cls(balance, high, low, cells_per_region, cell_weights)
        if cell_weights is not None and not options.is_used:
            raise ValueError(
                "cell_weights have no effect without balance, max_measure or min_measure: give one"
                " of these parameters, or leave cell_weights out"
            )
        return options

    def check_with(self, size: SizeOptions, loop: LoopOptions, min_size: float) -> None:
        """Raise a ValueError if these options conflict with `size`, `loop` or `min_size`."""
        if not self.is_used:
            return
        name = next(iter(self.params))
        if loop.radius_factor is not None:
            raise ValueError(
                f"{name} cannot be combined with radius_factor, which limits the paths from"
                " centers: leave one of them out"
            )
        if min_size > 0:
            raise ValueError(f"{name} sets the sizes of regions: leave min_size out")
        if self.cells_per_region is None:
            return
        if size.n_segments is not None or size.has_radius or size.seeds is not None:
            raise ValueError(
                "cells_per_region already sets the number of regions: leave out n_segments, radius"
                " and expected_radius, and do not pass seeds as init"
            )
        if loop.islands == "nearest":
            raise ValueError(
                "cells_per_region keeps each region in one component: leave islands='nearest' out"
            )

    @property
    def is_used(self) -> bool:
        """Whether any option limits or balances the sizes of regions."""
        bounds = (self.max_measure, self.min_measure, self.cells_per_region)
        return self.balance > 0 or any(bound is not None for bound in bounds)

    @property
    def bounds(self) -> tuple[float, float]:
        """Minimum and maximum size of a region; 0 and infinity if there are no limits."""
        low, high = self.min_measure, self.max_measure
        return 0.0 if low is None else low, math.inf if high is None else high

    @property
    def strength(self) -> float:
        """The option `balance`, or 1 if `cells_per_region` is given."""
        return 1.0 if self.cells_per_region is not None else self.balance

    def checked_cell_weights(self, n_cells: int) -> Floats:
        """Return `cell_weights` as (N,) float64 after checking that each is finite and >= 0."""
        refuse_mask(self.cell_weights, "cell_weights")
        given = np.asarray(self.cell_weights)
        if given.dtype.kind not in "iufb":
            raise TypeError(f"cell_weights must contain numbers, got {given.dtype}")
        if given.shape != (n_cells,):
            raise ValueError(f"cell_weights must have shape ({n_cells},), got {given.shape}")
        array = exact_doubles(given)
        is_wrong = ~(np.isfinite(array) & (array >= 0))
        refuse_first(is_wrong, "cell_weights", given, "finite and not negative")
        return array

    @property
    def params(self) -> dict[str, Any]:
        """The entries of `Segmentation.params` for the options that the caller has set."""
        given = {
            "balance": self.balance or None,
            "max_measure": self.max_measure,
            "min_measure": self.min_measure,
            "cells_per_region": self.cells_per_region,
            "cell_weights": None if self.cell_weights is None else "given",
        }
        return {name: value for name, value in given.items() if value is not None}


@dataclass(frozen=True)
class CleanupOptions:
    """Options of the clean-up of regions after the loop."""

    smooth: bool
    enforce_connectivity: bool
    min_size: float  # regions smaller than this fraction of the mean area are merged
    islands: str

    @classmethod
    def checked(
        cls, smooth: bool, enforce_connectivity: bool, min_size: float, islands: Islands
    ) -> CleanupOptions:
        """Check arguments of `segment`, and return them as options."""
        return cls(
            checked_flag(smooth, "smooth"),
            checked_flag(enforce_connectivity, "enforce_connectivity"),
            checked_number(min_size, "min_size", zero=True),
            checked_choice(islands, "islands", ISLANDS),
        )

    @property
    def is_needed(self) -> bool:
        """Whether any step of the clean-up is requested."""
        return self.smooth or self.enforce_connectivity or self.min_size > 0

    @property
    def params(self) -> dict[str, Any]:
        """The entries of `Segmentation.params` for these options."""
        names = ("smooth", "enforce_connectivity", "min_size")
        return {name: getattr(self, name) for name in names}
