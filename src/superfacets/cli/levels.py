"""The command ``superfacets levels``."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import click
import numpy as np

from .._options import ISLANDS, Islands
from .._validate import checked_threads
from ..batches.features import features_of
from ..errors import IslandWarning, SliverWarning
from ..io.atomic import atomic_outputs, checked_targets
from ..io.guards import counted, known_ending
from ..io.readers.labels import read_labels
from ..io.writers.cells import FormatOptions
from ..io.writers.sstk import write_sstk
from ..io.writers.write import OUTPUT_ENDINGS
from ..levels import hierarchy
from ..mesh.faces import AnyCells, n_cells_of, noun_of
from ..regions.hierarchy import Hierarchy
from .background import run_in_background
from .constraints import check_mask, constraint_options, constraints_of
from .inputs import check_inputs, load_cells_and_attributes, name_of
from .options import (
    FILE,
    STANDARD_STREAM,
    format_option,
    numbers,
    quiet_option,
    threads_option,
)
from .outputs import Job, check_files, check_fit, writer_of

__all__ = ["levels_command"]

ARRAYS = ".npz"
ALL_LEVELS = (ARRAYS, ".sstk.json")
"""Files that hold all levels."""


@click.command("levels")
@click.argument("input", metavar="IN", type=click.Path(allow_dash=True))
@click.option(
    "-n",
    "--n-segments",
    "counts",
    metavar="K,K...",
    callback=numbers,
    required=True,
    help="Number of regions on each level, say 2000,500,100.",
)
@click.option(
    "-o",
    "--output",
    metavar="OUT",
    type=FILE,
    required=True,
    help="A .npz or .sstk.json that holds all levels; or any other file that segment writes:"
    " OUT.ply then becomes OUT.2000.ply, OUT.500.ply and so on.",
)
@click.option(
    "--labels",
    metavar="L",
    type=FILE,
    help="Merge these regions, from a .npy, .seg, .txt or labeled mesh.  [default: those of"
    " superfacets segment for the largest K]",
)
@click.option(
    "--islands",
    type=click.Choice(ISLANDS),
    default="keep",
    show_default=True,
    help="Only regions that touch merge, or also those nearest across gaps between components.",
)
@click.option(
    "--features",
    metavar="NAME",
    multiple=True,
    help="What decides which regions merge, in place of geometry, and what the finest follow:"
    " color, normals, height (z), or a property of the faces, points or vertices in IN; may be"
    " given several times.",
)
@constraint_options
@threads_option
@format_option("IN", of_stream=True)
@quiet_option
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def levels_command(
    input: str, counts: tuple[int, ...], output: Path, labels: Path | None, mask: Path | None,
    barriers: Path | None, *, is_quiet: bool, as_json: bool, **options: Any,
) -> None:  # fmt: skip
    """Segment the mesh or point cloud in the file IN, and merge regions level by level.

    Each region of a level is a union of regions of the finer levels. IN may be - for standard
    input.
    """
    check_inputs((input,))
    if labels is not None and mask is not None:
        raise click.UsageError("--labels are -1 where cells are left out: leave --mask out")
    ending = _ending_of(output)
    check_mask(mask, [ending])
    paths = _paths_of_levels(output, ending, counts)
    also_read = [str(path) for path in (labels, mask, barriers) if path is not None]
    check_files([Job(input, tuple(paths))], also_read)
    checked_targets(paths)

    def compute() -> tuple[AnyCells, Hierarchy]:
        return _computed(_Source(input, labels, mask, barriers), counts, ending, **options)

    cells, nested = run_in_background(compute)
    _write(paths, output, ending, cells, nested)
    names = [str(path) for path in paths]
    if as_json:
        facts = {"file": input, "levels": list(nested.counts), "n_finest": nested.n_finest}
        click.echo(json.dumps({**facts, "n_fewest": nested.n_fewest, "outputs": names}))
    elif not is_quiet:
        name = name_of(input) if input == STANDARD_STREAM else Path(input).name
        listed = ", ".join(map(str, nested.counts))
        size = counted(n_cells_of(cells), noun_of(cells))
        click.echo(f"{name}: {size}, levels of {listed} regions")
        click.echo("wrote " + ", ".join(names))


def _ending_of(output: Path) -> str:
    try:
        return known_ending(output, OUTPUT_ENDINGS)
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def _paths_of_levels(output: Path, ending: str, counts: tuple[int, ...]) -> list[Path]:
    """The file that holds all levels; or one for each, the finest first, with its number."""
    if ending in ALL_LEVELS:
        return [output]
    stem, given = output.name[: -len(ending)], output.name[-len(ending) :]
    return [output.with_name(f"{stem}.{n}{given}") for n in sorted(counts, reverse=True)]


@dataclass(frozen=True)
class _Source:
    """The files to read."""

    input: str
    labels: Path | None
    mask: Path | None
    barriers: Path | None


def _computed(
    source: _Source, counts: tuple[int, ...], ending: str, *, format: str | None,
    features: tuple[str, ...], islands: Islands, n_threads: int | None,
) -> tuple[AnyCells, Hierarchy]:  # fmt: skip
    """Read the files, and make the levels; an error before that if the output cannot hold them."""
    cells, attributes = load_cells_and_attributes(source.input, format, keep=bool(features))
    n_cells = n_cells_of(cells)
    given = None if source.labels is None else read_labels(source.labels, n_cells)
    if ending != ARRAYS:
        check_fit(cells, given, [ending], FormatOptions())
    constraints = constraints_of(source.mask, source.barriers, n_cells)
    table = features_of(features, cells, attributes, checked_threads(n_threads))
    with warnings.catch_warnings():  # the levels are exact; slivers are not looked at here
        warnings.simplefilter("ignore", IslandWarning)
        warnings.simplefilter("ignore", SliverWarning)
        return cells, hierarchy(
            cells, counts, labels=given, features=table, islands=islands, n_threads=n_threads,
            **constraints,
        )  # fmt: skip


def _write(
    paths: Sequence[Path], output: Path, ending: str, cells: AnyCells, nested: Hierarchy
) -> None:
    """Write all files, or none; names in them are made of that of the output as given."""
    with atomic_outputs(paths) as temporaries:
        if ending in ALL_LEVELS:
            with temporaries[0].open("wb") as file:
                _write_all(file, ending, nested)
            return
        for temporary, labels in zip(temporaries, nested.levels, strict=True):
            with temporary.open("wb") as file:
                writer_of(cells, labels, ending, FormatOptions()).write(file, ending, output)


def _write_all(file: IO[bytes], ending: str, nested: Hierarchy) -> None:
    """Write the labels of all levels; as arrays, also who is part of whom, and the merge tree."""
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
