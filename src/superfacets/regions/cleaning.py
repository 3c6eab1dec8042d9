"""Stage 5: regions as the loop left them, made one piece each, large enough, and straight."""

from __future__ import annotations

from dataclasses import replace

from .._options import CleanupOptions
from .._types import Ints
from ..cells.constraints import NO_GROUPS
from ..clustering.segmentation import Segmentation
from .connect import connect_regions
from .edit import BorderCosts
from .merge import merge_regions
from .smooth import MAX_DISTANCE, straighten


def clean(
    costs: BorderCosts,
    result: Segmentation,
    options: CleanupOptions,
    groups: Ints = NO_GROUPS,
    max_distance: float = MAX_DISTANCE,
) -> Segmentation:
    """Return the result with its regions cleaned up; those of different groups never join.

    Borders move by no more than the distance, in radii.
    """
    if options.enforce_connectivity:
        edit = connect_regions(costs, result.labels, result.n_segments, result.centers)
        # Pieces that touch no other region are islands that had joined this one: so they stay.
        labels = edit.sources[edit.labels]
        result = replace(result, labels=labels, n_joined=edit.n_joined)
    if options.min_size > 0:
        edit = merge_regions(
            costs, result.labels, result.n_segments, options.min_size, options.islands, groups
        )
        result = replace(
            result,
            labels=edit.labels,
            centers=result.centers[edit.sources],
            n_merged=edit.n_joined,
            n_islands=edit.n_islands,
        )
    if options.smooth:
        labels = straighten(costs, result.labels, result.centers, max_distance)
        result = replace(result, labels=labels)
    return result
