"""Write texture images that store region ids, and a table of the ids."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Bools, Bytes, Ints, Output, atomic_outputs, kind_of

from .images import import_pillow
from .texels import ids_in_layout
from .textures import Material, Texture
from .writing import write_beside

PLAIN_SIZE = (2048, 2048)
"""Width and height of an id image if the texture has no color image that can be read."""


def write_ids(file: IO[bytes], content: Output) -> None:
    """Write an image with the region id of each texel, and a table of ids in the same folder.

    The id of a region is its label + 1, encoded as red + 256 green + 65,536 blue; 0 means no
    region. There is one id image per image of the texture. A stream gets only the first id image,
    and no table.
    """
    texture, labels = content.texture, content.labels
    if texture is None or labels is None:
        raise MeshError("a .ids.png file needs faces with labels and texture coordinates")
    if labels.max(initial=0) >= 2**24 - 1:
        raise MeshError(f".ids.png needs labels below 2**24 - 1, got {labels.max()}: renumber them")
    content.taken.add("texture")
    n_texels = np.zeros(int(labels.max(initial=-1)) + 1, np.int64)
    stem = "" if content.path is None else content.path.name[: -len(content.ending)]
    for number, (material, is_here, size) in enumerate(_layouts(texture)):
        ids = ids_in_layout(content.cells, texture, labels, is_here, material.wrap, size)
        n_texels += np.bincount(ids[ids >= 0], minlength=len(n_texels))
        image = import_pillow("Image").fromarray(_as_colors(ids))
        if number == 0:
            image.save(file, "png")
        elif content.path is not None:
            with atomic_outputs([content.path.with_name(f"{stem}.{number}.ids.png")]) as (beside,):
                image.save(beside, "png")
    if content.path is not None:
        write_beside(content.path, f"{stem}.ids.csv", _table_of_ids(content, labels, n_texels))


def _layouts(texture: Texture) -> Iterator[tuple[Material, Bools, tuple[int, int]]]:
    """Yield material, mask of faces and size of each image; one blank layout if there are none."""
    if not texture.images:
        yield Material(), np.ones(len(texture.face_materials), np.bool_), PLAIN_SIZE
    for image in texture.images:
        numbers = [n for n, each in enumerate(texture.materials) if each.image is image]
        is_here = np.isin(texture.face_materials, numbers)
        size = PLAIN_SIZE if image.problem is not None else image.size()
        yield texture.materials[numbers[0]], is_here, size


def _as_colors(ids: Ints) -> Bytes:
    numbers = ids.astype(np.int64) + 1
    return np.stack([numbers & 255, numbers >> 8 & 255, numbers >> 16], axis=2).astype(np.uint8)


def _table_of_ids(content: Output, labels: Ints, n_texels: Array) -> bytes:
    """Return a CSV table with id, label, number of texels and area of each region."""
    measures = kind_of(content.cells).measures(content.cells, 1)
    kept = labels >= 0
    areas = np.bincount(labels[kept], measures[kept], len(n_texels))
    rows = [
        f"{label + 1},{label},{n_texels[label]},{areas[label]:.9g}"
        for label in np.unique(labels[kept]).tolist()
    ]
    return ("\n".join(["id,label,texels,area", *rows]) + "\n").encode("ascii")
