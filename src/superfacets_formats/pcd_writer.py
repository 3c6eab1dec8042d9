"""Write point clouds as PCD, for the Point Cloud Library and Open3D."""

from __future__ import annotations

from typing import IO

import numpy as np

from superfacets.kit import Array, Output, number_format, write_rows

_NAMES = {"nx": "normal_x", "ny": "normal_y", "nz": "normal_z"}

ROWS_AT_ONCE = 1 << 14
"""Number of records that are written at a time."""


def write_pcd(file: IO[bytes], content: Output) -> None:
    """Write positions, normals, packed colors, labels and attributes as binary or text PCD.

    Coordinates are float32 if float32 is exact, otherwise float64. Labels are unsigned integers, or
    signed integers if a label is -1.
    """
    columns = _columns_of(content)
    kinds = [values.dtype.str[1:].upper() for values in columns.values()]
    counts = [1 if values.ndim == 1 else values.shape[1] for values in columns.values()]
    n_points = content.cells.n_points
    view = content.cells.viewpoints
    place = view if view is not None and view.ndim == 1 else (0, 0, 0)
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(columns)}",
        f"SIZE {' '.join(kind[1:] for kind in kinds)}",
        f"TYPE {' '.join(kind[0] for kind in kinds)}",
        f"COUNT {' '.join(map(str, counts))}",
        f"WIDTH {n_points}",
        "HEIGHT 1",
        "VIEWPOINT {:.17g} {:.17g} {:.17g} 1 0 0 0".format(*place),
        f"POINTS {n_points}",
        f"DATA {'ascii' if content.ascii else 'binary'}\n",
    ]
    file.write("\n".join(lines).encode("ascii"))
    if content.ascii:
        flat = [column for values in columns.values() for column in np.atleast_2d(values.T)]
        row = " ".join(map(number_format, flat))
        write_rows(file, f"{row}\n", flat)
        return
    record = np.dtype(
        [(name, values.dtype, values.shape[1:]) for name, values in columns.items()]
    ).newbyteorder("<")
    for begin in range(0, n_points, ROWS_AT_ONCE):
        rows = np.empty(min(ROWS_AT_ONCE, n_points - begin), record)
        for name, values in columns.items():
            rows[name] = values[begin : begin + ROWS_AT_ONCE]
        file.write(rows.tobytes())


def _columns_of(content: Output) -> dict[str, Array]:
    """Return the PCD fields by name, without attributes whose name or colors are there already."""
    cloud, labels, colors = content.cells, content.labels, content.cloud_colors
    with np.errstate(over="ignore"):  # overflow gives infinity, which differs from the value
        points = cloud.points.astype(np.float32)
    if not np.array_equal(points, cloud.points):
        points = cloud.points
    columns: dict[str, Array] = dict(zip("xyz", np.ascontiguousarray(points.T), strict=True))
    if cloud.normals is not None:
        columns |= zip(_NAMES.values(), cloud.normals.T.astype(np.float32), strict=True)
    own: dict[str, Array] = {}
    if colors is not None:
        packed = colors.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
        # Other programs expect these bits as a float in binary files, and as an integer in text.
        columns["rgb"] = packed if content.ascii else packed.view(np.float32)
        own = dict(zip(("red", "green", "blue"), colors.T, strict=True))
    if labels is not None:
        columns["label"] = labels if labels.min() < 0 else labels.astype(np.uint32)
    names = {field: name for name, field in _NAMES.items()}
    own |= {names.get(field, field): values for field, values in columns.items()}
    columns |= {
        _NAMES.get(name, name): values for name, values in content.properties("vertex", own).items()
    }
    return columns
