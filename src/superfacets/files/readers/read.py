"""Read meshes and point clouds from files of all supported formats."""

from __future__ import annotations

import os
import re
import zlib
from dataclasses import replace
from pathlib import Path
from typing import cast

from ...base.errors import MeshError
from ...graph.kinds import kind_of
from ...mesh.attributes import MeshAttributes
from ...mesh.faces import AnyMesh
from ...mesh.point_cloud import PointCloud
from ..formats import FORMATS
from ..guards import Content, known_ending, most_bytes_of, named_errors, read_content
from ..input import Input, Read
from .off import MAGIC as OFF_MAGIC

_BEGINS = {
    ".ply": rb"ply[ \t]*[\n\r]", ".glb": rb"glTF", ".gltf": rb"\{", ".stl": rb"(?i:solid)(?!\S)",
    ".off": OFF_MAGIC.pattern, ".obj": rb"(?:v|vn|vt|vp|f|l|p|o|g|s|mtllib|usemtl)(?!\S)",
}  # fmt: skip
"""Patterns of the first word of files, after white space and comments, keyed by ending."""

_SKIPPED = rb"(?:\s*+#[^\n]*+\n)*+\s*+"

_CAD = "{} is a CAD format: gmsh part.step -2 -o part.msh keeps its faces as gmsh:geometrical"
_RASTER = "a raster file is not a mesh: convert its heights to one (see Terrain in the user guide)"
_VECTOR = "a vector file is not a mesh: convert its triangles or points to .ply, .obj or .csv"
_VOXELS = "voxels are not a mesh: run marching cubes first (see Label volumes in the user guide)"
_CAD_FORMATS = {".step": "STEP", ".stp": "STEP", ".iges": "IGES", ".igs": "IGES", ".brep": "BREP",
                ".fcstd": "FCStd"}  # fmt: skip

_OTHER_ENDINGS = {
    **{ending: _CAD.format(name) for ending, name in _CAD_FORMATS.items()},
    **dict.fromkeys((".tif", ".tiff", ".asc"), _RASTER), ".shp": _VECTOR, ".gpkg": _VECTOR,
    ".geojson": _VECTOR, ".city.json": "CityJSON: run cjio IN export obj OUT.obj first",
    **dict.fromkeys((".nii", ".mgz", ".nrrd", ".dcm"), _VOXELS),
    **dict.fromkeys(FORMATS.vertex_values, "it has values for --features: give their mesh first"),
    **dict.fromkeys((".bdf", ".nas", ".inp", ".exo", ".med", ".cgns", ".xdmf", ".su2", ".ugrid"),
                    "convert the file first: meshio convert IN OUT.msh"),
}  # fmt: skip
"""Error messages for files that are neither meshes nor clouds, keyed by ending."""

_OTHER_BEGINS = {
    rb"version https://git-lfs": "the file is a pointer of Git LFS: run git lfs pull to get it",
    rb"\s*<(?:!doctype html|html)": "the file is a web page, not a mesh: download the file itself",
    rb"PK\x03\x04": "the file is a ZIP archive: unpack it first",
    rb"(?:7z\xbc\xaf|Rar!|BZh|\xfd7zXZ)": "the file is a compressed archive: unpack it first",
    rb"(?:II\*\0|MM\0\*)": _RASTER,
    rb"(?:\x89PNG|\xff\xd8\xff|GIF8)": "the file is a picture, not a mesh",
    rb"ISO-10303-21": _CAD.format("STEP"), rb"%PDF": "the file is a PDF document, not a mesh",
}  # fmt: skip
"""Error messages for other content, keyed by a pattern of its first bytes."""

_GZIP, _UTF_16 = b"\x1f\x8b", {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def read_mesh(path: str | os.PathLike[str]) -> AnyMesh:
    r"""Read the mesh in a file: its vertices and faces, in the order of the file.

    Nothing is merged, split, dropped, repaired or triangulated. Vertices are returned as stored:
    an STL file has three vertices per face, and a glTF file repeats vertices along texture seams.

    Parameters
    ----------
    path : path-like
        Mesh file. The ending, in upper or lower case, selects the format:

        - surfaces: ``.ply``, ``.stl``, ``.obj``, ``.off``, ``.vtp``, ``.glb`` and ``.gltf``
          (2.0), and surfaces of a brain cortex: ``.gii`` (GIFTI) and FreeSurfer's ``.white``,
          ``.pial``, ``.inflated``, ``.smoothwm``, ``.orig`` and ``.sphere``;
        - tetrahedra, or else faces: ``.vtu``, ``.vtk`` (legacy; needs the extra ``viz``), ``.msh``
          (Gmsh) and ``.mesh`` (Medit; both need the extra ``mesh``).

        ``.gz`` may follow the ending. Groups, objects and all meshes of the default scene of a glTF
        file form one mesh, with a copy per node or instance, posed by skins and morph weights.
        Strips and fans become triangles. A glTF file may refer to files in or below its folder.

    Returns
    -------
    Mesh, PolygonMesh or TetMesh
        A `Mesh` if all faces are triangles, otherwise a `PolygonMesh`; a `TetMesh` if there are
        tetrahedra. Vertices are float64, and decimal numbers are rounded to the nearest double.

    Raises
    ------
    MeshError
        If the file is empty, truncated or damaged, or does not match its ending; if there is no
        face, or a face with fewer than three corners; if an index or a coordinate is invalid; or if
        the ending is unknown. The message is one line that begins with the path.
    MissingExtraError
        If the format needs a package that is not installed.
    OSError
        If the file does not exist or cannot be read.

    Notes
    -----
    Arrays may have at most 100 times the size of the file, or 64 MB if this is larger. VTK and
    meshio run in a process with limits of time and memory. A text file truncated within its last
    number, and an OBJ or STL file truncated between faces, are read.

    Examples
    --------
    >>> from pathlib import Path
    >>> text = "OFF 4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"
    >>> _ = Path("square.off").write_text(text)
    >>> read_mesh("square.off")
    Mesh(4 vertices, 2 faces)
    """
    cells, _ = _read(path, FORMATS.meshes, keep=False)
    if kind_of(cells).are_points:
        raise MeshError(f"{path}: the file contains points, but no faces: use read_cloud")
    return cast("AnyMesh", cells)


def read_cloud(path: str | os.PathLike[str]) -> PointCloud:
    r"""Read the points in a file, and their normals and colors, if the file has them.

    Parameters
    ----------
    path : path-like
        Point cloud file, or a mesh file without faces. The ending (of any case) selects the format:

        - ``.ply``, ``.obj``, ``.vtp``, ``.glb`` and other formats of `read_mesh`;
        - ``.xyz``, ``.csv`` and ``.txt``: one line of numbers per point, separated by spaces,
          commas or semicolons, after an optional line of names as in PLY. Without names, the three
          columns after x, y and z are colors if all numbers are integers from 0 to 255, or normals
          if all vectors have length 1;
        - ``.npy``: 3 to 12 columns, as in text without names;
        - ``.las`` and ``.laz`` (extra ``las``), ``.pcd`` of any encoding (extra ``pcd``);
        - ``.e57``, with the extra ``e57``: the points of all scans, each transformed by its pose.

    Returns
    -------
    PointCloud
        The points; for a mesh, its vertices. Records without a position are skipped; labels of the
        cloud are in the order of the remaining points (``MeshAttributes.records``).

    Raises
    ------
    MeshError, MissingExtraError, OSError
        For the same reasons as in `read_mesh`.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("two.csv").write_text("x,y,z,red,green,blue\n0,0,0,255,0,0\n1,0,0,0,255,0\n")
    >>> read_cloud("two.csv")
    PointCloud(2 points, colors)
    """
    cells, _ = _read(path, FORMATS.cells, keep=False)
    if not kind_of(cells).are_points:
        return PointCloud(cast("AnyMesh", cells).vertices)
    return cast("PointCloud", cells)


def read_attributes(path: str | os.PathLike[str]) -> MeshAttributes:
    """Read all that a file has besides positions and corners: properties, names, the texture.

    ``write_mesh(..., attributes=...)`` writes them to a file again.

    Parameters
    ----------
    path : path-like
        Any file that `read_mesh` or `read_cloud` reads. Files of materials and images must be in
        its folder or in subfolders. Images are read later, on demand.

    Returns
    -------
    MeshAttributes
        Arrays in the order of the file, with the types that the file declares. `declared` lists
        everything in the file, and how it is used; `left_out` lists items that are not read.

    Raises
    ------
    MeshError, MissingExtraError, OSError
        For the same reasons as in `read_mesh`.

    Examples
    --------
    >>> from superfacets import write_mesh
    >>> triangle = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> attributes = MeshAttributes(vertex={"nz": [1.0, 1.0, 1.0]})
    >>> write_mesh("triangle.ply", triangle, attributes=attributes)
    >>> read_attributes("triangle.ply").vertex["nz"]
    array([1., 1., 1.])
    """
    _, attributes = _read(path, FORMATS.cells, keep=True)
    assert attributes is not None
    return attributes


def _read(path: str | os.PathLike[str], endings: tuple[str, ...], *, keep: bool) -> Read:
    """Read a file with one of these endings; error messages begin with its path."""
    path = Path(path)
    ending, data = cell_ending(path, endings), read_content(path)
    with named_errors(path):
        return parse(Input(data, ending, path.parent, keep))


def cell_ending(path: Path, endings: tuple[str, ...] = FORMATS.cells) -> str:
    """Return the ending of a mesh or point cloud file, or raise a MeshError for other endings."""
    given, path = path, path.with_suffix("") if path.suffix.lower() == ".gz" else path  # .ply.gz
    try:
        return known_ending(path, endings)
    except MeshError as error:
        suffix = path.suffix.lower()
        is_labels = path.name.lower().endswith((*{*FORMATS.labels}.difference(FORMATS.cells),))
        advice = "a label file: give the mesh of these labels first" if is_labels else ""
        known = (text for each, text in _OTHER_ENDINGS.items() if path.name.lower().endswith(each))
        advice = next(known, advice)
        if path.is_dir():
            advice = "is a folder: use superfacets batch"
        if advice:
            raise MeshError(f"{given}: {advice}") from None
        advice = ": convert the file first" if suffix else ""
        if suffix in FORMATS["read_points"]:
            advice = ": the file contains points, use read_cloud"
        if own := [each for each in path.suffixes if each.lower() in FORMATS.meshes]:
            advice = f": if it is a {own[-1]} file, rename a copy, or use --format {own[-1][1:]}"
        raise MeshError(f"{given}{str(error).removeprefix(str(path))}{advice}") from None


def parse(source: Input) -> Read:
    """Parse the content of a mesh or point cloud file, in the format of its ending."""
    FORMATS.check_readers([source.ending])
    source = replace(source, data=as_declared(source.data))
    table = FORMATS["read" if source.ending in FORMATS["read"] else "read_points"]
    found: Read = table[source.ending](source)
    return found


def recognized_ending(data: Content) -> str | None:
    """Guess the ending of a file from its content; return None if the format is unknown."""
    known = FORMATS["recognize"]
    found = next((ending for ending in known if known[ending](data)), None)
    fitting = (ending for ending, begin in _BEGINS.items() if re.match(_SKIPPED + begin, data))
    return found or next(fitting, None)


def as_declared(data: Content) -> Content:
    """Return decompressed content in UTF-8; raise a MeshError for a file that is not a mesh."""
    if data[:2] == _GZIP:
        data = _unpacked(data)
    if data[:2] in _UTF_16:
        try:
            data = data[2:].decode(_UTF_16[data[:2]]).encode()
        except UnicodeDecodeError:
            raise MeshError("the file is neither text in UTF-16 nor a mesh") from None
    begin = data[:200]
    for pattern, message in _OTHER_BEGINS.items():
        if re.match(pattern, begin, re.IGNORECASE):
            raise MeshError(message)
    return data


def _unpacked(data: Content) -> bytes:
    limit = most_bytes_of(len(data))
    stream = zlib.decompressobj(wbits=31)
    try:
        content = stream.decompress(data[:], limit)
    except zlib.error:
        content = b""
    if not stream.eof:
        most = f"more than {limit >> 20} MB, or " if len(content) == limit else ""
        raise MeshError(f"the gzip file has {most}no valid end: it may be truncated or damaged")
    return content
