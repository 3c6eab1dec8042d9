"""STL, ASCII and binary: three corners per triangle, not merged into shared vertices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..errors import MeshError
from .guards import Arrays, as_doubles, counted
from .text import Lines, iterate_lines

__all__ = ["read_stl"]

HEADER_SIZE = 80

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

KEYWORDS = (b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"solid", b"endsolid")
FACET, OUTER, VERTEX, ENDLOOP, ENDFACET, SOLID, ENDSOLID = range(7)

TRIANGLE_LINES = (FACET, OUTER, VERTEX, VERTEX, VERTEX, ENDLOOP, ENDFACET)


def read_stl(data: bytes) -> Arrays:
    """Vertices, three per face, and faces of an STL file; the stored normals are skipped.

    lagrange is not used: it returns no faces for a cut or an upper-case file, mixes up the corners
    behind a polygon, and returns memory that was never written for a coordinate that is no number.
    """
    corners = _read_binary(data) if _is_binary(data) else _read_ascii(data)
    vertices = as_doubles(corners).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _declared(data: bytes) -> tuple[int, int]:
    """Faces that a binary file with this head declares, and the bytes that it then has."""
    n_faces = int.from_bytes(data[HEADER_SIZE : HEADER_SIZE + 4], "little")
    return n_faces, HEADER_SIZE + 4 + n_faces * TRIANGLE.itemsize


def _is_binary(data: bytes) -> bool:
    """Tell by the size first: the header of a binary file may begin with "solid" as well."""
    if len(data) >= HEADER_SIZE + 4 and len(data) == _declared(data)[1]:
        return True
    return data.lstrip()[:5].lower() != b"solid" or b"\0" in data[: HEADER_SIZE + 4]


def _read_binary(data: bytes) -> npt.NDArray[np.float32]:
    if len(data) < HEADER_SIZE + 4:
        raise MeshError(f"not an STL file: no word solid, and only {counted(len(data), 'byte')}")
    n_faces, size = _declared(data)
    if size > len(data) or data[size:].strip(b"\0 \r\n\t"):
        raise MeshError(
            f"not an STL file, or damaged: {counted(n_faces, 'declared triangle')} take"
            f" {size} bytes but the file has {len(data)}"
        )
    triangles = np.frombuffer(data, dtype=TRIANGLE, count=n_faces, offset=HEADER_SIZE + 4)
    corners: npt.NDArray[np.float32] = triangles["corners"]
    return corners


def _read_ascii(data: bytes) -> npt.NDArray[np.float64]:
    blocks = [_read_block(lines) for lines in iterate_lines(data)]
    vertices, keywords, numbers = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    _check_solids(keywords, numbers)
    is_content = (keywords != SOLID) & (keywords != ENDSOLID)
    _check_facets(keywords[is_content], numbers[is_content])
    return vertices


def _read_block(
    lines: Lines,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int8], npt.NDArray[np.int64]]:
    """Flat coordinates of the vertex lines; keyword and number of each line."""
    masks = [lines.having_keyword(keyword, any_case=True) for keyword in KEYWORDS]
    keywords = np.full(len(lines), len(KEYWORDS), dtype=np.int8)
    for keyword, mask in enumerate(masks):
        keywords[mask] = keyword
    vertices = lines.after_keyword(masks[VERTEX], KEYWORDS[VERTEX])
    wrong = np.flatnonzero(vertices.counts != 3)
    if len(wrong):
        number, n_tokens = int(vertices.numbers[wrong[0]]), int(vertices.counts[wrong[0]])
        raise MeshError(f"line {number}: a vertex needs 3 coordinates, got {n_tokens}")
    return vertices.parse(np.float64), keywords, lines.numbers


def _check_solids(keywords: npt.NDArray[np.int8], numbers: npt.NDArray[np.int64]) -> None:
    """Raise a MeshError if the solids are not closed, one after the other."""
    borders = keywords[(keywords == SOLID) | (keywords == ENDSOLID)]
    expected = np.resize([SOLID, ENDSOLID], len(borders) + len(borders) % 2)
    if keywords[-1] != ENDSOLID or not np.array_equal(borders, expected):
        raise MeshError(
            f"line {numbers[-1]}: the file ends, but not each `solid` with an `endsolid`:"
            " is it cut?"
        )


def _check_facets(keywords: npt.NDArray[np.int8], numbers: npt.NDArray[np.int64]) -> None:
    """Raise a MeshError at the first line that no list of triangles has there."""
    expected = np.resize(TRIANGLE_LINES, -(-len(keywords) // 7) * 7)
    padded = np.append(keywords, np.full(len(expected) - len(keywords), -1))
    wrong = np.flatnonzero(padded != expected)
    if not len(wrong):
        return
    place = int(wrong[0])
    if place >= len(keywords):
        raise MeshError("the last facet is incomplete")
    if expected[place] == ENDLOOP and keywords[place] == VERTEX:
        raise MeshError(
            f"line {numbers[place]}: faces[{place // 7}] has more than 3 corners;"
            " only triangles are supported yet: triangulate the mesh first"
        )
    wanted = KEYWORDS[expected[place]].decode()
    raise MeshError(f"line {numbers[place]}: expected the keyword {wanted}")
