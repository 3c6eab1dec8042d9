"""Stage 5: join regions that are visible in the same masks of images."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .. import _core
from ..base.types import Floats, Ints


class MaskedAreas(NamedTuple):
    """Visible areas of regions in masks of images. Apps that group regions into objects use it."""

    regions: Ints  # (A,) region of each area, from 0
    masks: Ints  # (A,) mask of each area, as an index into `image_of`
    areas: Floats  # (A,) area of the region that is visible in the mask, > 0
    image_of: Ints  # (M,) image of each mask, in ascending order

    def groups(self, n_regions: int, least: float) -> Ints:
        """Return the group of each region, (n_regions,), numbered by their lowest regions.

        At first, each region is a group. Then the two groups with the highest agreement are joined,
        while it is at least `least` > 0. Agreement is the probability that two random points, one
        of each group and both in masks of the same image, are in the same mask.
        """
        for found, n in ((self.regions, n_regions), (self.masks, len(self.image_of))):
            if len(found) != len(self.areas) or not np.all((found >= 0) & (found < n)):
                raise ValueError(f"each area must have a region and a mask, with indices below {n}")
        order = np.lexsort((self.masks, self.regions))
        offsets = np.searchsorted(self.regions[order], np.arange(n_regions + 1))
        return _core.join_by_masks(
            offsets, self.masks[order], self.areas[order], self.image_of, least
        )
