"""Records: JSON files that are written atomically and verified when read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..io.atomic import atomic_outputs

__all__ = ["Key", "Record", "read_record", "write_record"]

Key = Mapping[str, Any]
"""All that a record depends on: one that was made from another key is stale."""

Record = dict[str, Any]
"""What was found out; or, where that failed, why: under "reason"."""


def write_record(path: Path, key: Key, record: Record) -> None:
    """Write a record atomically: whenever the process ends, it is complete or absent.

    Raises
    ------
    ValueError
        If a number is not finite.
    OSError
        If it cannot be written: the folder is none, or another folder lies in the record's place.
    """
    whole = {"checksum": _checksum(key, record), "key": key, "record": record}
    text = json.dumps(whole, indent=1, allow_nan=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_outputs([path]) as (partial,):
        partial.write_text(text + "\n", encoding="utf-8")


def read_record(path: Path, key: Key) -> Record | None:
    """Return a record; None if there is none, it is damaged, or it was made from another key.

    Damage is what the checksum does not agree with, be it a single digit.
    """
    try:
        whole = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(whole, dict) or whole.get("key") != key:
        return None
    record = whole.get("record")
    if not isinstance(record, dict) or whole.get("checksum") != _checksum(key, record):
        return None
    return record


def _checksum(key: Key, record: Record) -> str:
    text = json.dumps([key, record], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
