"""Run the jobs of a batch, one per file, and keep their records in its manifest."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from superfacets import __version__, kit
from superfacets.kit import Content, FileOptions, open_regular

Record = dict[str, Any]  # content of one line of the manifest

_STOPPING = (errno.ENOSPC, errno.EDQUOT)  # the disk is full, so all other files would fail, too


@dataclass(frozen=True)
class BatchJob:
    """A file to segment, with options and paths of results. Jobs are pickled for workers."""

    name: str  # name of the record: path of the file relative to the input folder
    head: Mapping[str, Any]  # entries of the record: name, input, version, params
    path: str
    folder: str
    outputs: tuple[str, ...]  # paths of results, relative to `folder`, with slashes
    options: FileOptions

    @property
    def files(self) -> list[Path]:
        """Paths of the results."""
        return [Path(self.folder, name) for name in self.outputs]

    def with_threads(self, n_threads: int) -> BatchJob:
        """Return the job with `n_threads`, or the same job if its options contain `n_threads`."""
        keywords = {"n_threads": n_threads, **self.options.keywords}
        return replace(self, options=replace(self.options, keywords=keywords))


def other_version(worker: str, version: str, own: str) -> ConnectionError:
    """Return the error for a worker whose version differs from the version of this process."""
    problem = f"has superfacets {version}, but this process has {own}"
    return ConnectionError(f"{worker} {problem}: install the same version on both")


def run_job(job: BatchJob) -> Record:
    """Process one file, and return its record, even if the file failed.

    Raises an OSError only if the batch must stop: the disk is full, or versions differ.
    """
    if job.head["version"] != __version__:
        who = f"a worker on {socket.gethostname()}"
        raise other_version(who, __version__, job.head["version"])
    record = {**job.head, "sha256": None}

    def set_hash(content: Content | None) -> None:
        known = None if content is None else hashlib.sha256(content).hexdigest()
        record["sha256"] = known or hash_of(job.path)

    try:
        result, seconds, notes = job.options.segment_to_files(job.path, job.files, set_hash)
        return record | {
            "cells": len(result.labels), "regions": result.n_segments, "notes": notes,
            "seconds": {stage: round(spent, 4) for stage, spent in seconds.items()},
            "outputs": {name: hash_of(Path(job.folder, name)) for name in job.outputs},
        }  # fmt: skip
    except Exception as error:  # recorded, so that other files are processed
        if isinstance(error, OSError) and error.errno in _STOPPING:
            raise
        return record | {"error": kit.reason_of(error)}


def failed(job: BatchJob, error: str) -> Record:
    """Return the record of a file that failed."""
    return {**job.head, "sha256": hash_of(job.path), "error": error}


def hash_of(path: str | Path) -> str | None:
    """Return the SHA-256 hash of a file, or None if it is not readable."""
    try:
        with open_regular(Path(path)) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


class Manifest:
    """A file of records, which only one process may use at a time, in a `with` block.

    `records` maps the name of each input file to its last record. Damaged lines are ignored, for
    example an incomplete last line from a killed process; `notes` has a message for each other
    damaged line. Damaged and replaced lines are removed before the first `append`, and at the end
    of the block unless it fails. Lines with ``begun`` count processes that began with a file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: int | None = None
        self.notes: list[str] = []
        self.records: dict[str, Record] = {}
        self._begun: dict[str, int] = {}
        self._is_tidy = True
        content = b""
        with suppress(FileNotFoundError), os.fdopen(kit.open_own(path, os.O_RDONLY), "rb") as file:
            content = file.read()
        for number, line in enumerate(content.splitlines(keepends=True), 1):
            record = _record_of(line)
            self._is_tidy &= record is not None and "begun" not in record
            if record is not None:
                self._take(record)
            elif line.endswith(b"\n"):
                problem = f"line {number} is damaged: its input file is processed again"
                self.notes.append(f"{path}: {problem}")

    def __enter__(self) -> Manifest:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._file is not None:
            os.close(self._file)
        if not self._is_tidy and kind is None:
            self._rewrite()

    def append(self, record: Record) -> None:
        """Write a record in place of an earlier one. An OSError leaves the file unchanged."""
        self._write(record)
        self._take(record)

    def count_begin(self, name: str, change: int = 1) -> None:
        """Write to the disk that this process begins with a file; a `change` of -1 reverts this."""
        self._write({"name": name, "begun": self.n_begun(name) + change})
        self._begun[name] = self.n_begun(name) + change
        self._is_tidy = False

    def n_begun(self, name: str) -> int:
        """Return how many processes have ended while processing a file that has no record."""
        return self._begun.get(name, 0)

    def _take(self, record: Record) -> None:
        name = record["name"]
        if "begun" in record:
            self._begun[name] = record["begun"]
        else:
            self._is_tidy &= not self._begun.pop(name, 0) and name not in self.records
            self.records[name] = record

    def _write(self, content: Record) -> None:
        if self._file is None:
            if not self._is_tidy:
                self._rewrite()
            self._file = kit.open_own(self._path, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        size = os.fstat(self._file).st_size
        line = json.dumps(content).encode() + b"\n"
        try:
            while line:  # `os.write` may write only some of the bytes
                line = line[os.write(self._file, line) :]
            os.fsync(self._file)
        except OSError as error:
            os.ftruncate(self._file, size)
            raise OSError(error.errno, error.strerror, str(self._path)) from None

    def _rewrite(self) -> None:
        begun = ({"name": name, "begun": n} for name, n in self._begun.items() if n)
        lines = (json.dumps(record) + "\n" for record in (*self.records.values(), *begun))
        with kit.atomic_outputs([self._path]) as (partial,), partial.open("wb") as file:
            file.write("".join(lines).encode())
            file.flush()
            os.fsync(file.fileno())
        self._is_tidy = True


def _record_of(line: bytes) -> Record | None:
    """Return the record in a line, or None if the line is incomplete or damaged."""
    try:
        record = json.loads(line)
    except (ValueError, RecursionError):
        return None
    kinds = {"name": str, "outputs": dict, "begun": int}  # only a name is required
    is_record = isinstance(record, dict) and all(
        isinstance(record.get(key), kind) for key, kind in kinds.items() if key in {"name", *record}
    )
    return record if is_record and line.endswith(b"\n") else None
