"""Rendered meshes: a PNG each, drawn anew only if its labels changed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ...errors import reason_of
from ...io.atomic import atomic_outputs
from ...pictures.rendering import render
from ..sources import load
from ..tasks import Key
from .gallery import Picture, view_of
from .measure import unpack_labels

_SIZE = (640, 480)

_LOOK = 1  # raised when pictures of the same labels are to look different

# Name of the text inside a PNG that says what it was made from.
_KEY = "superfacets"


@dataclass(frozen=True)
class Drawing:
    """A picture to be drawn, by a worker."""

    picture: Picture
    labels: str
    """As the record has them."""
    key: str
    folder: Path
    memory: int = 0

    @classmethod
    def of(cls, picture: Picture, key: Key, labels: str, folder: Path) -> Drawing:
        """Return the drawing of a picture whose run is done: its key, and its labels, packed."""
        made_from = [key, labels, _SIZE, _LOOK]
        digest = hashlib.blake2b(json.dumps(made_from).encode(), digest_size=16).hexdigest()
        return cls(picture, labels, digest, folder)

    def run(self) -> str | None:
        """Draw; return why that failed, if it did."""
        try:
            mesh, _ = load(self.picture.run.source)
            pixels = render(
                mesh,
                unpack_labels(self.labels),
                size=_SIZE,
                view=view_of(mesh),
            )
            _write(picture_path(self.folder, self.picture), pixels, self.key)
        except Exception as error:  # it is named, and the others are drawn
            return reason_of(error)
        return None


def picture_path(folder: Path, picture: Picture) -> Path:
    """Return where a picture lies."""
    return folder / f"{picture.name}.png"


def is_drawn(drawing: Drawing) -> bool:
    """Whether the picture is there, made from these labels."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(picture_path(drawing.folder, drawing.picture)) as image:
            image.load()
            return bool(image.info.get(_KEY) == drawing.key)
    except (OSError, SyntaxError, UnidentifiedImageError):
        return False


def _write(path: Path, pixels: npt.NDArray[np.uint8], key: str) -> None:
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    text = PngInfo()
    text.add_text(_KEY, key)
    with atomic_outputs([path]) as (partial,):
        Image.fromarray(pixels).save(partial, format="PNG", pnginfo=text, optimize=True)
