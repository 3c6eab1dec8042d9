"""Convert the masks of an image to one image that contains the mask id of each pixel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Bools, Ints

NO_MASK = 0
"""Id of pixels outside all masks."""

Overlap = Literal["smallest", "largest"]
"""Whether a pixel in several masks gets the id of the smallest or of the largest of these masks."""


def label_image(masks: Any, size: tuple[int, int], overlap: Overlap) -> Ints:
    """Return the mask id of each pixel, shape (height, width); 0 outside all masks.

    `masks` are the masks of one image, in any form that `lift` accepts. `overlap` is the same as in
    `lift`, and `size` is the width and height of the image in pixels. Raises a MeshError if the
    masks are not valid.
    """
    array = _as_array(masks, size)
    if array.dtype == bool and array.ndim == 3:
        _check_size(array.shape[:0:-1], size)
        return flattened(array, overlap)
    if array.dtype.kind not in "biu":
        raise MeshError(f"masks must be arrays of integers or bools, got {array.dtype}")
    if array.ndim != 2:
        raise MeshError(
            "masks must be integers of shape (height, width) or bools of shape (n, height, width),"
            f" got an array of {array.dtype} of shape {array.shape}"
        )
    _check_size(array.shape[::-1], size)
    if array.max(initial=0) >= 2**31:
        raise MeshError(f"ids in masks must be less than 2**31, got {array.max()}")
    return np.maximum(array, NO_MASK).astype(np.int32)


def flattened(stack: Bools, overlap: Overlap) -> Ints:
    """Merge n bool masks, (n, height, width), into an image of ids from 1 to n, 0 outside.

    Where masks overlap, `overlap` decides; of masks with equally many pixels, the first is used.
    """
    ids = np.zeros(stack.shape[1:], np.int32)
    sizes = np.count_nonzero(stack, axis=(1, 2))
    ranks = sizes if overlap == "smallest" else -sizes
    for index in np.argsort(ranks, kind="stable")[::-1].tolist():
        ids[stack[index]] = index + 1
    return ids


def _as_array(masks: Any, size: tuple[int, int]) -> Array:
    """Convert masks to one array; a mask may be a dict with the key ``"segmentation"``."""
    if not isinstance(masks, (list, tuple)):
        return np.asarray(masks)
    planes = [one.get("segmentation") if isinstance(one, Mapping) else one for one in masks]
    if any(plane is None for plane in planes):
        raise MeshError("each mask that is a dict must have an array under the key segmentation")
    if not planes:
        return np.zeros(size[::-1], bool)
    try:
        return np.asarray(planes)
    except ValueError:
        raise MeshError("all masks of an image must have the same shape") from None


def _check_size(found: tuple[int, ...], size: tuple[int, int]) -> None:
    if found != size:
        raise MeshError(
            f"masks must have the size of the camera, {size[0]} x {size[1]} pixels, got"
            f" {found[0]} x {found[1]} pixels"
        )
