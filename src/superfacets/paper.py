"""The algorithm as published in the paper, with its own weights, seedings and limits of paths."""

from __future__ import annotations

from dataclasses import replace

import numpy.typing as npt

from .base.checks import checked_choice, checked_number, explains_parameters
from .base.options import ANY_INITS, AnyInit, CountOptions, Islands, LoopOptions
from .base.timing import Callback
from .clustering.plan import Start
from .clustering.result import Segmentation
from .graph.constraints import ConstraintOptions
from .mesh.convert import MeshLike
from .pipeline import run
from .stages.options import SegmentOptions
from .stages.prepare import Prepared
from .weights.formulas import WeightOptions, Weights, superfacet_weights

__all__ = ["segment", "superfacet_weights"]

_OTHERS = ("weights", "features", "sizes", "smooth", "denoise", "tol")


@explains_parameters(dict.fromkeys(_OTHERS, "use superfacets.segment"))
def segment(
    mesh: MeshLike | Prepared, n_segments: int | None = None, *, radius: float | None = None,
    alpha: float | None = None, eta_convex: float | None = None, init: AnyInit | Start = "farthest",
    radius_factor: float | None = 2.0, mask: npt.ArrayLike | None = None,
    barriers: npt.ArrayLike | None = None, islands: Islands = "keep", max_num_iter: int = 50,
    n_threads: int | None = None, callback: Callback | None = None,
) -> Segmentation:  # fmt: skip
    """Label every face of a mesh with one of k regions, by the algorithm published in the paper.

    The paper is Simari, Picciau and De Floriani, "Fast and Scalable Mesh Superfacets", 2014.
    Weights are computed with equations 1 to 3, see `superfacet_weights`. Paths of a region end at
    a distance from its center. The loop stops when no center moves, when the centers return to an
    earlier state, or after `max_num_iter` iterations. Neither the mesh nor borders are smoothed.

    Parameters
    ----------
    mesh, n_segments, radius, mask, barriers, islands, max_num_iter, n_threads, callback
        Same as in `superfacets.segment`.
    alpha, eta_convex : float, optional
        Same as in `superfacet_weights`: 200 and 0.2 by default.
    init : {"farthest", "flood", "grid", "geodesic", "curve"}, array_like, or Segmentation
        One of the three seedings of the paper, another one (see `place_seeds`), or seeds.
    radius_factor : float or None, default 2.0
        Distance from the center at which paths of a region end, > 0, in units of the expected
        radius r. With None, paths have no limit.

    Returns
    -------
    Segmentation
        Same as in `superfacets.segment`. Cells that no path reaches form further regions or, with
        ``islands="nearest"``, join the nearest region. With ``"flood"`` and ``"grid"``, the
        number of regions may differ from k, too.

    Raises
    ------
    MeshError, ValueError, TypeError
        If the mesh is not valid, or if a parameter is out of range or of the wrong type.

    Examples
    --------
    >>> import superfacets
    >>> superfacets.paper.segment(superfacets.sample_mesh(5_000), 20).stop_reason
    'converged'
    """
    options = checked(
        n_segments=n_segments, radius=radius, alpha=alpha, eta_convex=eta_convex, init=init,
        radius_factor=radius_factor, mask=mask, barriers=barriers, islands=islands,
        max_num_iter=max_num_iter, n_threads=n_threads, callback=callback,
    )  # fmt: skip
    return run(mesh, options)


def checked(
    *, n_segments: int | None, radius: float | None, alpha: float | None,
    eta_convex: float | None, init: AnyInit | Start, radius_factor: float | None,
    mask: npt.ArrayLike | None, barriers: npt.ArrayLike | None, islands: Islands,
    max_num_iter: int, n_threads: int | None, callback: Callback | None,
) -> SegmentOptions:  # fmt: skip
    """Check the arguments of `segment`, except arrays with one row per cell or vertex."""
    count = CountOptions.checked(n_segments, radius, init)
    if isinstance(init, str):
        checked_choice(init, "init", ANY_INITS)
    if radius_factor is not None:
        radius_factor = checked_number(radius_factor, "radius_factor", zero=False)
    loop = LoopOptions.checked(max_num_iter, 0.0, islands, n_threads, callback)
    weights = Weights("superfacets", alpha=alpha, eta_convex=eta_convex)
    return SegmentOptions(
        count=count, init=init, weights=WeightOptions.checked(weights, None),
        loop=replace(loop, radius_factor=radius_factor),
        constraints=ConstraintOptions(mask, barriers), denoise=0, smooth=False, may_relocate=False,
    )  # fmt: skip
