"""Write OBJ with one group per region or class, and OFF with one color per face."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import IO, TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ...base.lazy import load
from ...base.types import Array, Ints, Longs
from ...mesh.faces import FaceMesh, corners_of
from .content import Content
from .text import ROWS_AT_ONCE, coordinate_format, text_rows, write_rows

if TYPE_CHECKING:
    from ... import Texture

NO_MATERIAL = "no_material"
"""Name of the material for faces without a material. It is needed only after faces with a material,
because a ``usemtl`` line applies to all faces up to the next ``usemtl`` line."""

# In OBJ, "#" begins a comment, and a backslash joins two lines.
_SAFE = str.maketrans("#\\", "__")


def write_obj(file: IO[bytes], content: Content) -> None:
    """Write OBJ with one group per region, or per class; faces keep their order within a region.

    Groups are named by `Content.part_names`, with underscores instead of ``#`` and backslashes.
    Materials are written to an MTL file in the same folder. Colors and attributes are not written.
    """
    mesh, labels, texture = content.cells, content.labels, content.texture
    lines_of = partial(face_lines, mesh, begin="f ", first=1)
    if texture is not None:
        library_lines = load("superfacets_textures.writing:library_lines")
        file.write(library_lines(texture, content.path))
        lines_of = partial(_textured_lines, mesh, texture)
    row = " ".join(["v", *[coordinate_format(mesh.vertices)] * 3]) + "\n"
    write_rows(file, row, list(mesh.vertices.T))
    if texture is not None and len(texture.coordinates):
        pairs = np.nan_to_num(texture.coordinates)
        write_rows(file, f"vt {coordinate_format(pairs)} {coordinate_format(pairs)}\n", [*pairs.T])
    if labels is None:
        for lines in lines_of(faces=np.arange(mesh.n_faces)):
            file.write(b"".join(lines))
        return
    order = np.argsort(labels, kind="stable")
    values, regions = np.unique(labels, return_inverse=True)
    names, groups = np.unique(content.part_names(values), return_inverse=True)
    group_lines = [f"g {name}\n".translate(_SAFE).encode() for name in names.tolist()]
    begin, last = 0, -1
    for lines in lines_of(faces=order):
        some = groups[regions[order[begin : begin + len(lines)]]]
        for place in np.flatnonzero(np.diff(some, prepend=last)).tolist():
            lines[place] = group_lines[some[place]] + lines[place]
        file.write(b"".join(lines))
        begin, last = begin + len(lines), some[-1]


def _textured_lines(
    mesh: FaceMesh, texture: Texture, faces: npt.NDArray[np.intp]
) -> Iterator[list[bytes]]:
    """Yield face lines with texture coordinates, and ``usemtl`` lines where materials change."""
    names = load("superfacets_textures.writing:material_names")(texture)
    offsets = corners_of(mesh).offsets
    firsts = 3 * np.arange(mesh.n_faces) if offsets is None else offsets[:-1]
    last = -1
    for begin in range(0, len(faces), ROWS_AT_ONCE):
        some = faces[begin : begin + ROWS_AT_ONCE]
        lines = _lines_of(mesh, some, "f ", 1, (), (texture.corners, firsts))
        materials = texture.face_materials[some]
        for place in np.flatnonzero(np.diff(materials, prepend=last)).tolist():
            material = int(materials[place])
            name = names[material] if material >= 0 else NO_MATERIAL
            lines[place] = f"usemtl {name}\n".encode("utf-8", "surrogateescape") + lines[place]
        last = int(materials[-1])
        yield lines


def face_lines(
    mesh: FaceMesh,
    faces: npt.NDArray[np.intp],
    begin: str,
    *,
    first: int = 0,
    ends: tuple[Array, ...] = (),
) -> Iterator[list[bytes]]:
    """Yield lists of at most `ROWS_AT_ONCE` lines, with one line per face.

    A line consists of `begin`, the vertices of the face, and its number in each array of `ends`. A
    ``#`` in `begin` is replaced by the number of corners. Vertices are numbered from `first`. Each
    array in `ends` has one number per face of the mesh.
    """
    for place in range(0, len(faces), ROWS_AT_ONCE):
        yield _lines_of(mesh, faces[place : place + ROWS_AT_ONCE], begin, first, ends)


def _lines_of(
    mesh: FaceMesh, faces: npt.NDArray[np.integer], begin: str, first: int,
    ends: tuple[Array, ...], pairs: tuple[Ints, Longs] | None = None,
) -> list[bytes]:  # fmt: skip
    """Return one line per face as `face_lines` does, with texture coordinates if `pairs` is given.

    `pairs` is a tuple of two arrays: the row of each corner of the mesh in `Texture.coordinates`,
    and the index of the first corner of each face.
    """
    lines = np.empty(len(faces), dtype=object)
    corners, offsets = corners_of(mesh).of(faces)
    sizes = np.diff(offsets)
    kinds = sizes
    if pairs is not None:
        of_corners = pairs[0][
            np.repeat(pairs[1][faces] - offsets[:-1], sizes) + np.arange(len(corners))
        ]
        is_whole = np.minimum.reduceat(of_corners, offsets[:-1]) >= 0
        # Faces with equal entries in `kinds` have the same format. The entry is the number of
        # corners, negated if a corner has no texture coordinates.
        kinds = np.where(is_whole, sizes, -sizes)
    for kind in np.unique(kinds).tolist():
        alike = np.flatnonzero(kinds == kind)
        places = [offsets[alike] + place for place in range(abs(kind))]
        columns = [corners[place] + first for place in places]
        words = ["%d"] * len(columns)
        if pairs is not None and kind > 0:
            words = ["%d/%d"] * len(columns)
            columns = [column for place, vertex in zip(places, columns, strict=True)
                       for column in (vertex, of_corners[place] + first)]  # fmt: skip
        columns += [values[faces[alike]] for values in ends]
        words += ["%d"] * len(ends)
        row = begin.replace("#", str(abs(kind))) + " ".join(words) + "\n"
        lines[alike] = text_rows(row, columns).splitlines(keepends=True)
    return lines.tolist()


def write_off(file: IO[bytes], content: Content) -> None:
    """Write OFF. The color of a face, three numbers from 0 to 255, follows its corners.

    The first line is OFF, because COFF would declare vertex colors. Labels and attributes are not
    written.
    """
    mesh, colors = content.cells, content.colors
    file.write(b"OFF\n%d %d 0\n" % (mesh.n_vertices, mesh.n_faces))
    row = " ".join([coordinate_format(mesh.vertices)] * 3) + "\n"
    write_rows(file, row, list(mesh.vertices.T))
    ends = () if colors is None else tuple(colors.T)
    for lines in face_lines(mesh, np.arange(mesh.n_faces), "# ", ends=ends):
        file.write(b"".join(lines))
