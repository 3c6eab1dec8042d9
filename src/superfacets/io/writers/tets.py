"""VTU and VTK of tetrahedra with labels, written by meshio."""

from __future__ import annotations

from typing import IO

import numpy as np
import numpy.typing as npt

from ...mesh.tet_mesh import TetMesh
from ..foreign import file_to_fill, run_meshio

__all__ = ["TET_OUTPUTS", "write_tets"]

TET_OUTPUTS = (".vtu", ".vtk")


def write_tets(
    file: IO[bytes],
    mesh: TetMesh,
    labels: npt.NDArray[np.int32] | None,
    ending: str,
    *,
    ascii: bool,
    label_name: str = "label",
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
