"""Define the plan of a benchmark: meshes, numbers of regions, settings and numbers of threads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .machine import thread_counts
from .meshes import count_faces, find_data
from .runs import Case

CATALOG = (
    "fandisk", "bunny", "hand", "hand-x4", "bunny-x16", "sphere-x65536", "hand-x16", "hand-x64",
    "bear60k", "bear60k-x4", "bear60k-x16", "bear60k-x64",
)  # fmt: skip
"""Meshes of 13 thousand to 7 million faces: real meshes, the same surfaces at several resolutions,
and a sphere of 1.31 million faces for the comparison with rivals."""

SAMPLES = ("bear5k", "bear60k", "bear60k-x4", "bear60k-x16", "sphere-x65536", "bear60k-x64")
"""Names of the meshes for runs without a data folder."""

RACES = (("bunny", 150), ("bear60k", 150), ("sphere-x65536", 2_000), ("hand-x16", 2_000))

HALTED = ("bunny", "hand-x4", "hand-x16")
"""Names of the meshes for the comparison of halted and exact expansions."""

RACED = ("defaults", "plain", "10 iterations")
"""Names of the settings for the comparison with rivals."""

MANY = ("hand-x16", 100_000)
"""Name of a mesh, and a number of regions that is typical for superpoint networks."""

N_SEGMENTS = (150, 2_000)
K_SERIES = (50, 150, 500, 2_000, 8_000)
LARGE = 1_000_000
QUICK_FACES = 500_000


@dataclass(frozen=True)
class BenchmarkPlan:
    """The runs of a benchmark."""

    meshes: dict[str, int]
    """Number of faces of each mesh, keyed by the name of the mesh, in the order of the runs."""
    data: Path | None
    races: tuple[tuple[str, int], ...]
    """Meshes and numbers of regions for the comparison with rivals."""
    wanted_repeats: int | None
    """Number of counted runs per case from the command line, or None for the default: 5, or 3 for
    large meshes and if `is_quick` is True."""
    is_quick: bool

    def repeats(self, mesh: str) -> int:
        """Return the number of counted runs per case for a mesh."""
        if self.wanted_repeats is not None:
            return self.wanted_repeats
        return 3 if self.is_quick or self.meshes[mesh] >= LARGE else 5

    def cases(self, mesh: str, sections: frozenset[str]) -> list[Case]:
        """Return the cases of a mesh for the sections `stages` and `scaling`."""
        cases = []
        if "stages" in sections:
            cases += self._stage_cases(mesh)
        if "scaling" in sections:
            cases += self._scaling_cases(mesh)
        fitting = [case for case in cases if case.n_segments <= self.meshes[mesh]]
        return list(dict.fromkeys(fitting))

    def hashed_runs(self, mesh: str) -> list[tuple[int, str]]:
        """Return (number of regions, settings) of all runs of a mesh whose labels are hashed."""
        cases = self.cases(mesh, frozenset({"stages", "scaling"}))
        runs = [(case.n_segments, case.settings) for case in cases]
        runs += [(k, settings) for raced, k in self.races for settings in RACED if raced == mesh]
        return list(dict.fromkeys(runs))

    def _stage_cases(self, mesh: str) -> list[Case]:
        threads = thread_counts()
        cases = [Case(mesh, k, "defaults", n) for k in N_SEGMENTS for n in threads]
        cases += [Case(mesh, k, "plain", threads[-1]) for k in N_SEGMENTS]
        if mesh == MANY[0]:
            cases += [Case(*MANY, "defaults", n) for n in threads]
        return [*cases, Case(mesh, N_SEGMENTS[0], "tol=0", threads[-1])]

    def _scaling_cases(self, mesh: str) -> list[Case]:
        threads = thread_counts()
        names = ("defaults", "10 iterations")
        cases = [Case(mesh, 150, name, threads[-1]) for name in names]
        if mesh in HALTED:
            cases.append(Case(mesh, 150, "halted, 10 iterations", threads[-1]))
        if self.meshes[mesh] >= LARGE:
            cases += [Case(mesh, k, "defaults", n) for k in N_SEGMENTS for n in threads]
        if mesh == self._mesh_of_k_series():
            cases += [Case(mesh, k, name, threads[-1]) for k in K_SERIES for name in names]
        return cases

    def _mesh_of_k_series(self) -> str:
        """Return the largest mesh with fewer than 1.2 million faces, or the largest mesh of all."""
        return max(
            self.meshes, key=lambda mesh: (self.meshes[mesh] < 1.2 * LARGE, self.meshes[mesh])
        )


def make_plan(
    *,
    meshes: tuple[str, ...] = (),
    max_faces: int | None = None,
    repeats: int | None = None,
    quick: bool = False,
    data: Path | None = None,
) -> BenchmarkPlan:
    """Return the plan for the given names of meshes, without meshes that are too large.

    By default, the meshes are `CATALOG`, or `SAMPLES` if there is no data folder. A mesh is too
    large if it has more than `max_faces` faces. If `quick` is True, the default of `max_faces` is
    `QUICK_FACES`; otherwise there is no limit.

    Raises
    ------
    ValueError
        If a mesh does not exist, or all meshes are too large.
    """
    data = find_data(data)
    limit = max_faces or (QUICK_FACES if quick else None)
    names = meshes or (CATALOG if data else SAMPLES)
    counts = {name: count_faces(name, data) for name in names}
    kept = {name: n for name, n in counts.items() if limit is None or n <= limit}
    if not kept:
        raise ValueError(f"no mesh has at most {limit} faces")
    races = tuple((mesh, 150) for mesh in kept) if meshes else RACES
    races = tuple((mesh, min(k, kept[mesh])) for mesh, k in races if mesh in kept)
    return BenchmarkPlan(kept, data, races, repeats, quick)
