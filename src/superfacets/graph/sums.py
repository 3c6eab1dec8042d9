"""Sum values that have the same label, and find the label with the largest sum of weights."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..base.checks import exact_array
from ..base.types import Bools, Floats, Ints


def positive_total(areas: Floats) -> float:
    """Return the sum of the areas of cells; raise a ValueError if the sum is not positive."""
    total = float(areas.sum())
    if not total > 0:
        raise ValueError("the total area must be positive, but all cells have area 0")
    return total


def sums_by_label(labels: npt.NDArray[np.integer], values: Floats, n_labels: int) -> Floats:
    """Return the sum of the values with each label, (n_labels,), for example areas of regions."""
    return np.asarray(np.bincount(labels, weights=values, minlength=n_labels), dtype=np.float64)


class Majority(NamedTuple):
    """Result of `weighted_majority`: two arrays with one entry per group."""

    winners: Ints  # label with the largest sum of weights, or -1 if the group has no members
    is_divided: Bools  # whether the members of the group have different labels


def weighted_majority(
    groups: npt.NDArray[np.integer], labels: Ints, weights: Floats, n_groups: int
) -> Majority:
    """Return, for each group, the label with the largest sum of weights: a vote of its members.

    `groups`, `labels` (>= -1) and `weights` (finite and >= 0) have one entry per member: its group,
    its label and its weight. The label -1 is treated like any other label. If several labels have
    equal sums, the lowest of these labels wins. Time is linear in the number of groups and members.

    Examples
    --------
    >>> groups, labels = np.array([0, 0, 0, 2, 2]), np.array([5, 3, 3, 4, 1], np.int32)
    >>> weighted_majority(groups, labels, np.array([3.0, 1, 1, 1, 1]), 3).winners
    array([ 5, -1,  1], dtype=int32)
    """
    winners, is_divided = _core.weighted_majority(
        exact_array(groups, np.int32), labels, exact_array(weights, np.float64), n_groups
    )
    return Majority(winners, is_divided.view(bool))
