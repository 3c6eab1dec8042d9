"""Write PLY files of meshes, with a label and a color per face, and of point clouds."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

from ...base.lazy import load
from ...base.types import Array, Bytes, Floats, Ints, Longs
from ...mesh.faces import FaceMesh, corners_of
from ..attributes import COLORS, INDEX_NAMES, NAMES_COMMENT, PLY_TYPES, is_image
from ..input import NORMALS
from .content import Output
from .text import ROWS_AT_ONCE, fits_single, text_rows


def write_ply(file: IO[bytes], content: Output) -> None:
    """Write a mesh as PLY, with the properties that `superfacets.write_mesh` describes."""
    mesh, attributes, texture = content.cells, content.attributes, content.texture
    vertices = _Element("vertex", mesh.n_vertices, _vertex_columns(mesh.vertices))
    columns = [_corner_column(mesh), *_label_columns(content.labels, content.colors)]
    faces = _Element("face", mesh.n_faces, columns)
    if content.vertex_labels is not None:
        vertices.columns.append(_Column("label", "<i4", content.vertex_labels))
    # If new labels of faces are written, labels of vertices in the attributes are outdated.
    labels = () if attributes is None else attributes.face.get("label", ())
    are_other = content.labels is not None and not np.array_equal(labels, content.labels)
    outdated = {"label": None} if are_other else {}
    vertices.add(content.properties("vertex", outdated | vertices.own))
    faces.add(content.properties("face", dict.fromkeys(INDEX_NAMES) | faces.own))
    comments = () if attributes is None else attributes.comments
    if attributes is not None:
        comments += tuple(
            f"{NAMES_COMMENT}{name} {json.dumps(names)}" for name, names in attributes.names.items()
        )
        content.taken.update(f"names of {name}s" for name in attributes.names)
    if texture is not None:
        is_cut = corners_of(mesh).size == 3
        placer = load("superfacets_textures.writing:Placer")(content.path)
        describe = load("superfacets_textures.writing:ply_texture")
        lines, fields = describe(texture, placer, has_triangles=is_cut)
        comments = (*(line for line in comments if not is_image(line)), *lines)
        faces.add(fields)
        content.taken.update(["texture"] * bool(lines))
    content.taken.add("comments")
    _write_elements(file, [vertices, faces], comments, ascii=content.ascii)


def write_cloud_ply(file: IO[bytes], content: Output) -> None:
    """Write a point cloud as PLY, with one label per point."""
    cloud = content.cells
    columns = _vertex_columns(cloud.points)
    if cloud.normals is not None:
        columns += _columns(NORMALS, "<f4", cloud.normals)
    columns += _label_columns(content.labels, content.cloud_colors)
    points = _Element("vertex", cloud.n_points, columns)
    points.add(content.properties("vertex", points.own))
    comments = () if content.attributes is None else content.attributes.comments
    content.taken.add("comments")
    _write_elements(file, [points], comments, ascii=content.ascii)


def _write_elements(
    file: IO[bytes], elements: list[_Element], comments: Sequence[str], *, ascii: bool
) -> None:
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0", *comments]
    for element in elements:
        lines += [f"element {element.name} {element.n_rows}"]
        lines += map(_declaration, element.columns)
    file.write("\n".join([*lines, "end_header\n"]).encode("utf-8", "surrogateescape"))
    for element in elements:
        for begin in range(0, element.n_rows, ROWS_AT_ONCE):
            end = min(begin + ROWS_AT_ONCE, element.n_rows)
            file.write(b"".join(_rows(element.columns, slice(begin, end), ascii=ascii)))


@dataclass(frozen=True)
class _Column:
    """A property of a PLY element."""

    name: str
    dtype: str
    values: Any  # array; one value for all rows; or the mesh, if faces differ in size (`longest`)
    length: int | None = None  # length of the list in every row; None if rows have one number
    longest: int = 0  # length of the longest list if lists differ in length, otherwise 0

    @property
    def length_dtype(self) -> str:
        return "u1" if max(self.length or 0, self.longest) < 256 else "<i4"

    def of(self, rows: slice | Longs, size: int = 0) -> _Column:
        """Return the column restricted to `rows`; ragged lists must have the length `size`."""
        if self.longest:
            corners = self.values.offsets[rows][:, np.newaxis] + np.arange(size)
            values = self.values.indices[corners]
            return _Column(self.name, self.dtype, values, size, self.longest)
        values = self.values[rows] if isinstance(self.values, np.ndarray) else self.values
        return _Column(self.name, self.dtype, values, self.length)


@dataclass(frozen=True)
class _Element:
    """An element of a PLY file: a named table, whose columns are called properties."""

    name: str
    n_rows: int
    columns: list[_Column]

    @property
    def own(self) -> dict[str, Any]:
        return {column.name: column.values for column in self.columns}

    def add(self, properties: Mapping[str, Array]) -> None:
        """Append properties as columns."""
        for name, values in properties.items():
            dtype = values.dtype.newbyteorder("<").str
            length = None if values.ndim == 1 else values.shape[1]
            self.columns.append(_Column(name, dtype, values, length))


def _vertex_columns(vertices: Floats) -> list[_Column]:
    return _columns("xyz", "<f4" if fits_single(vertices) else "<f8", vertices)


def _columns(names: Sequence[str], dtype: str, table: Array) -> list[_Column]:
    return [_Column(name, dtype, values) for name, values in zip(names, table.T, strict=True)]


def _label_columns(labels: Ints | None, colors: Bytes | None) -> list[_Column]:
    columns: list[_Column] = []
    if labels is not None:
        columns += [_Column("label", "<i4", labels), _Column("quality", "<f4", labels)]
    if colors is not None:
        columns += [*_columns(COLORS, "u1", colors), _Column("alpha", "u1", 255)]
    return columns


def _corner_column(mesh: FaceMesh) -> _Column:
    name, dtype = "vertex_indices", "<i4"
    corners = corners_of(mesh)
    sizes = corners.sizes
    longest = int(np.max(sizes))
    if np.min(sizes) == longest:
        return _Column(name, dtype, corners.vertices.reshape(-1, longest), longest)
    return _Column(name, dtype, mesh, longest=longest)


def _rows(columns: list[_Column], part: slice, *, ascii: bool) -> list[bytes]:
    """Encode the rows in the slice `part`: one item, or one per row if faces differ in size."""
    mesh = next((column.values for column in columns if column.longest), None)
    if mesh is None:
        rows = _fill_rows([column.of(part) for column in columns], part.stop - part.start)
        return [_as_text(rows) if ascii else rows.tobytes()]
    pieces = np.empty(part.stop - part.start, dtype=object)
    sizes = mesh.sizes[part]
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size)
        rows = _fill_rows([column.of(alike + part.start, size) for column in columns], len(alike))
        if ascii:
            pieces[alike] = _as_text(rows).splitlines(keepends=True)
        else:
            pieces[alike] = rows.view(f"V{rows.itemsize}").tolist()
    return list(pieces)


def _fill_rows(columns: list[_Column], n_rows: int) -> Array:
    fields: list[Any] = []
    for column in columns:
        if column.length is None:
            fields.append((column.name, column.dtype))
        else:  # attribute names have no spaces, so this name is unique
            fields.append((f"length of {column.name}", column.length_dtype))
            fields.append((column.name, column.dtype, (column.length,)))
    rows = np.empty(n_rows, dtype=fields)
    for column in columns:
        rows[column.name] = column.values
        if column.length is not None:
            rows[f"length of {column.name}"] = column.length
    return rows


def _declaration(column: _Column) -> str:
    kind = PLY_TYPES[column.dtype[-2:]]
    if column.length is not None or column.longest:
        kind = f"list {PLY_TYPES[column.length_dtype[-2:]]} {kind}"
    return f"property {kind} {column.name}"


def _as_text(rows: Array) -> bytes:
    """Format rows as text, with enough digits to restore all numbers exactly."""
    columns = [rows[name].reshape(len(rows), -1) for name in rows.dtype.names or ()]
    formats = {"f4": "%.9g", "f8": "%.17g"}
    words = [formats.get(column.dtype.str[1:], "%d") for column in columns for _ in column.T]
    row = " ".join(words) + "\n"
    return text_rows(row, [axis for column in columns for axis in column.T])
