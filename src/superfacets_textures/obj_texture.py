"""Read texture coordinates and materials of an OBJ file."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from superfacets.kit import Array, Bools, Content, Floats, Ints, Lines

from .images import problems_of
from .mtl import read_libraries, split_word
from .textures import Material, Texture

KEYWORDS = (b"vt", b"f", b"usemtl", b"mtllib")
COORDINATES, FACE, MATERIAL, LIBRARY = range(4)


@dataclass
class _Found:
    """Data collected from the lines read so far. Lists of arrays have one array per block."""

    coordinates: list[Floats] = field(default_factory=list)
    indices: list[Array] = field(default_factory=list)  # coordinate index of corners; < 0: none
    materials: list[Ints] = field(default_factory=list)  # material index of faces; -1 for none
    names: dict[str, int] = field(default_factory=dict)  # index of each material, by name
    libraries: list[str] = field(default_factory=list)  # names of MTL files
    material: int = -1  # material index of the faces that follow; -1 for none
    n_coordinates: int = 0


def read_texture(data: Content, folder: Path | None) -> tuple[Texture | None, list[str]]:
    """Return the texture of an OBJ file without continued lines, and the left-out items."""
    found = _Found()
    for lines in Lines.blocks(data, comment=b"#"):
        kinds = lines.keywords(KEYWORDS)
        _add_coordinates(lines, kinds, found)
        _add_materials(lines, kinds, found)
    if not found.n_coordinates and not found.names:
        return None, []
    coordinates = np.concatenate(found.coordinates)
    corners = np.concatenate(found.indices)
    corners = np.where((corners < 0) | (corners >= len(coordinates)), -1, corners)
    known, libraries, left_out = read_libraries(found.libraries, folder)
    missing = [name for name in found.names if name not in known]
    if missing and not left_out:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        left_out.append(f"materials: {missing[0]!r}{more}, which no MTL file defines")
    materials = [known.get(name, Material(name)) for name in found.names]
    images = [image for each in materials if each.source for image in each.source.images]
    texture = Texture(coordinates, corners, materials, np.concatenate(found.materials), libraries)
    return texture, [*left_out, *problems_of(images)]


def _add_coordinates(lines: Lines, kinds: Array, found: _Found) -> None:
    """Add the texture coordinates of a block of lines, and the texture indices of corners."""
    is_pair, is_face = kinds == COORDINATES, kinds == FACE
    pairs = lines.after_keyword(is_pair, b"vt")
    pairs.refuse(pairs.counts < 2, "texture coordinates need 2 numbers")
    faces = lines.after_keyword(is_face, b"f")
    indices = faces.parse_second_indices()
    if indices.min(initial=1) < 0:
        n_before = found.n_coordinates + np.cumsum(is_pair, dtype=np.int64)[is_face]
        last = np.repeat(n_before, faces.counts)  # number of `vt` lines before each corner
        indices = np.where(indices < 0, np.maximum(indices + last + 1, 0), indices)
    values = pairs.parse(np.float64)
    firsts = np.cumsum(pairs.counts, dtype=np.int64) - pairs.counts
    found.coordinates.append(values[firsts[:, np.newaxis] + np.arange(2)])
    found.indices.append(indices - 1)
    found.n_coordinates += len(pairs)


def _add_materials(lines: Lines, kinds: Array, found: _Found) -> None:
    found.libraries += [_name_at(lines, at) for at in np.flatnonzero(kinds == LIBRARY).tolist()]
    is_face: Bools = kinds == FACE
    n_before = np.cumsum(is_face)
    of_faces = np.empty(int(is_face.sum()), np.int32)
    begin = 0
    for place in np.flatnonzero(kinds == MATERIAL).tolist():
        of_faces[begin : n_before[place]] = found.material
        begin = int(n_before[place])
        name = _name_at(lines, place)
        found.material = found.names.setdefault(name, len(found.names))
    of_faces[begin:] = found.material
    found.materials.append(of_faces)


def _name_at(lines: Lines, place: int) -> str:
    """Return the text after the keyword of a line; it may contain spaces and ``#``."""
    text = lines.text[lines.starts[place] :][:4096].tobytes().split(b"\n")[0]
    return split_word(text.decode("utf-8", "surrogateescape"))[1]
