"""A JSON file for each run: whole or not there, and read back only if it is still true."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...io.atomic import atomic_outputs
from .runs import Run

__all__ = [
    "pack_labels", "read_record", "record_path", "remove_leftovers", "unpack_labels",
    "write_record",
]  # fmt: skip


def record_path(folder: Path, run: Run) -> Path:
    """Return where the record of a run lies: ``METHOD/MESH/alpha-A_k-K.json``."""
    alpha = "none" if run.alpha is None else f"{run.alpha:g}"
    return folder / run.method / run.source.name / f"alpha-{alpha}_k-{run.k}.json"


def write_record(path: Path, record: dict[str, Any]) -> None:
    """Write a record such that it is whole, or not there, whenever the process ends."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_outputs([path]) as (partial,):
        partial.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def read_record(path: Path, key: dict[str, Any]) -> dict[str, Any] | None:
    """Return a record; None if there is none, it is damaged, or it was made from something else."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(record, dict) or record.get("key") != key:
        return None
    is_whole = {"metrics", "seconds"} <= record.keys() or "reason" in record
    return record if is_whole else None


def remove_leftovers(folder: Path) -> None:
    """Remove what writers that were killed left behind."""
    for path in folder.rglob(".*.tmp"):
        path.unlink(missing_ok=True)


def pack_labels(labels: npt.NDArray[np.int32]) -> str:
    """Return labels as text that is short."""
    return base64.b64encode(zlib.compress(labels.astype("<i4").tobytes(), 9)).decode()


def unpack_labels(text: str) -> npt.NDArray[np.int32]:
    """Return the labels that `pack_labels` was given."""
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").astype(np.int32)
