"""The label that most of a group has, by weight."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._types import Floats, Ints

__all__ = ["weighted_majority"]


def weighted_majority(
    groups: npt.NDArray[np.integer], labels: Ints, weights: Floats, n_groups: int
) -> Ints:
    """Return the label with the largest sum of weights in each group.

    Parameters
    ----------
    groups : ndarray of int, shape (n,)
        The group of each voter, 0 to n_groups - 1.
    labels : ndarray of int32, shape (n,)
        -1 and up: -1 is a label like others.
    weights : ndarray of float64, shape (n,)
        Finite, >= 0; added in the order given.
    n_groups : int

    Returns
    -------
    ndarray of int32, shape (n_groups,)
        The lowest of labels with equal sums, 0 included; -1 of a group without voters.

    Notes
    -----
    Groups that agree take a few passes; the voters of the others are sorted, O(n log n).

    Examples
    --------
    >>> groups, labels = np.array([0, 0, 0, 2, 2]), np.array([5, 3, 3, 4, 1], np.int32)
    >>> weighted_majority(groups, labels, np.array([3.0, 1, 1, 1, 1]), 3)
    array([ 5, -1,  1], dtype=int32)
    """
    winners = np.full(n_groups, -1, np.int32)
    winners[groups] = labels  # of the last voter, which is right where all agree
    is_divided = np.zeros(n_groups, bool)
    is_divided[groups[winners[groups] != labels]] = True
    voters = np.flatnonzero(is_divided[groups])
    if len(voters):
        _settle(winners, groups[voters], labels[voters], weights[voters])
    return winners


def _settle(winners: Ints, groups: npt.NDArray[np.integer], labels: Ints, weights: Floats) -> None:
    """Write the label with the most weight into `winners`, for each group that occurs."""
    span = int(labels.max()) + 2  # labels from -1 up; both factors are below 2**31
    keys = groups.astype(np.int64) * span + (labels.astype(np.int64) + 1)
    pairs, pair_of_voter = np.unique(keys, return_inverse=True)
    sums = np.bincount(pair_of_voter, weights)
    group_of_pair, label_of_pair = np.divmod(pairs, span)
    starts = np.flatnonzero(np.diff(group_of_pair, prepend=-1))
    highest = np.maximum.reduceat(sums, starts)
    sizes = np.diff(starts, append=len(pairs))
    best = np.flatnonzero(sums == np.repeat(highest, sizes))[::-1]
    winners[group_of_pair[best]] = label_of_pair[best] - 1  # the last one written is the lowest
