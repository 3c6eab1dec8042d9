"""The command `superfacets batch` on several numbers of workers, process and all."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from .checks import require
from .clock import interleaved, median, summary

__all__ = ["measure_batch", "table"]


def measure_batch(folder: Path, workers: Sequence[int], repeats: int) -> list[dict[str, Any]]:
    """Return a row for each number of workers: seconds, processor time, gain over the first.

    The runs take turns, each into a folder of its own, and all must write the same bytes. What
    other processes do to the wall time they do less to the processor time, which all processes of
    a command have together.
    """
    with tempfile.TemporaryDirectory() as scratch:
        outputs = {count: Path(scratch, str(count)) for count in workers}
        expected: dict[str, bytes] = {}

        def accept(count: int, spent: float) -> float:
            found = _results(outputs[count])
            expected.update({} if expected else found)
            require(found == expected, f"{count} workers write other results")
            for path in sorted(outputs[count].rglob("*"), reverse=True):
                path.rmdir() if path.is_dir() else path.unlink()
            return spent

        jobs = {count: partial(_run, folder, outputs[count], count) for count in workers}
        samples = interleaved(jobs, repeats, accept)
    rows = []
    for count in workers:
        row = summary([sample.seconds for sample in samples[count]])
        spent = median([sample.fact for sample in samples[count]])
        rows.append({"workers": count, "files": len(expected), **row, "processor_seconds": spent})
    return [row | {"gain": rows[0]["seconds"] / row["seconds"]} for row in rows]


def _run(folder: Path, output: Path, n_workers: int) -> float:
    """Run the command, and return the processor time of all of its processes."""
    before = _spent()
    command = ["-m", "superfacets", "batch", str(folder), "-o", str(output), "--to", "npy", "-q"]
    subprocess.run([sys.executable, *command, "--workers", str(n_workers)], check=True)
    return _spent() - before


def _spent() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _results(folder: Path) -> dict[str, bytes]:
    """The bytes of all label files, by name."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*.npy")}


def table(rows: Sequence[dict[str, Any]]) -> str:
    """The rows as Markdown."""
    lines = [
        "| workers | files | seconds | fastest | processor | gain |",
        "|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['workers']} | {row['files']} | {row['seconds']:.2f} | {row['fastest']:.2f} |"
        f" {row['processor_seconds']:.2f} | {row['gain']:.2f} |"
        for row in rows
    ]
    return "\n".join(lines)
