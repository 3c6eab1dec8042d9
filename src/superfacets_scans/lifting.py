"""Stage 5: label regions by votes of masks in images of the mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args

import numpy as np
import numpy.typing as npt

from superfacets import MeshError
from superfacets.kit import (
    Array,
    Bools,
    Floats,
    Ints,
    MaskedAreas,
    MeshLike,
    as_cells,
    checked_choice,
    checked_classes,
    checked_flag,
    checked_number,
    checked_threads,
    counted,
    of_cells,
    ranked_labels,
    sums_by_label,
    weighted_majority,
)

from .label_images import Overlap
from .mask_votes import SeenSurface, Votes, collect_votes
from .pinhole_camera import PinholeCamera

MAX_PAIRS = 500_000_000
"""Maximum of the sum, over all masks, of the squared number of regions in the mask.
At the maximum, it takes two minutes to find objects. For 100 images of a room with 10,000 regions,
the sum is 50 million."""


@dataclass(frozen=True, eq=False, repr=False)
class LiftedLabels:
    """Result of `superfacets.lift`: labels of regions and cells.

    Attributes
    ----------
    labels : ndarray of int32, shape (N,)
        Label of each cell, or -1 for cells without a label. With ``consistent_ids=True``, labels
        are mask ids. Otherwise, each label is the index of an object, from 0 to n - 1.
    region_labels : ndarray of int32, shape (K,)
        Label of each region, or -1 for regions without a label.
    scores : ndarray of float64, shape (K,)
        Fraction, 0 to 1, of the visible area of each region that is in masks with the label of the
        region. Areas are summed over all images. The score of a region without a label is 0.
    label_scores : ndarray of float64, shape (len(found),)
        For each label in `found`, the same fraction for the union of the regions with this label.
    mask_labels : tuple of dict
        For each image, a dict from mask ids to labels. The label is -1 if no region has the label
        of the mask. Use the dicts to find the classes or captions that belong to labels.
    seen : ndarray of bool, shape (N,)
        Whether each cell is visible in at least one image, inside or outside masks.
    """

    labels: Ints
    region_labels: Ints
    scores: Floats
    label_scores: Floats
    mask_labels: tuple[dict[int, int], ...]
    seen: Bools

    @property
    def found(self) -> Ints:
        """Distinct labels of all regions in ascending order, without -1."""
        return np.unique(self.region_labels[self.region_labels >= 0])

    def of_segments(self, segments: Ints, names: Array) -> tuple[Ints, Ints]:
        """Return the label of each vertex, and of each distinct segment in ascending order.

        `names` is the segment of each region. Segments without a face have no region, and get -1.
        """
        ranks, distinct = ranked_labels(segments)
        labels = np.full(len(distinct), -1, np.int32)
        labels[np.searchsorted(distinct, names)] = self.region_labels
        return np.append(labels, np.int32(-1))[ranks], labels

    def __repr__(self) -> str:
        labels, regions = (
            counted(len(self.found), "label"),
            counted(len(self.region_labels), "region"),
        )
        return f"LiftedLabels({labels}, {regions}, {counted(len(self.mask_labels), 'image')})"


def lift(
    mesh: MeshLike,
    labels: npt.ArrayLike,
    masks: Iterable[Any],
    cameras: Sequence[PinholeCamera],
    *,
    consistent_ids: bool = False,
    agreement: float = 0.5,
    overlap: Overlap = "smallest",
    n_threads: int | None = None,
) -> LiftedLabels:
    """Label regions and cells by majority votes of masks in images.

    Each pixel that shows a region adds one vote to the region: for the mask at this pixel, or for
    no mask. The weight of the vote is the surface area in the pixel. If at least half of the votes
    of a region are for masks, the region gets the label with the most votes. Both sides of a face
    are visible. A pixel has no vote if the angle between its line of sight and the surface is below
    6 degrees.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        Same as in `segment`. Only the boundary of a tetrahedral mesh is visible. Point clouds are
        not supported, because points do not hide each other.
    labels : Segmentation, or array_like of int, shape (N,) or (V,)
        Labels of the cells of K regions. Each label from 0 to K - 1 must occur; -1 marks cells in
        no region. For superpoints, labels of the vertices, which may have gaps: region i has the
        i-th lowest label >= 0. If N = V, labels belong to cells.
    masks : iterable, one item per camera
        Masks of each image, in one of these forms:

        - An integer array of shape (height, width) with the mask id of each pixel, where values
          below 1 mean no mask.
        - A bool array of shape (n, height, width), whose masks get the ids 1 to n.
        - A list of bool masks, or of the dictionaries from the mask generator of SAM.
    cameras : sequence of PinholeCamera
        Camera of each image, for example from `read_cameras`.
    consistent_ids : bool, default False
        Whether an id has the same meaning in all images, like ids of classes or tracked objects. If
        not, regions that are often in the same mask are grouped into objects. At first, each region
        is a group. Then the two groups with the highest agreement are merged, as long as the value
        is at least `agreement`. The label of a mask is the object with the largest area in it.
    agreement : float, default 0.5
        Minimum agreement of merged groups, above 0 and at most 1, if ids are not consistent. The
        agreement of two groups is the probability that two random points, one of each group, are in
        the same mask if both are in masks of the same image. Higher values give smaller objects.
    overlap : {"smallest", "largest"}
        Which mask is used where bool masks overlap: the mask with the fewest pixels (parts of
        objects), or the mask with the most pixels (whole objects). Of masks with equal numbers of
        pixels, the first is used.
    n_threads : int, optional
        Same as in `segment`. The result does not depend on the number of threads.

    Returns
    -------
    LiftedLabels

    Warns
    -----
    ViewWarning
        If the mesh is not visible in an image, or if an image has no masks.

    Raises
    ------
    MeshError
        If the mesh is not valid, if the sizes of an image and its camera differ, if no camera sees
        the mesh, if no mask shows a part of the mesh, or if there are too many regions to find
        objects.
    ValueError, TypeError
        If the type or number of labels, masks, cameras or parameters is wrong.

    Notes
    -----
    Each image takes about 20 ns per triangle and 30 ns per pixel. The images of a batch are
    processed in parallel. The masks are read one after the other, so `masks` may be a generator.
    The time to find objects is quadratic in the number of regions: for 100 images of a room, 0.2 s
    with 2,000 regions and 10 s with 10,000 regions.

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
    of_regions, n_regions = _labels_of_regions(cells, labels)
    views = _checked_cameras(cameras)
    is_consistent = checked_flag(consistent_ids, "consistent_ids")
    least = checked_number(agreement, "agreement", zero=True)
    if least > 1:
        raise ValueError(f"agreement must be from 0 to 1, got {least}")
    if least == 0:
        raise ValueError(
            "agreement must be above 0, got 0: all regions would be merged into one object"
        )
    checked_choice(overlap, "overlap", get_args(Overlap))
    surface = SeenSurface(cells, of_regions, checked_threads(n_threads))
    votes = collect_votes(surface, masks, views, overlap)
    label_of = votes.ids if is_consistent else _objects_of_masks(votes, n_regions, least)
    winners, won, total = _elect(votes, label_of, n_regions)
    if not is_consistent:
        label_of, winners = _without_gaps(label_of, winners)
    label_of = np.where(np.isin(label_of, winners), label_of, -1)
    by_image = _by_image(votes, label_of, len(views))
    of_cells = np.append(winners, np.int32(-1))[of_regions]
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
    """Return an image of labels for each camera, to check poses or to make masks.

    Parameters
    ----------
    mesh, cameras, n_threads
        Same as in `lift`.
    labels : array_like of int, shape (N,)
        Label of each cell, >= 0, or -1 for cells without a label.

    Returns
    -------
    list of ndarray of int32, shape (height, width)
        Image of each camera, with the label of the cell visible in each pixel. A pixel is -1 if
        the cell has no label or if no cell is visible.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, or if the type or number of labels or cameras is wrong.

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
    n_vertices = getattr(cells, "n_vertices", None)
    given = checked_classes(labels, cells.n_cells, "labels", n_vertices=n_vertices)
    views = _checked_cameras(cameras)
    surface = SeenSurface(cells, given, checked_threads(n_threads))
    return [
        image.reshape(camera.size[::-1])
        for (image, _), camera in zip(surface.visible_regions(views), views, strict=True)
    ]


def _labels_of_regions(cells: Any, labels: Any) -> tuple[Ints, int]:
    """Return the region of each cell, from 0 or -1, and the number of regions."""
    n_vertices: Any = getattr(cells, "n_vertices", None)
    are_of_cells = n_vertices == cells.n_cells or np.shape(labels) != (n_vertices,)
    n, noun = (cells.n_cells, "cell") if are_of_cells else (n_vertices, "vertex")
    given = checked_classes(labels, n, "labels", noun, n_vertices=n_vertices)
    ranks, names = ranked_labels(given)
    if not len(names):
        raise ValueError("labels must contain at least one region, but all labels are -1")
    if not are_of_cells:
        return of_cells(ranks, cells).astype(np.int32), len(names)
    if names[-1] >= n:
        first = int(np.argmax(given >= n))
        cells_of = counted(n, "cell")
        raise ValueError(
            f"labels[{first}] must be -1 to {n - 1} for {cells_of}, got {given[first]}"
        )
    if names[-1] >= len(names):
        missing = int(np.argmax(names != np.arange(len(names))))
        raise ValueError(
            f"labels must be consecutive integers from 0, but no cell has label {missing}:"
            " renumber them with np.unique(labels, return_inverse=True)[1]"
            f"{' - 1' if given.min() < 0 else ''}"
        )
    return ranks, len(names)


def _checked_cameras(cameras: Any) -> list[PinholeCamera]:
    found = list(cameras)
    for i, camera in enumerate(found):
        if not isinstance(camera, PinholeCamera):
            raise TypeError(f"cameras[{i}] must be a PinholeCamera, got {type(camera).__name__}")
    if not found:
        raise ValueError("cameras must contain at least one camera, but it is empty")
    return found


def _objects_of_masks(votes: Votes, n_regions: int, least: float) -> Ints:
    """Group regions that are often in the same masks; return the largest group of each mask.

    Regions mostly outside masks are ignored. `least` is the minimum agreement of groups.
    """
    balance = np.where(votes.masks >= 0, votes.areas, -votes.areas)
    is_masked = sums_by_label(votes.regions, balance, n_regions) > 0
    chosen = np.flatnonzero((votes.masks >= 0) & is_masked[votes.regions])
    counts = np.bincount(votes.masks[chosen], minlength=1)
    if (counts**2).sum() > MAX_PAIRS:
        raise MeshError(
            f"masks contain up to {counts.max()} regions, which is too many to find objects: make"
            " fewer regions, or use consistent_ids=True if possible"
        )
    masks, regions, areas = votes.masks[chosen], votes.regions[chosen], votes.areas[chosen]
    groups = MaskedAreas(regions, masks, areas, votes.image_of).groups(n_regions, least)
    return weighted_majority(masks, groups[regions], areas, len(votes.ids)).winners


def _elect(votes: Votes, label_of: Ints, n_regions: int) -> tuple[Ints, Floats, Floats]:
    """Return, for each region, its label, the area of the votes for it, and the area of all votes.

    If less than half of the votes are for masks, the label is -1 and the first area is 0.
    """
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
    """Renumber labels of masks and regions by their lowest regions; -1 for labels of no region."""
    kept, firsts = np.unique(winners, return_index=True)
    names = np.full(max(label_of.max(), winners.max()) + 2, -1, np.int32)  # names[-1] is -1
    order = kept[np.argsort(firsts)]
    order = order[order >= 0]
    names[order] = np.arange(len(order))
    return names[label_of], names[winners]


def _by_image(votes: Votes, label_of: Ints, n_images: int) -> tuple[dict[int, int], ...]:
    ends = np.searchsorted(votes.image_of, np.arange(n_images + 1)).tolist()
    return tuple(
        dict(zip(votes.ids[a:b].tolist(), label_of[a:b].tolist(), strict=True))
        for a, b in pairwise(ends)
    )
