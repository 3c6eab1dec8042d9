"""Run the jobs of a batch (one job per file), and estimate how much memory they need."""

from __future__ import annotations

import errno
import hashlib
import socket
import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from superfacets import __version__
from superfacets.base.errors import MeshError, reason_of
from superfacets.base.timing import timed
from superfacets.base.types import Array
from superfacets.files.atomic import StrPath
from superfacets.files.attributes import MeshAttributes
from superfacets.files.guards import known_ending, open_regular, read_content
from superfacets.files.readers.labels import parse_labels
from superfacets.files.readers.read import cell_ending, parse_cells_and_attributes
from superfacets.files.writers.cells import ATTRIBUTE_OUTPUTS
from superfacets.files.writers.write import OUTPUT_ENDINGS, check_fit, check_outputs, write_outputs
from superfacets.graph.constraints import mask_of
from superfacets.mesh.base import Cells
from superfacets.tools.segment_file import FileOptions, segment_file

BASE = 150 << 20
"""Memory of a worker process after its imports, in bytes."""

PER_CELL = 200
"""Memory per cell, in bytes, for everything except the mesh: graph, weights, labels and temporary
arrays. For 1.4 million faces in PLY, OFF and STL, workers used a third to a half of the
estimate."""

PER_BYTE = 3
"""Memory in bytes per byte of the input file, for its content, the mesh, and the output."""

FILE_BYTES = {".stl": 50, ".ply": 18, ".obj": 30, ".off": 30, ".tri": 30, ".laz": 3, ".vtp": 6}
"""Minimum number of bytes per cell in a file, for each ending."""

USUAL_FILE_BYTES = 12
"""Minimum number of bytes per cell in a file, for endings that are not in `FILE_BYTES`."""


def cells_of(path: str) -> int:
    """Return an upper bound of the number of cells in a file, from its size; 0 if it is missing."""
    return _size_of(path) // FILE_BYTES.get(Path(path).suffix.lower(), USUAL_FILE_BYTES)


def memory_of(path: str) -> int:
    """Estimate the memory, in bytes, that a process needs to segment a file; usually too high."""
    return BASE + PER_BYTE * _size_of(path) + PER_CELL * cells_of(path)


def _size_of(path: str) -> int:
    try:
        return Path(path).stat().st_size
    except OSError:
        return 0


Record = dict[str, Any]
"""Content of one line of the manifest."""

_STOPPING = (errno.ENOSPC, errno.EDQUOT)
"""Error codes of a full disk. They stop the batch, because all other files would fail, too."""

_CHUNK = 1 << 20
"""Number of bytes that are hashed at a time, in less than a millisecond."""


@dataclass(frozen=True)
class BatchJob:
    """A file to segment, with options and paths of results. Jobs are pickled for workers."""

    head: Mapping[str, Any]  # entries of the record: name, input, version, params
    path: str
    folder: str
    outputs: tuple[str, ...]  # paths of results, relative to `folder`, with slashes
    options: FileOptions

    @property
    def name(self) -> str:
        """Name of the record of the job: path of the file relative to the input folder."""
        return str(self.head["name"])

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
    _check_version(job.head["version"])
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


def _check_version(version: str) -> None:
    """Raise a ConnectionError if this worker has another version of the package."""
    if version != __version__:
        raise ConnectionError(
            f"a worker on {socket.gethostname()} has superfacets {__version__}, but this process"
            f" has {version}: install the same version on both"
        )


def _done(job: BatchJob, record: Record) -> Record:
    """Process the file, set ``sha256`` in `record`, and return more entries for the record."""
    files = job.files
    for folder in {path.parent for path in files}:
        folder.mkdir(parents=True, exist_ok=True)
    check_outputs(files, force=job.options.force)
    path = Path(job.path)
    endings = [known_ending(file, OUTPUT_ENDINGS) for file in files]
    form = job.options.form(endings)

    def load(keep: bool) -> tuple[Cells, MeshAttributes | None, dict[str, Array]]:
        try:
            content = read_content(path)
        except MeshError:  # for example, an empty file
            record["sha256"] = hash_of(job.path)
            raise
        record["sha256"] = hashlib.sha256(content).hexdigest()
        cells, attributes = parse_cells_and_attributes(
            content, cell_ending(path), path.parent, keep=keep
        )
        check_fit(cells, None, endings, form)
        values, constraints = job.options.mask_values, {}
        if values:
            name = job.options.labels_named
            labels = parse_labels(content, cell_ending(path), cells.n_cells, name)
            constraints["mask"] = mask_of(labels, values, path, cells)
        return cells, attributes, constraints

    timings: dict[str, float] = {}
    holds_attributes = not {*endings}.isdisjoint(ATTRIBUTE_OUTPUTS)
    outcome = segment_file(load, job.options, holds_attributes=holds_attributes, timings=timings)
    result = outcome.result
    with timed(timings, "export"):
        write_outputs(
            files, outcome.mesh, result.labels, attributes=outcome.attributes, options=form,
            listed=outcome.listed, listed_mesh=outcome.listed_mesh,
        )  # fmt: skip
    seconds = {**result.timings, **timings}
    return {
        "cells": len(result.labels),
        "regions": result.n_segments,
        "seconds": {stage: round(spent, 4) for stage, spent in seconds.items()},
        "outputs": {name: hash_of(Path(job.folder, name)) for name in job.outputs},
    }


def hash_of(path: StrPath, stop: threading.Event | None = None) -> str | None:
    """Return the SHA-256 hash of a file, or None if it is not readable or `stop` is set."""
    found = hashlib.sha256()
    try:
        with open_regular(Path(path)) as file:
            while chunk := file.read(_CHUNK):
                if stop is not None and stop.is_set():
                    return None
                found.update(chunk)
    except OSError:
        return None
    return found.hexdigest()
