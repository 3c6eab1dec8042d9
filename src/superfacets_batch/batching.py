"""The function `batch`, which finds files, segments each file, and records the results."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from superfacets import Features, MissingExtraError, __version__, kit
from superfacets.kit import FORMATS, FileOptions, InputFile, StrPath

from .cluster import Crew, local_client, remote_client
from .jobs import BatchJob, Manifest, Record, failed, hash_of, run_job

MANIFEST = "manifest.jsonl"
MEMORY_SHARE = 0.8  # usable fraction of the memory per worker thread: estimates may be low
MOST_ENDS = 2  # number of processes that may end while they process the same file
START_CELLS = 2_000  # fixed time per file, as the number of cells processed in the same time

OpenClient = Callable[[], contextlib.AbstractContextManager[Any]]


@dataclass(frozen=True)
class BatchResult:
    """Result of `batch`: one record per file, and counts.

    Parameters
    ----------
    records : tuple of dict
        Record of each input file, in the order of the inputs, as in `manifest.jsonl`: ``name``,
        ``input``, ``version``, ``params``, ``sha256``, and ``error`` if the file failed, otherwise
        ``cells``, ``regions``, ``seconds``, ``outputs`` and ``notes``, texts by kind.
    n_done, n_kept, n_failed : int
        Numbers of files segmented in this call, skipped with valid results, and failed in any call.
    n_cells, seconds : int, float
        Number of cells of the files segmented in this call, and its wall time in seconds.
    notes : tuple of str
        Messages about ignored lines of `manifest.jsonl`, workers, and kinds of notes in `records`.
    """

    records: tuple[Record, ...]
    n_done: int
    n_kept: int
    n_failed: int
    n_cells: int
    seconds: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class BatchProgress:
    """Progress of a batch, reported after each file.

    Parameters
    ----------
    record : dict
        Record of the file, as in `BatchResult`.
    n_ended, n_files : int
        Numbers of files that this call has processed, including failures, and will process in all.
    n_cells, seconds, seconds_left : int, float, float
        Number of cells of the files segmented so far, the wall time since the start, and the
        remaining time, estimated from the sizes of the files.
    """

    record: Record
    n_ended: int
    n_files: int
    n_cells: int
    seconds: float
    seconds_left: float


def batch(
    inputs: StrPath | Iterable[StrPath], output_folder: StrPath, *,
    formats: Sequence[str] = (), scheduler: str | None = None, workers: int | None = None,
    timeout: float | None = None, retry_failed: bool = False,
    progress: Callable[[BatchProgress], object] | None = None,
    features: str | Sequence[str] | Features = (), subdivide: bool = False,
    max_edge: float | None = None, drop_attributes: bool = False, ascii: bool = False,
    label_name: str = "label", vertex_labels: bool = False, force: bool = False,
    viewpoint: Sequence[float] | None = None, min_opacity: float = 0.0,
    mask_values: Sequence[int] = (), labels_named: str = "label", paper: bool = False,
    **options: Any,
) -> BatchResult:  # fmt: skip
    """Segment many files, on all cores or on a cluster, and write their labels to a folder.

    If a file fails, the batch continues. A second call skips files that are already processed,
    unless the input file, the parameters or the version of the package have changed, or results are
    missing or damaged. Files that failed are skipped, too, unless `retry_failed` is true.

    Parameters
    ----------
    inputs : path-like, or iterable of these
        Files, folders (searched recursively for files other than ``.csv``, ``.txt``, ``.npy``),
        patterns such as ``"scans/**/*.ply"``, or files with one path per line (``"@list.txt"``).
    output_folder : path-like
        Folder of the results, created if it is missing. ``manifest.jsonl`` has one record per file.
        Results, such as ``NAME.superfacets.ply``, are in the same subfolder as their input.
    formats : sequence of str, optional
        Formats of the results, such as ``"npy"``. Default: LAS, LAZ or VTU as the input, or PLY.
    scheduler : str, optional
        Address of a Dask scheduler, for example ``"tcp://10.0.0.1:8786"``. Its workers must have
        the same version of the package, and access to all files at the same paths.
    workers : int, optional
        Number of worker processes on this machine, by default one per core if Dask is installed and
        there are several files, else 1. Each worker processes one file at a time, on one thread.
        With 1, files are processed in this process, on all cores: a file that crashes the process
        or never finishes stops the batch, and the next call continues with the other files.
    timeout : float, optional
        Maximum seconds for a file, by default unlimited. A file that takes longer is recorded as
        failed, and its worker restarts. The limit needs several workers or a scheduler.
    retry_failed : bool, default False
        Whether to process failed files again even if nothing has changed.
    progress : callable, optional
        Function called with a `BatchProgress` after each file.
    features : str, sequence of str, or Features, optional
        Names of features, as in `segment`.
    subdivide : bool, default False
        Whether to bisect edges longer than a quarter of the radius of a region before segmentation.
        Label files still have one label for each face of the input file.
    max_edge : float, optional
        Maximum edge length after subdivision, in the unit of the file. Implies `subdivide`.
    drop_attributes, ascii, paper : bool, default False
        Whether results omit attributes of the inputs, are text in formats that support both, and
        are computed by `paper.segment`.
    label_name, vertex_labels, force
        Same as in `write_mesh`.
    viewpoint : sequence of float, length 3, optional
        Position of the sensor for point clouds without normals; see `PointCloud`.
    min_opacity : float, default 0.0
        Minimum opacity of Gaussian splats, 0 to 1, stored as a logit in their property ``opacity``.
        Splats with a lower opacity get the label -1.
    mask_values, labels_named : sequence of int, optional, and str, default "label"
        Values >= 0 of cells to segment, by default all, and the property that contains these
        values, such as ``"classification"``. Cells with other values get the label -1.
    **options
        Other options of `segment`, or of `paper.segment`, except arrays and `callback`.

    Returns
    -------
    BatchResult

    Raises
    ------
    ValueError, TypeError
        If a parameter is invalid, if two files would have the same result, or if another process
        writes to the folder.
    OSError
        If no file is found, a folder cannot be read or written, or the disk is full; a
        ConnectionError if there is no scheduler or worker, or if a worker has another version of
        the package or cannot access the folder. Complete results are kept.
    MissingExtraError
        If Dask is missing for several workers or for a scheduler.

    Notes
    -----
    Files whose estimated memory exceeds 80% of the memory of a worker per thread, and files whose
    worker ended, are processed last, one at a time. If a worker ends again, its file has failed.

    Examples
    --------
    >>> import superfacets, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     superfacets.write_mesh(f"{folder}/bear.ply", superfacets.sample_mesh(5_000))
    ...     results = [superfacets.batch(folder, f"{folder}/out", n_segments=20) for _ in range(2)]
    >>> [(result.n_done, result.n_kept) for result in results]
    [(1, 0), (0, 1)]
    """
    if isinstance(formats, str):
        raise TypeError(f"formats must be a sequence of names, got {formats!r}")
    file_options = FileOptions(
        options, features, subdivide, max_edge, drop_attributes, ascii, label_name, vertex_labels,
        force, viewpoint, min_opacity, mask_values, labels_named, paper, options.pop("weld", True),
    )  # fmt: skip
    n_workers, notes = _checked_workers(workers, scheduler, timeout)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {progress!r}")
    began = time.perf_counter()
    folder = Path(output_folder).absolute()
    jobs = _plan(inputs, folder, formats, file_options)
    results = [path for job in jobs for path in job.files]
    with kit.locked(folder, results), Manifest(folder / MANIFEST) as manifest:
        todo = _todo(jobs, manifest, retry_failed=retry_failed)
        tally = _Tally(todo)
        work = _work_on(todo, manifest, scheduler, min(n_workers, len(todo)), timeout)
        with contextlib.closing(work):
            for job, record in work:
                manifest.append(record)
                state = tally.count(job, record)
                if progress is not None:
                    progress(state)
        records = tuple(manifest.records[job.name] for job in jobs)
    n_failed = sum("error" in record for record in records)
    kinds: dict[str, list[str]] = {}
    for record in records:
        for kind, note in record.get("notes", {}).items():
            kinds.setdefault(kind, []).append(f"{record['name']}: {note}")
    found = ((kind, kit.counted(len(texts), "file"), texts[0]) for kind, texts in kinds.items())
    notes += [f"{kind} in {files}, such as {first}" for kind, files, first in found]
    return BatchResult(
        records, tally.n_done, len(jobs) - n_failed - tally.n_done, n_failed, tally.n_cells,
        time.perf_counter() - began, (*manifest.notes, *notes),
    )  # fmt: skip


def _work_on(
    todo: Sequence[BatchJob], manifest: Manifest, scheduler: str | None, n_workers: int,
    timeout: float | None,
) -> Generator[tuple[BatchJob, Record]]:  # fmt: skip
    """Run jobs on a cluster, in workers on this machine, or in this process."""
    if todo and scheduler is not None:
        at = partial(remote_client, scheduler, todo[0].folder)
        return _on_workers(todo, at, at, timeout)
    if n_workers > 1 or (todo and timeout is not None):
        one = partial(local_client, 1, kit.checked_threads(None))
        return _on_workers(todo, partial(local_client, n_workers), one, timeout)
    return _in_turn(todo, manifest)


def _checked_workers(
    workers: int | None, scheduler: str | None, timeout: float | None
) -> tuple[int, list[str]]:
    """Return the number of workers on this machine, and a note if it is 1 without Dask."""
    notes = []
    if timeout is not None:
        kit.checked_number(timeout, "timeout", zero=False)
    if workers is None:
        workers = kit.checked_threads(None)
        has_dask = False
        with contextlib.suppress(ValueError):  # the module is marked as missing in `sys.modules`
            has_dask = find_spec("distributed") is not None
        if scheduler is None and workers > 1 and not has_dask:
            workers = 1
            advice = MissingExtraError("several workers", "batch")
            notes.append(f"files are processed one after the other: {advice}")
    elif scheduler is not None:
        raise ValueError("pass scheduler or workers, not both: a scheduler has its own workers")
    n_workers = kit.checked_count(workers, "workers")
    if timeout is not None and scheduler is None and n_workers == 1:
        raise ValueError("timeout needs several workers or a scheduler")
    return n_workers, notes


def _plan(
    inputs: StrPath | Iterable[StrPath], folder: Path, formats: Sequence[str], options: FileOptions
) -> list[BatchJob]:
    """Return a job for each file, even if it has results."""
    known = FORMATS.ending_of
    for name in formats:
        if name not in known or formats.count(name) > 1:
            what = f"{'a repeated' if name in known else 'an unknown'} name, {name!r}"
            raise ValueError(f"formats has {what}: use distinct names from {', '.join(known)}")
    endings = tuple(known[name] for name in formats)
    sources = InputFile.find(inputs)
    options.form(endings or [source.usual_ending for source in sources])
    InputFile.check_outputs_differ(sources, endings)
    params = {**options.params, "formats": list(formats)}
    return [
        BatchJob(
            source.name,
            {"name": source.name, "input": source.input, "version": __version__, "params": params},
            str(Path(source.input).absolute()), str(folder), source.output_names(endings), options,
        )
        for source in sources
    ]  # fmt: skip


def _todo(jobs: Sequence[BatchJob], manifest: Manifest, *, retry_failed: bool) -> list[BatchJob]:
    """Return the jobs that must run, by the hashes of inputs and results; see `batch`."""

    def is_done(job: BatchJob) -> bool:
        record = manifest.records.get(job.name, {})
        is_changed = any(record.get(key) != job.head[key] for key in ("version", "params"))
        if is_changed or (retry_failed and "error" in record):
            return False
        hashes = record.get("outputs", {})
        for name, path in zip(job.outputs, job.files, strict=True):
            if "error" not in record and hashes.get(name) != (hash_of(path) or ""):
                return False
        return hash_of(job.path) == record.get("sha256")

    return [job for job in jobs if not is_done(job)]


def _in_turn(jobs: Sequence[BatchJob], manifest: Manifest) -> Generator[tuple[BatchJob, Record]]:
    """Run jobs in this process; jobs during which a process ended come last."""
    for job in sorted(jobs, key=lambda job: manifest.n_begun(job.name)):
        if manifest.n_begun(job.name) >= MOST_ENDS:
            yield job, failed(job, "the process ended twice while it processed this file")
            continue
        manifest.count_begin(job.name)
        try:
            record = run_job(job)
        except BaseException:  # such as Ctrl-C, which is not an error of the file
            manifest.count_begin(job.name, -1)
            raise
        yield job, record


def _on_workers(
    jobs: Sequence[BatchJob], open_many: OpenClient, open_one: OpenClient, timeout: float | None
) -> Generator[tuple[BatchJob, Record]]:
    """Run jobs that fit in a worker's memory; then run larger jobs and repeats one at a time."""
    needs = {job.name: InputFile(job.path, job.name).memory for job in jobs}
    with open_many() as client:
        crew = Crew(client)
        room = MEMORY_SHARE * crew.share
        alone = [job for job in jobs if needs[job.name] > room]
        fitting = [job for job in jobs if needs[job.name] <= room]
        fitting.sort(key=lambda job: -needs[job.name])
        for job, record in crew.run(fitting, timeout=timeout):
            if record is None:
                alone.append(job)
            else:
                yield job, record
    if alone:
        with open_one() as client:
            for job, record in Crew(client).run(alone, timeout=timeout, is_alone=True):
                yield job, record or failed(job, "a worker ended during this file (out of memory?)")


class _Tally:
    """Counts finished files, and estimates the remaining time from the sizes of files."""

    def __init__(self, jobs: Sequence[BatchJob]) -> None:
        self.n_done = self.n_cells = self._n_ended = self._ended_work = 0
        sizes = {job.name: InputFile(job.path, job.name).most_cells for job in jobs}
        self._work = {name: START_CELLS + n_cells for name, n_cells in sizes.items()}
        self._all_work = sum(self._work.values())
        self._began = time.perf_counter()

    def count(self, job: BatchJob, record: Record) -> BatchProgress:
        self._n_ended += 1
        self._ended_work += self._work[job.name]
        self.n_done += "error" not in record
        self.n_cells += record.get("cells", 0)
        spent = time.perf_counter() - self._began
        left = spent * (self._all_work / self._ended_work - 1)
        return BatchProgress(record, self._n_ended, len(self._work), self.n_cells, spent, left)
