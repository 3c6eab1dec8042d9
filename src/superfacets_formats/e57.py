"""Read E57 files with pye57. All scans are transformed by their poses and form one cloud."""

from __future__ import annotations

import contextlib
import os
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any, NamedTuple

import numpy as np

from superfacets import MeshError, kit
from superfacets.kit import Array, Bools, Content, Floats, Input, Read, counted

from .foreign import as_small

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLORS = ("colorRed", "colorGreen", "colorBlue")

_NORMALS = ("nor:normalX", "nor:normalY", "nor:normalZ")

_NAMES = {
    **dict(zip(_CARTESIAN, "xyz", strict=True)),
    **dict(zip(_COLORS, ("red", "green", "blue"), strict=True)),
    **dict(zip(_NORMALS, ("nx", "ny", "nz"), strict=True)),
}
"""Names in `MeshAttributes`, keyed by names of fields in E57."""

_AT_REST = np.concatenate([np.zeros((1, 3)), np.eye(3)])
"""Position of the scanner, and its three axes, in the coordinate system of the scan."""

_PAGE = 1024
"""Size of a page of the file, in bytes."""
_CHECKSUM = 4
"""Size of the checksum at the end of each page, in bytes."""


class _Scan(NamedTuple):
    """Points of a scan."""

    columns: dict[str, Array]  # properties of the points, by their names in `MeshAttributes`
    is_valid: Bools  # (n,) False for points that the file declares invalid
    frame: Floats | None  # (4, 3) `_AT_REST` transformed by the pose; None if there is no pose


def read_e57(source: Input) -> Read:
    """Read the points of all scans, in the order of the file, except points declared invalid.

    Invalid points have no position, and are common in scans on a grid. The attributes ``scan`` and
    ``record`` are the index of each point's scan, and the index of its record in this scan. Points
    of scans without a field that other scans have are black, or have NaN. Viewpoints are kept only
    if all scans have poses, of which at least one is not the identity.
    """
    data = source.data
    pye57 = kit.import_extra("pye57", "an .e57 file", "e57")
    _check_description(data)
    with _temporary_file(data, "scans.e57") as path:
        try:
            with pye57.E57(path) as file:
                _check_counts(file, len(data))
                scans = [_read_scan(pye57, file, i, source) for i in range(file.scan_count)]
                root = file.image_file.root()
                n_images = root["images2D"].childCount() if root.isDefined("images2D") else 0
        except (MemoryError, MeshError):
            raise
        except Exception as error:  # pye57 raises exceptions of many classes
            reason = kit.shortened(kit.reason_of(error))
            raise MeshError(f"the E57 file cannot be read: {reason}") from None
    if not scans:
        raise MeshError("the E57 file has no scans")
    if n_images:
        source.declare(counted(n_images, "image"))
    return _joined(source, scans)


@contextlib.contextmanager
def _temporary_file(data: Content, name: str) -> Iterator[str]:
    """Yield the path of a temporary file with `data`, because pye57 reads only files.

    On POSIX systems, it is the descriptor of a file in no folder, so that nothing is left behind.
    """
    if os.name == "posix":
        with TemporaryFile() as file:
            file.write(data)
            file.seek(0)
            yield f"/dev/fd/{file.fileno()}"
    else:
        with TemporaryDirectory(prefix="superfacets-") as folder:
            Path(folder, name).write_bytes(data)
            yield str(Path(folder, name))


def _check_description(data: Content) -> None:
    """Refuse XML with a DOCTYPE, because libE57 would expand its entities without limit."""
    begin, n_bytes = struct.unpack_from("<QQ", data[24:40].ljust(16, b"\0"))
    at = begin // _PAGE * _PAGE
    n_pages = n_bytes // (_PAGE - _CHECKSUM) + 3
    pages = data[at : at + n_pages * _PAGE]
    text = b"".join(
        pages[place : place + _PAGE - _CHECKSUM] for place in range(0, len(pages), _PAGE)
    )[begin - at :].removeprefix(b"\xef\xbb\xbf")
    declared = re.match(rb"<\?xml[^>]*encoding\s*=\s*.([\w-]+)", text)
    is_utf_8 = not declared or declared[1].lower() == b"utf-8"
    if not re.match(rb"<[^\0]", text) or not is_utf_8 or b"<!DOCTYPE" in text:
        raise MeshError("the E57 file cannot be read: its XML must be UTF-8 without a DOCTYPE")


def _check_counts(file: Any, n_bytes: int) -> None:
    """Compare the size of the fields of all scans with the size of the file."""
    scans = [file.get_header(place) for place in range(file.scan_count)]
    n_numbers = sum(scan.point_count * max(3, len(scan.point_fields)) for scan in scans)
    if 8 * n_numbers > kit.most_bytes_of(n_bytes):
        n_points = counted(sum(scan.point_count for scan in scans), "point")
        raise MeshError(f"the scans declare {n_points}, too many for {n_bytes} bytes")


def _joined(source: Input, scans: list[_Scan]) -> Read:
    is_valid = np.concatenate([scan.is_valid for scan in scans])
    sizes = [len(scan.is_valid) for scan in scans]
    stored: dict[str, Array] = {
        "scan": np.repeat(np.arange(len(scans), dtype=np.int32), sizes),
        "record": np.concatenate([np.arange(size, dtype=np.int32) for size in sizes]),
    }
    for name in dict.fromkeys(name for scan in scans for name in scan.columns):
        without = sum(len(scan.is_valid) for scan in scans if name not in scan.columns)
        if without:
            source.declare(f"{name} of {counted(without, 'point')}", "of scans that have none")
        missing = 0.0 if name in ("red", "green", "blue", "nx", "ny", "nz") else np.nan
        stored[name] = np.concatenate([
            scan.columns.get(name, np.full(len(scan.is_valid), missing, np.float32))
            for scan in scans
        ])  # fmt: skip
    kept = ((name, values[is_valid]) for name, values in stored.items())
    viewpoints = _viewpoints_of(scans)
    if viewpoints is not None and viewpoints.ndim == 2:
        viewpoints = viewpoints[is_valid]
    return source.cloud(kept, viewpoints=viewpoints, records=is_valid)


def _viewpoints_of(scans: list[_Scan]) -> Floats | None:
    """Return the scanner position: (3,) for one scan, else per point, (N, 3); None if unknown."""
    found = [scan.frame for scan in scans if scan.frame is not None]
    # Merged clouds often have an identity pose, although the scanner was not at the origin.
    if len(found) < len(scans) or np.array_equal(found, [_AT_REST] * len(scans)):
        return None
    if len(found) == 1:
        return np.asarray(found[0][0])
    return np.repeat([frame[0] for frame in found], [len(scan.is_valid) for scan in scans], axis=0)


def _read_scan(pye57: Any, file: Any, place: int, source: Input) -> _Scan:
    header = file.get_header(place)
    axes = next((axes for axes in (_CARTESIAN, _SPHERICAL) if _has(header, axes)), None)
    if axes is None:
        raise MeshError(f"scan {place} has neither cartesian nor spherical coordinates")
    columns = _read_columns(pye57, file, place, source)
    states = [columns.pop(f"{kind}InvalidState", None) for kind in ("cartesian", "spherical")]
    state = states[axes == _SPHERICAL]
    is_valid = np.full(len(columns[axes[0]]), True) if state is None else state == 0
    points = np.column_stack([columns.pop(axis) for axis in axes])
    columns |= zip(_CARTESIAN, _moved(_from(axes, points), header, place).T, strict=True)
    if _has(header, _NORMALS):
        normals = np.column_stack([columns[name] for name in _NORMALS])
        turned = _moved(normals, header, place) - _moved(np.zeros((1, 3)), header, place)
        columns |= zip(_NORMALS, turned.T, strict=True)
    if _has(header, _COLORS):
        shades = _colors_of(pye57, header, columns)
        if shades is None:
            source.declare(f"colors of scan {place}", "whose limits are not ascending")
            columns = {name: values for name, values in columns.items() if name not in _COLORS}
        else:
            columns |= zip(_COLORS, shades.T, strict=True)
    frame = _moved(_AT_REST, header, place) if header.has_pose() else None
    return _Scan({_NAMES.get(key, key): each for key, each in columns.items()}, is_valid, frame)


def _has(header: Any, names: tuple[str, ...]) -> bool:
    return all(name in header.point_fields for name in names)


def _read_columns(pye57: Any, file: Any, place: int, source: Input) -> dict[str, Array]:
    header, nodes = file.get_header(place), pye57.libe57
    n_records = header.point_count
    kinds = {nodes.IntegerNode: np.longlong, nodes.ScaledIntegerNode: np.float64,
             nodes.FloatNode: np.float64}  # fmt: skip
    prototype = nodes.StructureNode(header.points.prototype())
    columns = {}
    for name in header.point_fields:
        if type(prototype[name]) in kinds:
            columns[name] = np.empty(n_records, kinds[type(prototype[name])])
        else:
            source.declare(f"field {name} of scan {place}", "which has no numbers")
    if not n_records:
        return columns
    buffers = nodes.VectorSourceDestBuffer()
    for name, values in columns.items():
        buffers.append(nodes.SourceDestBuffer(file.image_file, name, values, n_records, True, True))
    reader = header.points.reader(buffers)
    n_read = reader.read()
    reader.close()
    if n_read != n_records:
        raise MeshError(f"scan {place} declares {counted(n_records, 'point')} but has {n_read}")
    return {name: as_small(values) for name, values in columns.items()}


def _from(axes: tuple[str, ...], points: Floats) -> Floats:
    """Convert range, azimuth and elevation (in radians), if these are the axes, to x, y and z."""
    if axes == _CARTESIAN:
        return points
    range_, azimuth, elevation = points.T
    across = range_ * np.cos(elevation)
    return np.column_stack(
        [across * np.cos(azimuth), across * np.sin(azimuth), range_ * np.sin(elevation)]
    )


def _moved(points: Floats, header: Any, place: int) -> Floats:
    """Transform points by the pose of a scan: first the rotation, then the translation."""
    if not header.has_pose():
        return points
    pose = header.node["pose"]
    if pose.isDefined("rotation"):
        quaternion = np.array([_number_in(pose["rotation"][axis]) for axis in "wxyz"])
        rotation = kit.rotation_of(quaternion)
        if rotation is None:
            raise MeshError(f"scan {place} has an invalid rotation: {quaternion.tolist()}")
        points = np.einsum("ij,kj->ik", points, rotation)
    if pose.isDefined("translation"):
        points = points + [_number_in(pose["translation"][axis]) for axis in "xyz"]
    return points


def _colors_of(pye57: Any, header: Any, columns: dict[str, Array]) -> Array | None:
    """Scale colors to [0, 1], or return None if their limits are infinite or not ascending."""
    shades = np.empty((len(columns[_COLORS[0]]), 3), np.float32)
    for place, name in enumerate(_COLORS):
        low, high = _limits_of(pye57, header, name)
        if not (np.isfinite(high - low) and high > low):
            return None
        shades[:, place] = (columns[name] - np.float32(low)) / np.float32(high - low)
    return np.clip(shades, 0, 1)


def _limits_of(pye57: Any, header: Any, name: str) -> tuple[float, float]:
    """Return the limits of a color field from the header of the scan, or else from its type."""
    if header.node.isDefined("colorLimits"):
        limits = header.node["colorLimits"]
        return _number_in(limits[f"{name}Minimum"]), _number_in(limits[f"{name}Maximum"])
    kind = pye57.libe57.StructureNode(header.points.prototype())[name]
    return kind.minimum(), kind.maximum()


def _number_in(node: Any) -> float:
    return float(node.scaledValue() if hasattr(node, "scaledValue") else node.value())
