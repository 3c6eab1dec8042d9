"""Define `SegmentOptions`, the checked arguments of `segment`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy.typing as npt

from ..base.checks import checked_choice, checked_flag
from ..base.options import INITS, AnyInit, CountOptions, Init, Islands, LoopOptions, Sizes
from ..base.timing import Callback
from ..clustering.plan import Start
from ..clustering.result import Segmentation
from ..graph.constraints import ConstraintOptions
from ..graph.kinds import Kind
from ..mesh.denoising import Denoise, checked_denoise
from ..weights.features import Features
from ..weights.formulas import ArcValues, WeightName, WeightOptions, Weights


@dataclass(frozen=True, kw_only=True)
class SegmentOptions:
    """Checked arguments of `segment`, grouped by stage."""

    count: CountOptions
    init: AnyInit | Start | None
    weights: WeightOptions
    loop: LoopOptions
    constraints: ConstraintOptions
    denoise: Denoise
    smooth: bool
    features: Features = field(default_factory=lambda: Features(None))
    sizes: Sizes = field(default_factory=Sizes)
    weld: float = True  # of `Prepared`, as `n_steps`; both are set by `for_prepared`
    n_steps: int | None = None
    may_relocate: bool = True
    """Whether `LoopOptions.relocates`, if there are costs between parts and no given seeds."""

    @classmethod
    def checked(
        cls, *, n_segments: int | None, radius: float | None,
        weights: WeightName | Weights | ArcValues, alpha: float | None, features: Any,
        init: Init | Start | None, mask: npt.ArrayLike | None, barriers: npt.ArrayLike | None,
        sizes: Sizes | None, islands: Islands, smooth: bool, denoise: Denoise, max_num_iter: int,
        tol: float, n_threads: int | None, callback: Callback | None,
    ) -> SegmentOptions:  # fmt: skip
        """Check the arguments of `segment`, except arrays with one row per cell, vertex or arc."""
        count = CountOptions.checked(n_segments, radius, init)
        if isinstance(init, str):
            checked_choice(init, "init", INITS)
        if sizes is None:
            sizes = Sizes()
        elif not isinstance(sizes, Sizes):
            raise TypeError(f"sizes must be superfacets.Sizes(...), got {type(sizes).__name__}")
        sizes.check_with(count, islands)
        return cls(
            count=count, init=init, weights=WeightOptions.checked(weights, alpha),
            loop=LoopOptions.checked(max_num_iter, tol, islands, n_threads, callback),
            constraints=ConstraintOptions(mask, barriers), denoise=checked_denoise(denoise),
            smooth=checked_flag(smooth, "smooth"), features=Features.of(features), sizes=sizes,
        )  # fmt: skip

    def for_prepared(self, n_steps: int | None, angle_slack: float, weld: float) -> SegmentOptions:
        """Return options for a mesh after `n_steps` smoothing steps; see `Prepared`."""
        weights = replace(self.weights, angle_slack=angle_slack)
        return replace(self, n_steps=n_steps, weights=weights, weld=weld)

    def keeps_order(self, kind: Kind) -> bool:
        """Return whether cells must keep their input order.

        Given weights are in this order. If paths between faces have a limit, the lowest face that
        no center reaches becomes a center.
        """
        is_halted = self.loop.radius_factor is not None and not kind.are_points
        return is_halted or self.weights.given is not None

    def params(self, result: Segmentation) -> dict[str, Any]:
        """Return `Segmentation.params`: these options, and the loop parameters in `result`."""
        return {
            "denoise": self.n_steps, **self.weights.params, **self.features.params,
            **self.constraints.params, **result.params, "smooth": self.smooth, "weld": self.weld,
            **self.sizes.params,
        }  # fmt: skip
