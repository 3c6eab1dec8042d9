"""Stage 5: label regions of a mesh from masks in images of the mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from .. import _core
from .._types import Bools, Floats, Ints
from .._validate import (
    checked_choice,
    checked_classes,
    checked_flag,
    checked_regions,
    checked_share,
    checked_threads,
)
from ..adapters.convert import MeshLike, as_cells
from ..cells.sums import sums_by_label, weighted_majority
from ..errors import MeshError
from ..mesh.label_images import Overlap
from ..mesh.pinhole_camera import PinholeCamera
from .mask_votes import SeenSurface, Votes, collect_votes

MOST_PAIRS = 500_000_000
"""Largest sum over all masks of (number of regions in the mask) squared. With this sum, finding
objects takes two minutes. 100 images of a room in 10,000 regions have a tenth of this sum."""


@dataclass(frozen=True, eq=False, repr=False)
class LiftedLabels:
    """Labels of regions from masks of images: the result of `lift`.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        One label per cell: ids of masks if these are consistent, else objects 0..n-1; -1 for no
        label.
    region_labels : ndarray of int32, shape (K,)
        The same labels, one per region.
    scores : ndarray of float64, shape (K,)
        Fraction, 0 to 1, of the visible area of each region (summed over images) in masks of its
        label; 0 for regions without a label.
    label_scores : ndarray of float64, shape (len(found),)
        Like `scores`, for all regions of a label together: one fraction per label of `found`.
    mask_labels : tuple of dict
        For each image, the label of each mask id; -1 if no region has the label of the mask. Use it
        to look up classes or captions of masks by label.
    seen : ndarray of bool, shape (N,)
        Whether an image sees the cell, inside or outside masks.
    """

    labels: Ints
    region_labels: Ints
    scores: Floats
    label_scores: Floats
    mask_labels: tuple[dict[int, int], ...]
    seen: Bools

    @property
    def found(self) -> Ints:
        """The distinct labels of all regions, ascending, without -1."""
        return np.unique(self.region_labels[self.region_labels >= 0])

    def __repr__(self) -> str:
        n_images, n_regions = len(self.mask_labels), len(self.region_labels)
        return f"LiftedLabels({len(self.found)} labels, {n_regions} regions, {n_images} images)"


def lift(
    mesh: MeshLike,
    regions: npt.ArrayLike,
    masks: Iterable[Any],
    cameras: Sequence[PinholeCamera],
    *,
    consistent_ids: bool = False,
    agreement: float = 0.5,
    overlap: Overlap = "smallest",
    n_threads: int | None = None,
) -> LiftedLabels:
    """Return labels of regions and cells by a vote of masks in images.

    Each pixel votes for its mask, or for no mask, with the surface area in the pixel. A region with
    at least half of its votes in masks gets the label with the most votes. Both sides of a face are
    visible. Surface seen at an angle below 6 degrees hides other surface, but does not vote.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        As for `segment`. Cameras see the boundary of a tetrahedral mesh. Point clouds raise an
        error, because points hide nothing.
    regions : Segmentation or array_like of int, shape (N,)
        0..K-1, each at least once; -1 for cells in no region.
    masks : iterable, one item per camera
        Per image, one of: an integer array of shape (height, width) with the mask id of each pixel,
        where 0 and below mean no mask; n bool masks with ids 1 to n, shape (n, height, width); a
        list of bool masks, or of the dictionaries of SAM's mask generator.
    cameras : sequence of PinholeCamera
        From `read_cameras`, or made from poses.
    consistent_ids : bool, default False
        Whether an id has the same meaning in all images, like ids of classes or tracked objects. If
        not, regions that are often in the same mask become objects: starting from single regions,
        the two groups with the highest agreement are merged while this is at least `agreement`. The
        label of a mask is the object with the largest area in the mask.
    agreement : float, default 0.5
        Threshold, above 0 and at most 1, for ids that are not consistent. The agreement of two
        groups is the probability that a random point of each, both in masks of one image, are in
        the same mask. Higher values give more and smaller objects.
    overlap : {"smallest", "largest"}
        The mask that wins where bool masks overlap: the mask with the fewest pixels (parts) or with
        the most pixels (wholes). Ties go to the first.
    n_threads : int, optional
        As for `segment`. The result does not depend on it.

    Returns
    -------
    LiftedLabels

    Warns
    -----
    ViewWarning
        If the mesh is not visible in an image, or an image has no mask.

    Raises
    ------
    MeshError
        If the mesh is not valid, the sizes of an image and its camera differ, no camera sees the
        mesh, no mask shows a part of the mesh, or there are too many regions to find objects.
    ValueError, TypeError
        If the type or number of regions, masks, cameras or parameters is wrong.

    Notes
    -----
    Each image takes about 20 ns per triangle and 30 ns per pixel. Images are processed in parallel,
    a batch at a time, so `masks` may be a generator. Finding objects is quadratic in the number of
    regions: for 100 images of a room, 0.2 s for 2,000 regions and 10 s for 10,000.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> pose = [[1, 0, 0, 0.5], [0, -1, 0, 0.5], [0, 0, -1, 1], [0, 0, 0, 1]]  # looks down
    >>> camera = PinholeCamera(pose, (4, 4, 2, 2), (4, 4))
    >>> mask = [[7, 7, 7, 0], [7, 7, 0, 0], [7, 0, 0, 0], [0, 0, 0, 0]]
    >>> lift(square, [0, 1], [mask], [camera], consistent_ids=True).labels
    array([-1,  7], dtype=int32)
    """
    cells = as_cells(mesh)
    labels, n_regions = checked_regions(regions, cells.n_cells)
    views = _checked_cameras(cameras)
    is_consistent = checked_flag(consistent_ids, "consistent_ids")
    least = checked_share(agreement, "agreement")
    if least == 0:
        raise ValueError(
            "agreement must be above 0, because 0 would join all regions into one object"
        )
    checked_choice(overlap, "overlap", get_args(Overlap))
    surface = SeenSurface(cells, labels, checked_threads(n_threads))
    votes = collect_votes(surface, masks, views, overlap)
    label_of = votes.ids if is_consistent else _objects_of_masks(votes, n_regions, least)
    winners, won, total = _elect(votes, label_of, n_regions)
    if not is_consistent:
        label_of, winners = _without_gaps(label_of, winners)
    label_of = np.where(np.isin(label_of, winners), label_of, -1)
    by_image = _by_image(votes, label_of, len(views))
    of_cells = np.append(winners, np.int32(-1))[labels]
    scores = np.divide(won, total, out=np.zeros(n_regions), where=total > 0)
    _, ranks = np.unique(np.append(winners, np.int32(-1)), return_inverse=True)
    of_labels = np.bincount(ranks[:-1], won)[1:] / np.bincount(ranks[:-1], total)[1:]
    return LiftedLabels(of_cells, winners, scores, of_labels, by_image, votes.seen)


def project_labels(
    mesh: MeshLike,
    labels: npt.ArrayLike,
    cameras: Sequence[PinholeCamera],
    *,
    n_threads: int | None = None,
) -> list[Ints]:
    """Return images of the labels that cameras see, to check poses or to make masks.

    Parameters
    ----------
    mesh, cameras, n_threads
        As for `lift`.
    labels : array_like of int, shape (N,)
        One label per cell, >= 0, or -1 for no label.

    Returns
    -------
    list of ndarray of int32, shape (height, width)
        For each camera, the label of the nearest cell in each pixel; -1 for no label or no cell.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, or the type or number of labels or cameras is wrong.

    Examples
    --------
    >>> from superfacets import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> pose = [[1, 0, 0, 0.5], [0, -1, 0, 0.5], [0, 0, -1, 1], [0, 0, 0, 1]]  # looks down
    >>> project_labels(square, [4, 7], [PinholeCamera(pose, (3, 3, 1.5, 1.5), (3, 3))])
    [array([[7, 7, 4],
           [7, 4, 4],
           [4, 4, 4]], dtype=int32)]
    """
    cells = as_cells(mesh)
    given = checked_classes(labels, cells.n_cells, "labels")
    views = _checked_cameras(cameras)
    surface = SeenSurface(cells, given, checked_threads(n_threads))
    return [
        image.reshape(camera.size[::-1])
        for (image, _), camera in zip(surface.looked_at(views), views, strict=True)
    ]


def _checked_cameras(cameras: Any) -> list[PinholeCamera]:
    found = list(cameras)
    for place, camera in enumerate(found):
        if not isinstance(camera, PinholeCamera):
            raise TypeError(
                f"cameras[{place}] must be a PinholeCamera, got {type(camera).__name__}"
            )
    if not found:
        raise ValueError("there are no cameras")
    return found


def _objects_of_masks(votes: Votes, n_regions: int, least: float) -> Ints:
    """Return the object of each mask: the group of regions with the largest area in the mask.

    Regions with most of their visible area outside masks are ignored.
    """
    balance = np.where(votes.masks >= 0, votes.areas, -votes.areas)
    is_masked = sums_by_label(votes.regions, balance, n_regions) > 0
    chosen = np.flatnonzero((votes.masks >= 0) & is_masked[votes.regions])
    counts = np.bincount(votes.masks[chosen], minlength=1)
    if (counts**2).sum() > MOST_PAIRS:
        raise MeshError(
            f"masks show up to {counts.max()} regions each, too many to find objects: segment into"
            " fewer regions"
        )
    order = chosen[np.lexsort((votes.masks[chosen], votes.regions[chosen]))]
    masks, regions, areas = votes.masks[order], votes.regions[order], votes.areas[order]
    offsets = np.searchsorted(regions, np.arange(n_regions + 1))
    groups = _core.join_by_masks(offsets, masks, areas, votes.image_of, least)
    return weighted_majority(masks, groups[regions], areas, len(votes.ids)).winners


def _elect(votes: Votes, label_of: Ints, n_regions: int) -> tuple[Ints, Floats, Floats]:
    """Return the winning label of each region (or -1), its votes, and the votes of the region."""
    total = sums_by_label(votes.regions, votes.areas, n_regions)
    is_masked = votes.masks >= 0
    regions, areas = votes.regions[is_masked], votes.areas[is_masked]
    labels = label_of[votes.masks[is_masked]]
    winners = weighted_majority(regions, labels, areas, n_regions).winners
    winners[2 * sums_by_label(regions, areas, n_regions) < total] = -1
    is_won = (labels == winners[regions]) & (labels >= 0)
    won = sums_by_label(regions[is_won], areas[is_won], n_regions)
    return winners, won, total


def _without_gaps(label_of: Ints, winners: Ints) -> tuple[Ints, Ints]:
    """Renumber labels to 0..n-1 by their lowest regions; labels without regions become -1."""
    kept, firsts = np.unique(winners, return_index=True)
    names = np.full(max(label_of.max(), winners.max()) + 2, -1, np.int32)  # the last: -1
    order = kept[np.argsort(firsts)]
    order = order[order >= 0]
    names[order] = np.arange(len(order))
    return names[label_of], names[winners]


def _by_image(votes: Votes, label_of: Ints, n_images: int) -> tuple[dict[int, int], ...]:
    """Return, for each image, the label of each mask id."""
    ends = np.searchsorted(votes.image_of, np.arange(n_images + 1)).tolist()
    return tuple(
        dict(zip(votes.ids[a:b].tolist(), label_of[a:b].tolist(), strict=True))
        for a, b in pairwise(ends)
    )
