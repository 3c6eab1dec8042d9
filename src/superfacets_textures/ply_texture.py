"""Read texture coordinates and images of a PLY file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from superfacets import MeshAttributes
from superfacets.files.attributes import IMAGE_COMMENT, is_image
from superfacets.files.guards import Polygons
from superfacets.files.readers.ply_body import Column
from superfacets.files.readers.ply_header import Header
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
    header: Header,
    tables: list[list[Column]],
    faces: Array | Polygons,
    folder: Path | None,
) -> MeshAttributes:
    """Add a texture to the attributes, if the file has image names and texture coordinates."""
    names = images_in(attributes.comments)
    if not names:
        return attributes
    corners, offsets = _corners_of(faces)
    found = _pairs_of_faces(header, tables, offsets)
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
    is_kept = [OF_CORNERS not in text for text in attributes.left_out]
    left_out = [text for text, kept in zip(attributes.left_out, is_kept, strict=True) if kept]
    return replace(attributes, texture=texture, left_out=(*left_out, *problems_of(images)))


def images_in(comments: tuple[str, ...]) -> list[str]:
    """Return the names of images in the comments of a PLY header."""
    found = [line[len(IMAGE_COMMENT) :].strip() for line in comments if is_image(line)]
    return [name for name in found if name]


def _corners_of(faces: Array | Polygons) -> tuple[Array, Longs]:
    """Return the vertex of each corner, flat, and the index of the first corner of each face."""
    if isinstance(faces, Polygons):
        return faces.indices, faces.offsets
    return faces.ravel(), 3 * np.arange(len(faces) + 1)


def _pairs_of_faces(
    header: Header, tables: list[list[Column]], offsets: Longs
) -> tuple[Array, Ints] | None:
    """Return texture coordinates stored in faces, and the row of each corner, or None.

    The row is -1 for corners of faces without coordinates.
    """
    place = header.find("face")
    column = None if place is None else header.elements[place].find(OF_CORNERS)
    if place is None or column is None or place != header.faces:
        return None
    found = tables[place][column]
    if found.lengths is None or header.elements[place].n_rows != len(offsets) - 1:
        return None
    values = found.ragged if found.values is None else found.values.ravel()
    assert values is not None
    lengths = np.asarray(found.lengths, np.int64)
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
