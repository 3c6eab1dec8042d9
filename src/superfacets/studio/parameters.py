"""What can be set of the regions, and in which bounds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .._validate import checked_count, checked_flag, checked_number
from ..cells.size import DEFAULT_N_SEGMENTS
from ..cells.weights import WEIGHTS

MAX_REGIONS = 20_000
"""To which the slider goes; painting by hundreds of thousands of regions is no help."""

MAX_ALPHA, MAX_RIDGES = 100.0, 1.0

Parameters = dict[str, Any]


def default_parameters(n_cells: int, n_segments: int | None = None) -> Parameters:
    """Those that `segment` has, with a number of regions if one is asked for."""
    n = DEFAULT_N_SEGMENTS if n_segments is None else n_segments
    weights = {name: WEIGHTS["creases"].defaults[name] for name in ("alpha", "ridges")}
    return {"n_segments": min(n, n_cells), **weights, "smooth": True, "level": None}


def ranges(n_cells: int) -> dict[str, list[float]]:
    """The lowest and highest value of each slider."""
    return {
        "n_segments": [1, min(n_cells, MAX_REGIONS)],
        "alpha": [0.0, MAX_ALPHA],
        "ridges": [0.0, MAX_RIDGES],
    }


def checked_parameters(given: Mapping[str, Any], usual: Parameters, n_cells: int) -> Parameters:
    """Parameters as a client sends them, with those that it leaves out as they are now.

    A level that is as fine as the finest is none.

    Raises
    ------
    ValueError, TypeError
        If one is unknown, out of range or of the wrong type.
    """
    unknown = sorted(set(given) - set(usual))
    if unknown:
        raise ValueError(f"there is no parameter {unknown[0]}")
    merged = {**usual, **given}
    if "level" not in given and given.get("n_segments") not in (None, usual["n_segments"]):
        merged["level"] = None  # it was one of other regions
    n_segments = checked_count(merged["n_segments"], "n_segments", n_cells, "cells")
    level = merged["level"]
    if level is not None:
        level = checked_count(level, "level", n_segments, "regions on the finest level")
    return {
        "n_segments": n_segments,
        "alpha": checked_number(merged["alpha"], "alpha", zero=True),
        "ridges": checked_number(merged["ridges"], "ridges", zero=True),
        "smooth": checked_flag(merged["smooth"], "smooth"),
        "level": None if level == n_segments else level,
    }
