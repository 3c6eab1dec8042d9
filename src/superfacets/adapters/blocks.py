"""Meshes of meshio, which consist of blocks of cells of one type."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._types import Array
from .._validate import polygon_arrays
from ..errors import MeshError
from ..mesh.faces import FaceMesh
from ..mesh.polygon_mesh import PolygonMesh
from ..mesh.tet_mesh import TetMesh
from ..mesh.triangle_mesh import Mesh

_TETS = ("tetra", "tetra10")
"""meshio's names of tetrahedra. The first four nodes are corners; other nodes are on edges."""

_FACES = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4, "polygon": None}
"""Number of corners by type of face; None if faces differ. Corners precede nodes on edges."""

_SKIPPED = ("vertex", "line", "line3")


def has_blocks(source: Any) -> bool:
    """Whether an object is a mesh of meshio, with or without cells."""
    blocks = getattr(source, "cells", None)
    if not isinstance(blocks, list) or not hasattr(source, "points"):
        return False
    return all(hasattr(block, "type") and hasattr(block, "data") for block in blocks)


def cell_blocks(source: Any) -> list[int]:
    """Return the indices of the blocks to segment: blocks of tetrahedra, else blocks of faces.

    Labels belong to the cells of these blocks, one block after the other. If the list is empty, the
    points are a cloud. Raises a MeshError if a block has other volume cells, or cells of an unknown
    type.
    """
    filled = [i for i, block in enumerate(source.cells) if len(block.data)]
    kinds = {i: source.cells[i].type for i in filled}
    known = (*_TETS, *_FACES, *_SKIPPED)
    others = sorted({kind for kind in kinds.values() if kind not in known})
    if others:
        raise MeshError(f"the mesh has cells other than faces and tetrahedra: {', '.join(others)}")
    tets = [i for i in filled if kinds[i] in _TETS]
    return tets or [i for i in filled if kinds[i] in _FACES]


def mesh_of_blocks(source: Any) -> FaceMesh | TetMesh:
    """Return the tetrahedra or faces of a mesh of meshio, in the order of its blocks."""
    blocks = [source.cells[i] for i in cell_blocks(source)]
    if blocks[0].type in _TETS:
        tets = np.concatenate([np.asarray(block.data)[:, :4] for block in blocks])
        return TetMesh(source.points, tets)
    parts = [_faces_of(block) for block in blocks]
    corners = np.concatenate([part[1] for part in parts])
    if all(_FACES[block.type] == 3 for block in blocks):
        return Mesh(source.points, corners.reshape(-1, 3))
    sizes = np.concatenate([np.diff(offsets) for offsets, _ in parts])
    return PolygonMesh(source.points, np.concatenate([[0], np.cumsum(sizes)]), corners)


def _faces_of(block: Any) -> tuple[Array, Array]:
    """Offsets and corners of the faces of a block, without the nodes on their edges."""
    n_corners = _FACES[block.type]
    if n_corners is None:
        return polygon_arrays(block.data)
    return polygon_arrays(np.asarray(block.data)[:, :n_corners])
