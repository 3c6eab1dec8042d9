"""Writing a mesh with its labels, or labels alone, so that the file appears whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np
import numpy.lib.format as npy_format
import numpy.typing as npt

from ..._validate import refuse_mask
from ...adapters.convert import as_cells
from ...errors import MeshError
from ...mesh.faces import AnyCells, FaceMesh, n_cells_of, noun_of
from ...mesh.point_cloud import PointCloud
from ...mesh.tet_mesh import TetMesh
from ..atomic import StrPath, atomic_outputs, checked_targets
from ..attributes import MeshAttributes
from ..guards import known_ending
from ..readers.labels import checked_labels
from .clouds import CLOUD_WRITERS
from .ply import write_ply
from .tets import TET_OUTPUTS, write_tets
from .vtp import write_vtp

__all__ = [
    "CLOUD_OUTPUTS",
    "LABEL_OUTPUTS",
    "MESH_OUTPUTS",
    "OUTPUT_ENDINGS",
    "check_outputs",
    "write_labels",
    "write_mesh",
    "write_outputs",
]

FACE_OUTPUTS = (".ply", ".vtp")
MESH_OUTPUTS = FACE_OUTPUTS + TET_OUTPUTS
CLOUD_OUTPUTS = (".csv", ".las", ".laz")
"""Of point clouds alone."""
LABEL_OUTPUTS = (".npy", ".seg", ".txt")
OUTPUT_ENDINGS = (*MESH_OUTPUTS, *CLOUD_OUTPUTS, *LABEL_OUTPUTS)

NO_STREAMS: Mapping[str, IO[bytes]] = MappingProxyType({})

LABELS_AT_ONCE = 1 << 16
"""Labels turned into text at a time."""


def write_mesh(
    path: StrPath,
    mesh: Any,
    labels: npt.ArrayLike | None = None,
    *,
    colors: npt.ArrayLike | None = None,
    attributes: MeshAttributes | None = None,
    ascii: bool = False,
) -> None:
    """Write a mesh, with labels and colors of its faces, as PLY or VTP.

    Vertices are ``float`` where that is exact for every coordinate, else ``double``. Faces are
    ``list uchar int vertex_indices`` (``list int int`` where one has more than 255 corners);
    labels add ``int label`` and ``float quality`` (the same, exact below 2**24, for MeshLab);
    labels or colors add ``uchar red green blue alpha``. VTP has double vertices, and cell data
    ``label`` and ``colors``.

    Parameters
    ----------
    path : path-like
        Ends in ``.ply``, or in ``.vtp``, which needs the extra ``io``; for a `TetMesh`, in
        ``.vtu`` or ``.vtk``, which need it too and hold the labels alone; for a `PointCloud`, in
        ``.ply``, in ``.csv`` (x, y, z and label), or in ``.las`` or ``.laz``, which need the extra
        ``las``. A file there is replaced once all is written, and keeps its permissions.
    mesh : Mesh, PolygonMesh, TetMesh, PointCloud, or what is like one
        As for `segment`. Polygons stay polygons. Labels and colors of a cloud are properties of
        its vertices; LAS has the labels as a further dimension ``label``.
    labels : array_like of integers, shape (F,), optional
        0 and up.
    colors : array_like of uint8, shape (F, 3), optional
        Red, green, blue. With labels and no colors, those of `face_colors`.
    attributes : MeshAttributes, optional
        What else is stored with the vertices and faces, from `read_attributes` or made by hand.
        Those with the name of a property above that the file gets are left out.
    ascii : bool, default False
        Text instead of binary little-endian, for readers that need it.

    Raises
    ------
    ValueError
        If the ending, a shape or a dtype is wrong, or a label is negative.
    TypeError
        If `attributes` are none.
    OSError
        If the file cannot be written.

    Notes
    -----
    Linear in V + F; the file is made piece by piece.

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
    ending = known_ending(Path(path), MESH_OUTPUTS + CLOUD_OUTPUTS)
    cells = as_cells(mesh)
    cell_labels = None if labels is None else checked_labels(labels, n_cells_of(cells))
    write = _mesh_writer(cells, cell_labels, colors, attributes, ascii=ascii)
    _check_kind(cells, ending)
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        write(file, ending)


def write_labels(path: StrPath, labels: npt.ArrayLike) -> None:
    r"""Write one label per face, in face order.

    Parameters
    ----------
    path : path-like
        Ends in ``.npy`` (int32), or in ``.seg`` or ``.txt`` (one integer per line, no header). A
        file there is replaced once all is written, and keeps its permissions.
    labels : array_like of integers, shape (F,)
        0 and up.

    Raises
    ------
    ValueError
        If the ending, the shape or the dtype is wrong, or a label is negative.
    OSError
        If the file cannot be written.

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
    ending = known_ending(Path(path), LABEL_OUTPUTS)
    face_labels = checked_labels(labels)
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        _write_labels_to(file, ending, face_labels)


def write_outputs(
    paths: Sequence[StrPath],
    mesh: Any,
    labels: npt.ArrayLike,
    *,
    streams: Mapping[str, IO[bytes]] = NO_STREAMS,
    attributes: MeshAttributes | None = None,
    ascii: bool = False,
    listed: npt.ArrayLike | None = None,
) -> None:
    """Write several files, each by its ending, such that all appear, or none.

    Parameters
    ----------
    paths : sequence of path-like
        ``.ply`` and ``.vtp`` for the mesh with labels, see `write_mesh`; ``.npy``, ``.seg`` and
        ``.txt`` for the labels alone, see `write_labels`.
    mesh : Mesh, PolygonMesh, TetMesh or mesh-like
        As for `segment`. Polygons stay polygons.
    labels : array_like of integers, shape (F,)
        0 and up.
    streams : mapping of str to binary file, optional
        Open files to write to as well, when the others are complete, by the ending that tells the
        format. They need not be seekable; if one fails, the others are not written.
    attributes : MeshAttributes, optional
        Goes into each PLY, see `write_mesh`.
    ascii : bool, default False
        Whether PLY is text.
    listed : array_like of integers, optional
        Labels for the files of labels alone, 0 and up, where these are of another mesh.

    Raises
    ------
    ValueError
        If an ending, a shape or a dtype is wrong, a label is negative, or a file is given twice.
    OSError
        If a file cannot be written.
    """
    endings = [known_ending(Path(path), OUTPUT_ENDINGS) for path in paths]
    cells = as_cells(mesh)
    cell_labels = checked_labels(labels, n_cells_of(cells))
    listed_labels = cell_labels if listed is None else checked_labels(listed)
    meshes = [ending for ending in (*endings, *streams) if ending not in LABEL_OUTPUTS]
    for ending in meshes:
        _check_kind(cells, ending)
    if meshes:
        write_mesh_to = _mesh_writer(cells, cell_labels, None, attributes, ascii=ascii)

    def write_to(file: IO[bytes], ending: str) -> None:
        if ending in LABEL_OUTPUTS:
            _write_labels_to(file, ending, listed_labels)
        else:
            write_mesh_to(file, ending)

    with atomic_outputs(paths) as temporaries:
        for temporary, ending in zip(temporaries, endings, strict=True):
            with temporary.open("wb") as file:
                write_to(file, ending)
        for ending, stream in streams.items():
            write_to(stream, ending)
            stream.flush()


def _check_kind(mesh: AnyCells, ending: str) -> None:
    """Raise a MeshError if files of this kind hold other cells."""
    if isinstance(mesh, PointCloud):
        fitting: tuple[str, ...] = tuple(CLOUD_WRITERS)
    else:
        fitting = TET_OUTPUTS if isinstance(mesh, TetMesh) else FACE_OUTPUTS
    if ending not in fitting:
        what = "tetrahedra" if isinstance(mesh, TetMesh) else f"{noun_of(mesh)}s"
        raise MeshError(f"{what} are written as {' or '.join(fitting)}, not as {ending}")


def _mesh_writer(
    mesh: AnyCells,
    labels: npt.NDArray[np.int32] | None,
    colors: Any,
    attributes: MeshAttributes | None,
    *,
    ascii: bool,
) -> Callable[[IO[bytes], str], None]:
    """Check what goes with a mesh, and return what writes it to a file of some ending."""
    if isinstance(mesh, TetMesh):
        if colors is not None or attributes is not None:
            raise ValueError("files of tetrahedra hold labels: leave out colors and attributes")
        return lambda file, ending: write_tets(file, mesh, labels, ending, ascii=ascii)
    face_colors = _checked_colors(colors, mesh, labels)
    _check_attributes(attributes, mesh)

    def write(file: IO[bytes], ending: str) -> None:
        if isinstance(mesh, PointCloud):
            write_points = CLOUD_WRITERS[ending]
            write_points(file, mesh, labels, face_colors, ascii=ascii, attributes=attributes)
        else:
            write_faces = write_vtp if ending == ".vtp" else write_ply
            write_faces(file, mesh, labels, face_colors, ascii=ascii, attributes=attributes)

    return write


def check_outputs(paths: Sequence[StrPath]) -> None:
    """Find out before the long work whether `write_outputs` could write these files.

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


def _checked_colors(
    colors: Any, mesh: FaceMesh | PointCloud, labels: npt.NDArray[np.int32] | None
) -> npt.NDArray[np.uint8] | None:
    """The colors as given, or those of the labels, or None where there are neither."""
    if colors is None:
        if labels is None:
            return None
        from ...view.colors import face_colors

        return face_colors(mesh, labels)
    refuse_mask(colors, "colors")
    array = np.asarray(colors)
    n_cells = n_cells_of(mesh)
    if array.shape != (n_cells, 3):
        raise ValueError(f"colors must have shape ({n_cells}, 3), got {array.shape}")
    if array.dtype.kind not in "iu" or array.min() < 0 or array.max() > 255:
        raise ValueError("colors must be integers from 0 to 255")
    return array.astype(np.uint8)


def _check_attributes(attributes: Any, mesh: FaceMesh | PointCloud) -> None:
    """Raise an error where they are no attributes, or not of this mesh."""
    if attributes is None:
        return
    if not isinstance(attributes, MeshAttributes):
        raise TypeError(f"attributes must be MeshAttributes, got {type(attributes).__name__}")
    if isinstance(mesh, PointCloud):
        n_vertices, n_faces = mesh.n_points, 0
    else:
        n_vertices, n_faces = mesh.n_vertices, mesh.n_faces
    for owner, values, n_rows in (
        ("vertex", attributes.vertex, n_vertices),
        ("face", attributes.face, n_faces),
    ):
        for name, array in values.items():
            if len(array) != n_rows:
                raise ValueError(
                    f"the {owner} property {name} has {len(array)} values for {n_rows} in the mesh"
                )


def _write_labels_to(file: IO[bytes], ending: str, labels: npt.NDArray[np.int32]) -> None:
    if ending == ".npy":  # numpy.save asks a file where it stands, which pipes cannot tell
        header = npy_format.header_data_from_array_1_0(labels)
        npy_format.write_array_header_1_0(file, header)
        file.write(labels.data)
        return
    for begin in range(0, len(labels), LABELS_AT_ONCE):
        part = labels[begin : begin + LABELS_AT_ONCE].tolist()
        file.write(b"%d\n" * len(part) % tuple(part))
