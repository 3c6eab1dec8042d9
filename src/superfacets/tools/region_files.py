"""Write the cells of each region to a file of its own."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.checks import refuse_order
from ..base.errors import MeshError
from ..files.atomic import StrPath, atomic_outputs, output_folder
from ..files.formats import FORMATS
from ..files.readers.labels import checked_labels
from ..files.writers.cells import CellWriter, FormatOptions
from ..files.writers.write import Written
from ..graph.kinds import kind_of
from ..mesh.attributes import MeshAttributes, is_image
from ..mesh.convert import as_cells
from ..regions.submeshes import Submesh, part_of


def write_regions(
    folder: StrPath, mesh: Any, labels: npt.ArrayLike, *, ending: str | None = None,
    attributes: MeshAttributes | None = None, ascii: bool = False,
) -> list[Path]:  # fmt: skip
    """Write the cells of each region to a separate file: either all files, or none.

    Parameters
    ----------
    folder : path-like
        Folder for the files, created if missing. Files are named after the labels, for example
        ``region_017.ply`` if there are hundreds; they replace existing files.
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, mesh-like or cloud-like
        The cells, which keep their order. A file has only the vertices of its cells, in the order
        of the mesh. Points keep their normals and colors.
    labels : array_like of integers, shape (N,)
        Region of each cell, 0 or greater. Cells with label -1 are not written.
    ending : str, optional
        Ending of the files, which selects a format as in `write_mesh`. By default ``.vtu`` for
        tetrahedra, and ``.ply`` for other cells.
    attributes : MeshAttributes, optional
        Other properties, such as colors; each file gets those of its vertices and faces, but no
        texture. A warning names properties that the format does not store.
    ascii : bool, default False
        Same as in `write_mesh`.

    Returns
    -------
    list of Path
        Paths of the files, in ascending order of the labels.

    Raises
    ------
    ValueError
        If the ending, a label or the length of an attribute is wrong, if all labels are -1, or if
        all vertices of a region are at one point.
    FileExistsError
        If the folder already contains other region files with this ending, which are not replaced.
    OSError
        If a file cannot be written.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> [path.name for path in write_regions("regions", square, [4, 2], ending=".obj")]
    ['region_2.obj', 'region_4.obj']
    """
    refuse_order(folder, "a path")
    cells = as_cells(mesh)
    ending = FORMATS.usual_output(kind_of(cells).name) if ending is None else ending
    cell_labels = checked_labels(labels, cells.n_cells, getattr(cells, "n_vertices", None))
    order = np.argsort(cell_labels, kind="stable").astype(np.int32)
    order = order[np.searchsorted(cell_labels[order], 0) :]
    if not len(order):
        raise MeshError("no cell is in a region: all labels are -1")
    members = np.split(order, np.flatnonzero(np.diff(cell_labels[order], prepend=-1))[1:])
    values = [int(cell_labels[cells_of[0]]) for cells_of in members]
    n_digits = len(str(values[-1]))
    options = FormatOptions(ascii=ascii)
    CellWriter(cells, None, None, attributes, options).checked([ending])
    paths = [Path(folder, f"region_{value:0{n_digits}}{ending}") for value in values]
    _check_no_other_regions(Path(folder), paths, ending)
    lost: list[str] = []
    with output_folder(Path(folder)), atomic_outputs(paths) as temporaries:
        for temporary, cells_of, value in zip(temporaries, members, values, strict=True):
            part = part_of(cells, cells_of, value)
            with temporary.open("wb") as file:
                is_named = ascii and ending == ".stl"
                named = np.full(len(cells_of), value, np.int32) if is_named else None
                kept = None if attributes is None else _attributes_of(part, attributes)
                lost += CellWriter(part.mesh, named, None, kept, options).write(file, ending)
    for note in Written({ending: [*dict.fromkeys(lost)]}, np.zeros(0, np.int64)).notes():
        warnings.warn(note, stacklevel=2)
    return paths


def _attributes_of(part: Submesh, attributes: MeshAttributes) -> MeshAttributes:
    """Return the attributes of the vertices and cells of a part, without the texture."""
    return replace(
        attributes,
        vertex={name: values[part.vertices] for name, values in attributes.vertex.items()},
        face={name: values[part.cells] for name, values in attributes.face.items()},
        comments=tuple(line for line in attributes.comments if not is_image(line)),
        texture=None,
    )


def _check_no_other_regions(folder: Path, paths: Sequence[Path], ending: str) -> None:
    """Raise a FileExistsError if region files of an earlier run would stay in the folder."""
    others = {*folder.glob(f"region_*{ending}")}.difference(paths)
    names = [path.name.removesuffix(ending).removeprefix("region_") for path in others]
    numbers = [name for name in names if name.isdecimal()]
    if numbers:
        raise FileExistsError(
            f"{folder} already contains other region files, such as region_{min(numbers)}{ending}:"
            " give a new or empty folder"
        )
