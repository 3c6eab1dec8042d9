"""Convert meshio meshes, which store the cells of each type in a separate block."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.checks import polygon_arrays
from ..base.errors import MeshError
from ..base.lazy import load
from ..base.types import Array
from .faces import FaceMesh
from .polygon_mesh import PolygonMesh
from .triangle_mesh import Mesh

if TYPE_CHECKING:
    from .. import TetMesh

_TETS = ("tetra", "tetra10")
"""Types of tetrahedra in meshio. The first four nodes of a tetrahedron are its corners; all other
nodes are on its edges."""

_FACES = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4, "polygon": None}
"""Number of corners for each type of face in meshio, or None if faces of this type may have any
number of corners. The corners are the first nodes of a face."""

_SKIPPED = ("vertex", "line", "line3")
"""Types of cells in meshio that are ignored."""


def has_blocks(source: Any) -> bool:
    """Return whether an object looks like a meshio mesh; its list of blocks may be empty."""
    blocks = getattr(source, "cells", None)
    if not isinstance(blocks, list) or not hasattr(source, "points"):
        return False
    return all(hasattr(block, "type") and hasattr(block, "data") for block in blocks)


def cell_blocks(source: Any) -> list[int]:
    """Return the indices of the blocks of a meshio mesh that contain the cells to segment.

    These are tetrahedra, or faces, or none for a point cloud. Raises a MeshError if a block has
    cells of any other type than vertices and lines, such as hexahedra.
    """
    filled = [i for i, block in enumerate(source.cells) if len(block.data)]
    kinds = {i: source.cells[i].type for i in filled}
    known = (*_TETS, *_FACES, *_SKIPPED)
    others = sorted({kind for kind in kinds.values() if kind not in known})
    if others:
        raise MeshError(f"cells must be faces or tetrahedra, got {', '.join(others)}")
    tets = [i for i in filled if kinds[i] in _TETS]
    return tets or [i for i in filled if kinds[i] in _FACES]


def tet_mesh(vertices: Any, tets: Any) -> TetMesh:
    """Return a mesh of tetrahedra."""
    mesh: TetMesh = load("superfacets_formats.tet_mesh:TetMesh")(vertices, tets)
    return mesh


def mesh_of_blocks(source: Any) -> FaceMesh | TetMesh:
    """Return the cells in the blocks that `cell_blocks` finds, in the order of the blocks."""
    blocks = [source.cells[i] for i in cell_blocks(source)]
    if blocks[0].type in _TETS:
        tets = np.concatenate([np.asarray(block.data)[:, :4] for block in blocks])
        return tet_mesh(source.points, tets)
    parts = [_faces_of(block) for block in blocks]
    corners = np.concatenate([part[1] for part in parts])
    if all(_FACES[block.type] == 3 for block in blocks):
        return Mesh(source.points, corners.reshape(-1, 3))
    sizes = np.concatenate([np.diff(offsets) for offsets, _ in parts])
    return PolygonMesh(source.points, np.concatenate([[0], np.cumsum(sizes)]), corners)


def _faces_of(block: Any) -> tuple[Array, Array]:
    """Return CSR offsets and corners of the faces of a block; other nodes are left out."""
    n_corners = _FACES[block.type]
    if n_corners is None:
        return polygon_arrays(block.data)
    return polygon_arrays(np.asarray(block.data)[:, :n_corners])
