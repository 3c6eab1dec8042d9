"""Classes for options of `segment`, grouped by stage or subject.

Arguments are checked when an object is made, before any work is done. The property ``params``,
which most classes have, returns the options as entries of `Segmentation.params`. Other classes of
options are next to the code that uses the options: `Weights` and `Features` in `weights`,
`ConstraintOptions` in `graph`, and `stages.options.SegmentOptions`, which contains all options.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from .checks import (
    checked_choice,
    checked_count,
    checked_fraction,
    checked_nonnegative_array,
    checked_number,
    checked_threads,
)
from .timing import Callback, Reports
from .types import Floats

Init = Literal["geodesic", "curve", "farthest"]
INITS: tuple[str, ...] = get_args(Init)
"""Names of the seeding methods of `segment`."""

AnyInit = Literal["geodesic", "curve", "farthest", "flood", "grid"]
ANY_INITS: tuple[str, ...] = get_args(AnyInit)
"""Names of the seeding methods of `place_seeds` and `paper.segment`."""

Islands = Literal["keep", "nearest"]
ISLANDS: tuple[str, ...] = get_args(Islands)
"""Treatment of connected components without a seed, and of small regions without a neighbor: each
of them is kept as a region, or joins the nearest region."""

Seeds: TypeAlias = Sequence[int] | npt.NDArray[np.integer[Any]]
"""Indices of seed faces. The type is not `ArrayLike`, because type checkers would then accept a
misspelled name of a seeding method."""


@dataclass(frozen=True)
class CountOptions:
    """Options for the number of regions: this number, a radius, or seeds."""

    n_segments: int | None
    radius: float | None  # expected radius of a region, in the unit of the positions
    seeds: Any  # argument `init`, but None if `init` is the name of a method

    @classmethod
    def checked(cls, n_segments: int | None, radius: float | None, init: object) -> CountOptions:
        """Check arguments of `segment`, and return them as options; `init` is checked later."""
        if n_segments is not None and radius is not None:
            raise ValueError(
                f"n_segments is {n_segments} and radius is {radius}: give only one of them"
            )
        if n_segments is not None:
            checked_count(n_segments, "n_segments")
        if radius is not None:
            radius = checked_number(radius, "radius", zero=False)
        return cls(n_segments, radius, None if init is None or isinstance(init, str) else init)


@dataclass(frozen=True)
class LoopOptions:
    """Options of the clustering loop."""

    max_num_iter: int
    tol: float  # the loop stops if the RMS move of centers is at most `tol` * r
    islands: str
    n_threads: int
    report: Reports
    radius_factor: float | None = None
    """Paths end at this multiple of r from the center; only `paper.segment` sets it."""
    relocates: bool = False
    """Whether redundant centers may move into regions with long paths."""

    @classmethod
    def checked(
        cls, max_num_iter: int, tol: float, islands: Islands, n_threads: int | None,
        callback: Callback | None,
    ) -> LoopOptions:  # fmt: skip
        """Check arguments of `segment` and return them as options."""
        if callback is not None and not callable(callback):
            raise TypeError(f"callback must be callable, got {callback!r}")
        return cls(
            checked_count(max_num_iter, "max_num_iter", low=0),
            checked_number(tol, "tol", zero=True), checked_choice(islands, "islands", ISLANDS),
            checked_threads(n_threads), Reports(callback),
        )  # fmt: skip

    @property
    def params(self) -> dict[str, Any]:
        """The entries of `Segmentation.params` for these options."""
        names = ("radius_factor", "max_num_iter", "tol", "islands", "relocates")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True, eq=False, kw_only=True)
class Sizes:
    """Sizes that regions get: balanced, between bounds, or a fixed number of cells.

    The argument `sizes` of `segment`. Either only `cells` is given, or some other parameters.

    Parameters
    ----------
    balance : float, default 0.0
        How equal the areas (volumes) of regions become, from 0 (not balanced) to 1 (equal).
    bounds : (float or None, float or None), optional
        Lowest and highest area (volume) of a region; None: no bound.
    weights : array_like of float, shape (N,), optional
        Sizes of cells, >= 0, that `balance` and `bounds` use instead of areas.
    cells : int, optional
        Exact number of cells in each region. One region of each connected component may be smaller:
        it contains the remaining cells. See `Segmentation.patches`.

    Raises
    ------
    ValueError, TypeError
        If a parameter is out of range, of the wrong type, or in conflict with another one.

    Examples
    --------
    >>> import superfacets
    >>> mesh = superfacets.sample_mesh(5_000)
    >>> result = superfacets.segment(mesh, sizes=superfacets.Sizes(cells=mesh.n_faces // 10))
    >>> result.n_segments in (10, 11)
    True
    """

    balance: float = 0.0
    bounds: tuple[float | None, float | None] = (None, None)
    weights: Any = None  # checked later by `checked_weights`
    cells: int | None = None

    def __post_init__(self) -> None:
        """Check the parameters."""
        balance = checked_fraction(self.balance, "balance")
        if not isinstance(self.bounds, (tuple, list)) or len(self.bounds) != 2:
            raise TypeError(f"bounds must be a pair (lowest, highest), got {self.bounds!r}")
        low, high = self.bounds
        low = None if low is None else checked_number(low, "bounds[0]", zero=True)
        high = None if high is None else checked_number(high, "bounds[1]", zero=False)
        if low is not None and high is not None and low > high:
            raise ValueError(f"bounds[0] must be at most bounds[1], {high:g}, got {low:g}")
        object.__setattr__(self, "balance", balance)
        object.__setattr__(self, "bounds", (low, high))
        if self.cells is not None:
            object.__setattr__(self, "cells", checked_count(self.cells, "cells"))
            given = {"balance": balance or None, "weights": self.weights}
            for name, value in (given | {"bounds": low if high is None else high}).items():
                if value is not None:
                    raise ValueError(f"Sizes(cells=...) already sets all sizes: leave {name} out")
        elif self.weights is not None and not self.is_used:
            raise ValueError(
                "Sizes.weights have no effect without balance or bounds: give one of them, or"
                " leave weights out"
            )

    @property
    def is_used(self) -> bool:
        """Whether the sizes of regions are balanced or limited."""
        return self.balance > 0 or self.bounds != (None, None) or self.cells is not None

    @property
    def limits(self) -> tuple[float, float]:
        """Minimum and maximum size of a region; 0 and infinity if there are no bounds."""
        low, high = self.bounds
        return 0.0 if low is None else low, math.inf if high is None else high

    @property
    def shown_bounds(self) -> str:
        """The bounds as the caller wrote them, for messages."""
        low, high = ("None" if bound is None else f"{bound:g}" for bound in self.bounds)
        return f"Sizes(bounds=({low}, {high}))"

    @property
    def strength(self) -> float:
        """The parameter `balance`, or 1 if `cells` is given."""
        return 1.0 if self.cells is not None else self.balance

    def check_with(self, size: CountOptions, islands: str) -> None:
        """Raise a ValueError if `cells` conflicts with other arguments of `segment`."""
        if self.cells is None:
            return
        if size.n_segments is not None or size.radius is not None or size.seeds is not None:
            raise ValueError(
                "Sizes(cells=...) already sets the number of regions: leave out n_segments and"
                " radius, and do not pass seeds as init"
            )
        if islands == "nearest":
            raise ValueError(
                "Sizes(cells=...) keeps each region in one component: leave islands='nearest' out"
            )

    def checked_weights(self, n_cells: int) -> Floats:
        """Return `weights` as (N,) float64 after checking that each is finite and >= 0."""
        threads = checked_threads(None)
        return checked_nonnegative_array(self.weights, n_cells, "Sizes.weights", "cell", threads)

    @property
    def params(self) -> dict[str, Any]:
        """The entries of `Segmentation.params` for the parameters that the caller has set."""
        given = {
            "balance": self.balance or None,
            "bounds": None if self.bounds == (None, None) else list(self.bounds),
            "size_weights": None if self.weights is None else "given",
            "cells": self.cells,
        }
        return {name: value for name, value in given.items() if value is not None}
