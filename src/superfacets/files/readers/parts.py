"""Read the named parts of a mesh file, such as groups and solids, and the part of each face.

A part is a solid of a text STL file, or a group or object of an OBJ file.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from ...base.types import Array, Ints
from ..guards import Content
from .text import Lines

_REGION = re.compile(r"(?:(.+)_)?region_(\d{1,10})|unlabeled")
"""Matches the names that `write_mesh` gives to parts; they may begin with another name."""


class Parts(NamedTuple):
    """Property of the faces with the number of each face's part, and names of the parts."""

    columns: list[tuple[str, Array]]
    names: dict[str, tuple[str, ...]]


def parts_of(
    data: Content, words: tuple[bytes, ...], noun: str, *, any_case: bool = False,
    comment: bytes = b"",
) -> Parts:  # fmt: skip
    """Return the parts of a text file. Lines that begin with ``words[0]`` are faces.

    Lines that begin with another of `words` begin a part. The name of the part follows the word.
    The property has the name `noun`; the value -1 stands for no part. If all names are like
    ``region_17`` or ``inlet_region_17``, the property ``label`` has the numbers in the names. There
    is no property if a file has no names, or one name for all faces.
    """
    names: dict[str, int] = {}
    blocks, last = [], -1
    for lines in Lines.blocks(data, comment=comment):
        keywords = lines.keywords(words, any_case=any_case)
        is_part = (keywords > 0) & (keywords < len(words))
        parts = [last]
        for line in np.flatnonzero(is_part).tolist():
            name = " ".join(lines.content(line).decode("utf-8", "replace").split()[1:])
            parts.append(names.setdefault(name, len(names)))
        blocks.append(np.array(parts, np.int32)[np.cumsum(is_part)[keywords == 0]])
        last = parts[-1]
    of_faces: Ints = np.concatenate(blocks)
    if not any(names) or not len(of_faces) or of_faces.max() < 0:
        return Parts([], {})
    matches = [_REGION.fullmatch(name) for name in names]
    if all(matches):
        pairs = [(match[1] or "", int(match[2] or -1)) for match in matches if match is not None]
        labels = np.array([-1, *(number for _, number in pairs)])[of_faces + 1]
        wholes = [*dict.fromkeys(whole for whole, _ in pairs)]
        if wholes == [""]:
            return Parts([("label", labels)], {})
        of_parts = np.array([-1, *(wholes.index(whole) for whole, _ in pairs)])[of_faces + 1]
        return Parts([("label", labels), (noun, of_parts)], {noun: tuple(wholes)})
    if len(names) == 1 and of_faces.min() == 0:  # the name of the model
        return Parts([], {})
    return Parts([(noun, of_faces)], {noun: tuple(names)})
