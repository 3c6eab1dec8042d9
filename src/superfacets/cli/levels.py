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

from .._options import ISLANDS
from .._validate import checked_threads, ranked_labels
from ..cells.kinds import kind_of
from ..cells.named_features import features_of
from ..errors import IslandWarning, SliverWarning
from ..export.cells import FormatOptions
from ..export.scannet import write_sstk
from ..export.write import OUTPUT_ENDINGS, check_fit, writer_of
from ..io.atomic import atomic_outputs, checked_targets
from ..io.attributes import MeshAttributes
from ..io.guards import counted, known_ending
from ..mesh.cells import Cells
from ..nesting import hierarchy
from ..regions.hierarchy import Hierarchy
from . import options as opts
from .failures import print_notes
from .inputs import (
    check_inputs,
    constraint_options,
    constraints_of,
    labels_for,
    load_cells_and_attributes,
)
from .interrupts import run_in_background
from .options import FILE, numbers, option, options
from .outputs import (
    TO_IS_UNUSED,
    Job,
    check_files,
    check_mask,
    check_terminal,
    output_option,
)
from .report import notes_on_written

ARRAYS = ".npz"
ALL_LEVELS = (ARRAYS, ".sstk.json")
"""Endings of files that hold all levels."""


@click.command("levels")
@click.argument("input", metavar="IN", type=opts.INPUT)
@options(
    option("-n --n-segments counts K,K...", None,
           "Number of regions on each level, say 2000,500,100.", callback=numbers, required=True),
    output_option(
        "A .npz or .sstk.json that holds all levels; or any other file that segment writes: OUT.ply"
        " then becomes OUT.2000.ply, OUT.500.ply and so on. May be given several times; or - for"
        " standard output.", required=True),
    option("--to format_of_stream", tuple(ending.lstrip(".") for ending in ALL_LEVELS),
           "Format of standard output.  [default: npz]"),
    option("--labels L", FILE,
           "Merge these regions, from a .npy, .seg, .txt or labeled mesh.  [default: the regions of"
           " superfacets segment for the largest K]"),
    option("--islands", ISLANDS,
           "Merge only regions that touch (keep), or also the nearest regions across gaps between"
           " components.", default="keep"),
    option("--features NAME", None,
           "Merge regions by this feature in place of geometry; the finest level follows it, too:"
           " color, normals, height (z), or a property of the faces, points or vertices in IN; may"
           " be given several times.", multiple=True),
    constraint_options,
    opts.drop_attributes_option("IN"),
    opts.labels_named_option,
    opts.threads_option,
    opts.format_option("IN", of_stream=True),
    opts.quiet_option,
    opts.json_option(),
)  # fmt: skip
def levels_command(
    input: str, counts: tuple[int, ...], outputs: tuple[str, ...], format_of_stream: str | None,
    labels: Path | None, mask: Path | None, mask_values: tuple[int, ...] | None,
    barriers: Path | None, *, format: str | None,
    features: tuple[str, ...], drop_attributes: bool, labels_named: str, is_quiet: bool,
    as_json: bool, **options: Any,
) -> None:  # fmt: skip
    """Segment a mesh or point cloud, and merge regions level by level.

    Each region of a level is a union of regions of the finer levels. IN may be - for standard
    input.
    """
    check_inputs((input,))
    if labels is not None and mask is not None:
        raise click.UsageError("--labels leaves out cells of label -1 already: leave --mask out")
    stream = _checked_stream(outputs, format_of_stream)
    named = [Path(text) for text in outputs if text != opts.STANDARD_STREAM]
    paths = [path for output in named for path in _paths_of_levels(output, counts)]
    job = Job(input, tuple(paths), stream)
    check_mask(mask, mask_values, job.endings)
    also_read = [str(path) for path in (labels, mask, barriers) if path is not None]
    check_files([job], also_read)
    checked_targets(paths)
    keeps = job.holds_attributes and not drop_attributes

    def compute() -> tuple[Cells, MeshAttributes | None, Hierarchy]:
        cells, attributes = load_cells_and_attributes(input, format, keep=keeps or bool(features))
        given = None
        if labels is not None:  # a file's labels may have gaps
            given, _ = ranked_labels(labels_for(cells, labels, labels_named))
        check_fit(cells, given, job.endings - {ARRAYS}, FormatOptions())
        table: Any = features_of(features, cells, attributes, checked_threads(options["n_threads"]))
        constraints = constraints_of(mask, mask_values, barriers, cells.n_cells, labels_named)
        with warnings.catch_warnings():  # levels have exact numbers of regions
            warnings.simplefilter("ignore", IslandWarning)
            warnings.simplefilter("ignore", SliverWarning)
            nested = hierarchy(
                cells, counts, labels=given, features=table, **constraints, **options
            )
        return cells, attributes if keeps else None, nested

    cells, attributes, nested = run_in_background(compute)
    with atomic_outputs(paths) as temporaries:
        writers = _writers(named, cells, attributes, nested)
        for temporary, write in zip(temporaries, writers, strict=True):
            with temporary.open("wb") as file:
                write(file)
        if stream is not None:
            _write_all(sys.stdout.buffer, stream, nested)
            sys.stdout.buffer.flush()
    if not is_quiet:
        print_notes(notes_on_written(cells, attributes, job.endings, 0))
    facts = {
        "levels": list(nested.counts), "n_finest": nested.n_finest, "n_fewest": nested.n_fewest,
    }  # fmt: skip
    listed = ", ".join(map(str, nested.counts))
    size = counted(cells.n_cells, kind_of(cells).noun)
    text = f"{job.name}: {size}, levels of {listed} regions"
    job.report(facts, text, kind_of(cells).noun, as_json=as_json, is_quiet=is_quiet)


def _checked_stream(outputs: tuple[str, ...], format: str | None) -> str | None:
    """Ending of the output on standard output; None if there is none."""
    if outputs.count(opts.STANDARD_STREAM) > 1:
        raise click.UsageError("-o takes at most one -")
    if opts.STANDARD_STREAM not in outputs:
        if format is not None:
            raise click.UsageError(TO_IS_UNUSED)
        return None
    stream = f".{format or 'npz'}"
    check_terminal(stream, ascii=False)
    return stream


def _paths_of_levels(output: Path, counts: tuple[int, ...]) -> list[Path]:
    """The file of all levels; or one per level, finest first, named by its number of regions."""
    try:
        ending = known_ending(output, OUTPUT_ENDINGS)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if ending in ALL_LEVELS:
        return [output]
    stem, given = output.name[: -len(ending)], output.name[-len(ending) :]
    return [output.with_name(f"{stem}.{n}{given}") for n in sorted(counts, reverse=True)]


def _writers(
    outputs: list[Path], cells: Cells, attributes: MeshAttributes | None, nested: Hierarchy
) -> Iterator[Callable[[IO[bytes]], None]]:
    """Yield a function for each file, which writes it."""
    for output in outputs:
        ending = known_ending(output, OUTPUT_ENDINGS)
        if ending in ALL_LEVELS:
            yield partial(_write_all, ending=ending, nested=nested)
            continue
        for labels in nested.levels:
            writer = writer_of(cells, labels, ending, FormatOptions(), attributes)
            yield partial(writer.write, ending=ending, path=output)


def _write_all(file: IO[bytes], ending: str, nested: Hierarchy) -> None:
    """Write the labels of all levels; in an .npz, also the parents and the merge tree."""
    if ending != ARRAYS:
        write_sstk(file, nested.levels)
        return
    arrays: dict[str, Any] = {
        "counts": np.array(nested.counts),
        "labels": np.stack(nested.levels),
        **{f"parents_{i}": parents for i, parents in enumerate(nested.parents)},
        "finest": nested.finest,
        "children": nested.children,
        "costs": nested.costs,
    }
    np.savez(file, **arrays)
