"""Point clouds in files and arrays, read piece by piece."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._validate import checked_normals, exact_doubles
from ...errors import MeshError
from ...io.readers.npy import MAX_NPY_HEADER, npy_header
from ...io.readers.ply_header import Header
from ...mesh.point_cloud import PointCloud
from ..reading import ArrayRows, RecordRows, Rows

__all__ = ["CloudPieces", "array_pieces", "cloud_pieces", "npy_pieces", "ply_cloud_pieces"]

AXES = ("x", "y", "z")
NORMALS = ("nx", "ny", "nz")


@dataclass(frozen=True)
class CloudPieces:
    """A cloud of which pieces can be read.

    Parameters
    ----------
    points : Rows
        Of three coordinates, as float64.
    normals : Rows or None
        Of three numbers, of length 1 or 0.
    """

    points: Rows
    normals: Rows | None = None

    @property
    def n_points(self) -> int:
        """Number of points."""
        return self.points.n_rows

    @property
    def n_cells(self) -> int:
        """The same, whatever kind the cells are of."""
        return self.n_points


@dataclass(frozen=True)
class DoubleRows:
    """The rows of a table of numbers, as float64."""

    rows: Rows

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return self.rows.n_rows

    def read(self, begin: int, end: int) -> npt.NDArray[np.float64]:
        """Rows begin to end - 1."""
        return exact_doubles(self.rows.read(begin, end))


@dataclass(frozen=True)
class NormalRows:
    """The same, with vectors of length 1, or 0; a MeshError names the first that is not finite."""

    rows: Rows

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return self.rows.n_rows

    def read(self, begin: int, end: int) -> npt.NDArray[np.float64]:
        """Rows begin to end - 1."""
        return checked_normals(self.rows.read(begin, end), end - begin, begin)


def cloud_pieces(cloud: PointCloud) -> CloudPieces:
    """The arrays of a cloud; its normals are of length 1 already."""
    normals = None if cloud.normals is None else ArrayRows(cloud.normals)
    return CloudPieces(ArrayRows(cloud.points), normals)


def array_pieces(points: npt.NDArray[Any]) -> CloudPieces:
    """An array as it is: it may be a map of a file that is larger than memory."""
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise MeshError(f"points must be numbers of shape (N, 3), got {points.shape}")
    if not len(points):
        raise MeshError("the cloud has no points")
    return CloudPieces(DoubleRows(ArrayRows(points)))


def ply_cloud_pieces(path: Path, header: Header) -> CloudPieces | None:
    """The vertices of a binary PLY file and their normals, or None if that has to be read whole."""
    begin, place = header.size, header.find("vertex")
    if header.is_ascii or place is None:
        return None
    names = [[stored.name for stored in element.properties] for element in header.elements]
    for element in header.elements[: place + 1]:
        if any(stored.is_list for stored in element.properties):
            return None
    if len(set(names[place])) < len(names[place]) or not set(AXES) <= set(names[place]):
        return None
    records = [_record_of(header, at) for at in range(place + 1)]
    begin += sum(
        element.n_rows * record.itemsize
        for element, record in zip(header.elements[:place], records, strict=False)
    )
    n_points, record = header.elements[place].n_rows, records[place]
    if not n_points or n_points * record.itemsize > path.stat().st_size - begin:
        return None
    normals = None
    if set(NORMALS) <= set(names[place]):
        normals = NormalRows(RecordRows(path, begin, n_points, record, NORMALS))
    return CloudPieces(DoubleRows(RecordRows(path, begin, n_points, record, AXES)), normals)


def _record_of(header: Header, place: int) -> np.dtype[Any]:
    """The record of a row of an element without lists."""
    properties = header.elements[place].properties
    names = [stored.name for stored in properties]
    are_different = len(set(names)) == len(names)
    return np.dtype(
        [
            (stored.name if are_different else f"{at}", stored.dtype)
            for at, stored in enumerate(properties)
        ]
    )


def npy_pieces(path: Path) -> CloudPieces | None:
    """The points of a .npy file of shape (N, 3), or None if that has to be read whole."""
    with path.open("rb") as file:
        shape, dtype, is_fortran, begin = npy_header(file.read(2 * MAX_NPY_HEADER))
    if len(shape) != 2 or shape[1] != 3 or is_fortran or dtype.kind not in "fiu" or not shape[0]:
        return None
    record = np.dtype([("row", dtype, (3,))])
    if shape[0] * record.itemsize != path.stat().st_size - begin:
        return None
    return CloudPieces(DoubleRows(RecordRows(path, begin, shape[0], record, ("row",))))
