"""Read tetrahedra from VTU, VTK, MSH and MESH files."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from superfacets import MeshError
from superfacets.kit import Array, Content, as_integers, check_length, counted

from .grids import Grid
from .medit import read_medit
from .msh import read_msh
from .tet_mesh import TetMesh
from .vtk_legacy import read_vtk
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

    def mesh(self, data: Content) -> TetMesh:
        """Return the tetrahedra, in the order of the file; points, lines and faces are skipped.

        Raises a MeshError if there are other volume cells, or no tetrahedra.
        """
        grid = self._checked(data, "")
        return TetMesh(grid.vertices, grid.tets())

    def labels(self, data: Content, name: str) -> Array | None:
        """Return the cell data `name` of the tetrahedra, or None if the file has no such data."""
        grid = self._checked(data, name)
        if grid.values is None:
            return None
        return as_integers(grid.values[grid.is_tet()], "labels")  # MSH stores cell data as floats

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


MEDIT, MSH, VTK, VTU = map(TetFormat, (read_medit, read_msh, read_vtk, _read_vtu))
