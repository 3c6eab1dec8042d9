"""The command ``superfacets lift``."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

import click

from .._types import Ints
from .._validate import ranked_labels
from ..cells.kinds import measures_of
from ..cells.sums import positive_total
from ..errors import ViewWarning
from ..export.cells import FormatOptions
from ..export.write import check_fit, check_outputs
from ..interop.masks import read_masks
from ..io.attributes import MeshAttributes
from ..io.guards import counted
from ..io.readers.cameras import read_cameras
from ..io.readers.labels import read_labels
from ..mesh.cells import Cells
from ..mesh.label_images import Overlap
from ..mesh.pinhole_camera import PinholeCamera
from ..regions.lifting import LiftedLabels, lift
from .failures import print_note
from .inputs import load_cells_and_attributes
from .interrupts import run_in_background
from .options import (
    FILE,
    Real,
    ascii_option,
    drop_attributes_option,
    force_option,
    format_option,
    labels_named_option,
    quiet_option,
    threads_option,
)
from .outputs import Job, output_option, plan_jobs, to_option
from .report import notes_on_written


@click.command("lift")
@click.argument("source", metavar="IN", type=FILE)
@click.argument("labels", metavar="LABELS", type=FILE)
@click.argument("masks", metavar="MASKS", type=FILE)
@click.argument("cameras", metavar="CAMERAS", type=FILE)
@click.option(
    "--consistent-ids",
    "is_consistent",
    is_flag=True,
    help="Ids of masks mean the same in all images, as those of classes do: they become the labels."
    "  [default: masks that share regions become objects, numbered from 0]",
)
@click.option(
    "--agreement",
    type=Real(0, 1, min_open=True),
    default=0.5,
    show_default=True,
    help="Without --consistent-ids: the chance that two points of an object that an image sees in"
    " masks are in the same mask. More gives more and smaller objects.",
)
@click.option(
    "--overlap",
    type=click.Choice(get_args(Overlap)),
    default="smallest",
    show_default=True,
    help="The mask that counts where masks of an image overlap: of parts, or of wholes.",
)
@click.option(
    "--intrinsics",
    type=FILE,
    help="A text file with fx fy cx cy, or a matrix of 3 or 4 rows, if CAMERAS is a folder of"
    " poses.",
)
@output_option(
    "IN with the labels, or the labels alone, in any format that segment writes; may be given"
    " several times. Or a folder (results/), or - for standard output."
    "  [default: IN.superfacets.ply beside IN]"
)
@to_option()
@labels_named_option
@format_option("IN")
@ascii_option
@drop_attributes_option("IN")
@force_option
@threads_option
@quiet_option
@click.option("--json", "as_json", is_flag=True, help="Print the facts as JSON.")
def lift_command(
    source: Path, labels: Path, masks: Path, cameras: Path, is_consistent: bool, agreement: float,
    overlap: Any, intrinsics: Path | None, outputs: tuple[str, ...], formats: tuple[str, ...],
    labels_named: str, format: str | None, ascii: bool, drop_attributes: bool,
    n_threads: int | None, force: bool, is_quiet: bool, as_json: bool,
) -> None:  # fmt: skip
    """Label regions of a mesh by masks of images.

    LABELS are the regions: a file as segment writes it; a labeled IN may be given twice. MASKS is a
    folder with a .png, .npy or folder of .png for each image, named as the image is. CAMERAS is a
    COLMAP model, a transforms.json, or a folder of poses (a .txt of 4 x 4 numbers, camera to world,
    for each image). Lenses without distortion only. Each region gets the label of the masks that
    show most of its visible area.
    """
    read = tuple(str(path) for path in (source, labels, cameras))
    (job,) = plan_jobs(read[:1], outputs, formats, ascii=ascii, also_read=read[1:])
    check_outputs(job.files, force=force)
    form = FormatOptions(ascii=ascii, force=force)

    def compute() -> _Run:
        keeps = job.holds_attributes and not drop_attributes
        cells, attributes = load_cells_and_attributes(str(source), format, keep=keeps)
        check_fit(cells, None, job.endings, form)
        regions, _ = ranked_labels(read_labels(labels, cells.n_cells, name=labels_named))
        ids = read_masks(masks, overlap=overlap)
        size = next(iter(ids.values())).shape[::-1]
        views = read_cameras(cameras, intrinsics=intrinsics, size=size, names=ids)
        result, notes = _lifted(
            cells, regions, ids, views, consistent_ids=is_consistent, agreement=agreement,
            n_threads=n_threads,
        )  # fmt: skip
        return _Run(cells, attributes, result, notes)

    run = run_in_background(compute)
    found = run.result.found.tolist()
    names = tuple(map(str, found)) if is_consistent else ("object",) * len(found)
    n_lost = job.write(
        run.cells,
        run.result.labels,
        attributes=run.attributes,
        options=replace(form, classes=names, scores=tuple(run.result.label_scores.tolist())),
    )
    if not is_quiet:
        for note in run.notes + notes_on_written(run.cells, run.attributes, job.endings, n_lost):
            print_note(note)
    _report(job, run, as_json=as_json, is_quiet=is_quiet)


@dataclass(frozen=True)
class _Run:
    """What was read, and what came out."""

    cells: Cells
    attributes: MeshAttributes | None
    result: LiftedLabels
    notes: list[str]


def _lifted(
    cells: Cells, regions: Ints, ids: dict[str, Ints], views: list[PinholeCamera], **options: Any
) -> tuple[LiftedLabels, list[str]]:
    """Lift the masks that have a camera; also notes on those that do not count."""
    stems = [Path(view.name).stem for view in views]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ViewWarning)
        result = lift(cells, regions, [ids[stem] for stem in stems], views, **options)
    notes = [str(warning.message) for warning in caught]
    if lacking := sorted(ids.keys() - {*stems}):
        more = f" and {len(lacking) - 1} more" if len(lacking) > 1 else ""
        notes.append(f"masks without a camera are left out: {lacking[0]}{more}")
    return result, notes


def _report(job: Job, run: _Run, *, as_json: bool, is_quiet: bool) -> None:
    """Print counts and shares of the area, and files."""
    areas = measures_of(run.cells, 1)
    total = positive_total(areas)
    seen = float(areas[run.result.seen].sum()) / total
    labeled = float(areas[run.result.seen & (run.result.labels >= 0)].sum()) / total
    scores = run.result.scores[run.result.region_labels >= 0]
    score = float(scores.mean()) if len(scores) else 0.0
    n_images, n_labels = len(run.result.mask_labels), len(run.result.found)
    facts = {"n_images": n_images, "n_labels": n_labels, "mean_score": score}
    text = (
        f"{job.name}: {counted(n_images, 'image')} see {seen:.1%} of the area,"
        f" {counted(n_labels, 'label')} cover {labeled:.1%}, with"
        f" a mean score of {score:.2f}"
    )
    shares = {"seen_area": seen, "labeled_area": labeled}
    job.report(facts | shares, text, as_json=as_json, is_quiet=is_quiet)
