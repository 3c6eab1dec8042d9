"""Read vertices, faces, labels and attributes from the tables of a PLY file."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ...base.arrays import as_rows, contiguous_rows
from ...base.errors import MeshError
from ...base.lazy import load
from ...base.text import parsed_json
from ...base.types import Array, Longs
from ...mesh.attributes import INDEX_NAMES, NAMES_COMMENT, images_in
from ..guards import Polygons, faces_of
from ..input import Input, Read
from .ply_tables import Header, Table, parse_header, read_tables
from .text import as_integers

STRIPS = "tristrips"
"""Name of the element with triangle strips; each row is a list of vertices."""

RESTART = -1
"""Value in a list of vertex indices after which a new triangle strip begins."""


def read_ply(source: Input) -> Read:
    """Read a PLY file, ASCII or binary; without faces, the vertices are a point cloud."""
    header = parse_header(source.data)
    tables = read_tables(header, source.data)
    found = {table.name: table for table in reversed(tables)}
    vertex, faces = found.get("vertex"), found.get("face")
    if vertex is None:
        raise MeshError("the PLY file has no element vertex")
    if faces is None or not faces.n_rows:
        faces = found.get(STRIPS)
    is_packed = vertex.find("packed_position") is not None  # SuperSplat compresses Gaussian splats
    used = {"vertex", "face", *["chunk"] * is_packed}
    for table in tables:
        if table.n_rows and table.name not in used and table is not faces:
            source.declare(f"element {table.name}")
    comments, names = _comments_of(header)
    if is_packed:
        unpacked, chunk = load("superfacets_formats.splats:unpacked"), found.get("chunk")
        limits = {} if chunk is None else dict(_columns(chunk))
        return source.cloud(unpacked(dict(_columns(vertex)), limits), comments=comments)
    vertices = as_rows([_position(vertex, axis) for axis in "xyz"], np.float64)
    of_vertices = _columns(vertex, *"xyz")
    if faces is None or not faces.n_rows:
        return source.mesh(vertices, None, vertex=of_vertices, comments=comments, names=names)
    corners = _faces_of(faces)
    of_faces = _columns(faces, INDEX_NAMES) if faces.name == "face" else ()
    cells, attributes = source.mesh(
        vertices, corners, vertex=of_vertices, face=of_faces, comments=comments, names=names
    )
    if attributes is not None and (images := images_in(comments)):
        with_texture = load("superfacets_textures.ply_texture:with_texture")
        lists = partial(_lists_of_faces, faces)
        attributes = with_texture(attributes, images, corners, lists, source.folder)
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


def _position(vertex: Table, axis: str) -> Array:
    column = vertex.find(axis)
    if column is None or column.lengths is not None:
        raise MeshError(f"the PLY element vertex has no property {axis}")
    return column.values


def _faces_of(faces: Table) -> Array | Polygons:
    column, name = faces.find(*INDEX_NAMES), INDEX_NAMES[0]
    if column is None or column.lengths is None:
        what = "faces" if faces.name == "face" else "triangle strips"
        raise MeshError(f"the PLY {what} have no list {name}")
    if not column.stored.is_integer:
        raise MeshError(f"the type of the PLY list {name} must be an integer type")
    flat = column.values if column.is_ragged else contiguous_rows(column.values).ravel()
    corners = as_integers(flat, "vertex indices")
    return (_triangles_of_strips if faces.name == STRIPS else faces_of)(column.lengths, corners)


def _lists_of_faces(faces: Table, name: str) -> tuple[Array, Array] | None:
    """Return the values, flat, and the lengths of the lists `name` of faces, or None."""
    column = faces.find(name)
    if column is None or column.lengths is None or faces.name == STRIPS:
        return None
    return column.values.ravel(), np.asarray(column.lengths, np.int64)


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


def _columns(table: Table, *own: Sequence[str]) -> Iterator[tuple[str, Array | str]]:
    """Yield copies of columns, so that the content can be freed, except for columns named `own`."""
    used = [table.find(*names) for names in own]
    for column in table.columns:
        if not any(column is one for one in used):
            why = "whose lists differ in length"
            native = column.values.dtype.newbyteorder("=")
            yield column.stored.name, why if column.is_ragged else column.values.astype(native, "C")


def _one_line(line: str) -> str:
    """Decode a comment, and replace line breaks in the comment by spaces."""
    try:
        text = line.encode("latin-1").decode("utf-8")
    except UnicodeDecodeError:  # some programs write Latin-1
        text = line
    return text.replace("\r", " ").replace("\n", " ").rstrip()
