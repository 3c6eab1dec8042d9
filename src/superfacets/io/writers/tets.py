"""VTU and VTK of tetrahedra with labels, written by meshio."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import IO

import numpy as np
import numpy.typing as npt

from ...mesh.tet_mesh import TetMesh
from ..foreign import file_to_fill, run_meshio

__all__ = ["TET_WRITERS"]


def _write_tets(
    file: IO[bytes],
    mesh: TetMesh,
    labels: npt.NDArray[np.int32] | None,
    colors: None,
    *,
    ascii: bool,
    attributes: None,
    label_name: str,
    ending: str,
) -> None:
    """Write checked arrays; labels are cell data."""
    cell_data = {} if labels is None else {label_name: [labels]}
    with file_to_fill(ending) as path:
        _, fault = run_meshio(
            lambda meshio: meshio.Mesh(
                mesh.vertices, [("tetra", mesh.tets)], cell_data=cell_data
            ).write(path, binary=not ascii)
        )
        if fault is not None:
            raise OSError(f"meshio cannot write {ending}: {fault}")
        file.write(path.read_bytes())


TET_WRITERS: Mapping[str, Callable[..., None]] = {
    ending: partial(_write_tets, ending=ending) for ending in (".vtu", ".vtk")
}
"""As the writers of meshes of faces, but for a `TetMesh`; no colors and attributes are given."""
