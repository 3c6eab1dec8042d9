"""Read vertices, faces, labels and attributes from the tables of a PLY file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from functools import partial

import numpy as np

from ...base.errors import MeshError
from ...base.lazy import load
from ...base.types import Array, Longs
from ..attributes import NAMES_COMMENT, images_in
from ..guards import Polygons, as_rows, checked_faces, contiguous_rows, parsed_json
from ..input import Input, Read
from .ply_body import Column, read_tables
from .ply_header import INDEX_NAMES, STRIPS, Header, Property, parse_header
from .text import as_integers

RESTART = -1
"""Value in a list of vertex indices after which a new triangle strip begins."""


def read_ply(source: Input) -> Read:
    """Read a PLY file, ASCII or binary; without faces, the vertices are a point cloud."""
    data = source.data
    header = parse_header(data)
    place = header.find("vertex")  # SuperSplat compresses Gaussian splats
    is_packed = place is not None and header.elements[place].find("packed_position") is not None
    positions_at = [] if is_packed else _find_positions(header)
    corners_at = _find_corners(header)
    tables = read_tables(header, data)
    for place, element in enumerate(header.elements):
        is_read = element.name in ("vertex", "face", "chunk" if is_packed else "face")
        if element.n_rows and not is_read and place != header.faces:
            source.declare(f"element {element.name}")
    if is_packed:
        unpacked = load("superfacets_formats.splats:unpacked")
        owners = (dict(_columns(header, tables, owner)) for owner in ("vertex", "chunk"))
        return source.cloud(unpacked(*owners), comments=_comments_of(header)[0])
    positions = [_present(tables[place][column].values) for place, column in positions_at]
    vertices = as_rows(positions, np.float64)
    comments, names = _comments_of(header)
    vertex = _columns(header, tables, "vertex")
    if corners_at is None:
        return source.mesh(vertices, None, vertex=vertex, comments=comments, names=names)
    faces = _faces_of(tables[corners_at[0]][corners_at[1]], header)
    face = _columns(header, tables, "face")
    cells, attributes = source.mesh(
        vertices, faces, vertex=vertex, face=face, comments=comments, names=names
    )
    if attributes is not None and (images := images_in(comments)):
        with_texture = load("superfacets_textures.ply_texture:with_texture")
        lists = partial(_lists_of_faces, header, tables)
        attributes = with_texture(attributes, images, faces, lists, source.folder)
    return cells, attributes


def _comments_of(header: Header) -> tuple[tuple[str, ...], dict[str, tuple[str, ...]]]:
    """Return the comments, and the names of values that `write_mesh` stores in comments."""
    comments: list[str] = []
    names: dict[str, tuple[str, ...]] = {}
    for line in map(_one_line, header.comments):
        name, _, text = line.removeprefix(NAMES_COMMENT).partition(" ")
        found = None
        if line.startswith(NAMES_COMMENT):
            with contextlib.suppress(MeshError):
                found = parsed_json(text)
        if isinstance(found, list) and all(isinstance(each, str) for each in found):
            names[name] = tuple(found)
        else:
            comments.append(line)
    return tuple(comments), names


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


def _find_positions(header: Header) -> list[tuple[int, int]]:
    """Return the indices of the element vertex, and of its properties x, y and z."""
    place = header.find("vertex")
    if place is None:
        raise MeshError("the PLY file has no element vertex")
    element, found = header.elements[place], []
    for name in "xyz":
        column = element.find(name)
        if column is None or element.properties[column].is_list:
            raise MeshError(f"the PLY element vertex has no property {name}")
        found.append((place, column))
    return found


def _find_corners(header: Header) -> tuple[int, int] | None:
    """Return the indices of the element with faces and of the list of corners, or None."""
    if header.faces is None:
        return None
    faces = header.elements[header.faces]
    column = faces.find(*INDEX_NAMES)
    if column is None or not faces.properties[column].is_list:
        what = "faces" if faces.name == "face" else "triangle strips"
        raise MeshError(f"the PLY {what} have no list {INDEX_NAMES[0]}")
    if not faces.properties[column].is_integer:
        raise MeshError(f"the type of the PLY list {INDEX_NAMES[0]} must be an integer type")
    return header.faces, column


def _faces_of(indices: Column, header: Header) -> Array | Polygons:
    listed = indices.values
    flat = _present(indices.ragged) if listed is None else contiguous_rows(listed).ravel()
    corners, lengths = as_integers(flat, "vertex indices"), _present(indices.lengths)
    are_strips = header.faces is not None and header.elements[header.faces].name == STRIPS
    return (_triangles_of_strips if are_strips else checked_faces)(lengths, corners)


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


def _columns(
    header: Header, tables: list[list[Column]], owner: str
) -> Iterator[tuple[str, Array | str]]:  # fmt: skip
    """Yield copies of the other properties of an element, so that the content can be freed."""
    place = header.find(owner)
    if place is None:
        return
    element = header.elements[place]
    own = [element.find(axis) for axis in "xyz"] if owner == "vertex" else [
        element.find(*INDEX_NAMES)
    ]  # fmt: skip
    for column, stored in enumerate(element.properties):
        if column not in own:
            values = tables[place][column].values
            why = "whose lists differ in length"
            yield stored.name, why if values is None else _as_stored(values, stored)


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
