"""The command ``superfacets levels``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import SCANS, Hierarchy, IslandWarning, SliverWarning, hierarchy, kit
from superfacets.kit import FORMATS, CellData, Cells, FileOptions, OutputFiles, Written
from superfacets_scans import write_sstk

from . import inputs as read
from . import options as opts
from .failures import print_notes
from .interrupts import run_in_background
from .options import COUNT, option, options
from .outputs import one_job, output_option
from .report import notes_on_written
from .segment import denoise_option, scans_option

ARRAYS = ".npz"
ALL_LEVELS = (ARRAYS, ".sstk.json")  # file endings of formats that store all levels in one file


@click.command("levels")
@click.argument("input", metavar="IN", type=opts.INPUT)
@opts.labels_argument
@options(
    option("-n --n-segments counts K,K...", opts.Listed(COUNT),
           "Number of regions on each level, such as 2000,500,100.", required=True),
    output_option(
        "A .npz or .sstk.json file for all levels. In any other format that segment writes, each"
        " level is a separate file: OUT.ply becomes OUT.2000.ply, OUT.500.ply and so on. This"
        " option may be given several times.", required=True),
    option("--islands", FileOptions.CHOICES["islands"],
           "Merge only regions that touch (keep), or also the nearest regions across gaps between"
           " components (nearest).", default="keep"),
    option("--features NAMES", opts.Listed(),
           "Merge regions with similar values of this feature, instead of similar geometry; borders"
           " of the finest level follow the feature, too. NAMES are color, normals, height (z),"
           " properties in IN, or files such as lh.sulc, separated by commas.", multiple=True),
    scans_option, denoise_option, read.constraint_options, opts.drop_attributes_option("IN"),
    opts.labels_named_option, opts.viewpoint_option, opts.threads_option,
    opts.format_option("IN", of_stream=True), opts.quiet_option(), opts.json_option(),
)  # fmt: skip
def levels_command(
    input: str, counts: tuple[int, ...], labels: Path | None, features: tuple[str, ...],
    islands: Any, n_threads: int | None, **given: Any,
) -> None:  # fmt: skip
    """Segment a mesh or cloud, and merge regions level by level.

    Each region of a level is a union of regions of the finer levels. LABELS is a label file with
    the regions to merge; without it, IN is segmented first. IN may be - for standard input.
    """
    if labels is not None and labels.name.isdecimal() and not labels.exists():
        raise click.UsageError(f"extra argument {labels}", click.get_current_context())
    counts = tuple(sorted({*counts}))
    has_mask = given["mask"] is not None or given["mask_values"] is not None
    denoise = {} if given["denoise"] is None else {"denoise": given["denoise"]}
    chosen = {**(SCANS if given["scans"] else {}), **denoise}
    if labels is not None and (has_mask or chosen):
        raise click.UsageError("give LABELS or a mask, --scans or --denoise, not both")
    paths = [path for text in given["outputs"] for path in _paths_of_levels(Path(text), counts)]
    also_read = (labels, given["mask"], given["barriers"])
    given["outputs"] = [str(path) for path in paths]
    job = one_job(input, given, also_read)

    def compute() -> tuple[Cells, Any, Hierarchy, dict[str, Any]]:
        source = read.read_input(input, given["format"])
        cells, attributes = source.cells_and_attributes(keep=job.keeps_attributes or bool(features))
        cells = kit.kind_of(cells).seen_from(cells, given["viewpoint"])
        regions, of_vertices = None, None
        if labels is not None:  # label numbers in a file may have gaps
            found = read.ranked_labels_beside(source, labels, cells, given["labels_named"])
            regions, of_vertices = found[0], None if found[2] is found[0] else found[2]
            if any(n >= 0 and name != f"region_{n}" for n, name in found[3].items()):
                print_notes([f"names of regions are not copied from {labels}: levels merge them"])
        constraints = read.constraints_of(given | {"features": features}, source, cells)
        likely = read.likely_labels(constraints) if regions is None else regions
        OutputFiles([path for path in paths if path.suffix != ARRAYS]).check_fit(cells, likely)
        data, mask = CellData(cells, attributes), constraints.get("mask")
        table: Any = data.features(features, kit.checked_threads(n_threads), mask)
        with warnings.catch_warnings():  # the finest regions, which cause the warnings, are merged
            warnings.simplefilter("ignore", IslandWarning)
            warnings.simplefilter("ignore", SliverWarning)
            nested = hierarchy(
                cells, counts, labels=regions, features=table, islands=islands,
                n_threads=n_threads, **constraints, **chosen,
            )  # fmt: skip
        kept = attributes if job.keeps_attributes else None
        return cells, kept, nested, {"constraints": constraints, "of_vertices": of_vertices}

    cells, attributes, nested, others = run_in_background(compute)
    written = _write(paths, cells, attributes, nested, **others)
    print_notes(notes_on_written(None, attributes, job.endings, written))
    facts = {"levels": [*nested.counts], "n_finest": nested.n_finest, "n_fewest": nested.n_fewest}
    noun, listed = kit.kind_of(cells).noun, ", ".join(map(str, nested.counts))
    job.report(facts, f"{kit.counted(cells.n_cells, noun)}, levels of {listed} regions", noun)


def _paths_of_levels(output: Path, counts: tuple[int, ...]) -> list[Path]:
    """Return the path of one file for all levels, or one path per level, finest level first."""
    try:
        ending = kit.known_ending(output, FORMATS.outputs)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if ending in ALL_LEVELS:
        return [output]
    stem, given = output.name[: -len(ending)], output.name[-len(ending) :]
    return [output.with_name(f"{stem}.{n}{given}") for n in sorted(counts, reverse=True)]


def _write(
    paths: list[Path], cells: Cells, attributes: Any, nested: Hierarchy, constraints: Any,
    of_vertices: Any,  # given labels of vertices, whose faces have the labels `nested.finest`
) -> Written:  # fmt: skip
    """Write all outputs, or none of them if one fails; an .npz file also gets the merge tree."""
    lost: dict[str, list[str]] = {}
    levels = iter(nested.levels * len(paths))  # one after the other, for each output
    finest = nested.levels[0] if of_vertices is None else nested.finest
    with kit.atomic_outputs(paths) as temporaries:
        for path, temporary in zip(paths, temporaries, strict=True):
            ending = kit.known_ending(path, FORMATS.outputs)
            with temporary.open("wb") as file:
                if ending == ARRAYS:
                    arrays: dict[str, Any] = {
                        "counts": np.array(nested.counts), "labels": np.stack(nested.levels),
                        **{f"parents_{i}": parents for i, parents in enumerate(nested.parents)},
                        "finest": nested.finest, "children": nested.children, "costs": nested.costs,
                    }  # fmt: skip
                    np.savez(file, **arrays)
                elif ending in ALL_LEVELS:
                    write_sstk(file, nested.levels)
                else:
                    given = (next(levels), attributes, constraints, finest, of_vertices)
                    lost[ending] = OutputFiles([path]).write_one(file, path, cells, *given)
    return Written(lost, np.zeros(0, np.int64))
