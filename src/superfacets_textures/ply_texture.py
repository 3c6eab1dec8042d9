"""Read texture coordinates and images of a PLY file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from superfacets import MeshAttributes
from superfacets.kit import Array, Ints, Longs

from .images import image_beside, problems_of
from .textures import Material, Texture

PAIRS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
"""Pairs of names of vertex properties that are texture coordinates."""

OF_CORNERS, IMAGE_OF_FACE = "texcoord", "texnumber"
"""Names of face properties in which MeshLab stores texture coordinates and image indices."""

OF_TEXTURE = (OF_CORNERS, IMAGE_OF_FACE)


def with_texture(
    attributes: MeshAttributes,
    names: Sequence[str],
    faces: Array | tuple[Longs, Array],
    lists_of_faces: Callable[[str], tuple[Array, Array] | None],
    folder: Path | None,
) -> MeshAttributes:
    """Add a texture to the attributes, if the file has texture coordinates.

    `names` are names of images. `faces` are triangles, (F, 3), or offsets and corners of polygons.
    `lists_of_faces` returns values, flat, and lengths of the lists with a name, or None.
    """
    corners, offsets = _corners_of(faces)
    found = _pairs_of_faces(lists_of_faces(OF_CORNERS), offsets)
    if found is None:
        found = _pairs_of_vertices(attributes, corners)
    if found is None:
        return attributes
    images = [image_beside(name, folder) for name in names]
    materials = [Material(Path(image.name).stem, image=image) for image in images]
    numbers = attributes.face.get(IMAGE_OF_FACE, np.zeros(len(offsets) - 1))
    is_known = (numbers >= 0) & (numbers < len(names)) & (numbers == np.floor(numbers))
    face_materials = np.where(is_known, numbers, -1).astype(np.int32).reshape(-1)
    texture = Texture(*found, materials, face_materials, format="ply")
    declared = {**attributes.declared, "texture": "texture"}
    if (item := f"face property {OF_CORNERS}") in declared:
        declared[item] = "texture"
    declared |= dict.fromkeys(problems_of(images), "")
    return replace(attributes, texture=texture, declared=declared)


def _corners_of(faces: Array | tuple[Longs, Array]) -> tuple[Array, Longs]:
    """Return the vertex of each corner, flat, and the index of the first corner of each face."""
    if isinstance(faces, tuple):
        return faces[1], faces[0]
    return faces.ravel(), 3 * np.arange(len(faces) + 1)


def _pairs_of_faces(lists: tuple[Array, Array] | None, offsets: Longs) -> tuple[Array, Ints] | None:
    """Return texture coordinates stored in faces, and the row of each corner or -1; else None."""
    if lists is None or len(lists[1]) != len(offsets) - 1:
        return None
    values, lengths = lists
    sizes = np.diff(offsets)
    has_pairs = np.repeat(lengths == 2 * sizes, sizes)
    firsts = np.repeat((np.cumsum(lengths) - lengths) // 2, sizes)
    within = np.arange(int(offsets[-1])) - np.repeat(offsets[:-1], sizes)
    corners = np.where(has_pairs, firsts + within, -1).astype(np.int32)
    if np.any(lengths % 2):
        return None
    return values.reshape(-1, 2), corners


def _pairs_of_vertices(attributes: MeshAttributes, corners: Array) -> tuple[Array, Array] | None:
    for names in PAIRS:
        stored = [attributes.vertex.get(name) for name in names]
        pairs = [values for values in stored if values is not None and values.ndim == 1]
        if len(pairs) == 2:
            is_inside = (corners >= 0) & (corners < len(pairs[0]))
            return np.stack(pairs, axis=1), np.where(is_inside, corners, -1)
    return None
