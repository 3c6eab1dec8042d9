"""The command `superfacets`."""

from __future__ import annotations

import dataclasses
import json
import signal
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click
import numpy as np
import numpy.typing as npt

from .. import __version__
from .._options import INITS, ISLANDS, WEIGHTS
from .._timing import timed
from ..cells.slivers import advised_max_edge, sliver_note
from ..cells.subdivision import Subdivision, subdivide
from ..clustering.loop import Segmentation
from ..errors import MeshError, MissingExtraError, SliverWarning
from ..io.readers.labels import has_labels, read_labels
from ..io.readers.read import read_mesh
from ..io.writers.write import check_outputs, write_outputs
from ..mesh.triangle_mesh import Mesh
from ..metrics.cuts import DEFAULT_TOLERANCE
from ..pipeline import PAPER, segment
from ..study.reproduce.command import reproduce_command
from ..view.camera import Up
from ..view.gl import RenderError
from .quality import quality_command

if TYPE_CHECKING:
    from ..cells.info import MeshInfo

__all__ = ["main"]

EXIT_DATA, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130

FILE = click.Path(path_type=Path)
POSITIVE = click.FloatRange(min=0, min_open=True)
NOT_NEGATIVE = click.FloatRange(min=0)


def main() -> NoReturn:
    """Run the command. A fault of the user's is one line on stderr and an exit status."""
    signal.signal(signal.SIGTERM, _terminate)
    try:
        commands.main(standalone_mode=False)
    except click.UsageError as error:
        place = error.ctx.command_path if error.ctx else "superfacets"
        _fail(f"{error.format_message()} (see {place} --help)", EXIT_USAGE)
    except click.Abort:
        _fail("interrupted", EXIT_INTERRUPTED)
    except OSError as error:
        _fail(_text_of_os_error(error), EXIT_DATA)
    except (MeshError, MissingExtraError, RenderError) as error:
        _fail(str(error), EXIT_DATA)
    except MemoryError:
        _fail("not enough memory", EXIT_DATA)
    except ValueError as error:  # a parameter, or a setting in the environment
        _fail(str(error), EXIT_USAGE)
    sys.exit(0)


def _terminate(*_: object) -> NoReturn:
    """End as after Ctrl-C, so that temporary files are removed."""
    raise KeyboardInterrupt


def _fail(message: str, status: int) -> NoReturn:
    one_line = " ".join(message.split())
    click.echo(f"superfacets: error: {one_line}", err=True)
    sys.exit(status)


def _text_of_os_error(error: OSError) -> str:
    if error.filename is None or error.strerror is None:
        return str(error)
    return f"{error.filename}: {error.strerror}"


# What click does without a command differs between 8.1 and 8.2: this does not depend on it.
@click.group(context_settings={"help_option_names": ["-h", "--help"]}, invoke_without_command=True)
@click.version_option(__version__, message="superfacets %(version)s")
@click.pass_context
def commands(context: click.Context) -> None:
    """Oversegment meshes into superfacets: compact, connected regions that follow the creases."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help(), err=True)
        sys.exit(EXIT_USAGE)


commands.add_command(reproduce_command)
commands.add_command(quality_command)


@commands.command("segment")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option(
    "-n", "--n-segments", type=click.IntRange(min=1), help="Number of regions.  [default: 150]"
)
@click.option(
    "-r",
    "--radius",
    type=POSITIVE,
    help="Radius of a region, as a fraction of the mesh's diagonal, instead of -n.",
)
@click.option(
    "-a",
    "--alpha",
    type=NOT_NEGATIVE,
    help="How much borders follow creases.  [default: by weights: 20, 200, 0.5]",
)
@click.option(
    "--eta",
    "eta_convex",
    type=NOT_NEGATIVE,
    help="What a convex crease counts against a concave one.  [default: by weights: 0, 0.2]",
)
@click.option(
    "--weights",
    type=click.Choice(tuple(WEIGHTS)),
    help="Lengths of steps: with a price for creases that does not depend on resolution, those of"
    " the paper, or those of Shlafman, Tal and Katz.  [default: creases]",
)
@click.option(
    "--init",
    type=click.Choice(INITS),
    help="How the first centers are placed.  [default: geodesic]",
)
@click.option("--paper", is_flag=True, help="The algorithm of the paper, to the letter.")
@click.option(
    "--max-iter",
    "max_num_iter",
    type=click.IntRange(min=1),
    default=50,
    show_default=True,
    help="At most so many iterations.",
)
@click.option(
    "--tol",
    type=NOT_NEGATIVE,
    help="Stop when centers move less, in radii.  [default: 0.02; 0 with --paper]",
)
@click.option(
    "--smooth/--no-smooth",
    default=None,
    help="Make borders straight where the surface is smooth.  [default: yes, but with --paper]",
)
@click.option(
    "--connect",
    "enforce_connectivity",
    is_flag=True,
    help="Regions that have fallen apart, with --paper, keep one piece.",
)
@click.option(
    "--min-size",
    type=NOT_NEGATIVE,
    help="Regions smaller than this, in mean regions, join a neighbor.",
)
@click.option(
    "--islands",
    type=click.Choice(ISLANDS),
    help="What small regions do that touch no other.  [default: keep]",
)
@click.option(
    "--subdivide",
    "is_subdivided",
    is_flag=True,
    help="Bisect edges longer than a quarter of a region's radius first, for meshes of long thin"
    " faces. A .ply then holds the subdivided mesh; label files hold a label for each face of IN:"
    " that with the most area in it.",
)
@click.option(
    "--max-edge",
    type=POSITIVE,
    help="Subdivide until no edge is longer than this, in the unit of the mesh.",
)
@click.option(
    "--threads",
    "n_threads",
    type=click.IntRange(min=1),
    help="Threads to use.  [default: one per core]",
)
@click.option(
    "-o",
    "--output",
    "outputs",
    metavar="OUT",
    type=FILE,
    multiple=True,
    help="A .ply (mesh with labels and colors) or a .npy, .seg or .txt (labels); may be"
    " given several times.  [default: IN.superfacets.ply]",
)
@click.option("--ascii", is_flag=True, help="Write .ply files as text.")
@click.option("--json", "as_json", is_flag=True, help="Print the facts of the run as JSON.")
def segment_command(
    mesh: Path, outputs: tuple[Path, ...], ascii: bool, as_json: bool, is_subdivided: bool,
    max_edge: float | None, **options: Any,
) -> None:  # fmt: skip
    """Segment the mesh in the file IN and write its labels."""
    if not mesh.name:
        raise click.UsageError(f"{mesh} is not a file")
    options = _parameters(**options)
    paths = list(outputs) or [mesh.with_name(f"{mesh.stem}.superfacets.ply")]
    _check_outputs(mesh, paths)
    timings: dict[str, float] = {}
    with timed(timings, "mesh"):
        surface = read_mesh(mesh)
    parts = None
    if is_subdivided or max_edge is not None:
        with timed(timings, "subdivide"):
            parts = _subdivide(surface, max_edge, options)
        surface = parts.mesh
    result = _segment(surface, **options)
    listed = None if parts is None else parts.labels_back(result.labels)
    with timed(timings, "export"):
        write_outputs(paths, surface, result.labels, ascii=ascii, listed=listed)
    stages = {**result.timings, **timings}
    asked = result.params["n_segments"]
    for note in _notes(result, asked) + _notes_of_parts(parts, listed, result, paths):
        click.echo(f"superfacets: note: {note}", err=True)
    if as_json:
        click.echo(json.dumps(_facts(mesh, result, stages, paths)))
    else:
        click.echo(_summary(mesh, result, stages, paths))


@commands.command("info")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def info_command(mesh: Path, as_json: bool) -> None:
    """Print counts and sizes of the mesh in the file IN."""
    from ..cells.info import mesh_info

    info = mesh_info(read_mesh(mesh))
    if as_json:
        click.echo(json.dumps({"file": str(mesh), **dataclasses.asdict(info)}))
    else:
        click.echo("\n".join(f"{name:<20} {value}" for name, value in _rows_of_info(info)))


@commands.command("render")
@click.argument("mesh", metavar="IN", type=FILE)
@click.option("-o", "--output", metavar="OUT", type=FILE, required=True, help="A .png file.")
@click.option(
    "--up",
    type=click.Choice(("auto", "x", "y", "z")),
    default="auto",
    show_default=True,
    help="Axis that points up; a guess between y and z by default.",
)
@click.option("--azimuth", type=float, default=30.0, show_default=True, help="Degrees around.")
@click.option(
    "--elevation",
    type=click.FloatRange(-90, 90),
    default=15.0,
    show_default=True,
    help="Degrees above the horizon.",
)
@click.option(
    "--labels",
    metavar="L",
    type=FILE,
    help="A .npy, .seg, .txt or labeled .ply; those in IN, if it has any, otherwise.",
)
def render_command(
    mesh: Path, output: Path, up: Up, azimuth: float, elevation: float, labels: Path | None
) -> None:
    """Draw a shaded picture of the mesh in the file IN, with its regions and dark borders."""
    from ..view.rendering import View, render

    if output.suffix.lower() != ".png":
        raise click.UsageError(f"{output}: pictures are written as .png")
    surface = read_mesh(mesh)
    shown = _labels_of(mesh, surface) if labels is None else read_labels(labels, surface.n_faces)
    view = View(azimuth=azimuth, elevation=elevation, up=up)
    render(surface, shown, output=output, view=view)
    click.echo(f"wrote {output}")


@commands.command("evaluate")
@click.argument("mesh", metavar="IN", type=FILE)
@click.argument("labels", metavar="LABELS", type=FILE)
@click.argument("more", nargs=-1, type=FILE, metavar="[--gt SEG...]")
@click.option(
    "--gt",
    "truths",
    metavar="SEG...",
    type=FILE,
    multiple=True,
    help="Ground truth: labels too, one or more files (say, seg/1/*.seg).",
)
@click.option(
    "--tolerance",
    type=NOT_NEGATIVE,
    default=DEFAULT_TOLERANCE,
    show_default=True,
    help="How far apart borders may be to count as one, as a fraction of the mesh's diagonal.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the metrics as JSON.")
def evaluate_command(
    mesh: Path, labels: Path, truths: tuple[Path, ...], more: tuple[Path, ...], tolerance: float,
    as_json: bool,
) -> None:  # fmt: skip
    """Print how good LABELS of the mesh in the file IN are, against ground truth if there is any.

    Labels are read from .npy, .seg, .txt or labeled .ply files.
    """
    from ..metrics import evaluate

    if more and not truths:
        raise click.UsageError(
            f"Got unexpected extra argument ({more[0]}): ground truth needs --gt"
        )
    surface = read_mesh(mesh)
    regions = read_labels(labels, surface.n_faces)
    segments = [read_labels(path, surface.n_faces) for path in (*truths, *more)]
    values = evaluate(surface, regions, segments, tolerance=tolerance)
    if segments:
        click.echo(f"labels: {labels}; ground truths: {len(segments)}", err=True)
    if as_json:
        files = {"file": str(mesh), "labels": str(labels), "n_ground_truths": len(segments)}
        click.echo(json.dumps(files | values))
    else:
        click.echo("\n".join(f"{name:<26} {value:.6g}" for name, value in values.items()))


@commands.command("demo")
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    type=FILE,
    default=Path("superfacets-demo"),
    show_default=True,
    help="Folder for the results.",
)
def demo_command(output: Path) -> None:
    """Segment a sample mesh that comes along, and write a labeled mesh and a picture of it."""
    from ..sample import sample_mesh
    from ..view.rendering import check_rendering, render

    check_rendering()
    output.mkdir(parents=True, exist_ok=True)
    labeled, picture = output / "bear.superfacets.ply", output / "bear.superfacets.png"
    timings: dict[str, float] = {}
    with timed(timings, "mesh"):
        surface = sample_mesh()
    result = _segment(surface)
    with timed(timings, "export"):
        write_outputs([labeled], surface, result.labels)
    click.echo(_summary(Path("bear"), result, {**result.timings, **timings}, [labeled]))
    render(surface, result.labels, output=picture)
    click.echo(f"wrote {picture}")


def _check_outputs(mesh: Path, paths: list[Path]) -> None:
    """Find what is wrong with output files before the work is done."""
    try:
        check_outputs(paths)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    if any(path.exists() and mesh.exists() and path.samefile(mesh) for path in paths):
        raise click.UsageError(f"{mesh}: the output would take the place of the input")


def _parameters(*, paper: bool, **options: Any) -> dict[str, Any]:
    """The keywords of `segment` that were given, or that --paper stands for."""
    given = {name: value for name, value in options.items() if value is not None}
    if not paper:
        return given
    for name in ("weights", "init"):
        if name in given and given[name] != PAPER[name]:
            raise click.UsageError(f"--paper has {name} of its own: leave --{name} out")
    return {**PAPER, **given}


def _subdivide(mesh: Mesh, max_edge: float | None, options: Mapping[str, Any]) -> Subdivision:
    """Subdivide for the regions that are asked for, where no longest edge is given."""
    if max_edge is None:
        max_edge = advised_max_edge(mesh, options.get("n_segments"), options.get("radius"))
    return subdivide(mesh, max_edge, n_threads=options.get("n_threads"))


def _segment(mesh: Mesh, **options: Any) -> Segmentation:
    """Segment with a progress bar on a terminal; what warnings say, notes say."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SliverWarning)
        return _segment_with_progress(mesh, **options)


def _segment_with_progress(mesh: Mesh, **options: Any) -> Segmentation:
    if not sys.stderr.isatty():
        return segment(mesh, **options)
    from tqdm import tqdm

    total = options.get("max_num_iter")
    with tqdm(total=total, unit="iteration", leave=False) as bar:

        def progress(_: int, n_moved: int) -> None:
            bar.set_postfix(centers_moved=n_moved, refresh=False)
            bar.update()

        return segment(mesh, progress=progress, **options)


def _labels_of(path: Path, mesh: Mesh) -> npt.NDArray[Any] | None:
    """The labels that a file holds along with its mesh; None if it has none."""
    return read_labels(path, mesh.n_faces) if has_labels(path) else None


def _notes(result: Segmentation, asked: int | None) -> list[str]:
    """What may come as a surprise."""
    notes = []
    keeps_k = result.params["init"] in ("geodesic", "farthest")
    n_more = result.n_segments + result.n_merged - asked if asked is not None and keeps_k else 0
    if n_more > 0:
        why = "components of the mesh that got no seed"
        if result.params["radius_factor"] is not None:
            why += ", or faces that no center reached"
        notes.append(f"{n_more} more regions than asked for, for {why}")
    if result.n_joined:
        notes.append(f"{result.n_joined} stray pieces joined a neighbor")
    if result.n_merged:
        notes.append(f"{result.n_merged} small regions joined another")
    if result.n_islands:
        notes.append(f"{result.n_islands} small regions touch no other, and stayed")
    slivers = sliver_note(result.sliver_share or 0.0, "try --subdivide")
    return notes if slivers is None else [*notes, slivers]


def _notes_of_parts(
    parts: Subdivision | None,
    listed: npt.NDArray[np.int64] | None,
    result: Segmentation,
    paths: list[Path],
) -> list[str]:
    """What happened to the faces of the input, where it was subdivided."""
    if parts is None or listed is None:
        return []
    notes = [f"{parts.n_sources} faces were subdivided into {len(parts.sources)}"]
    n_lost = result.n_segments - len(np.unique(listed))
    if n_lost and any(path.suffix.lower() != ".ply" for path in paths):
        notes.append(
            f"{n_lost} regions have the most area in no face of the input: label files lack them"
        )
    return notes


def _facts(
    mesh: Path, result: Segmentation, timings: Mapping[str, float], paths: list[Path]
) -> dict[str, Any]:
    return {
        "file": str(mesh),
        "n_faces": len(result.labels),
        "n_segments": result.n_segments,
        "n_iter": result.n_iter,
        "stop_reason": result.stop_reason,
        "seconds": dict(timings),
        "sliver_share": result.sliver_share,
        "params": result.params,
        "outputs": [str(path) for path in paths],
    }


def _summary(
    mesh: Path, result: Segmentation, timings: Mapping[str, float], paths: list[Path]
) -> str:
    seconds = ", ".join(f"{stage} {spent:.3f}" for stage, spent in timings.items())
    written = "\n".join(f"wrote {path}" for path in paths)
    return (
        f"{written}\n{mesh.name}: {len(result.labels)} faces, {result.n_segments} regions, "
        f"{result.n_iter} iterations, {result.stop_reason}; seconds: {seconds}"
    )


def _rows_of_info(info: MeshInfo) -> list[tuple[str, str]]:
    low, high = (" ".join(f"{value:g}" for value in corner) for corner in info.bounds)
    return [
        ("faces", str(info.n_faces)),
        ("vertices", str(info.n_vertices)),
        ("distinct positions", str(info.n_positions)),
        ("components", str(info.n_components)),
        ("edges", str(info.n_edges)),
        ("boundary edges", str(info.n_boundary_edges)),
        ("non-manifold edges", str(info.n_nonmanifold_edges)),
        ("inconsistent edges", str(info.n_inconsistent_edges)),
        ("degenerate faces", str(info.n_degenerate_faces)),
        ("inside out", "yes" if info.is_inside_out else "no"),
        ("bounding box", f"{low} to {high}"),
        ("diagonal", f"{info.diagonal:g}"),
        ("area", f"{info.area:g}"),
    ]
