"""What the front end draws: positions, triangles, and the area of each cell."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..cells.kinds import kind_of
from ..pictures.page.shape import Shape, shape_of
from ..pictures.upright import guess_up
from .coding import packet
from .document import Document

__all__ = ["mesh_packet"]

ENOUGH = 100_000
"""Triangles by which the axis that points up is guessed: of a million it would take seconds."""


def mesh_packet(document: Document) -> bytes:
    """The shape of a mesh as one block, see `packet`.

    Positions are float32 around the center of the bounding box. Vertices are in the order in which
    triangles use them, no two at one place. Triangles of polygons, and of the outside of
    tetrahedra, have ``triangle_cells``; points have ``normals``.
    """
    shape = shape_of(document.cells)
    center = document.cells.bounds.mean(axis=0)
    arrays: dict[str, Any] = {"positions": (shape.points - center).astype(np.float32)}
    if shape.triangles is not None:
        arrays["triangles"] = shape.triangles.astype(np.uint32)
    if shape.sources is not None:
        arrays["triangle_cells"] = shape.sources.astype(np.uint32)
    if shape.normals is not None:
        arrays["normals"] = shape.normals.astype(np.float32)
    arrays["areas"] = document.areas.astype(np.float32)
    return packet(_header(document, shape, center.tolist()), arrays)


def _header(document: Document, shape: Shape, center: list[float]) -> dict[str, Any]:
    return {
        "kind": document.source.kind,
        "n_cells": document.n_cells,
        "n_vertices": len(shape.points),
        "n_triangles": 0 if shape.triangles is None else len(shape.triangles),
        "center": center,
        "scale": shape.diagonal,
        "up": _guessed_up(shape),
        "point_size": shape.point_size * shape.diagonal,
        "measure": "volume" if kind_of(document.cells).dimension == 3 else "area",
    }


def _guessed_up(shape: Shape) -> str:
    scene = shape.scene
    step = len(scene.triangles) // ENOUGH + 1
    return guess_up(replace(scene, triangles=scene.triangles[::step]))
