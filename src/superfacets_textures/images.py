"""Find the texture images of a mesh, in its folder or inside its file, and decode them."""

from __future__ import annotations

import contextlib
import io
import re
import reprlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Bytes, file_beside, import_extra, open_regular, read_content, shortened

MAX_PIXELS = 1 << 28
"""Maximum number of pixels of an image, 16,384 x 16,384."""

ALWAYS_ALLOWED_PIXELS = 1 << 24
MAX_PIXELS_PER_BYTE = 1032
"""Maximum number of pixels per byte of the file, for images with more than `ALWAYS_ALLOWED_PIXELS`.
This is the maximum compression ratio of deflate, which PNG uses."""

_PLUGINS = {"png": "Png", "jpeg": "Jpeg", "webp": "WebP", "bmp": "Bmp", "tiff": "Tiff",
            "tga": "Tga"}  # fmt: skip
"""Names of Pillow's readers, keyed by image format. The readers are called directly, because
`PIL.Image.open` refuses images with more than 179 million pixels."""

_MAGIC = {
    "png": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "jpeg": re.compile(rb"\xff\xd8\xff"),
    "webp": re.compile(rb"RIFF....WEBP", re.DOTALL),
    "bmp": re.compile(rb"BM.{12}[\x0c-\x7f]\0\0\0", re.DOTALL),
    "tiff": re.compile(rb"II\*\0|MM\0\*"),
    "ktx2": re.compile(rb"\xabKTX 20\xbb\r\n\x1a\n"),
    # TGA has no signature. Expect a known image type, and no color map or a color map with 24 or 32
    # bits per entry.
    "tga": re.compile(
        rb".(\0[\x02\x03\x0a\x0b]\0\0\0\0\0|\x01[\x01\x09]....[\x18\x20])", re.DOTALL
    ),
}
"""Pattern of the first bytes of each image format. The least specific pattern is last."""

UNKNOWN = "has an unknown format"

ENDING_OF_IMAGE = {kind: f".{kind}" for kind in _PLUGINS} | {"jpeg": ".jpg", "tiff": ".tif"}


def kind_of_image(content: bytes) -> str | None:
    """Return the format of an image, determined by its first bytes, or None if it is unknown."""
    return next((kind for kind, magic in _MAGIC.items() if magic.match(content)), None)


@dataclass(frozen=True, eq=False)
class TextureImage:
    """Image of a texture, which is read and decoded on demand.

    Parameters
    ----------
    name : str
        Name of the image, used in messages and in the file names of copies of the image.
    path : path-like, optional
        File of the image.
    content : bytes, optional
        Encoded image, if it is stored in the file of the mesh.
    problem : str, optional
        Reason why the image cannot be used, for example ``"is missing"``.
    """

    name: str
    path: Path | None = None
    content: bytes | None = field(default=None, repr=False)
    problem: str | None = None

    def encoded(self) -> bytes:
        """Return the encoded image; raise a MeshError if it is unreadable or of unknown format."""
        problem, content = self.problem, self.content or b""
        if problem is None and self.path is not None:
            try:
                content = read_content(self.path)[:]
            except (OSError, MeshError):
                problem = "cannot be read"
        if problem is not None:
            raise MeshError(f"the image {self._shown} {problem}")
        if kind_of_image(content) is None:
            raise MeshError(f"the image {self._shown} {UNKNOWN}")
        return content

    def size(self) -> tuple[int, int]:
        """Return the width and height of the image in pixels, without decoding the pixels."""
        size: tuple[int, int] = self._open(self.encoded()).size
        return size

    def pixels(self) -> Bytes:
        """Return red, green and blue of all pixels, uint8, shape (height, width, 3).

        The first row is the top row. Transparency is ignored.

        Raises
        ------
        MeshError
            If the image is missing or damaged; if its format is not PNG, JPEG, WebP, BMP, TIFF or
            TGA; or if it has more than 2**28 pixels, or both more than 2**24 pixels and more than
            1,032 pixels per byte of its file.
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
        """Open the image with Pillow, which reads only its header, and check the declared size."""
        kind = kind_of_image(content)
        if kind == "ktx2":
            raise MeshError(f"the image {self._shown} is KTX2: convert it to PNG or JPEG")
        name = _PLUGINS[kind or ""]
        reader = getattr(import_pillow(f"{name}ImagePlugin"), f"{name}ImageFile")
        with _reading(self._shown):
            image = reader(io.BytesIO(content))
        check_pixels(f"the image {self._shown}", image.size, len(content))
        return image


def check_pixels(name: str, size: tuple[int, int], n_bytes: int) -> None:
    """Raise a MeshError if an image of `n_bytes` bytes declares more pixels than it can have."""
    most = min(max(ALWAYS_ALLOWED_PIXELS, MAX_PIXELS_PER_BYTE * n_bytes), MAX_PIXELS)
    if size[0] * size[1] > most:
        raise MeshError(
            f"{name} declares {size[0]} x {size[1]} pixels, but at most {most} are allowed for its"
            f" {n_bytes} bytes"
        )


@contextlib.contextmanager
def _reading(name: str) -> Iterator[None]:
    """Convert any exception of Pillow to a MeshError with the name of the image."""
    try:
        yield
    except Exception as error:
        why = shortened(str(error)) or type(error).__name__
        raise MeshError(f"the image {name} is damaged: {why}") from None


def import_pillow(module: str) -> Any:
    """Return a module of Pillow, or raise a MissingExtraError if Pillow is not installed."""
    return import_extra(f"PIL.{module}", "reading of textures", "texture")


def image_beside(name: str, folder: Path | None) -> TextureImage:
    """Return the image at a path relative to `folder`, with `problem` set if it cannot be used."""
    problem: str | None = "is not in the folder of the mesh"
    try:
        if (path := file_beside(name, folder)) is not None:
            problem = _problem_with(path)
    except (OSError, ValueError):
        path = None
    return TextureImage(name, path if problem is None else None, problem=problem)


def _problem_with(path: Path) -> str | None:
    """Return the reason why the file cannot be used as an image, or None if it can be used."""
    if not path.is_file():
        return "is missing"
    with open_regular(path) as file:
        return None if kind_of_image(file.read(64) or b"") else UNKNOWN


def problems_of(images: Sequence[TextureImage]) -> list[str]:
    """Return a description of each image that cannot be used, without duplicates."""
    found = [f"image {image._shown}, which {image.problem}" for image in images if image.problem]
    return list(dict.fromkeys(found))
