"""Store the attributes that mesh files have for vertices and faces, for example normals."""

from __future__ import annotations

import reprlib
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.checks import counted, owned, refuse_mask
from ..base.errors import MeshError
from ..base.lazy import load
from ..base.types import Array, Bytes
from .guards import narrowed

if TYPE_CHECKING:
    from .. import Texture

PLY_TYPES = {"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint",
             "f4": "float", "f8": "double"}  # fmt: skip
"""Names of types in PLY, keyed by NumPy's type code."""

COLORS = ("red", "green", "blue")
"""Names of the properties that are colors."""

IMAGE_COMMENT = "comment TextureFile "
"""Begin of the comments in PLY that name an image of the texture."""

_WKT, _GEOTIFF = 2112, 34735
"""Ids of the LAS records that define the reference system: in WKT format, and in GeoTIFF format."""


_DIMENSION = 192
"""Size in bytes of the description of an extra dimension in a LAS file."""

_EXTRA_TYPES = ("", "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f4", "<f8")


class LasDimension(NamedTuple):
    """Description of an extra dimension of a LAS file, which has 1 to 3 numbers per point."""

    name: str  # name in the file, which may contain spaces
    kind: str  # NumPy type of the stored numbers, such as "<u2"
    n_numbers: int  # number of stored numbers per point, 1 to 3
    description: str
    scales: tuple[float, ...] = ()
    offsets: tuple[float, ...] = ()
    """A value is its stored number times `scales`, plus `offsets`. Both tuples are empty if the
    stored numbers are the values."""

    @property
    def attribute(self) -> str:
        """Name of the dimension in `MeshAttributes`, where underscores replace spaces."""
        return "_".join(self.name.split())

    @property
    def is_readable(self) -> bool:
        """Whether the type is documented, and the name can be a name in `MeshAttributes`."""
        return bool(self.kind) and is_word(self.attribute)

    def decoded(self, stored: Array) -> Array:
        """Return the values that stored numbers represent."""
        if not self.scales:
            return narrowed(stored)
        with np.errstate(over="ignore", invalid="ignore"):
            values: Array = stored * np.array(self.scales) + np.array(self.offsets)
        return values

    def encoded(self, values: Array) -> Array | None:
        """Return the numbers to store; None if the shape is wrong or decoding them gives others."""
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

    The reader of LAS stores it in `MeshAttributes.las`, so that written files are like the file
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
    source_id: int = 0
    """File source id, for example the number of the flight line."""
    has_standard_time: bool = False
    """Whether GPS times are adjusted standard times. Otherwise they are seconds since the start of
    the week."""

    @property
    def reference_system(self) -> Literal["WKT", "GeoTIFF"] | None:
        """Format of the coordinate reference system, or None if there is none."""
        numbers = {number for number, _ in self.projection}
        if _WKT in numbers and (self.is_wkt or _GEOTIFF not in numbers):
            return "WKT"
        return "GeoTIFF" if _GEOTIFF in numbers else None

    @staticmethod
    def dimensions(record: bytes) -> Iterator[tuple[LasDimension, int]]:
        """Yield the extra dimensions that a LAS record describes, with their sizes in bytes.

        For undocumented bytes, `kind` is empty. The types 11 to 30 are deprecated pairs and triples
        of the types 1 to 10. Raises a MeshError for other types.
        """
        for begin in range(0, len(record) - _DIMENSION + 1, _DIMENSION):
            kind, options, name = struct.unpack_from("<2xBB32s", record, begin)
            if kind > 30:
                raise MeshError(f"an extra dimension of the points has the unknown type {kind}")
            n = (kind - 1) // 10 + 1 if kind else 1
            factors = struct.unpack_from(f"<{n}d", record, begin + 112)
            terms = struct.unpack_from(f"<{n}d", record, begin + 136)
            scaling = (
                factors if options & 8 else (1.0,) * n, terms if options & 16 else (0.0,) * n
            )  # fmt: skip
            dimension = LasDimension(
                name.split(b"\0")[0].decode("utf-8", "replace"),
                _EXTRA_TYPES[(kind - 1) % 10 + 1] if kind else "",
                n,
                record[begin + 160 : begin + 192].split(b"\0")[0].decode("ascii", "ignore"),
                *(scaling if kind > 0 and options & 24 else ()),
            )
            yield dimension, n * np.dtype(dimension.kind).itemsize if kind else options


@dataclass(frozen=True, eq=False)
class MeshAttributes:
    """Properties in a mesh file other than positions and corners, for example colors or a texture.

    `read_attributes` reads attributes from a file, and `write_mesh` writes them. You can also
    create attributes yourself, to store your own numbers with vertices or faces.

    Parameters
    ----------
    vertex : mapping of str to array_like, shape (V,) or (V, n), optional
        Properties of the vertices other than x, y and z, by name: one number, or n numbers, per
        vertex. Arrays are copied, made read-only, and converted to types that PLY supports: bool
        becomes uint8, int64 becomes int32 or uint32, and float16 becomes float32.
    face : mapping of str to array_like, shape (F,) or (F, n), optional
        Properties of the faces other than their corners.
    comments : sequence of str, optional
        Lines of the PLY header that begin with ``comment`` or ``obj_info``, in their order.
    left_out : sequence of str, optional
        Descriptions of data in the file that were not read, for example elements other than
        vertices and faces, lists of varying length, properties whose name is repeated or is not one
        word of ASCII, and missing images.
    las : LasFrame, optional
        Version, point format, quantization, coordinate reference system and types of extra
        dimensions of the LAS file that was read. Written LAS files use the same values.
    texture : Texture, optional
        Texture coordinates and materials.

    Raises
    ------
    ValueError
        If a name is not one word of printable ASCII, if an array does not have one or two
        dimensions, if no type of PLY can store an integer, or if a comment is not one line that
        begins with ``comment`` or ``obj_info``.
    TypeError
        If an array does not contain real numbers, if `vertex` or `face` is not a mapping, or if
        ``texture`` is not a `Texture`.

    Examples
    --------
    >>> attributes = MeshAttributes(face={"material": [0, 2]}, comments=["comment by hand"])
    >>> attributes
    MeshAttributes(vertex: none; face: material; 1 comment)
    >>> attributes.face["material"].dtype
    dtype('int32')
    """

    vertex: Mapping[str, Array] = field(default_factory=dict)
    face: Mapping[str, Array] = field(default_factory=dict)
    comments: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    las: LasFrame | None = None
    texture: Texture | None = None

    def __post_init__(self) -> None:
        for owner in ("vertex", "face"):
            given: Mapping[str, Any] = getattr(self, owner)
            if not isinstance(given, Mapping):
                raise TypeError(f"{owner} must be a mapping of names to arrays, got {type(given)}")
            checked = {name: _checked(values, name, owner) for name, values in given.items()}
            object.__setattr__(self, owner, MappingProxyType(checked))
        object.__setattr__(self, "comments", tuple(map(_checked_comment, self.comments)))
        object.__setattr__(self, "left_out", tuple(self.left_out))
        texture_class = "superfacets_textures.textures:Texture"
        if self.texture is not None and not isinstance(self.texture, load(texture_class)):
            raise TypeError(f"texture must be a Texture, got {type(self.texture).__name__}")

    @property
    def colors(self) -> Bytes | None:
        """Red, green and blue of each face or else of each vertex, (n, 3) uint8, or None.

        The largest value determines whether the properties ``red``, ``green`` and ``blue`` are in
        the range 0 to 1, 0 to 255, or 0 to 65535. Point clouds store black for missing colors, so
        the result is also None if all colors are black. Colors that `write_mesh` writes beside
        labels are left out, because they are colors of regions.
        """
        return self._colors_that(are_of_regions=False)

    @property
    def region_colors(self) -> Bytes | None:
        """Colors of regions that `write_mesh` writes beside labels, (n, 3) uint8, or None.

        There is one color per face or, in a point cloud, per point.
        """
        return self._colors_that(are_of_regions=True)

    def _colors_that(self, *, are_of_regions: bool) -> Bytes | None:
        for stored in (self.face, self.vertex):
            if stored.keys() >= {*COLORS} and _have_region_colors(stored) == are_of_regions:
                return _bytes_of(np.column_stack([stored[name] for name in COLORS])[:, :3])
        return None

    def with_properties(
        self, *, vertex: Mapping[str, Any] | None = None, face: Mapping[str, Any] | None = None
    ) -> MeshAttributes:
        """Return a copy with additional properties, which replace properties of the same name.

        All other fields, such as comments and the texture, are the same as in the original.

        Parameters
        ----------
        vertex, face : mapping of str to array_like, optional
            Properties of the vertices, and of the faces. Same as in `MeshAttributes`.

        Returns
        -------
        MeshAttributes

        Examples
        --------
        >>> MeshAttributes(vertex={"heat": [1, 2]}).with_properties(vertex={"kind": [0, 0]})
        MeshAttributes(vertex: heat, kind; face: none; 0 comments)
        """
        return replace(
            self, vertex={**self.vertex, **(vertex or {})}, face={**self.face, **(face or {})}
        )

    def __reduce__(self) -> tuple[type[MeshAttributes], tuple[Any, ...]]:
        others = self.comments, self.left_out, self.las, self.texture
        return MeshAttributes, (dict(self.vertex), dict(self.face), *others)

    def __repr__(self) -> str:
        vertex, face = (", ".join(names) or "none" for names in (self.vertex, self.face))
        texture = "" if self.texture is None else f"; {self.texture}"
        comments = counted(len(self.comments), "comment")
        return f"MeshAttributes(vertex: {vertex}; face: {face}; {comments}{texture})"


def _have_region_colors(stored: Mapping[str, Array]) -> bool:
    """Return whether colors are of regions: `write_ply` stores labels as `label` and `quality`."""
    if not stored.keys() >= {"label", "quality"}:
        return False
    return np.array_equal(stored["label"].astype(np.float32), stored["quality"])


def _bytes_of(colors: Array) -> Bytes | None:
    """Scale colors to the range 0 to 255; return None if all colors are black."""
    colors = np.nan_to_num(colors)
    most = float(colors.max(initial=0.0))
    if most <= 0.0:
        return None
    top = next((top for top in (1.0, 255.0, 65535.0) if most <= top), most)
    return np.rint(np.clip(colors, 0, None) * (255.0 / top)).astype(np.uint8)


def _checked(values: Any, name: str, owner: str) -> Array:
    """Return the values as a read-only (N,) or (N, n) array of a type that PLY supports."""
    what = f"{owner} property {reprlib.repr(name)}"
    if not is_word(name):
        raise ValueError(f"{what}: the name must be one word of printable ASCII")
    refuse_mask(values, what)
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{what} must be real numbers, got {array.dtype}")
    if array.ndim not in (1, 2):
        raise ValueError(f"{what} must have one or two dimensions, got shape {array.shape}")
    stored = owned(array, _stored_type(array, what))
    stored.flags.writeable = False
    return stored


def _stored_type(array: Array, what: str) -> npt.DTypeLike:
    """Return the NumPy type to which an array is converted, so that PLY can store it.

    Raises a ValueError if an integer does not fit in 32 bits.
    """
    if array.dtype.str[1:] in PLY_TYPES:
        return array.dtype.newbyteorder("=")
    if array.dtype.kind == "b":
        return np.uint8
    if array.dtype.kind == "f":  # float16 or long double
        return np.float32 if array.dtype.itemsize < 4 else np.float64
    for kind in (np.int32, np.uint32):
        limits = np.iinfo(kind)
        if not array.size or limits.min <= array.min() <= array.max() <= limits.max:
            return kind
    raise ValueError(f"{what} must fit in 32-bit integers, got {array.min()} to {array.max()}")


def is_image(comment: str) -> bool:
    """Return whether a comment of a PLY file has the name of an image."""
    return comment.startswith(IMAGE_COMMENT)


def images_in(comments: Sequence[str]) -> list[str]:
    """Return the names of images in the comments of a PLY file."""
    found = [line[len(IMAGE_COMMENT) :].strip() for line in comments if is_image(line)]
    return [name for name in found if name]


def is_word(name: object) -> bool:
    """Return whether an object can be a name in a PLY header: one word of printable ASCII."""
    is_text = isinstance(name, str) and name.isascii() and name.isprintable()
    return is_text and str(name).split() == [name]


def _checked_comment(line: object) -> str:
    is_line = isinstance(line, str) and not {"\n", "\r"} & set(line) and is_encodable(line)
    if not is_line or str(line).split(" ")[0] not in ("comment", "obj_info"):
        raise ValueError(
            f"comments must be lines that begin with comment or obj_info, got {reprlib.repr(line)}"
        )
    return str(line)


def is_encodable(text: str) -> bool:
    """Return whether a text can be encoded as UTF-8."""
    try:
        text.encode()
    except UnicodeEncodeError:  # the text has a lone surrogate
        return False
    return True
