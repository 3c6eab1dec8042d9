"""Estimate the noise of vertex positions, and smooth meshes before `segment` measures creases."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple, cast

import numpy as np

from .. import _core
from ..base.checks import checked_count
from ..base.types import Floats, Ints
from .faces import FaceMesh, corners_of, mesh_like, spread_indices

Denoise = int | Literal["auto", "scan"] | None

N_SAMPLES, N_FIRST = 512, 128
"""Number of sampled faces, and number of samples that are measured first. If the first samples show
no noise, the remaining samples are not measured."""

MIN_SAMPLES = 32
"""Minimum number of samples at which `near` and `agreement` of `Roughness` are finite. With fewer
of these samples, ``"auto"`` does not smooth the mesh."""

NOISE_LIMIT, NOISE_LIMIT_ON_GRIDS = 0.029, 0.005
"""Minimum noise, in edge lengths, at which meshes are smoothed: for irregular meshes, and for
regular grids. On a plane of equal squares, noise of 0.005 edge lengths makes regions 1.3 times as
long as wide."""

SMOOTH_BELOW = 0.7
"""A mesh is treated as smooth if the noise estimated from the first samples is below this fraction
of the noise limit. The estimate is then 4 standard errors below the limit."""

DETAIL_RATIO = 1.45
"""Assumed ratio of `Roughness.far` to `Roughness.near` on meshes with details but without noise.
The ratio is 1 for white noise, and 1.3 to 2 for benchmark models without noise."""

MAX_AGREEMENT, MAX_AGREEMENT_OF_ROUGH, ROUGH = 0.5, 0.56, 0.35
"""Maximum mean of `Roughness.agreement` on a noisy mesh, and its value if the noise is at least
`ROUGH` edge lengths. The mean is 0.42 for white noise, up to 0.55 if strong noise folds faces over,
and higher for coarse shapes without noise."""

SCAN_STEPS = 5
"""Minimum number of smoothing steps that ``"scan"`` uses."""

FOLD_PER_NOISE = 2.4
"""Minimum ratio of the angle between neighboring faces (in radians) to the noise (in edge lengths).
The ratio is 2.4 to 3.3 on noisy models. Noise bends all edges. Therefore the angles of the flattest
edges, divided by this ratio, are an upper bound of the noise: a mesh with many flat edges, such as
a subdivided mesh, has little noise."""

QUARTER_OF_NORMAL = 0.3186
"""First quartile of the absolute values of standard normal numbers."""

LOW_PART, LOW_MEAN_OF_NORMAL = 0.6, 0.3966
"""Noise is estimated from the lowest 60 % of the heights, because larger heights come from creases.
The second value is the mean of the lowest 60 % of absolute standard normal numbers."""

STEPS_PER_NOISE, STEPS_ON_GRIDS = 100, 200
"""Number of smoothing steps per edge length of noise, on irregular meshes and on regular grids."""

MIN_STEPS, MIN_STEPS_ON_GRIDS = 5, 20
"""Minimum number of smoothing steps for noisy irregular meshes, and for noisy regular grids. Grids
need more steps, because even small creases stretch regions on grids."""

MAX_AUTO_STEPS = 100
"""Maximum number of smoothing steps that ``"auto"`` uses."""

MIN_EVEN = 0.98
"""A mesh is a regular grid if at least this fraction of its inner vertices belong to an even number
of faces. The median of this fraction over the benchmark models is 0.7."""

STEPS_WITH_SLACK = 10
"""Number of smoothing steps below which `slack_of` returns 0."""

MIN_SLACK, SLACK_PER_STEP = 2.25, 0.1
"""Minimum of `slack_of`, and its increase per smoothing step, in degrees. Both values exceed three
standard deviations of the angles that remained on smoothed height fields. The fields had noise of
0.05 to 0.5 edge lengths, and were smoothed with 200 steps per edge length of noise."""

MAX_STEPS = 1000
"""Maximum number of smoothing steps. Far fewer steps already remove all details of a shape."""


def checked_denoise(denoise: object) -> Denoise:
    """Return the argument `denoise` of `segment`, or raise an error if the argument is invalid."""
    if denoise is None or denoise in ("auto", "scan"):
        return denoise
    if isinstance(denoise, str):
        raise ValueError(f"denoise must be 'auto', 'scan', an integer or None, got {denoise!r}")
    n_steps = checked_count(denoise, "denoise", low=0)
    if n_steps > MAX_STEPS:
        raise ValueError(f"denoise must be at most {MAX_STEPS} steps, got {n_steps}")
    return n_steps


def suits(denoise: Denoise, n_steps: int | None) -> bool:
    """Whether a mesh that was smoothed in `n_steps` steps can be used for this `denoise`."""
    return denoise in ("auto", n_steps) or (denoise == "scan" and (n_steps or 0) >= SCAN_STEPS)


def smoothed(mesh: FaceMesh, arcs: Any, n_steps: int, n_threads: int) -> FaceMesh:
    """Return a copy of the mesh, smoothed by `n_steps` steps of Taubin smoothing.

    `arcs` are the `FaceArcs` of the mesh. Vertices that they weld stay together. Do not weld the
    result again, because small components can shrink to a point, where welding would join
    unrelated faces.
    """
    lists, counts = corners_of(mesh).lists, arcs.edge_counts
    is_simple = counts.non_manifold == counts.inconsistent == 0
    offsets = arcs.offsets if is_simple else arcs.offsets[:0]
    positions = _core.smooth_positions(
        mesh.vertices, *lists, arcs.lowest, offsets, n_steps, n_threads
    )
    return cast(FaceMesh, mesh_like(mesh, positions, *lists[:2]))


def slack_of(n_steps: int, *, is_regular: bool) -> float:
    """Return the angle in radians below which edges of a smoothed mesh are treated as flat.

    Small angles remain and stretch regions on regular grids; the result is 0 for other meshes,
    and for few steps.
    """
    degrees = max(MIN_SLACK, SLACK_PER_STEP * n_steps)
    return math.radians(degrees) if is_regular and n_steps >= STEPS_WITH_SLACK else 0.0


class Roughness(NamedTuple):
    """Roughness at sampled faces and their first corners (see ``roughness.hpp``); NaN if undefined.

    `near` and `far` are absolute heights of the corner above a fitted surface, in edge lengths.
    """

    near: Floats  # fitted to the first and second ring of vertices around the corner
    far: Floats  # fitted only to the second ring
    fold: Floats  # angle between the planes of the face and of its first neighbor
    agreement: Floats  # fraction of pairs of neighbors with centers on the same side of the face
    n_faces: Ints  # number of faces around the corner; 0 on the boundary

    @classmethod
    def of(cls, mesh: FaceMesh, arcs: Any, faces: Ints, n_threads: int) -> Roughness:
        """Measure the roughness at `faces`; `arcs` is the graph of all faces of the mesh."""
        lists = corners_of(mesh).lists
        return cls(
            *_core.measure_roughness(
                mesh.vertices, *lists, arcs.offsets, arcs.neighbors, faces, n_threads
            )
        )

    @classmethod
    def of_mesh(cls, mesh: FaceMesh, arcs: Any, n_threads: int) -> Roughness:
        """Measure the roughness at samples, or at the first ones if they show no noise."""
        # the first `N_FIRST` faces are also spread evenly
        faces = spread_indices(N_SAMPLES, mesh.n_faces).astype(np.int32)
        first = cls.of(mesh, arcs, faces[:N_FIRST], n_threads)
        if first.is_smooth:
            return first
        pairs: Any = zip(first, cls.of(mesh, arcs, faces[N_FIRST:], n_threads), strict=True)
        return cls(*(np.concatenate(pair) for pair in pairs))

    @property
    def is_smooth(self) -> bool:
        """Whether the measured heights are so low that the noise must be below the limit."""
        return _scale_of(self.near[np.isfinite(self.near)]) < SMOOTH_BELOW * self.limit

    @property
    def limit(self) -> float:
        """Minimum noise, in edge lengths, at which the mesh is smoothed."""
        return NOISE_LIMIT_ON_GRIDS if self.is_regular else NOISE_LIMIT

    @property
    def noise(self) -> float:
        """Standard deviation of the noise, in edge lengths; 0 if the shape explains it.

        See `MIN_SAMPLES`, `MAX_AGREEMENT` and `DETAIL_RATIO`.
        """
        is_known = np.isfinite(self.near) & np.isfinite(self.agreement)
        if np.count_nonzero(is_known) < MIN_SAMPLES:
            return 0.0
        near, far = _scale_of(self.near[is_known]), _scale_of(self.far[is_known])
        fold, agreement = np.sort(self.fold[is_known]), np.sort(self.agreement[is_known])
        most = MAX_AGREEMENT_OF_ROUGH if near >= ROUGH else MAX_AGREEMENT
        if float(agreement.mean()) > most or near == 0.0:
            return 0.0
        fraction = max(DETAIL_RATIO**2 - max(far / near, 1.0) ** 2, 0.0) / (DETAIL_RATIO**2 - 1.0)
        flattest = float(fold[len(fold) // 4]) / QUARTER_OF_NORMAL
        return min(near * math.sqrt(fraction), flattest / FOLD_PER_NOISE)

    @property
    def is_regular(self) -> bool:
        """Whether the mesh is a regular grid; see `MIN_EVEN`."""
        inside = self.n_faces[:N_FIRST]
        inside = inside[inside > 0]
        return len(inside) > 0 and float(np.mean(inside % 2 == 0)) >= MIN_EVEN

    @property
    def n_steps(self) -> int:
        """Number of smoothing steps that ``"auto"`` uses; 0 if the mesh is not noisy."""
        noise = self.noise
        if noise < self.limit:
            return 0
        per_noise, least = STEPS_PER_NOISE, MIN_STEPS
        if self.is_regular:
            per_noise, least = STEPS_ON_GRIDS, MIN_STEPS_ON_GRIDS
        return min(max(round(per_noise * noise), least), MAX_AUTO_STEPS)


def _scale_of(heights: Floats) -> float:
    """Estimate the standard deviation of normal heights from their absolute values; 0 if none."""
    low = np.sort(heights)[: math.ceil(LOW_PART * len(heights))]
    return float(low.mean()) / LOW_MEAN_OF_NORMAL if len(low) else 0.0
