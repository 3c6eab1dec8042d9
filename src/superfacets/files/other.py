"""Recognize content that is not what the ending of its file says, and decompress or recode it."""

from __future__ import annotations

import re
import zlib

from ..base.errors import MeshError
from .guards import Content, most_bytes_of

_CAD = (
    "{} is a CAD format, not a mesh: export STL from your CAD program, or run"
    " gmsh part.step -2 -o part.stl"
)
_RASTER = (
    "a raster file is not a mesh: convert its heights to a mesh (see Terrain in the documentation)"
)
_VECTOR = "a vector file is not a mesh: convert its triangles or points to .ply, .obj or .csv"
_CAD_FORMATS = {".step": "STEP", ".stp": "STEP", ".iges": "IGES", ".igs": "IGES", ".brep": "BREP",
                ".fcstd": "FCStd"}  # fmt: skip

ENDINGS = {
    **{ending: _CAD.format(name) for ending, name in _CAD_FORMATS.items()},
    **dict.fromkeys((".tif", ".tiff", ".asc"), _RASTER), ".shp": _VECTOR, ".gpkg": _VECTOR,
}  # fmt: skip
"""Error messages for files that are neither meshes nor clouds, keyed by ending."""

_BEGINS = {
    rb"version https://git-lfs": "the file is a pointer of Git LFS: run git lfs pull to get it",
    rb"\s*<(?:!doctype html|html)": "the file is a web page, not a mesh: download the file itself",
    rb"PK\x03\x04": "the file is a ZIP archive: unpack it first",
    rb"(?:7z\xbc\xaf|Rar!|BZh|\xfd7zXZ)": "the file is a compressed archive: unpack it first",
    rb"(?:II\*\0|MM\0\*)": _RASTER,
    rb"(?:\x89PNG|\xff\xd8\xff|GIF8)": "the file is a picture, not a mesh",
    rb"ISO-10303-21": _CAD.format("STEP"),
    rb"%PDF": "the file is a PDF document, not a mesh",
}
"""Error messages for other content, keyed by a pattern that matches its begin."""

_GZIP, _UTF_16 = b"\x1f\x8b", {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def as_declared(data: Content) -> Content:
    """Return the content, unpacked and in UTF-8, or raise a MeshError if it is no mesh."""
    if data[:2] == _GZIP:
        data = _unpacked(data)
    if data[:2] in _UTF_16:
        try:
            data = data[2:].decode(_UTF_16[data[:2]]).encode()
        except UnicodeDecodeError:
            raise MeshError("the file is neither text in UTF-16 nor a mesh") from None
    begin = data[:200]
    for pattern, message in _BEGINS.items():
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
