"""Times of the command `superfacets batch`, as a whole process, with several numbers of workers."""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from research.table_writer import markdown_table

from .checks import require
from .clock import interleaved, median, summary

_WHOLE = """
import ctypes, os, sys
ctypes.CDLL(None).prctl(36, 1)  # PR_SET_CHILD_SUBREAPER
command = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
try:
    while True:
        pid, status = os.wait()
        if pid == command:
            result = os.waitstatus_to_exitcode(status)
except ChildProcessError:
    sys.exit(result)
"""
"""Python program that runs a command, and waits for all processes of the command. These processes
become children of the program, so that their processor time is counted."""


def measure_batch(
    folder: Path, workers: Sequence[int], repeats: int, n_files: int | None = None
) -> list[dict[str, Any]]:
    """Return a row for each number of workers: seconds, processor time, speedup over the first row.

    Runs alternate between the numbers of workers, and must all write the same bytes. The processor
    time is the sum over all processes of a command. Other programs on the machine affect it less
    than the wall time. The batch consists of all files in `folder`, or of `n_files` copies of these
    files.
    """
    with tempfile.TemporaryDirectory() as scratch:
        if n_files is not None:
            folder = _copied(folder, Path(scratch, "copies"), n_files)
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


def _copied(folder: Path, copies: Path, n_files: int) -> Path:
    """Copy the files repeatedly until there are `n_files` copies; return their folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    copies.mkdir()
    for number in range(n_files):
        file = files[number % len(files)]
        shutil.copyfile(file, copies / f"{number}{file.suffix}")
    return copies


def _run(folder: Path, output: Path, n_workers: int) -> float:
    """Run the command, and return the processor time of all of its processes."""
    before = _spent()
    command = ["-m", "superfacets", "batch", str(folder), "-o", str(output), "--to", "npy", "-q"]
    command = [sys.executable, "-P", *command, "--workers", str(n_workers)]
    subprocess.run([sys.executable, "-I", "-S", "-c", _WHOLE, *command], check=True)
    return _spent() - before


def _spent() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _results(folder: Path) -> dict[str, bytes]:
    """Return the content of all label files in a folder, keyed by path relative to the folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*.npy")}


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Return the rows as a table in Markdown."""
    times = ("seconds", "fastest", "processor_seconds", "gain")
    return markdown_table(
        ["workers", "files", *times],
        ([row["workers"], row["files"], *(f"{row[name]:.2f}" for name in times)] for row in rows),
    )
