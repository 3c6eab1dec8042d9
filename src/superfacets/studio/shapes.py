"""What the front end draws: positions, triangles, and the area of each cell."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..cells.kinds import kind_of
from ..pictures.camera import View
from ..pictures.colors import PALETTE
from ..pictures.page.shape import shape_of, view_facts
from .coding import packet
from .document import Document


def mesh_packet(document: Document) -> bytes:
    """The shape of a mesh as one block, see `packet`.

    Positions are float32 around the center of the bounding box. Vertices are in the order in which
    triangles use them, no two at one place. Triangles of polygons, and of the outside of
    tetrahedra, have ``sources``: the cell of each. Points have packed ``normals``.
    """
    shape = shape_of(document.cells)
    center = document.cells.bounds.mean(axis=0)
    header = {
        "kind": document.source.kind,
        "n_cells": document.n_cells,
        "center": center.tolist(),
        "measure": "volume" if kind_of(document.cells).dimension == 3 else "area",
        **view_facts(shape, View()),
        "low": [0, 0, 0],
        "step": [1, 1, 1],
        "point_size": shape.point_size * shape.diagonal,
        "palette": PALETTE.tolist(),
    }
    parts = shape.parts((shape.points - center).astype(np.float32))
    arrays: dict[str, Any] = {name: array for name, (array, _) in parts.items()}
    return packet(header, {**arrays, "areas": document.areas.astype(np.float32)})
