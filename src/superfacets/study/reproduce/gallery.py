"""Draw pictures like the paper's Figures 1, 2, 3 and 8. Pictures of unchanged labels are kept."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..._types import Bytes
from ...errors import reason_of
from ...io.atomic import atomic_outputs
from ...mesh.faces import FaceMesh
from ...pictures.camera import View
from ...pictures.rendering import render
from ..sources import Source, load
from ..tasks import Key
from .measure import Run, unpack_labels
from .methods import METHODS

TABLE_METHODS = ("default", "superfacets", "paper")  # methods in Table 1

_ALPHA = 200.0

# Categories whose smallest models are shown. Another category replaces a category without models.
_ALPHA_CATEGORIES = ("Fourleg", "Hand")
_CUTS_CATEGORIES = ("Human", "Airplane", "Plier", "Bird")
_VSA_CATEGORIES = ("Human", "Cup", "Mech", "Fourleg")

# Methods and alphas of the last rows: the paper's method with exact regions, and the default.
_OURS = (("superfacets", _ALPHA), ("default", METHODS["default"].usual_alpha))

_VSA = ("vsa-l21-r", "vsa-l21-i", "vsa-l2-r", "vsa-l2-i")


@dataclass(frozen=True)
class Picture:
    """A picture of a mesh with its regions, and its row and column in a figure."""

    figure: str
    row: str
    column: str
    run: Run

    @property
    def name(self) -> str:
        """File name without the ending."""
        alpha = "" if self.run.alpha is None else f"-alpha{self.run.alpha:g}"
        return f"fig{self.figure}-{self.run.source.name}-{self.run.method}{alpha}-k{self.run.k}"


def view_of(mesh: FaceMesh) -> View:
    """Return a view of the broad side of a mesh, because models have no common up axis."""
    x, y, z = mesh.bounds[1] - mesh.bounds[0]
    if y <= min(x, z):
        return View(azimuth=20, elevation=60, up="y")
    if x < z:
        return View(azimuth=65, up="z" if z > 2 * y else "y")
    return View(azimuth=25, up="y")


def table_runs(meshes: tuple[Source, ...], k: int) -> list[Run]:
    """Return the runs whose times are in Table 1."""
    return [
        Run(mesh, method, METHODS[method].usual_alpha, k)
        for mesh in meshes
        for method in TABLE_METHODS
    ]


def _shown(models: tuple[Source, ...], categories: tuple[str, ...]) -> list[Source]:
    """Return the smallest model of each category; other categories replace missing categories."""
    smallest: dict[str, Source] = {}
    for model in models:
        smallest.setdefault(model.category, model)
    wanted = [smallest.pop(name) for name in categories if name in smallest]
    return [*wanted, *smallest.values()][: len(categories)]


_ROWS: Mapping[str, tuple[tuple[tuple[str, float | None], ...], tuple[str, ...]]] = {
    "2": (tuple(("superfacets", alpha) for alpha in (0.0, 200.0, 1000.0)), _ALPHA_CATEGORIES),
    "3": ((("ncuts", _ALPHA), ("ncuts-sparse", _ALPHA), *_OURS), _CUTS_CATEGORIES),
    "8": ((*((vsa, None) for vsa in _VSA), *_OURS), _VSA_CATEGORIES),
}
"""For each figure with models: method and alpha of each row, and category of each column."""

GALLERY = ("1", *_ROWS)
"""Figures with pictures: large meshes, effect of alpha, normalized cuts, and variants of VSA."""


def pictures_of(
    figure: str, models: tuple[Source, ...], meshes: tuple[Source, ...], k: int
) -> list[Picture]:
    """Return the pictures of a figure, row by row."""
    if figure == "1":
        return [Picture("1", "", mesh.name, Run(mesh, "superfacets", _ALPHA, k)) for mesh in meshes]
    rows, categories = _ROWS[figure]
    return [
        Picture(
            figure, f"alpha = {alpha:g}" if figure == "2" else METHODS[method].title,
            f"{model.name} ({model.category})", Run(model, method, alpha, k),
        )
        for method, alpha in rows
        for model in _shown(models, categories)
    ]  # fmt: skip


_SIZE = (640, 480)

_LOOK = 1  # version of the style; pictures of another version are drawn again

_KEY = "superfacets"  # name of the text entry of a PNG file that identifies the input


@dataclass(frozen=True)
class Drawing:
    """A job for a worker, which draws one picture."""

    picture: Picture
    labels: str  # labels as packed by `pack_labels`
    key: str
    folder: Path
    memory: int = 0

    @classmethod
    def of(cls, picture: Picture, key: Key, labels: str, folder: Path) -> Drawing:
        """Return the drawing of a picture, given the key and the packed labels of its run."""
        made_from = [key, labels, _SIZE, _LOOK]
        digest = hashlib.blake2b(json.dumps(made_from).encode(), digest_size=16).hexdigest()
        return cls(picture, labels, digest, folder)

    def run(self) -> str | None:
        """Draw and write the picture; return the reason if this fails, otherwise None."""
        try:
            mesh, _ = load(self.picture.run.source)
            pixels = render(mesh, unpack_labels(self.labels), size=_SIZE, view=view_of(mesh))
            _write(picture_path(self.folder, self.picture), pixels, self.key)
        except Exception as error:  # any error is reported, and other pictures are drawn
            return reason_of(error)
        return None


def picture_path(folder: Path, picture: Picture) -> Path:
    """Return the path of a picture."""
    return folder / f"{picture.name}.png"


def is_drawn(drawing: Drawing) -> bool:
    """Whether the picture exists and shows the current labels."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(picture_path(drawing.folder, drawing.picture)) as image:
            image.load()
            return bool(image.info.get(_KEY) == drawing.key)
    except (OSError, SyntaxError, UnidentifiedImageError):
        return False


def _write(path: Path, pixels: Bytes, key: str) -> None:
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    text = PngInfo()
    text.add_text(_KEY, key)
    with atomic_outputs([path]) as (partial,):
        Image.fromarray(pixels).save(partial, format="PNG", pnginfo=text, optimize=True)
