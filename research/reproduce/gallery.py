"""Draw pictures like Figures 1, 2, 3 and 8 of the paper; unchanged pictures are not redrawn."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from superfacets import plot
from superfacets.base.errors import reason_of
from superfacets.base.types import Bytes
from superfacets.files.atomic import atomic_outputs
from superfacets.mesh.faces import FaceMesh
from superfacets_show.camera import View

from ..sources import StudyMesh, load
from ..tasks import Key
from .measure import Run, unpack_labels
from .methods import METHODS

TABLE_METHODS = ("default", "superfacets", "paper")  # methods whose times Table 1 lists

_ALPHA = 200.0

# Categories whose smallest models Figures 2, 3 and 8 show. A category without models is replaced by
# another category.
_ALPHA_CATEGORIES = ("Fourleg", "Hand")
_CUTS_CATEGORIES = ("Human", "Airplane", "Plier", "Bird")
_VSA_CATEGORIES = ("Human", "Cup", "Mech", "Fourleg")

# Methods and alphas of the last two rows of Figures 3 and 8: the weights and seeds of the paper in
# exact mode, and the default.
_OURS = (("superfacets", _ALPHA), ("default", METHODS["default"].usual_alpha))

_VSA = ("vsa-l21-r", "vsa-l21-i", "vsa-l2-r", "vsa-l2-i")


@dataclass(frozen=True)
class Picture:
    """A picture of the regions of a run, and its row and column in a figure."""

    figure: str
    row: str
    column: str
    run: Run

    @property
    def name(self) -> str:
        """File name of the picture without the ending."""
        alpha = "" if self.run.alpha is None else f"-alpha{self.run.alpha:g}"
        return f"fig{self.figure}-{self.run.source.name}-{self.run.method}{alpha}-k{self.run.k}"


def view_of(mesh: FaceMesh) -> View:
    """Return a view of the broad side of a mesh. Models of the benchmark have no common up axis."""
    x, y, z = mesh.bounds[1] - mesh.bounds[0]
    if y <= min(x, z):
        return View(azimuth=20, elevation=60, up="y")
    if x < z:
        return View(azimuth=65, up="z" if z > 2 * y else "y")
    return View(azimuth=25, up="y")


def table_runs(meshes: tuple[StudyMesh, ...], k: int) -> list[Run]:
    """Return the runs whose times are listed in Table 1."""
    return [
        Run(mesh, method, METHODS[method].usual_alpha, k)
        for mesh in meshes
        for method in TABLE_METHODS
    ]


def _shown(models: tuple[StudyMesh, ...], categories: tuple[str, ...]) -> list[StudyMesh]:
    """Return the smallest model of each category. `models` are sorted by size.

    A category without models is replaced by the category of the smallest other model.
    """
    smallest: dict[str, StudyMesh] = {}
    for model in models:
        smallest.setdefault(model.category, model)
    wanted = [smallest.pop(name) for name in categories if name in smallest]
    return [*wanted, *smallest.values()][: len(categories)]


_ROWS: Mapping[str, tuple[tuple[tuple[str, float | None], ...], tuple[str, ...]]] = {
    "2": (tuple(("superfacets", alpha) for alpha in (0.0, 200.0, 1000.0)), _ALPHA_CATEGORIES),
    "3": ((("ncuts", _ALPHA), ("ncuts-sparse", _ALPHA), *_OURS), _CUTS_CATEGORIES),
    "8": ((*((vsa, None) for vsa in _VSA), *_OURS), _VSA_CATEGORIES),
}
"""Rows and columns of Figures 2, 3 and 8: (method, alpha) of each row, category of each column."""

GALLERY = ("1", *_ROWS)
"""Figures that consist of pictures: 1 shows large meshes, 2 the effect of alpha, 3 normalized cuts,
and 8 variants of VSA (variational shape approximation)."""


def pictures_of(
    figure: str, models: tuple[StudyMesh, ...], meshes: tuple[StudyMesh, ...], k: int
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

_LOOK = 1  # version of the style; if it changes, all pictures are drawn again

_KEY = "superfacets"  # name of the text entry in PNG files that stores `Drawing.key`


@dataclass(frozen=True)
class Drawing:
    """A job for a worker process: draw one picture."""

    picture: Picture
    labels: str  # labels, encoded by `pack_labels`
    key: str  # hash of everything that the picture depends on
    folder: Path
    memory: int = 0

    @classmethod
    def of(cls, picture: Picture, key: Key, labels: str, folder: Path) -> Drawing:
        """Make the job for a picture from the key and the packed labels of its run."""
        made_from = [key, labels, _SIZE, _LOOK]
        digest = hashlib.blake2b(json.dumps(made_from).encode(), digest_size=16).hexdigest()
        return cls(picture, labels, digest, folder)

    def run(self) -> str | None:
        """Draw and write the picture; return None, or the reason if this fails."""
        try:
            mesh, _ = load(self.picture.run.source)
            pixels = plot(mesh, unpack_labels(self.labels), size=_SIZE, view=view_of(mesh)).image
            _write(picture_path(self.folder, self.picture), pixels, self.key)
        except Exception as error:  # returned, so that the other pictures are drawn
            return reason_of(error)
        return None


def picture_path(folder: Path, picture: Picture) -> Path:
    """Return the path of the PNG file of a picture."""
    return folder / f"{picture.name}.png"


def is_drawn(drawing: Drawing) -> bool:
    """Return whether the picture exists and shows the current labels in the current style."""
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
