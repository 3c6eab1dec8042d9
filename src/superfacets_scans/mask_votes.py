"""Compute votes of image masks for regions: the visible area of each region in each mask."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError
from superfacets.kit import (
    Array,
    Bools,
    Floats,
    Ints,
    counted,
    kind_of,
    named_errors,
    ranked_labels,
    sums_by_label,
)

from .label_images import NO_MASK, Overlap, label_image
from .pinhole_camera import PinholeCamera

MAX_PIXELS = 1 << 23
"""Maximum number of pixels in a batch of images (but see `MIN_IMAGES`). Each pixel takes about 30
bytes."""

MIN_IMAGES = 8
"""Maximum number of images in a batch with more than `MAX_PIXELS` pixels. In such a batch, each
thread processes one image."""


class ViewWarning(UserWarning):
    """Some images are not used, because they have no masks or their cameras see no region."""


class Votes(NamedTuple):
    """Table of visible areas of regions in each mask, and outside the masks of each image."""

    masks: Ints  # (A,) mask of each entry, as an index into `ids`; -1 for an area in no mask
    regions: Ints  # (A,) region of each entry
    areas: Floats  # (A,) area of the region visible in the mask, > 0, in squared units of the mesh
    image_of: Ints  # (M,) image index of each mask, ascending
    ids: Ints  # (M,) id of each mask in its image, >= 1
    seen: Bools  # (N,) whether each cell is visible in at least one image


class SeenSurface:
    """Labeled surface of a mesh, cut into triangles, with a record of the cells seen by cameras."""

    def __init__(self, cells: Any, labels: Ints, n_threads: int) -> None:
        drawn = kind_of(cells).drawn_faces(cells)
        if drawn is None:
            raise TypeError(
                f"masks need a mesh, got {kind_of(cells).plural}, which have no surface: lift the"
                " masks to a mesh of the object, then use transfer"
            )
        self._cells, self._faces = cells, drawn
        # Pixels without a cell have index -1, and therefore get the last label, which is -1.
        self._labels = np.append(labels, np.int32(-1))
        self._n_threads = n_threads
        self.is_seen = np.zeros(len(labels), bool)

    def visible_regions(self, cameras: list[PinholeCamera]) -> Iterator[tuple[Ints, Floats]]:
        """Yield, for each camera, the label and the area of the surface visible in each pixel.

        The label is -1 if no cell is visible or the cell has no label. The area is 0 if no cell is
        visible, or if the angle between the surface and the line of sight is below 6 degrees.
        """
        return chain.from_iterable(map(self._visible_regions_of, self.batches(cameras)))

    def batches(self, cameras: list[PinholeCamera]) -> Iterator[list[PinholeCamera]]:
        """Yield the cameras whose images are computed at the same time."""
        largest = max(width * height for width, height in (camera.size for camera in cameras))
        step = max(min(self._n_threads, MIN_IMAGES), MAX_PIXELS // largest)
        return (cameras[start : start + step] for start in range(0, len(cameras), step))

    def _visible_regions_of(self, cameras: list[PinholeCamera]) -> Iterator[tuple[Ints, Floats]]:
        rows = [
            [*camera.projection.ravel(), camera.intrinsics[0] * camera.intrinsics[1]]
            for camera in cameras
        ]
        sizes = np.array([camera.size for camera in cameras], np.int32)
        cells, areas, seen = kind_of(self._cells).seen_cells(
            self._faces, np.array(rows), sizes, self._n_threads
        )
        self.is_seen[seen] = True
        ends = np.cumsum(sizes.prod(axis=1, dtype=np.int64))
        for start, end in zip([0, *ends[:-1]], ends, strict=True):
            yield self._labels[cells[start:end]], areas[start:end]


def collect_votes(
    surface: SeenSurface, masks: Iterable[Any], cameras: list[PinholeCamera], overlap: Overlap
) -> Votes:
    """Return the visible areas of regions in the masks of all images, as `Votes`.

    Raises a MeshError if no image has votes for a mask, or if a size differs from the camera's, and
    a ValueError if the numbers of images and cameras differ.
    """
    images = list(_votes_of_images(surface, masks, cameras, overlap))
    _check_images(images, cameras)
    counts = [len(image.ids) for image in images]
    firsts = np.cumsum([0, *counts])
    numbers = [
        np.where(image.masks < 0, -1, image.masks + first)
        for image, first in zip(images, firsts, strict=False)
    ]
    return Votes(
        np.concatenate(numbers).astype(np.int32),
        np.concatenate([image.regions for image in images]),
        np.concatenate([image.areas for image in images]),
        np.repeat(np.arange(len(images), dtype=np.int32), counts),
        np.concatenate([image.ids for image in images]).astype(np.int32),
        surface.is_seen,
    )


class _ImageVotes(NamedTuple):
    """Table of the visible areas of regions in the masks of one image, and outside its masks."""

    masks: Ints  # (A,) mask of each entry, as an index into `ids`; -1 for an area in no mask
    regions: Ints  # (A,) region of each entry
    areas: Floats  # (A,) area of the region visible in the mask, > 0
    ids: Array  # (M,) ids of the masks of the image, ascending
    n_seen: int  # number of pixels in which a region is visible


def _votes_of_images(
    surface: SeenSurface, masks: Iterable[Any], cameras: list[PinholeCamera], overlap: Overlap
) -> Iterator[_ImageVotes]:
    """Yield the votes of each image; raise a ValueError unless there is one image per camera."""
    given, n_images = iter(masks), 0
    for batch in surface.batches(cameras):
        images = []
        for camera, image in zip(batch, given, strict=False):
            with named_errors(_title(n_images, camera)):
                images.append(label_image(image, camera.size, overlap).ravel())
            n_images += 1
        if len(images) < len(batch):
            raise ValueError(
                f"masks must have one item per camera ({len(cameras)}), got"
                f" {counted(n_images, 'item')}"
            )
        # Sizes of cameras are compared with the masks before memory is allocated for pixels.
        for ids, (regions, areas) in zip(images, surface.visible_regions(batch), strict=True):
            yield _votes_of(ids, regions, areas)
    if next(given, given) is not given:
        raise ValueError(f"masks must have one item per camera ({len(cameras)}), got more items")


def _votes_of(ids: Array, regions: Ints, areas: Floats) -> _ImageVotes:
    """Sum the areas of pixels for each pair of a region and a mask, and for pixels in no mask."""
    ranks, names = ranked_labels(np.where(ids == NO_MASK, -1, ids))
    votes = (regions >= 0) & (areas > 0)
    local, regions_seen = ranked_labels(regions)
    n_regions = len(regions_seen)
    keys = (ranks[votes].astype(np.int64) + 1) * n_regions + local[votes]
    # Only pairs that occur are stored, because most masks show few regions.
    places, found = ranked_labels(np.append(keys, -1))
    sums = sums_by_label(places[:-1], areas[votes], len(found))
    masks, ranks = np.divmod(found, max(n_regions, 1))
    return _ImageVotes(masks - 1, regions_seen[ranks].astype(np.int32), sums, names, len(keys))


def _check_images(images: list[_ImageVotes], cameras: list[PinholeCamera]) -> None:
    """Warn about images without visible region or mask; raise a MeshError if no image has both."""
    titles = [_title(i, camera) for i, camera in enumerate(cameras)]
    blind = [title for title, image in zip(titles, images, strict=True) if not image.n_seen]
    empty = [title for title, image in zip(titles, images, strict=True) if not len(image.ids)]
    if len(blind) == len(images):
        raise MeshError(
            "no camera sees the mesh: check that poses are camera-to-world matrices in the"
            " coordinates of the mesh, with the axes of OpenCV (for OpenGL, use"
            " PinholeCamera.of_opengl)"
        )
    if len(empty) == len(images):
        raise MeshError("all images are without masks: mask ids start at 1, and 0 is background")
    if not any((image.masks >= 0).any() for image in images):
        raise MeshError(
            "no mask contains a visible part of the mesh: check that masks and cameras are in the"
            " same order"
        )
    for found, what in ((blind, "the mesh is not visible"), (empty, "there is no mask")):
        if found:
            more = f" and {len(found) - 1} more" if len(found) > 1 else ""
            warnings.warn(f"{what} in {found[0]}{more}", ViewWarning, stacklevel=4)


def _title(i: int, camera: PinholeCamera) -> str:
    return f"image {i} ({camera.name})" if camera.name else f"image {i}"
