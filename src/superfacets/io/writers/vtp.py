"""VTP of a mesh with labels and colors per face, written by VTK."""

from __future__ import annotations

from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ...mesh.faces import FaceMesh, corners_in_a_row, face_sizes
from ..attributes import MeshAttributes
from ..foreign import file_to_fill, vtk_modules

__all__ = ["write_vtp"]


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
    """Write checked arrays; labels and colors are cell data, these of the name `colors`."""
    of_faces: dict[str, npt.NDArray[Any]] = dict(attributes.face if attributes else {})
    if labels is not None:
        of_faces[label_name] = labels
    if colors is not None:
        of_faces["colors"] = colors
    with vtk_modules() as vtk, file_to_fill(".vtp") as path:
        surface = _surface(vtk, mesh)
        for data, arrays in (
            (surface.GetPointData(), attributes.vertex if attributes else {}),
            (surface.GetCellData(), of_faces),
        ):
            for name, values in arrays.items():
                array = vtk.numpy_to_vtk(np.ascontiguousarray(values), deep=True)
                array.SetName(name)
                data.AddArray(array)
        writer = vtk.vtkXMLPolyDataWriter()
        writer.SetInputData(surface)
        writer.SetFileName(str(path))
        if ascii:
            writer.SetDataModeToAscii()
        if not writer.Write():
            raise OSError(f"{path}: VTK could not write it")
        file.write(path.read_bytes())


def _surface(vtk: Any, mesh: FaceMesh) -> Any:
    surface, points, polygons = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(vtk.numpy_to_vtk(mesh.vertices, deep=True))
    offsets = np.concatenate([[0], np.cumsum(face_sizes(mesh))])
    polygons.SetData(
        *(
            vtk.numpy_to_vtk(array.astype(np.int64), deep=True, array_type=vtk.VTK_LONG_LONG)
            for array in (offsets, corners_in_a_row(mesh))
        )
    )
    surface.SetPoints(points)
    surface.SetPolys(polygons)
    return surface
