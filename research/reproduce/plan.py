"""Plan the runs and pictures that the chosen figures need."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from ..princeton import CATEGORIES
from ..sources import StudyMesh, StudyMeshes
from .gallery import GALLERY, Picture, pictures_of, table_runs
from .measure import Run
from .methods import METHODS

KS = (50, 100, 150, 200, 250, 300)
SUBSET_KS = (50, 150, 300)

CURVES = ("4", "6", "7")  # figures with a curve for each method and alpha

FIGURES = ("1", "2", "3", *CURVES[:1], "5", *CURVES[1:], "8", "rivals")
"""Names of figures: numbers in the paper, and "rivals", an additional figure with a curve for each
method that can process most of the models."""

_USUAL_K = 150  # number of regions in pictures and times of the paper


@dataclass(frozen=True, kw_only=True)
class Choice:
    """Figures, methods and numbers of regions that the user has chosen."""

    figures: tuple[str, ...] = FIGURES
    methods: tuple[str, ...] = tuple(METHODS)
    ks: tuple[int, ...] = KS
    is_subset: bool = False
    """Whether to run only the smallest model of each category, and fewer alphas."""

    @property
    def k(self) -> int:
        """Number of regions for pictures and times: the value in `ks` that is nearest to 150."""
        return min(self.ks, key=lambda k: (abs(k - _USUAL_K), k))

    def alphas(self, method: str) -> tuple[float | None, ...]:
        """Return all values of alpha for which a method is run."""
        row = METHODS[method]
        return row.subset_alphas if self.is_subset else row.alphas

    def methods_in(self, figure: str) -> tuple[str, ...]:
        """Return the methods that have curves or dots in a figure."""
        return tuple(name for name in self.methods if figure in METHODS[name].figures)

    def curves_in(self, figure: str) -> list[tuple[str, float | None]]:
        """Return the method and alpha of each curve in a figure."""
        return [
            (name, alpha)
            for name in self.methods_in(figure)
            for alpha in (self.alphas(name) if figure in CURVES else (METHODS[name].usual_alpha,))
        ]


@dataclass(frozen=True)
class RunPlan:
    """All runs and pictures that the chosen figures need."""

    choice: Choice
    models: tuple[StudyMesh, ...]
    meshes: tuple[StudyMesh, ...]
    runs: tuple[Run, ...]
    """Distinct runs, in order: meshes of the user, then models by rank in their category."""
    pictures: tuple[Picture, ...]
    problems: tuple[str, ...]  # one message per file that is missing or not used


def make_plan(models: StudyMeshes, meshes: StudyMeshes, choice: Choice) -> RunPlan:
    """Plan runs and pictures for the chosen figures; raise a ValueError if these need no run."""
    ranks = _ranks(models.found)
    chosen = tuple(m for m in models.found if not choice.is_subset or ranks[m] == 0)
    pictures = tuple(
        picture
        for figure in choice.figures
        if figure in GALLERY
        for picture in pictures_of(figure, chosen, meshes.found, choice.k)
        if picture.run.method in choice.methods and _accepts(picture.run, ranks, choice)
    )
    runs = {picture.run for picture in pictures}
    runs |= {run for run in _curve_runs(chosen, choice) if _accepts(run, ranks, choice)}
    if "1" in choice.figures:
        table = table_runs(meshes.found, choice.k)
        runs |= {run for run in table if run.method in choice.methods}
    if not runs:
        raise ValueError("nothing to run: no requested figure shows the requested methods")
    ordered = sorted(runs, key=lambda run: _place(run, ranks))
    problems = models.problems + meshes.problems
    return RunPlan(choice, chosen, meshes.found, tuple(ordered), pictures, problems)


def _ranks(models: tuple[StudyMesh, ...]) -> dict[StudyMesh, int]:
    """Return the rank of each model in its category, 0 for the smallest. `models` are sorted."""
    seen: Counter[str] = Counter()
    ranks = {}
    for model in models:
        ranks[model] = seen[model.category]
        seen[model.category] += 1
    return ranks


def _curve_runs(models: tuple[StudyMesh, ...], choice: Choice) -> Iterator[Run]:
    """Yield the runs for all figures that are plots. The same run may occur several times."""
    for figure in set(choice.figures) - set(GALLERY):
        ks = (choice.k,) if figure == "5" else choice.ks
        for curve in choice.curves_in(figure):
            yield from (Run(model, *curve, k) for model in models for k in ks)


def _accepts(run: Run, ranks: dict[StudyMesh, int], choice: Choice) -> bool:
    """Return whether the mesh of a run is small enough for the method.

    The `least_models` smallest models of each category are always accepted, except in a subset.
    """
    row = METHODS[run.method]
    limit = row.subset_max_faces if choice.is_subset else row.max_faces
    if limit is None or run.source.n_faces <= limit:
        return True
    return run.source.is_model and not choice.is_subset and ranks[run.source] < row.least_models


def _place(run: Run, ranks: dict[StudyMesh, int]) -> tuple[object, ...]:
    """Return the sort key of a run: meshes of the user, then models by rank in their category."""
    place = (
        (1, ranks[run.source], CATEGORIES.index(run.source.category))
        if run.source.is_model
        else (0, 0, 0)
    )
    alpha = -1.0 if run.alpha is None else run.alpha
    return (*place, run.source.name, list(METHODS).index(run.method), alpha, run.k)
