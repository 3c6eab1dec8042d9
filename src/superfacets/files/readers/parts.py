"""Read which named part of a mesh file each face is in.

A part is a solid of a text STL file, or a group or object of an OBJ file.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from ...base.types import Array, Ints
from ..guards import Content
from .text import Lines

_REGION = re.compile(r"region_(\d{1,10})|unlabeled")
"""Matches the names that `write_mesh` gives to parts that have no other name."""


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
    ``region_17``, the property is ``label``, and has the numbers in the names. There is no property
    if a file has no names.
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
        numbers = [int(match[1]) if match and match[1] else -1 for match in matches]
        return Parts([("label", np.array([-1, *numbers])[of_faces + 1])], {})
    return Parts([(noun, of_faces)], {noun: tuple(names)})
