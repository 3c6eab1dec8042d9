"""Textures of meshes: coordinates of corners, materials, and images, decoded when asked for."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import re
import reprlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Array, Bytes, Floats, Ints
from .._validate import freeze, owned, refuse_mask
from ..errors import MeshError, MissingExtraError
from .guards import open_regular, read_content, shortened

WRAPS = ("repeat", "clamp", "mirror")
"""How coordinates outside of [0, 1] are taken; the core numbers them in this order."""

MAX_PIXELS = 1 << 28
"""Largest number of pixels of an image: 16,384 x 16,384."""

ALWAYS_ALLOWED_PIXELS = 1 << 24
MAX_PIXELS_PER_BYTE = 1032
"""Pixels that an image may have for each byte of its file, if it has more than
`ALWAYS_ALLOWED_PIXELS`: the largest ratio of deflate, the compression of PNG."""

_PLUGINS = {
    "png": ("PngImagePlugin", "PngImageFile"),
    "jpeg": ("JpegImagePlugin", "JpegImageFile"),
    "webp": ("WebPImagePlugin", "WebPImageFile"),
    "bmp": ("BmpImagePlugin", "BmpImageFile"),
    "tiff": ("TiffImagePlugin", "TiffImageFile"),
    "tga": ("TgaImagePlugin", "TgaImageFile"),
}
"""Readers of Pillow. `PIL.Image.open` would refuse images of more than 179 million pixels."""

_MAGIC = {
    "png": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "jpeg": re.compile(rb"\xff\xd8\xff"),
    "webp": re.compile(rb"RIFF....WEBP", re.DOTALL),
    "bmp": re.compile(rb"BM.{12}[\x0c-\x7f]\0\0\0", re.DOTALL),
    "tiff": re.compile(rb"II\*\0|MM\0\*"),
    "ktx2": re.compile(rb"\xabKTX 20\xbb\r\n\x1a\n"),
    # No color map or one of 256 entries, and a known type of image: TGA has no word of its own.
    "tga": re.compile(
        rb".(\0[\x02\x03\x0a\x0b]\0\0\0\0\0|\x01[\x01\x09]....[\x18\x20])", re.DOTALL
    ),
}
"""First bytes of the kinds of images, the most certain first."""

ENDING_OF_IMAGE = {kind: f".{kind}" for kind in _PLUGINS} | {"jpeg": ".jpg", "tiff": ".tif"}


def kind_of_image(content: bytes) -> str | None:
    """Return the kind of image that a file's content begins like, None if it is none."""
    return next((kind for kind, magic in _MAGIC.items() if magic.match(content)), None)


@dataclass(frozen=True, eq=False)
class TextureImage:
    """An image of a texture. It is read and decoded when that is asked for.

    Parameters
    ----------
    name : str
        Name of the image in messages, and in files that it is copied to.
    path : path-like, optional
        The file of the image.
    content : bytes, optional
        The encoded image, if it is in no file of its own.
    problem : str, optional
        Why there is no image: ``"is missing"``.
    """

    name: str
    path: Path | None = None
    content: bytes | None = None
    problem: str | None = None

    def encoded(self) -> bytes:
        """Return the encoded image; a MeshError if it cannot be read or is of no known kind."""
        problem, content = self.problem, self.content or b""
        if problem is None and self.path is not None:
            try:
                content = read_content(self.path)[:]
            except (OSError, MeshError):
                problem = "cannot be read"
        if problem is not None:
            raise MeshError(f"the image {self._shown} {problem}")
        if kind_of_image(content) is None:
            raise MeshError(f"the image {self._shown} is of no known format")
        return content

    def size(self) -> tuple[int, int]:
        """Return width and height, without decoding the pixels."""
        size: tuple[int, int] = self._open(self.encoded()).size
        return size

    def pixels(self) -> Bytes:
        """Return red, green and blue of all pixels, uint8, shape (height, width, 3).

        The first row is the upper one. Transparency is left out.

        Raises
        ------
        MeshError
            If the image is missing, damaged, of another format than PNG, JPEG, WebP, BMP, TIFF and
            TGA, or larger than 2**28 pixels, or than 1,032 pixels for each byte of its file (if
            that is less than 2**24).
        MissingExtraError
            If Pillow is not installed.
        """
        image = self._open(self.encoded())
        with _reading(self._shown):
            if image.mode.startswith("I;16"):
                gray = (np.asarray(image) >> 8).astype(np.uint8)
                return np.repeat(gray[:, :, np.newaxis], 3, axis=2)
            return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))

    @property
    def _shown(self) -> str:
        return reprlib.repr(self.name)

    def _open(self, content: bytes) -> Any:
        """Return the image as one of Pillow, of which only the header is read."""
        kind = kind_of_image(content)
        if kind == "ktx2":
            raise MeshError(f"the image {self._shown} is KTX2: convert it to PNG or JPEG")
        module, name = _PLUGINS[kind or ""]
        reader = getattr(import_pillow(module), name)
        with _reading(self._shown):
            image = reader(io.BytesIO(content))
        width, height = image.size
        most = max(ALWAYS_ALLOWED_PIXELS, MAX_PIXELS_PER_BYTE * len(content))
        if width * height > min(most, MAX_PIXELS):
            raise MeshError(
                f"the image {self._shown} declares {width} x {height} pixels in {len(content)}"
                " bytes, which is too much"
            )
        return image


@contextlib.contextmanager
def _reading(name: str) -> Iterator[None]:
    """Turn errors of Pillow, which are of any class, into a MeshError that names the image."""
    try:
        yield
    except Exception as error:
        why = shortened(str(error)) or type(error).__name__
        raise MeshError(f"the image {name} is damaged: {why}") from None


def import_pillow(module: str, task: str = "reading of textures", extra: str = "texture") -> Any:
    """Return a module of Pillow, or raise a MissingExtraError if Pillow is not installed."""
    try:
        return importlib.import_module(f"PIL.{module}")
    except ModuleNotFoundError:
        raise MissingExtraError(task, extra) from None


@dataclass(frozen=True, eq=False)
class MaterialSource:
    """A material as its file describes it, to be written to a file of the same format.

    In the text of MTL, a number between zero bytes stands for the name of an image; in the JSON of
    glTF, ``index`` is the number of an image and a sampler.
    """

    format: str  # "mtl" or "gltf"
    text: str
    images: tuple[TextureImage, ...] = ()
    samplers: tuple[str, ...] = ()  # of glTF, as JSON, one per image


@dataclass(frozen=True, eq=False)
class Material:
    """A material: an image, or one color.

    Parameters
    ----------
    name : str
    color : tuple of three floats
        Red, green and blue in linear light, 0 to 1. The image is multiplied by them.
    image : TextureImage, optional
    wrap : tuple of two str
        How u and v outside of [0, 1] are taken: ``"repeat"``, ``"clamp"`` or ``"mirror"``.
    source : MaterialSource, optional
        All that the file says about the material.
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

    `read_attributes` reads them from a file, `write_mesh` writes them.

    Parameters
    ----------
    coordinates : array_like, shape (T, 2)
        Pairs u, v. In [0, 1], u goes from the left to the right side of the image, and v from its
        lower to its upper side.
    corners : array_like of integers, shape (C,)
        Index of a pair for each corner of each face, one face after the other; -1: none.
    materials : sequence of Material
    face_materials : array_like of integers, shape (F,)
        Index of a material for each face; -1: none.
    libraries : sequence of path-like, optional
        MTL files that describe these materials.
    format : str, optional
        ``"ply"`` if attributes of a PLY file hold the coordinates as well.

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
        """Whether attributes of a PLY file hold the coordinates as well."""
        return self.format == "ply"

    @property
    def images(self) -> list[TextureImage]:
        """The images of the colors of materials, each once."""
        images = [material.image for material in self.materials]
        return list(dict.fromkeys(image for image in images if image is not None))

    def __repr__(self) -> str:
        counts = [len(self.materials), len(self.images)]
        materials, images = (
            f"{n} {noun}{'s' * (n != 1)}"
            for n, noun in zip(counts, ("material", "image"), strict=True)
        )
        return f"Texture({len(self.coordinates)} coordinates; {materials}, {images})"


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
        raise ValueError(f"{name}[{wrong}] is {array[wrong]}, and there are {count}")
    return owned(array, np.int32)


def file_beside(name: str, folder: Path | None, top: Path | None = None) -> Path | None:
    """The file that a relative path names; None if it is not in `top`, or below it.

    `top` is the folder itself, or a folder above it.

    A file must not be able to name files elsewhere on the machine: ``..`` is applied and symbolic
    links are followed before the path is compared with the folder.
    """
    if folder is None or re.match(r"[\w+.-]*:|[/\\]", name) or "\0" in name:
        return None
    path = Path(os.path.realpath(folder / name))
    return path if path.is_relative_to(os.path.realpath(top or folder)) else None


def image_beside(name: str, folder: Path | None) -> TextureImage:
    """The image with a relative path in a file of `folder`; it may have a problem."""
    try:
        path = file_beside(name, folder)
        problem = None if path is not None else "is not beside the mesh"
        if path is not None:
            problem = _problem_with(path)
    except (OSError, ValueError):
        path, problem = None, "is not beside the mesh"
    return TextureImage(name, path if problem is None else None, problem=problem)


def _problem_with(path: Path) -> str | None:
    """Why a file gives no image, or None. Its first bytes tell: others are not copied."""
    if not path.is_file():
        return "is missing"
    with open_regular(path) as file:
        return None if kind_of_image(file.read(64) or b"") else "is of no known format"


def problems_of(images: Sequence[TextureImage]) -> list[str]:
    """Descriptions of the images that there are not, each once."""
    found = [f"image {image._shown}, which {image.problem}" for image in images if image.problem]
    return list(dict.fromkeys(found))
