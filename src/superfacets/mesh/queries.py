"""Check the query points and the maximum distance of searches for nearest cells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.checks import (
    VALUE_RANGE,
    checked_number,
    exact_doubles,
    refuse_infinite,
    rows_of_three,
)
from ..base.errors import MeshError
from ..base.types import Floats
from .convert import as_cloud


def checked_distance(max_distance: Any) -> float:
    """Return `max_distance` as float; infinity for None. Raise an error if it is not valid."""
    if max_distance is None:
        return math.inf
    return checked_number(max_distance, "max_distance", zero=True)


def query_points(points: Any) -> Floats:
    """Return the positions (M, 3) of query points; `points` is an array or a cloud.

    Raises a MeshError if a point is not valid.
    """
    if not isinstance(points, (np.ndarray, list, tuple)):
        points = as_cloud(points).points
    array = exact_doubles(rows_of_three(points, "points"))
    refuse_infinite(array, "points")
    largest = float(np.abs(array).max(initial=0.0))
    if largest > VALUE_RANGE[1]:
        raise MeshError(
            f"coordinates of points must be at most {VALUE_RANGE[1]:g}, got {largest:.3g}: rescale"
            " the points"
        )
    return array
