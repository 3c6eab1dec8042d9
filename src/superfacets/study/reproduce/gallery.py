"""Which pictures are made: like the paper's Figures 1, 2, 3 and 8, with the same settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ...mesh.faces import FaceMesh
from ...pictures.camera import View
from ..sources import Source
from .methods import METHODS
from .runs import Run

TABLE_METHODS = ("default", "superfacets", "paper")
"""Methods in Table 1."""

_ALPHA = 200.0

# Categories whose smallest models are shown; where they are missing, others take their place.
_ALPHA_CATEGORIES = ("Fourleg", "Hand")
_CUTS_CATEGORIES = ("Human", "Airplane", "Plier", "Bird")
_VSA_CATEGORIES = ("Human", "Cup", "Mech", "Fourleg")

# What rivals are shown above: the paper's method, and what it has become.
_OURS = (("superfacets", _ALPHA), ("default", METHODS["default"].usual_alpha))

_VSA = ("vsa-l21-r", "vsa-l21-i", "vsa-l2-r", "vsa-l2-i")


@dataclass(frozen=True)
class Picture:
    """One rendered mesh, and its place in a figure."""

    figure: str
    row: str
    column: str
    run: Run

    @property
    def name(self) -> str:
        """The file's name, without ending."""
        alpha = "" if self.run.alpha is None else f"-alpha{self.run.alpha:g}"
        return f"fig{self.figure}-{self.run.source.name}-{self.run.method}{alpha}-k{self.run.k}"


def view_of(mesh: FaceMesh) -> View:
    """Return the view of a mesh: its broad side, as the orientation of models varies.

    The models of the benchmark have no common axis that points up.
    """
    x, y, z = mesh.bounds[1] - mesh.bounds[0]
    if y <= min(x, z):
        return View(azimuth=20, elevation=60, up="y")
    if x < z:
        return View(azimuth=65, up="z" if z > 2 * y else "y")
    return View(azimuth=25, up="y")


def _large_meshes(models: tuple[Source, ...], meshes: tuple[Source, ...], k: int) -> list[Picture]:
    """Figure 1: the meshes that the user has."""
    return [Picture("1", "", mesh.name, Run(mesh, "superfacets", _ALPHA, k)) for mesh in meshes]


def table_runs(meshes: tuple[Source, ...], k: int) -> list[Run]:
    """Return the runs whose times Table 1 tells."""
    return [
        Run(mesh, method, METHODS[method].usual_alpha, k)
        for mesh in meshes
        for method in TABLE_METHODS
    ]


def _three_alphas(models: tuple[Source, ...], meshes: tuple[Source, ...], k: int) -> list[Picture]:
    """Figure 2: what alpha does."""
    return [
        Picture("2", f"alpha = {alpha:g}", _title(model), Run(model, "superfacets", alpha, k))
        for alpha in (0.0, 200.0, 1000.0)
        for model in _shown(models, _ALPHA_CATEGORIES)
    ]


def _cuts_and_ours(models: tuple[Source, ...], meshes: tuple[Source, ...], k: int) -> list[Picture]:
    """Figure 3: normalized cuts above ours."""
    return [
        Picture("3", METHODS[method].title, _title(model), Run(model, method, alpha, k))
        for method, alpha in (("ncuts", _ALPHA), ("ncuts-sparse", _ALPHA), *_OURS)
        for model in _shown(models, _CUTS_CATEGORIES)
    ]


def _vsa_and_ours(models: tuple[Source, ...], meshes: tuple[Source, ...], k: int) -> list[Picture]:
    """Figure 8: the four variants of VSA above ours."""
    return [
        Picture("8", METHODS[method].title, _title(model), Run(model, method, alpha, k))
        for method, alpha in (*((vsa, None) for vsa in _VSA), *_OURS)
        for model in _shown(models, _VSA_CATEGORIES)
    ]


def _shown(models: tuple[Source, ...], categories: tuple[str, ...]) -> list[Source]:
    """Return the smallest model of each category, and of others where one has none."""
    smallest: dict[str, Source] = {}
    for model in models:
        smallest.setdefault(model.category, model)
    wanted = [smallest.pop(name) for name in categories if name in smallest]
    return [*wanted, *smallest.values()][: len(categories)]


def _title(model: Source) -> str:
    return f"{model.name} ({model.category})"


GALLERY: Mapping[str, Callable[[tuple[Source, ...], tuple[Source, ...], int], list[Picture]]] = (
    MappingProxyType(
        {"1": _large_meshes, "2": _three_alphas, "3": _cuts_and_ours, "8": _vsa_and_ours}
    )
)
"""From the number of a figure to its pictures, row by row."""
