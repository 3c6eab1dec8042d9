"""Read surfaces, labels and values of brain cortex meshes: GIFTI and FreeSurfer files.

Sizes that a file declares are compared with its content before memory is allocated.
"""

from __future__ import annotations

import binascii
import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, BinaryReader, Content, Input, Lines, Read, counted, shown

from .grids import as_count
from .vtk_xml import NUMBER_TYPES, parsed_numbers, parsed_xml

TRIANGLES = b"\xff\xff\xfe"
"""First bytes of FreeSurfer files with a surface of triangles."""

_CURVE = b"\xff\xff\xff"
"""First bytes of FreeSurfer files with a number per vertex."""

_IDENTITY = [*("1", *[""] * 4) * 3, "1"]
"""Numbers of an identity matrix, without zeros at their ends."""

STRUCTURE = "comment AnatomicalStructurePrimary "
"""Beginning of the comment that stores the anatomical structure of a surface."""

_TYPES = {f"NIFTI_TYPE_{word.upper()}": code for word, code in NUMBER_TYPES.items()}


def is_gifti(data: Content) -> bool:
    """Return whether the content begins like a GIFTI file."""
    return b"<GIFTI" in data[:1000]


def is_surface(data: Content) -> bool:
    """Return whether the content begins like a FreeSurfer surface of triangles."""
    return data[:3] == TRIANGLES


def read_gifti(source: Input) -> Read:
    """Read a GIFTI surface, its other arrays, and its anatomical structure as a comment."""
    data, root = source.data, _parsed(source.data)
    arrays = list(root.iter("DataArray"))
    found = {}
    for intent in ("POINTSET", "TRIANGLE"):
        first = next((one for one in arrays if one.get("Intent") == f"NIFTI_INTENT_{intent}"), None)
        if first is None:
            raise MeshError(
                f"the GIFTI file has no surface: it has no {intent}; if it has labels or values of"
                " vertices, give the surface of these vertices first"
            )
        arrays.remove(first)
        found[intent] = _values_of(first, len(data))
    points, triangles = found.values()
    if points.shape[1:] != (3,) or triangles.shape[1:] != (3,):
        raise MeshError("points and triangles of a GIFTI file must have 3 numbers each")
    pairs = {pair.findtext("Name"): pair.findtext("Value") for pair in root.iter("MD")}
    structure = pairs.pop(STRUCTURE.split()[1], None)
    for name in filter(lambda each: each not in ("GeometricType", "TopologicalType"), pairs):
        source.declare(f"metadata {name}")
    for matrix in root.iter("MatrixData"):
        words = [word.rstrip("0").rstrip(".") for word in (matrix.text or "").split()]
        if words and words != _IDENTITY:
            source.declare("transform of coordinates")
    comments = (f"{STRUCTURE}{structure.strip()}",) if structure else ()
    corners = kit.as_integers(triangles, "vertex indices")
    vertex = _others_of(arrays, len(data), len(points)) if source.keep else ()
    return source.mesh(points, corners, vertex=vertex, comments=comments)


def _others_of(
    arrays: list[Element], n_bytes: int, n_vertices: int
) -> Iterator[tuple[str, Array | str]]:
    """Yield arrays that have one row per vertex, and why others are left out."""
    for array in arrays:
        pairs = {pair.findtext("Name"): pair.findtext("Value") for pair in array.iter("MD")}
        intent = array.get("Intent", "").removeprefix("NIFTI_INTENT_").lower()
        values = _values_of(array, n_bytes)
        fits = values.shape[:1] == (n_vertices,)
        yield pairs.get("Name") or intent, values if fits else "which has no row per vertex"


def gifti_labels(data: Content) -> Array:
    """Return the label of each vertex: its key minus 1. Key 0 means no region and becomes -1."""
    keys = _gifti_array(data, Intent="NIFTI_INTENT_LABEL")
    if keys is None or keys.ndim != 1:
        raise MeshError("the GIFTI file has no labels of vertices")
    return np.maximum(kit.as_integers(keys, "labels").astype(np.int64), 0) - 1


def _parsed(data: Content) -> Element:
    """Parse the XML of a GIFTI file; own entities are refused, because they can be endless."""
    if data.find(b"<!ENTITY") >= 0:
        raise MeshError("the GIFTI file must not define entities")
    if data.find(b"ExternalFileBinary") >= 0:  # for security, refuse names of other files
        raise MeshError("the GIFTI file refers to another file: save all arrays in one file")
    return parsed_xml(data[:], "GIFTI")


def _gifti_array(data: Content, **wanted: str) -> Array | None:
    """Return the first array whose XML element has the attributes `wanted`, or None."""
    arrays = (
        one for one in _parsed(data).iter("DataArray") if wanted.items() <= one.attrib.items()
    )
    array = next(arrays, None)
    return None if array is None else _values_of(array, len(data))


def _values_of(array: Element, n_file: int) -> Array:
    """Decode an array of a file of `n_file` bytes."""
    word, text = array.get("DataType", ""), array.findtext("Data", "")
    if word not in _TYPES:
        raise MeshError(f"expected a DataType such as NIFTI_TYPE_FLOAT32, got {shown(word)}")
    stored = np.dtype(_TYPES[word])
    n_axes = as_count(array.get("Dimensionality", ""), "Dimensionality")
    shape = [as_count(array.get(f"Dim{axis}", ""), f"Dim{axis}") for axis in range(n_axes)]
    n_bytes = math.prod(shape) * stored.itemsize
    if n_bytes > kit.most_bytes_of(n_file):
        raise MeshError(f"an array declares {counted(n_bytes, 'byte')}, too many for the file size")
    if array.get("Encoding") == "ASCII":
        values = parsed_numbers(text.encode(), stored)
    else:
        order: Literal["<", ">"] = "<" if array.get("Endian") == "LittleEndian" else ">"
        content = _decoded(text, n_bytes, is_packed=array.get("Encoding") == "GZipBase64Binary")
        values = np.frombuffer(content, stored.newbyteorder(order)).astype(stored)
    if len(values) != math.prod(shape):
        raise MeshError(f"an array of shape {tuple(shape)} has {counted(len(values), 'number')}")
    is_column_major = array.get("ArrayIndexingOrder") == "ColumnMajorOrder"
    return values.reshape(shape, order="F" if is_column_major else "C")


def _decoded(text: str, n_bytes: int, *, is_packed: bool) -> bytes:
    """Return at most `n_bytes` + 1 bytes of base64, decompressed if `is_packed`."""
    try:
        content = binascii.a2b_base64(text.encode())
        if is_packed:
            content = zlib.decompressobj().decompress(content, n_bytes + 1)
    except (binascii.Error, zlib.error) as error:
        raise MeshError(f"the GIFTI file is damaged: {error}") from None
    if len(content) != n_bytes:
        found = len(content) if len(content) < n_bytes else "more"
        raise MeshError(f"an array declares {n_bytes} bytes, but its data has {found}")
    return content


def read_surface(source: Input) -> Read:
    """Read a FreeSurfer surface of triangles."""
    data = source.data
    if not is_surface(data):
        raise MeshError("not a FreeSurfer surface of triangles: the magic number is missing")
    reader = BinaryReader(data, ">", 3)
    for _ in range(2):  # a line with creator and date, and an empty line
        reader.text(b"\n")
    n_vertices, n_faces = reader.take("2i")
    vertices = reader.numbers(3 * n_vertices, "f4").reshape(-1, 3)
    return source.mesh(vertices, reader.numbers(3 * n_faces, "i4").reshape(-1, 3))


def gifti_values(data: Content) -> Array:
    """Return the number of each vertex in a GIFTI file."""
    values = _gifti_array(data, Dimensionality="1")
    if values is None:
        raise MeshError("the GIFTI file has no array with one number per vertex")
    return values


def curve_values(data: Content) -> Array:
    """Return the number of each vertex in a FreeSurfer file, for example ``lh.thickness``."""
    if data[:3] != _CURVE:
        raise MeshError("not a FreeSurfer file of values: the magic number is missing")
    reader = BinaryReader(data, ">", 3)
    n_vertices, _, n_numbers = reader.take("3i")  # the second number is the face count
    if n_numbers != 1:
        raise MeshError(f"expected one number per vertex, got {n_numbers}")
    return reader.numbers(n_vertices, "f4")


def listed_vertices(data: Content) -> Array:
    """Return the vertices that a FreeSurfer label file lists, for example ``lh.cortex.label``."""
    lines = Lines.of(data, comment=b"#")
    rows = lines[1:]  # vertex, x, y, z, value
    rows.refuse(rows.counts != 5, "a listed vertex needs 5 numbers")
    if lines[:1].parse(np.int64).tolist() != [len(rows)]:
        raise MeshError(f"expected the number of listed vertices, {len(rows)}, before their rows")
    return kit.as_integers(rows.parse(np.float64)[::5], "listed vertices")


def label_names(path: kit.StrPath) -> dict[int, str]:
    """Return the names in the table of a ``.label.gii`` or ``.annot`` file, keyed by label.

    Labels are as in `read_labels`; -1 means no area. Raises a MeshError if the file is damaged.
    """
    path = Path(path)
    ending, data = kit.known_ending(path, kit.FORMATS.key_labels), kit.read_content(path)
    with kit.named_errors(path):
        if ending == ".annot":
            names = _annot_tables(BinaryReader(data, ">"))[2]
        else:
            rows = _parsed(data).iterfind("LabelTable/Label")
            names = {as_count(row.get("Key", ""), "Key"): row.text or "" for row in rows}
    return {max(key, 0) - 1: name for key, name in sorted(names.items())}


def annot_labels(data: Content) -> Array:
    """Return the label of each vertex: its row in the color table minus 1; -1 means no region."""
    pairs, rows, _ = _annot_tables(BinaryReader(data, ">"))
    colors, places = np.unique(pairs[:, 1], return_inverse=True)
    found = np.array([rows.get(color, 0) for color in colors.tolist()], np.int64)
    return np.maximum(found, 0)[places.ravel()] - 1


def _annot_tables(reader: BinaryReader) -> tuple[Array, dict[int, int], dict[int, str]]:
    """Return vertices and their colors, (V, 2), the row of each color, and the name of each row."""
    pairs = reader.numbers(2 * reader.take("i")[0], "i4").reshape(-1, 2)
    rows, names = {0: 0}, dict[int, str]()
    has_table, n_rows = reader.take("2i")
    if is_sparse := n_rows < 0:  # rows are numbered; in older files they are consecutive
        reader.take("i")  # one above the highest number
    reader.skip(reader.take("i")[0])  # name of the table
    if is_sparse:
        (n_rows,) = reader.take("i")
    if not has_table or n_rows < 1:
        raise MeshError("the FreeSurfer file has no color table")
    for row in range(n_rows):
        (number,) = reader.take("i") if is_sparse else (row,)
        name = reader.numbers(reader.take("i")[0], "u1").tobytes()
        names.setdefault(number, name.rstrip(b"\0").decode("utf-8", "replace"))
        red, green, blue, _ = reader.take("4i")
        rows.setdefault(red | green << 8 | blue << 16, number)
    return pairs, rows, names
