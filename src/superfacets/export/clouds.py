"""Write point clouds with a label per point: CSV, LAS and LAZ."""

from __future__ import annotations

import io
from typing import IO

import numpy as np

from .._types import Array, Floats
from ..errors import MeshError, MissingExtraError, reason_of
from ..io.guards import shortened
from .content import Content
from .text import write_rows

_LAS_STEPS = 2.0**31 - 2
"""Number of steps between the lowest and the highest coordinate: LAS stores 32-bit integers."""


def write_csv(file: IO[bytes], content: Content) -> None:
    """Write points as CSV: a line of names, and a line per point with x, y, z and the label."""
    cloud, labels = content.cells, content.labels
    names = ["x", "y", "z"] + ([] if labels is None else ["label"])
    file.write((",".join(names) + "\n").encode())
    row = ",".join(["%.17g"] * 3 + ([] if labels is None else ["%d"])) + "\n"
    columns: list[Array] = list(cloud.points.T)
    write_rows(file, row, columns if labels is None else [*columns, labels])


def write_las(file: IO[bytes], content: Content) -> None:
    """Write points as LAS 1.4 or LAZ, with attributes, and labels in a dimension `label`."""
    try:
        import laspy
    except ModuleNotFoundError:
        raise MissingExtraError("a .las or .laz file", "las") from None
    cloud, attributes = content.cells, content.attributes
    header = laspy.LasHeader(point_format=7 if cloud.colors is not None else 6, version="1.4")
    low, high = cloud.bounds
    header.offsets = low
    header.scales = np.maximum(_round_step((high - low) / _LAS_STEPS), 1e-12)
    las = laspy.LasData(header)
    las.x, las.y, las.z = cloud.points.T
    stored = {} if attributes is None else dict(attributes.vertex)
    if cloud.colors is not None:
        for name, shades in zip(("red", "green", "blue"), cloud.colors.T, strict=True):
            stored[name] = np.rint(shades * 65535).astype(np.uint16)
    if content.labels is not None:
        stored["label"] = content.labels
    known = set(las.point_format.dimension_names)
    for name, values in stored.items():
        if values.ndim != 1:
            continue
        if name not in known:
            las.add_extra_dim(laspy.ExtraBytesParams(name=name[:31], type=values.dtype))
        las[name[:31]] = values
    written = io.BytesIO()  # laspy seeks back to complete the header
    try:
        las.write(written, do_compress=content.ending == ".laz")
    except Exception as error:  # laspy raises many kinds
        reason = shortened(reason_of(error))
        raise MeshError(f"the cloud cannot be written as {content.ending}: {reason}") from None
    file.write(written.getbuffer())


def _round_step(least: Floats) -> Floats:
    """Round steps up to powers of ten, at least 1e-6, as is usual for scales in LAS."""
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 ** np.maximum(np.ceil(np.log10(least)), -6.0))
