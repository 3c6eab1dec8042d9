"""The command ``python -m benchmarks``."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np

import superfacets as sf

from . import report, runs, targets
from .balance import balance_table, measure_balance
from .batch import measure_batch, table
from .checks import (
    EXPECTED,
    WrongLabelsError,
    check_against_reference,
    check_invariants,
    hash_labels,
    hash_mesh,
    load_expected,
    require,
    save_expected,
)
from .doubling import JOBS, LIMIT, SHAPES, doubling_table, measure_doubling
from .machine import facts, usable_cores
from .meshes import Arrays, build, find_data
from .pages import knobby_torus, measure_page, page_table
from .peers import measure_peers
from .plan import make_plan
from .sections import SECTIONS, measure

FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False, exists=True)

README_MESHES = ("bear60k", "bear60k-x4", "bear60k-x16")


class Group(click.Group):
    """Group of commands that reports wrong labels, meshes and settings in one line on stderr."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""
        try:
            return super().invoke(ctx)
        except WrongLabelsError as error:
            raise click.ClickException(f"no times: {error}") from error
        except (ValueError, ImportError) as error:
            raise click.ClickException(str(error)) from error


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
def commands() -> None:
    """Time superfacets: check labels first, print tables, and write JSON."""


data_option = click.option(
    "--data", type=FOLDER, help="Folder that contains the folder meshes.  [SUPERFACETS_DATA]"
)


def selection(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that select meshes."""
    options = [
        click.option("--meshes", help="Names, separated by commas: bunny,hand-x64,bear60k."),
        click.option("--max-faces", type=click.IntRange(min=1), help="Maximum number of faces."),
        data_option,
    ]
    for option in reversed(options):
        command = option(command)
    return command


def running(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options of commands that measure sections."""
    options = [
        click.option("--quick", is_flag=True, help="Meshes of up to 500,000 faces, 3 runs each."),
        click.option("--repeats", type=click.IntRange(min=1), help="Number of counted runs."),
        click.option("--json", "output", type=FILE, help="File for all results."),
    ]
    for option in reversed(options):
        command = option(command)
    return selection(command)


def _names(meshes: str | None) -> tuple[str, ...]:
    return tuple(meshes.split(",")) if meshes else ()


def _say(text: str) -> None:
    click.echo(f"benchmarks: {text}", err=True)


def _run(sections: set[str], **options: Any) -> None:
    """Measure sections, print their tables, and write the JSON."""
    output = options.pop("output")
    meshes = _names(options.pop("meshes"))
    plan = make_plan(meshes=meshes, **options)
    if plan.data is None:
        _say("no data folder was found (SUPERFACETS_DATA, ../shared/data): using sample meshes")
    results = measure(plan, frozenset(sections), load_expected(), _say)
    click.echo(report.render(results))
    if output:
        output.write_text(json.dumps(results, indent=1) + "\n")
        _say(f"wrote {output}")


@commands.command("targets")
@click.option("--repeats", type=click.IntRange(min=1), default=3, show_default=True)
@data_option
@click.option("--json", "output", type=FILE, help="File for all results.")
def measure_targets(repeats: int, data: Path | None, output: Path | None) -> None:
    """Measure the rows of the documentation that have a target, in about five minutes."""
    check_against_reference()
    before = facts()  # now the load is caused by other processes only
    found = targets.measure(targets.Meshes(), find_data(data), repeats, load_expected(), _say)
    results = {"machine": before} | found
    click.echo(report.render(results))
    if output:
        output.write_text(json.dumps(results, indent=1) + "\n")
        _say(f"wrote {output}")


SECTION_COMMANDS = {
    "stages": ({"stages", "passes"}, "Time all stages from arrays to labels, and single passes."),
    "scaling": ({"scaling"}, "Time more numbers of regions, settings and threads."),
    "orders": ({"orders"}, "Time large meshes in their order, and in random order."),
    "rivals": ({"rivals"}, "Time METIS, pyacvd, SLIC and SciPy side by side with superfacets."),
    "memory": ({"memory"}, "Measure peak memory, in fresh processes."),
    "all": (set(SECTIONS), "Run all of the commands above."),
}
for _name, (_sections, _help) in SECTION_COMMANDS.items():
    commands.command(_name, help=_help)(running(partial(_run, _sections)))


@commands.command()
@click.option("--repeats", type=click.IntRange(min=1), default=5, show_default=True)
def timings(repeats: int) -> None:
    """Print the table of times for the README."""
    rows = []
    for mesh in README_MESHES:
        cases = [runs.Case(mesh, k, "defaults", usable_cores()) for k in (150, 2_000)]
        rows += runs.measure(build(mesh, None), cases, repeats, load_expected())
    click.echo(report.readme_table(rows))


@commands.command()
@click.argument("folder", type=FOLDER)
@click.option("--workers", default="1,2", show_default=True, help="Numbers, separated by commas.")
@click.option("--repeats", type=click.IntRange(min=1), default=5, show_default=True)
@click.option("--files", type=click.IntRange(min=1), help="Number of files; the files are copied.")
def batch(folder: Path, workers: str, repeats: int, files: int | None) -> None:
    """Time `superfacets batch` on the meshes in FOLDER, alternating between numbers of workers."""
    counts = [int(count) for count in workers.split(",")]
    click.echo(table(measure_batch(folder, counts, repeats, files)))


@commands.command()
@click.argument("folder", type=FOLDER)
@click.option("-k", "ks", type=click.IntRange(min=1), multiple=True, help="Numbers of regions.")
@click.option("--every", type=click.IntRange(min=1), default=1, help="Every n-th model.")
def balance(folder: Path, ks: tuple[int, ...], every: int) -> None:
    """Compare regions of equal area with METIS and pyacvd, on the Princeton benchmark in FOLDER."""
    click.echo(balance_table(measure_balance(folder, ks or (50, 150, 300), every, _say)))


@commands.command()
@click.argument("folder", type=FOLDER)
@click.option("-k", type=click.IntRange(min=1), default=150, show_default=True)
@click.option("--every", type=click.IntRange(min=1), default=1, help="Every n-th model.")
@click.option("--into", "document", type=FILE, help="Document whose table is filled.")
def peers(folder: Path, k: int, every: int, document: Path | None) -> None:
    """Compare with METIS, VSA, pyacvd and ScanNet's segmentator, on the Princeton benchmark."""
    marks = "<!-- table: peers --><!-- end -->"
    filled = report.fill_peers(
        document.read_text() if document else marks, measure_peers(folder, k, every, _say)
    )
    if document:
        document.write_text(filled)
    else:
        click.echo(filled)


@commands.command()
@click.argument("mesh")
@click.option("--segments", type=click.IntRange(min=1), default=2_000, show_default=True)
@click.option("--frames", type=click.IntRange(min=1), default=20, show_default=True)
@data_option
@click.option("--json", "output", type=FILE, help="File for all results.")
def page(mesh: str, segments: int, frames: int, data: Path | None, output: Path | None) -> None:
    """Measure a page of MESH in a browser, while the view turns.

    MESH is a file, a name such as bear60k-x16, or a number of faces for a torus with knobs.
    """
    found = measure_page(_mesh_of_page(mesh, data), segments, frames)
    click.echo(page_table(found))
    if output:
        output.write_text(json.dumps(found, indent=1) + "\n")


def _mesh_of_page(mesh: str, data: Path | None) -> sf.Mesh | sf.PolygonMesh:
    if mesh.isdecimal():
        return knobby_torus(int(mesh))
    if not Path(mesh).is_file():
        return sf.Mesh(*build(mesh, find_data(data)))
    found = sf.read_mesh(mesh)
    if isinstance(found, sf.TetMesh):
        raise click.UsageError(f"{mesh} has tetrahedra: give a mesh of faces")
    return found


@commands.command()
@click.option("--shapes", help="Names, separated by commas.  [default: all]")
@click.option("--jobs", help="Names, separated by semicolons.  [default: all]")
@click.option("--smallest", type=click.IntRange(min=8), default=16_000, show_default=True)
@click.option("--doublings", type=click.IntRange(min=1), default=3, show_default=True)
@click.option("--repeats", type=click.IntRange(min=1), default=3, show_default=True)
def doubling(
    shapes: str | None, jobs: str | None, smallest: int, doublings: int, repeats: int
) -> None:
    """Measure how CPU time grows with size, on inputs that may make an algorithm quadratic."""
    sizes = [smallest << i for i in range(doublings + 1)]
    some_shapes, some_jobs = _known(shapes, ",", SHAPES), _known(jobs, ";", JOBS)
    found = []
    for growth in measure_doubling(some_shapes, some_jobs, sizes, repeats):
        found.append(growth)
        times = ", ".join(f"{seconds:.3g}" for seconds in growth.seconds)
        verdict = "" if growth.exponent <= LIMIT else f", more than {LIMIT}"
        _say(f"{growth.shape}, {growth.job}: {times} s; exponent {growth.exponent:.2f}{verdict}")
    click.echo(doubling_table(found))


def _known(names: str | None, separator: str, known: Collection[str]) -> list[str]:
    wanted = names.split(separator) if names else list(known)
    unknown = [name for name in wanted if name not in known]
    if unknown:
        raise click.UsageError(f"unknown name {unknown[0]!r}: choose from {', '.join(known)}")
    return wanted


@commands.command("report")
@click.argument("results", type=FILE)
@click.option("--into", "document", type=FILE, help="Document whose tables are filled.")
def render_report(results: Path, document: Path | None) -> None:
    """Print the tables of a file of results, or put them into a document."""
    loaded = json.loads(results.read_text())
    if document is None:
        click.echo(report.render(loaded))
    else:
        document.write_text(report.fill(document.read_text(), loaded))
        _say(f"filled the tables of {document}")


@commands.command()
@selection
@click.option("--output", type=FILE, default=EXPECTED, help="File for the hashes.")
def expect(meshes: str | None, output: Path, **options: Any) -> None:
    """Store new hashes of labels, after a check of labels against reference.

    Hashes of other meshes are kept.
    """
    check_against_reference()
    plan = make_plan(meshes=_names(meshes), **options)
    stored = load_expected(output)
    for mesh, n_faces in plan.meshes.items():
        _say(f"{mesh}: {n_faces:,} faces")
        arrays = build(mesh, plan.data)
        labels = {
            runs.run_name(*run): _hash_of_labels(arrays, *run) for run in plan.hashed_runs(mesh)
        }
        stored["meshes"][mesh] = {"mesh": hash_mesh(arrays), "labels": labels}
        save_expected(stored, output)


def _hash_of_labels(arrays: Arrays, n_segments: int, settings: str) -> str:
    """Return the hash of labels, after checks of invariants and of equal labels on one thread."""
    job = partial(runs.SETTINGS[settings], arrays, n_segments)
    result, alone = job(), job(n_threads=1)
    require(np.array_equal(result.labels, alone.labels), "one thread gives other labels")
    check_invariants(arrays, result)
    return hash_labels(result.labels)
