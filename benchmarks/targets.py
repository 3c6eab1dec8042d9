"""Measurements that have a target, and compare superfacets with rivals or with the machine."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import superfacets as sf

from . import memory, processes, races, runs
from .checks import Expected, hash_labels, require
from .clock import Sample, interleaved, median
from .machine import usable_cores
from .meshes import Arrays, build

Row = dict[str, Any]


class Meshes(NamedTuple):
    """Names of the meshes that are measured."""

    ladder: tuple[str, ...] = ("bear60k", "bear60k-x4", "bear60k-x16")
    """The same surface at several resolutions. The last mesh is also measured with shuffled faces,
    and as a cloud."""
    small: str = "bunny"
    even: str = "sphere-x65536"
    many: str = "hand-x16"
    large: str = "hand-x64"


FEW, SOME, MANY = 150, 2_000, 100_000  # numbers of regions

SMALL_FACES = 100_000
"""Meshes with fewer faces than this get two additional runs, because their times vary more."""


def measure(
    meshes: Meshes, data: Path | None, repeats: int, expected: Expected, say: Callable[[str], None]
) -> dict[str, Any]:
    """Return the rows with targets, the rows of the runs, and the rows of the rivals.

    The keys are ``targets``, ``runs`` and ``label_races``. The labels of all runs are checked.
    """
    bench = _Bench(data, repeats, expected, _memory_speeds(), [], [], [])
    say(meshes.small)
    _small(bench, meshes.small)
    for name in meshes.ladder:
        say(f"{name}: creases")
        _against_creases(bench, name)
    say(f"{meshes.ladder[-1]}: threads, orders, clouds")
    _other_inputs(bench, meshes.ladder[-1])
    for name, rival, target in ((meshes.even, "METIS", 7.0), (meshes.many, "pyacvd", 2.0)):
        say(f"{name}: rivals")
        _against_rivals(bench, name, rival, target)
    say(f"{meshes.many}: many regions")
    _many(bench, meshes.many)
    say(f"{meshes.large}: time, memory, whole process")
    _large(bench, meshes.large)
    return {"targets": bench.rows, "runs": bench.runs, "label_races": bench.races}


class _Bench(NamedTuple):
    """Input of all measurements, and the rows that have been measured until now."""

    data: Path | None
    repeats: int
    expected: Expected
    speeds: tuple[float, float]  # bytes per second for writing new memory, and for reading
    rows: list[Row]
    runs: list[Row]
    races: list[Row]

    def add(self, what: str, now: float, unit: str, target: float | None, floor: float = 0) -> None:
        """Add a row with a target.

        `floor` is a lower bound that the machine sets, in the same unit, or 0 if there is none.
        """
        self.rows.append({"what": what, "now": now, "unit": unit, "target": target, "floor": floor})

    def timed(self, arrays: Arrays, name: str, k: int, settings: tuple[str, ...]) -> list[float]:
        """Return the median seconds for each of the settings, measured in interleaved runs."""
        cases = [runs.Case(name, k, setting, usable_cores()) for setting in settings]
        repeats = self.repeats + 2 if len(arrays.faces) < SMALL_FACES else self.repeats
        found = runs.measure(arrays, cases, repeats, self.expected)
        self.runs.extend(found)
        return [row["seconds"] for row in found]

    def peak_and_floor(self, arrays: Arrays, name: str, k: int) -> tuple[float, float]:
        """Return the peak memory in bytes per cell, and a lower bound of the time in seconds.

        The bound is the time in which the machine writes new memory of this size and reads it once.
        """
        row = memory.measure(name, arrays, k)
        n_bytes = row["bytes_per_face"] * row["faces"]
        return row["bytes_per_face"], sum(n_bytes / speed for speed in self.speeds)


def _memory_speeds(n_bytes: int = 1 << 28) -> tuple[float, float]:
    """Return bytes per second on all threads: for writing new memory, and for reading."""
    n_threads = usable_cores()

    def write(_: int) -> npt.NDArray[np.float64]:
        return np.full(n_bytes // 8 // n_threads, 1.0)

    with ThreadPoolExecutor(n_threads) as pool:

        def written(_: object = None) -> list[npt.NDArray[np.float64]]:
            return list(pool.map(write, range(n_threads)))

        parts = written()

        def read() -> list[float]:
            return list(pool.map(np.max, parts))

        jobs: dict[str, Callable[[], Any]] = {"write": written, "read": read}
        samples = interleaved(jobs, 5, lambda *_: None)
    return _speed(n_bytes, samples["write"]), _speed(n_bytes, samples["read"])


def _speed(n_bytes: int, samples: list[Sample]) -> float:
    return n_bytes / median([sample.seconds for sample in samples])


def _small(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    (seconds,) = bench.timed(arrays, name, FEW, ("defaults",))
    floor = bench.peak_and_floor(arrays, name, FEW)[1]
    bench.add(f"{len(arrays.faces):,} faces, k = {FEW}", 1e3 * seconds, "ms", 45.0, 1e3 * floor)


def _against_creases(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    n_faces = len(arrays.faces)
    for k in (FEW, min(SOME, n_faces // 4)):
        ours, creases = bench.timed(arrays, name, k, ("defaults", "creases"))
        target = 1.3 if n_faces >= 100_000 and k == FEW else None
        bench.add(f"over creases, {n_faces:,} faces, k = {k:,}", ours / creases, "x", target)


def _other_inputs(bench: _Bench, name: str) -> None:
    """Add rows for one thread, for shuffled faces, and for a cloud with one point per face."""
    arrays = build(name, bench.data)
    shuffled, _ = runs.measure_orders(name, arrays, FEW, bench.repeats)[1:]
    bench.add("shuffled faces over sorted ones", shuffled["ratio"], "x", 1.25)
    points = np.ascontiguousarray(arrays.vertices[arrays.faces].mean(axis=1))
    jobs: dict[str, Callable[[], sf.Segmentation]] = {
        "mesh": lambda: sf.segment(arrays, FEW),
        "alone": lambda: sf.segment(arrays, FEW, n_threads=1),
        "cloud": lambda: sf.segment(points, FEW),
    }
    known: dict[str, str] = {}

    def accept(job: str, result: sf.Segmentation) -> None:
        found = known.setdefault(job.replace("alone", "mesh"), hash_labels(result.labels))
        require(found == hash_labels(result.labels), f"{name}: labels depend on the run")

    samples = interleaved(jobs, bench.repeats, accept)
    seconds = {job: median([sample.seconds for sample in taken]) for job, taken in samples.items()}
    bench.add("one thread over all", seconds["alone"] / seconds["mesh"], "x", None)
    bench.add("cloud over a mesh of as many cells", seconds["cloud"] / seconds["mesh"], "x", 3.0)
    peak, _ = bench.peak_and_floor(Arrays(points, arrays.faces[:0]), name, FEW)
    bench.add("memory of a cloud, per point", peak, "bytes", 220.0)


def _against_rivals(bench: _Bench, name: str, rival: str, target: float) -> None:
    arrays = build(name, bench.data)
    k = min(SOME, len(arrays.faces) // 4)
    rows = races.race_for_labels(name, arrays, k, bench.repeats, bench.expected)
    bench.races.extend(rows)
    # The first row of a rival has its best settings.
    for row in [row for row in rows if row["who"] == rival][:1]:
        place = f"{len(arrays.faces):,} faces, k = {k:,}"
        bench.add(f"{rival} over ours, {place}", row["ratio"], "x (more is better)", target)


def _many(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    n_faces = len(arrays.faces)
    k = min(MANY, n_faces // 4)
    (seconds,) = bench.timed(arrays, name, k, ("defaults",))
    floor = bench.peak_and_floor(arrays, name, k)[1]
    bench.add(f"{n_faces:,} faces, k = {k:,}", seconds, "s", 1.3, floor)


def _large(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    n_faces = len(arrays.faces)
    (seconds,) = bench.timed(arrays, name, FEW, ("defaults",))
    peak, floor = bench.peak_and_floor(arrays, name, FEW)
    place = f"{n_faces:,} faces, k = {FEW}"
    bench.add(place, seconds, "s", 2.0, floor)
    bench.add("memory of a mesh, per face", peak, "bytes", 110.0)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mesh.ply"
        sf.write_mesh(file, sf.Mesh(*arrays))
        row = processes.measure_command(name, file, bench.repeats)
    bench.add(f"{place}, PLY to PLY", row["seconds"], "s", 2.8)
