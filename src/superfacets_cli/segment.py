"""The commands ``segment`` and ``demo``, and options that ``superfacets batch`` shares."""

from __future__ import annotations

import json
from collections.abc import Set
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import click
import numpy as np

from superfacets import SCANS, Features, MeshAttributes, MeshError, Sizes, Weights, kit

from . import inputs as read
from . import options as opts
from .failures import EXIT_DATA, count_failures, print_note, print_notes
from .interrupts import run_in_background
from .options import COUNT, FLAG, NOT_NEGATIVE, POSITIVE, option, options
from .outputs import Job, check_mask, output_option, plan_jobs, to_option
from .progress import RunBar
from .report import facts_of, notes_of, summary_of


def _by_weights(parameter: str) -> str:
    """Return the default of a parameter for each formula of weights that has it, as text."""
    used = {name: weight.defaults.get(parameter) for name, weight in kit.WEIGHTS.items()}
    listed = [f"{value:g} with {name}" for name, value in used.items() if value is not None]
    return f"  [default: {', '.join(listed)}]"


def _bounds(
    ctx: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[float | None, ...] | None:
    """Parse LOW,HIGH, where a bound may be missing (a callback of click)."""
    if text is None:
        return None
    try:
        low, high = (float(bound) if bound.strip() else None for bound in text.split(","))
        Sizes(bounds=(low, high))
    except ValueError as error:
        why = (
            str(error) if "bounds[" in str(error) else f"{text!r} is not LOW,HIGH: 2,5 or 2, or ,5"
        )
        raise click.BadParameter(why, ctx, parameter) from None
    return low, high


class SegmentCommand(opts.GroupedCommand):
    """A command whose help lists the options of `segment_options` in groups."""

    groups: ClassVar = {
        "Everyday options": (
            "n_segments", "radius", "alpha", "weights", "features", "output", "outputs", "formats",
            "is_quiet",
        ),
        "Presets": ("scans", "paper"),
        "Creases and borders": ("eta_convex", "ridges", "smooth", "islands"),
        "Equal, bounded and exact sizes": ("balance", "bounds", "cells"),
        "Data that borders follow": (
            "feature_weight", "mask", "mask_values", "barriers", "barrier_angle", "labels_named",
        ),
        "Noise, long faces, clouds": (
            "denoise", "is_subdivided", "max_edge", "viewpoint", "min_opacity",
        ),
        "Seeds and the loop": ("init", "max_num_iter", "tol"),
        "Files": ("format", "ascii", "label_name", "vertex_labels", "drop_attributes", "force"),
        "Running": (
            "n_threads", "workers", "scheduler", "timeout", "retry_failed", "as_json", "is_verbose",
        ),
    }  # fmt: skip
    n_shown = 2


segment_options = options(
    option("-n --n-segments", COUNT, f"Number of regions.  [default: {opts.USUAL_COUNT}]"),
    option("-r --radius", POSITIVE,
           "Radius of a region, instead of -n, in the unit of the file."),
    option("-a --alpha", NOT_NEGATIVE,
           "How strongly borders follow creases; 0 gives the roundest regions."
           f"{_by_weights('alpha')}"),
    option("--weights NAME", tuple(kit.WEIGHTS),
           "How borders are drawn: parts (along creases, and between parts of a shape), creases, or"
           " superfacets (as in the paper).  [default: parts]"),
    option("--features NAMES", None,
           "Data that borders follow, too: color, texture, normals, height (z), or properties in"
           " IN, separated by commas.", multiple=True, callback=opts.listed),
    option("--scans", FLAG,
           "For fused scans of rooms: same as"
           f" --denoise {SCANS['denoise']} --alpha {SCANS['alpha']:g}."),
    option("--paper", FLAG,
           "The algorithm of the paper, exactly as published, without options that it lacks."),
    option("--eta-convex", NOT_NEGATIVE,
           f"Weight of convex creases relative to concave creases.{_by_weights('eta_convex')}"),
    option("--ridges", NOT_NEGATIVE,
           "Weight of sharp convex edges between flat faces, as on machine parts, relative to"
           f" concave creases; 0 ignores them.{_by_weights('ridges')}"),
    option("--smooth/--no-smooth", None,
           "Straighten borders where the surface is smooth.  [default: yes]", default=None),
    option("--islands", kit.FileOptions.CHOICES["islands"],
           "What to do with components without a seed: keep them as regions (keep), or join them to"
           " the nearest region (nearest), which makes -n exact except with barriers.  [default:"
           " keep]"),
    option("--balance", opts.Real(0.0, 1.0),
           "How equal the areas or volumes of regions should be, from 0 to 1.  [default: 0]"),
    option("--bounds LOW,HIGH", None,
           "Lowest and highest area or volume of a region, in squared or cubed units of the file;"
           " either may be empty, as in --bounds ,5.", callback=_bounds),
    option("--cells", COUNT,
           "Exact number of faces or points in each region, instead of -n; the remaining faces or"
           " points of each component form one smaller region."),
    option("--feature-weight", NOT_NEGATIVE,
           "Weight of features: a difference of one standard deviation adds this many region radii"
           " to the length of a path.  [default: 5]"),
    option("--denoise N|auto", opts.Count(0, "auto"),
           "Measure creases on a copy of the mesh, smoothed in N steps; auto estimates the noise"
           " and uses 0 steps if the mesh is clean. Outputs are not smoothed.  [default: auto]"),
    option("--subdivide is_subdivided", FLAG,
           "First bisect edges longer than a quarter of a region's radius, for meshes with long and"
           " thin faces. A .ply or .vtp then contains the subdivided mesh. Label files contain one"
           " label for each face of IN: the label that covers most of the face."),
    option("--max-edge", POSITIVE,
           "First bisect edges longer than this, in the unit of the file."),
    opts.viewpoint_option,
    option("--min-opacity P", opts.Real(0.0, 1.0),
           "Leave out Gaussian splats with an opacity below this, 0 to 1; they get label -1.",
           default=0.0, show_default=False),
    option("--init", kit.FileOptions.CHOICES["init"],
           "How the initial centers are placed. flood and grid need --paper, and match -n only"
           " approximately.  [default: geodesic; curve for 10,000 or more regions of less than 100"
           " cells each; farthest with --paper]"),
    option("--max-iter max_num_iter", opts.Count(0),
           "Maximum number of iterations; 0 keeps the initial centers.", default=50),
    option("--tol", NOT_NEGATIVE,
           "Stop when centers move less than this, as a fraction of a region's radius."
           "  [default: 0.02]"),
    opts.threads_option,
    opts.help_all_option,
)  # fmt: skip
"""Decorator that adds the options that control the segmentation to a command."""

file_options = options(
    opts.ascii_option,
    opts.label_options,
    opts.drop_attributes_option(
        "IN", ": colors, normals, texture coordinates, other properties, comments"
    ),
    opts.force_option,
)
"""Decorator that adds the options for the format of mesh files to a command."""

_EXCLUSIVE = {
    "paper": ("scans", "weights", "ridges", "features", "feature_weight", "smooth", "balance",
              "bounds", "cells", "denoise", "tol"),
    "n_segments": ("radius", "cells"),
    "radius": ("cells",),
    "cells": ("balance", "bounds"),
}  # fmt: skip
"""Options that cannot be given together with an option: names of parameters by name."""

_OF_FILES = {field.name for field in fields(kit.FileOptions)}


def options_of(*, scans: bool, is_subdivided: bool, **given: Any) -> kit.FileOptions:
    """Return the options, completed by presets; raise a usage error if options are incompatible."""
    given = {name: value for name, value in given.items() if value is not None and value != ()}
    is_paper = given["paper"]
    presets = {name for name, is_given in (("paper", is_paper), ("scans", scans)) if is_given}
    _check_exclusive(given.keys() - {"paper"} | presets)
    if given.get("init") in ("flood", "grid") and not is_paper:
        raise click.UsageError(f"--init {given['init']} needs --paper")
    weight = given.pop("feature_weight", None)
    if weight is not None:
        if "features" not in given:
            raise click.UsageError("--feature-weight needs --features")
        given["features"] = Features(given["features"], weight)
    given = {**SCANS, **given} if scans else given
    try:
        own: dict[str, Any] = {
            name: given.pop(name) for name in ("eta_convex", "ridges") if name in given
        }
        if is_paper:
            given.update(own)
        elif own:
            given["weights"] = Weights(given.get("weights", "parts"), **own)
        sizes = {name: given.pop(name) for name in ("balance", "bounds", "cells") if name in given}
        if sizes:
            given["sizes"] = Sizes(**sizes)
        of_files = {name: given.pop(name) for name in _OF_FILES & given.keys()}
        return kit.FileOptions(given, subdivide=is_subdivided, **of_files)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


def _check_exclusive(given: Set[str]) -> None:
    """Raise a usage error if two given options exclude each other."""
    flags = {each.name: each.opts[0] for each in click.get_current_context().command.params}
    for name, others in _EXCLUSIVE.items():
        for other in others:
            if {name, other} <= given:
                raise click.UsageError(f"give {flags[name]} or {flags[other]}, not both")


@click.command("segment", cls=SegmentCommand)
@click.argument("inputs", metavar="IN...", type=opts.INPUT, nargs=-1, required=True)
@options(
    segment_options,
    read.constraint_options,
    read.barrier_angle_option,
    opts.labels_named_option,
    output_option(
        "Output file: a mesh or cloud with labels, or labels alone; a folder (results/) for the"
        " files of all inputs, or - for standard output; may be given several times."
        "  [default: IN.superfacets.ply beside IN]"),
    to_option(),
    opts.format_option("the inputs", of_stream=True),
    file_options,
    opts.quiet_option(),
    option("-v --verbose is_verbose", FLAG, "Also print the time of each stage."),
    opts.json_option("the results as JSON, one line per IN"),
)  # fmt: skip
@click.pass_context
def segment_command(
    ctx: click.Context, /, inputs: tuple[str, ...], outputs: tuple[str, ...],
    formats: tuple[str, ...], format: str | None, mask: Path | None,
    mask_values: tuple[int, ...] | None, barriers: Path | None, barrier_angle: float | None,
    labels_named: str, is_verbose: bool, as_json: bool, **given: Any,
) -> None:  # fmt: skip
    """Segment meshes and clouds; superfacets FILE does the same.

    IN may be - for standard input, whose result is written to standard output unless -o is given.
    If an input fails, the others are still processed, and the exit status is 1.
    """
    scans = given["scans"]
    chosen = options_of(**given)
    read.check_inputs(inputs)
    if barriers is not None and barrier_angle is not None:
        raise click.UsageError("give --barriers or --barrier-angle, not both")
    if len(inputs) > 1 and (mask is not None or barriers is not None):
        raise click.UsageError(
            "files of --mask and --barriers fit only one input: to read values from each input,"
            " give --mask-values without --mask"
        )
    also_read = [str(path) for path in (mask, barriers) if path is not None]
    jobs = plan_jobs(inputs, outputs, formats, ascii=chosen.ascii, also_read=also_read)
    endings = [ending for job in jobs for ending in job.endings]
    has_mask = mask is not None or mask_values is not None
    check_mask(endings, has_mask=has_mask)
    constraints = partial(read.constraints_of, mask, mask_values, barriers, name=labels_named)
    run = _Run(
        chosen, format, chosen.form(endings), constraints, barrier_angle, has_mask, scans,
        as_json, is_verbose,
    )  # fmt: skip
    named = [read.name_of(job.input) for job in jobs]
    if count_failures(named, lambda i: run.do(jobs[i]), lambda i, m: run.print_failure(jobs[i], m)):
        ctx.exit(EXIT_DATA)


@dataclass(frozen=True)
class _Run:
    """Options of the command that apply to every job."""

    options: kit.FileOptions
    format: str | None
    form: kit.FormatOptions
    constraints: partial[dict[str, kit.Array]]
    barrier_angle: float | None
    has_mask: bool
    scans: bool
    as_json: bool
    is_verbose: bool

    def print_failure(self, job: Job, message: str) -> None:
        """Print a failure as a JSON object if ``--json`` is given."""
        if self.as_json:
            job.print(json.dumps({"file": job.input, "error": message}))

    def do(self, job: Job) -> None:
        """Run one job, and print a report."""
        outputs = job.outputs(self.form)
        outputs.check()
        timings: dict[str, float] = {}
        with RunBar(read.name_of(job.input)) as bar:
            outcome = run_in_background(
                lambda: self._compute(job, outputs, bar, timings), tick=bar.draw
            )
            with bar.timed("export", timings):
                written = outcome.write(outputs)
        result, noun = outcome.result, kit.kind_of(outcome.mesh).noun
        timings = {**result.timings, **timings}
        asked = self.options.keywords.get("n_segments")
        print_notes(notes_of(outcome, asked, job.endings, written, job.holds_labels))
        n_left_out = int(np.count_nonzero(result.labels < 0))
        if self.has_mask and not n_left_out:
            print_note(f"the mask leaves out no {noun}")
        inside = None if outcome.sharp_inside is None else float(outcome.sharp_inside.sum())
        summary = summary_of(
            result, timings, noun, n_left_out, denoise=self.options.keywords.get("denoise"),
            is_verbose=self.is_verbose,
        )  # fmt: skip
        sharp = "; all sharp edges are on borders" if inside == 0 else ""
        facts = facts_of(result, timings, noun, inside)
        text = f"{job.name}: {summary}{sharp}"
        job.report(facts, text, noun)

    def _compute(
        self, job: Job, outputs: kit.OutputFiles, bar: RunBar, timings: dict[str, float]
    ) -> Any:
        """Read, subdivide and segment the input, without writing files."""
        return self.options.segment(
            lambda keep: self._load(job, outputs, keep=keep),
            holds_attributes=job.holds_attributes,
            timings=timings,
            barrier_angle=self.barrier_angle,
            callback=bar.on_report,
        )

    def _load(
        self, job: Job, outputs: kit.OutputFiles, *, keep: bool
    ) -> tuple[kit.Cells, MeshAttributes | None, dict[str, kit.Array]]:
        """Read the input and its constraints.

        Raises an error if an output format cannot store this kind of cells.
        """
        source = read.read_input(job.input, self.format)
        cells, attributes = source.cells_and_attributes(keep=keep)
        self._check_kind(job, cells)
        outputs.check_fit(cells)
        return cells, attributes, self.constraints(source, cells)

    def _check_kind(self, job: Job, cells: kit.Cells) -> None:
        """Raise a MeshError if options for meshes are given with a point cloud."""
        if not kit.kind_of(cells).are_points:
            return
        typed = "--subdivide" if self.options.subdivide else None
        if self.options.keywords.get("denoise"):
            typed = "--scans" if self.scans else "--denoise"
        if typed is not None:
            raise MeshError(
                f"{read.name_of(job.input)}: {typed} is for meshes, but this is a point cloud"
            )
        if self.barrier_angle is not None:
            name = read.name_of(job.input)
            raise MeshError(f"{name}: --barrier-angle needs a mesh: point clouds have no edges")


@click.command("demo")
@option("-o --output DIR", opts.FOLDER, "Folder for the results.", default=Path("superfacets-demo"))
def demo_command(output: Path) -> None:
    """Segment the sample mesh of the package.

    The labeled mesh and a picture of the mesh are written to DIR.
    """
    from superfacets import plot, sample_mesh, segment, write_mesh
    from superfacets_show import check_rendering

    check_rendering()
    click.get_current_context().with_resource(kit.output_folder(output))
    labeled, picture = output / "bear.superfacets.ply", output / "bear.superfacets.png"
    timings: dict[str, float] = {}
    with RunBar("bear") as bar:
        with bar.timed("mesh", timings):
            surface = sample_mesh()
        result = segment(surface, callback=bar.on_report)
        with bar.timed("export", timings):
            write_mesh(labeled, surface, result.labels)
    click.echo(f"wrote {labeled}\nbear: {summary_of(result, {**result.timings, **timings})}")
    plot(surface, result.labels, output=picture)
    click.echo(f"wrote {picture}")
