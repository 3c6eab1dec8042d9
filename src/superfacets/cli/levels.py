"""The command ``superfacets levels``."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import click
import numpy as np

from .._options import ISLANDS
from ..errors import IslandWarning, SliverWarning
from ..io.atomic import atomic_outputs, checked_targets
from ..io.guards import counted, known_ending
from ..io.readers.labels import read_labels
from ..io.writers.write import OUTPUT_ENDINGS, write_outputs
from ..levels import hierarchy
from ..mesh.faces import AnyCells, n_cells_of, noun_of
from ..regions.hierarchy import Hierarchy
from .background import run_in_background
from .inputs import check_inputs, load_cells, name_of
from .options import COUNT, FILE, INPUT_FORMATS, STANDARD_STREAM, numbers

__all__ = ["levels_command"]

ALL_LEVELS = ".npz"


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
    help="A .npz that holds all levels; or any file that segment writes: OUT.ply then becomes"
    " OUT.2000.ply, OUT.500.ply and so on.",
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
@click.option("--threads", "n_threads", type=COUNT, help="Threads to use.  [default: one per core]")
@click.option(
    "--format",
    type=click.Choice(INPUT_FORMATS),
    help="Format of IN.  [default: by the ending; standard input by its content]",
)
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def levels_command(
    input: str, counts: tuple[int, ...], output: Path, labels: Path | None, format: str | None,
    *, as_json: bool, **options: Any,
) -> None:  # fmt: skip
    """Segment the mesh or point cloud in the file IN, and merge regions level by level.

    Each region of a level is a union of regions of the finer levels. IN may be - for standard
    input.
    """
    check_inputs((input,))
    paths = _outputs(output, counts)
    checked_targets(list(paths.values()))

    def compute() -> tuple[AnyCells, Hierarchy]:
        cells = load_cells(input, format)
        given = None if labels is None else read_labels(labels, n_cells_of(cells))
        with warnings.catch_warnings():  # the levels are exact; slivers are not looked at here
            warnings.simplefilter("ignore", IslandWarning)
            warnings.simplefilter("ignore", SliverWarning)
            return cells, hierarchy(cells, counts, labels=given, **options)

    cells, nested = run_in_background(compute)
    names = _write(paths, cells, nested)
    if as_json:
        facts = {"file": input, "levels": list(nested.counts), "n_finest": nested.n_finest}
        click.echo(json.dumps({**facts, "n_fewest": nested.n_fewest, "outputs": names}))
        return
    name = name_of(input) if input == STANDARD_STREAM else Path(input).name
    listed = ", ".join(map(str, nested.counts))
    size = counted(n_cells_of(cells), noun_of(cells))
    click.echo(f"{name}: {size}, levels of {listed} regions")
    click.echo("wrote " + ", ".join(names))


def _outputs(output: Path, counts: tuple[int, ...]) -> dict[int | None, Path]:
    """The file of each level by its number of regions; or, by None, that of all."""
    try:
        ending = known_ending(output, (ALL_LEVELS, *OUTPUT_ENDINGS))
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if ending == ALL_LEVELS:
        return {None: output}
    return {n: output.with_name(f"{output.stem}.{n}{output.suffix}") for n in reversed(counts)}


def _write(paths: dict[int | None, Path], cells: AnyCells, nested: Hierarchy) -> list[str]:
    for n, path in paths.items():
        if n is None:
            _write_all(path, nested)
        else:
            write_outputs([path], cells, nested.cut(n))
    return [str(path) for path in paths.values()]


def _write_all(path: Path, nested: Hierarchy) -> None:
    """Write the labels of all levels, who is part of whom, and the merge tree."""
    arrays: dict[str, Any] = {
        "counts": np.array(nested.counts),
        "labels": np.stack(nested.levels),
        **{f"parents_{i}": parents for i, parents in enumerate(nested.parents)},
        "finest": nested.finest,
        "children": nested.children,
        "costs": nested.costs,
    }
    with atomic_outputs([path]) as (temporary,), temporary.open("wb") as file:
        np.savez(file, **arrays)
