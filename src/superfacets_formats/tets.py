"""Read tetrahedra from VTU, VTK, MSH and MESH files."""

from __future__ import annotations

from collections.abc import Callable

from superfacets.base.checks import check_length, counted
from superfacets.base.errors import MeshError
from superfacets.base.types import Array
from superfacets.files.guards import Content, TriangleArrays
from superfacets.files.readers.text import as_integers

from .grids import Grid
from .medit import read_medit
from .msh import read_msh
from .vtk_legacy import read_vtk
from .vtk_xml import XmlFile


def read_tets(data: Content, ending: str) -> TriangleArrays:
    """Return vertices, (V, 3), and tetrahedra, (N, 4), in the order of the file.

    Points, lines and faces are skipped. Raises a MeshError if there are other volume cells, or no
    tetrahedra.
    """
    grid = _read(data, ending, "")
    return grid.vertices, grid.tets()


def tet_labels(data: Content, name: str, *, ending: str) -> Array | None:
    """Return the cell data `name` of the tetrahedra, or None if the file has no such data."""
    grid = _read(data, ending, name)
    if grid.values is None:
        return None
    return as_integers(grid.values[grid.is_tet()], "labels")  # MSH stores cell data as floats


def _read(data: Content, ending: str, name: str) -> Grid:
    grid = _READERS[ending](data, name)
    n_cells = len(grid.kinds)
    if len(grid.sizes) != n_cells or int(grid.sizes.sum()) != len(grid.corners):
        raise MeshError(
            f"the file has types of {counted(n_cells, 'cell')}, but sizes of {len(grid.sizes)} and"
            f" {counted(len(grid.corners), 'corner')}: the file may be damaged"
        )
    if grid.values is not None:
        check_length(grid.values, n_cells, name, error=MeshError)
    return grid


def _read_vtu(data: Content, name: str) -> Grid:
    file = XmlFile(data, "UnstructuredGrid")
    if not file.pieces:
        raise MeshError("the VTU file has no element Piece")
    points, sizes, corners = file.cells("Cells", "NumberOfCells")
    values = file.cell_data(name, "NumberOfCells") if name else None
    return Grid(points, file.kinds(), sizes, corners, values)


_READERS: dict[str, Callable[[Content, str], Grid]] = {
    ".mesh": read_medit,
    ".msh": read_msh,
    ".vtk": read_vtk,
    ".vtu": _read_vtu,
}

TET_ENDINGS = tuple(_READERS)
