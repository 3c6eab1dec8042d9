"""Conversion of masks of an image to one id per pixel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from .._types import Array, Bools, Ints
from ..errors import MeshError

NO_MASK = 0
"""Id of pixels in no mask."""

Overlap = Literal["smallest", "largest"]
"""Mask that is used where masks overlap, by number of pixels."""


def label_image(masks: Any, size: tuple[int, int], overlap: Overlap) -> Ints:
    """Return the id of the mask of each pixel, (height, width), 0 for none.

    `masks` and `overlap` are as for `lift`; `size` is width and height of the camera. A MeshError
    if the masks are not valid.
    """
    array = _as_array(masks, size)
    if array.dtype == bool and array.ndim == 3:
        _check_size(array.shape[:0:-1], size)
        return flattened(array, overlap)
    if array.dtype.kind not in "biu":
        raise MeshError(f"masks must be integers or bools, got {array.dtype}")
    if array.ndim != 2:
        raise MeshError(
            "masks must be ids of shape (height, width) or bools of shape (n, height, width), got"
            f" {array.dtype} of shape {array.shape}"
        )
    _check_size(array.shape[::-1], size)
    if array.max(initial=0) >= 2**31:
        raise MeshError(f"ids of masks must be below 2**31, got {array.max()}")
    return np.maximum(array, NO_MASK).astype(np.int32)


def flattened(stack: Bools, overlap: Overlap) -> Ints:
    """Return ids, 1 to n, of masks (n, height, width); of masks of equal size the first is used."""
    ids = np.zeros(stack.shape[1:], np.int32)
    sizes = np.count_nonzero(stack, axis=(1, 2))
    ranks = sizes if overlap == "smallest" else -sizes
    for place in np.argsort(ranks, kind="stable")[::-1].tolist():
        ids[stack[place]] = place + 1
    return ids


def _as_array(masks: Any, size: tuple[int, int]) -> Array:
    """One array of ids or bools; the mask in a dictionary is its ``"segmentation"``."""
    if not isinstance(masks, (list, tuple)):
        return np.asarray(masks)
    planes = [one["segmentation"] if isinstance(one, Mapping) else one for one in masks]
    if not planes:
        return np.zeros(size[::-1], bool)
    try:
        return np.asarray(planes)
    except ValueError:
        raise MeshError("masks of one image differ in size") from None


def _check_size(found: tuple[int, ...], size: tuple[int, int]) -> None:
    if found != size:
        raise MeshError(
            f"masks have {found[0]} x {found[1]} pixels, but the camera has {size[0]} x {size[1]}"
        )
