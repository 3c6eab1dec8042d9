"""Read labels from the named parts of a mesh file.

A part is a solid of a text STL file, or a group or object of an OBJ file.
"""

from __future__ import annotations

import re

import numpy as np

from ...base.errors import MeshError
from ...base.types import Array
from ..guards import Content
from .obj import read_obj, without_continuations
from .stl import is_binary_stl, read_stl
from .text import Lines

_REGION = re.compile(rb"region_(\d{1,10})|unlabeled")
"""Matches the names that `write_mesh` gives to parts."""

_OUR_PART = re.compile(rb"^(?:solid|g) region_\d", re.MULTILINE)


def has_region_parts(data: Content) -> bool:
    """Return whether a part has a name like ``region_17``, as written by `write_mesh`."""
    return _OUR_PART.search(data) is not None


def stl_labels(data: Content, name: str = "") -> Array:
    """Return the label of each triangle, from the name of its solid in a text file."""
    read_stl(data)  # raises a MeshError if the file is damaged
    if is_binary_stl(data):
        raise MeshError("a binary STL file has no solids: use a text STL file, or PLY with labels")
    return _labels_by_part(data, (b"facet", b"solid"), any_case=True)


def obj_labels(data: Content, name: str = "") -> Array:
    """Return the label of each face, from the last `g` or `o` line before the face."""
    read_obj(data)  # raises a MeshError if the file is damaged
    labels = _labels_by_part(without_continuations(data), (b"f", b"g", b"o"), comment=b"#")
    if not len(labels) or labels.max() < 0:
        raise MeshError("the OBJ file has no groups: no face follows a `g` or `o` line")
    return labels


def _labels_by_part(
    data: Content, words: tuple[bytes, ...], *, any_case: bool = False, comment: bytes = b""
) -> Array:
    """Return a label per face. Lines that begin with ``words[0]`` are faces.

    Lines that begin with another of `words` begin a part. The name of the part follows the word.
    """
    names: dict[bytes, int] = {}
    blocks, last = [], -1
    for lines in Lines.blocks(data, comment=comment):
        keywords = lines.keywords(words, any_case=any_case)
        is_part = (keywords > 0) & (keywords < len(words))
        parts = [last]
        for line in np.flatnonzero(is_part).tolist():
            name = b" ".join(lines.content(line).split()[1:])
            parts.append(names.setdefault(name, len(names)))
        blocks.append(np.array(parts)[np.cumsum(is_part)[keywords == 0]])
        last = parts[-1]
    matches = [_REGION.fullmatch(name) for name in names]
    numbers = np.arange(-1, len(names))  # label -1 for no part, then the label of each part
    if all(matches):  # all names are like `region_17` or `unlabeled`
        numbers[1:] = [int(match[1]) if match and match[1] else -1 for match in matches]
    return np.asarray(numbers[np.concatenate(blocks) + 1])
