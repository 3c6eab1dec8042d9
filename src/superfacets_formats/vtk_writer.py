"""Write VTP, VTU and legacy VTK, with labels as cell data."""

from __future__ import annotations

import binascii
import html
import string
import sys
import zlib
from collections.abc import Mapping
from typing import IO
from urllib.parse import quote

import numpy as np

from superfacets.kit import Array, Output, corners_of, number_format, write_rows

from .foreign import as_small

Arrays = Mapping[str, Array]
"""Arrays of shape (N,) or (N, n), by name."""

_BLOCK = 1 << 20
"""Number of bytes per block before compression; the last block may be shorter."""


def write_vtk_xml(
    file: IO[bytes], kind: str, counts: Mapping[str, int], sections: Mapping[str, Arrays], *,
    ascii: bool,
) -> None:  # fmt: skip
    """Write a VTK XML file with a single ``Piece`` element. Names of arrays are escaped."""
    order = f"{sys.byteorder.capitalize()}Endian"
    numbers = " ".join(f'{name}="{count}"' for name, count in counts.items())
    file.write(
        f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="{order}"'
        f' header_type="UInt64" compressor="vtkZLibDataCompressor">\n'
        f"<{kind}>\n<Piece {numbers}>\n".encode()
    )
    for section, arrays in sections.items():
        file.write(f"<{section}>\n".encode())
        for name, values in arrays.items():
            _write_array(file, name, values, ascii=ascii)
        file.write(f"</{section}>\n".encode())
    file.write(f"</Piece>\n</{kind}>\n</VTKFile>\n".encode())


def _write_array(file: IO[bytes], name: str, values: Array, *, ascii: bool) -> None:
    word = {"i": "Int", "u": "UInt", "f": "Float"}[values.dtype.kind]
    table = values if values.ndim > 1 else values[:, np.newaxis]
    form = "ascii" if ascii else "binary"
    # If NumberOfComponents is missing, meshio reads an (N,) array; if it is 1, an (N, 1) array.
    width = f' NumberOfComponents="{table.shape[1]}"' if values.ndim > 1 else ""
    file.write(
        f'<DataArray type="{word}{8 * values.dtype.itemsize}" Name="{html.escape(name)}"{width}'
        f' format="{form}">\n'.encode()
    )
    if ascii:
        write_rows(file, " ".join([number_format(values)] * table.shape[1]) + "\n", list(table.T))
    else:
        content = np.ascontiguousarray(table, table.dtype.newbyteorder("=")).tobytes()
        blocks = [zlib.compress(content[i : i + _BLOCK]) for i in range(0, len(content), _BLOCK)]
        sizes = [len(blocks), _BLOCK, len(content) % _BLOCK, *map(len, blocks)]
        for part in (np.array(sizes, np.uint64).tobytes(), b"".join(blocks)):
            file.write(binascii.b2a_base64(part, newline=False))
        file.write(b"\n")
    file.write(b"</DataArray>\n")


def write_vtp(file: IO[bytes], content: Output) -> None:
    """Write VTP, with labels and ``colors`` as cell data."""
    corners = corners_of(content.cells)
    polygons = {"connectivity": corners.vertices.astype(np.int64), "offsets": corners.starts[1:]}
    _write_cells(file, content, ("PolyData", "Polys"), polygons, content.colors)


_TETRA = 10
"""VTK's code for tetrahedra."""


def write_vtu(file: IO[bytes], content: Output) -> None:
    """Write tetrahedra as VTU, with labels and properties as data."""
    mesh = content.cells
    cells: Arrays = {
        "connectivity": mesh.tets.astype(np.int64).ravel(),
        "offsets": np.arange(4, 4 * mesh.n_tets + 1, 4, dtype=np.int64),
        "types": np.full(mesh.n_tets, _TETRA, np.uint8),
    }
    _write_cells(file, content, ("UnstructuredGrid", "Cells"), cells)


def _write_cells(
    file: IO[bytes], content: Output, kinds: tuple[str, str], cells: Arrays,
    colors: Array | None = None,
) -> None:  # fmt: skip
    """Write VTK XML with data; `kinds` are the type of the file, and the section of the cells."""
    mesh, (kind, section) = content.cells, kinds
    sections: dict[str, Arrays] = {
        "PointData": content.properties("vertex"), "CellData": _with_labels(content, colors),
        "Points": {"Points": mesh.vertices}, section: cells,
    }  # fmt: skip
    counts = {"NumberOfPoints": len(mesh.vertices), f"NumberOf{section}": mesh.n_cells}
    write_vtk_xml(file, kind, counts, sections, ascii=content.ascii)


def _with_labels(content: Output, colors: Array | None = None) -> dict[str, Array]:
    """Return the properties of the cells, the labels, and colors."""
    own = {content.label_name: content.labels, "colors": colors}
    written = {name: values for name, values in own.items() if values is not None}
    return {**content.properties("face", written), **written}


_WORDS = {
    "i1": "char", "u1": "unsigned_char", "i2": "short", "u2": "unsigned_short", "i4": "int",
    "u4": "unsigned_int", "f4": "float", "f8": "double", "i8": "vtktypeint64",
    "u8": "vtktypeuint64",
}  # fmt: skip
"""Names of types in legacy VTK, keyed by NumPy's type code."""


def write_vtk(file: IO[bytes], content: Output) -> None:
    """Write tetrahedra as legacy VTK, with labels and properties as fields of data."""
    mesh, ascii = content.cells, content.ascii
    n = mesh.n_tets
    cells = np.column_stack([np.full(n, 4, np.int32), mesh.tets])
    parts: list[tuple[str, Array]] = [
        (f"POINTS {mesh.n_vertices} double", mesh.vertices),
        (f"CELLS {n} {5 * n}", cells),
        (f"CELL_TYPES {n}", np.full((n, 1), _TETRA, np.int32)),
    ]
    for head, arrays in (
        (f"CELL_DATA {n}", _with_labels(content)),
        (f"POINT_DATA {mesh.n_vertices}", content.properties("vertex")),
    ):
        for place, (name, values) in enumerate(arrays.items()):
            begin = "" if place else f"{head}\nFIELD FieldData {len(arrays)}\n"
            # Most programs do not know the types of 64 bits.
            table = as_small(values.reshape(len(values), -1))
            word = quote(name, safe=string.punctuation.replace("%", "").replace('"', ""))
            size = f"{table.shape[1]} {len(table)}"
            parts.append((f"{begin}{word} {size} {_WORDS[table.dtype.str[1:]]}", table))
    form = f"{'ASCII' if ascii else 'BINARY'}\nDATASET UNSTRUCTURED_GRID\n"
    file.write(f"# vtk DataFile Version 3.0\nsuperfacets\n{form}".encode())
    for head, values in parts:
        file.write(f"{head}\n".encode())
        if ascii:
            row = " ".join([number_format(values)] * values.shape[1]) + "\n"
            write_rows(file, row, list(values.T))
        else:
            file.write(values.astype(values.dtype.newbyteorder(">")).tobytes() + b"\n")
