"""VTP: VTK's polygonal surfaces."""

from __future__ import annotations

import numpy as np

from ..._types import Array
from ...errors import MeshError
from ..guards import Arrays, Content, checked_faces
from .vtk_xml import XmlFile, is_xml_of

__all__ = ["has_vtp_labels", "is_vtp", "read_vtp", "read_vtp_labels"]


def is_vtp(data: Content) -> bool:
    """Whether the file is a VTP file."""
    return is_xml_of("PolyData", data)


def read_vtp(data: Content) -> Arrays:
    """Vertices and polygons of a VTP file; single points and lines are skipped."""
    file = _open(data)
    points, sizes, corners, n_points = [], [], [], 0
    for piece in file.pieces:
        points.append(file.points(piece))
        found = file.cells(piece, "Polys", piece.count("NumberOfPolys"))
        sizes.append(found[0])
        corners.append(found[1] + n_points if n_points else found[1])
        n_points += len(points[-1])
    if not sum(map(len, sizes)):
        raise MeshError("the VTP file has no polygons")
    return np.concatenate(points), checked_faces(np.concatenate(sizes), np.concatenate(corners))


def read_vtp_labels(data: Content, name: str = "label") -> Array:
    """The cell data of the polygons with this name, by default ``label``."""
    labels = _labels(data, name)
    if labels is None:
        raise MeshError(f"the VTP file has no cell data {name}")
    if labels.dtype.kind not in "iu":
        raise MeshError("labels must be integers: the VTP file holds something else")
    return labels


def has_vtp_labels(data: Content, name: str = "label") -> bool:
    """Whether a VTP file has cell data of that name."""
    return _labels(data, name) is not None


def _labels(data: Content, name: str) -> Array | None:
    """The values of polygons: in each piece they follow those of vertices and lines."""
    file, parts = _open(data), []
    for piece in file.pieces:
        n_before = piece.count("NumberOfVerts") + piece.count("NumberOfLines")
        n_cells = n_before + piece.count("NumberOfPolys")
        values = file.cell_data(piece, name, n_cells) if n_cells else np.empty(0, np.int8)
        if values is None:
            return None
        parts.append(values[n_before:])
    return np.concatenate(parts) if parts else None


def _open(data: Content) -> XmlFile:
    if not is_vtp(data):
        raise MeshError("not a VTP file: it does not begin as a VTKFile of type PolyData")
    file = XmlFile(data, "PolyData")
    if any(piece.count("NumberOfStrips") for piece in file.pieces):
        raise MeshError("the VTP file holds triangle strips: save it with polygons")
    return file
