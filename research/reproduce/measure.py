"""Carry out runs. A run segments one mesh with one method into a given number of regions."""

from __future__ import annotations

import base64
import platform
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from superfacets import __version__
from superfacets.base.types import Ints
from superfacets.clustering.result import Segmentation
from superfacets.metrics import evaluate

from ..sources import StudyMesh, load
from ..tasks import Record, WorkItem
from .methods import METHODS, Setting

_RECORD_VERSION = 2  # version of the content of records; other versions are not used


@dataclass(frozen=True)
class Run:
    """An application of one method to one mesh, with one alpha and one number of regions k."""

    source: StudyMesh
    method: str
    alpha: float | None  # None if the method has no parameter alpha
    k: int

    def setting(self, most_segments: int, max_memory: int) -> Setting:
        """Return the settings of the method for this run."""
        seed = self.source.number or zlib.crc32(self.source.name.encode())
        return Setting(
            alpha=self.alpha, most_segments=most_segments, seed=seed, max_memory=max_memory
        )

    def key(self, most_segments: int) -> dict[str, Any]:
        """Return all inputs that the results depend on. Records with another key are outdated."""
        method = METHODS[self.method]
        setting = self.setting(most_segments, max_memory=0)
        return {
            "record": _RECORD_VERSION,
            "superfacets": __version__,
            "mesh": self.source.digest,
            "method": [self.method, method.version],
            "settings": {name: getattr(setting, name) for name in method.depends_on},
            "k": self.k,
        }

    def item(self, folder: Path, most_segments: int) -> WorkItem:
        """Return the work item of this run: the run, and path and key of its record.

        The path is ``folder/METHOD/MESH/alpha-A_k-K.json``.
        """
        alpha = "none" if self.alpha is None else f"{self.alpha:g}"
        path = folder / self.method / self.source.name / f"alpha-{alpha}_k-{self.k}.json"
        return WorkItem(self, path, self.key(most_segments))


@dataclass(frozen=True)
class RunTask:
    """Task of a worker process: runs that differ only in k, and share preparation."""

    items: tuple[WorkItem, ...]
    pictured: frozenset[Run]  # runs whose records must contain labels, for pictures
    setting: Setting

    @property
    def first(self) -> Run:
        """First run of the task. The other runs of the task differ only in k."""
        run: Run = self.items[0].subject
        return run

    @property
    def memory(self) -> int:
        """Estimated memory in bytes for methods with quadratic memory, and 0 for other methods."""
        return METHODS[self.first.method].bytes_per_pair * self.first.source.n_faces**2

    def prepare(self) -> Callable[[WorkItem], Record]:
        """Load the mesh, do the work that all runs share, and return a function for one run."""
        mesh, truths = load(self.first.source)
        start = time.perf_counter()
        segmenter = METHODS[self.first.method].prepare(mesh, self.setting)
        shared = time.perf_counter() - start

        def measure(item: WorkItem) -> Record:
            run: Run = item.subject
            start = time.perf_counter()
            result = segmenter(run.k)
            end = time.perf_counter()
            metrics = evaluate(mesh, result.labels, truths)
            seconds = {
                **result.timings,
                "total": shared + end - start,
                "metrics": time.perf_counter() - end,
            }
            record = _head(run) | _facts(result) | {"seconds": seconds, "metrics": metrics}
            if run in self.pictured:
                record["labels"] = pack_labels(result.labels)
            return record

        return measure


def _head(run: Run) -> dict[str, Any]:
    return {
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


def pack_labels(labels: Ints) -> str:
    """Encode labels as base64 text of their compressed bytes."""
    return base64.b64encode(zlib.compress(labels.astype("<i4").tobytes(), 9)).decode()


def unpack_labels(text: str) -> Ints:
    """Return the labels in a text from `pack_labels`."""
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").astype(np.int32)
