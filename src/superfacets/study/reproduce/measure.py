"""From a task, one method on one mesh, to what is recorded for each number of regions."""

from __future__ import annotations

import base64
import platform
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import __version__
from ...clustering.segmentation import Segmentation
from ...metrics import evaluate
from ..sources import load
from ..tasks import Piece, Record
from .methods import METHODS, Setting
from .runs import Run


@dataclass(frozen=True)
class Task:
    """Runs that differ in the number of regions alone, so that they share what can be shared."""

    pieces: tuple[Piece, ...]
    pictured: frozenset[Run]
    """Runs whose labels are kept."""
    setting: Setting

    @property
    def first(self) -> Run:
        """The first run, which stands for all where they agree."""
        run: Run = self.pieces[0].subject
        return run

    @property
    def memory(self) -> int:
        """Bytes needed, where it is quadratic in the number of faces."""
        return METHODS[self.first.method].bytes_per_pair * self.first.source.n_faces**2

    def prepare(self) -> Callable[[Piece], Record]:
        """Load the mesh, and do what the method does once for all numbers of regions."""
        mesh, truths = load(self.first.source)
        start = time.perf_counter()
        segmenter = METHODS[self.first.method].prepare(mesh, self.setting)
        shared = time.perf_counter() - start

        def measure(piece: Piece) -> Record:
            run: Run = piece.subject
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


def pack_labels(labels: npt.NDArray[np.int32]) -> str:
    """Return labels as text that is short."""
    return base64.b64encode(zlib.compress(labels.astype("<i4").tobytes(), 9)).decode()


def unpack_labels(text: str) -> npt.NDArray[np.int32]:
    """Return the labels that `pack_labels` was given."""
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").astype(np.int32)
