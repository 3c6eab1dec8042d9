"""Removal of noise from the positions of meshes, before `segment` measures creases."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple, cast

import numpy as np

from .. import _core
from .._types import Floats, Ints, Longs
from .._validate import checked_count
from .faces import (
    FaceMesh,
    corners_in_a_row,
    corners_of,
    face_sizes,
    mesh_like,
    spread_indices,
    vertex_graph,
)
from .weld import lowest_vertices

Denoise = int | Literal["auto"] | None

N_SAMPLES, N_FIRST = 512, 128
"""Number of sampled faces, and number of first samples that can show that a mesh is smooth."""

LEAST_SAMPLES = 32
"""Minimum number of usable samples. A mesh with fewer usable samples is not smoothed."""

NOISE_LIMIT, NOISE_LIMIT_ON_GRIDS = 0.029, 0.005
"""Minimum noise that is smoothed, in edge lengths: for irregular meshes, and for regular grids.
On a plane of equal squares, noise of 0.005 makes regions 1.3 times as long as wide."""

SMOOTH_BELOW = 0.7
"""Fraction of the noise limit. A mesh is treated as smooth if the estimate from the first samples
is below this fraction, because the estimate is then 4 standard errors below the limit."""

DETAIL_RATIO = 1.45
"""Ratio of the far height to the near height on meshes with details but without noise. The ratio is
1 for white noise, and 1.3 to 2 for benchmark models without noise."""

MOST_AGREEMENT = 0.5
"""Maximum mean `Roughness.agreement` of a noisy mesh. The mean is 0.42 for white noise, and higher
for coarse shapes without noise."""

FOLD_PER_NOISE = 2.4
"""Ratio of the bending angle of edges, in radians, to the noise, in edge lengths. The ratio is 2.4
to 3.3 on noisy models. It gives an upper bound of the noise, because noise bends all edges. In
subdivided meshes and in planes, many edges are flat."""

QUARTER_OF_NORMAL = 0.3186
"""First quartile of the absolute values of standard normal numbers."""

LOW_PART, LOW_MEAN_OF_NORMAL = 0.6, 0.3966
"""Fraction of the samples with the lowest values, and the mean of this fraction for absolute values
of standard normal numbers. Samples with higher values are excluded because they contain creases."""

STEPS_PER_NOISE, STEPS_ON_GRIDS = 100, 200
"""Number of smoothing steps per edge length of noise, on irregular meshes and on regular grids."""

LEAST_STEPS, LEAST_STEPS_ON_GRIDS = 5, 20
"""Minimum number of smoothing steps of a noisy mesh that is irregular, or a regular grid. Grids
need more steps, because even small creases stretch regions on grids."""

MOST_AUTO_STEPS = 100
"""Maximum number of smoothing steps that ``"auto"`` uses."""

LEAST_EVEN = 0.98
"""Minimum fraction of inner vertices of a regular grid that have an even number of faces. The
median of benchmark models is 0.7."""

STEPS_WITH_SLACK = 10
"""Minimum number of smoothing steps for which `slack_of` is not 0."""

LEAST_SLACK, SLACK_PER_STEP = 2.25, 0.1
"""Minimum of `slack_of`, and its increase per step, in degrees. They exceed three standard
deviations of the angles that remain on smoothed height fields. The fields had noise of 0.05 to 0.5
edge lengths, and 200 steps per edge length of noise."""

MOST_STEPS = 1000
"""Maximum number of smoothing steps. Far fewer steps already remove all details of a shape."""


def checked_denoise(denoise: object) -> Denoise:
    """Check the argument `denoise` of `segment`."""
    if denoise is None or denoise == "auto":
        return denoise
    if isinstance(denoise, str):
        raise ValueError(f"denoise must be 'auto', a number of steps, or None, got {denoise!r}")
    n_steps = checked_count(denoise, "denoise", low=0)
    if n_steps > MOST_STEPS:
        raise ValueError(f"denoise must be at most {MOST_STEPS}, got {n_steps}")
    return n_steps


def smoothed(mesh: FaceMesh, n_steps: int, *, weld: bool, n_threads: int) -> FaceMesh:
    """Return the mesh after one or more smoothing steps.

    With `weld`, vertices at the same position stay at the same position, and faces refer to the
    vertex with the lowest index. Do not weld the result again: this would join faces of small
    components that shrink to a point.
    """
    lowest = lowest_vertices(mesh.vertices, weld, n_threads)
    graph = vertex_graph(mesh, lowest, n_threads)
    positions = _core.taubin_smooth(
        mesh.vertices, graph.offsets, graph.neighbors, n_steps, n_threads
    )
    offsets = np.concatenate([[0], np.cumsum(face_sizes(mesh))])
    made = mesh_like(mesh, positions[lowest], lowest[corners_in_a_row(mesh)], offsets)
    return cast(FaceMesh, made)


def slack_of(n_steps: int, *, is_regular: bool) -> float:
    """Return the angle in radians below which edges of a smoothed mesh are treated as flat.

    After `n_steps` smoothing steps, small random angles remain at the edges. On regular grids,
    these angles would stretch regions along the diagonal.
    """
    degrees = max(LEAST_SLACK, SLACK_PER_STEP * n_steps)
    return math.radians(degrees) if is_regular and n_steps >= STEPS_WITH_SLACK else 0.0


class Roughness(NamedTuple):
    """Measures of roughness at sampled faces, from ``measure_roughness`` in the C++ core."""

    near: Floats
    far: Floats
    fold: Floats
    agreement: Floats
    n_faces: Ints

    @classmethod
    def of(cls, mesh: FaceMesh, arcs: Any, faces: Ints, n_threads: int) -> Roughness:
        """Measure the roughness at `faces`; `arcs` has the offsets and neighbors of all faces."""
        lists = corners_of(mesh).lists
        return cls(
            *_core.measure_roughness(
                mesh.vertices, *lists, arcs.offsets, arcs.neighbors, faces, n_threads
            )
        )

    @classmethod
    def of_mesh(cls, mesh: FaceMesh, arcs: Any, order: Ints | None, n_threads: int) -> Roughness:
        """Measure the roughness at the sampled faces; `order` has the input index of each face.

        If the first samples show that the mesh is smooth, the other samples are not measured.
        """
        faces = sampled_faces(mesh.n_faces)
        if order is not None:
            sorted_index = np.empty_like(order)
            sorted_index[order] = np.arange(len(order), dtype=order.dtype)
            faces = sorted_index[faces]
        first = cls.of(mesh, arcs, faces[:N_FIRST], n_threads)
        if first.is_smooth:
            return first
        more = cls.of(mesh, arcs, faces[N_FIRST:], n_threads)
        return cls.joined([first, more], np.arange(len(faces), dtype=np.int64))

    @classmethod
    def joined(cls, parts: list[Roughness], samples: Longs) -> Roughness:
        """Join measures of several parts of a mesh; the result is the same as from `of_mesh`.

        `samples` has the sample index of each row of the joined parts.
        """
        order = np.argsort(samples)
        columns: Any = [np.concatenate(some)[order] for some in zip(*parts, strict=True)]
        whole = cls(*columns)
        first = cls(*(column[:N_FIRST] for column in columns))
        return first if first.is_smooth else whole

    @property
    def is_smooth(self) -> bool:
        """Whether the measured heights are too low for noise above the limit."""
        return _scale_of(self.near[np.isfinite(self.near)]) < SMOOTH_BELOW * self.limit

    @property
    def limit(self) -> float:
        """Minimum noise that is smoothed, in edge lengths."""
        return NOISE_LIMIT_ON_GRIDS if self.is_regular else NOISE_LIMIT

    @property
    def noise(self) -> float:
        """Estimate of the standard deviation of the noise, in edge lengths."""
        is_known = np.isfinite(self.near) & np.isfinite(self.agreement)
        if np.count_nonzero(is_known) < LEAST_SAMPLES:
            return 0.0
        near, far = _scale_of(self.near[is_known]), _scale_of(self.far[is_known])
        fold, agreement = np.sort(self.fold[is_known]), np.sort(self.agreement[is_known])
        if float(agreement.mean()) > MOST_AGREEMENT or near == 0.0:
            return 0.0
        ratio = max(far / near, 1.0)
        fraction = max(DETAIL_RATIO**2 - ratio**2, 0.0) / (DETAIL_RATIO**2 - 1.0)
        flattest = float(fold[len(fold) // 4]) / QUARTER_OF_NORMAL
        return min(near * math.sqrt(fraction), flattest / FOLD_PER_NOISE)

    @property
    def is_regular(self) -> bool:
        """Whether the mesh is a regular grid: nearly all vertices have an even number of faces."""
        inside = self.n_faces[:N_FIRST]
        inside = inside[inside > 0]
        return len(inside) > 0 and float(np.mean(inside % 2 == 0)) >= LEAST_EVEN

    @property
    def n_steps(self) -> int:
        """Number of smoothing steps that ``"auto"`` uses; 0 if the mesh is not noisy."""
        noise = self.noise
        if noise < self.limit:
            return 0
        per_noise, least = STEPS_PER_NOISE, LEAST_STEPS
        if self.is_regular:
            per_noise, least = STEPS_ON_GRIDS, LEAST_STEPS_ON_GRIDS
        return min(max(round(per_noise * noise), least), MOST_AUTO_STEPS)


def _scale_of(heights: Floats) -> float:
    """Estimate the standard deviation of normal numbers from their absolute values."""
    low = np.sort(heights)[: math.ceil(LOW_PART * len(heights))]
    return float(low.mean()) / LOW_MEAN_OF_NORMAL if len(low) else 0.0


def sampled_faces(n_faces: int) -> Ints:
    """Return the indices of the faces at which roughness is measured.

    All samples are spread evenly over the mesh, and so are the first `N_FIRST` samples.
    """
    return spread_indices(N_SAMPLES, n_faces).astype(np.int32)
