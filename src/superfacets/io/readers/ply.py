"""PLY: vertices and triangles, or the labels of faces, out of a file's tables."""

from __future__ import annotations

import numpy as np

from ..._types import Array
from ...errors import MeshError
from ..attributes import MeshAttributes
from ..guards import Arrays, Content, checked_faces, side_by_side
from .ply_attributes import attributes_of
from .ply_body import Column, read_tables
from .ply_header import INDEX_NAMES, Element, Header, parse_header
from .ply_strips import STRIPS, triangles_of_strips
from .text import as_integers

__all__ = ["read_ply", "read_ply_labels", "read_ply_with_attributes"]


def read_ply(data: Content) -> Arrays:
    """Vertices and faces of a PLY file, ASCII or binary.

    lagrange is not used: it does not notice that a binary file was cut, never returns from some
    ASCII files that were, reads words there as 0, and takes the memory that a header claims.
    """
    return _read_arrays(parse_header(data), data)[0]


def read_ply_with_attributes(data: Content) -> tuple[Arrays, MeshAttributes]:
    """Vertices and faces, and copies of all that is stored with them; the file is read once."""
    header = parse_header(data)
    arrays, tables = _read_arrays(header, data)
    return arrays, attributes_of(header, tables)


def _read_arrays(header: Header, data: Content) -> tuple[Arrays, list[list[Column]]]:
    vertex, vertices = _find_element(header, "vertex")
    xyz = [_find_scalar(vertices, name) for name in "xyz"]
    face, faces = _find_faces(header)
    column = faces.find(*INDEX_NAMES)
    if column is None or not faces.properties[column].is_list:
        what = "faces" if faces.name == "face" else "triangle strips"
        raise MeshError(f"the PLY {what} have no list {INDEX_NAMES[0]}")
    if not faces.properties[column].is_integer:
        raise MeshError(f"the PLY list {INDEX_NAMES[0]} must hold integers")
    tables = read_tables(header, data)
    indices = tables[face][column]
    positions = np.empty((vertices.n_rows, 3))
    with np.errstate(invalid="ignore"):  # numpy warns of some kinds of NaN; `Mesh` refuses them
        for axis, place in enumerate(xyz):
            positions[:, axis] = _present(tables[vertex][place].values)
    corners = as_integers(_corners_in_a_row(indices), "vertex indices")
    lengths = _present(indices.lengths)
    if faces.name == STRIPS:
        return (positions, triangles_of_strips(lengths, corners)), tables
    return (positions, checked_faces(lengths, corners)), tables


def _corners_in_a_row(indices: Column) -> Array:
    if indices.values is None:
        return _present(indices.ragged)
    return side_by_side(indices.values).ravel()


def read_ply_labels(data: Content, name: str = "label") -> Array:
    """The face property `label` of a PLY file, or what has that name; the faces may be polygons."""
    header = parse_header(data)
    face, faces = _find_labeled(header)
    column = None if faces.name == STRIPS else faces.find(name)  # strips are not faces
    if column is None or faces.properties[column].is_list:
        things = "faces" if faces.name in ("face", STRIPS) else "points"
        raise MeshError(f"the PLY {things} have no property {name}")
    if not faces.properties[column].is_integer:
        raise MeshError("labels must be integers: the PLY file declares another type")
    return as_integers(_present(read_tables(header, data)[face][column].values), "labels")


def _find_element(header: Header, name: str) -> tuple[int, Element]:
    place = header.find(name)
    if place is None:
        raise MeshError(f"the PLY file has no element {name}")
    return place, header.elements[place]


def _find_faces(header: Header) -> tuple[int, Element]:
    """Place and declaration of the faces, or of the strips where there are no faces."""
    place = header.find("face")
    if place is not None and header.elements[place].n_rows:
        return place, header.elements[place]
    place = header.find(STRIPS)
    if place is not None and header.elements[place].n_rows:
        return place, header.elements[place]
    raise MeshError("the PLY file has no faces: is it a point cloud? read_cloud reads those")


def _find_labeled(header: Header) -> tuple[int, Element]:
    """Place and declaration of the faces; of the vertices where there are no faces."""
    place = header.find("vertex")
    faces = [element for element in header.elements if element.name in ("face", STRIPS)]
    if place is not None and not any(element.n_rows for element in faces):
        return place, header.elements[place]
    return _find_faces(header)


def _find_scalar(element: Element, name: str) -> int:
    column = element.find(name)
    if column is None or element.properties[column].is_list:
        raise MeshError(f"the PLY element {element.name} has no property {name}")
    return column


def _present(values: Array | None) -> Array:
    assert values is not None
    return values
