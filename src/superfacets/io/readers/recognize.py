"""Telling the format of a mesh by the first bytes of its file, where no ending does."""

from __future__ import annotations

import re

from ..guards import Content
from .off import MAGIC as OFF_MAGIC
from .stl import has_binary_size
from .vtp import is_vtp

# The first word of a text that is no comment.
_FIRST_WORD = re.compile(rb"(?:\s*+#[^\n]*+\n)*+\s*+(\S{1,20})")

_OBJ_WORDS = b"v vn vt vp f l p o g s mtllib usemtl".split()


def recognized_ending(data: Content) -> str | None:
    """The ending that files of this content have; None if it is of no known format."""
    if data[:4] in (b"ply\n", b"ply\r"):
        return ".ply"
    if is_vtp(data):
        return ".vtp"
    if data[:4] == b"glTF":
        return ".glb"
    if has_binary_size(data):
        return ".stl"
    found = _FIRST_WORD.match(data)
    return None if found is None else _ending_of_text(found[1])


def _ending_of_text(word: bytes) -> str | None:
    if word.startswith(b"{"):
        return ".gltf"
    if word.lower() == b"solid":
        return ".stl"
    if OFF_MAGIC.match(word):
        return ".off"
    if word in _OBJ_WORDS:
        return ".obj"
    return ".tri" if word.isdigit() else None
