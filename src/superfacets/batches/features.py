"""Features of the cells of a file, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..cells.features import means_of_corners
from ..cells.point_graph import estimate_normals
from ..errors import MeshError
from ..io.attributes import MeshAttributes
from ..mesh.faces import AnyCells, area_vectors
from ..mesh.point_cloud import PointCloud
from ..mesh.tet_mesh import TetMesh

__all__ = ["features_of"]

_COLORS = ("red", "green", "blue")


def features_of(
    names: Sequence[str],
    cells: AnyCells,
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
    name: str, cells: AnyCells, attributes: MeshAttributes | None, n_threads: int
) -> npt.NDArray[np.float64]:
    if name == "normals":
        return _normals_of(cells, n_threads)
    if name == "height":
        return _per_cell(_positions_of(cells)[:, 2:], cells)
    if name == "color" and isinstance(cells, PointCloud) and cells.colors is not None:
        return cells.colors.astype(np.float64)
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


def _positions_of(cells: AnyCells) -> npt.NDArray[np.float64]:
    return cells.points if isinstance(cells, PointCloud) else cells.vertices


def _normals_of(cells: AnyCells, n_threads: int) -> npt.NDArray[np.float64]:
    if isinstance(cells, PointCloud):
        given = cells.normals
        return estimate_normals(cells, n_threads=n_threads) if given is None else given
    if isinstance(cells, TetMesh):
        raise MeshError("features normals: tetrahedra have none")
    vectors = area_vectors(cells, n_threads)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0))


def _per_cell(table: npt.NDArray[np.float64], cells: AnyCells) -> npt.NDArray[np.float64]:
    """Rows of points as they are, and the means of the corners of faces of rows of vertices."""
    return table if isinstance(cells, PointCloud) else means_of_corners(cells, table)
