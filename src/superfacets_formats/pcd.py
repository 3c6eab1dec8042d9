"""Read and write PCD files: a header, then points as text, binary records or compressed columns.

pypcd4 checks headers and decompresses columns. Declared sizes are first compared with the file.
"""

from __future__ import annotations

import io
import math
import re
from typing import IO, Any, NamedTuple, cast

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Content, Input, Lines, Output, Read, counted, shown

from .grids import as_count

_FORMS = ("ascii", "binary", "binary_compressed")

_KINDS = {"i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"}

_DATA = re.compile(rb"^[ \t]*DATA[ \t]+(\S+)[^\n]*\n", re.MULTILINE)

_NORMALS = {"nx": "normal_x", "ny": "normal_y", "nz": "normal_z"}
"""Names of normals in PCD, keyed by their names in `MeshAttributes`."""

_OTHER_NAMES = {"r": "red", "g": "green", "b": "blue", **{b: a for a, b in _NORMALS.items()}}
"""Names in `MeshAttributes`, keyed by names in PCD."""

_PADDING = "_"
"""Name of fields that are only padding."""

_MAX_COMPRESSED = 100
"""Upper bound of the compression ratio. LZF compresses at most 264 bytes to 3 bytes."""

_MAX_NUMBERS = 10_000
"""Maximum number of values per point. The largest known descriptors have 2,000."""

ROWS_AT_ONCE = 1 << 14
"""Number of records that are written at a time."""

_AT_REST = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
"""Pose that programs write if the pose is unknown: translation 0, identity quaternion."""


class _Header(NamedTuple):
    names: list[str]  # names of the fields in the file
    kinds: list[np.dtype[Any]]  # their declared types
    shape: Any  # `pypcd4.MetaData`, with other names
    begin: int  # offset of the first point


def read_pcd(source: Input) -> Read:
    """Return the points of a PCD file; points without a position, as in grids, are skipped."""
    header = _header_of(source.data)
    table = _points_of(source.data, header)
    columns: dict[str, Array] = {}
    parts = [table[name] for name in table.dtype.names or ()]
    for name, kind, n in zip(*header[:2], header.shape.count, strict=True):
        values = parts[0].copy() if n == 1 else np.stack(parts[:n], axis=1)
        del parts[:n]
        if name in columns:
            source.declare(f"another point property {name}", "whose name is repeated")
        elif name != _PADDING:
            columns[name] = _as_declared(values, name, kind)
    columns = _with_colors(columns)
    is_known = np.all([np.isfinite(columns[axis]) for axis in "xyz"], axis=0)
    if not is_known.any():
        raise MeshError("no point of the file has a position: all coordinates are NaN")
    pose = header.shape.viewpoint
    is_placed = pose != _AT_REST and np.isfinite(pose).all()
    return source.cloud(
        ((_OTHER_NAMES.get(name, name), values[is_known]) for name, values in columns.items()),
        viewpoints=np.array(pose[:3]) if is_placed else None, records=is_known,
    )  # fmt: skip


def _header_of(data: Content) -> _Header:
    """Return the header, with sizes that pypcd4 has checked, but not compared with the file."""
    pypcd4 = kit.import_extra("pypcd4", "a .pcd file", "pcd")
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
    names, *rows = _fields_of(words)
    n_points = _n_points(words)
    try:
        shape = pypcd4.MetaData(
            fields=[f"f{i}" for i in range(len(names))], size=rows[0], type=rows[1], count=rows[2],
            points=n_points, width=n_points, data=form, viewpoint=words.get("VIEWPOINT", _AT_REST),
        )  # fmt: skip
    except ValueError as error:
        key = str(cast("Any", error).errors()[0]["loc"][0]).upper()
        given = shown(" ".join(words.get(key, [])))
        raise MeshError(f"{key} of the header is not valid: {given}") from None
    kinds = [f"{kind.lower()}{size}" for kind, size in zip(shape.type, shape.size, strict=True)]
    if not {*kinds} <= _KINDS:
        raise MeshError(f"expected TYPE I, U or F with a SIZE such as 4, got {kinds}")
    if form == "ascii":  # `_as_declared` converts the numbers
        shape = shape.derive(size=(8,) * len(names), type=("F",) * len(names))
    return _Header(names, [*map(np.dtype, kinds)], shape, found.end())


def _fields_of(words: dict[str, list[str]]) -> tuple[list[str], list[str], list[str], list[int]]:
    """Return names, sizes, types and numbers of values of the fields that have values."""
    names = words.get("FIELDS", words.get("COLUMNS", []))
    if not {*"xyz"} & {*names}:  # PDAL writes names in upper case
        names = [name.lower() for name in names]
    counts = words.get("COUNT", ["1"] * len(names))
    rows = [names, words.get("SIZE", []), words.get("TYPE", []), counts]
    if len({*map(len, rows)}) > 1:
        raise MeshError("FIELDS, SIZE, TYPE and COUNT of the header must have the same length")
    lengths = [as_count(count, "COUNT") for count in counts]
    for axis in "xyz":
        if [n for name, n in zip(names, lengths, strict=True) if name == axis and n] != [1]:
            raise MeshError(f"FIELDS must contain {axis}, with COUNT 1")
    if sum(lengths) > _MAX_NUMBERS:
        raise MeshError(f"a point may have at most {_MAX_NUMBERS:,} numbers: check COUNT")
    fields = [field for field in zip(*rows[:3], lengths, strict=True) if field[3]]
    names, sizes, kinds, lengths = map(list, zip(*fields, strict=True))
    return names, sizes, kinds, lengths


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


def _points_of(data: Content, header: _Header) -> Array:
    """Return the points, (N,), as records with the fields of `header.shape`."""
    pypcd4 = kit.import_extra("pypcd4", "a .pcd file", "pcd")
    shape, dtype = header.shape, header.shape.build_dtype()
    n_bytes = shape.points * dtype.itemsize
    if shape.data == "ascii":
        lines = Lines.of(data, begin=header.begin, comment=b"#")
        width = sum(shape.count)
        lines.refuse(lines.counts != width, f"expected {counted(width, 'number')}")
        _check_points(len(lines), header)
        return lines[: shape.points].parse(np.float64).view(dtype)
    if shape.data == "binary":
        _check_points((len(data) - header.begin) // dtype.itemsize, header)
        return np.frombuffer(data, dtype, shape.points, header.begin)
    body = data[header.begin :]
    sizes = np.frombuffer(body[:8].ljust(8, b"\0"), "<u4").tolist()
    n_packed = min(sizes[0], max(len(body) - 8, 0))
    if n_packed != sizes[0] or sizes[1] != n_bytes or n_bytes > _MAX_COMPRESSED * n_packed:
        raise MeshError(
            f"{counted(shape.points, 'point')} must have {n_bytes} bytes, but the file declares"
            f" {sizes[1]} bytes, compressed to {sizes[0]}, and has {n_packed} compressed bytes: it"
            " may be truncated or damaged"
        )
    try:
        file = io.BytesIO(shape.compose_header().encode() + body)
        return np.asarray(pypcd4.PointCloud.from_fileobj(file).pc_data)
    except Exception as error:  # NumPy and lzf raise exceptions of many classes
        reason = kit.shortened(kit.reason_of(error))
        raise MeshError(f"the points cannot be read, the file may be damaged: {reason}") from None


def _check_points(n_found: int, header: _Header) -> None:
    if n_found < header.shape.points:
        raise MeshError(
            f"the header declares {counted(header.shape.points, 'point')}, but the file has"
            f" {n_found}: the file may be truncated"
        )


def _as_declared(values: Array, name: str, kind: np.dtype[Any]) -> Array:
    """Convert numbers of a text file to the declared type; coordinates remain float64."""
    if values.dtype == kind or name in ("x", "y", "z"):
        return values
    is_whole = np.all((values == np.floor(values)) & (np.abs(values) < 2.0**32))
    # In text files, packed colors are integers, even if the header declares floats.
    if name in ("rgb", "rgba") and is_whole and (kind.kind != "f" or values.max() >= 1):
        return (values.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32)
    with np.errstate(invalid="ignore", over="ignore"):
        declared = values.astype(kind)
    if kind.kind != "f" and not np.array_equal(declared, values):
        size = counted(kind.itemsize, "byte")
        raise MeshError(f"the field {name} must have integers of {size}")
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


def write_pcd(file: IO[bytes], content: Output) -> None:
    """Write positions, normals, packed colors, labels and attributes as binary or text PCD.

    Coordinates are float32 if float32 is exact, otherwise float64. Labels are unsigned integers, or
    signed integers if a label is -1.
    """
    columns = _columns_of(content)
    kinds = [values.dtype.str[1:].upper() for values in columns.values()]
    counts = [1 if values.ndim == 1 else values.shape[1] for values in columns.values()]
    n_points = content.cells.n_points
    view = content.cells.viewpoints
    place = view if view is not None and view.ndim == 1 else (0, 0, 0)
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(columns)}",
        f"SIZE {' '.join(kind[1:] for kind in kinds)}",
        f"TYPE {' '.join(kind[0] for kind in kinds)}",
        f"COUNT {' '.join(map(str, counts))}",
        f"WIDTH {n_points}",
        "HEIGHT 1",
        "VIEWPOINT {:.17g} {:.17g} {:.17g} 1 0 0 0".format(*place),
        f"POINTS {n_points}",
        f"DATA {'ascii' if content.ascii else 'binary'}\n",
    ]
    file.write("\n".join(lines).encode("ascii"))
    if content.ascii:
        flat = [column for values in columns.values() for column in np.atleast_2d(values.T)]
        row = " ".join(map(kit.number_format, flat))
        kit.write_rows(file, f"{row}\n", flat)
        return
    fields = [(name, values.dtype, values.shape[1:]) for name, values in columns.items()]
    record = np.dtype(fields).newbyteorder("<")
    for begin in range(0, n_points, ROWS_AT_ONCE):
        rows = np.empty(min(ROWS_AT_ONCE, n_points - begin), record)
        for name, values in columns.items():
            rows[name] = values[begin : begin + ROWS_AT_ONCE]
        file.write(rows.tobytes())


def _columns_of(content: Output) -> dict[str, Array]:
    """Return the PCD fields by name, without attributes whose name or colors are there already."""
    cloud, labels, colors = content.cells, content.labels, content.cloud_colors
    with np.errstate(over="ignore"):  # overflow gives infinity, which differs from the value
        points = cloud.points.astype(np.float32)
    if not np.array_equal(points, cloud.points):
        points = cloud.points
    columns: dict[str, Array] = dict(zip("xyz", np.ascontiguousarray(points.T), strict=True))
    if cloud.normals is not None:
        columns |= zip(_NORMALS.values(), cloud.normals.T.astype(np.float32), strict=True)
    own: dict[str, Array] = {}
    if colors is not None:
        packed = colors.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
        # Other programs expect these bits as a float in binary files, and as an integer in text.
        columns["rgb"] = packed if content.ascii else packed.view(np.float32)
        own = dict(zip(("red", "green", "blue"), colors.T, strict=True))
    if labels is not None:
        columns["label"] = labels if labels.min() < 0 else labels.astype(np.uint32)
    own |= {_OTHER_NAMES.get(field, field): values for field, values in columns.items()}
    added = content.properties("vertex", own)
    return columns | {_NORMALS.get(name, name): values for name, values in added.items()}
