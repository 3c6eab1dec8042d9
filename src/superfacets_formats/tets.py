"""Read tetrahedra from VTU, VTK, MSH and MESH files."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from superfacets import MeshError
from superfacets.kit import Content, Input, Read, check_length, counted

from . import medit, msh, vtk_legacy
from .grids import Grid
from .tet_mesh import TetMesh
from .vtk_xml import XmlFile


def _read_vtu(data: Content, name: str) -> Grid:
    file = XmlFile(data, "UnstructuredGrid")
    if not file.pieces:
        raise MeshError("the VTU file has no element Piece")
    points, sizes, corners = file.cells("Cells", "NumberOfCells")
    values = file.cell_data(name, "NumberOfCells") if name else None
    return Grid(points, file.kinds(), sizes, corners, values)


class TetFormat(NamedTuple):
    """A file format of tetrahedra."""

    read: Callable[[Content, str], Grid]  # takes the content and a name of cell data, or ""

    def cells(self, source: Input) -> Read:
        """Return the tetrahedra, in the order of the file; points, lines and faces are skipped.

        Raises a MeshError if there are other volume cells, or no tetrahedra.
        """
        grid = self._checked(source.data, "label")
        face = [] if grid.values is None else [("label", grid.values[grid.is_tet()])]
        return source.of_cells(TetMesh(grid.vertices, grid.tets()), face=face)

    def _checked(self, data: Content, name: str) -> Grid:
        grid = self.read(data, name)
        n_cells = len(grid.kinds)
        if len(grid.sizes) != n_cells or int(grid.sizes.sum()) != len(grid.corners):
            raise MeshError(
                f"the file has types of {counted(n_cells, 'cell')}, but sizes of"
                f" {len(grid.sizes)} and {counted(len(grid.corners), 'corner')}: the file may be"
                " damaged"
            )
        if grid.values is not None:
            check_length(grid.values, n_cells, name, error=MeshError)
        return grid


read_medit, read_msh, read_vtk, read_vtu = (
    TetFormat(read).cells
    for read in (medit.read_medit, msh.read_msh, vtk_legacy.read_vtk, _read_vtu)
)
