"""Write each region to a file of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..adapters.convert import as_cells
from ..cells.kinds import kind_of
from ..errors import MeshError
from ..io.atomic import StrPath, atomic_outputs, output_folder
from ..io.readers.labels import checked_labels
from ..regions.submeshes import Splitter
from .cells import CellWriter, FormatOptions, usual_ending


def write_regions(
    folder: StrPath,
    mesh: Any,
    labels: npt.ArrayLike,
    *,
    ending: str | None = None,
    ascii: bool = False,
) -> list[Path]:
    """Write the cells of each region to a file of their own: all files, or none.

    Parameters
    ----------
    folder : path-like
        Created if it does not exist. Files are named after the labels: ``region_17.ply``.
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, mesh-like or cloud-like
        As for `segment`. Points keep their normals and colors.
    labels : array_like of integers, shape (N,)
        0 and up; cells labeled -1 are in no file.
    ending : str, optional
        Ending of the files, which tells the format: one that `write_mesh` knows for these cells. By
        default ``.vtu`` for tetrahedra, and ``.ply`` for other cells.
    ascii : bool, default False
        As for `write_mesh`.

    Returns
    -------
    list of Path
        The files, in the order of the labels.

    Raises
    ------
    ValueError
        If the ending or a label is wrong, no cell is in a region, or all faces of a region lie at
        one point.
    OSError
        If a file cannot be written.

    Notes
    -----
    Cells keep their order. A file holds only the vertices that its cells use, in the order of the
    mesh. Files that an earlier call wrote for other labels are not removed.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> with TemporaryDirectory() as folder:
    ...     [path.name for path in write_regions(folder, square, [4, 2], ending=".obj")]
    ['region_2.obj', 'region_4.obj']
    """
    cells = as_cells(mesh)
    ending = usual_ending(kind_of(cells).name) if ending is None else ending
    cell_labels = checked_labels(labels, cells.n_cells)
    order = np.argsort(cell_labels, kind="stable").astype(np.int32)
    order = order[np.searchsorted(cell_labels[order], 0) :]
    if not len(order):
        raise MeshError("no cell is in a region: all labels are -1")
    starts = np.flatnonzero(np.diff(cell_labels[order], prepend=-1))
    members = np.split(order, starts[1:])
    names = [f"region_{cell_labels[cells_of[0]]}{ending}" for cells_of in members]
    options = FormatOptions(ascii=ascii)
    CellWriter(cells, None, None, None, options).checked([ending])
    paths = [Path(folder, name) for name in names]
    splitter = Splitter(cells)
    with output_folder(Path(folder)), atomic_outputs(paths) as temporaries:
        for temporary, cells_of in zip(temporaries, members, strict=True):
            part = splitter.named_part(cells_of, int(cell_labels[cells_of[0]]))
            with temporary.open("wb") as file:
                CellWriter(part.mesh, None, None, None, options).write(file, ending)
    return paths
