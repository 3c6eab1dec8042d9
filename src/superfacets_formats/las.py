"""Read LAS and LAZ files, which have one record per point, with laspy.

lazrs decompresses LAZ in a process of its own.
"""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Bytes, Content, Input, Read, counted

from .las_frame import DIMENSION, ORIGIN, LasFrame

_MAX_COMPRESSED = 1000
"""Maximum ratio of decompressed bytes to bytes of the file. The usual ratio is 5 to 20. Only files
whose points are almost all equal exceed the maximum."""
_SMALL = 64 << 20
"""Size of decompressed points in bytes that is accepted even if `_MAX_COMPRESSED` is exceeded."""

PROJECTION = b"LASF_Projection"
"""User id of the records that contain the coordinate reference system."""

EXTRA_BYTES = (b"LASF_Spec", 4)
"""User id and id of the records that describe extra dimensions of the points."""

_LASZIP = (b"laszip encoded", 22204)

_WAVES = ("wavepacket_", "return_point_wave", "x_t", "y_t", "z_t")
"""Prefixes of the names of fields that refer to wave packets, which are not read."""


class _Header(NamedTuple):
    frame: LasFrame  # without extra dimensions
    n_points: int
    size: int  # size of a point record in bytes
    begin: int  # offset of the first point in the file
    is_compressed: bool
    records: dict[tuple[bytes, int], bytes]  # all records, keyed by (user, id)
    layout: Any  # `laspy.PointFormat` without extra dimensions


def read_las(source: Input) -> Read:
    """Return the points of a LAS or LAZ file with colors and attributes, named as in laspy."""
    data = source.data
    header = _header_of(data)
    n_bytes = header.n_points * header.size
    if header.is_compressed:
        if n_bytes > max(_SMALL, _MAX_COMPRESSED * len(data)):
            raise MeshError(
                f"the header declares {counted(header.n_points, 'point')} of {header.size} bytes,"
                f" more than {_MAX_COMPRESSED} times the size of the file, {len(data)} bytes"
            )
        kit.FORMATS.check_readers([".laz"])
        found = kit.guarded("superfacets_formats.las:decompressed", data, source.ending)
        records = np.asarray(found["records"])
    elif n_bytes > len(data) - header.begin:
        raise MeshError(
            f"the header declares {counted(header.n_points, 'point')} of {header.size} bytes, but"
            f" the file has only {counted(len(data) - header.begin, 'byte')} of points: it may be"
            " truncated"
        )
    else:
        records = np.frombuffer(data, np.uint8, n_bytes, header.begin)
    columns = dict(_columns(records, header))
    waves = [name for name in columns if name.startswith(_WAVES)]
    if waves:
        source.declare("wave packets")
        columns = {name: values for name, values in columns.items() if name not in waves}
    frame = _add_extra_columns(columns, records, header, source)
    for user, number in header.records:
        if user != PROJECTION and (user, number) not in (_LASZIP, EXTRA_BYTES):
            source.declare(f"record {number} of {user.decode('ascii', 'replace')!r}")
    if frame.is_geographic:
        warnings.warn(
            f"x and y are degrees of {frame.name}, but heights are meters: project the points"
            " first, for example with PDAL or QGIS",
            stacklevel=2,
        )
    points = {}
    for axis, scale, offset in zip("xyz", header.frame.scales, header.frame.offsets, strict=True):
        with np.errstate(over="ignore", invalid="ignore"):  # `PointCloud` refuses infinite results
            points[axis] = columns.pop(axis.upper()) * scale + offset
    colors = {name: columns[name] for name in ("red", "green", "blue") if name in columns}
    # Colors in LAS have 16 bits, but many programs write only values from 0 to 255.
    if colors and max(int(shades.max(initial=0)) for shades in colors.values()) <= 255:
        colors = {name: shades.astype(np.uint8) for name, shades in colors.items()}
    return source.cloud((points | columns | colors).items(), header=frame)


def las_steps(data: Content) -> tuple[float, float, float]:
    """Return the quantization steps of x, y and z in a LAS or LAZ file, in the unit of the file."""
    return _header_of(data).frame.scales


def _header_of(data: Content) -> _Header:
    if data[:4] != b"LASF" or len(data) < 227:
        raise MeshError("not a LAS file: the header is missing or truncated")
    minor = data[25]
    form = "<HIIBHI"
    header_size, begin, n_records, point_format, size, n_points = struct.unpack_from(form, data, 94)
    if minor >= 4:
        if len(data) < 375:
            raise MeshError("the file ends within its header: it may be truncated")
        (n_points,) = struct.unpack_from("<Q", data, 247)
    is_compressed, point_format = point_format >= 128, point_format & 63
    if point_format > 10:
        raise MeshError(f"expected point format 0 to 10, got {point_format}")
    laspy = kit.import_extra("laspy", "a .las or .laz file", "las")
    layout = laspy.PointFormat(point_format)
    if size < layout.size:
        raise MeshError(
            f"points of format {point_format} need {layout.size} or more bytes, got {size}"
        )
    if not n_points:
        raise MeshError("the file has no points")
    numbers = struct.unpack_from("<6d", data, 131)
    records = _records(data, (header_size, begin), n_records)
    if minor >= 4:  # more records may follow the points
        place, n_records = struct.unpack_from("<QI", data, 235)
        records = _records(data, (place, len(data)), n_records, records, is_extended=True)
    system = tuple((n, content) for (user, n), content in records.items() if user == PROJECTION)
    frame = LasFrame(
        minor, point_format, numbers[:3], numbers[3:], system,
        is_wkt=bool(data[6] & 16), has_standard_time=bool(data[6] & 1),
        origin=tuple((begin, data[begin:end]) for begin, end in ORIGIN),
    )  # fmt: skip
    return _Header(frame, n_points, size, begin, is_compressed, records, layout)


def _records(
    data: Content, part: tuple[int, int], n_records: int,
    found: dict[tuple[bytes, int], bytes] | None = None, *, is_extended: bool = False,
) -> dict[tuple[bytes, int], bytes]:  # fmt: skip
    """Return `found` and the variable length records in a part of the file.

    Descriptions of extra dimensions are concatenated. Of other records, only the first is used.
    """
    found, place, end = dict(found or {}), part[0], min(part[1], len(data))
    form, head = ("<2x16sHQ", 60) if is_extended else ("<2x16sHH", 54)
    for record in range(n_records):
        size = 0
        if place + head <= end:
            user, number, size = struct.unpack_from(form, data, place)
        if place + head + size * is_extended > end:
            raise MeshError(
                f"extended record {record} of {n_records} exceeds the file: it may be truncated"
                if is_extended
                else f"variable length record {record} of {n_records} overlaps the points"
            )
        key, place = (user.rstrip(b"\0"), number), place + head
        content = data[place : min(end, place + size)]
        if key == EXTRA_BYTES:
            found[key] = found.get(key, b"") + content[: len(content) // DIMENSION * DIMENSION]
        found.setdefault(key, content)
        place += size
    return found


def _columns(records: Bytes, header: _Header) -> Iterator[tuple[str, Array]]:
    """Yield the fields of the points, without extra dimensions, with laspy's names."""
    record = kit.import_extra("laspy.point.record", "a .las or .laz file", "las")
    fields = [*header.layout.dtype().descr, ("extra bytes", f"V{header.size - header.layout.size}")]
    stored: Array = np.ndarray(header.n_points, fields, records)
    points = record.PackedPointRecord(stored, header.layout)
    for name in header.layout.dimension_names:
        yield name, np.array(points[name])


def _add_extra_columns(
    columns: dict[str, Array], records: Bytes, header: _Header, source: Input
) -> LasFrame:
    """Add the extra dimensions of the points to `columns`, and return the frame with them."""
    added = []
    place = header.layout.size
    described = header.records.get(EXTRA_BYTES, b"")
    for dimension, n_bytes in LasFrame.dimensions(described if place < header.size else b""):
        if place + n_bytes > header.size:
            raise MeshError(f"the extra dimensions of a point do not fit in {header.size} bytes")
        name, n_numbers = dimension.name, dimension.n_numbers
        if dimension.kind and name not in columns:
            shape = (header.n_points, n_numbers) if n_numbers > 1 else (header.n_points,)
            strides = (header.size, n_bytes // n_numbers)[: len(shape)]
            stored: Array = np.ndarray(shape, dimension.kind, records, place, strides)
            columns[name] = dimension.decoded(stored)
            added.append(dimension)
        else:
            source.declare(f"extra dimension {dimension.name!r}")
        place += n_bytes
    if place < header.size:
        source.declare(f"{counted(header.size - place, 'byte')} per point, which have no names")
    return header.frame._replace(extra=tuple(added))


def decompressed(data: bytes, _ending: str) -> dict[str, Array]:
    """Return the points of a LAZ file. lazrs can abort, so this is called in another process."""
    lazrs = kit.import_extra("lazrs", "a .laz file", "las")
    header = _header_of(data)
    description = header.records.get(_LASZIP, b"").ljust(6, b"\0")
    if description[0] == 1:
        raise MeshError(
            f"LASzip {description[4]}.{description[5]} compressed the points without chunks, which"
            " lazrs does not read: decompress the file with laszip or las2las first"
        )
    vlr = lazrs.LazVlr(description)
    if vlr.item_size() != header.size:
        raise MeshError("the description of the compressed points does not match their format")
    file = io.BytesIO(data)
    file.seek(header.begin)
    counts = np.array(lazrs.read_chunk_table(file, vlr), np.int64).reshape(-1, 2)
    if len(counts) and not vlr.uses_variable_size_chunks():  # the last chunk may have fewer points
        counts[:-1, 0] = vlr.chunk_size()
        counts[-1, 0] = header.n_points - counts[:-1, 0].sum()
    counts = counts[counts.any(axis=1)]  # some programs write an empty chunk at the end
    is_too_large = not vlr.uses_variable_size_chunks() and (counts[:, 0] > vlr.chunk_size()).any()
    if counts.min(initial=1) < 1 or counts[:, 0].sum() != header.n_points or is_too_large:
        n_points = counted(header.n_points, "point")
        raise MeshError(f"the chunk table does not match the {n_points} that the header declares")
    records = np.empty(header.n_points * header.size, np.uint8)
    content, table = data[header.begin + 8 :], [(int(n), int(size)) for n, size in counts]
    lazrs.decompress_points_with_chunk_table(content, bytes(vlr.record_data()), records, table)
    return {"records": records}
