"""Write VTK XML files of one piece; arrays are text, or compressed blocks in base64."""

from __future__ import annotations

import binascii
import html
import sys
import zlib
from collections.abc import Mapping
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from .text import write_rows

Arrays = Mapping[str, npt.NDArray[Any]]
"""Arrays (N,) or (N, n) by name."""

_BLOCK = 1 << 20
"""Bytes per compressed block; the last block may be shorter."""


def write_vtk_xml(
    file: IO[bytes],
    kind: str,
    counts: Mapping[str, int],
    sections: Mapping[str, Arrays],
    *,
    ascii: bool,
) -> None:
    """Write the sections of a piece with these counts; names of arrays are escaped."""
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


def _write_array(file: IO[bytes], name: str, values: npt.NDArray[Any], *, ascii: bool) -> None:
    word = {"i": "Int", "u": "UInt", "f": "Float"}[values.dtype.kind]
    table = values.reshape(len(values), -1)
    form = "ascii" if ascii else "binary"
    # Left out if 1: meshio would read an array (N, 1).
    width = f' NumberOfComponents="{table.shape[1]}"' if values.ndim > 1 else ""
    file.write(
        f'<DataArray type="{word}{8 * values.dtype.itemsize}" Name="{html.escape(name)}"{width}'
        f' format="{form}">\n'.encode()
    )
    if ascii:
        row = " ".join([number_format(values)] * table.shape[1]) + "\n"
        write_rows(file, row, list(table.T))
    else:
        content = np.ascontiguousarray(table, table.dtype.newbyteorder("=")).tobytes()
        blocks = [zlib.compress(content[i : i + _BLOCK]) for i in range(0, len(content), _BLOCK)]
        sizes = [len(blocks), _BLOCK, len(content) % _BLOCK, *map(len, blocks)]
        for part in (np.array(sizes, np.uint64).tobytes(), b"".join(blocks)):
            file.write(binascii.b2a_base64(part, newline=False))
        file.write(b"\n")
    file.write(b"</DataArray>\n")


def number_format(values: npt.NDArray[Any]) -> str:
    """A format that reads back as the same number of the same type."""
    return "%d" if values.dtype.kind in "iu" else "%.9g" if values.dtype.itemsize == 4 else "%.17g"
