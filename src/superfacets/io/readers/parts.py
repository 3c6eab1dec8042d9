"""Labels from the named parts of a text file: solids of an STL file, groups of an OBJ file."""

from __future__ import annotations

import re

import numpy as np

from ..._types import Array
from ...errors import MeshError
from ..guards import Content
from .obj import read_obj, without_continuations
from .stl import is_binary_stl, read_stl
from .text import iterate_lines

_REGION = re.compile(rb"region_(\d{1,10})|unlabeled")
"""Names that `write_mesh` gives to the parts of a file."""

_OUR_PART = re.compile(rb"^(?:solid|g) region_\d", re.MULTILINE)


def has_region_parts(data: Content) -> bool:
    """Whether the file has a part that `write_mesh` named after a region."""
    return _OUR_PART.search(data) is not None


def stl_labels(data: Content) -> Array:
    """The label of each triangle, by the name of its solid; a MeshError for a binary file."""
    read_stl(data)  # raises the errors of damaged files
    if is_binary_stl(data):
        raise MeshError("a binary STL file names no solids: write text STL, or PLY with labels")
    return _labels_by_part(data, (b"facet", b"solid"), any_case=True)


def obj_labels(data: Content) -> Array:
    """The label of each face, by the last `g` or `o` line before it; a MeshError without any."""
    read_obj(data)  # raises the errors of damaged files
    labels = _labels_by_part(without_continuations(data), (b"f", b"g", b"o"), comment=b"#")
    if not len(labels) or labels.max() < 0:
        raise MeshError("the OBJ file has no groups: no face follows a `g` or `o` line")
    return labels


def _labels_by_part(
    data: Content, words: tuple[bytes, ...], *, any_case: bool = False, comment: bytes = b""
) -> Array:
    """Labels of the lines that begin with the first word; other words begin a part with a name.

    A part `region_17` has label 17 and `unlabeled` has -1, if all names are such. Otherwise parts
    are numbered in the order of their names in the file. Faces before the first part have -1.
    """
    names: dict[bytes, int] = {}
    blocks, last = [], -1
    for lines in iterate_lines(data, comment=comment):
        keywords = lines.keywords(words, any_case=any_case)
        is_part = (keywords > 0) & (keywords < len(words))
        parts = [last]
        for line in np.flatnonzero(is_part).tolist():
            name = b" ".join(lines.content(line).split()[1:])
            parts.append(names.setdefault(name, len(names)))
        blocks.append(np.array(parts)[np.cumsum(is_part)[keywords == 0]])
        last = parts[-1]
    matches = [_REGION.fullmatch(name) for name in names]
    numbers = np.arange(-1, len(names))  # the last row is of no part, -1
    if all(matches):
        numbers[1:] = [int(match[1]) if match and match[1] else -1 for match in matches]
    labels: Array = numbers[np.concatenate(blocks) + 1]
    return labels
