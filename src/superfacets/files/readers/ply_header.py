"""Parse the header of a PLY file."""

from __future__ import annotations

import re
import reprlib
from typing import NamedTuple

import numpy as np

from ...base.errors import MeshError
from ..attributes import PLY_TYPES
from ..guards import Content

TYPES = {word: stored for stored, word in PLY_TYPES.items()} | {
    np.dtype(stored).name: stored for stored in PLY_TYPES
}
"""NumPy type codes without byte order, keyed by the names of types in PLY."""

COMMENT_WORDS = ("comment", "obj_info")
"""First words of comment lines."""

_END, _OLD_END = re.compile(rb"\nend_header[ \t]*\r?\n"), re.compile(rb"\rend_header\r")
"""Match the end of the header. Some programs mix ``\\n`` and ``\\r\\n``."""

BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


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
    if data[:4] not in (b"ply\n", b"ply\r"):
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
