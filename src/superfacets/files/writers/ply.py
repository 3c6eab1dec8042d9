"""Write PLY files of meshes, with a label and a color per face, and of point clouds."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import IO, Any

import numpy as np

from ...base.lazy import load
from ...base.types import Array, Bytes, Floats, Ints, Longs
from ...mesh.attributes import COLORS, INDEX_NAMES, NAMES_COMMENT, PLY_TYPES, is_image
from ...mesh.faces import Corners, corners_of
from ..input import NORMALS
from .cells import Output
from .text_formats import ROWS_AT_ONCE, fits_single, number_format, text_rows

Columns = dict[str, Any]
"""Properties of an element: one number, (N,), or one list, (N, n), per row. The corners of faces
that differ in size are `Corners`."""


def write_ply(file: IO[bytes], content: Output) -> None:
    """Write a mesh as PLY, with the properties that `superfacets.write_mesh` describes."""
    mesh, attributes, texture = content.cells, content.attributes, content.texture
    vertices: Columns = _positions(mesh.vertices)
    faces: Columns = {INDEX_NAMES[0]: _lists_of(corners_of(mesh))}
    faces |= _labels_and_colors(content.labels, content.colors)
    if content.vertex_labels is not None:
        vertices["label"] = content.vertex_labels
    # If new labels of faces replace old ones, labels of vertices in the attributes are outdated.
    old = {} if attributes is None else attributes.face
    is_new = "label" in old and not np.array_equal(old["label"], faces.get("label", old["label"]))
    outdated = {"label": None} if is_new else {}
    vertices |= content.properties("vertex", outdated | vertices)
    faces |= content.properties("face", dict.fromkeys(INDEX_NAMES) | faces)
    comments = () if attributes is None else attributes.comments
    if attributes is not None:
        comments += tuple(
            f"{NAMES_COMMENT}{name} {json.dumps(names)}" for name, names in attributes.names.items()
        )
        content.taken.update(f"{name} names" for name in attributes.names)
    if texture is not None:
        is_cut = corners_of(mesh).size == 3
        placer = load("superfacets_textures.writing:Placer")(content.path)
        describe = load("superfacets_textures.writing:ply_texture")
        lines, fields = describe(texture, placer, has_triangles=is_cut)
        comments = (*(line for line in comments if not is_image(line)), *lines)
        faces |= fields
        content.taken.update(["texture"] * bool(lines))
    content.taken.add("comments")
    sizes = {"vertex": mesh.n_vertices, "face": mesh.n_faces}
    _write_elements(file, sizes, [vertices, faces], comments, ascii=content.ascii)


def write_cloud_ply(file: IO[bytes], content: Output) -> None:
    """Write a point cloud as PLY, with one label per point."""
    cloud = content.cells
    columns: Columns = _positions(cloud.points)
    if cloud.normals is not None:
        columns |= zip(NORMALS, cloud.normals.astype(np.float32).T, strict=True)
    columns |= _labels_and_colors(content.labels, content.cloud_colors)
    columns |= content.properties("vertex", columns)
    comments = () if content.attributes is None else content.attributes.comments
    content.taken.add("comments")
    _write_elements(file, {"vertex": cloud.n_points}, [columns], comments, ascii=content.ascii)


def _positions(vertices: Floats) -> dict[str, Array]:
    stored = vertices.astype(np.float32) if fits_single(vertices) else vertices
    return dict(zip("xyz", stored.T, strict=True))


def _labels_and_colors(labels: Ints | None, colors: Bytes | None) -> Columns:
    columns: Columns = {}
    if labels is not None:
        columns |= {"label": labels, "quality": labels.astype(np.float32)}
    if colors is not None:
        opaque = np.broadcast_to(np.uint8(255), len(colors))
        columns |= zip((*COLORS, "alpha"), (*colors.T, opaque), strict=True)
    return columns


def _lists_of(corners: Corners) -> Array | Corners:
    sizes = np.asarray(corners.sizes)
    return corners if sizes.min() < sizes.max() else corners.vertices.reshape(corners.n_cells, -1)


def _write_elements(
    file: IO[bytes], sizes: Mapping[str, int], tables: Sequence[Columns], comments: Sequence[str],
    *, ascii: bool,
) -> None:  # fmt: skip
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0", *comments]
    for (element, n_rows), columns in zip(sizes.items(), tables, strict=True):
        lines += [f"element {element} {n_rows}", *map(_declaration, columns.items())]
    file.write("\n".join([*lines, "end_header\n"]).encode("utf-8", "surrogateescape"))
    for n_rows, columns in zip(sizes.values(), tables, strict=True):
        for begin in range(0, n_rows, ROWS_AT_ONCE):
            rows = np.arange(begin, min(begin + ROWS_AT_ONCE, n_rows))
            file.write(b"".join(_rows(columns, rows, ascii=ascii)))


def _type_of_length(values: Array | Corners) -> str | None:
    """Return the type of the length of lists, or None for numbers."""
    if isinstance(values, np.ndarray):
        longest = values.shape[1] if values.ndim == 2 else 0
        return None if values.ndim == 1 else "u1" if longest < 256 else "i4"
    return "u1" if np.max(values.sizes) < 256 else "i4"


def _declaration(column: tuple[str, Any]) -> str:
    name, values = column
    length = _type_of_length(values)
    kind = PLY_TYPES[getattr(values, "vertices", values).dtype.str[1:]]
    return f"property {f'list {PLY_TYPES[length]} ' if length else ''}{kind} {name}"


def _rows(columns: Columns, rows: Longs, *, ascii: bool) -> list[bytes]:
    """Encode rows: one item, or one per row if faces differ in size."""
    ragged = next((each for each in columns.values() if isinstance(each, Corners)), None)
    if ragged is None:
        filled = _filled(columns, slice(rows[0], rows[-1] + 1))
        return [_as_text(filled) if ascii else filled.tobytes()]
    pieces = np.empty(len(rows), dtype=object)
    flat, offsets = ragged.of(rows)
    sizes = np.diff(offsets)
    for size in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == size)
        filled = _filled(columns, rows[alike], flat[offsets[alike, None] + np.arange(size)])
        if ascii:
            pieces[alike] = _as_text(filled).splitlines(keepends=True)
        else:
            pieces[alike] = filled.view(f"V{filled.itemsize}").tolist()
    return list(pieces)


def _filled(columns: Columns, rows: slice | Longs, corners: Array | None = None) -> Array:
    """Return rows as a structured array; `corners` has one row per polygon."""
    parts: dict[str, Any] = {
        name: values[rows] if isinstance(values, np.ndarray) else corners
        for name, values in columns.items()
    }
    fields: list[Any] = []
    for name, values in parts.items():
        if length := _type_of_length(columns[name]):
            # Names of properties have no spaces, so this name is unique.
            fields.append((f"length of {name}", f"<{length}"))
        fields.append((name, values.dtype.newbyteorder("<"), values.shape[1:]))
    filled = np.empty(len(next(iter(parts.values()))), dtype=fields)
    for name, values in parts.items():
        filled[name] = values
        if values.ndim == 2:
            filled[f"length of {name}"] = values.shape[1]
    return filled


def _as_text(rows: Array) -> bytes:
    """Format rows as text, with enough digits to restore all numbers exactly."""
    columns = [rows[name].reshape(len(rows), -1) for name in rows.dtype.names or ()]
    row = " ".join([number_format(column) for column in columns for _ in column.T]) + "\n"
    return text_rows(row, [axis for column in columns for axis in column.T])
