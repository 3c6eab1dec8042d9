"""Textures: coordinates of corners, and materials of faces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Array, Floats, Ints
from .._validate import freeze, owned, refuse_mask
from .guards import counted
from .images import TextureImage

WRAPS = ("repeat", "clamp", "mirror")
"""How an image continues outside of [0, 1]; the core numbers these ways in this order."""


@dataclass(frozen=True, eq=False)
class MaterialSource:
    """The full description of a material in its file, for output in the same format.

    In the text of MTL, an index between zero bytes replaces the name of an image. In the JSON of
    glTF, ``index`` is the index of an image and of its sampler.
    """

    format: str  # "mtl" or "gltf"
    text: str
    images: tuple[TextureImage, ...] = ()
    samplers: tuple[str, ...] = ()  # of glTF, as JSON, one per image


def with_textures(value: Any, convert: Callable[[str, dict[str, Any]], Any]) -> Any:
    """Copy the JSON of a glTF material with converted references to textures; None removes one."""
    if isinstance(value, list):
        return [with_textures(each, convert) for each in value]
    if not isinstance(value, dict):
        return value
    kept: dict[str, Any] = {}
    for key, each in value.items():
        if not (key.endswith("Texture") and isinstance(each, dict) and "index" in each):
            kept[key] = with_textures(each, convert)
        elif (converted := convert(key, each)) is not None:
            kept[key] = converted
    return kept


@dataclass(frozen=True, eq=False)
class Material:
    """A material: an image, or one color.

    Parameters
    ----------
    name : str
    color : tuple of three floats
        Red, green and blue in linear light, 0 to 1. The colors of the image are multiplied by them.
    image : TextureImage, optional
    wrap : tuple of two str
        How the image continues for u and v outside of [0, 1]: ``"repeat"``, ``"clamp"`` or
        ``"mirror"``.
    source : MaterialSource, optional
        The full description of the material in its file.
    """

    name: str = ""
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    image: TextureImage | None = None
    wrap: tuple[str, str] = ("repeat", "repeat")
    source: MaterialSource | None = None

    def __post_init__(self) -> None:
        if not {*self.wrap} <= {*WRAPS} or len(self.wrap) != 2:
            raise ValueError(f"wrap must be two of {', '.join(WRAPS)}, got {self.wrap!r}")


@dataclass(frozen=True, eq=False)
class Texture:
    """Texture coordinates of the corners of faces, and the materials of faces.

    `read_attributes` reads textures from a file, and `write_mesh` writes them.

    Parameters
    ----------
    coordinates : array_like, shape (T, 2)
        Pairs u, v. In [0, 1], u goes from the left to the right side of the image, and v from its
        lower to its upper side.
    corners : array_like of integers, shape (C,)
        Index of a pair for each corner of each face, one face after the other; -1 for no pair.
    materials : sequence of Material
    face_materials : array_like of integers, shape (F,)
        Index of a material for each face; -1 for no material.
    libraries : sequence of path-like, optional
        MTL files that describe these materials.
    format : str, optional
        ``"ply"`` if the attributes of a PLY file also hold the coordinates.

    Raises
    ------
    ValueError
        If a shape is wrong or an index is out of range.

    Examples
    --------
    >>> wall = TextureImage("wall.png", Path("wall.png"))
    >>> Texture([[0, 0], [1, 0], [0, 1]], [0, 1, 2], [Material("wall", image=wall)], [0])
    Texture(3 coordinates; 1 material, 1 image)
    """

    coordinates: Floats
    corners: Ints
    materials: Sequence[Material]
    face_materials: Ints
    libraries: Sequence[Path] = ()
    format: str = ""

    def __post_init__(self) -> None:
        coordinates = owned(_numbers(self.coordinates, "coordinates", "iuf"), np.float64)
        if coordinates.ndim != 2 or coordinates.shape[1] != 2:
            raise ValueError(f"coordinates must have shape (T, 2), got {coordinates.shape}")
        corners = _indices(self.corners, "corners", len(coordinates))
        face_materials = _indices(self.face_materials, "face_materials", len(self.materials))
        freeze(self, coordinates=coordinates, corners=corners, face_materials=face_materials)
        object.__setattr__(self, "materials", tuple(self.materials))
        object.__setattr__(self, "libraries", tuple(map(Path, self.libraries)))

    def __reduce__(self) -> tuple[type[Texture], tuple[Any, ...]]:
        """Rebuild copies and pickles by the constructor, which checks the values again."""
        arrays = self.coordinates, self.corners, self.materials, self.face_materials
        return Texture, (*arrays, self.libraries, self.format)

    @property
    def is_of_ply(self) -> bool:
        """Whether the attributes of a PLY file also hold the coordinates."""
        return self.format == "ply"

    @property
    def images(self) -> list[TextureImage]:
        """The color images of the materials, each once."""
        images = [material.image for material in self.materials]
        return list(dict.fromkeys(image for image in images if image is not None))

    def __repr__(self) -> str:
        n_coordinates, materials = len(self.coordinates), counted(len(self.materials), "material")
        images = counted(len(self.images), "image")
        return f"Texture({n_coordinates} coordinates; {materials}, {images})"


def _numbers(values: npt.ArrayLike, name: str, kinds: str) -> Array:
    refuse_mask(values, name)
    array = np.asarray(values)
    if array.dtype.kind not in kinds and array.size:
        raise ValueError(f"{name} must be {'integers' if 'f' not in kinds else 'numbers'}")
    return array


def _indices(values: npt.ArrayLike, name: str, count: int) -> Ints:
    array = _numbers(values, name, "iu")
    if array.ndim != 1:
        raise ValueError(f"{name} must have one dimension, got shape {array.shape}")
    if array.size and (array.min() < -1 or array.max() >= count):
        wrong = int(np.argmax((array < -1) | (array >= count)))
        raise ValueError(f"{name}[{wrong}] is {array[wrong]}; it must be -1 to {count - 1}")
    return owned(array, np.int32)
