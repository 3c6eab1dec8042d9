"""Define `SegmentOptions`, the checked arguments of `segment`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy.typing as npt

from ..base.checks import checked_choice
from ..base.options import (
    INITS,
    BalanceOptions,
    CleanupOptions,
    Init,
    Islands,
    LoopOptions,
    Progress,
    SizeOptions,
)
from ..base.timing import OnStage
from ..clustering.plan import Start
from ..clustering.result import Segmentation
from ..graph.constraints import ConstraintOptions
from ..graph.kinds import Kind
from ..mesh.denoising import Denoise, checked_denoise
from ..weights.features import FeatureOptions
from ..weights.formulas import WeightName, WeightOptions, Weights


@dataclass(frozen=True)
class SegmentOptions:
    """Checked arguments of `segment`, grouped by stage."""

    weld: bool
    init: Init | Start | None
    size: SizeOptions
    weights: WeightOptions
    loop: LoopOptions
    cleanup: CleanupOptions
    features: FeatureOptions
    constraints: ConstraintOptions
    denoise: Denoise  # argument of `segment`; after `smoothed`, the number of steps made
    balance: BalanceOptions

    @classmethod
    def checked(
        cls, *, n_segments: int | None, alpha: float | None,
        features: npt.ArrayLike | str | Sequence[str] | None,
        denoise: Denoise, n_threads: int | None, radius: float | None,
        expected_radius: float | None, weights: WeightName | Weights, eta_convex: float | None,
        ridges: float | None, init: Init | Start | None, relocate: bool | None, smooth: bool,
        max_num_iter: int, tol: float, radius_factor: float | None, islands: Islands,
        min_size: float, enforce_connectivity: bool, balance: float, max_measure: float | None,
        min_measure: float | None, cell_weights: npt.ArrayLike | None,
        cells_per_region: int | None, mask: npt.ArrayLike | None, barriers: npt.ArrayLike | None,
        feature_weight: float, scale_features: bool, weld: bool, progress: Progress | None,
        on_stage: OnStage | None,
    ) -> SegmentOptions:  # fmt: skip
        """Check the arguments of `segment`, except arrays with one row per cell, vertex or arc."""
        size = SizeOptions.checked(n_segments, radius, expected_radius, init)
        if isinstance(init, str):
            checked_choice(init, "init", INITS)
        loop = LoopOptions.checked(
            max_num_iter, tol, radius_factor, islands, n_threads, progress, on_stage,
            relocate=relocate,
        )  # fmt: skip
        bounds = (min_measure, max_measure)
        sizes = BalanceOptions.checked(balance, bounds, cells_per_region, cell_weights)
        sizes.check_with(size, loop, min_size)
        return cls(
            weld=weld,
            init=init,
            size=size,
            weights=WeightOptions.checked(weights, alpha, eta_convex, ridges),
            loop=loop,
            cleanup=CleanupOptions.checked(smooth, enforce_connectivity, min_size, islands),
            features=FeatureOptions.checked(features, feature_weight, scale_features),
            constraints=ConstraintOptions(mask, barriers),
            denoise=checked_denoise(denoise),
            balance=sizes,
        )

    def smoothed(self, n_steps: int | None, slack: float) -> SegmentOptions:
        """Return options for a mesh after `n_steps` smoothing steps; see `Prepared` for `slack`."""
        return replace(self, denoise=n_steps, weights=replace(self.weights, slack=slack))

    def needs_order(self, kind: Kind) -> bool:
        """Return whether cells must keep their input order, even if sorted cells would be faster.

        This is the case if the caller gave weights, which are in input order. It is also the case
        if `radius_factor` is given, except for points: then the lowest face that no center reaches
        becomes a center, so labels depend on the order.
        """
        is_halted = self.loop.radius_factor is not None and not kind.are_points
        return is_halted or self.weights.given is not None

    def params(self, result: Segmentation) -> dict[str, Any]:
        """Return `Segmentation.params`: these options, and the loop parameters in `result`."""
        return {
            "weld": self.weld,
            "denoise": self.denoise,
            **self.weights.params,
            **self.features.params,
            **self.constraints.params,
            **result.params,
            **self.cleanup.params,
            **self.balance.params,
        }
