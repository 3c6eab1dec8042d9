"""Write point clouds with one label per point as LAS or LAZ, with laspy."""

from __future__ import annotations

import io
from typing import IO, Any

import numpy as np

from superfacets import MeshError, PointCloud
from superfacets.kit import Array, Output, import_extra, reason_of, shortened

from .las import PROJECTION
from .las_frame import LasFrame

_COLORS = ("red", "green", "blue")

_WITHOUT_WAVES = {4: 1, 5: 3, 9: 6, 10: 8}
"""Maps each LAS point format with wave packets to the same format without wave packets."""

_LAS_STEPS = 2.0**31 - 2
"""Maximum range of a coordinate, in quantization steps. LAS stores the number of steps as a 32-bit
integer."""

_MAX_VLR_BYTES = 65535
"""Maximum size of a variable length record, in bytes. Larger records are written after the points,
as extended variable length records, which LAS 1.4 introduced."""

_MAX_BYTES = 31
"""Maximum length, in bytes, of the name and of the description of an extra dimension."""


def write_las(file: IO[bytes], content: Output) -> None:
    """Write points and attributes as LAS or LAZ, with labels in the extra dimension ``label``.

    If the attributes come from a LAS file, the output has the same version, point format,
    quantization, coordinate reference system, source, date of creation and types of extra
    dimensions, with three exceptions: a quantization or type that cannot represent the values is
    replaced, point formats with wave packets become formats without wave packets, and old versions
    become at least LAS 1.2. If there are no attributes from a LAS file, the output is LAS 1.4 with
    point format 6, or 7 if the cloud has colors.
    """
    laspy = import_extra("laspy", "a .las or .laz file", "las")
    cloud, attributes = content.cells, content.attributes
    frame = _frame_of(cloud, None if attributes is None else attributes.header)
    header = laspy.LasHeader(point_format=frame.point_format, version=f"1.{frame.minor}")
    header.scales, header.offsets = np.array(frame.scales), np.array(frame.offsets)
    if frame.is_wkt:  # laspy 2.5 also sets this flag if the assigned value is False
        header.global_encoding.wkt = True
    if frame.has_standard_time:
        header.global_encoding.gps_time_type = laspy.header.GpsTimeType.STANDARD
    las = laspy.LasData(header)
    for number, record in frame.projection:
        vlr = laspy.VLR(PROJECTION.decode(), number, record_data=record)
        if len(record) <= _MAX_VLR_BYTES:
            header.vlrs.append(vlr)
        else:
            las.evlrs = laspy.vlrs.vlrlist.VLRList([*(las.evlrs or ()), vlr])
    las.x, las.y, las.z = cloud.points.T
    own = {} if content.labels is None else {"label": content.labels}
    stored = content.properties("vertex", own)
    content.taken.add(str(frame) if attributes is None else str(attributes.header))
    kinds = {stored[name].dtype if name in stored else None for name in _COLORS}
    if cloud.colors is not None and not kinds <= {np.dtype(np.uint8), np.dtype(np.uint16)}:
        for name, shades in zip(_COLORS, cloud.colors.T, strict=True):
            stored[name] = np.rint(shades * 65535).astype(np.uint16)
    if content.labels is not None:
        stored["label"] = content.labels
    _add_columns(las, stored, content, frame)
    written = io.BytesIO()  # laspy needs a seekable file to complete the header
    try:
        las.write(written, do_compress=content.ending == ".laz")
    except Exception as error:  # laspy raises exceptions of many classes
        reason = shortened(reason_of(error))
        raise MeshError(f"the cloud cannot be written as {content.ending}: {reason}") from None
    whole = written.getbuffer()
    for begin, part in frame.origin:
        whole[begin : begin + len(part)] = part
    file.write(whole)


def _add_columns(las: Any, stored: dict[str, Array], content: Output, frame: LasFrame) -> None:
    """Store each array in the field of its name, or in a new dimension if it would be rounded."""
    fields = {field.name: field for field in las.point_format.standard_dimensions}
    for name, values in stored.items():
        if name in fields and _fits(values, fields[name]):
            las[name] = values
            continue
        is_label = name == "label" and content.labels is not None  # labels are always int32
        other = f"{name}_value" if name in fields else name
        other = other.encode()[:_MAX_BYTES].decode("utf-8", "ignore")
        if not _add_dimension(las, name, other, values, None if is_label else frame):
            content.taken.discard(f"vertex property {name}")
        elif other != name:
            content.changed.append(f"vertex property {name} by this name, but as {other}")


def _fits(values: Array, field: Any) -> bool:
    """Return whether a field of a LAS point can store the values exactly."""
    if values.ndim > 1:
        return False
    if field.name == "gps_time":
        return True
    # The field `scan_angle` counts steps of 0.006 degrees; fractions are degrees.
    is_angle = field.name == "scan_angle" and values.dtype.kind == "f"
    return not is_angle and bool(
        np.all((values >= field.min) & (values <= field.max) & (values == np.rint(values)))
    )


def _add_dimension(las: Any, name: str, other: str, values: Array, frame: LasFrame | None) -> bool:
    """Add a property as an extra dimension named `other`, and return whether this is possible.

    Name and type come from the dimension of this property in `frame` if its type can represent all
    values; otherwise the array determines the type. A dimension has 1 to 3 numbers per point.
    """
    n = 1 if values.ndim == 1 else values.shape[1]
    if not 1 <= n <= 3:
        return False
    shape = () if n == 1 else (n,)
    given = next((each for each in frame.extra if each.name == name), None) if frame else None
    stored = None if given is None else given.encoded(values)
    more: dict[str, Any] = {"type": np.dtype((values.dtype.str, shape))}
    if given is not None and stored is not None:
        other, values = given.name, stored
        more = {
            "type": np.dtype((given.kind, shape)), "description": given.description[:_MAX_BYTES],
            "offsets": given.offsets or None, "scales": given.scales or None,
        }  # fmt: skip
    extra_bytes = import_extra("laspy", "a .las or .laz file", "las").ExtraBytesParams
    las.add_extra_dim(extra_bytes(name=other, **more))
    las.points.array[other] = values.reshape(-1, *shape)
    return True


def _frame_of(cloud: PointCloud, given: LasFrame | None) -> LasFrame:
    """Return settings that represent the points: `given`, adapted if needed, or new settings."""
    low, high = cloud.bounds
    with np.errstate(divide="ignore"):  # steps are powers of ten, as is common in LAS
        scales = 10.0 ** np.maximum(np.ceil(np.log10((high - low) / _LAS_STEPS)), -6.0)
    usual = LasFrame(4, 7 if cloud.colors is not None else 6, tuple(scales), tuple(low))
    if given is None:
        return usual
    point_format = _WITHOUT_WAVES.get(given.point_format, given.point_format)
    minor = max(given.minor, 4 if point_format > 5 else 2)
    with np.errstate(all="ignore"):
        steps = (cloud.bounds - given.offsets) / given.scales
    if not (np.all(np.asarray(given.scales) > 0) and np.all(np.abs(steps) < 2.0**31 - 1)):
        given = given._replace(scales=usual.scales, offsets=usual.offsets)
    return given._replace(minor=minor, point_format=point_format)
