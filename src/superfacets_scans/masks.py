"""Read mask files that programs for image segmentation write."""

from __future__ import annotations

import os
from pathlib import Path
from typing import get_args

import numpy as np

from superfacets import MeshError
from superfacets.kit import (
    Array,
    Ints,
    checked_choice,
    import_extra,
    named_errors,
    npy_array,
    open_regular,
    read_content,
)
from superfacets_textures import check_pixels

from .label_images import Overlap, flattened, label_image


def read_masks(folder: str | os.PathLike[str], *, overlap: Overlap = "smallest") -> dict[str, Ints]:
    """Read the masks of images from a folder, and return the mask id of each pixel of each image.

    Parameters
    ----------
    folder : path-like
        Folder that contains one of the following for each image, with the name of the image. Other
        files are ignored.

        - A ``.png`` file, gray or with a palette, with 8 or 16 bits. The value of a pixel is its
          mask id, or 0 outside all masks.
        - A ``.npy`` file: mask ids as integers of shape (height, width), or n masks as bools of
          shape (n, height, width).
        - A folder with one ``.png`` file per mask, as written by ``amg.py`` of SAM. Pixels above 0
          are in the mask.
    overlap : {"smallest", "largest"}
        Which mask is used where bool masks overlap. Same as in `lift`.

    Returns
    -------
    dict of str to ndarray of int32, shape (height, width)
        Mask id of each pixel, or 0 outside all masks, keyed by the name of the image without
        ending. Names are in alphabetical order. `read_cameras` accepts the dict as `names`.

    Raises
    ------
    MeshError
        If a file is damaged or contains no masks, if the masks of an image differ in size, if an
        image has two files, or if the folder has no masks.
    MissingExtraError
        If there is a ``.png`` file, but Pillow is not installed.
    OSError
        If a file cannot be read.
    """
    checked_choice(overlap, "overlap", get_args(Overlap))
    folder = Path(folder)
    masks: dict[str, Ints] = {}
    for path in sorted(folder.iterdir()):
        found = _masks_in(path, overlap)
        if found is None:
            continue
        if path.stem in masks:
            raise MeshError(f"{path}: image {path.stem} has two files of masks: remove one of them")
        masks[path.stem] = found
    if not masks:
        raise MeshError(
            f"{folder}: must have a .png file, a .npy file or a folder per image, but has no masks"
        )
    return masks


def _masks_in(path: Path, overlap: Overlap) -> Ints | None:
    """Return the mask ids in a file, or in all files of a folder; None if the path has no masks."""
    if path.is_dir():
        parts = sorted(path.glob("*.png"), key=lambda part: (len(part.stem), part.stem))
        planes = [_picture(part) > 0 for part in parts]
        if len({plane.shape for plane in planes}) > 1:
            raise MeshError(f"{path}: all masks of an image must have the same size")
        return flattened(np.stack(planes), overlap) if planes else None
    if path.suffix.lower() == ".png":
        return _picture(path).astype(np.int32)
    if path.suffix.lower() != ".npy":
        return None
    with named_errors(path):
        array = npy_array(read_content(path), "masks")
        return label_image(array, array.shape[:-3:-1], overlap)


def _picture(path: Path) -> Array:
    """Return the pixels of a PNG file, or raise a MeshError if it has several channels."""
    with open_regular(path) as file:
        reader = import_extra("PIL.PngImagePlugin", "reading masks", "viz").PngImageFile
        try:
            with reader(file) as image:
                if len(image.getbands()) != 1:
                    colors = f"got colors ({image.mode})"
                    raise MeshError(f"{path}: masks must be gray, with one id per pixel, {colors}")
                check_pixels(f"{path}:", image.size, path.stat().st_size)
                return np.array(image)
        except (OSError, SyntaxError, ValueError) as error:
            if isinstance(error, MeshError):
                raise
            raise MeshError(f"{path}: is not a complete PNG: {error}") from None
