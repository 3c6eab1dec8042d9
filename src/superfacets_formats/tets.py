"""Read volume meshes and surfaces from VTU, VTK, MSH and MESH files."""

from __future__ import annotations

from superfacets import MeshError
from superfacets.kit import Input, Read

from .grids import Grid
from .vtk_xml import XmlFile


def read_vtu(source: Input) -> Read:
    """Read a VTU file, by VTK if it is compressed with LZ4."""
    file = XmlFile(source.data, "UnstructuredGrid")
    if file.needs_vtk:
        return Grid.of_foreign("read_with_vtk", source).read(source)
    file.declare_others(source)
    if not file.pieces:
        raise MeshError("the VTU file has no element Piece")
    points, sizes, corners = file.cells("Cells", "NumberOfCells")
    point = file.data("PointData", "NumberOfPoints")
    cell = file.data("CellData", "NumberOfCells")
    return Grid(points, file.kinds(), sizes, corners, point, cell).read(source)


def read_vtk(source: Input) -> Read:
    """Read a legacy VTK file with VTK."""
    if source.data[:22] != b"# vtk DataFile Version":
        raise MeshError("not a VTK file: it does not begin with # vtk DataFile Version")
    return Grid.of_foreign("read_with_vtk", source).read(source)


def read_with_meshio(source: Input) -> Read:
    """Read an MSH file of Gmsh or a MESH file of Medit with meshio."""
    return Grid.of_foreign("read_with_meshio", source).read(source)
