"""Reading a mesh from a file of any supported format."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from ...errors import MeshError
from ...mesh.cells import Cells
from ...mesh.faces import AnyMesh
from ...mesh.point_cloud import PointCloud
from ...mesh.polygon_mesh import PolygonMesh
from ...mesh.tet_mesh import TetMesh
from ...mesh.triangle_mesh import Mesh
from ..attributes import MeshAttributes
from ..guards import Arrays, Content, Polygons, known_ending, named_errors, read_content
from .b3dm import Placement, open_model
from .clouds import CLOUD_READERS, holds_cloud
from .cortex import SURFACE_ENDINGS, TRIANGLES, read_gifti, read_surface
from .gltf import read_gltf
from .gltf_texture import read_gltf_with_attributes
from .obj import read_obj
from .obj_texture import read_obj_with_attributes
from .off import MAGIC as OFF_MAGIC
from .off import read_off, read_tri
from .ply import read_ply, read_ply_with_attributes
from .stl import cad_advice, has_binary_size, read_stl
from .tets import TET_ENDINGS, read_tets
from .vtk_xml import is_vtp, read_vtp

_READERS: dict[str, Callable[[Content], Arrays]] = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
    ".tri": read_tri,
    ".vtp": read_vtp,
    ".gii": read_gifti,
    **dict.fromkeys(SURFACE_ENDINGS, read_surface),
}

_GLTF_ENDINGS = (".glb", ".gltf", ".b3dm")

_ATTRIBUTE_READERS: dict[str, Callable[[Content, Path | None], tuple[Arrays, MeshAttributes]]] = {
    ".ply": read_ply_with_attributes,
    ".obj": read_obj_with_attributes,
}
ATTRIBUTE_ENDINGS = (*_ATTRIBUTE_READERS, *_GLTF_ENDINGS)

MESH_ENDINGS = (*_GLTF_ENDINGS, *_READERS, *TET_ENDINGS)
CELL_ENDINGS = (*MESH_ENDINGS, *(ending for ending in CLOUD_READERS if ending != ".ply"))
"""Endings of meshes and of point clouds."""

CAD_FORMATS = {".step": "STEP", ".stp": "STEP", ".iges": "IGES", ".igs": "IGES", ".brep": "BREP",
               ".fcstd": "FCStd"}  # fmt: skip
"""Formats of CAD programs that hold no mesh, by their endings."""

_BEGINS = {b"ply\n": ".ply", b"ply\r": ".ply", b"glTF": ".glb", b"b3dm": ".b3dm",
           TRIANGLES: SURFACE_ENDINGS[0]}  # fmt: skip
"""Endings of files by their first bytes."""

_NO_MESHES = {
    **dict.fromkeys(
        (".tif", ".tiff", ".asc"),
        "a raster file is no mesh: make a mesh of its heights, see Terrain in the documentation",
    ),
    **dict.fromkeys(
        (".shp", ".gpkg"),
        "a vector file is no mesh: convert its triangles or points to .ply, .obj or .csv",
    ),
}
"""Messages about files of geographic information, by ending."""

Parsed = TypeVar("Parsed")

# First word of a text that is not in a comment line.
_FIRST_WORD = re.compile(rb"(?:\s*+#[^\n]*+\n)*+\s*+(\S{1,20})")

_OBJ_WORDS = b"v vn vt vp f l p o g s mtllib usemtl".split()


def read_mesh(path: str | os.PathLike[str]) -> AnyMesh:
    r"""Return the mesh that a file holds: its vertices and faces in their order.

    Nothing is merged, split, dropped, repaired or triangulated. Vertices are as the file stores
    them: an STL file has three per face, and a glTF file repeats them along texture seams.

    Parameters
    ----------
    path : path-like
        The ending, in any case, tells the format: ``.ply`` and ``.stl`` (ASCII and binary),
        ``.obj`` (Wavefront), ``.off`` (ASCII), ``.glb`` and ``.gltf`` (2.0; the extra
        ``compressed`` reads what Draco or meshopt compress), ``.b3dm`` (z up, without its
        RTC_CENTER), ``.vtp``, and ``.tri`` (vertex count, a line of x y z per vertex, triangle
        count, a line of three indices from 0 per triangle); for the cortex ``.gii`` (GIFTI) and
        FreeSurfer's ``.white``, ``.pial``, ``.inflated``, ``.smoothwm``, ``.orig`` and ``.sphere``;
        for tetrahedra ``.vtu``, ``.vtk``
        (legacy), ``.msh`` (Gmsh 2.2 and 4.1) and ``.mesh`` (Medit, text). Triangle strips of a PLY
        become their triangles. Groups and objects become one mesh. All meshes of a glTF scene
        become one, in the order of the file, with a copy of a mesh for each node that shows it; the
        copies may take 100 times the size of the file, or 64 MB if that is more. A glTF file may
        refer to other files only in its folder or below.

    Returns
    -------
    Mesh, PolygonMesh or TetMesh
        A `Mesh` if all faces are triangles, a `PolygonMesh` otherwise; a `TetMesh` for the last
        four formats, whose triangles, lines and points are skipped. Vertices are float64, exactly
        as stored: decimals are rounded to the nearest double.

    Raises
    ------
    MeshError
        If the file is empty, cut, damaged or of another format than its ending says; if it holds
        no faces, or one with fewer than three corners; if an index or a coordinate is invalid; if
        the ending is unknown. The message is one line that begins with the path. A text file that
        was cut within its last number, or an OBJ file cut between lines, cannot be told from a
        whole one.
    MissingExtraError
        If a glTF file is compressed, and DracoPy or meshopt is not installed.
    OSError
        If there is no such file, or it cannot be read.

    Notes
    -----
    Time and memory are linear in the size of the file. Sizes that a header declares are compared
    with the file's content before memory is allocated. Compressed arrays of a VTK file may take 100
    times the size of the file, or 64 MB if that is more.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> text = "OFF 4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "square.off")
    ...     _ = path.write_text(text)
    ...     read_mesh(path)
    Mesh(4 vertices, 2 faces)
    """
    return _read(path, MESH_ENDINGS, parse_mesh)


def read_cloud(path: str | os.PathLike[str]) -> PointCloud:
    r"""Return the points that a file holds, with their normals and colors, if it has any.

    Parameters
    ----------
    path : path-like
        The ending, in any case, tells the format. ``.ply``: its vertices, with properties x, y, z,
        and optionally nx, ny, nz and red, green, blue. ``.xyz``, ``.csv`` and ``.txt``: a line of
        numbers per point, separated by blanks, commas or semicolons. The first line may name the
        columns, as in PLY. Without names, the three columns after x, y and z are colors if all
        numbers are whole and 0 to 255, or normals if all have length 1. ``.npy``: an (N, 3) array,
        or one of up to 12 columns, as in text. ``.las``. ``.laz``, which needs the extra ``las``:
        its points may take 1,000 times the size of the file, or 64 MB if that is more. ``.pcd``
        (text, binary, compressed). ``.e57``, which needs the extra ``e57``: the points of all
        scans, one scan after the other, each moved to its pose.

    Returns
    -------
    PointCloud
        The points; for a mesh in a PLY file, its vertices. Points that an E57 file declares
        invalid, and points of a PCD file whose coordinates are NaN, have no position: they are left
        out, and labels belong to the remaining points in their order.

    Raises
    ------
    MeshError
        If the file is empty, cut, damaged or of another format than its ending says, or a
        coordinate is invalid. The message is one line that begins with the path.
    MissingExtraError
        If lazrs (for ``.laz``) or pye57 (for ``.e57``) is not installed.
    OSError
        If there is no such file, or it cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "three.csv")
    ...     _ = path.write_text("x,y,z,red,green,blue\n0,0,0,255,0,0\n1,0,0,0,255,0\n")
    ...     read_cloud(path)
    PointCloud(2 points, colors)
    """
    return _read(
        path, tuple(CLOUD_READERS), lambda data, ending, _: CLOUD_READERS[ending](data).cloud
    )


def read_cells(path: str | os.PathLike[str], placement: Placement | None = None) -> Cells:
    """Return the mesh that a file holds or, where there are no faces, its points.

    `placement` moves a model of 3D Tiles.
    """
    parse = partial(parse_cells_and_attributes, keep=False, placement=placement)
    return _read(path, CELL_ENDINGS, parse)[0]


def read_cells_and_attributes(path: str | os.PathLike[str]) -> tuple[Cells, MeshAttributes | None]:
    """Like `read_cells`; also the attributes of a cloud, or of a mesh in PLY, OBJ or glTF."""
    return _read(path, CELL_ENDINGS, parse_cells_and_attributes)


def read_attributes(path: str | os.PathLike[str]) -> MeshAttributes:
    """Return the data that a file stores besides the mesh that `read_mesh` returns.

    ``write_mesh(..., attributes=...)`` writes it to a file again.

    Parameters
    ----------
    path : path-like
        Ends in ``.ply``: vertex colors, normals and all other properties except positions and
        corners, and the texture if comments ``TextureFile`` name its images. Or in ``.obj``,
        ``.glb``, ``.gltf`` or ``.b3dm``: the texture. Files of materials and images must be in the
        folder of the mesh or below it. Images are not read yet.

    Returns
    -------
    MeshAttributes
        Arrays of the types that the file declares, in the order of the file. An integer in a text
        file that its declared type cannot hold makes the property float64. `left_out` names
        missing images, and the reason if a texture cannot be read.

    Raises
    ------
    MeshError
        As for `read_mesh`, or if the path has another ending.
    OSError
        If there is no such file, or it cannot be read.

    Notes
    -----
    The file is read again. This takes as much time and memory as `read_mesh`, plus memory for the
    copies.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from superfacets import write_mesh
    >>> attributes = MeshAttributes(vertex={"nz": [1.0, 1.0, 1.0]})
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "triangle.ply")
    ...     write_mesh(path, ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]),
    ...                attributes=attributes)
    ...     read_attributes(path).vertex["nz"]
    array([1., 1., 1.])
    """
    _, attributes = _read(path, ATTRIBUTE_ENDINGS, parse_cells_and_attributes)
    assert attributes is not None  # the endings have readers of attributes
    return attributes


def _read(
    path: str | os.PathLike[str],
    endings: tuple[str, ...],
    parse: Callable[[Content, str, Path | None], Parsed],
) -> Parsed:
    """Read and parse a file with one of these endings; errors name it."""
    path = Path(path)
    ending = cell_ending(path, endings)
    data = read_content(path)
    with named_errors(path):
        return parse(data, ending, path.parent)


def cell_ending(path: Path, endings: tuple[str, ...] = CELL_ENDINGS) -> str:
    """The ending of a file to read as a mesh or a cloud; a MeshError if no reader knows it."""
    try:
        return known_ending(path, endings)
    except MeshError as error:
        if path.suffix.lower() in CAD_FORMATS:
            raise MeshError(f"{path}: {cad_advice(CAD_FORMATS[path.suffix.lower()])}") from None
        advice = ": convert the file first" if path.suffix else ""
        if path.suffix.lower() == ".json":
            advice = ": tilesets are for batch, convert and segment --tiled"
        if path.suffix.lower() in _NO_MESHES:
            raise MeshError(f"{path}: {_NO_MESHES[path.suffix.lower()]}") from None
        if path.suffix.lower() in CLOUD_READERS:
            advice = ": it holds points, use read_cloud"
        raise MeshError(f"{error}{advice}") from None


def parse_mesh(data: Content, ending: str, folder: Path | None) -> AnyMesh:
    """Parse the mesh in a file's content; a glTF may refer to files in `folder` if there is one."""
    if ending in _GLTF_ENDINGS:
        return _parse_gltf(data, folder, keep=False, placement=None)[0]
    if ending in TET_ENDINGS:
        return TetMesh(*read_tets(data, ending))
    return _mesh_of(_READERS[ending](data))


def parse_cells_and_attributes(
    data: Content,
    ending: str,
    folder: Path | None,
    *,
    keep: bool = True,
    placement: Placement | None = None,
) -> tuple[Cells, MeshAttributes | None]:
    """The mesh in a file's content, or the point cloud where there are no faces.

    With `keep`, also the attributes, if there are any. `placement` moves a model of 3D Tiles.
    """
    if ending in _GLTF_ENDINGS:
        return _parse_gltf(data, folder, keep=keep, placement=placement)
    if holds_cloud(data, ending):
        cloud, attributes = CLOUD_READERS[ending](data)
        return cloud, attributes if keep else None
    if keep and ending in _ATTRIBUTE_READERS:
        arrays, attributes = _ATTRIBUTE_READERS[ending](data, folder)
        return _mesh_of(arrays), attributes
    return parse_mesh(data, ending, folder), None


def _parse_gltf(
    data: Content, folder: Path | None, *, keep: bool, placement: Placement | None
) -> tuple[AnyMesh, MeshAttributes | None]:
    model = open_model(data, placement)
    if not keep:
        return _mesh_of(read_gltf(model.gltf, folder, model.matrix)), None
    arrays, attributes = read_gltf_with_attributes(model.gltf, folder, model.matrix)
    if model.comments:
        attributes = replace(attributes, comments=model.comments)
    return _mesh_of(arrays), attributes


def _mesh_of(arrays: Arrays) -> AnyMesh:
    vertices, faces = arrays
    if isinstance(faces, Polygons):
        return PolygonMesh._of_new(vertices, *faces)
    return Mesh._of_new(vertices, faces)


def recognized_ending(data: Content) -> str | None:
    """Guess the ending of a file from its content; None if the format is unknown."""
    for begin, ending in _BEGINS.items():
        if data[: len(begin)] == begin:
            return ending
    if is_vtp(data):
        return ".vtp"
    if b"<GIFTI" in data[:1000]:
        return ".gii"
    if has_binary_size(data):
        return ".stl"
    found = _FIRST_WORD.match(data)
    return None if found is None else _ending_of_text(found[1])


def _ending_of_text(word: bytes) -> str | None:
    if word.startswith(b"{"):
        return ".gltf"
    if word.lower() == b"solid":
        return ".stl"
    if OFF_MAGIC.match(word):
        return ".off"
    if word in _OBJ_WORDS:
        return ".obj"
    return ".tri" if word.isdigit() else None
