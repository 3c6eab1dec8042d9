"""Read the body of a PLY file: one table per element, with one column per property."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from ... import _core
from ...base.checks import checked_threads, counted
from ...base.errors import MeshError
from ...base.types import Array, Bools, Ints, Longs
from ..guards import Content
from .ply_header import Element, Header, Property
from .text import Lines, as_integers, runs

MAX_RECORD_SIZE = 2**31 - 1
"""Maximum size of a NumPy record in bytes."""


@dataclass(frozen=True, eq=False)
class Column:
    """Values of one property in all R rows of an element."""

    values: Array | None  # (R,) numbers, or (R, n) lists; None if lists differ in length
    lengths: Array | None = None  # (R,) length of each list; None if the property is not a list
    ragged: Array | None = None  # (L,) values of all lists, flat, if lists differ in length


def read_tables(header: Header, data: Content) -> list[list[Column]]:
    """Return the columns of all elements, in the order of the header; sizes are checked before.

    An element whose lists have one length is read as one array, another binary one row by row.
    """
    return _read_binary(header, data) if header.byte_order else _read_text(header, data)


def _raise_cut(element: Element, what: str) -> NoReturn:
    raise MeshError(
        f"the PLY header declares {counted(element.n_rows, 'row')} of element"
        f" {reprlib.repr(element.name)} but the file ends {what}: it may be truncated"
    )


def _read_binary(header: Header, data: Content) -> list[list[Column]]:
    tables = []
    begin = header.size
    for element in header.elements:
        columns, begin = _read_binary_element(element, data, begin)
        tables.append(columns)
    if data[begin:].strip(b"\0 \r\n\t"):
        n_extra = counted(len(data) - begin, "byte")
        raise MeshError(f"the file has {n_extra} more than the header declares")
    return tables


def _least_size(element: Element, n_bytes: int) -> int:
    """Return the minimum size of a row in bytes; raise a MeshError if `n_bytes` are too few."""
    heads = [np.dtype(stored.count_dtype or stored.dtype) for stored in element.properties]
    least = sum(head.itemsize for head in heads)
    if element.n_rows * least > n_bytes:
        _raise_cut(element, f"after at most {counted(n_bytes // least, 'row')}")
    return least


def _read_binary_element(element: Element, data: Content, begin: int) -> tuple[list[Column], int]:
    """Return the columns of an element, and the offset of its end."""
    least = _least_size(element, len(data) - begin)
    if not element.n_rows or not least:
        return [Column(np.empty(0), np.empty(0)) for _ in element.properties], begin
    _, lengths, _ = _walk(element, 1, data, begin)
    columns, end = _read_uniform(element, lengths[0].tolist(), data, begin)
    if columns is None:
        starts, lengths, end = _walk(element, element.n_rows, data, begin)
        columns = [
            _gather(stored, data, starts[:, i], lengths[:, i])
            for i, stored in enumerate(element.properties)
        ]
    return columns, end


def _read_uniform(
    element: Element, lengths: list[int], data: Content, begin: int
) -> tuple[list[Column] | None, int]:
    """Return columns and end offset if all rows have these list lengths, or None and `begin`."""
    fields: list[Any] = []
    for i, (stored, length) in enumerate(zip(element.properties, lengths, strict=True)):
        if stored.is_list:
            fields.append((f"length{i}", stored.count_dtype))
        fields.append((f"value{i}", stored.dtype, (length,) if stored.is_list else ()))
    row_size = sum(np.dtype(kind).itemsize * int(np.prod(shape)) for _, kind, *shape in fields)
    if row_size > MAX_RECORD_SIZE or row_size * element.n_rows > len(data) - begin:
        return None, begin
    rows = np.frombuffer(data, dtype=np.dtype(fields), count=element.n_rows, offset=begin)
    columns = []
    for i, (stored, length) in enumerate(zip(element.properties, lengths, strict=True)):
        stored_lengths = rows[f"length{i}"] if stored.is_list else None
        if stored_lengths is not None and np.any(stored_lengths != length):
            return None, begin
        columns.append(Column(rows[f"value{i}"], stored_lengths))
    return columns, begin + row_size * element.n_rows


def _walk(element: Element, n_rows: int, data: Content, begin: int) -> tuple[Longs, Longs, int]:
    """Return, per row and property, byte offset and number of values; also the end of all rows."""
    counts = [np.dtype(stored.count_dtype or "u1") for stored in element.properties]
    starts, lengths, end, n_whole = _core.walk_rows(
        np.frombuffer(data, dtype=np.uint8),
        begin,
        n_rows,
        [count.itemsize if stored.is_list else 0
         for count, stored in zip(counts, element.properties, strict=True)],
        [count.kind == "i" for count in counts],
        [np.dtype(stored.dtype).itemsize for stored in element.properties],
        any(stored.dtype.startswith(">") for stored in element.properties),
    )  # fmt: skip
    if n_whole < n_rows:
        _raise_cut(element, f"in row {n_whole}")
    _check_lengths(lengths)
    shape = (n_rows, len(counts))
    return starts.reshape(shape), lengths.reshape(shape), end


def _check_lengths(lengths: Array) -> None:
    if lengths.min(initial=0) < 0:
        raise MeshError(f"lengths of lists in the PLY file must be >= 0, got {lengths.min()}")


def _gather(stored: Property, data: Content, starts: Longs, lengths: Longs) -> Column:
    """Copy a column whose rows begin at the byte offsets `starts` and have `lengths` values."""
    listed = lengths if stored.is_list else None
    content = np.frombuffer(data, dtype=np.uint8)
    if np.any(lengths != lengths[0]):
        n_bytes = np.dtype(stored.dtype).itemsize * lengths
        places = np.ascontiguousarray(starts)
        ragged = _core.copy_runs(content, places, n_bytes, checked_threads(None))
        return Column(None, listed, ragged.view(stored.dtype))
    size = np.dtype(stored.dtype).itemsize * int(lengths[0])
    values = content[starts[:, np.newaxis] + np.arange(size)].view(stored.dtype)
    return Column(values if stored.is_list else values[:, 0], listed)


def _read_text(header: Header, data: Content) -> list[list[Column]]:
    lines = Lines.of(data, begin=header.size)
    tables = []
    for element in header.elements:
        n_rows = element.n_rows if element.properties else 0
        if n_rows > len(lines):
            _raise_cut(element, f"after {len(lines)}")
        rows, lines = lines[:n_rows], lines[n_rows:]
        has_integers = any(stored.is_integer for stored in element.properties)
        values = rows.parse_integers_or_floats() if has_integers else rows.parse(np.float64)
        columns = _read_uniform_text(element, values, rows.counts)
        tables.append(columns or _gather_text(element, values, rows))
    if len(lines):
        raise MeshError(f"line {lines.number(0)}: there are more lines than the header declares")
    return tables


def _read_uniform_text(element: Element, values: Array, counts: Ints) -> list[Column] | None:
    """Return columns if lists have the same lengths in all rows, otherwise None."""
    if not len(counts) or counts.min() != counts.max():
        return None
    rows = values.reshape(len(counts), -1)
    columns = []
    place = 0
    for stored in element.properties:
        if place >= rows.shape[1]:
            return None
        head = rows[:, place]
        place += 1
        if not stored.is_list:
            columns.append(Column(_as_declared(head, stored)))
            continue
        length = int(head[0]) if 0 <= head[0] <= rows.shape[1] - place else -1
        if length < 0 or np.any(head != length):
            return None
        lengths = np.broadcast_to(np.int64(length), len(head))
        columns.append(Column(rows[:, place : place + length], lengths))
        place += length
    return columns if place == rows.shape[1] else None


def _gather_text(element: Element, values: Array, lines: Lines) -> list[Column]:
    """Return columns whose lists differ in length; check the number of tokens in each line."""
    ends = np.cumsum(lines.counts, dtype=np.int64)
    places = ends - lines.counts
    columns = []
    for stored in element.properties:
        _check_tokens(lines, places < ends)
        head = values[places]
        places = places + 1
        if not stored.is_list:
            columns.append(Column(_as_declared(head, stored)))
            continue
        lengths = as_integers(head, "lengths of lists")
        _check_lengths(lengths)
        _check_tokens(lines, lengths <= ends - places)
        columns.append(_list_column(values, places, lengths))
        places = places + lengths
    _check_tokens(lines, places == ends)
    return columns


def _check_tokens(lines: Lines, is_right: Bools) -> None:
    if not is_right.all():
        line = int(np.argmin(is_right))
        raise MeshError(
            f"line {lines.number(line)}: {counted(int(lines.counts[line]), 'number')} cannot be a"
            " row of the element that the PLY header declares"
        )


def _as_declared(values: Array, stored: Property) -> Array:
    """Round values to float32 if this is the declared type, as in a binary file."""
    if stored.dtype[-2:] != "f4":
        return values
    with np.errstate(over="ignore"):  # `Mesh` refuses infinite coordinates
        return values.astype(np.float32)


def _list_column(values: Array, places: Longs, lengths: Longs) -> Column:
    """Return the column of lists that begin at the indices `places` of `values`."""
    if not len(lengths) or np.any(lengths != lengths[0]):
        return Column(None, lengths, values[runs(places, lengths)])
    listed: Array = values[places[:, np.newaxis] + np.arange(int(lengths[0]))]
    return Column(listed, lengths)
