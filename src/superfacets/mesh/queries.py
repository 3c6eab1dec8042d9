"""Check the query points and the maximum distance of searches for nearest cells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.checks import checked_number, checked_queries
from ..base.types import Floats
from .convert import as_cloud


def checked_distance(max_distance: Any) -> float:
    """Return `max_distance` as float; infinity for None. Raise an error if it is not valid."""
    if max_distance is None:
        return math.inf
    return checked_number(max_distance, "max_distance", zero=True)


def query_points(points: Any) -> Floats:
    """Return the positions (M, 3) of query points. `points` is an array or a cloud."""
    if isinstance(points, (np.ndarray, list, tuple)):
        return checked_queries(points)
    return checked_queries(as_cloud(points).points)
