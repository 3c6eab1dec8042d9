"""Encode textures for the JavaScript viewer: coordinates, and an atlas of all images."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np

from superfacets import Texture
from superfacets.kit import Array, FaceMesh, corner_triangles, import_extra
from superfacets_textures import WRAPS, TextureImage, check_texture, srgb_of_linear

from .coding import Coding
from .shape import STEPS

ATLAS_SIZE = 2048
"""Maximum width and height of the atlas, in pixels, supported by all implementations of WebGL 2."""

GRID = 32
"""Images in the atlas start at multiples of `GRID` pixels, and are padded to multiples of `GRID`
with copies of their edge pixels. Images therefore do not mix in the first five mipmap levels."""

QUALITY = 88
"""JPEG quality of the atlas, 0 to 100."""


def texture_parts(
    mesh: FaceMesh, texture: Texture
) -> tuple[dict[str, Any], dict[str, tuple[Array, Coding]]]:
    """Return a description of a texture, and its arrays, for the JavaScript viewer.

    The atlas is one image that contains all images of the texture, scaled down and arranged in a
    grid. A tile consists of a rectangle in the atlas, wrap modes and a color. Each material has a
    tile, and a second tile with an empty rectangle for faces without texture coordinates. The last
    tile is for faces without a material. Coordinates are rounded to 1/65535 of their range. Raises
    a MeshError if the texture does not match the mesh, or if an image is missing or damaged.
    """
    check_texture(texture, mesh)
    places, sources = corner_triangles(mesh)
    faces = np.arange(mesh.n_faces) if sources is None else sources
    corners = texture.corners[places]
    pairs = texture.coordinates[np.maximum(corners, 0)] if len(texture.coordinates) else corners
    pairs = np.where(corners[:, :, np.newaxis] >= 0, pairs, np.nan).reshape(-1, 3, 2)
    has_pairs = np.asarray(np.isfinite(pairs.reshape(len(pairs), -1)).all(axis=1))
    pairs = np.where(has_pairs[:, np.newaxis, np.newaxis], pairs, 0.0).reshape(-1, 2)
    low, high = pairs.min(axis=0), pairs.max(axis=0)
    step = np.where(high > low, high - low, 1.0) / STEPS
    atlas, rectangles = _atlas_of(texture.images)
    tiles = [
        [*([0, 0, 0, 0] if material.image is None else rectangles[material.image]),
         *map(WRAPS.index, material.wrap), *srgb_of_linear(material.color).tolist()]
        for material in texture.materials
    ]  # fmt: skip
    n = len(tiles)
    tiles += [[0, 0, 0, 0, 0, 0, *tile[6:]] for tile in tiles]  # for faces without coordinates
    of_triangles = texture.face_materials[faces]
    numbers = np.where(of_triangles < 0, 2 * n, of_triangles + np.where(has_pairs, 0, n))
    facts = {
        "low": low.tolist(), "step": step.tolist(), "tiles": [*tiles, [0] * 6 + [255] * 3],
    }  # fmt: skip
    quantized = np.rint((pairs - low) / step).astype(np.uint16)
    return facts, {
        "pairs": (quantized, "difference"),
        "tile_of": (numbers.astype(np.uint32), "difference"),
        "atlas": (np.frombuffer(atlas, np.uint8), "plain"),
    }


def _extended(pillow: Any, picture: Any, most: int) -> Any:
    """Extend a picture to the right and downward, with copies of its edge pixels.

    The new width and height are multiples of `GRID`, or `most` if this is less.
    """
    pixels = np.asarray(picture)
    grow = [(0, min(-length % GRID, most - length)) for length in pixels.shape[:2]]
    return pillow.fromarray(np.pad(pixels, [*grow, (0, 0)], mode="edge"))


def _atlas_of(images: list[TextureImage]) -> tuple[bytes, dict[TextureImage, list[int]]]:
    """Return a JPEG with all images in a grid, and the rectangle of each image.

    A rectangle consists of left, top, width and height in pixels.
    """
    pillow = import_extra("PIL.Image", "reading of textures", "texture")
    side = max(1, math.isqrt(max(len(images), 1) - 1) + 1)
    most = max(ATLAS_SIZE // side // GRID * GRID, ATLAS_SIZE // side % GRID)
    rectangles: dict[TextureImage, list[int]] = {}
    pictures = []
    for number, image in enumerate(images):
        picture = pillow.fromarray(image.pixels())
        picture.thumbnail((most, most), pillow.Resampling.LANCZOS)
        left, top = number % side * most, number // side * most
        rectangles[image] = [left, top, *picture.size]
        pictures.append((_extended(pillow, picture, most), (left, top)))
    right = max([left + picture.width for picture, (left, _) in pictures], default=1)
    bottom = max([top + picture.height for picture, (_, top) in pictures], default=1)
    atlas = pillow.new("RGB", (right, bottom))
    for picture, corner in pictures:
        atlas.paste(picture, corner)
    file = io.BytesIO()
    atlas.save(file, "jpeg", quality=QUALITY, subsampling=0)
    return file.getvalue(), rectangles
