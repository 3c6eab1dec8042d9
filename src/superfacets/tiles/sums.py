"""Sums that come in pieces, with the bits of the sum of all."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core
from .store import RANGE

__all__ = ["BlockedSum"]


class BlockedSum:
    """What the core's ``sum_of`` returns for an array of which pieces are added in order.

    It adds partial sums of blocks of 4096 values (``kSumBlock``), whatever the number of threads.
    """

    BLOCK = RANGE

    def __init__(self) -> None:
        self._total = 0.0
        self._rest = np.empty(0)

    def add(self, values: npt.NDArray[np.float64]) -> None:
        """Add the next values, any number of them."""
        values = np.concatenate([self._rest, values])
        n_whole = len(values) // self.BLOCK * self.BLOCK
        for first in range(0, n_whole, self.BLOCK):
            self._total += _core.sum_of(values[first : first + self.BLOCK], 1)
        self._rest = values[n_whole:]

    @property
    def total(self) -> float:
        """The sum so far."""
        return self._total + _core.sum_of(self._rest, 1) if len(self._rest) else self._total
