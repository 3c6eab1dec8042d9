"""OFF with a color for each face."""

from __future__ import annotations

from typing import IO

import numpy as np

from .._types import Bytes, Ints
from ..io.attributes import MeshAttributes
from ..mesh.faces import FaceMesh
from .obj import face_lines
from .text import coordinate_format, write_rows


def write_off(
    file: IO[bytes],
    mesh: FaceMesh,
    labels: Ints | None,
    colors: Bytes | None,
    *,
    ascii: bool,
    attributes: MeshAttributes | None = None,
) -> None:
    """Write checked arrays: behind the corners of each face stand red, green and blue, 0 to 255.

    The word OFF begins the file: COFF would announce colors of vertices. Labels themselves, and
    attributes, are left out.
    """
    file.write(b"OFF\n%d %d 0\n" % (mesh.n_vertices, mesh.n_faces))
    row = " ".join([coordinate_format(mesh.vertices)] * 3) + "\n"
    write_rows(file, row, list(mesh.vertices.T))
    ends = () if colors is None else tuple(colors.T)
    for lines in face_lines(mesh, np.arange(mesh.n_faces), "# ", ends=ends):
        file.write(b"".join(lines))
