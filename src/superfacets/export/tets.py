"""VTU and VTK files of tetrahedra with labels."""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping
from functools import partial
from typing import IO, Any
from urllib.parse import quote

import numpy as np
import numpy.typing as npt

from ..mesh.tet_mesh import TetMesh
from .text import write_rows
from .vtk_xml import Arrays, number_format, write_vtk_xml

_TETRA = 10
"""VTK's cell type of tetrahedra."""


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
    if ending == ".vtk":
        _write_legacy(file, mesh, labels, label_name, ascii=ascii)
        return
    cells: Arrays = {
        "connectivity": mesh.tets.astype(np.int64).ravel(),
        "offsets": np.arange(4, 4 * mesh.n_tets + 1, 4, dtype=np.int64),
        "types": np.full(mesh.n_tets, _TETRA, np.uint8),
    }
    sections: dict[str, Arrays] = {
        "CellData": {} if labels is None else {label_name: labels},
        "Points": {"Points": mesh.vertices},
        "Cells": cells,
    }
    counts = {"NumberOfPoints": mesh.n_vertices, "NumberOfCells": mesh.n_tets}
    write_vtk_xml(file, "UnstructuredGrid", counts, sections, ascii=ascii)


def _write_legacy(
    file: IO[bytes],
    mesh: TetMesh,
    labels: npt.NDArray[np.int32] | None,
    label_name: str,
    *,
    ascii: bool,
) -> None:
    n = mesh.n_tets
    cells = np.column_stack([np.full(n, 4, np.int32), mesh.tets])
    parts: list[tuple[str, npt.NDArray[Any]]] = [
        (f"POINTS {mesh.n_vertices} double", mesh.vertices),
        (f"CELLS {n} {5 * n}", cells),
        (f"CELL_TYPES {n}", np.full((n, 1), _TETRA, np.int32)),
    ]
    if labels is not None:
        name = quote(label_name, safe=string.punctuation.replace("%", "").replace('"', ""))
        head = f"CELL_DATA {n}\nFIELD FieldData 1\n{name} 1 {n} int"
        parts.append((head, labels.reshape(n, 1)))
    form = "ASCII" if ascii else "BINARY"
    file.write(
        f"# vtk DataFile Version 3.0\nsuperfacets\n{form}\nDATASET UNSTRUCTURED_GRID\n".encode()
    )
    for head, values in parts:
        file.write(f"{head}\n".encode())
        if ascii:
            row = " ".join([number_format(values)] * values.shape[1]) + "\n"
            write_rows(file, row, list(values.T))
        else:
            file.write(values.astype(values.dtype.newbyteorder(">")).tobytes() + b"\n")


TET_WRITERS: Mapping[str, Callable[..., None]] = {
    ending: partial(_write_tets, ending=ending) for ending in (".vtu", ".vtk")
}
"""Signature of the writers of a `TetMesh`: no colors, no attributes."""
