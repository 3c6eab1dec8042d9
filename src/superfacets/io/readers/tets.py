"""VTU, VTK, MSH and MESH: tetrahedra, read by meshio."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...errors import MeshError
from ..foreign import file_of, run_meshio
from ..guards import Content, TriangleArrays, as_doubles, counted

__all__ = ["TET_ENDINGS", "has_tet_labels", "read_tet_labels", "read_tets"]

TET_ENDINGS = (".mesh", ".msh", ".vtk", ".vtu")

_TETS = ("tetra", "tetra10")
"""meshio's names; of one with nodes on its edges the first four are its corners."""

_SKIPPED = ("vertex", "line", "line3", "triangle", "triangle6", "quad", "quad8", "quad9", "polygon")
"""What lies on the border of a volume, or in it, and is none."""


def read_tets(data: Content, ending: str) -> TriangleArrays:
    """Vertices (V, 3) and tetrahedra (N, 4) in the order of the file; other cells are skipped.

    Cells of a volume that are no tetrahedra are refused.
    """
    mesh = _read(data, ending)
    kinds = [block.type for block in mesh.cells]
    others = sorted({kind for kind in kinds if kind not in _TETS + _SKIPPED})
    if others:
        raise MeshError(f"the file holds cells that are no tetrahedra: {', '.join(others)}")
    blocks = [np.asarray(block.data)[:, :4] for block in mesh.cells if block.type in _TETS]
    if not sum(map(len, blocks)):
        found = f": it has {', '.join(sorted(set(kinds)))}" if kinds else ""
        raise MeshError(f"the file has no tetrahedra{found}")
    return as_doubles(np.asarray(mesh.points)), np.concatenate(blocks)


def read_tet_labels(data: Content, ending: str, name: str = "label") -> npt.NDArray[Any]:
    """The cell data `label` of tetrahedra, or what has that name."""
    mesh = _read(data, ending)
    stored = mesh.cell_data.get(name)
    if stored is None:
        raise MeshError(f"the file has no cell data {name}")
    parts = [part for block, part in zip(mesh.cells, stored, strict=True) if block.type in _TETS]
    labels = np.concatenate(parts) if parts else np.empty(0, dtype=np.int32)
    if labels.dtype.kind == "f" and np.array_equal(labels, np.floor(labels)):
        labels = labels.astype(np.int64)  # as some formats store them
    if labels.dtype.kind not in "iu":
        raise MeshError("labels must be integers: the file holds something else")
    return labels


def has_tet_labels(data: Content, ending: str, name: str = "label") -> bool:
    """Whether a file of tetrahedra has cell data of that name."""
    return name in _read(data, ending).cell_data


def _read(data: Content, ending: str) -> Any:
    with file_of(data, ending) as path:
        mesh, fault = run_meshio(lambda meshio: meshio.read(path))
    if fault is not None:
        raise MeshError(f"meshio cannot read the file as {ending}: {fault}")
    _check(mesh)
    return mesh


def _check(mesh: Any) -> None:
    """Raise a MeshError where the blocks that meshio made are not as it says they are."""
    points = np.asarray(mesh.points)
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise MeshError(f"expected vertices with x, y and z, got {counted(points.ndim, 'axis')}")
    for block in mesh.cells:
        if block.type in _TETS and np.asarray(block.data).dtype.kind not in "iu":
            raise MeshError("the corners of tetrahedra must be integers")
