"""Read LAS and LAZ files, which have one record per point, with laspy. lazrs decompresses LAZ.

lazrs aborts the process if a file declares more chunks, or larger layers, than fit in memory.
Therefore all numbers from which lazrs computes sizes of arrays are first compared with the size of
the file: number and sizes of chunks, sizes of layers, and items of a record. `tools/fuzz` tests
these checks with damaged files.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Bytes, Content, Input, Read, counted, reason_of, shortened

from .las_frame import DIMENSION, LasFrame

_MAX_COMPRESSED = 1000
"""Maximum ratio of decompressed bytes to bytes of the file. The usual ratio is 5 to 20. Only files
whose points are almost all equal exceed the maximum."""
_SMALL = 64 << 20
"""Size of decompressed points in bytes that is accepted even if `_MAX_COMPRESSED` is exceeded."""

_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
"""Number of compressed layers of the items of LAZ records of point formats 6 to 10, by type.
Other items are extra bytes, and each byte has its own layer."""

PROJECTION = b"LASF_Projection"
"""User id of the records that contain the coordinate reference system."""


EXTRA_BYTES = (b"LASF_Spec", 4)
"""User id and id of the records that describe extra dimensions of the points."""

_LASZIP = (b"laszip encoded", 22204)

_WAVES = ("wavepacket_", "return_point_wave", "x_t", "y_t", "z_t")
"""Begins of the names of fields that refer to wave packets, which are not read."""


class _Header(NamedTuple):
    frame: LasFrame  # without extra dimensions
    n_points: int
    size: int  # size of a point record in bytes
    begin: int  # offset of the first point in the file
    is_compressed: bool
    records: dict[tuple[bytes, int], bytes]  # all records, keyed by (user, id)
    layout: Any  # `laspy.PointFormat` without extra dimensions

    @property
    def n_extra(self) -> int:
        """Number of extra bytes of a point."""
        return int(self.size - self.layout.size)


def read_las(source: Input) -> Read:
    """Return the points of a LAS or LAZ file with their colors and attributes; no wave packets.

    Attributes have the same names as in laspy, except that underscores replace spaces.
    """
    data = source.data
    header = _header_of(data)
    n_bytes = header.n_points * header.size
    if header.is_compressed:
        records = _decompressed(data, header)
    elif n_bytes > len(data) - header.begin:
        raise MeshError(
            f"the header declares {counted(header.n_points, 'point')} of {header.size} bytes, but"
            f" the file has only {counted(len(data) - header.begin, 'byte')} of points: it may be"
            " truncated"
        )
    else:
        records = np.frombuffer(data, np.uint8, n_bytes, header.begin)
    columns = dict(_columns(records, header))
    frame = _add_extra_columns(columns, records, header, source)
    for name in [name for name in columns if name.startswith(_WAVES)]:
        del columns[name]
        if name == "wavepacket_index":
            source.declare("wave packets")
    for user, number in header.records.keys() - {_LASZIP, EXTRA_BYTES}:
        if user != PROJECTION:
            source.declare(f"record {number} of {user.decode('ascii', 'replace')!r}")
    if frame.is_geographic:
        source.declare(
            f"meters of x and y: they are degrees of {frame.name}, and heights are not, so project"
            " the points first, for example with PDAL or QGIS"
        )
    points = {}
    for axis, scale, offset in zip("xyz", header.frame.scales, header.frame.offsets, strict=True):
        with np.errstate(over="ignore", invalid="ignore"):  # `PointCloud` refuses infinite results
            points[axis] = columns.pop(axis.upper()) * scale + offset
    colors = {name: columns[name] for name in ("red", "green", "blue") if name in columns}
    # Colors in LAS have 16 bits, but many programs write only values from 0 to 255.
    if colors and max(int(shades.max(initial=0)) for shades in colors.values()) <= 255:
        colors = {name: shades.astype(np.uint8) for name, shades in colors.items()}
    columns = points | columns | colors
    return source.cloud(columns.items(), header=frame)


def las_steps(data: Content) -> tuple[float, float, float]:
    """Return the quantization steps of x, y and z in a LAS or LAZ file, in the unit of the file."""
    return _header_of(data).frame.scales


def _header_of(data: Content) -> _Header:
    if data[:4] != b"LASF" or len(data) < 227:
        raise MeshError("not a LAS file: the header is missing or truncated")
    minor = data[25]
    begin, n_records, point_format, size, n_points = struct.unpack_from("<IIBHI", data, 96)
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
    (header_size,) = struct.unpack_from("<H", data, 94)
    numbers = struct.unpack_from("<6d", data, 131)
    records = _records(data, (header_size, begin), n_records)
    if minor >= 4:  # more records may follow the points
        place, n_records = struct.unpack_from("<QI", data, 235)
        records = _records(data, (place, len(data)), n_records, records, is_extended=True)
    projection = {
        number: content for (user, number), content in records.items() if user == PROJECTION
    }
    frame = LasFrame(
        minor, point_format, numbers[:3], numbers[3:], tuple(projection.items()),
        is_wkt=bool(data[6] & 16), source_id=int.from_bytes(data[4:6], "little"),
        has_standard_time=bool(data[6] & 1),
    )  # fmt: skip
    return _Header(frame, n_points, size, begin, is_compressed, records, layout)


def _records(
    data: Content, part: tuple[int, int], n_records: int,
    found: dict[tuple[bytes, int], bytes] | None = None, *, is_extended: bool = False,
) -> dict[tuple[bytes, int], bytes]:  # fmt: skip
    """Return the contents of variable length records in a part of the file, with those `found`.

    Descriptions of extra dimensions are concatenated. Of other records with the same number, the
    first is returned.
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
        key, content = (
            (user.rstrip(b"\0"), number),
            data[place + head : min(end, place + head + size)],
        )
        if key == EXTRA_BYTES:
            found[key] = found.get(key, b"") + content[: len(content) // DIMENSION * DIMENSION]
        found.setdefault(key, content)
        place += head + size
    return found


def _columns(records: Bytes, header: _Header) -> Iterator[tuple[str, Array]]:
    """Yield the fields of the points, without extra dimensions, with laspy's names."""
    record = kit.import_extra("laspy.point.record", "a .las or .laz file", "las")
    fields = [*header.layout.dtype().descr, ("extra bytes", f"V{header.n_extra}")]
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
        name, n_numbers = dimension.attribute, dimension.n_numbers
        if dimension.is_readable and name not in columns:
            shape = (header.n_points, n_numbers) if n_numbers > 1 else (header.n_points,)
            strides = (header.size, n_bytes // n_numbers)[: len(shape)]
            stored: Array = np.ndarray(shape, dimension.kind, records, place, strides)
            columns[name] = dimension.decoded(stored)
            added.append(dimension)
            if not dimension.scales and _is_rounded(stored):
                source.declare(f"last digits of {name}", "which are rounded above 2^53")
        else:
            source.declare(f"extra dimension {dimension.name!r}")
        place += n_bytes
    return header.frame._replace(extra=tuple(added))


def _is_rounded(stored: Array) -> bool:
    """Return whether an integer is beyond ±2**53, where float64 does not represent all integers."""
    is_long = stored.dtype.kind in "iu" and stored.itemsize == 8
    return is_long and max(int(stored.max()), -int(stored.min())) > 2**53


def _decompressed(data: Content, header: _Header) -> Bytes:
    lazrs = kit.import_extra("lazrs", "a .laz file", "las")
    n_bytes = header.n_points * header.size
    if n_bytes > max(_SMALL, _MAX_COMPRESSED * len(data)):
        raise MeshError(
            f"the header declares {counted(header.n_points, 'point')} of {header.size} bytes, more"
            f" than {_MAX_COMPRESSED} times the size of the file, {len(data)} bytes"
        )
    description = header.records.get(_LASZIP, b"")
    n_layers = _n_layers(lazrs, description, header)
    begin, end = header.begin + 8, _begin_of_table(data, header)
    try:
        table = _chunks(lazrs, data[end:], description, header, end - begin)
        content = data[begin:end]
        if n_layers:
            _check_layers(content, table, header.size, n_layers)
        records = np.empty(n_bytes, np.uint8)
        lazrs.decompress_points_with_chunk_table(content, description, records, table)
    except BaseException as error:  # PanicException is not an Exception and cannot be imported
        if isinstance(error, lazrs.LazrsError) or type(error).__name__ == "PanicException":
            raise MeshError(f"the LAZ file cannot be read: {shortened(reason_of(error))}") from None
        raise
    return records


def _n_layers(lazrs: Any, description: bytes, header: _Header) -> int:
    """Check the items of a record; return the number of layers per chunk, 0 for formats 0 to 5."""
    compressor, major, minor = struct.unpack_from("<H2xBB", description.ljust(6, b"\0"))
    if compressor == 1 and major < 3:
        raise MeshError(
            f"LASzip {major}.{minor} compressed the points without chunks, which lazrs does not"
            " read: decompress the file with laszip or las2las first"
        )
    new = lazrs.LazVlr.new_for_compression(header.frame.point_format, header.n_extra, False)
    expected = bytes(new.record_data())
    is_layered, fits = header.frame.point_format > 5, len(description) == len(expected)
    given, items = (
        [*struct.iter_unpack("<HHH", each[34:])]
        for each in (description if fits else expected, expected)
    )
    fits &= description[:2] == expected[:2] and description[32:34] == expected[32:34]
    fits &= [item[:2] for item in given] == [item[:2] for item in items]
    if not fits or not {item[2] for item in given} <= ({3, 4} if is_layered else {1, 2}):
        raise MeshError("the description of the compressed points does not match their format")
    return sum(_LAYERS.get(kind, size) for kind, size, _ in items) if is_layered else 0


def _begin_of_table(data: Content, header: _Header) -> int:
    """Return the offset of the chunk table.

    The file stores this offset before the points, or in its last 8 bytes.
    """
    begin = header.begin + 8
    if begin <= len(data):
        for at in (header.begin, len(data) - 8):
            (place,) = struct.unpack_from("<q", data, at)
            if begin <= place <= len(data) - 8:
                return int(place)
    raise MeshError(
        "the chunk table of the compressed points is outside the file: the file may be truncated"
    )


def _chunks(
    lazrs: Any, table: bytes, description: bytes, header: _Header, n_bytes: int
) -> list[tuple[int, int]]:
    (n_chunks,) = struct.unpack_from("<I", table, 4)
    if n_chunks > n_bytes // header.size + 1:  # each chunk begins with an uncompressed point
        raise MeshError(
            f"the file declares {counted(n_chunks, 'chunk')} of points, too many for its size"
        )
    vlr = lazrs.LazVlr(description)
    chunks = lazrs.read_chunk_table_only(io.BytesIO(table), vlr)
    if any(size > n_bytes for _, size in chunks):  # so that the sum of sizes cannot overflow
        raise MeshError(f"a chunk declares more than the {counted(n_bytes, 'byte')} of all chunks")
    counts, largest = np.array(chunks, dtype=np.int64).reshape(-1, 2), header.n_points
    if n_chunks and not vlr.uses_variable_size_chunks():  # the last chunk may have fewer points
        largest = counts[:-1, 0] = vlr.chunk_size()
        counts[-1, 0] = header.n_points - counts[:-1, 0].sum()
    counts = counts[counts.any(axis=1)]  # some programs write an empty chunk at the end
    n_points, n_used = counts.sum(axis=0)
    sizes_fit = counts.min(initial=1) > 0 and counts[:, 0].max(initial=0) <= largest
    if not sizes_fit or n_points != header.n_points or n_used > n_bytes:
        raise MeshError(
            f"the chunk table does not match the {counted(header.n_points, 'point')} in"
            f" {n_bytes} bytes that the header declares: the file may be damaged"
        )
    return [(int(points), int(size)) for points, size in counts]


def _check_layers(content: bytes, chunks: list[tuple[int, int]], size: int, n_layers: int) -> None:
    """Raise a MeshError if the layers of a chunk are larger than the chunk."""
    # A chunk has one point, the number of points, the sizes of the layers, and the layers.
    place = 0  # offset of the current chunk
    for chunk, (_, n_bytes) in enumerate(chunks):
        left = n_bytes - size - 4 - 4 * n_layers
        if left >= 0:
            left -= sum(struct.unpack_from(f"<{n_layers}I", content, place + size + 4))
        if left < 0:
            raise MeshError(
                f"the layers of chunk {chunk} are larger than its {counted(n_bytes, 'byte')}"
            )
        place += n_bytes
