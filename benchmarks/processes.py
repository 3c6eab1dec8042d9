"""Times of whole processes: the import, and the command from file to file."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import superfacets as sf

from .checks import require
from .clock import interleaved, median, summary


def measure_imports(repeats: int) -> dict[str, Any]:
    """Return the times of ``import numpy`` and ``import superfacets``.

    ``more_ms`` is the median difference of the two times in milliseconds. Each import runs in a
    separate process, and the two imports alternate. A first pair is not counted: it fills the
    caches of the file system.
    """
    jobs = {
        module: partial(_run, ["-c", f"import {module}"]) for module in ("numpy", "superfacets")
    }
    samples = interleaved(jobs, repeats, lambda *_: None)
    seconds = {name: [sample.seconds for sample in samples[name]] for name in jobs}
    differences = np.subtract(seconds["superfacets"], seconds["numpy"]).tolist()
    return {
        "numpy": summary(seconds["numpy"]),
        "superfacets": summary(seconds["superfacets"]),
        "more_ms": 1e3 * median(differences),
    }


def measure_command(mesh: str, file: Path, repeats: int) -> dict[str, Any]:
    """Return the time of ``superfacets segment`` from PLY to PLY, as a whole process.

    The labels in the file that the command writes must equal the labels of `superfacets.segment`.
    """
    labels = sf.segment(file).labels
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "labeled.ply"

        def accept(*_: object) -> None:
            require(np.array_equal(sf.read_labels(output), labels), "the command's labels differ")
            output.unlink()

        command = ["-m", "superfacets", "segment", str(file), "-o", str(output)]
        samples = interleaved({mesh: partial(_run, command)}, repeats, accept)
    row = {"mesh": mesh, "faces": len(labels)}
    return row | summary([sample.seconds for sample in samples[mesh]])


def _run(arguments: list[str]) -> None:
    # Without -P, Python would import modules from the current folder.
    subprocess.run([sys.executable, "-P", *arguments], check=True, capture_output=True)
