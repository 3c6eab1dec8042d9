"""Define the table of methods: how each method is run, and in which figures it appears.

To add a method, add a row. A figure shows all methods whose `figures` contain its name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Literal

from superfacets import paper
from superfacets.clustering.result import Segmentation
from superfacets.mesh.faces import FaceMesh
from superfacets.pipeline import segment

Segmenter = Callable[[int], Segmentation]
"""Function that segments one mesh into a given number of regions."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """Inputs of a method besides the mesh and the number of regions."""

    alpha: float | None
    most_segments: int  # maximum k of all runs; some methods do shared work for this k
    seed: int  # random seed, which is different for each mesh
    max_memory: int  # memory limit in bytes; labels do not depend on it


@dataclass(frozen=True, kw_only=True)
class Method:
    """A row of the table: a method, its settings, and its style in figures."""

    title: str
    prepare: Callable[[FaceMesh, Setting], Segmenter]
    """Function that does the work common to all numbers of regions, and returns a `Segmenter`."""
    color: str
    line: str = "-"  # line style of curves; it distinguishes similar colors
    figures: tuple[str, ...]  # names of figures with curves or dots of this method
    depends_on: tuple[str, ...] = ("alpha",)  # fields of `Setting` that labels depend on
    alphas: tuple[float | None, ...] = (None,)  # values of alpha; (None,) if there is no alpha
    subset_alphas: tuple[float | None, ...] = (None,)
    usual_alpha: float | None = None
    """Alpha for pictures, times, and figures with one curve per method."""
    packages: tuple[str, ...] = ()  # names of required optional packages
    bytes_per_pair: int = 0
    """Bytes per pair of faces for methods with quadratic memory, and 0 for other methods."""
    max_faces: int | None = None
    """Models with more faces are left out, except the smallest `least_models` per category."""
    least_models: int = 2  # number of models per category that are run despite `max_faces`
    subset_max_faces: int | None = None  # with ``--subset``, models with more faces are left out
    version: int = 1
    """Version of the method and its settings. Records with another version are not used."""


_OUR_ALPHAS = (0.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
_FEW_ALPHAS = (0.0, 100.0, 200.0)


# Weights and seeds of the paper, but with a tolerance as stop criterion. Paths have no limit, so
# each face gets the label of the nearest center.
_EXACT: dict[str, Any] = {
    "weights": "superfacets", "init": "farthest", "smooth": False, "denoise": 0,
}  # fmt: skip


def _superfacets(mesh: FaceMesh, setting: Setting, **keywords: Any) -> Segmenter:
    return partial(segment, mesh, alpha=setting.alpha, n_threads=1, **keywords)


def _paper(mesh: FaceMesh, setting: Setting) -> Segmenter:
    return partial(paper.segment, mesh, alpha=setting.alpha, n_threads=1)


def _stk02(mesh: FaceMesh, setting: Setting) -> Segmenter:
    from ..stk02 import stk02_weights

    assert setting.alpha is not None
    given = {**_EXACT, "weights": stk02_weights(mesh, alpha=setting.alpha)}
    return partial(segment, mesh, n_threads=1, **given)


def _vsa(
    mesh: FaceMesh,
    setting: Setting,
    *,
    metric: Literal["l21", "l2"],
    init: Literal["random", "incremental"],
) -> Segmenter:
    from ..baselines import variational_shape_approximation

    return partial(variational_shape_approximation, mesh, metric=metric, init=init,
                   rng=setting.seed, n_threads=1)  # fmt: skip


def _normalized_cuts(mesh: FaceMesh, setting: Setting, *, reach: float | None) -> Segmenter:
    from ..baselines import affinity_embedding

    n_vectors = min(setting.most_segments, mesh.n_faces)
    return affinity_embedding(mesh, n_vectors, alpha=setting.alpha, reach=reach,
                              max_memory=setting.max_memory, n_threads=1).segment  # fmt: skip


def _metis(mesh: FaceMesh, setting: Setting) -> Segmenter:
    from ..baselines import metis_partition

    return partial(metis_partition, mesh, alpha=setting.alpha, n_threads=1)


_SUPERFACETS = Method(
    title="superfacets, exact",
    prepare=partial(_superfacets, **_EXACT),
    color="#1f5fa8",
    figures=("4", "5", "6", "7", "rivals"),
    alphas=_OUR_ALPHAS,
    subset_alphas=_FEW_ALPHAS,
    usual_alpha=200.0,
)

_NCUTS = Method(
    title="normalized cuts, all pairs",
    prepare=partial(_normalized_cuts, reach=None),
    color="#c23b22",
    figures=("4", "5"),
    depends_on=("alpha", "most_segments"),
    alphas=_FEW_ALPHAS,
    subset_alphas=_FEW_ALPHAS,
    usual_alpha=100.0,
    packages=("scipy",),
    bytes_per_pair=5,  # affinities: 4; eigenvectors: less than 1 for large meshes
    max_faces=12_000,
    least_models=0,
    subset_max_faces=9_000,
)

_VSA = Method(
    title="VSA, L2, random",
    prepare=partial(_vsa, metric="l2", init="random"),
    color="#8e5bb0",
    figures=("5", "7", "rivals"),
    depends_on=("seed",),
)

METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "superfacets": _SUPERFACETS,
        "default": replace(
            _SUPERFACETS,
            title="superfacets, the default",
            version=2,
            prepare=_superfacets,
            color="#0fa3a3",
            figures=("4", "5", "6", "7", "rivals"),
            alphas=(17.0,),
            subset_alphas=(17.0,),
            usual_alpha=17.0,
        ),
        "paper": replace(
            _SUPERFACETS,
            title="superfacets, halted as in the paper",
            prepare=_paper,
            color="#62a3d9",
            figures=("5", "rivals"),
            alphas=(200.0,),
            subset_alphas=(200.0,),
        ),
        "stk02": replace(
            _SUPERFACETS,
            title="STK02 weights",
            prepare=_stk02,
            color="#3a8a3f",
            figures=("5", "6", "rivals"),
            alphas=(0.0, 0.25, 0.5, 0.75, 1.0),
            subset_alphas=(0.25, 0.5, 0.75),
            usual_alpha=0.5,
        ),
        "vsa-l2-r": _VSA,
        "vsa-l2-i": replace(
            _VSA,
            title="VSA, L2, incremental",
            prepare=partial(_vsa, metric="l2", init="incremental"),
            color="#c58be0",
        ),
        "vsa-l21-r": replace(
            _VSA,
            title="VSA, L2,1, random",
            prepare=partial(_vsa, metric="l21", init="random"),
            color="#b8860b",
        ),
        "vsa-l21-i": replace(
            _VSA,
            title="VSA, L2,1, incremental",
            prepare=partial(_vsa, metric="l21", init="incremental"),
            color="#e0b84c",
        ),
        "ncuts": _NCUTS,
        "ncuts-sparse": replace(
            _NCUTS,
            title="normalized cuts, bounded distances",
            prepare=partial(_normalized_cuts, reach=3.0),
            color="#e07b39",
            line="--",
            figures=("4", "5", "rivals"),
            bytes_per_pair=1,  # 32 bytes for each pair within reach: 3 % of all pairs
            max_faces=16_000,
            least_models=2,
            subset_max_faces=None,
        ),
        "metis": Method(
            title="METIS",
            prepare=_metis,
            color="#555555",
            figures=("5", "rivals"),
            alphas=(0.0, 200.0),
            subset_alphas=(0.0, 200.0),
            usual_alpha=200.0,
            packages=("pymetis", "scipy"),
        ),
    }
)
"""All methods, in the order of figure legends. The option ``--methods`` uses the same names."""
