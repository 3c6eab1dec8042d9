"""VTP files of a mesh with labels and colors per face."""

from __future__ import annotations

from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ..io.attributes import MeshAttributes
from ..mesh.faces import FaceMesh, corners_in_a_row, face_sizes
from .vtk_xml import write_vtk_xml


def write_vtp(
    file: IO[bytes],
    mesh: FaceMesh,
    labels: npt.NDArray[np.int32] | None,
    colors: npt.NDArray[np.uint8] | None,
    *,
    ascii: bool,
    attributes: MeshAttributes | None = None,
    label_name: str = "label",
) -> None:
    """Write checked arrays; labels (named `label_name`) and ``colors`` are cell data."""
    of_faces: dict[str, npt.NDArray[Any]] = dict(attributes.face if attributes else {})
    if labels is not None:
        of_faces[label_name] = labels
    if colors is not None:
        of_faces["colors"] = colors
    polygons = {
        "connectivity": corners_in_a_row(mesh).astype(np.int64),
        "offsets": np.cumsum(face_sizes(mesh), dtype=np.int64),
    }
    sections = {
        "PointData": attributes.vertex if attributes else {},
        "CellData": of_faces,
        "Points": {"Points": mesh.vertices},
        "Polys": polygons,
    }
    counts = {"NumberOfPoints": len(mesh.vertices), "NumberOfPolys": mesh.n_faces}
    write_vtk_xml(file, "PolyData", counts, sections, ascii=ascii)
