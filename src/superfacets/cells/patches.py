"""Cells by region, in an order along the surface."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Ints
from .surface import Surface


def patches_of(surface: Surface, labels: Ints, n_regions: int) -> Ints:
    """Return the cells of each region in the order of a walk, padded with -1; labels may be -1."""
    cells = _core.walk_regions(
        surface.offsets, surface.neighbors, labels, n_regions, surface.n_threads
    )
    counts = np.bincount(labels[labels >= 0], minlength=n_regions)
    patches = np.full((n_regions, int(counts.max(initial=0))), -1, np.int32)
    patches[np.arange(patches.shape[1]) < counts[:, None]] = cells
    return patches
