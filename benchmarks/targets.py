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
from .meshes import Arrays, build, with_holes, with_noise

Row = dict[str, Any]


class Meshes(NamedTuple):
    """Names of the meshes that are measured."""

    ladder: tuple[str, ...] = ("bear60k", "bear60k-x4", "bear60k-x16")
    """The same surface at several resolutions. The last mesh is also measured with shuffled faces,
    with holes, and as a cloud. The meshes below are also measured with the noise of a scan."""
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
    for name in _clean_and_noisy(meshes.small):
        say(name)
        _small(bench, name)
    for name in meshes.ladder:
        say(f"{name}: creases")
        _against_creases(bench, name)
    say(f"{meshes.ladder[-1]}: threads, orders, holes, clouds")
    _other_inputs(bench, meshes.ladder[-1])
    for name in _clean_and_noisy(meshes.even):
        say(f"{name}: METIS")
        _against_rivals(bench, name, {"METIS": (4.0,)})
    for name in _clean_and_noisy(meshes.many):
        say(f"{name}: pyacvd, many regions")
        _against_rivals(bench, name, {"pyacvd": (2.0, 0.6)})
        _many(bench, name)
    say(f"{meshes.large}: time, memory, whole process")
    _large(bench, meshes.large)
    return {"targets": bench.rows, "runs": bench.runs, "label_races": bench.races}


def _clean_and_noisy(name: str) -> tuple[str, str]:
    return name, f"{name}-noisy"


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
    bench.add(f"{_place(name, arrays, FEW)}", 1e3 * seconds, "ms", 52.0, 1e3 * floor)


def _place(name: str, arrays: Arrays, k: int) -> str:
    noise = ", noisy" if name.endswith("-noisy") else ""
    return f"{len(arrays.faces):,} faces{noise}, k = {k:,}"


def _against_creases(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    n_faces = len(arrays.faces)
    for k in (FEW, min(SOME, n_faces // 4)):
        ours, creases = bench.timed(arrays, name, k, ("defaults", "creases"))
        target = 1.3 if n_faces >= 100_000 and k == FEW else None
        bench.add(f"over creases, {n_faces:,} faces, k = {k:,}", ours / creases, "x", target)


def _other_inputs(bench: _Bench, name: str) -> None:
    """Add rows for one thread, shuffled faces, holes, and a cloud with one point per face."""
    arrays = build(name, bench.data)
    shuffled, _ = runs.measure_orders(name, arrays, FEW, bench.repeats)[1:]
    bench.add("shuffled faces over sorted ones", shuffled["ratio"], "x", 1.25)
    scan = with_holes(with_noise(arrays))
    points = np.ascontiguousarray(arrays.vertices[arrays.faces].mean(axis=1))
    jobs: dict[str, Callable[[], sf.Segmentation]] = {
        "mesh": lambda: sf.segment(arrays, FEW),
        "alone": lambda: sf.segment(arrays, FEW, n_threads=1),
        "cloud": lambda: sf.segment(points, FEW),
        "scan": lambda: sf.segment(scan, FEW, islands="nearest"),
    }
    seconds = _medians(jobs, bench.repeats, name)
    bench.add("one thread over all", seconds["alone"] / seconds["mesh"], "x", None)
    bench.add("cloud over a mesh of as many cells", seconds["cloud"] / seconds["mesh"], "x", 2.5)
    ratio = seconds["scan"] / seconds["mesh"] * len(arrays.faces) / len(scan.faces)
    bench.add("noise and holes over clean, per face", ratio, "x", None)
    peak, _ = bench.peak_and_floor(Arrays(points, arrays.faces[:0]), name, FEW)
    bench.add("memory of a cloud, per point", peak, "bytes", 180.0)


def _medians(
    jobs: dict[str, Callable[[], sf.Segmentation]], repeats: int, name: str
) -> dict[str, float]:
    """Return the median seconds of interleaved runs; "alone" must give the labels of "mesh"."""
    known: dict[str, str] = {}

    def accept(job: str, result: sf.Segmentation) -> None:
        found = known.setdefault(job.replace("alone", "mesh"), hash_labels(result.labels))
        require(found == hash_labels(result.labels), f"{name}: labels depend on the run")

    samples = interleaved(jobs, repeats, accept)
    return {job: median([sample.seconds for sample in taken]) for job, taken in samples.items()}


def _against_rivals(bench: _Bench, name: str, targets: dict[str, tuple[float, ...]]) -> None:
    """Add a row for each setting of the rivals; `targets` are those of their first settings."""
    arrays = build(name, bench.data)
    k = min(SOME, len(arrays.faces) // 4)
    rows = races.race_for_labels(name, arrays, k, bench.repeats, bench.expected)
    bench.races.extend(rows)
    for rival, asked in targets.items():
        raced = [row for row in rows if row["who"] == rival]
        for row, target in zip(raced, asked, strict=False):
            who = f"{rival} ({row['settings']}) over ours"
            what = f"{who}, {_place(name, arrays, k)}"
            bench.add(what, row["ratio"], "x (more is better)", target)


def _many(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    n_faces = len(arrays.faces)
    k = min(MANY, n_faces // 4)
    (seconds,) = bench.timed(arrays, name, k, ("defaults",))
    floor = bench.peak_and_floor(arrays, name, k)[1]
    bench.add(_place(name, arrays, k), seconds, "s", 2.0, floor)


def _large(bench: _Bench, name: str) -> None:
    arrays = build(name, bench.data)
    n_faces = len(arrays.faces)
    noisy = with_noise(arrays)
    jobs: dict[str, Callable[[], sf.Segmentation]] = {
        "clean": lambda: sf.segment(arrays, FEW),
        "noisy": lambda: sf.segment(noisy, FEW),
        "not smoothed": lambda: sf.segment(noisy, FEW, denoise=0),
    }
    seconds = _medians(jobs, bench.repeats, name)
    peak, floor = bench.peak_and_floor(arrays, name, FEW)
    place = f"{n_faces:,} faces, k = {FEW}"
    bench.add(place, seconds["clean"], "s", 1.6, floor)
    bench.add(f"{n_faces:,} faces, noisy, k = {FEW}", seconds["noisy"], "s", 2.0, floor)
    added = seconds["noisy"] - seconds["not smoothed"]
    bench.add(f"smoothing adds, {n_faces:,} faces", added, "s", 0.5)
    bench.add("memory of a mesh, per face", peak, "bytes", 90.0)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mesh.ply"
        sf.write_mesh(file, sf.Mesh(*arrays))
        row = processes.measure_command(name, file, bench.repeats)
    bench.add(f"{place}, PLY to PLY", row["seconds"], "s", 2.8)
