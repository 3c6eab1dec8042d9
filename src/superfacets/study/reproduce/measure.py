"""From a task, one method on one mesh, to a record for each number of regions."""

from __future__ import annotations

import platform
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...clustering.loop import Segmentation
from ...mesh.triangle_mesh import Mesh
from ...metrics import GroundTruths, evaluate
from .methods import METHODS, Segmenter, Setting
from .records import pack_labels, record_path, write_record
from .runs import Run
from .sources import load

__all__ = ["Task", "record_failure"]


@dataclass(frozen=True)
class Task:
    """Runs that differ in the number of regions alone, so that they share what can be shared."""

    runs: tuple[Run, ...]
    pictured: frozenset[Run]
    """Runs whose labels are kept."""
    setting: Setting
    folder: Path
    """Where records go."""

    @property
    def memory(self) -> int:
        """Bytes needed, where it is quadratic in the number of faces."""
        first = self.runs[0]
        return METHODS[first.method].bytes_per_pair * first.source.n_faces**2

    def run(self) -> None:
        """Write a record for each run, be it of a failure."""
        first = self.runs[0]
        start = time.perf_counter()
        try:
            mesh, truths = load(first.source)
            start = time.perf_counter()
            segmenter = METHODS[first.method].prepare(mesh, self.setting)
        except Exception as error:  # of any method: it is named, and other tasks go on
            for run in self.runs:
                record_failure(self, run, _reason(error))
            return
        shared = time.perf_counter() - start
        for run in self.runs:
            try:
                self._measure(run, mesh, truths, segmenter, shared)
            except Exception as error:
                record_failure(self, run, _reason(error))

    def _measure(
        self,
        run: Run,
        mesh: Mesh,
        truths: GroundTruths,
        segmenter: Segmenter,
        shared: float,
    ) -> None:
        start = time.perf_counter()
        result = segmenter(run.k)
        end = time.perf_counter()
        metrics = evaluate(mesh, result.labels, truths)
        record = (
            _head(self, run)
            | _facts(result)
            | {
                "seconds": {
                    **result.timings,
                    "total": shared + end - start,
                    "metrics": time.perf_counter() - end,
                },
                "metrics": metrics,
            }
        )
        if run in self.pictured:
            record["labels"] = pack_labels(result.labels)
        write_record(record_path(self.folder, run), record)


def record_failure(task: Task, run: Run, reason: str) -> None:
    """Write that a run failed, and why."""
    write_record(record_path(task.folder, run), _head(task, run) | {"reason": reason})


def _reason(error: Exception) -> str:
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _head(task: Task, run: Run) -> dict[str, Any]:
    return {
        "key": run.key(task.setting.most_segments),
        "model": run.source.name,
        "category": run.source.category,
        "faces": run.source.n_faces,
        "ground_truths": run.source.n_ground_truths,
        "method": run.method,
        "alpha": run.alpha,
        "k": run.k,
        "versions": {
            "superfacets": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
    }


def _facts(result: Segmentation) -> dict[str, Any]:
    return {
        "n_segments": result.n_segments,
        "n_iter": result.n_iter,
        "stop_reason": result.stop_reason,
        "params": result.params,
    }
