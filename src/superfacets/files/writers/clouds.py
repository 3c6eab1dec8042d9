"""Write point clouds as CSV."""

from __future__ import annotations

from typing import IO

import numpy as np

from ...base.types import Array
from ..attributes import COLORS
from ..input import NORMALS
from .content import Output
from .text import number_format, write_rows


def write_csv(file: IO[bytes], content: Output) -> None:
    """Write points as CSV: a line with names, then one line per point with all its properties."""
    cloud = content.cells
    columns: dict[str, Array] = dict(zip("xyz", cloud.points.T, strict=True))
    if content.labels is not None:
        columns["label"] = content.labels
    for name, values in content.properties("vertex", columns).items():
        parts = {name: values} if values.ndim == 1 else {
            f"{name}_{place}": part for place, part in enumerate(values.T)
        }  # fmt: skip
        columns |= parts
    for names, table in ((NORMALS, cloud.normals), (COLORS, content.cloud_colors)):
        if table is not None and not columns.keys() & {*names}:
            columns |= zip(names, table.T, strict=True)
    file.write(f"{','.join(columns)}\n".encode())
    row = ",".join(number_format(np.asarray(values)) for values in columns.values()) + "\n"
    write_rows(file, row, [*columns.values()])
