"""Read PCD files: a header, then points as text, binary records or compressed columns."""

from __future__ import annotations

import math
import re
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError
from superfacets.kit import (
    Array,
    BinaryReader,
    Bools,
    Content,
    Floats,
    Input,
    Lines,
    Read,
    counted,
    shown,
)

from .grids import as_count

_KINDS = {
    f"{letter}{size}": f"<{letter.lower()}{size}"
    for letter, sizes in (("I", (1, 2, 4, 8)), ("U", (1, 2, 4, 8)), ("F", (4, 8)))
    for size in sizes
}
"""NumPy type for each TYPE and SIZE of a field in the header, for example F4."""

_DATA = re.compile(rb"^[ \t]*DATA[ \t]+(\S+)[^\n]*\n", re.MULTILINE)

_OTHER_NAMES = {
    "normal_x": "nx", "normal_y": "ny", "normal_z": "nz", "r": "red", "g": "green", "b": "blue",
}  # fmt: skip
"""Names of normals and colors in `MeshAttributes`, keyed by their names in PCD."""

_WORD = re.compile("[!-~]+")
"""Matches names that can be names in `MeshAttributes`."""

_PADDING = "_"
"""Name of fields that are only padding."""

_MAX_COMPRESSED = 100
"""Upper bound of the compression ratio. LZF compresses at most 264 bytes to 3 bytes."""

_AT_REST = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Pose that programs write if the pose is unknown: translation 0, identity quaternion."""


class _Field(NamedTuple):
    name: str
    dtype: np.dtype[Any]
    length: int  # number of values per point


class _Header(NamedTuple):
    fields: list[_Field]
    n_points: int
    viewpoint: Floats | None  # (3,) position of the scanner; None if it is unknown
    form: str  # "ascii", "binary" or "binary_compressed"
    begin: int  # offset of the first point

    @property
    def record_size(self) -> int:
        """Size of a point in bytes."""
        return sum(field.dtype.itemsize * field.length for field in self.fields)


def read_pcd(source: Input) -> Read:
    """Return the points of a PCD file with their normals, colors and attributes.

    Organized clouds, which have one point per pixel, contain points with a NaN or infinite
    coordinate, which are skipped.
    """
    data = source.data
    header = _header_of(data)
    read = {"ascii": _read_text, "binary": _read_records, "binary_compressed": _read_compressed}
    if header.form not in read:
        raise MeshError(f"expected DATA {', '.join(read)}, got {shown(header.form)}")
    columns: dict[str, Array] = {}
    for field, values in zip(header.fields, read[header.form](data, header), strict=True):
        if field.name in columns:
            source.declare(f"another point property {field.name}", "whose name is repeated")
        elif field.name != _PADDING:
            columns[field.name] = values
    columns = _with_colors(columns)
    is_known: Bools = np.all([np.isfinite(columns[axis]) for axis in "xyz"], axis=0)
    if not is_known.any():
        raise MeshError("no point of the file has a position: all coordinates are NaN")
    return source.cloud(
        ((_OTHER_NAMES.get(name, name), values[is_known]) for name, values in columns.items()),
        viewpoints=header.viewpoint, records=is_known,
    )  # fmt: skip


def _header_of(data: Content) -> _Header:
    found = _DATA.search(data[: 1 << 16])
    if found is None:
        raise MeshError("not a PCD file: the header has no line DATA")
    words = {}
    for line in data[: found.start()].decode("latin-1").splitlines():
        key, *values = line.split("#")[0].split() or [""]
        words[key] = values
    names = words.get("FIELDS", words.get("COLUMNS", []))
    sizes, kinds = words.get("SIZE", []), words.get("TYPE", [])
    counts = words.get("COUNT", ["1"] * len(names))
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise MeshError("FIELDS, SIZE, TYPE and COUNT of the header must have the same length")
    fields = [
        _Field(name, _type_of(kind, size), as_count(count, "COUNT"))
        for name, size, kind, count in zip(names, sizes, kinds, counts, strict=True)
    ]
    for axis in "xyz":
        if [field.length for field in fields if field.name == axis] != [1]:
            raise MeshError(f"FIELDS must contain {axis}, with COUNT 1")
    return _Header(
        [field for field in fields if field.length],
        _n_points(words),
        _viewpoint_of(words.get("VIEWPOINT", [])),
        found[1].decode("latin-1").lower(),
        found.end(),
    )


def _type_of(kind: str, size: str) -> np.dtype[Any]:
    if kind + size not in _KINDS:
        got = f"TYPE {shown(kind)} and SIZE {shown(size)}"
        raise MeshError(f"expected TYPE I, U or F with a SIZE such as 4, got {got}")
    return np.dtype(_KINDS[kind + size])


def _n_points(words: dict[str, list[str]]) -> int:
    """Return the number of points: POINTS, or WIDTH times HEIGHT if POINTS is missing."""
    sides = [as_count("".join(words.get(key, ["1"])), key) for key in ("WIDTH", "HEIGHT")]
    n_points = math.prod(sides)
    given = as_count("".join(words["POINTS"]), "POINTS") if "POINTS" in words else n_points
    if "WIDTH" in words and given != n_points:
        raise MeshError(f"POINTS is {given}, but WIDTH times HEIGHT is {n_points}")
    if not given:
        raise MeshError("the file has no points")
    return given


def _viewpoint_of(words: list[str]) -> Floats | None:
    try:
        pose = tuple(map(float, words))
    except ValueError:
        raise MeshError(f"VIEWPOINT must be 7 numbers, got {shown(' '.join(words))}") from None
    if len(pose) != 7 or pose == _AT_REST or not np.isfinite(pose).all():
        return None
    return np.array(pose[:3])


def _read_text(data: Content, header: _Header) -> list[Array]:
    lines = Lines.of(data, begin=header.begin, comment=b"#")
    width = sum(field.length for field in header.fields)
    lines.refuse(lines.counts != width, f"expected {counted(width, 'number')}")
    _check_points(len(lines), header)
    table = lines[: header.n_points].parse(np.float64).reshape(-1, width)
    ends = np.cumsum([field.length for field in header.fields])[:-1]
    parts = np.split(table, ends, axis=1)
    return [
        _as_declared(part[:, 0] if field.length == 1 else part, field)
        for field, part in zip(header.fields, parts, strict=True)
    ]


def _as_declared(values: Floats, field: _Field) -> Array:
    """Convert numbers of a text file to the declared type; coordinates remain float64."""
    if field.name in ("x", "y", "z"):
        return values
    kind = field.dtype.kind
    is_whole = np.all((values == np.floor(values)) & (np.abs(values) < 2.0**32))
    # In text files, packed colors are integers, even if the header declares floats.
    if field.name in ("rgb", "rgba") and is_whole and (kind != "f" or values.max() >= 1):
        return (values.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32)
    with np.errstate(invalid="ignore", over="ignore"):
        declared = values.astype(field.dtype)
    if kind != "f" and not np.array_equal(declared, values):
        size = counted(field.dtype.itemsize, "byte")
        raise MeshError(f"the field {field.name} must have integers of {size}")
    return declared


def _read_records(data: Content, header: _Header) -> list[Array]:
    _check_points((len(data) - header.begin) // header.record_size, header)
    kinds = [(f"{i}", field.dtype, (field.length,)) for i, field in enumerate(header.fields)]
    table = np.frombuffer(data, np.dtype(kinds), header.n_points, header.begin)
    return [_flat(table[f"{i}"]) for i in range(len(kinds))]


def _read_compressed(data: Content, header: _Header) -> list[Array]:
    """Read columns that are stored one after the other and compressed together."""
    begin = header.begin + 8
    sizes = np.frombuffer(data[header.begin : begin].ljust(8, b"\0"), "<u4").tolist()
    n_packed = min(sizes[0], max(len(data) - begin, 0))
    n_bytes = header.n_points * header.record_size
    if n_packed != sizes[0] or sizes[1] != n_bytes or n_bytes > _MAX_COMPRESSED * n_packed:
        raise MeshError(
            f"{counted(header.n_points, 'point')} must have {n_bytes} bytes, but the file declares"
            f" {sizes[1]} bytes, compressed to {sizes[0]}, and has {n_packed} compressed bytes:"
            " it may be truncated or damaged"
        )
    content = BinaryReader(data, begin=begin).unpacked(n_packed, n_bytes)
    columns, place = [], 0
    for field in header.fields:
        end = place + header.n_points * field.length * field.dtype.itemsize
        columns.append(_flat(content[place:end].view(field.dtype).reshape(-1, field.length)))
        place = end
    return columns


def _check_points(n_found: int, header: _Header) -> None:
    if n_found < header.n_points:
        raise MeshError(
            f"the header declares {counted(header.n_points, 'point')}, but the file has {n_found}:"
            " the file may be truncated"
        )


def _flat(values: Array) -> Array:
    """Return a table in contiguous memory; a table with one column becomes one-dimensional."""
    return np.ascontiguousarray(values[:, 0] if values.shape[1] == 1 else values)


def _with_colors(columns: dict[str, Array]) -> dict[str, Array]:
    """Replace packed colors by red, green and blue; the fourth byte, opacity, is ignored."""
    name = next((name for name in ("rgb", "rgba") if name in columns), None)
    if name is None or columns[name].ndim != 1 or columns[name].itemsize != 4:
        return columns
    packed = columns[name].view(np.uint32)
    colors = {
        color: (packed >> shift & 255).astype(np.uint8)
        for color, shift in (("red", 16), ("green", 8), ("blue", 0))
    }
    return {key: values for key, values in columns.items() if key != name} | colors
