"""The command ``superfacets segment``."""

from __future__ import annotations

import json
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
import numpy.typing as npt

from .._options import (
    INITS,
    ISLANDS,
    WEIGHTS,
    CleanupOptions,
    LoopOptions,
    SizeOptions,
    WeightOptions,
)
from .._timing import timed
from .._validate import checked_threads
from ..adapters.convert import as_mesh
from ..cells.slivers import advised_max_edge
from ..cells.subdivision import Subdivision, subdivide
from ..clustering.segmentation import Segmentation
from ..errors import IslandWarning, SliverWarning
from ..io.attributes import MeshAttributes
from ..io.guards import counted
from ..io.writers.cells import FormatOptions
from ..io.writers.write import check_outputs, write_outputs
from ..mesh.faces import AnyCells, n_cells_of, noun_of
from ..mesh.point_cloud import PointCloud
from ..pipeline import PAPER, segment
from .background import run_in_background
from .constraints import constraint_options, constraints_of
from .failures import EXIT_DATA, FAILURES, message_of, print_error, print_note
from .features import features_of
from .inputs import check_inputs, load_cells_and_attributes, name_of
from .options import COUNT, INPUT_FORMATS, NOT_NEGATIVE, POSITIVE, Count, label_options
from .outputs import OUTPUT_FORMATS, Job, plan_jobs
from .progress import Bar, open_bar
from .report import (
    attributes_of_parts,
    facts_of,
    notes_on_attributes,
    notes_on_listed,
    notes_on_regions,
    notes_on_vertices,
    summary_of,
)

__all__ = ["segment_command"]


@click.command("segment")
@click.argument(
    "inputs", metavar="IN...", type=click.Path(allow_dash=True), nargs=-1, required=True
)
@click.option("-n", "--n-segments", type=COUNT, help="Number of regions.  [default: 150]")
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
    help="Weight of convex creases (ridges) relative to concave ones; 0.2 is right for machine"
    " parts.  [default: by weights: 0, 0.2]",
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
    help="How the first centers are placed; flood and grid make only about as many regions as -n"
    " says.  [default: geodesic]",
)
@click.option("--paper", is_flag=True, help="The algorithm of the paper, exactly as published.")
@click.option(
    "--max-iter",
    "max_num_iter",
    type=Count(0),
    default=50,
    show_default=True,
    help="Maximum number of iterations; 0 labels by the first centers.",
)
@click.option(
    "--tol",
    type=NOT_NEGATIVE,
    help="Stop when centers move less, in radii.  [default: 0.02; 0 with --paper]",
)
@click.option(
    "--smooth/--no-smooth",
    default=None,
    help="Make borders straight where the surface is smooth.  [default: yes; no with --paper]",
)
@click.option(
    "--connect",
    "enforce_connectivity",
    is_flag=True,
    help="Disconnected regions, which --paper may give, keep one piece.",
)
@click.option(
    "--min-size",
    type=NOT_NEGATIVE,
    help="Regions smaller than this, in mean regions, join a neighbor.",
)
@click.option(
    "--islands",
    type=click.Choice(ISLANDS),
    help="Components without a seed, and small regions without a neighbor, are regions of their"
    " own, or join the nearest region, which makes -n exact (but with --init flood or grid)."
    "  [default: keep]",
)
@click.option(
    "--subdivide",
    "is_subdivided",
    is_flag=True,
    help="Bisect edges longer than a quarter of a region's radius first, for meshes of long thin"
    " faces. A .ply or .vtp then holds the subdivided mesh; label files hold a label for each face"
    " of IN: that with the most area in it.",
)
@click.option(
    "--max-edge",
    type=POSITIVE,
    help="Subdivide until no edge is longer than this, in the unit of the mesh.",
)
@click.option(
    "--features",
    metavar="NAME",
    multiple=True,
    help="What borders follow besides creases: color, normals, height (z), or a property of the"
    " faces, points or vertices in IN; may be given several times.",
)
@click.option(
    "--feature-weight",
    type=NOT_NEGATIVE,
    help="How much features count, in radii per standard deviation.  [default: 5]",
)
@constraint_options
@click.option(
    "--threads",
    "n_threads",
    type=COUNT,
    help="Threads to use.  [default: one per core]",
)
@click.option(
    "-o",
    "--output",
    "outputs",
    metavar="OUT",
    type=click.Path(allow_dash=True),
    multiple=True,
    help="A .ply, .vtp, .obj, .off or .glb (mesh with labels; of tetrahedra a .vtu or .vtk; of a"
    " point cloud a .ply, .csv, .las or .laz), a .npy, .seg or .txt (labels), a .segs.json, .bin or"
    " _sp_label.npy (labels of vertices), a .sstk.json, .aggregation.json or .npz (graph of"
    " regions); may be given several times. Or a folder (results/) for the files of all inputs, or"
    " - for standard output.  [default: IN.superfacets.ply beside IN]",
)
@click.option(
    "--to",
    "formats",
    type=click.Choice(OUTPUT_FORMATS),
    multiple=True,
    help="Format of what -o gives no file name for; may be given several times.  [default: ply;"
    " vtu of tetrahedra]",
)
@click.option(
    "--format",
    type=click.Choice(INPUT_FORMATS),
    help="Format of the inputs.  [default: by the ending; standard input by its content]",
)
@click.option("--ascii", is_flag=True, help="Write .ply and .vtp files as text.")
@label_options
@click.option(
    "--drop-attributes",
    is_flag=True,
    help="Do not carry over what a .ply input stores besides its mesh: colors, normals, texture"
    " coordinates, further properties, comments.",
)
@click.option("-q", "--quiet", "is_quiet", is_flag=True, help="Print nothing but errors.")
@click.option(
    "--json", "as_json", is_flag=True, help="Print the facts as JSON, an object and a line per IN."
)
@click.pass_context
def segment_command(
    ctx: click.Context,
    /,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    formats: tuple[str, ...],
    format: str | None,
    ascii: bool,
    label_name: str,
    vertex_labels: bool,
    drop_attributes: bool,
    is_quiet: bool,
    as_json: bool,
    is_subdivided: bool,
    max_edge: float | None,
    features: tuple[str, ...],
    mask: Path | None,
    barriers: Path | None,
    **options: Any,
) -> None:
    """Segment the meshes and point clouds in the files IN and write their labels.

    IN may be - for standard input; the result then goes to standard output, if -o names no other
    place. What is printed goes to stderr where standard output holds the result. An input that
    fails does not stop the others; the exit status is 1 if one did.
    """
    keywords = _keywords(**options)
    _check_keywords(keywords)
    check_inputs(inputs)
    jobs = plan_jobs(inputs, outputs, formats, ascii=ascii)
    form = FormatOptions.checked(
        [ending for job in jobs for ending in job.endings],
        ascii=ascii, label_name=label_name, vertex_labels=vertex_labels,
    )  # fmt: skip
    run = _Run(
        keywords, format, is_subdivided or max_edge is not None, max_edge, form=form,
        keeps_attributes=not drop_attributes, is_quiet=is_quiet, as_json=as_json,
        features=features, mask=mask, barriers=barriers,
    )  # fmt: skip
    n_failed = sum(not run.try_job(job, is_one_of_many=len(jobs) > 1) for job in jobs)
    if n_failed and len(jobs) > 1:
        print_error(f"{n_failed} of {len(jobs)} files failed")
    if n_failed:
        ctx.exit(EXIT_DATA)


@dataclass(frozen=True)
class _Outcome:
    """The data to write for one input."""

    mesh: AnyCells
    attributes: MeshAttributes | None
    result: Segmentation
    listed: npt.NDArray[np.int64] | None = None  # labels of the input's faces, if subdivided
    listed_mesh: AnyCells | None = None  # that input


@dataclass(frozen=True)
class _Run:
    """What is to be done with each input."""

    keywords: dict[str, Any]  # of `segment`
    format: str | None
    is_subdivided: bool
    max_edge: float | None
    form: FormatOptions
    keeps_attributes: bool
    is_quiet: bool
    as_json: bool
    features: tuple[str, ...]  # names
    mask: Path | None
    barriers: Path | None

    def try_job(self, job: Job, *, is_one_of_many: bool) -> bool:
        """Do one job; if it fails, print why and return False."""
        name = name_of(job.input)
        try:
            self._do(job)
        except BrokenPipeError:  # click ends the process, without a word as others in a pipe do
            raise
        except (*FAILURES, ValueError) as error:
            if not (is_one_of_many or isinstance(error, FAILURES)):
                raise  # an option that does not suit the mesh: a wrong command line
            message = message_of(error)
            if is_one_of_many and name not in message:
                message = f"{name}: {message}"
            print_error(message)
            if self.as_json:
                self._print(job, json.dumps({"file": job.input, "error": message}))
            return False
        return True

    def _do(self, job: Job) -> None:
        check_outputs(job.files)
        timings: dict[str, float] = {}
        notes: list[str] = []
        with open_bar(name_of(job.input), is_quiet=self.is_quiet) as bar:
            outcome = run_in_background(
                lambda: self._compute(job, bar, timings, notes), tick=bar.draw
            )
            with timed(timings, "export", bar.on_stage):
                _write(job, outcome, self.form)
        result, noun = outcome.result, noun_of(outcome.mesh)
        timings = {**result.timings, **timings}
        if not self.is_quiet:
            for note in notes:
                print_note(note)
        if self.as_json:
            self._print(job, json.dumps(facts_of(job.input, result, timings, job.names, noun)))
        elif not self.is_quiet:
            name = Path(job.input).name if job.files or not job.stream else name_of(job.input)
            self._print(job, summary_of(name, result, timings, job.names, noun))

    def _compute(self, job: Job, bar: Bar, timings: dict[str, float], notes: list[str]) -> _Outcome:
        """Read, subdivide and segment; write nothing."""
        keeps = self.keeps_attributes and job.holds_attributes
        with timed(timings, "mesh", bar.on_stage):
            mesh, attributes = load_cells_and_attributes(
                job.input, self.format, keep=keeps or bool(self.features)
            )
            threads = checked_threads(self.keywords.get("n_threads"))
            of_cells = constraints_of(self.mask, self.barriers, n_cells_of(mesh))
            features = features_of(self.features, mesh, attributes, threads)
            if features is not None:
                of_cells["features"] = features
            attributes = attributes if keeps else None
        parts, given = None, mesh
        if self.is_subdivided:
            with timed(timings, "subdivide"):
                parts = self._subdivide(mesh)
            mesh = parts.mesh
            of_cells = {name: values[parts.sources] for name, values in of_cells.items()}
            notes.append(f"{parts.n_sources} faces were subdivided into {mesh.n_faces}")
            attributes = None if attributes is None else attributes_of_parts(attributes, parts)
        result = self._segment(mesh, of_cells, bar, notes)
        listed = None if parts is None else parts.labels_back(result.labels)
        if listed is not None and job.holds_labels:
            notes += notes_on_listed(result, listed)
        labels = result.labels if listed is None else listed
        notes += notes_on_vertices(given, labels, job.endings)
        if attributes is not None:
            notes += notes_on_attributes(attributes, of_points=isinstance(mesh, PointCloud))
        return _Outcome(mesh, attributes, result, listed, None if parts is None else given)

    def _subdivide(self, source: AnyCells) -> Subdivision:
        """Subdivide; without a given edge length, to suit the size of the regions."""
        mesh = as_mesh(source)
        get = self.keywords.get
        max_edge = self.max_edge
        if max_edge is None:
            max_edge = advised_max_edge(mesh, get("n_segments"), get("radius"))
        return subdivide(mesh, max_edge, n_threads=get("n_threads"))

    def _segment(
        self,
        mesh: AnyCells,
        of_cells: dict[str, Any],
        bar: Bar,
        notes: list[str],
    ) -> Segmentation:
        keywords = {**self.keywords, **of_cells}
        asked = keywords.get("n_segments")
        mask = of_cells.get("mask")
        n_cells = n_cells_of(mesh) if mask is None else int(mask.sum())
        if asked is not None and asked > n_cells:
            whole = "cloud" if isinstance(mesh, PointCloud) else "mesh"
            notes.append(
                f"{asked} regions were asked for; the {whole} has"
                f" {counted(n_cells, noun_of(mesh))}, each of which became a region"
            )
            keywords["n_segments"] = n_cells
        with warnings.catch_warnings():  # what warnings say, notes say
            warnings.simplefilter("ignore", IslandWarning)
            warnings.simplefilter("ignore", SliverWarning)
            result = segment(
                mesh,
                progress=bar.on_iteration,
                on_stage=bar.on_stage,
                **keywords,
            )
        notes += notes_on_regions(result, result.params["n_segments"])
        return result

    def _print(self, job: Job, text: str) -> None:
        """Print on stdout, or on stderr where stdout holds the result."""
        click.echo(text, err=job.stream is not None)


def _write(job: Job, outcome: _Outcome, form: FormatOptions) -> None:
    streams = {job.stream: sys.stdout.buffer} if job.stream else {}
    write_outputs(
        job.files,
        outcome.mesh,
        outcome.result.labels,
        streams=streams,
        attributes=outcome.attributes,
        options=form,
        listed=outcome.listed,
        listed_mesh=outcome.listed_mesh,
    )


def _keywords(*, paper: bool, **options: Any) -> dict[str, Any]:
    """The keywords of `segment` that were given, or that --paper stands for."""
    given = {name: value for name, value in options.items() if value is not None}
    if not paper:
        return given
    for name in ("weights", "init"):
        if name in given and given[name] != PAPER[name]:
            raise click.UsageError(f"--paper has {name} of its own: leave --{name} out")
    return {**PAPER, **given}


def _check_keywords(keywords: dict[str, Any]) -> None:
    """Raise a ValueError if they are wrong for every mesh, before one is read."""
    get = keywords.get
    SizeOptions.checked(get("n_segments"), get("radius"), "geodesic")
    islands = get("islands", "keep")
    LoopOptions.checked(
        get("max_num_iter", 1), get("tol", 0.0), None, islands, get("n_threads"), None
    )
    WeightOptions.checked(get("weights", "creases"), get("alpha"), get("eta_convex"))
    CleanupOptions.checked(True, False, get("min_size", 0.0), islands)
