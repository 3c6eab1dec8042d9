"""Copies of what a PLY file stores besides positions and corners."""

from __future__ import annotations

import numpy as np

from ..._types import Array
from ..attributes import MeshAttributes, is_word
from .ply_body import Column
from .ply_header import INDEX_NAMES, Element, Header, Property
from .ply_strips import STRIPS

__all__ = ["attributes_of"]


def attributes_of(header: Header, tables: list[list[Column]]) -> MeshAttributes:
    """What the tables hold besides x, y, z and corners, copied so that the file can be freed."""
    left_out: list[str] = []
    kept: dict[str, dict[str, Array]] = {"vertex": {}, "face": {}}
    for element, columns in zip(header.elements, tables, strict=True):
        if element.name in kept:
            kept[element.name] = _copied(element, columns, left_out)
        elif element.n_rows and not _is_mesh(header, element):
            left_out.append(f"element {element.name}")
    return MeshAttributes(
        kept["vertex"], kept["face"], tuple(map(_one_line, header.comments)), tuple(left_out)
    )


def _is_mesh(header: Header, element: Element) -> bool:
    """Whether the element is triangle strips that are read as the faces."""
    place = header.find("face")
    return element.name == STRIPS and (place is None or not header.elements[place].n_rows)


def _copied(element: Element, columns: list[Column], left_out: list[str]) -> dict[str, Array]:
    """The columns by name but for the mesh's own; what cannot be kept is added to `left_out`."""
    own = _own_columns(element)
    copies: dict[str, Array] = {}
    for place, (stored, column) in enumerate(zip(element.properties, columns, strict=True)):
        if place in own:
            continue
        what = f"{element.name} property {stored.name}"
        if column.values is None:
            left_out.append(f"{what}, whose lists differ in length")
        elif stored.name in copies or not is_word(stored.name):
            left_out.append(f"{what}, whose name is taken or is no word of ASCII")
        else:
            copies[stored.name] = _as_stored(column.values, stored)
    return copies


def _own_columns(element: Element) -> set[int | None]:
    if element.name == "vertex":
        return {element.find(axis) for axis in "xyz"}
    return {element.find(*INDEX_NAMES)}


def _as_stored(values: Array, stored: Property) -> Array:
    """A contiguous copy in the declared type; as float64 where a text file holds other numbers."""
    declared = np.dtype(stored.dtype).newbyteorder("=")
    with np.errstate(invalid="ignore", over="ignore"):
        copy = np.array(values, dtype=declared, order="C")
    may_differ = stored.is_integer and values.dtype.itemsize != declared.itemsize
    if may_differ and not np.array_equal(copy, values):
        return np.array(values, dtype=np.float64, order="C")
    return copy


def _one_line(line: str) -> str:
    """A comment as text, without a line break of another kind than the header's."""
    text = line.encode("latin-1").decode("utf-8", "surrogateescape")
    return text.replace("\r", " ").replace("\n", " ").rstrip()
