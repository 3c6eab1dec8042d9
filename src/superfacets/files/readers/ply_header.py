"""Parse the header of a PLY file."""

from __future__ import annotations

import re
import reprlib
from dataclasses import dataclass, field

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

INDEX_NAMES = ("vertex_indices", "vertex_index")
"""Possible names of the list with the corners of a face."""

STRIPS = "tristrips"
"""Name of the element with triangle strips; each row is a list of vertices."""

_END, _OLD_END = re.compile(rb"\nend_header[ \t]*\r?\n"), re.compile(rb"\rend_header\r")
"""Match the end of the header. Some programs mix ``\\n`` and ``\\r\\n``."""

BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class Property:
    """A column of an element, with one number or one list of numbers per row."""

    name: str
    dtype: str  # NumPy type with byte order
    count_dtype: str | None = None  # type of the length of lists; None if rows have one number

    @property
    def is_list(self) -> bool:
        """Whether rows have lists of numbers."""
        return self.count_dtype is not None

    @property
    def is_integer(self) -> bool:
        """Whether the numbers are integers."""
        return self.dtype[-2] in "iu"


@dataclass(frozen=True)
class Element:
    """Declaration of a table, for example of vertices or faces."""

    name: str
    n_rows: int
    properties: list[Property] = field(default_factory=list)

    def find(self, *names: str) -> int | None:
        """Return the index of the first property with one of these names, or None."""
        return next((i for i, stored in enumerate(self.properties) if stored.name in names), None)


@dataclass(frozen=True)
class Header:
    """Parsed header of a PLY file."""

    byte_order: str  # "<" or ">" for a binary file; empty for an ASCII file
    elements: list[Element]  # in the order of the file
    size: int  # size of the header in bytes
    comments: list[str] = field(default_factory=list)  # lines that begin with one of COMMENT_WORDS

    @property
    def faces(self) -> int | None:
        """Index of the element with faces or strips; None if both are missing or empty."""
        for name in ("face", STRIPS):
            place = self.find(name)
            if place is not None and self.elements[place].n_rows:
                return place
        return None

    def find(self, name: str) -> int | None:
        """Return the index of the element with this name, or None."""
        return next((i for i, element in enumerate(self.elements) if element.name == name), None)


def parse_header(data: Content) -> Header:
    """Parse the header at the beginning of `data`, or raise a MeshError if a line is not valid."""
    if data[:4] not in (b"ply\n", b"ply\r"):
        raise MeshError("not a PLY file: it does not begin with the word ply")
    is_old = data[3:4] == b"\r" and data[4:5] != b"\n"  # lines end with \\r
    found = (_OLD_END if is_old else _END).search(data)
    if found is None:
        raise MeshError("the PLY header has no line end_header: the file may be truncated")
    size = found.end()
    lines = data[: found.start()].decode("latin-1").splitlines()
    byte_order = _parse_format(lines[1].split() if len(lines) > 1 else [])
    elements: list[Element] = []
    for line in lines[2:]:
        _parse_line(line, byte_order, elements)
    for name in ("vertex", "face"):
        if sum(element.name == name for element in elements) > 1:
            raise MeshError(f"the PLY header declares element {name} twice")
    comments = [line for line in lines[2:] if line.startswith(COMMENT_WORDS)]
    return Header(byte_order, elements, size, comments)


def _parse_format(words: list[str]) -> str:
    if len(words) != 3 or words[0] != "format" or words[1] not in BYTE_ORDERS:
        raise _bad_line(" ".join(words), f"`format` and one of {', '.join(BYTE_ORDERS)}")
    if words[2] != "1.0":
        raise MeshError(f"the PLY version must be 1.0, got {reprlib.repr(words[2])}")
    return BYTE_ORDERS[words[1]]


def _parse_line(line: str, byte_order: str, elements: list[Element]) -> None:
    """Add the declaration in a line of the header to `elements`."""
    words = line.split()
    if not words or words[0] in COMMENT_WORDS:
        return
    if words[0] == "element" and len(words) == 3 and words[2].isdecimal() and words[2].isascii():
        # The length is limited, because `int` raises a ValueError for more than 4,300 digits.
        elements.append(Element(words[1], int(words[2][:30])))
    elif words[0] == "property" and elements:
        elements[-1].properties.append(_parse_property(words, byte_order))
    else:
        raise _bad_line(line, "an element with its count, or a property")


def _parse_property(words: list[str], byte_order: str) -> Property:
    order = byte_order or "="
    match words:
        case [_, "list", count_type, item_type, name] if {count_type, item_type} <= TYPES.keys():
            if TYPES[count_type][0] == "f":
                raise _bad_line(" ".join(words), "an integer type for the length of a list")
            return Property(name, order + TYPES[item_type], order + TYPES[count_type])
        case [_, item_type, name] if item_type in TYPES:
            return Property(name, order + TYPES[item_type])
    raise _bad_line(" ".join(words), "a property with a type and a name")


def _bad_line(line: str, expected: str) -> MeshError:
    return MeshError(f"expected {expected} in the PLY header, got {reprlib.repr(line)}")
