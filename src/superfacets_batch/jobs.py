"""Run the jobs of a batch: one job per file."""

from __future__ import annotations

import errno
import hashlib
import socket
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from superfacets import __version__
from superfacets.kit import Content, FileOptions, StrPath, open_regular, reason_of
from superfacets.tools.segment_to_files import segment_to_files

Record = dict[str, Any]
"""Content of one line of the manifest."""

_STOPPING = (errno.ENOSPC, errno.EDQUOT)
"""Error codes of a full disk. They stop the batch, because all other files would fail, too."""


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


def run_job(job: BatchJob) -> Record:
    """Process one file, and return its record, even if the file failed.

    Raises an OSError only if the whole batch must stop, because the disk is full or this process
    has another version of the package.
    """
    version = job.head["version"]
    if version != __version__:
        raise ConnectionError(
            f"a worker on {socket.gethostname()} has superfacets {__version__}, but this process"
            f" has {version}: install the same version on both"
        )
    record = {**job.head, "sha256": None}
    try:
        return record | _done(job, record)
    except Exception as error:  # recorded, so that other files are processed
        if isinstance(error, OSError) and error.errno in _STOPPING:
            raise
        return record | {"error": reason_of(error)}


def failed(job: BatchJob, error: str) -> Record:
    """Return the record of a file that failed."""
    return {**job.head, "sha256": hash_of(job.path), "error": error}


def _done(job: BatchJob, record: Record) -> Record:
    """Process the file, set ``sha256`` in `record`, and return more entries for the record."""

    def set_hash(content: Content | None) -> None:

        record["sha256"] = (
            hash_of(job.path) if content is None else hashlib.sha256(content).hexdigest()
        )

    result, seconds = segment_to_files(job.path, job.files, job.options, on_content=set_hash)
    return {
        "cells": len(result.labels),
        "regions": result.n_segments,
        "seconds": {stage: round(spent, 4) for stage, spent in seconds.items()},
        "outputs": {name: hash_of(Path(job.folder, name)) for name in job.outputs},
    }


def hash_of(path: StrPath) -> str | None:
    """Return the SHA-256 hash of a file, or None if it is not readable."""
    try:
        with open_regular(Path(path)) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None
