"""Surfaces and labels of the cortex: GIFTI, and the binary files of FreeSurfer."""

from __future__ import annotations

import binascii
import zlib
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

import numpy as np

from ..._types import Array, Ints
from ...errors import MeshError
from ..guards import Arrays, Content, as_doubles, counted, most_bytes_of
from .text import as_count, as_integers, shown
from .vtk_xml import first_bytes, parse_xml, parsed

SURFACE_ENDINGS = (".white", ".pial", ".inflated", ".smoothwm", ".orig", ".sphere")
"""Endings of FreeSurfer's surfaces, as in ``lh.white``."""

TRIANGLES = b"\xff\xff\xfe"
"""First bytes of a surface of triangles."""

_QUADS = (b"\xff\xff\xff", b"\xff\xff\xfd")

_TYPES = {"UINT8": "u1", "INT32": "i4", "FLOAT32": "f4", "INT64": "i8", "FLOAT64": "f8"}
"""NumPy's type, by the name of the type in GIFTI without ``NIFTI_TYPE_``."""

_COLOR_TABLE = 1
"""Tag of the table in an .annot file."""

_VERSION = -2
"""Number of the newer form of the table; the older one begins with its number of rows."""


def read_gifti(data: Content) -> Arrays:
    """Vertices and triangles of a GIFTI surface; its transforms are not applied."""
    file = _Gifti(data)
    points, triangles = file.array("POINTSET"), file.array("TRIANGLE")
    if points is None or triangles is None:
        raise MeshError("the GIFTI file has no points and triangles: it holds no surface")
    if points.shape[1:] != (3,) or triangles.shape[1:] != (3,):
        raise MeshError("points and triangles of a GIFTI file must have 3 numbers each")
    return as_doubles(points), as_integers(triangles, "vertex indices")


def gifti_labels(data: Content) -> Array:
    """The label of each vertex: the key less one, and -1 for key 0, which means no region."""
    keys = _Gifti(data).array("LABEL")
    if keys is None or keys.ndim != 1:
        raise MeshError("the GIFTI file holds no labels of vertices")
    return np.maximum(as_integers(keys, "labels").astype(np.int64), 0) - 1


def read_surface(data: Content) -> Arrays:
    """Vertices and triangles of a surface of FreeSurfer, which begins with lines of text."""
    if data[:3] in _QUADS:
        raise MeshError("the surface has quads of an old version: convert it by mris_convert first")
    begin = data.find(b"\n") + 1
    if data[:3] != TRIANGLES or not begin:
        raise MeshError("not a FreeSurfer surface: the magic number is missing")
    begin += data[begin : begin + 1] == b"\n"
    n_vertices, n_faces = _numbers(data, begin, 2, "counts").tolist()
    begin += 8
    vertices = _numbers(data, begin, 3 * n_vertices, counted(n_vertices, "vertex"), ">f4")
    begin += vertices.nbytes
    faces = _numbers(data, begin, 3 * n_faces, counted(n_faces, "face"))
    return as_doubles(vertices).reshape(-1, 3), faces.astype(np.int32).reshape(-1, 3)


def annot_labels(data: Content) -> Array:
    """The label of each vertex: its row in the color table less one; row 0 means no region."""
    (n_vertices,) = _numbers(data, 0, 1, "a count").tolist()
    pairs = _numbers(data, 4, 2 * n_vertices, counted(n_vertices, "vertex")).reshape(-1, 2)
    values = np.zeros(n_vertices, np.int32)
    if len(pairs) and not 0 <= pairs[:, 0].min() <= pairs[:, 0].max() < n_vertices:
        raise MeshError(f"an annotation is of a vertex that is not one of {n_vertices}")
    values[pairs[:, 0]] = pairs[:, 1]
    colors, rows = _color_table(data, 4 + pairs.nbytes)
    order = np.argsort(colors, kind="stable")
    places = np.searchsorted(colors[order], values).clip(max=len(colors) - 1)
    found = order[places]
    return np.where(colors[found] == values, np.maximum(rows[found], 0) - 1, -1)


def _color_table(data: Content, at: int) -> tuple[Ints, Ints]:
    """Packed color and number of each row of the table at the end of an .annot file."""
    tag, version = _numbers(data, at, 2, "a color table").tolist()
    if tag != _COLOR_TABLE or not (version == _VERSION or version > 0):
        raise MeshError("the annotation has no color table of version 1 or 2")
    at += 12 if version < 0 else 8  # version 2 has the highest number of a row first
    at = _behind_text(data, at)
    n_rows = version
    if version < 0:
        n_rows, at = int(_numbers(data, at, 1, "a count")[0]), at + 4
    colors, rows = [], []
    for place in range(n_rows):
        rows.append(place if version > 0 else int(_numbers(data, at, 1, "a row")[0]))
        at += 0 if version > 0 else 4
        at = _behind_text(data, at)
        red, green, blue, _ = _numbers(data, at, 4, "a color").tolist()
        at += 16
        colors.append(red + (green << 8) + (blue << 16))
    if not rows:
        raise MeshError("the color table of the annotation is empty")
    return np.array(colors), np.array(rows)


def _behind_text(data: Content, at: int) -> int:
    """Offset behind a text that begins with its length."""
    n_bytes = int(_numbers(data, at, 1, "the length of a name")[0])
    if not 0 <= n_bytes <= len(data) - at - 4:
        raise MeshError("a name ends behind the file: the file may be truncated or damaged")
    return at + 4 + n_bytes


def _numbers(data: Content, begin: int, n: int, what: str, dtype: str = ">i4") -> Array:
    """The `n` numbers of four bytes at an offset; a MeshError if the file ends before."""
    if not 0 <= 4 * n <= len(data) - begin:
        raise MeshError(f"the file ends within {what}: the file may be truncated or damaged")
    return np.frombuffer(data, dtype, n, begin)


@dataclass(frozen=True, eq=False)
class _DataArray:
    attributes: dict[str, str]
    texts: list[str] = field(default_factory=list)


class _Gifti:
    """The arrays of a GIFTI file, decoded when asked for; entities of XML are refused."""

    def __init__(self, data: Content) -> None:
        self._arrays: list[_DataArray] = []
        self._path: list[str] = []
        self._left = most_bytes_of(len(data))
        parser = expat.ParserCreate()
        parser.StartElementHandler = self._start
        parser.EndElementHandler = lambda _: self._path.pop()
        parser.CharacterDataHandler = self._characters
        parser.EntityDeclHandler = _refuse_entity
        parse_xml(parser, data[:])

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if not self._path and tag != "GIFTI":
            raise MeshError("the XML is not of GIFTI")
        if tag == "DataArray":
            self._arrays.append(_DataArray(attributes))
        self._path.append(tag)

    def _characters(self, text: str) -> None:
        if self._path == ["GIFTI", "DataArray", "Data"]:
            self._arrays[-1].texts.append(text)

    def array(self, intent: str) -> Array | None:
        """The first array with this intent; None if there is none."""
        wanted = f"NIFTI_INTENT_{intent}"
        for array in self._arrays:
            if array.attributes.get("Intent") == wanted:
                try:
                    return self._decoded(array)
                except MeshError as error:
                    raise MeshError(f"the array {wanted}: {error}") from None
        return None

    def _decoded(self, array: _DataArray) -> Array:
        values = array.attributes
        word = values.get("DataType", "").removeprefix("NIFTI_TYPE_")
        if word not in _TYPES:
            raise MeshError(
                f"expected numbers of a type like NIFTI_TYPE_FLOAT32, got {shown(word)}"
            )
        kind = np.dtype(_TYPES[word])
        n_sides = as_count(values.get("Dimensionality", "1"), "Dimensionality")
        sides = [as_count(values.get(f"Dim{i}", ""), f"Dim{i}") for i in range(min(n_sides, 3))]
        n = int(np.prod(np.array(sides, object)))
        self._left -= 8 * n
        if self._left < 0:
            raise MeshError(f"{counted(n, 'number')} are too many for a file of this size")
        found = self._content(array, kind, n)
        if len(found) != n:
            n_found = len(found)
            raise MeshError(f"expected {counted(n, 'number')}, got {n_found}: is the file damaged?")
        is_turned = values.get("ArrayIndexingOrder") == "ColumnMajorOrder"
        return found.reshape(sides, order="F" if is_turned else "C")

    def _content(self, array: _DataArray, kind: np.dtype[Any], n: int) -> Array:
        """The numbers of an array, flat; more or fewer than `n` if it is damaged."""
        form, text = array.attributes.get("Encoding", ""), "".join(array.texts)
        if form == "ASCII":
            return parsed(text.encode(), kind)
        stored = kind.newbyteorder(">" if array.attributes.get("Endian") == "BigEndian" else "<")
        packed = "".join(text.split()).encode()
        if form == "Base64Binary":
            return np.frombuffer(first_bytes(packed, n * kind.itemsize, True), stored).astype(kind)
        if form != "GZipBase64Binary":
            raise MeshError(f"data encoded as {shown(form)} are not read: save them in the file")
        try:
            content = zlib.decompressobj().decompress(
                binascii.a2b_base64(packed), (n + 1) * kind.itemsize
            )
        except (binascii.Error, zlib.error):
            raise MeshError("the compressed data are damaged") from None
        whole = len(content) // kind.itemsize * kind.itemsize
        return np.frombuffer(content[:whole], stored).astype(kind)


def _refuse_entity(*_: object) -> None:
    raise MeshError("the XML declares entities, which files of GIFTI do not have")
