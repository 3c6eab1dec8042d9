"""Define `MeshAttributes`: properties of vertices and faces, for example colors or a texture."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arrays import narrowed
from ..base.checks import counted, owned, refuse_mask
from ..base.lazy import load
from ..base.types import Array, Bools, Bytes
from .point_cloud import PointCloud

if TYPE_CHECKING:
    from .. import Texture

PLY_TYPES = {"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint",
             "f4": "float", "f8": "double"}  # fmt: skip
"""Names of types in PLY, keyed by NumPy's type code."""

COLORS = ("red", "green", "blue")
"""Names of the properties that are colors."""

INDEX_NAMES = ("vertex_indices", "vertex_index")
"""Possible names in PLY of the list with the corners of a face."""

TAKEN = ("cells", "attributes", "texture")
"""Values of `MeshAttributes.declared` for items that are not left out."""

NAMES_COMMENT = "comment names "
"""Beginning of a PLY comment with the name of a property of faces, and a JSON list of the names of
its values."""

IMAGE_COMMENT = "comment TextureFile "
"""Beginning of a PLY comment that names an image of the texture."""


@dataclass(frozen=True, eq=False)
class MeshAttributes:
    """Properties in a mesh file other than positions and corners, for example colors or a texture.

    `read_attributes` reads attributes from a file, and `write_mesh` writes them. You can also
    create attributes yourself, to store your own numbers with vertices or faces.

    Parameters
    ----------
    vertex : mapping of str to array_like, shape (V,) or (V, n), optional
        Properties of the vertices other than x, y and z, by name: one number, or n numbers, per
        vertex. Arrays are copied and made read-only. Bool becomes uint8, and float16 becomes
        float32.
    face : mapping of str to array_like, shape (F,) or (F, n), optional
        Properties of the faces other than their corners.
    comments : sequence of str, optional
        Lines of the PLY header that begin with ``comment`` or ``obj_info``, in their order.
    texture : Texture, optional
        Texture coordinates and materials.
    names : mapping of str to sequence of str, optional
        Names of the values 0, 1, 2, ... of an integer property of the faces, keyed by the name of
        the property: for example names of the groups of an OBJ file, or of the solids of an STL
        file.
    declared : mapping of str to str, optional
        Items that a file declares, such as elements, properties, arrays, materials, poses and cells
        of other kinds. The value says where an item is stored: in "cells", "attributes" or
        "texture". Otherwise it is the reason why the item is left out, which may be empty.
    records : array_like of bool, shape (R,), optional
        Whether each record of a point cloud file is a point of the cloud. By default, all records
        are points. Records without a position are not.
    header : object, optional
        Further data of the file that was read, for the writer of the same format: for LAS the
        version, point format, quantization, coordinate reference system and extra dimensions.

    Raises
    ------
    ValueError
        If a name is not one line of printable text, if an array does not have one or two
        dimensions, or if a comment is not one line that begins with ``comment`` or ``obj_info``.
    TypeError
        If an array does not contain real numbers, if `vertex` or `face` is not a mapping, or if
        ``texture`` is not a `Texture`.

    Examples
    --------
    >>> attributes = MeshAttributes(face={"is steep": [True, False]}, comments=["comment by hand"])
    >>> attributes
    MeshAttributes(vertex: none; face: is steep; 1 comment)
    >>> attributes.face["is steep"].dtype
    dtype('uint8')
    """

    vertex: Mapping[str, Array] = field(default_factory=dict)
    face: Mapping[str, Array] = field(default_factory=dict)
    comments: tuple[str, ...] = ()
    texture: Texture | None = None
    names: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    declared: Mapping[str, str] = field(default_factory=dict)
    records: Bools | None = None
    header: Any = None

    def __post_init__(self) -> None:
        for owner in ("vertex", "face"):
            given: Mapping[str, Any] = getattr(self, owner)
            if not isinstance(given, Mapping):
                raise TypeError(f"{owner} must be a mapping of names to arrays, got {type(given)}")
            checked = {name: _checked(values, name, owner) for name, values in given.items()}
            object.__setattr__(self, owner, MappingProxyType(checked))
        object.__setattr__(self, "comments", tuple(map(_checked_comment, self.comments)))
        for owner in ("names", "declared"):
            object.__setattr__(self, owner, MappingProxyType({**getattr(self, owner)}))
        texture_class = "superfacets_textures.textures:Texture"
        if self.texture is not None and not isinstance(self.texture, load(texture_class)):
            raise TypeError(f"texture must be a Texture, got {type(self.texture).__name__}")

    @property
    def left_out(self) -> tuple[str, ...]:
        """Declared items that are neither in the cells nor in the attributes, and the reasons."""
        return self.fates["left_out"]

    @property
    def fates(self) -> dict[str, tuple[str, ...]]:
        """Declared items, keyed by value in `declared`; other items have the key `left_out`."""
        rest = tuple(
            f"{item}, {fate}" if fate else item
            for item, fate in self.declared.items()
            if fate not in TAKEN
        )
        taken = {
            fate: tuple(item for item, became in self.declared.items() if became == fate)
            for fate in TAKEN
        }
        return {**taken, "left_out": rest}

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
            if stored.keys() >= {*COLORS} and have_region_colors(stored) == are_of_regions:
                return _bytes_of(np.column_stack([stored[name] for name in COLORS])[:, :3])
        return None

    def as_in_ply(self) -> tuple[MeshAttributes, list[str]]:
        """Return attributes with names and types of PLY, and a list of what is lost.

        Names become words of ASCII, and integers of 64 bits become `narrowed` numbers.
        """
        vertex, face = dict[str, Array](), dict[str, Array]()
        lost, is_new = list[str](), False
        for owner, stored, kept in ("vertex", self.vertex, vertex), ("face", self.face, face):
            for name, values in stored.items():
                item, word = f"{owner} property {name}", "_".join(name.split())
                plain = narrowed(values)
                is_new |= plain is not values
                if not word.isascii() or word in {*stored, *kept} - {name}:
                    lost.append(item)
                    continue
                kept[word] = plain
                lost += [f"{item} by this name, but as {word}"] * (word != name)
                is_rounded = plain.dtype.kind == "f" != values.dtype.kind
                lost += [f"{item} as integers, but as float64"] * is_rounded
        return (replace(self, vertex=vertex, face=face) if is_new or lost else self), lost

    def without_region_colors(self) -> MeshAttributes:
        """Return attributes without `region_colors` of faces, alpha and quality."""
        if not have_region_colors(self.face):
            return self
        own = {*COLORS, "alpha", "quality"}
        return replace(self, face={n: each for n, each in self.face.items() if n not in own})

    @staticmethod
    def as_words(names: Sequence[str], ending: str) -> list[str]:
        """Return names as words for a format; names that differ stay different.

        Spaces become underscores, and a number is appended if two names would become the same.
        """
        # In OBJ, "#" begins a comment, and a backslash joins two lines.
        table = str.maketrans("#\\", "__" if ending == ".obj" else "#\\")
        words = {name: "_".join(name.translate(table).split()) or "unnamed" for name in names}
        taken = {word for name, word in words.items() if word == name}
        for name, word in words.items():
            n = 1
            while words[name] != name and words[name] in taken:
                n += 1
                words[name] = f"{word}_{n}"
            taken.add(words[name])
        return [words[name] for name in names]

    def __reduce__(self) -> tuple[type[MeshAttributes], tuple[Any, ...]]:
        others = dict(self.names), dict(self.declared), self.records, self.header
        stored = dict(self.vertex), dict(self.face), self.comments, self.texture
        return MeshAttributes, (*stored, *others)

    def __repr__(self) -> str:
        vertex, face = (", ".join(names) or "none" for names in (self.vertex, self.face))
        texture = "" if self.texture is None else f"; {self.texture}"
        comments = counted(len(self.comments), "comment")
        return f"MeshAttributes(vertex: {vertex}; face: {face}; {comments}{texture})"


def stored_colors(cells: Any, attributes: MeshAttributes | None) -> Bytes | None:
    """Return red, green and blue to show for each cell or vertex, or None if there are no colors.

    Files of point clouds store black for missing colors, so None is also returned if all colors of
    a cloud are black. For the range of colors in a file, see `MeshAttributes.colors`.
    """
    if not isinstance(cells, PointCloud) or cells.colors is None:
        return None if attributes is None else attributes.colors
    return np.asarray(np.rint(cells.colors * 255), np.uint8) if cells.colors.any() else None


def have_region_colors(stored: Mapping[str, Array]) -> bool:
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
    """Return the values as a read-only (N,) or (N, n) array of integers or floats."""
    what = f"{owner} property {reprlib.repr(name)}"
    if not is_name(name):
        raise ValueError(f"{what}: the name must be one line of printable text")
    refuse_mask(values, what)
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{what} must be real numbers, got {array.dtype}")
    if array.ndim not in (1, 2):
        raise ValueError(f"{what} must have one or two dimensions, got shape {array.shape}")
    others = {"?": np.uint8, "e": np.float32, "g": np.float64}  # bool, float16, long double
    stored = owned(array, others.get(array.dtype.char, array.dtype.newbyteorder("=")))
    stored.flags.writeable = False
    return stored


def is_image(comment: str) -> bool:
    """Return whether a comment of a PLY file has the name of an image."""
    return comment.startswith(IMAGE_COMMENT)


def images_in(comments: Sequence[str]) -> list[str]:
    """Return the names of images in the comments of a PLY file."""
    found = [line[len(IMAGE_COMMENT) :].strip() for line in comments if is_image(line)]
    return [name for name in found if name]


def is_name(name: object) -> bool:
    """Return whether an object can be the name of a property: one line of printable text."""
    return isinstance(name, str) and name.isprintable() and bool(name.strip())


def found_name(stored: Mapping[str, Array], name: str) -> str:
    """Return the name in `stored` that equals `name` except for spaces, or else `name`."""
    words = {"_".join(key.split()): key for key in stored}
    return name if name in stored else words.get("_".join(name.split()), name)


def _checked_comment(line: object) -> str:
    is_line = isinstance(line, str) and not re.search("[\n\r\ud800-\udfff]", line)
    if not is_line or str(line).split(" ")[0] not in ("comment", "obj_info"):
        raise ValueError(
            f"comments must be lines that begin with comment or obj_info, got {reprlib.repr(line)}"
        )
    return str(line)
