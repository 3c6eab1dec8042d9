"""Format rows of numbers as text, and write OBJ, OFF, STL and CSV."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from typing import IO, TYPE_CHECKING, Any

import numpy as np
import numpy.lib.format as npy_format
import numpy.typing as npt

from ...base.checks import checked_threads
from ...base.lazy import load
from ...base.types import Array, Floats
from ...mesh.attributes import COLORS
from ...mesh.faces import FaceMesh, area_vectors, corners_of
from ..input import NORMALS
from ..readers.stl import HEADER_SIZE, TRIANGLE
from .cells import Output

if TYPE_CHECKING:
    from ... import Texture

ROWS_AT_ONCE = 1 << 14
"""Number of rows that are formatted at a time; small enough to fit in the processor cache."""

NO_MATERIAL = "no_material"
"""Name of the material for faces without a material. It is needed only after faces with a material,
because a ``usemtl`` line applies to all faces up to the next ``usemtl`` line."""


def text_rows(row: str, columns: Sequence[Array]) -> bytes:
    """Format all rows with a single format operation; `row` is the format string of one row."""
    lists = [column.tolist() for column in columns]
    n_rows = len(lists[0])
    flat: list[Any] = [None] * (n_rows * len(lists))
    for place, values in enumerate(lists):
        flat[place :: len(lists)] = values
    return (row * n_rows % tuple(flat)).encode("ascii")


def write_rows(file: IO[bytes], row: str, columns: Sequence[Array]) -> None:
    """Write columns of equal length as rows of text; `row` is the format string of one row.

    Writers of text formats use this function, because it formats many rows at a time.
    """
    for begin in range(0, len(columns[0]), ROWS_AT_ONCE):
        file.write(text_rows(row, [column[begin : begin + ROWS_AT_ONCE] for column in columns]))


def coordinate_format(values: Floats) -> str:
    """Return the shortest number format that preserves all values exactly."""
    return "%.9g" if fits_single(values) else number_format(values)


def fits_single(values: Floats) -> bool:
    """Return whether float32 represents all values exactly."""
    with np.errstate(over="ignore"):  # overflow gives infinity, which differs from the value
        return all(
            np.array_equal(part.astype(np.float32), part)
            for part in np.array_split(values, max(1, len(values) // ROWS_AT_ONCE))
        )


def write_npy(file: IO[bytes], array: Array) -> None:
    """Write an array as .npy to any stream; `numpy.save` calls ``tell``, which fails on pipes."""
    npy_format.write_array_header_1_0(file, npy_format.header_data_from_array_1_0(array))
    file.write(array.data)


def number_format(values: Array) -> str:
    """Return a format string with enough digits to restore the values exactly."""
    if values.dtype.kind in "iu" or values.dtype.itemsize == 4:
        return "%d" if values.dtype.kind in "iu" else "%.9g"
    most = float(np.abs(values).max(initial=0.0))
    scale = 10.0 ** (14 - math.floor(math.log10(most))) if 1e-6 < most < 1e15 else math.nan
    return "%.15g" if np.array_equal(np.rint(values * scale) / scale, values) else "%.17g"


def write_obj(file: IO[bytes], content: Output) -> None:
    """Write OBJ with one group per region, class or part; faces of a region keep their order."""
    mesh, labels, parts = content.cells, content.labels, content.parts()
    texture = None if content.texture is None else content.texture.shared
    if texture is not None:
        library_lines = load("superfacets_textures.writing:library_lines")
        file.write(library_lines(texture, content.path))
        content.taken.add("texture")
    words, columns = [coordinate_format(mesh.vertices)] * 3, [*mesh.vertices.T]
    if (colors := content.stored_colors("vertex")) is not None:
        words, columns = [*words, *["%.6g"] * 3], [*columns, *(colors / 255).T]
    write_rows(file, " ".join(["v", *words]) + "\n", columns)
    if texture is not None and len(texture.coordinates):
        pairs = np.nan_to_num(texture.coordinates)
        write_rows(file, f"vt {coordinate_format(pairs)} {coordinate_format(pairs)}\n", [*pairs.T])
    order = np.arange(mesh.n_faces)
    if parts is not None:
        _, firsts, groups = np.unique(parts[1], return_index=True, return_inverse=True)
        of_faces = firsts[groups][parts[0]]  # first part with the same name
        order = order if labels is None else np.lexsort((parts[0], of_faces))
    blocks = _face_lines(mesh, order, "f ", 1, texture=texture)
    if texture is not None:
        materials = load("superfacets_textures.writing:material_names")(texture)
        uses = [f"usemtl {name}\n" for name in (*materials, NO_MATERIAL)]  # -1 means the last one
        blocks = _with_titles(blocks, texture.face_materials[order], uses)
    if parts is not None:
        blocks = _with_titles(blocks, of_faces[order], [f"g {name}\n" for name in parts[1]])
    for lines in blocks:
        file.write(b"".join(lines))


def _with_titles(
    blocks: Iterator[list[bytes]], numbers: npt.NDArray[np.integer], titles: list[str]
) -> Iterator[list[bytes]]:
    """Yield the blocks, with the title of each line's number before lines where numbers change."""
    begin, last = 0, -1
    for lines in blocks:
        some = numbers[begin : begin + len(lines)]
        for place in np.flatnonzero(np.diff(some, prepend=last)).tolist():
            lines[place] = titles[some[place]].encode("utf-8", "surrogateescape") + lines[place]
        begin, last = begin + len(lines), int(some[-1])
        yield lines


def _face_lines(
    mesh: FaceMesh, faces: npt.NDArray[np.intp], begin: str, first: int, *,
    ends: tuple[Array, ...] = (), texture: Texture | None = None,
) -> Iterator[list[bytes]]:  # fmt: skip
    """Yield lists of at most `ROWS_AT_ONCE` lines: `begin`, corners of a face, and `ends`.

    A ``#`` in `begin` is replaced by the number of corners. Vertices are numbered from `first`.
    """
    of_mesh = corners_of(mesh)
    of_texture = None if texture is None else replace(of_mesh, vertices=texture.corners)
    for place in range(0, len(faces), ROWS_AT_ONCE):
        some = faces[place : place + ROWS_AT_ONCE]
        lines = np.empty(len(some), dtype=object)
        corners, offsets = of_mesh.of(some)
        kinds = np.diff(offsets)
        if of_texture is not None:
            pairs, _ = of_texture.of(some)
            is_whole = np.minimum.reduceat(pairs, offsets[:-1]) >= 0
            # Faces with equal entries in `kinds` have the same format. The entry is the number of
            # corners, negated if a corner has no texture coordinates.
            kinds = np.where(is_whole, kinds, -kinds)
        for kind in np.unique(kinds).tolist():
            alike = np.flatnonzero(kinds == kind)
            places = offsets[alike, np.newaxis] + np.arange(abs(kind))
            words, columns = ["%d"] * abs(kind), [*(corners[places] + first).T]
            if of_texture is not None and kind > 0:
                of_pairs = zip(columns, (pairs[places] + first).T, strict=True)
                words, columns = ["%d/%d"] * kind, [*chain.from_iterable(of_pairs)]
            columns += [values[some[alike]] for values in ends]
            words += ["%d"] * len(ends)
            row = begin.replace("#", str(abs(kind))) + " ".join(words) + "\n"
            lines[alike] = text_rows(row, columns).splitlines(keepends=True)
        yield lines.tolist()


def write_off(file: IO[bytes], content: Output) -> None:
    """Write OFF with given or stored colors of faces. COFF would declare colors of vertices."""
    mesh, colors = content.cells, content.colors
    colors = content.stored_colors("face") if colors is None else colors
    file.write(b"OFF\n%d %d 0\n" % (mesh.n_vertices, mesh.n_faces))
    write_rows(file, " ".join([coordinate_format(mesh.vertices)] * 3) + "\n", list(mesh.vertices.T))
    ends = () if colors is None else tuple(colors.T)
    for lines in _face_lines(mesh, np.arange(mesh.n_faces), "# ", 0, ends=ends):
        file.write(b"".join(lines))


def write_stl(file: IO[bytes], content: Output) -> None:
    """Write text with one solid per region, class or part, or binary data if there are none.

    Binary data needs coordinates that float32 can represent. Undefined normals are 0.
    """
    mesh = content.cells
    normals = area_vectors(mesh, checked_threads(None))
    lengths = np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    normals /= np.where(lengths > 0, lengths, 1.0)
    parts = content.parts()
    if parts is None and not content.ascii and fits_single(mesh.vertices):
        triangles = np.zeros(mesh.n_faces, TRIANGLE)
        triangles["normal"], triangles["corners"] = normals, mesh.vertices[mesh.faces]
        file.write(bytes(HEADER_SIZE) + mesh.n_faces.to_bytes(4, "little") + triangles.tobytes())
        return
    solids, listed = parts or (np.zeros(mesh.n_faces, np.intp), ["mesh"])
    names = np.array(listed)
    corner = " ".join(["      vertex", *[coordinate_format(mesh.vertices)] * 3]) + "\n"
    facet = f"  facet normal %.9g %.9g %.9g\n    outer loop\n{3 * corner}    endloop\n  endfacet\n"
    for name in dict.fromkeys(names[np.unique(solids)].tolist()):
        faces = np.flatnonzero((names == name)[solids])
        columns = [*normals[faces].T, *mesh.vertices[mesh.faces[faces]].reshape(-1, 9).T]
        file.write(b"solid %s\n" % name.encode("utf-8"))
        write_rows(file, facet, columns)
        file.write(b"endsolid %s\n" % name.encode("utf-8"))


def write_csv(file: IO[bytes], content: Output) -> None:
    """Write points as CSV: a line with names, then one line per point with all its properties."""
    cloud = content.cells
    columns: dict[str, Array] = dict(zip("xyz", cloud.points.T, strict=True))
    columns |= {} if content.labels is None else {"label": content.labels}
    for name, values in content.properties("vertex", columns).items():
        parts = np.atleast_2d(values.T)
        titles = [name] if values.ndim == 1 else [f"{name}_{i}" for i in range(len(parts))]
        columns |= zip(titles, parts, strict=True)
    for names, table in ((NORMALS, cloud.normals), (COLORS, content.cloud_colors)):
        if table is not None and not columns.keys() & {*names}:
            columns |= zip(names, table.T, strict=True)
    file.write(f"{','.join(columns)}\n".encode())
    row = ",".join(number_format(np.asarray(values)) for values in columns.values()) + "\n"
    write_rows(file, row, [*columns.values()])
