"""Write STL, as text with one solid per region or class, or as binary data without labels."""

from __future__ import annotations

from typing import IO

import numpy as np

from ...base.checks import checked_threads
from ...mesh.faces import area_vectors
from ..readers.stl import HEADER_SIZE, TRIANGLE
from .content import Output
from .text import coordinate_format, fits_single, write_rows


def write_stl(file: IO[bytes], content: Output) -> None:
    """Write text with one solid per region, class or part, or binary data if there are none.

    Binary data needs coordinates that float32 can represent. Undefined normals are 0.
    """
    mesh = content.cells
    normals = area_vectors(mesh, checked_threads(None))
    lengths = np.sqrt((normals * normals).sum(axis=1, keepdims=True))
    normals /= np.where(lengths > 0, lengths, 1.0)
    parts = content.parts()
    if parts is None and not content.ascii and fits_single(mesh.vertices):
        triangles = np.zeros(mesh.n_faces, TRIANGLE)
        triangles["normal"], triangles["corners"] = normals, mesh.vertices[mesh.faces]
        file.write(bytes(HEADER_SIZE) + mesh.n_faces.to_bytes(4, "little") + triangles.tobytes())
        return
    solids, listed = parts or (np.zeros(mesh.n_faces, np.intp), ["mesh"])
    names = np.array(listed)
    number = coordinate_format(mesh.vertices)
    corner = " ".join(["      vertex", *[number] * 3]) + "\n"
    facet = f"  facet normal %.9g %.9g %.9g\n    outer loop\n{3 * corner}    endloop\n  endfacet\n"
    for name in dict.fromkeys(names[np.unique(solids)].tolist()):
        faces = np.flatnonzero((names == name)[solids])
        columns = [*normals[faces].T, *mesh.vertices[mesh.faces[faces]].reshape(-1, 9).T]
        file.write(b"solid %s\n" % name.encode("utf-8"))
        write_rows(file, facet, columns)
        file.write(b"endsolid %s\n" % name.encode("utf-8"))
