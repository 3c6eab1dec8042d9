"""Times of `segment_tiled` on one and two workers, and simulated times for larger meshes.

    python -m benchmarks.tiled compare scan.ply
    python -m benchmarks.tiled measure scan.ply -o measured.json
    python -m benchmarks.tiled plan measured.json

`compare` times `superfacets segment` with and without tiles, in interleaved runs. `measure`
segments a mesh in tiles with all arrays on disk. For each pass over the tiles, it records the
processor time, and the bytes that are read and written per face. `plan` simulates the same passes
for more faces and more workers.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import click
import numpy as np

from superfacets.batches.mapping import Run, Work, open_run
from superfacets.tiles import segmenting
from superfacets.tiles.store import TileStore
from superfacets.workers.threads import Job

from .checks import require
from .clock import interleaved, median

IO_FILE = Path("/proc/self/io")
"""File in which Linux counts the bytes that a process reads and writes."""


@dataclass(frozen=True)
class Pass:
    """Costs of one pass over the tiles of a mesh, or over other work items.

    Attributes
    ----------
    name : str
        Name of the function that processes a tile or work item.
    jobs : int
        Number of tiles or work items that this pass processes.
    pieces : int
        Number of all tiles of the mesh. For a pass over other work items, the same as ``jobs``.
    seconds : float
        Processor time in seconds, per face of the mesh.
    n_read, n_written : float
        Bytes read and written, per face of the mesh.
    wall : float
        Wall time of the pass in seconds.
    """

    name: str
    jobs: int
    pieces: int
    seconds: float
    n_read: float
    n_written: float
    wall: float


@dataclass(frozen=True)
class Measured:
    """Costs of a run in tiles.

    Attributes
    ----------
    n_faces, n_segments, tile_size, workers : int
    passes : list of Pass
    driver : dict of str to float
        Processor time of the main process, in seconds per face, for each stage. The time in passes
        is not included, except for the time to distribute tiles to several workers.
    wall : float
        Wall time of the run in seconds.
    halo : float
        Estimated size of a halo, as a fraction of the size of its tile: mean fraction of the cells
        of a tile that other tiles load as part of their halos.
    """

    n_faces: int
    n_segments: int
    tile_size: int
    workers: int
    passes: list[Pass]
    driver: dict[str, float]
    wall: float
    halo: float


class _Recorder(Run):
    """A `Run` that records the costs of each pass."""

    def __init__(self, run: Run, n_faces: int) -> None:
        self.run = run
        self.n_faces = n_faces
        self.passes: list[Pass] = []
        self.halos: list[float] = []

    def __call__(
        self, work: Work, store: Any, jobs: Sequence[Job], *, n_before: int = 0, n_after: int = 0
    ) -> list[Any]:
        begin, before = time.perf_counter(), _spent()
        results = self.run(work, store, jobs, n_before=n_before, n_after=n_after)
        wall = time.perf_counter() - begin
        seconds, n_read, n_written = (
            (after - first) / self.n_faces for after, first in zip(_spent(), before, strict=True)
        )
        n_pieces = store.n_tiles if isinstance(store, TileStore) else len(jobs)
        self.passes.append(
            Pass(work.__name__.strip("_"), len(jobs), n_pieces, seconds, n_read, n_written, wall)
        )
        if isinstance(store, TileStore) and store.has(0, "outer/cells"):
            self.halos = [
                len(store.read(tile, "outer/cells")) / store.size(tile)
                for tile in range(store.n_tiles)
            ]
        return results


def _spent() -> tuple[float, float, float]:
    """Return the processor time in seconds, and the bytes read and written, of this process."""
    counts = dict(line.split(": ") for line in IO_FILE.read_text().splitlines())
    return time.process_time(), float(counts["rchar"]), float(counts["wchar"])


def measure(
    path: Path, n_faces: int, n_segments: int, tile_size: int, workers: int, scratch: Path
) -> Measured:
    """Segment a file in tiles, and return the costs of the run."""
    recorders: list[_Recorder] = []

    @contextlib.contextmanager
    def recorded(*args: Any) -> Iterator[_Recorder]:
        with open_run(*args) as run:
            recorders.append(_Recorder(run, n_faces))
            started.append(time.perf_counter())
            yield recorders[0]

    def on_stage(stage: str) -> None:
        in_passes = sum(done.seconds for done in recorders[0].passes) if workers == 1 else 0.0
        marks.append((stage, time.process_time() / n_faces - in_passes))

    started: list[float] = []  # time at which all workers have started
    marks: list[tuple[str, float]] = []  # stages, and processor time per face when they begin
    with mock.patch.object(segmenting, "open_run", recorded):
        segmenting.segment_tiled(
            path, n_segments, tile_size=tile_size, workers=workers, scratch=scratch, cache=0,
            n_threads=1, on_stage=on_stage,
        )  # fmt: skip
    wall = time.perf_counter() - started[0]
    on_stage("end")
    found = recorders[0]
    driver: dict[str, float] = {}
    for (stage, begin), (_, end) in itertools.pairwise(marks):
        driver[stage] = driver.get(stage, 0.0) + end - begin
    halo = sum(found.halos) / max(1, len(found.halos))
    return Measured(n_faces, n_segments, tile_size, workers, found.passes, driver, wall, halo)


@dataclass(frozen=True)
class Cluster:
    """Number and speed of the workers of a cluster.

    Attributes
    ----------
    workers : int
        Number of threads, each of which works on one tile at a time.
    bandwidth : float
        Bytes per second that one worker reads or writes.
    shared : float
        Bytes per second that all workers read or write together.
    dispatch : float
        Seconds that the scheduler needs to send a tile and to receive its result.
    """

    workers: int
    bandwidth: float = 1e9
    shared: float = 20e9
    dispatch: float = 0.005


def simulate(
    measured: Measured, n_faces: int, tile_size: int, cluster: Cluster
) -> tuple[float, float]:
    """Return simulated seconds for a mesh, and the part of these seconds in the main process.

    Passes run one after the other. In a pass, each tile is sent to the first free worker. The
    duration of a tile is its processor time, plus the time to transfer its bytes. The size of a
    halo, relative to its tile, is proportional to the square root of 1 / (size of the tile).
    """
    seconds = 0.0
    n_tiles = math.ceil(n_faces / tile_size)
    halo = measured.halo * math.sqrt(measured.tile_size / tile_size)
    growth = (1 + halo) / (1 + measured.halo)
    for done in measured.passes:
        share = done.jobs / max(done.pieces, 1)  # less than 1 if some tiles do not need the pass
        n_jobs = max(1, round(n_tiles * share))
        per_job = n_faces / n_jobs * growth
        seconds += _makespan(
            n_jobs, per_job * done.seconds, per_job * (done.n_read + done.n_written), cluster
        )
    driver = sum(measured.driver.values()) * n_faces
    return seconds + driver, driver


def _makespan(n_jobs: int, seconds: float, n_bytes: float, cluster: Cluster) -> float:
    """Return the seconds until `n_jobs` equal jobs are finished.

    A job takes `seconds` of processor time, and transfers `n_bytes` bytes.
    """
    n_busy = min(n_jobs, cluster.workers)
    bandwidth = min(cluster.bandwidth, cluster.shared / n_busy)
    duration = seconds + n_bytes / bandwidth
    free = [0.0] * n_busy
    handed_out = 0.0
    for _ in range(n_jobs):
        handed_out += cluster.dispatch
        begin = max(handed_out, heapq.heappop(free))
        heapq.heappush(free, begin + duration)
    return max(free)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def commands() -> None:
    """Measure runs in tiles, and simulate larger runs."""


@commands.command("measure")
@click.argument("mesh", type=click.Path(path_type=Path, exists=True))
@click.option("-n", "--n-segments", type=int, default=2_000, show_default=True)
@click.option("--tile-size", type=int, default=1 << 18, show_default=True)
@click.option("--workers", type=int, multiple=True, default=(1, 2), show_default=True)
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True)
def measure_command(
    mesh: Path, n_segments: int, tile_size: int, workers: tuple[int, ...], output: Path
) -> None:
    """Run MESH in tiles on these numbers of workers, and write the costs of each pass."""
    os.environ["SUPERFACETS_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as folder:
        n_faces = _count_faces(mesh, Path(folder))
        runs = [
            measure(mesh, n_faces, n_segments, tile_size, count, Path(folder)) for count in workers
        ]
    output.write_text(json.dumps([asdict(run) for run in runs], indent=1))
    for run in runs:
        click.echo(f"{run.workers} workers: {run.wall:.2f} s, halo {run.halo:.3f}")


@commands.command("compare")
@click.argument("mesh", type=click.Path(path_type=Path, exists=True))
@click.option("-n", "--n-segments", type=int, default=2_000, show_default=True)
@click.option("--repeats", type=int, default=5, show_default=True)
def compare_command(mesh: Path, n_segments: int, repeats: int) -> None:
    """Time `superfacets segment` from MESH to labels with and without --tiled."""
    with tempfile.TemporaryDirectory() as folder:
        files = {name: Path(folder) / f"{name}.npy" for name in ("memory", "tiles")}

        def run(name: str) -> None:
            command = [sys.executable, "-P", "-m", "superfacets", "segment", str(mesh), "-q"]
            command += ["-n", str(n_segments), "-o", str(files[name])]
            command += ["--tiled"] if name == "tiles" else []
            subprocess.run(command, check=True)

        def accept(*_: object) -> None:
            found = [np.load(file) for file in files.values() if file.exists()]
            require(np.array_equal(found[0], found[-1]), "labels of tiles differ")

        samples = interleaved({name: partial(run, name) for name in files}, repeats, accept)
    alone, tiled = ([sample.seconds for sample in samples[name]] for name in files)
    click.echo(f"in memory {median(alone):.2f} s, in tiles {median(tiled):.2f} s (medians)")
    ratios = [after / before for before, after in zip(alone, tiled, strict=True)]
    click.echo(f"ratio {median(ratios):.2f}, in each round {' '.join(f'{r:.2f}' for r in ratios)}")


def _count_faces(mesh: Path, folder: Path) -> int:
    from superfacets.tiles.opening import open_pieces
    from superfacets.workers.scratch import scratch_folder

    with scratch_folder(folder) as scratch:
        return open_pieces(mesh, scratch, for_workers=True).n_cells


@commands.command("plan")
@click.argument("measured", type=click.Path(path_type=Path, exists=True))
@click.option("--tile-size", type=int, default=1 << 20, show_default=True)
@click.option(
    "--bandwidth",
    type=float,
    default=1e9,
    show_default=True,
    help="Bytes per second of one worker.",
)
@click.option(
    "--shared",
    type=float,
    default=20e9,
    show_default=True,
    help="Bytes per second of all workers together.",
)
@click.option(
    "--dispatch",
    type=float,
    default=0.005,
    show_default=True,
    help="Seconds for sending a tile and receiving its result.",
)
@click.option("--spread", multiple=True, help="Stage of the driver to simulate on the workers.")
def plan_command(
    measured: Path, tile_size: int, bandwidth: float, shared: float, dispatch: float,
    spread: tuple[str, ...],
) -> None:  # fmt: skip
    """Print the passes in the file MEASURED, and simulated times for more faces and workers."""
    runs = [_run_of(facts) for facts in json.loads(measured.read_text())]
    alone = next(run for run in runs if run.workers == 1)
    _print_passes(alone)
    click.echo("\n| workers | measured, s | simulated, s |\n|---|---|---|")
    for run in runs:
        cluster = Cluster(run.workers, bandwidth, shared, dispatch)
        simulated, _ = simulate(alone, run.n_faces, run.tile_size, cluster)
        click.echo(f"| {run.workers} | {run.wall:.1f} | {simulated:.1f} |")
    alone = _spread(alone, spread)
    counts = (1, 2, 10, 100, 1_000)
    click.echo(f"\n| faces | {' | '.join(f'{count:,} workers' for count in counts)} | driver |")
    click.echo("|---" * (len(counts) + 2) + "|")
    for n_faces in (10**7, 10**8, 10**9, 10**10):
        cells = []
        for count in counts:
            cluster = Cluster(count, bandwidth, shared, dispatch)
            total, driver = simulate(alone, n_faces, tile_size, cluster)
            cells.append(_shown(total))
        click.echo(f"| {n_faces:.0e} | {' | '.join(cells)} | {_shown(driver)} |")


def _spread(run: Measured, stages: Sequence[str]) -> Measured:
    """Return a run in which the given stages of the main process are passes over the tiles."""
    n_tiles = math.ceil(run.n_faces / run.tile_size)
    more = [Pass(stage, n_tiles, n_tiles, run.driver[stage], 0.0, 0.0, 0.0) for stage in stages]
    left = {stage: spent for stage, spent in run.driver.items() if stage not in stages}
    return replace(run, passes=[*run.passes, *more], driver=left)


def _run_of(facts: dict[str, Any]) -> Measured:
    return Measured(**{**facts, "passes": [Pass(**done) for done in facts["passes"]]})


def _print_passes(run: Measured) -> None:
    """Print the costs of each pass, summed over all passes with the same name."""
    click.echo("| pass | times | ns per face | bytes read per face | bytes written |")
    click.echo("|---|---|---|---|---|")
    names = dict.fromkeys(done.name for done in run.passes)
    for name in names:
        of_name = [done for done in run.passes if done.name == name]
        numbers = [
            sum(getattr(done, what) for done in of_name) * unit
            for what, unit in (("seconds", 1e9), ("n_read", 1), ("n_written", 1))
        ]
        click.echo(f"| `{name}` | {len(of_name)} | {' | '.join(f'{n:.0f}' for n in numbers)} |")
    for stage, seconds in run.driver.items():
        click.echo(f"| driver, {stage} | | {1e9 * seconds:.0f} | | |")


def _shown(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


if __name__ == "__main__":
    commands(prog_name="python -m benchmarks.tiled")
