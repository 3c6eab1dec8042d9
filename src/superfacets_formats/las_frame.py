"""Describe the header of a LAS file, so that a written file is like the file that was read."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array

_WKT, _GEOTIFF = 2112, 34735
"""Ids of the LAS records that define the reference system: in WKT format, and in GeoTIFF format."""

_TEXTS = 34737
"""Id of the LAS record with the texts of GeoTIFF keys."""
_MODEL, _GEOGRAPHIC = 1024, 2
"""GeoTIFF key of the kind of reference system, and its value for longitude and latitude."""
_CITATIONS, _CODES, _USER_DEFINED = (3073, 1026, 2049), (3072, 2048), 32767
"""GeoTIFF keys of names and of EPSG codes, and the code of a system that EPSG does not define."""

ORIGIN = ((4, 6), (8, 24), (26, 58), (90, 94))
"""Byte ranges in the header of a LAS file: source id (for example the number of the flight line),
GUID, system identifier, and day and year of creation."""

DIMENSION = 192
"""Size in bytes of the description of an extra dimension in a LAS file."""

_EXTRA_TYPES = ("", "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f4", "<f8")


class LasDimension(NamedTuple):
    """Description of an extra dimension of a LAS file, which has 1 to 3 numbers per point."""

    name: str  # name in the file, which may contain spaces
    kind: str  # NumPy type of the stored numbers, such as "<u2"; empty if it is not documented
    n_numbers: int  # number of stored numbers per point, 1 to 3
    description: str
    scales: tuple[float, ...] = ()
    offsets: tuple[float, ...] = ()
    """A value is its stored number times `scales`, plus `offsets`. Both tuples are empty if the
    stored numbers are the values."""

    def decoded(self, stored: Array) -> Array:
        """Return the values that stored numbers represent."""
        if not self.scales:
            return stored
        with np.errstate(over="ignore", invalid="ignore"):
            values: Array = stored * np.array(self.scales) + np.array(self.offsets)
        return values

    def encoded(self, values: Array) -> Array | None:
        """Return the numbers to store; None if the shape is wrong or decoding changes values."""
        if values.shape[1:] != ((self.n_numbers,) if self.n_numbers > 1 else ()):
            return None
        dtype = np.dtype(self.kind)
        with np.errstate(all="ignore"):
            if self.scales:
                numbers = (values - np.array(self.offsets)) / np.array(self.scales)
                stored = (np.rint(numbers) if dtype.kind in "iu" else numbers).astype(dtype)
            else:
                stored = values.astype(dtype)
        return stored if np.array_equal(self.decoded(stored), values, equal_nan=True) else None


class LasFrame(NamedTuple):
    """Version, point format, quantization and coordinate reference system of a LAS file.

    The reader of LAS stores it in `MeshAttributes.header`, so that written files are like the file
    that was read; the command `info` shows it.
    """

    minor: int  # minor version: LAS 1.minor
    point_format: int
    scales: tuple[float, float, float]
    offsets: tuple[float, float, float]
    """A coordinate is its stored integer times `scales`, plus `offsets`."""
    projection: tuple[tuple[int, bytes], ...] = ()
    """Id and content of each record of the reference system: GeoTIFF keys or WKT."""
    is_wkt: bool = False
    """Whether the header declares that the reference system is WKT."""
    extra: tuple[LasDimension, ...] = ()
    """Extra dimensions that were read, and are attributes of the points."""
    has_standard_time: bool = False
    """Whether GPS times are adjusted standard times. Otherwise they are seconds since the start of
    the week."""
    origin: tuple[tuple[int, bytes], ...] = ()
    """Offsets and contents of the parts of the header that say where the points are from."""

    def __str__(self) -> str:
        return f"LAS header, reference system {self.name or 'none'}"

    @property
    def facts(self) -> dict[str, str | int]:
        """Facts that `superfacets info` shows."""
        facts: dict[str, str | int] = {
            "LAS_version": f"1.{self.minor}",
            "point_format": self.point_format,
            "reference_system": self.name or "none",
        }
        return facts | ({"EPSG": self.epsg} if self.epsg else {})

    @property
    def reference_system(self) -> Literal["WKT", "GeoTIFF"] | None:
        """Format of the coordinate reference system, or None if there is none."""
        numbers = {number for number, _ in self.projection}
        if _WKT in numbers and (self.is_wkt or _GEOTIFF not in numbers):
            return "WKT"
        return "GeoTIFF" if _GEOTIFF in numbers else None

    @property
    def name(self) -> str | None:
        """Name of the reference system, or else its EPSG code or format; None if there is none."""
        kind, records = self.reference_system, dict(self.projection)
        if kind != "GeoTIFF":
            named = re.search(rb'"([^"]+)"', records.get(_WKT, b""))
            return _text_of(named[1]) if named and kind else kind
        keys = self._keys
        for key in _CITATIONS:
            at, n_bytes, begin = keys.get(key, (0, 0, 0))
            text = _text_of(records.get(_TEXTS, b"")[begin : begin + n_bytes])
            if at == _TEXTS and text:
                return text
        return f"EPSG:{self.epsg}" if self.epsg else kind

    @property
    def epsg(self) -> int:
        """EPSG code of the reference system; 0 if the file has none."""
        if self.reference_system == "WKT":  # the last entry is of the whole system
            code = re.search(rb'\["EPSG", ?"?(\d+)"?\]\][\s\0]*$', dict(self.projection)[_WKT])
            return int(code[1]) if code else 0
        keys = self._keys
        codes = [keys[key][2] for key in _CODES if key in keys and keys[key][0] == 0]
        return next((code for code in codes if 0 < code < _USER_DEFINED), 0)

    @property
    def is_geographic(self) -> bool:
        """Whether x and y are longitude and latitude, in degrees."""
        if self.reference_system == "GeoTIFF":
            return self._keys.get(_MODEL) == (0, 1, _GEOGRAPHIC)
        text = dict(self.projection).get(_WKT, b"").upper()
        words = re.findall(rb"\b(PROJ(?:CS|CRS|ECTEDCRS)|GEO(?:GCS|GCRS|DCRS|GRAPHICCRS))\b", text)
        return self.reference_system == "WKT" and bool(words) and words[0].startswith(b"GEO")

    @property
    def _keys(self) -> dict[int, tuple[int, int, int]]:
        """GeoTIFF keys: record with the value (0: no record), length, and offset or value."""
        content = dict(self.projection).get(_GEOTIFF, b"")
        rows = struct.iter_unpack("<4H", content[8 : len(content) // 8 * 8])
        return {key: (at, n, value) for key, at, n, value in rows}

    @staticmethod
    def dimensions(record: bytes) -> Iterator[tuple[LasDimension, int]]:
        """Yield the extra dimensions that a LAS record describes, with their sizes in bytes.

        For undocumented bytes, `kind` is empty. The types 11 to 30 are deprecated pairs and triples
        of the types 1 to 10. Raises a MeshError for other types.
        """
        for begin in range(0, len(record) - DIMENSION + 1, DIMENSION):
            kind, options, name = struct.unpack_from("<2xBB32s", record, begin)
            if kind > 30:
                raise MeshError(f"an extra dimension of the points has the unknown type {kind}")
            n = (kind - 1) // 10 + 1 if kind else 1
            numbers = struct.unpack_from("<6d", record, begin + 112)
            scales = numbers[:n] if options & 8 else (1.0,) * n
            offsets = numbers[3 : 3 + n] if options & 16 else (0.0,) * n
            dimension = LasDimension(
                name.split(b"\0")[0].decode("utf-8", "replace"),
                _EXTRA_TYPES[(kind - 1) % 10 + 1] if kind else "",
                n,
                record[begin + 160 : begin + 192].split(b"\0")[0].decode("ascii", "ignore"),
                *((scales, offsets) if kind > 0 and options & 24 else ()),
            )
            yield dimension, n * np.dtype(dimension.kind).itemsize if kind else options


def _text_of(content: bytes) -> str:
    """Return a name in a record as one line."""
    return " ".join(content.rstrip(b"\0|").decode("utf-8", "replace").split())
