"""A JSON file for each run: whole or not there, and read back only if it is still true."""

from __future__ import annotations

import base64
import hashlib
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ...io.atomic import atomic_outputs
from .runs import Run

__all__ = [
    "is_blocked",
    "pack_labels",
    "read_record",
    "record_path",
    "unpack_labels",
    "write_record",
]


def record_path(folder: Path, run: Run) -> Path:
    """Return where the record of a run lies: ``METHOD/MESH/alpha-A_k-K.json``."""
    alpha = "none" if run.alpha is None else f"{run.alpha:g}"
    return folder / run.method / run.source.name / f"alpha-{alpha}_k-{run.k}.json"


def is_blocked(folder: Path, run: Run) -> bool:
    """Whether a folder lies where the record belongs: it is not ours to remove."""
    return record_path(folder, run).is_dir()


def write_record(path: Path, record: dict[str, Any]) -> None:
    """Write a record such that it is whole, or not there, whenever the process ends.

    Raises
    ------
    ValueError
        If a number is not finite.
    OSError
        If it cannot be written.
    """
    text = json.dumps(record | {"checksum": _checksum(record)}, indent=1, allow_nan=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_outputs([path]) as (partial,):
        partial.write_text(text + "\n", encoding="utf-8")


def read_record(path: Path, key: dict[str, Any]) -> dict[str, Any] | None:
    """Return a record; None if there is none, it is damaged, or it was made from something else."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(record, dict):
            return None
        checksum = record.pop("checksum", None)
        is_as_written = checksum == _checksum(record)
    except (OSError, ValueError, RecursionError):  # of what may be anything
        return None
    return record if is_as_written and record.get("key") == key else None


def _checksum(record: dict[str, Any]) -> str:
    """Of all that a record says, whatever the order and the blanks."""
    text = json.dumps(record, sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def pack_labels(labels: npt.NDArray[np.int32]) -> str:
    """Return labels as text that is short."""
    return base64.b64encode(zlib.compress(labels.astype("<i4").tobytes(), 9)).decode()


def unpack_labels(text: str) -> npt.NDArray[np.int32]:
    """Return the labels that `pack_labels` was given."""
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").astype(np.int32)
