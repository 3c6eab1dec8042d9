"""Read PCD files with pypcd4: a header, then points as text, binary records or compressed columns.

The sizes that the header declares are first compared with the file. pypcd4 gets a header that is
written from these sizes, because it does not accept all headers.
"""

from __future__ import annotations

import io
import math
import re
from typing import NamedTuple

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import (
    Array,
    Bools,
    Content,
    Floats,
    Input,
    Lines,
    Read,
    counted,
    reason_of,
    shortened,
    shown,
)

from .grids import as_count

_SIZES = {"I": (1, 2, 4, 8), "U": (1, 2, 4, 8), "F": (4, 8)}
"""Sizes in bytes of the numbers of a field, for each TYPE."""

_FORMS = ("ascii", "binary", "binary_compressed")

_DATA = re.compile(rb"^[ \t]*DATA[ \t]+(\S+)[^\n]*\n", re.MULTILINE)

_OTHER_NAMES = {
    "normal_x": "nx", "normal_y": "ny", "normal_z": "nz", "r": "red", "g": "green", "b": "blue",
}  # fmt: skip
"""Names of normals and colors in `MeshAttributes`, keyed by their names in PCD."""

_PADDING = "_"
"""Name of fields that are only padding."""

_MAX_COMPRESSED = 100
"""Upper bound of the compression ratio. LZF compresses at most 264 bytes to 3 bytes."""

_MAX_NUMBERS = 10_000
"""Maximum number of numbers per point. The largest known descriptors have 2,000."""

_AT_REST = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Pose that programs write if the pose is unknown: translation 0, identity quaternion."""


class _Field(NamedTuple):
    name: str
    kind: str  # TYPE
    size: int  # of a number, in bytes
    length: int  # number of values per point


class _Header(NamedTuple):
    fields: list[_Field]
    n_points: int
    viewpoint: Floats | None  # (3,) position of the scanner; None if it is unknown
    form: str  # one of _FORMS
    begin: int  # offset of the first point

    @property
    def record_size(self) -> int:
        """Size of a point in bytes."""
        return sum(field.size * field.length for field in self.fields)

    @property
    def text(self) -> str:
        """The header for pypcd4: all names differ, and numbers of a text are float64."""
        kinds = [("F", 8) if self.form == "ascii" else field[1:3] for field in self.fields]
        rows = {
            "VERSION": ["0.7"], "FIELDS": [f"f{i}" for i in range(len(self.fields))],
            "SIZE": [size for _, size in kinds], "TYPE": [kind for kind, _ in kinds],
            "COUNT": [field.length for field in self.fields], "WIDTH": [self.n_points],
            "HEIGHT": [1], "VIEWPOINT": [0, 0, 0, 1, 0, 0, 0], "POINTS": [self.n_points],
            "DATA": [self.form],
        }  # fmt: skip
        return "".join(f"{key} {' '.join(map(str, words))}\n" for key, words in rows.items())


def read_pcd(source: Input) -> Read:
    """Return the points of a PCD file with their normals, colors and attributes.

    Organized clouds, which have one point per pixel, contain points with a NaN or infinite
    coordinate, which are skipped.
    """
    header = _header_of(source.data)
    table = _points_of(source.data, header)
    columns: dict[str, Array] = {}
    is_text = header.form == "ascii"
    names, place = table.dtype.names or (), 0
    for field in header.fields:
        parts = [table[name] for name in names[place : place + field.length]]
        place += field.length
        if field.name in columns:
            source.declare(f"another point property {field.name}", "whose name is repeated")
        elif field.name != _PADDING:
            values = parts[0].copy() if len(parts) == 1 else np.stack(parts, axis=1)
            columns[field.name] = _as_declared(values, field) if is_text else values
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
    form = found[1].decode("latin-1").lower()
    if form not in _FORMS:
        raise MeshError(f"expected DATA {', '.join(_FORMS)}, got {shown(form)}")
    viewpoint = _viewpoint_of(words.get("VIEWPOINT", []))
    return _Header(_fields_of(words), _n_points(words), viewpoint, form, found.end())


def _fields_of(words: dict[str, list[str]]) -> list[_Field]:
    names = words.get("FIELDS", words.get("COLUMNS", []))
    if not {*"xyz"} & {*names}:  # PDAL writes names in upper case
        names = [name.lower() for name in names]
    sizes, kinds = words.get("SIZE", []), words.get("TYPE", [])
    counts = words.get("COUNT", ["1"] * len(names))
    if not len(names) == len(sizes) == len(kinds) == len(counts):
        raise MeshError("FIELDS, SIZE, TYPE and COUNT of the header must have the same length")
    fields = []
    for name, size, kind, count in zip(names, sizes, kinds, counts, strict=True):
        if size not in map(str, _SIZES.get(kind, ())):
            got = f"TYPE {shown(kind)} and SIZE {shown(size)}"
            raise MeshError(f"expected TYPE I, U or F with a SIZE such as 4, got {got}")
        if length := as_count(count, "COUNT"):
            fields.append(_Field(name, kind, int(size), length))
    for axis in "xyz":
        if [field.length for field in fields if field.name == axis] != [1]:
            raise MeshError(f"FIELDS must contain {axis}, with COUNT 1")
    if sum(field.length for field in fields) > _MAX_NUMBERS:
        raise MeshError(f"a point may have at most {_MAX_NUMBERS:,} numbers: check COUNT")
    return fields


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


def _points_of(data: Content, header: _Header) -> Array:
    """Return the points, (N,), as records whose fields have the declared types."""
    pypcd4 = kit.import_extra("pypcd4", "a .pcd file", "pcd")
    body = data[header.begin :]
    if header.form == "ascii":
        body = _checked_lines(data, header)
    elif header.form == "binary":
        _check_points(len(body) // header.record_size, header)
    else:
        _check_compressed(body, header)
    file = io.BytesIO(header.text.encode() + body)
    try:
        with np.errstate(all="ignore"):
            table: Array = np.atleast_1d(pypcd4.PointCloud.from_fileobj(file).pc_data)
    except Exception as error:  # numpy, lzf and pydantic raise exceptions of many classes
        reason = shortened(reason_of(error))
        raise MeshError(f"the points cannot be read, the file may be damaged: {reason}") from None
    _check_points(len(table), header)
    return table


def _checked_lines(data: Content, header: _Header) -> bytes:
    """Return the lines of points with one space between numbers, as pypcd4 expects them."""
    lines = Lines.of(data, begin=header.begin, comment=b"#")
    width = sum(field.length for field in header.fields)
    lines.refuse(lines.counts != width, f"expected {counted(width, 'number')}")
    _check_points(len(lines), header)
    return b"\n".join(b" ".join(lines.content(i).split()) for i in range(header.n_points))


def _check_compressed(body: bytes, header: _Header) -> None:
    sizes = np.frombuffer(body[:8].ljust(8, b"\0"), "<u4").tolist()
    n_packed = min(sizes[0], max(len(body) - 8, 0))
    n_bytes = header.n_points * header.record_size
    if n_packed != sizes[0] or sizes[1] != n_bytes or n_bytes > _MAX_COMPRESSED * n_packed:
        raise MeshError(
            f"{counted(header.n_points, 'point')} must have {n_bytes} bytes, but the file declares"
            f" {sizes[1]} bytes, compressed to {sizes[0]}, and has {n_packed} compressed bytes:"
            " it may be truncated or damaged"
        )


def _check_points(n_found: int, header: _Header) -> None:
    if n_found < header.n_points:
        raise MeshError(
            f"the header declares {counted(header.n_points, 'point')}, but the file has {n_found}:"
            " the file may be truncated"
        )


def _as_declared(values: Array, field: _Field) -> Array:
    """Convert numbers of a text file to the declared type; coordinates remain float64."""
    if field.name in ("x", "y", "z"):
        return values
    is_whole = np.all((values == np.floor(values)) & (np.abs(values) < 2.0**32))
    # In text files, packed colors are integers, even if the header declares floats.
    if field.name in ("rgb", "rgba") and is_whole and (field.kind != "F" or values.max() >= 1):
        return (values.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32)
    with np.errstate(invalid="ignore", over="ignore"):
        declared = values.astype(f"{field.kind.lower()}{field.size}")
    if field.kind != "F" and not np.array_equal(declared, values):
        size = counted(field.size, "byte")
        raise MeshError(f"the field {field.name} must have integers of {size}")
    return declared


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
