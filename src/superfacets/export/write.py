"""Write a mesh with its labels, or labels only; a file appears complete or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from ..adapters.convert import as_cells
from ..io.atomic import StrPath, atomic_outputs, checked_targets
from ..io.attributes import MeshAttributes
from ..io.guards import known_ending
from ..io.readers.labels import checked_labels
from ..mesh.cells import Cells
from .cells import CLOUD_OUTPUTS, MESH_OUTPUTS, CellWriter, FormatOptions
from .ids import ID_OUTPUTS, LABEL_OUTPUTS, VERTEX_OUTPUTS, IdWriter, write_given_labels
from .pyg import GRAPH_OUTPUTS

DERIVED_OUTPUTS = (*ID_OUTPUTS, *GRAPH_OUTPUTS)
"""Files that are derived from a mesh and its labels, and hold neither."""

OUTPUT_ENDINGS = (*MESH_OUTPUTS, *CLOUD_OUTPUTS, *LABEL_OUTPUTS, *DERIVED_OUTPUTS)

ENDING_OF_FORMAT = {ending.lstrip("._"): ending for ending in OUTPUT_ENDINGS}
"""Endings by name: ``ply``, ``segs.json``, ``sp_label.npy``."""

NO_STREAMS: Mapping[str, IO[bytes]] = MappingProxyType({})


def write_mesh(
    path: StrPath,
    mesh: Any,
    labels: npt.ArrayLike | None = None,
    *,
    colors: npt.ArrayLike | None = None,
    attributes: MeshAttributes | None = None,
    ascii: bool = False,
    label_name: str = "label",
    vertex_labels: bool = False,
    classes: Sequence[str] | Sequence[int] | None = None,
) -> None:
    """Write a mesh, with labels and colors of its faces, in the format of the file's ending.

    In PLY, vertices are ``float`` where that is exact for every coordinate, else ``double``. Faces
    are ``list uchar int vertex_indices`` (``list int int`` where one has more than 255 corners);
    labels add ``int label`` and ``float quality`` (the same, exact below 2**24, for MeshLab);
    labels or colors add ``uchar red green blue alpha``. VTP has double vertices, and cell data
    ``label`` and ``colors``. The user guide, Export, says what the other formats hold.

    Parameters
    ----------
    path : path-like
        Ends in ``.ply``, ``.obj`` (a group per region), ``.off`` (colors), ``.glb`` (ids and a
        table of regions), or in ``.vtp``, which needs the extra ``io``; for a `TetMesh`, in
        ``.vtu`` or ``.vtk``, which need it too and hold the labels alone; for a `PointCloud`, in
        ``.ply``, in ``.csv`` (x, y, z and label), or in ``.las`` or ``.laz``, which need the extra
        ``las``. Or, for the labels of the vertices of the mesh, or points of the cloud, in
        ``.segs.json``, ``.bin`` or ``_sp_label.npy``; for those of triangles in ``.sstk.json``;
        and in ``.aggregation.json``; for the graph of regions in ``.npz``, as `write_graphs` writes
        that of `region_graph`. A file there is replaced once all is written, and keeps its
        permissions.
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, or what is like one
        As for `segment`. Polygons stay polygons, but in GLB. Labels and colors of a cloud are
        properties of its vertices; LAS has the labels as a further dimension ``label``.
    labels : array_like of integers, shape (F,), optional
        0 and up; -1 where a face is in no region.
    colors : array_like of uint8, shape (F, 3), optional
        Red, green, blue. With labels and no colors, those of `face_colors`.
    attributes : MeshAttributes, optional
        What else is stored with the vertices and faces, from `read_attributes` or made by hand.
        Those with the name of a property above that the file gets are left out. For PLY, VTP and
        LAS; other formats have no place for them.
    ascii : bool, default False
        Text instead of binary little-endian, for readers that need it.
    label_name : str, default "label"
        Name of the array of labels in VTP, VTU and VTK: dental tools want ``Label``.
    vertex_labels : bool, default False
        Whether a PLY also has the labels of its vertices, see `superfacets.vertex_labels`, as a
        vertex property ``label``.
    classes : sequence of str or int, length K, optional
        What each region is, in the order of the labels that occur: a column of the table in GLB,
        and the labels of groups in ``.aggregation.json``.

    Raises
    ------
    ValueError
        If the ending, a shape or a dtype is wrong, a label is below -1, the format does not hold
        these cells or so many of them, or has no place for what an option asks for; or if labels
        are -1 in a format whose ids begin at 0.
    TypeError
        If `attributes` are none.
    OSError
        If the file cannot be written.

    Notes
    -----
    Linear in V + F, but for a sort in OBJ and GLB. The file is made piece by piece; GLB is made in
    memory, some 200 bytes a face, and holds up to 4 GiB.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from superfacets import Mesh
    >>> square = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.ply")
    ...     write_mesh(path, square, colors=[[255, 0, 0], [0, 0, 255]], ascii=True)
    ...     print(path.read_text().splitlines()[-1])
    3 0 2 3 0 0 255 255
    """
    path = Path(path)
    ending = known_ending(path, (*MESH_OUTPUTS, *CLOUD_OUTPUTS, *DERIVED_OUTPUTS))
    options = FormatOptions.checked(
        [ending], ascii=ascii, label_name=label_name, vertex_labels=vertex_labels, classes=classes
    )
    cells = as_cells(mesh)
    cell_labels = None if labels is None else checked_labels(labels, cells.n_cells)
    write: Callable[[IO[bytes], str, Path | None], None]
    if ending in DERIVED_OUTPUTS:
        write = IdWriter(cells, cell_labels, options).checked([ending]).write
    else:
        write = CellWriter(cells, cell_labels, colors, attributes, options).checked([ending]).write
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        write(file, ending, path)


def write_labels(path: StrPath, labels: npt.ArrayLike) -> None:
    r"""Write labels as they are, in their order.

    Parameters
    ----------
    path : path-like
        Ends in ``.npy`` (int32), or in ``.seg`` or ``.txt`` (one integer per line, no header). Or,
        for labels that are those of vertices, in ``.segs.json``, ``.bin`` or ``_sp_label.npy``
        (int64, renumbered without gaps); for those of triangles in ``.sstk.json``. A file there is
        replaced once all is written, and keeps its permissions.
    labels : array_like of integers, shape (F,)
        0 and up; -1 where a face is in no region, but not in the three formats of vertices. For
        ``.sstk.json`` also (n, F): nested levels, the finest first.

    Raises
    ------
    ValueError
        If the ending, the shape or the dtype is wrong, a label is negative that may not be, an id
        for ``.segs.json`` is 2**24 or more, or levels are not nested.
    OSError
        If the file cannot be written.

    See Also
    --------
    write_mesh : Makes labels of vertices from those of faces, for the formats that need them.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.seg")
    ...     write_labels(path, [0, 1])
    ...     path.read_text()
    '0\n1\n'
    """
    path = Path(path)
    ending = known_ending(path, (*LABEL_OUTPUTS, *ID_OUTPUTS))
    write = write_given_labels(labels, ending)
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        write(file, ending, path)


def write_outputs(
    paths: Sequence[StrPath],
    mesh: Any,
    labels: npt.ArrayLike | None,
    *,
    streams: Mapping[str, IO[bytes]] = NO_STREAMS,
    attributes: MeshAttributes | None = None,
    options: FormatOptions | None = None,
    listed: npt.ArrayLike | None = None,
    listed_mesh: Any = None,
) -> int:
    """Write several files, in the formats of their endings: all appear, or none.

    Parameters
    ----------
    paths : sequence of path-like
        As for `write_mesh`, and ``.npy``, ``.seg`` and ``.txt`` for the labels alone, see
        `write_labels`.
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        As for `segment`. Polygons stay polygons.
    labels : array_like of integers, shape (F,), or None
        0 and up; -1 where a face is in no region. None where all files are meshes.
    streams : mapping of str to binary file, optional
        Open files to write to as well, when the others are complete, by the ending that tells the
        format. They need not be seekable; if one fails, the others are not written.
    attributes : MeshAttributes, optional
        Goes into each PLY, see `write_mesh`.
    options : FormatOptions, optional
        As the further arguments of `write_mesh`.
    listed : array_like of integers, optional
        Labels for the files of labels alone, where these are of another mesh.
    listed_mesh : Mesh, PolygonMesh or mesh-like, optional
        That mesh.

    Returns
    -------
    int
        Number of regions that files of labels of vertices lack, as no vertex could be spared.

    Raises
    ------
    ValueError
        As by `write_mesh`; if a file is given twice, or there are no labels for one that is labels.
    OSError
        If a file cannot be written.
    """
    endings = [known_ending(Path(path), OUTPUT_ENDINGS) for path in paths]
    options = FormatOptions() if options is None else options
    cells = as_cells(mesh)
    cell_labels = None if labels is None else checked_labels(labels, cells.n_cells)
    of_labels, of_cells = cell_labels, cells
    if listed is not None:
        of_labels = checked_labels(listed)
        of_cells = cells if listed_mesh is None else as_cells(listed_mesh)
    all_endings = {*endings, *streams}
    ids = IdWriter(of_cells, of_labels, options)
    writers = _writers(all_endings, ids, CellWriter(cells, cell_labels, None, attributes, options))
    with atomic_outputs(paths) as temporaries:
        for temporary, ending, path in zip(temporaries, endings, paths, strict=True):
            with temporary.open("wb") as file:
                writers[ending](file, ending, Path(path))
        for ending, stream in streams.items():
            writers[ending](stream, ending, None)
            stream.flush()
    return 0 if all_endings.isdisjoint(VERTEX_OUTPUTS) else ids.n_lost


def _writers(
    endings: set[str], of_labels: IdWriter, of_cells: CellWriter
) -> dict[str, Callable[[IO[bytes], str, Path | None], None]]:
    """Functions that write files by ending; a MeshError if one cannot be written."""
    listing = [ending for ending in endings if ending in (*LABEL_OUTPUTS, *DERIVED_OUTPUTS)]
    holding = [ending for ending in endings if ending not in listing]
    of_labels.checked(listing)
    of_cells = of_cells.checked(holding)
    return {**dict.fromkeys(listing, of_labels.write), **dict.fromkeys(holding, of_cells.write)}


def check_outputs(paths: Sequence[StrPath]) -> None:
    """Check before the long work whether `write_outputs` can write these files.

    Raises
    ------
    ValueError
        If an ending is not one of those that `write_outputs` knows, or a file is given twice.
    OSError
        If a folder does not exist or is not writable, or something other than a file is there.
    """
    for path in paths:
        known_ending(Path(path), OUTPUT_ENDINGS)
    checked_targets(paths)


def writer_of(
    cells: Cells,
    labels: npt.NDArray[np.int32],
    ending: str,
    form: FormatOptions,
    attributes: MeshAttributes | None = None,
) -> CellWriter | IdWriter:
    """Return the writer of files with this ending; an error if they cannot hold the cells."""
    if ending in (*MESH_OUTPUTS, *CLOUD_OUTPUTS):
        return CellWriter(cells, labels, None, attributes, form).checked([ending])
    return IdWriter(cells, labels, form).checked([ending])


def check_fit(
    cells: Cells,
    labels: npt.NDArray[np.int32] | None,
    endings: Iterable[str],
    form: FormatOptions,
) -> None:
    """Raise an error, before the long work, if files with these endings cannot hold such cells.

    Labels are those given, which others will be made of; without any, each cell will have one.
    """
    likely = np.zeros(cells.n_cells, np.int32) if labels is None else labels
    for ending in endings:
        writer_of(cells, likely, ending, form)
