"""The commands ``segment`` and ``demo``, and options that ``superfacets batch`` shares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from superfacets import SCANS, Features, Segmentation, Sizes, Weights, kit

from . import inputs as read
from . import options as opts
from .failures import for_each, print_notes
from .interrupts import run_in_background
from .options import COUNT, FLAG, NOT_NEGATIVE, POSITIVE, option, options
from .outputs import Job, output_option, plan_jobs, to_option
from .progress import Progress
from .report import notes_on_result


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
    except ValueError:
        why = f"{text!r} is not LOW,HIGH: 2,5 or 2, or ,5"
        raise click.BadParameter(why, ctx, parameter) from None
    return low, high


_EVERYDAY = options(
    option("-n --n-segments", COUNT, f"Number of regions.  [default: {opts.USUAL_COUNT}]"),
    option("-r --radius", POSITIVE,
           "Radius of a region, instead of -n, in the unit of the file."),
    option("-a --alpha", NOT_NEGATIVE,
           "How strongly borders follow creases; 0 gives the roundest regions."
           f"{_by_weights('alpha')}"),
    option("--weights NAME", tuple(kit.WEIGHTS),
           "How borders are drawn: parts (along creases, and between parts of a shape), creases, or"
           " superfacets (as in the paper).  [default: parts]"),
    option("--features NAMES", opts.Listed(),
           "Data that borders follow, too: color, texture, normals, height (z), properties in IN,"
           " or files such as lh.sulc, separated by commas.", multiple=True),
    group="Everyday options",
)  # fmt: skip
scans_option = option(
    "--scans", FLAG, f"For fused scans of rooms: --denoise {SCANS['denoise']} --alpha"
    f" {SCANS['alpha']:g}.",
)  # fmt: skip
denoise_option = option(
    "--denoise N|auto|scan", opts.Count(0, "auto", "scan"),
    "Measure creases on a copy that is smoothed in N steps. auto estimates N from the noise; scan"
    " does so too, and N is at least 5. Outputs are not smoothed.  [default: auto]",
)  # fmt: skip
_PRESETS = options(
    scans_option,
    option("--paper", FLAG,
           "The algorithm of the paper, exactly as published, without options that it lacks."),
    group="Presets",
)  # fmt: skip
_CREASES = options(
    option("--eta-convex", NOT_NEGATIVE,
           f"Weight of convex creases relative to concave creases.{_by_weights('eta_convex')}"),
    option("--ridges", NOT_NEGATIVE,
           "Weight of sharp convex edges between flat faces, as on machine parts, relative to"
           f" concave creases; 0 ignores them.{_by_weights('ridges')}"),
    option("--smooth/--no-smooth", None,
           "Straighten borders where the surface is smooth.  [default: yes]", default=None),
    option("--islands", kit.FileOptions.CHOICES["islands"],
           "What to do with components without a seed: keep them as regions (keep), or join them to"
           " the nearest region (nearest). Then -n is the exact number of regions, except with"
           " barriers.  [default: keep]"), group="Creases and borders",
)  # fmt: skip
_SIZES = options(
    option("--balance", opts.Real(0.0, 1.0),
           "How equal the areas or volumes of regions should be, from 0 to 1.  [default: 0]"),
    option("--bounds LOW,HIGH", None,
           "Lowest and highest area or volume of a region, in squared or cubed units of the file;"
           " either may be empty, as in --bounds ,5.", callback=_bounds),
    option("--cells", COUNT,
           "Exact number of faces or points in each region, instead of -n; the remaining faces or"
           " points of each component form one smaller region."),
    group="Equal, bounded and exact sizes",
)  # fmt: skip
_DATA = options(
    option("--feature-weight", NOT_NEGATIVE,
           "Weight of features: a difference of one standard deviation adds this many region radii"
           " to the length of a path.  [default: 5]"),
    group="Data that borders follow",
)  # fmt: skip
_NOISE = options(
    denoise_option,
    option("--subdivide is_subdivided", FLAG,
           "First bisect edges longer than a quarter of a region's radius, for meshes with long and"
           " thin faces. Label files still contain one label for each face of IN."),
    option("--weld", POSITIVE,
           "Treat vertices at most this far apart as one vertex, in the unit of the file."),
    option("--max-edge", POSITIVE,
           "First bisect edges longer than this, in the unit of the file."),
    opts.viewpoint_option,
    option("--min-opacity P", opts.Real(0.0, 1.0),
           "Leave out Gaussian splats with an opacity below this, 0 to 1; they get label -1.",
           default=0.0, show_default=False),
    group="Noise, long faces, clouds",
)  # fmt: skip
_LOOP = options(
    option("--init", kit.FileOptions.CHOICES["init"],
           "How initial centers are placed; flood and grid need --paper, and match -n only roughly."
           "  [default: geodesic; curve for 10,000 or more regions of less than 100"
           " cells each; farthest with --paper]"),
    option("--max-iter max_num_iter", opts.Count(0),
           "Maximum number of iterations; 0 keeps the initial centers.", default=50),
    option("--tol", NOT_NEGATIVE,
           "Stop when centers move less than this, as a fraction of a region's radius."
           "  [default: 0.02]"), group="Seeds and the loop",
)  # fmt: skip
segment_options = options(
    _EVERYDAY, _PRESETS, _CREASES, _SIZES, _DATA, _NOISE, _LOOP,
    options(opts.threads_option, group="Running"), opts.help_all_option,
)  # fmt: skip
"""Decorator that adds the options that control the segmentation to a command."""

file_options = options(
    opts.ascii_option, opts.label_options,
    opts.drop_attributes_option(
        "IN", ": colors, normals, texture coordinates, other properties, comments"
    ),
    opts.force_option, group="Files",
)  # fmt: skip
"""Decorator that adds the options for the format of mesh files to a command."""

_NOT_WITH_PAPER = {
    "weights", "ridges", "features", "feature_weight", "smooth", "balance", "bounds", "cells",
    "denoise", "tol",
}  # fmt: skip


def options_of(*, scans: bool, is_subdivided: bool, **given: Any) -> kit.FileOptions:
    """Return the options, completed by presets; raise a usage error if options are incompatible."""
    given = {name: value for name, value in given.items() if value is not None and value != ()}
    is_paper = given["paper"]
    refused = [*({"scans"} if scans else ()), *sorted(given.keys() & _NOT_WITH_PAPER)]
    if is_paper and refused:
        flags = {each.name: each.opts[0] for each in click.get_current_context().command.params}
        raise click.UsageError(f"give --paper or {flags[refused[0]]}, not both")
    weight = given.pop("feature_weight", None)
    if weight is not None:
        if "features" not in given:
            raise click.UsageError("--feature-weight needs --features")
        given["features"] = Features(given["features"], weight)
    given = {**SCANS, **given} if scans else given
    try:
        own: dict[str, Any] = {n: given.pop(n) for n in ("eta_convex", "ridges") if n in given}
        if is_paper:
            given.update(own)
        elif own:
            given["weights"] = Weights(given.get("weights", "parts"), **own)
        sizes = {name: given.pop(name) for name in ("balance", "bounds", "cells") if name in given}
        if sizes:
            given["sizes"] = Sizes(**sizes)
        shared = given.keys() & kit.FileOptions.__dataclass_fields__.keys()
        of_files = {name: given.pop(name) for name in shared}
        return kit.FileOptions(given, subdivide=is_subdivided, **of_files)
    except ValueError as error:
        raise click.UsageError(str(error)) from error


@click.command("segment", cls=opts.GroupedCommand)
@click.argument("inputs", metavar="IN...", type=opts.INPUT, nargs=-1, required=True)
@options(
    segment_options,
    options(read.constraint_options, read.barrier_angle_option, opts.labels_named_option,
            group="Data that borders follow"),
    options(
        output_option(
            "Output file: a mesh or cloud with labels, or labels alone; a folder (results/) for the"
            " files of all inputs, or - for standard output. This option may be repeated."
            "  [default: IN.superfacets.FORMAT beside IN, see --to]"),
        to_option(), opts.quiet_option(), group="Everyday options",
    ),
    options(opts.format_option("the inputs", of_stream=True), file_options, group="Files"),
    options(
        option("-v --verbose is_verbose", FLAG, "Also print the time of each stage."),
        opts.json_option("the results as JSON, one line per IN"), group="Running",
    ),
)  # fmt: skip
def segment_command(inputs: tuple[str, ...], **given: Any) -> None:
    """Segment meshes and clouds; superfacets FILE does the same.

    IN may be - for standard input, whose result is written to standard output unless -o is given.
    If an input fails, the others are still processed, and the exit status is 1.
    """
    mask, barriers = given["mask"], given["barriers"]
    not_of_files = ("outputs", "formats", "format", "mask", "barriers", "barrier_angle", "as_json",
                    "is_verbose")  # fmt: skip
    chosen = options_of(**{name: given[name] for name in given if name not in not_of_files})
    if barriers is not None and given["barrier_angle"] is not None:
        raise click.UsageError("give --barriers or --barrier-angle, not both")
    if len(inputs) > 1 and (mask, barriers) != (None, None):
        raise click.UsageError("files of --mask and --barriers fit only one input")
    jobs, run = plan_jobs(inputs, given, (mask, barriers)), _Run(chosen, given)
    for_each([read.name_of(text) for text in inputs], lambda i: run.do(jobs[i]))


@dataclass(frozen=True)
class _Run:
    """Options of the command that apply to every job."""

    options: kit.FileOptions
    given: Mapping[str, Any]

    def do(self, job: Job) -> None:
        """Run one job, and print a report."""
        job.outputs.check()
        timings: dict[str, float] = {}
        with Progress(read.name_of(Path(job.input).name)) as bar:
            outcome = run_in_background(lambda: self._compute(job, bar, timings), is_shown=False)
            with bar.timed("export", timings):
                written = outcome.write(job.outputs)
        result, noun = outcome.result, kit.kind_of(outcome.mesh).noun
        print_notes(notes_on_result(outcome, self.given["n_segments"], job.endings, written))
        has_mask = (self.given["mask"], self.given["mask_values"]) != (None, None)
        if has_mask and (result.labels >= 0).all():
            print_notes([f"the mask leaves out no {noun}"])
        inside = None if outcome.sharp_inside is None else float(outcome.sharp_inside.sum())
        facts = {
            f"n_{noun}s": len(result.labels), "n_segments": result.n_segments,
            "n_iter": result.n_iter, "stop_reason": result.stop_reason,
            "levels": [asdict(level) for level in result.levels],
            "seconds": {**result.timings, **timings}, "n_unreached": result.n_unreached,
            "sliver_share": result.sliver_share, "sharp_inside": inside, "params": result.params,
        }  # fmt: skip
        text = _summary(result, facts["seconds"], noun)
        asked, steps = self.options.keywords.get("denoise", "auto"), result.params["denoise"]
        if steps and asked in ("auto", "scan"):  # a scan may have no noise
            found = "noise found: " if asked == "auto" else ""
            text += f"; {found}creases measured after {kit.counted(steps, 'smoothing step')}"
        if self.given["is_verbose"]:
            seconds = ", ".join(f"{stage} {spent:.3f}" for stage, spent in facts["seconds"].items())
            iterations = kit.counted(result.n_iter, "iteration")
            text += f"; {iterations}, {result.stop_reason}; seconds: {seconds}"
        sharp = "; all sharp edges are on borders" if inside == 0 else ""
        of = "" if outcome.listed is None else f" of {read.name_of(Path(job.input).name)}"
        job.report(facts, text + sharp, noun + of)

    def _compute(self, job: Job, bar: Progress, timings: dict[str, float]) -> Any:
        """Read, subdivide and segment the input, without writing files."""

        def load(keep: bool) -> tuple[kit.Cells, Any, dict[str, kit.Array]]:
            source = read.read_input(job.input, self.given["format"])
            cells, attributes = source.cells_and_attributes(keep=keep)
            if self.given["barrier_angle"] is not None or self.options.subdivide:
                with kit.named_errors(f"{source.name}: --barrier-angle and --subdivide"):
                    kit.as_mesh(cells)
            constraints = read.constraints_of(self.given, source, cells)
            job.outputs.check_fit(cells, read.likely_labels(constraints))
            return cells, attributes, constraints

        return self.options.segment(
            load, holds_attributes=job.keeps_attributes, timings=timings,
            barrier_angle=self.given["barrier_angle"], callback=bar.on_report,
        )  # fmt: skip


def _summary(result: Segmentation, seconds: Mapping[str, float], noun: str) -> str:
    """Return a one-line summary of a run; `noun` is the word for a labeled element."""
    regions, cells = (
        f"{n:,} {kit.counted(n, thing).partition(' ')[2]}"
        for n, thing in ((result.n_segments, "region"), (len(result.labels), noun))
    )
    n_left_out = int(np.count_nonzero(result.labels < 0))
    left_out = f" ({n_left_out:,} left out)" if n_left_out else ""
    return f"{regions} of {cells}{left_out} in {sum(seconds.values()):.2f} s"


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
    with Progress("bear") as bar:
        surface = sample_mesh()
        result = segment(surface, callback=bar.on_report)
        write_mesh(labeled, surface, result.labels)
        plot(surface, result.labels, output=picture)
    click.echo(f"bear: {_summary(result, result.timings, 'face')}")
    click.echo(f"wrote {labeled}\nwrote {picture}")
