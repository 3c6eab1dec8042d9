"""Sums and majorities by label."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._types import Floats, Ints


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


def weighted_majority(
    groups: npt.NDArray[np.integer], labels: Ints, weights: Floats, n_groups: int
) -> Ints:
    """Return the label with the largest sum of weights in each group, shape (n_groups,).

    Labels are -1 and up; -1 is a label like others. Weights are finite and >= 0. Of labels with
    equal sums the lowest wins; a group without members has -1. Groups whose members agree take a
    few passes; the members of the others are sorted, O(n log n).

    Examples
    --------
    >>> groups, labels = np.array([0, 0, 0, 2, 2]), np.array([5, 3, 3, 4, 1], np.int32)
    >>> weighted_majority(groups, labels, np.array([3.0, 1, 1, 1, 1]), 3)
    array([ 5, -1,  1], dtype=int32)
    """
    winners = np.full(n_groups, -1, np.int32)
    winners[groups] = labels  # of the last member: right if all agree
    is_divided = np.zeros(n_groups, bool)
    is_divided[groups[winners[groups] != labels]] = True
    members = np.flatnonzero(is_divided[groups])
    if len(members):
        _settle(winners, groups[members], labels[members], weights[members])
    return winners


def _settle(winners: Ints, groups: npt.NDArray[np.integer], labels: Ints, weights: Floats) -> None:
    """Write the label with the most weight into `winners`, for each group that occurs."""
    span = int(labels.max()) + 2  # labels from -1 up; keys are below 2**63
    keys = groups.astype(np.int64) * span + (labels.astype(np.int64) + 1)
    pairs, pair_of_member = np.unique(keys, return_inverse=True)
    sums = np.bincount(pair_of_member, weights)
    group_of_pair, label_of_pair = np.divmod(pairs, span)
    starts = np.flatnonzero(np.diff(group_of_pair, prepend=-1))
    highest = np.maximum.reduceat(sums, starts)
    sizes = np.diff(starts, append=len(pairs))
    best = np.flatnonzero(sums == np.repeat(highest, sizes))[::-1]
    winners[group_of_pair[best]] = label_of_pair[best] - 1  # the lowest is written last
