"""Read a PLY file: one table per element, with one column per property."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ... import _core
from ...base.checks import checked_threads, counted
from ...base.errors import MeshError
from ...base.types import Array, Longs
from ...mesh.attributes import INDEX_NAMES, PLY_TYPES
from ..guards import Content
from .text import Lines, as_integers

TYPES = {word: stored for stored, word in PLY_TYPES.items()} | {
    np.dtype(stored).name: stored for stored in PLY_TYPES
}
"""NumPy type codes without byte order, keyed by the names of types in PLY."""

COMMENT_WORDS = ("comment", "obj_info")
"""First words of comment lines."""

_END, _OLD_END = re.compile(rb"\nend_header[ \t]*\r?\n"), re.compile(rb"\rend_header\r")
"""Match the end of the header. Some programs mix ``\\n`` and ``\\r\\n``."""

BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

MAX_RECORD_SIZE = 2**31 - 1
"""Maximum size of a NumPy record in bytes."""


class Property(NamedTuple):
    """A column of an element, with one number or one list of numbers per row."""

    name: str
    dtype: str  # NumPy type with byte order
    count_dtype: str | None = None  # type of the length of lists; None if rows have one number

    @property
    def is_integer(self) -> bool:
        """Whether the numbers are integers."""
        return self.dtype[-2] in "iu"


class Element(NamedTuple):
    """Declaration of a table, for example of vertices or faces."""

    name: str
    n_rows: int
    properties: list[Property]


class Header(NamedTuple):
    """Parsed header of a PLY file."""

    byte_order: str  # "<" or ">" for a binary file; empty for an ASCII file
    elements: list[Element]  # in the order of the file
    size: int  # size of the header in bytes
    comments: list[str]  # lines that begin with one of COMMENT_WORDS


def parse_header(data: Content) -> Header:
    """Parse the header at the beginning of `data`, or raise a MeshError if a line is not valid."""
    if not re.match(rb"ply[ \t]*[\n\r]", data):
        raise MeshError("not a PLY file: it does not begin with the word ply")
    is_old = data[3:4] == b"\r" and data[4:5] != b"\n"  # lines end with \\r
    found = (_OLD_END if is_old else _END).search(data)
    if found is None:
        raise MeshError("the PLY header has no line end_header: the file may be truncated")
    form, *lines = [*data[: found.start()].decode("latin-1").splitlines()[1:], ""]
    match form.split():
        case ["format", name, version] if name in BYTE_ORDERS:
            byte_order = BYTE_ORDERS[name]
        case _:
            raise _bad_line(form, f"`format` and one of {', '.join(BYTE_ORDERS)}")
    if version != "1.0":
        raise MeshError(f"the PLY version must be 1.0, got {reprlib.repr(version)}")
    elements: list[Element] = []
    comments: list[str] = []
    for line in lines:
        if (words := line.split()) and words[0] in COMMENT_WORDS:
            comments.append(re.sub(r"\s*(\w+)\s?", r"\1 ", line, count=1))
        elif words:
            _parse_line(line, byte_order or "=", elements)
    for name in ("vertex", "face"):
        if sum(element.name == name for element in elements) > 1:
            raise MeshError(f"the PLY header declares element {name} twice")
    return Header(byte_order, elements, found.end(), comments)


def _parse_line(line: str, order: str, elements: list[Element]) -> None:
    """Add the declaration in a line of the header to `elements`."""
    match line.split():
        case ["element", name, count] if count.isdecimal() and count.isascii():
            # The length is limited, because `int` raises a ValueError for more than 4,300 digits.
            elements.append(Element(name, int(count[:30]), []))
        case ["property", "list", size, item, name] if elements and {size, item} <= TYPES.keys():
            if TYPES[size][0] == "f":
                raise _bad_line(line, "an integer type for the length of a list")
            types = order + TYPES[item], order + TYPES[size]
            elements[-1].properties.append(Property(name, *types))
        case ["property", item, name] if elements and item in TYPES:
            elements[-1].properties.append(Property(name, order + TYPES[item]))
        case ["property", *_] if elements:
            raise _bad_line(line, "a property with a type and a name")
        case _:
            raise _bad_line(line, "an element with its count, or a property")


def _bad_line(line: str, expected: str) -> MeshError:
    return MeshError(f"expected {expected} in the PLY header, got {reprlib.repr(line)}")


class Column(NamedTuple):
    """Values of one property in all R rows of an element."""

    stored: Property
    values: Array  # (R,) numbers, or (R, n) lists; (L,) values of all lists that differ in length
    lengths: Array | None = None  # (R,) length of each list; None if the property is not a list

    @property
    def is_ragged(self) -> bool:
        """Whether the property is a list whose length differs between rows."""
        return self.lengths is not None and self.values.ndim == 1


class Table(NamedTuple):
    """Content of an element."""

    name: str
    n_rows: int
    columns: list[Column]

    def find(self, *names: str) -> Column | None:
        """Return the first column with one of these names, or None."""
        return next((each for each in self.columns if each.stored.name in names), None)


def read_tables(header: Header, data: Content) -> list[Table]:
    """Return the tables of all elements, in the order of the header; sizes are checked before.

    An element whose lists have one length is read as one array, all others row by row.
    """
    if not header.byte_order:
        return _read_text(header, data)
    tables, begin = [], header.size
    for element in header.elements:
        heads = [np.dtype(stored.count_dtype or stored.dtype) for stored in element.properties]
        least, n_bytes = sum(head.itemsize for head in heads), len(data) - begin
        if element.n_rows * least > n_bytes:
            _raise_cut(element, f"after at most {counted(n_bytes // least, 'row')}")
        columns, begin = _read_element(element, data, begin)
        tables.append(Table(element.name, element.n_rows, columns))
    if data[begin:].strip(b"\0 \r\n\t"):
        n_extra = counted(len(data) - begin, "byte")
        raise MeshError(f"the file has {n_extra} more than the header declares")
    return tables


def _read_text(header: Header, data: Content) -> list[Table]:
    """Read the numbers of each element, and then rows as in a binary file with these numbers."""
    lines = Lines.of(data, begin=header.size)
    tables = []
    for element in header.elements:
        n_rows = element.n_rows if element.properties else 0
        if n_rows > len(lines):
            _raise_cut(element, f"after {len(lines)}")
        rows, lines = lines[:n_rows], lines[n_rows:]
        has_integers = any(stored.is_integer for stored in element.properties)
        values = rows.parse_integers_or_floats() if has_integers else rows.parse(np.float64)
        form = values.dtype.str
        plain = [Property(one.name, form, one.count_dtype and form) for one in element.properties]
        columns, _ = _read_element(Element(element.name, n_rows, plain), values, 0, rows)
        tables.append(Table(element.name, element.n_rows, [
            Column(stored, _as_declared(column.values, stored), column.lengths)
            for stored, column in zip(element.properties, columns, strict=True)
        ]))  # fmt: skip
    if len(lines):
        raise MeshError(f"line {lines.number(0)}: there are more lines than the header declares")
    return tables


def _as_declared(values: Array, stored: Property) -> Array:
    """Convert numbers of a text file to the declared type, unless it cannot store an integer."""
    with np.errstate(invalid="ignore", over="ignore"):  # `Mesh` refuses infinite coordinates
        declared = values if stored.name in INDEX_NAMES else values.astype(stored.dtype)
    is_same = declared is values or not stored.is_integer or np.array_equal(declared, values)
    return declared if is_same else values


def _raise_cut(element: Element, what: str) -> NoReturn:
    raise MeshError(
        f"the PLY header declares {counted(element.n_rows, 'row')} of element"
        f" {reprlib.repr(element.name)} but the file ends {what}: it may be truncated"
    )


def _read_element(
    element: Element, data: Any, begin: int, lines: Lines | None = None
) -> tuple[list[Column], int]:
    """Return the columns of an element, and the offset of its end.

    For text, `data` are the numbers in `lines`.
    """
    if not element.n_rows or not element.properties:
        return [Column(stored, np.empty(0), np.empty(0)) for stored in element.properties], begin
    walk = partial(_walk, element, data, begin, lines)
    columns, end = _read_uniform(element, [int(each[0]) for each in walk(1)[1]], data, begin)
    if columns is None or (lines is not None and np.any(lines.counts != lines.counts[0])):
        *places, end = walk(element.n_rows)
        found = zip(element.properties, *places, strict=True)
        columns = [_gather(stored, data, starts, lengths) for stored, starts, lengths in found]
    return columns, end


def _read_uniform(
    element: Element, lengths: list[int], data: Any, begin: int
) -> tuple[list[Column] | None, int]:
    """Return columns and end offset if all rows have these list lengths, or None and `begin`."""
    fields: list[Any] = []
    for i, (stored, length) in enumerate(zip(element.properties, lengths, strict=True)):
        if stored.count_dtype:
            fields.append((f"length{i}", stored.count_dtype))
        fields.append((f"value{i}", stored.dtype, (length,) if stored.count_dtype else ()))
    row_size = sum(np.dtype(kind).itemsize * int(np.prod(shape)) for _, kind, *shape in fields)
    if row_size > MAX_RECORD_SIZE or row_size * element.n_rows > memoryview(data).nbytes - begin:
        return None, begin
    rows = np.frombuffer(data, dtype=np.dtype(fields), count=element.n_rows, offset=begin)
    columns = []
    for i, (stored, length) in enumerate(zip(element.properties, lengths, strict=True)):
        stored_lengths = rows[f"length{i}"] if stored.count_dtype else None
        if stored_lengths is not None and np.any(stored_lengths != length):
            return None, begin
        columns.append(Column(stored, rows[f"value{i}"], stored_lengths))
    return columns, begin + row_size * element.n_rows


def _walk(
    element: Element, data: Any, begin: int, lines: Lines | None, n_rows: int
) -> tuple[Iterable[Longs], Iterable[Longs], int]:
    """Return byte offset and number of values of each property in each row, and the end offset."""
    if lines is not None:
        return _walk_text(element, data, lines[:n_rows])
    counts = [np.dtype(stored.count_dtype or "V0") for stored in element.properties]
    starts, lengths, end, n_whole = _core.walk_rows(
        np.frombuffer(data, dtype=np.uint8), begin, n_rows,
        [count.itemsize for count in counts], [count.kind == "i" for count in counts],
        [np.dtype(stored.dtype).itemsize for stored in element.properties],
        any(stored.dtype.startswith(">") for stored in element.properties),
    )  # fmt: skip
    if n_whole < n_rows:
        _raise_cut(element, f"in row {n_whole}")
    _check_lengths(lengths)
    shape = (n_rows, len(counts))
    return starts.reshape(shape).T, lengths.reshape(shape).T, end


def _walk_text(
    element: Element, values: Array, lines: Lines
) -> tuple[Iterable[Longs], Iterable[Longs], int]:
    """Return the result of `_walk` for text, after a check of the number of tokens in each line."""
    ends = np.cumsum(lines.counts, dtype=np.int64)
    places = ends - lines.counts
    starts, lengths = [], []
    expected = "expected as many numbers as the PLY header and the lengths of lists declare"
    for stored in element.properties:
        sizes = np.ones(len(lines), np.int64)
        if stored.count_dtype:
            lines.refuse(places >= ends, expected)
            sizes = as_integers(values[places], "lengths of lists").astype(np.int64)
            _check_lengths(sizes)
            places = places + 1
        lines.refuse(sizes > ends - places, expected)
        starts.append(places * values.itemsize)
        lengths.append(sizes)
        places = places + sizes
    lines.refuse(places < ends, expected)
    return starts, lengths, values.nbytes


def _check_lengths(lengths: Array) -> None:
    if lengths.min(initial=0) < 0:
        raise MeshError(f"lengths of lists in the PLY file must be >= 0, got {lengths.min()}")


def _gather(stored: Property, data: Any, starts: Longs, lengths: Longs) -> Column:
    """Copy a column whose rows begin at the byte offsets `starts` and have `lengths` values."""
    content = np.frombuffer(data, dtype=np.uint8)
    places = np.ascontiguousarray(starts)
    n_bytes = np.dtype(stored.dtype).itemsize * lengths
    flat = _core.copy_runs(content, places, n_bytes, checked_threads(None)).view(stored.dtype)
    if not stored.count_dtype:
        return Column(stored, flat)
    is_ragged = np.any(lengths != lengths[0])
    return Column(stored, flat if is_ragged else flat.reshape(len(lengths), -1), lengths)
