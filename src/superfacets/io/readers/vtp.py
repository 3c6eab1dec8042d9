"""VTP: the polygons of a surface of VTK, read by VTK."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import MeshError
from ..foreign import file_of, vtk_modules
from ..guards import Arrays, Content, as_doubles, checked_faces

__all__ = ["has_vtp_labels", "is_vtp", "read_vtp", "read_vtp_labels"]


def read_vtp(data: Content) -> Arrays:
    """Vertices and polygons of a VTP file; single points and lines are skipped."""
    _check_begin(data)
    with vtk_modules() as vtk:
        surface = _surface(vtk, data)
        polygons = surface.GetPolys()
        polygons.ConvertTo64BitStorage()
        # Copies: the memory is VTK's.
        vertices = np.array(as_doubles(vtk.vtk_to_numpy(surface.GetPoints().GetData())))
        offsets, indices = (
            np.array(vtk.vtk_to_numpy(array), dtype=np.int64)
            for array in (polygons.GetOffsetsArray(), polygons.GetConnectivityArray())
        )
    if len(offsets) < 2:
        raise MeshError("the VTP file has no polygons")
    return vertices, checked_faces(np.diff(offsets), indices)


def read_vtp_labels(data: Content, name: str = "label") -> npt.NDArray[Any]:
    """The cell data `label` of a VTP file, or what has that name."""
    _check_begin(data)
    with vtk_modules() as vtk:
        surface = _surface(vtk, data)
        stored = surface.GetCellData().GetArray(name)
        if stored is None:
            raise MeshError(f"the VTP file has no cell data {name}")
        labels = np.array(vtk.vtk_to_numpy(stored))
    if labels.dtype.kind not in "iu" or labels.ndim != 1:
        raise MeshError("labels must be integers: the VTP file holds something else")
    return labels


def has_vtp_labels(data: Content, name: str = "label") -> bool:
    """Whether a VTP file has cell data of that name."""
    _check_begin(data)
    with vtk_modules() as vtk:
        return _surface(vtk, data).GetCellData().GetArray(name) is not None


def is_vtp(data: Content) -> bool:
    """Whether a file begins as those of VTK with a surface do."""
    head = data[:1000]
    return b"<VTKFile" in head and b"PolyData" in head


def _check_begin(data: Content) -> None:
    if not is_vtp(data):
        raise MeshError("not a VTP file: it does not begin as a VTKFile of type PolyData")


def _surface(vtk: Any, data: Content) -> Any:
    with file_of(data, ".vtp") as path:
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(path)
        reader.Update()
    surface = reader.GetOutput()
    if reader.GetErrorCode() or surface.GetPoints() is None:
        raise MeshError("VTK cannot read the VTP file: is it cut or damaged?")
    if surface.GetNumberOfStrips():
        raise MeshError("the VTP file holds triangle strips: save it with polygons")
    return surface
