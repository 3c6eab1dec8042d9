"""Read vertices, faces, labels and attributes from the tables of a PLY file."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Longs
from ..attributes import MeshAttributes, images_in, is_word
from ..guards import Arrays, Content, as_rows, checked_faces, contiguous_rows, hint_at_integers
from .ply_body import Column, read_tables
from .ply_header import INDEX_NAMES, STRIPS, Element, Header, Property, parse_header
from .text import as_integers

RESTART = -1
"""Value in a list of vertex indices after which a new triangle strip begins."""


def read_ply(data: Content) -> Arrays:
    """Return vertices and faces of a PLY file, ASCII or binary."""
    return _read_arrays(parse_header(data), data)[0]


def read_ply_with_attributes(
    data: Content, folder: Path | None = None
) -> tuple[Arrays, MeshAttributes]:
    """Return vertices and faces, and copies of all other properties.

    Images that ``TextureFile`` comments name must be in `folder` or in its subfolders.
    """
    header = parse_header(data)
    arrays, tables = _read_arrays(header, data)
    attributes = attributes_of(header, tables)
    if images := images_in(attributes.comments):
        with_texture = load("superfacets_textures.ply_texture:with_texture")
        lists = partial(_lists_of_faces, header, tables)
        attributes = with_texture(attributes, images, arrays[1], lists, folder)
    return arrays, attributes


def _lists_of_faces(
    header: Header, tables: list[list[Column]], name: str
) -> tuple[Array, Array] | None:
    """Return the values, flat, and the lengths of the lists `name` of faces, or None."""
    place = header.find("face")
    column = None if place is None else header.elements[place].find(name)
    if place is None or column is None or place != header.faces:
        return None
    found = tables[place][column]
    if found.lengths is None:
        return None
    values = found.ragged if found.values is None else found.values.ravel()
    return _present(values), np.asarray(found.lengths, np.int64)


def _read_arrays(header: Header, data: Content) -> tuple[Arrays, list[list[Column]]]:
    vertex = header.find("vertex")
    if vertex is None:
        raise MeshError("the PLY file has no element vertex")
    xyz = [_find_scalar(header.elements[vertex], name) for name in "xyz"]
    face, faces = _find_faces(header)
    column = faces.find(*INDEX_NAMES)
    if column is None or not faces.properties[column].is_list:
        what = "faces" if faces.name == "face" else "triangle strips"
        raise MeshError(f"the PLY {what} have no list {INDEX_NAMES[0]}")
    if not faces.properties[column].is_integer:
        raise MeshError(f"the type of the PLY list {INDEX_NAMES[0]} must be an integer type")
    tables = read_tables(header, data)
    indices = tables[face][column]
    positions = as_rows([_present(tables[vertex][place].values) for place in xyz], np.float64)
    listed = indices.values
    flat = _present(indices.ragged) if listed is None else contiguous_rows(listed).ravel()
    corners, lengths = as_integers(flat, "vertex indices"), _present(indices.lengths)
    read_faces = _triangles_of_strips if faces.name == STRIPS else checked_faces
    return (positions, read_faces(lengths, corners)), tables


def _find_scalar(element: Element, name: str) -> int:
    column = element.find(name)
    if column is None or element.properties[column].is_list:
        raise MeshError(f"the PLY element {element.name} has no property {name}")
    return column


def _find_faces(header: Header) -> tuple[int, Element]:
    if header.faces is None:
        raise MeshError("the PLY file has no faces: if it is a point cloud, use read_cloud")
    return header.faces, header.elements[header.faces]


def _present(values: Array | None) -> Array:
    assert values is not None
    return values


def _triangles_of_strips(lengths: Array, corners: Array) -> Longs:
    """Convert strips to triangles, (F, 3): one for each vertex of a strip after the first two."""
    # Degenerate triangles are kept, so that face indices are the same as in other programs.
    begins = np.zeros(len(corners) + 1, dtype=bool)
    begins[np.cumsum(lengths, dtype=np.int64)] = True
    begins = begins[: len(corners)]
    is_restart = corners == RESTART
    begins[1:] |= is_restart[:-1]
    begins[:1] = True
    # Index of each corner within its strip.
    places = np.arange(len(corners))
    places -= np.maximum.accumulate(np.where(begins, places, 0))
    ends = np.flatnonzero((places >= 2) & ~is_restart)
    if not len(ends):
        raise MeshError("the PLY file has no faces: no strip has three vertices")
    triangles = np.stack([corners[ends - 2], corners[ends - 1], corners[ends]], axis=1)
    is_turned = places[ends] % 2 == 1  # every second triangle of a strip has reverse orientation
    triangles[is_turned] = triangles[is_turned][:, [1, 0, 2]]
    return triangles.astype(np.int64)


def read_ply_labels(data: Content, name: str = "label") -> Array:
    """Return the integer property `name` of the faces, or of the vertices if there are no faces."""
    header = parse_header(data)
    place, column = _find_labels(header, name)
    element = header.elements[place]
    if column is None or element.properties[column].is_list:
        things = "faces" if element.name in ("face", STRIPS) else "points"
        others = [some.name for some in element.properties if some.is_integer and not some.is_list]
        raise MeshError(f"the PLY {things} have no property {name}{hint_at_integers(others)}")
    if not element.properties[column].is_integer:
        raise MeshError(f"labels must be integers, but the PLY property {name} has another type")
    return as_integers(_present(read_tables(header, data)[place][column].values), "labels")


def has_ply_labels(data: Content, name: str) -> bool:
    """Return whether the faces, or the vertices if there are no faces, have the property `name`."""
    header = parse_header(data)
    has_cells = header.faces is not None or header.find("vertex") is not None
    return has_cells and _find_labels(header, name)[1] is not None


def _find_labels(header: Header, name: str) -> tuple[int, int | None]:
    """Return the index of the element with labels, and of its property `name` (None if missing)."""
    vertex = header.find("vertex")
    place = vertex if header.faces is None and vertex is not None else _find_faces(header)[0]
    element = header.elements[place]
    return place, None if element.name == STRIPS else element.find(name)


def attributes_of(header: Header, tables: list[list[Column]]) -> MeshAttributes:
    """Copy all properties except x, y, z and corners, so that the file content can be freed."""
    left_out: list[str] = []
    kept: dict[str, dict[str, Array]] = {"vertex": {}, "face": {}}
    for place, (element, columns) in enumerate(zip(header.elements, tables, strict=True)):
        if element.name in kept:
            kept[element.name] = _copied(element, columns, left_out)
        elif element.n_rows and place != header.faces:
            left_out.append(f"element {element.name}")
    comments = tuple(map(_one_line, header.comments))
    return MeshAttributes(kept["vertex"], kept["face"], comments, tuple(left_out))


def _copied(element: Element, columns: list[Column], left_out: list[str]) -> dict[str, Array]:
    """Copy columns except positions and corners; skipped columns are added to `left_out`."""
    is_vertex = element.name == "vertex"
    own = [element.find(axis) for axis in "xyz"] if is_vertex else [element.find(*INDEX_NAMES)]
    copies: dict[str, Array] = {}
    for place, (stored, column) in enumerate(zip(element.properties, columns, strict=True)):
        if place in own:
            continue
        what = f"{element.name} property {stored.name}"
        if column.values is None:
            left_out.append(f"{what}, whose lists differ in length")
        elif stored.name in copies or not is_word(stored.name):
            left_out.append(f"{what}, whose name is repeated or not a word of ASCII")
        else:
            copies[stored.name] = _as_stored(column.values, stored)
    return copies


def _as_stored(values: Array, stored: Property) -> Array:
    """Copy values with the declared type, or as float64 if this type cannot store them."""
    declared = np.dtype(stored.dtype).newbyteorder("=")
    with np.errstate(invalid="ignore", over="ignore"):
        copy = np.array(values, dtype=declared, order="C")
    may_differ = stored.is_integer and values.dtype.itemsize != declared.itemsize
    if may_differ and not np.array_equal(copy, values):
        return np.array(values, dtype=np.float64, order="C")
    return copy


def _one_line(line: str) -> str:
    """Decode a comment, and replace line breaks in the comment by spaces."""
    try:
        text = line.encode("latin-1").decode("utf-8")
    except UnicodeDecodeError:  # some programs write Latin-1
        text = line
    return text.replace("\r", " ").replace("\n", " ").rstrip()
