"""Features of the cells of a file, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..cells.kinds import kind_of
from ..cells.point_graph import estimate_normals
from ..errors import MeshError
from ..io.attributes import MeshAttributes
from ..mesh.faces import area_vectors

_COLORS = ("red", "green", "blue")


def features_of(
    names: Sequence[str],
    cells: Any,
    attributes: MeshAttributes | None,
    n_threads: int,
) -> npt.NDArray[np.float64] | None:
    """The features that names stand for, side by side, one row per face or point.

    ``color`` is red, green and blue in the file; ``normals`` and ``height`` (z) are computed;
    another name is a property of the faces, points or vertices. A MeshError if the file has none.
    """
    if not names:
        return None
    columns = [_columns_of(name, cells, attributes, n_threads) for name in names]
    return np.concatenate(columns, axis=1)


def _columns_of(
    name: str, cells: Any, attributes: MeshAttributes | None, n_threads: int
) -> npt.NDArray[np.float64]:
    if name == "normals":
        return _normals_of(cells, n_threads)
    if name == "height":
        return _per_cell(_positions_of(cells)[:, 2:], cells)
    if name == "color" and kind_of(cells).are_points and cells.colors is not None:
        return np.asarray(cells.colors, np.float64)
    wanted = _COLORS if name == "color" else (name,)
    of_faces, of_vertices = _stored(attributes)
    for stored in (of_faces, of_vertices):
        if all(field in stored for field in wanted):
            columns = [stored[field].reshape(len(stored[field]), -1) for field in wanted]
            table = np.concatenate(columns, axis=1).astype(np.float64)
            return table if stored is of_faces else _per_cell(table, cells)
    known = sorted({*of_faces, *of_vertices})
    raise MeshError(
        f"features {name}: the file has no {' '.join(wanted)};"
        f" it has {', '.join(known) or 'no such data'}"
    )


def _stored(
    attributes: MeshAttributes | None,
) -> tuple[dict[str, npt.NDArray[Any]], dict[str, npt.NDArray[Any]]]:
    """Properties of the faces, and of vertices or points."""
    return ({}, {}) if attributes is None else (dict(attributes.face), dict(attributes.vertex))


def _positions_of(cells: Any) -> npt.NDArray[np.float64]:
    return np.asarray(cells.points if kind_of(cells).are_points else cells.vertices)


def _normals_of(cells: Any, n_threads: int) -> npt.NDArray[np.float64]:
    kind = kind_of(cells)
    if kind.are_points:
        given = cells.normals
        return estimate_normals(cells, n_threads=n_threads) if given is None else given
    if not kind.has_faces:
        raise MeshError(f"features normals: {kind.plural} have none")
    vectors = area_vectors(cells, n_threads)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0))


def _per_cell(table: npt.NDArray[np.float64], cells: Any) -> npt.NDArray[np.float64]:
    """Rows of points as they are, and the means of the corners of faces of rows of vertices."""
    corners = kind_of(cells).corners(cells)
    return table if corners is None else corners.means(table)
