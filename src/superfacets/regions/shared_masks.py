"""Stage 5: join regions that are visible in the same masks of images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.types import Floats, Ints


class MaskedAreas(NamedTuple):
    """Visible areas of regions in masks of images: a table with a row per region and mask."""

    regions: Ints  # (A,) region of each row, from 0
    masks: Ints  # (A,) mask of each row, as an index into `image_of`
    areas: Floats  # (A,) area of the region that is visible in the mask, > 0
    image_of: Ints  # (M,) image of each mask, ascending

    def groups(self, n_regions: int, least: float) -> Ints:
        """Return the group of each region, (n_regions,), after joining regions of the same masks.

        At first, each region is a group. The two groups with the highest agreement are joined as
        long as it is at least `least`, > 0. The agreement is the probability that two random
        points, one of each group and both in masks of the same image, are in the same mask. Groups
        are numbered in the order of their lowest regions. Apps group regions to objects with it.
        Raises a ValueError if arrays differ in length or have an index out of range.
        """
        order = np.lexsort((self.masks, self.regions))
        regions, masks = self.regions[order], self.masks[order]
        for name, found, n in (("regions", regions, n_regions), ("masks", masks, self.n_masks)):
            if len(found) != len(self.areas) or not np.all((found >= 0) & (found < n)):
                raise ValueError(f"{name} must have one index below {n} per area")
        offsets = np.searchsorted(regions, np.arange(n_regions + 1))
        return _core.join_by_masks(offsets, masks, self.areas[order], self.image_of, least)

    @property
    def n_masks(self) -> int:
        """Number of masks, M."""
        return len(self.image_of)
