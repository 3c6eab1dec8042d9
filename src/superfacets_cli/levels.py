"""The command ``superfacets levels``."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import IO, Any

import click
import numpy as np

from superfacets import Hierarchy, IslandWarning, MeshAttributes, SliverWarning, hierarchy, kit
from superfacets.kit import FORMATS, CellData, Cells, FileOptions, OutputFiles, Written
from superfacets_scans import write_sstk

from . import options as opts
from .failures import print_notes
from .inputs import check_inputs, constraint_options, constraints_of, labels_for, read_input
from .interrupts import run_in_background
from .options import numbers, option, options
from .outputs import Job, check_mask, output_option, plan_jobs
from .report import notes_on_written

ARRAYS = ".npz"
ALL_LEVELS = (ARRAYS, ".sstk.json")  # file endings of formats that store all levels in one file


@click.command("levels")
@click.argument("input", metavar="IN", type=opts.INPUT)
@opts.labels_argument
@options(
    option("-n --n-segments counts K,K...", None,
           "Number of regions on each level, such as 2000,500,100.", callback=numbers,
           required=True),
    output_option(
        "A .npz or .sstk.json file for all levels, or - for standard output. In any other format"
        " that segment writes, each level is a separate file: OUT.ply becomes OUT.2000.ply,"
        " OUT.500.ply and so on. May be given several times.", required=True),
    option("--to format_of_stream", tuple(ending.lstrip(".") for ending in ALL_LEVELS),
           "Format of standard output.  [default: npz]"),
    option("--islands", FileOptions.CHOICES["islands"],
           "Merge only regions that touch (keep), or also the nearest regions across gaps between"
           " components (nearest).", default="keep"),
    option("--features NAMES", None,
           "Merge regions with similar values of this feature, instead of similar geometry; borders"
           " of the finest level follow the feature, too. NAMES are color, normals, height (z), or"
           " properties of the faces, points or vertices in IN, separated by commas.",
           multiple=True, callback=opts.listed),
    constraint_options,
    opts.drop_attributes_option("IN"),
    opts.labels_named_option,
    opts.threads_option,
    opts.format_option("IN", of_stream=True),
    opts.quiet_option(),
    opts.json_option(),
)  # fmt: skip
def levels_command(
    input: str, counts: tuple[int, ...], outputs: tuple[str, ...], format_of_stream: str | None,
    labels: Path | None, mask: Path | None, mask_values: tuple[int, ...] | None,
    barriers: Path | None, *, format: str | None,
    features: tuple[str, ...], drop_attributes: bool, labels_named: str, as_json: bool,
    **options: Any,
) -> None:  # fmt: skip
    """Segment a mesh or cloud, and merge regions level by level.

    Each region of a level is a union of regions of the finer levels. LABELS is a label file with
    the regions to merge; without it, IN is segmented first. IN may be - for standard input.
    """
    check_inputs((input,))
    has_mask = mask is not None or mask_values is not None
    if labels is not None and has_mask:
        raise click.UsageError(
            "give LABELS or a mask, not both: cells with label -1 are left out already"
        )
    also_read = [str(path) for path in (labels, mask, barriers) if path is not None]
    named = [Path(text) for text in outputs if text != opts.STANDARD_STREAM]
    job = _plan(input, outputs, counts, format_of_stream, also_read)
    check_mask(job.endings, has_mask=has_mask)
    kit.checked_targets(job.files)
    keeps = job.holds_attributes and not drop_attributes

    def compute() -> tuple[Cells, MeshAttributes | None, Hierarchy]:
        source = read_input(input, format)
        cells, attributes = source.cells_and_attributes(keep=keeps or bool(features))
        given = None
        if labels is not None:  # label numbers in a file may have gaps
            of_file = labels_for(source, cells, labels, labels_named)
            given, _ = kit.ranked_labels(of_file)
        meshes = [path for path in job.files if not path.name.lower().endswith(ARRAYS)]
        OutputFiles(meshes).check_fit(cells, given)
        constraints = constraints_of(mask, mask_values, barriers, source, cells, name=labels_named)
        threads, is_kept = kit.checked_threads(options["n_threads"]), constraints.get("mask")
        table: Any = CellData(cells, attributes).features(features, threads, is_kept)
        with warnings.catch_warnings():  # they are about the finest regions, which are then merged
            warnings.simplefilter("ignore", IslandWarning)
            warnings.simplefilter("ignore", SliverWarning)
            arguments = {**options, **constraints, "labels": given, "features": table}
            nested = hierarchy(cells, counts, **arguments)
        return cells, attributes if keeps else None, nested

    cells, attributes, nested = run_in_background(compute)
    written = _write(job, named, cells, attributes, nested)
    print_notes(notes_on_written(cells, attributes, job.endings, written))
    facts = {
        "levels": list(nested.counts), "n_finest": nested.n_finest, "n_fewest": nested.n_fewest,
    }  # fmt: skip
    listed = ", ".join(map(str, nested.counts))
    size = kit.counted(cells.n_cells, kit.kind_of(cells).noun)
    text = f"{job.name}: {size}, levels of {listed} regions"
    job.report(facts, text, kit.kind_of(cells).noun)


def _plan(
    input: str, outputs: tuple[str, ...], counts: tuple[int, ...], format: str | None,
    also_read: list[str],
) -> Job:  # fmt: skip
    """Return the job of the input and its outputs; `format` is the format of standard output."""
    paths = [path for output in outputs for path in _paths_of_levels(output, counts)]
    format = format or ("npz" if opts.STANDARD_STREAM in outputs else None)
    formats = [] if format is None else [format]
    (job,) = plan_jobs((input,), paths, formats, ascii=False, also_read=also_read)
    return job


def _paths_of_levels(text: str, counts: tuple[int, ...]) -> list[str]:
    """Return the path of one file for all levels, or one path per level, finest level first."""
    if text == opts.STANDARD_STREAM:
        return [text]
    output = Path(text)
    try:
        ending = kit.known_ending(output, FORMATS.outputs)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if ending in ALL_LEVELS:
        return [text]
    stem, given = output.name[: -len(ending)], output.name[-len(ending) :]
    return [str(output.with_name(f"{stem}.{n}{given}")) for n in sorted(counts, reverse=True)]


def _write(
    job: Job, named: list[Path], cells: Cells, attributes: MeshAttributes | None, nested: Hierarchy
) -> Written:
    """Write all outputs of the job, or none of them if one fails."""
    lost: dict[str, list[str]] = {}
    with kit.atomic_outputs(job.files) as temporaries:
        writers = _writers(named, cells, attributes, nested)
        for output, temporary, write in zip(job.files, temporaries, writers, strict=True):
            with temporary.open("wb") as file:
                lost[output.suffix] = write(file)
        if job.stream is not None:
            _write_all(sys.stdout.buffer, job.stream, nested)
            sys.stdout.buffer.flush()
    return Written(lost, np.zeros(0, np.int64))


def _writers(
    outputs: list[Path], cells: Cells, attributes: MeshAttributes | None, nested: Hierarchy
) -> Iterator[Callable[[IO[bytes]], list[str]]]:
    """Yield one function per output file; it gets the open file, and writes to it."""
    for output in outputs:
        ending = kit.known_ending(output, FORMATS.outputs)
        if ending in ALL_LEVELS:
            yield partial(_write_all, ending=ending, nested=nested)
            continue
        for labels in nested.levels:
            write = partial(
                OutputFiles([output]).write_one, path=output, cells=cells, labels=labels
            )
            yield partial(write, attributes=attributes)


def _write_all(file: IO[bytes], ending: str, nested: Hierarchy) -> list[str]:
    """Write the labels of all levels; an .npz file also gets parent regions and the merge tree."""
    if ending != ARRAYS:
        write_sstk(file, nested.levels)
        return []
    arrays: dict[str, Any] = {
        "counts": np.array(nested.counts),
        "labels": np.stack(nested.levels),
        **{f"parents_{i}": parents for i, parents in enumerate(nested.parents)},
        "finest": nested.finest,
        "children": nested.children,
        "costs": nested.costs,
    }
    np.savez(file, **arrays)
    return []
