"""The commands ``superfacets lift`` and ``transfer``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, get_args

import click
import numpy as np

from superfacets import (
    MeshAttributes,
    PinholeCamera,
    kit,
    lift,
    transfer,
)
from superfacets.kit import FORMATS, Array, Cells, Ints
from superfacets_scans import GROUPS, SEGMENTS, LiftedLabels, Overlap, ViewWarning

from . import options as opts
from .inputs import GivenLabels, given_labels, labels_of_cells, read_input
from .interrupts import run_in_background
from .outputs import OneRun, one_output_options


@click.command("lift")
@click.argument("source", metavar="IN", type=opts.FILE)
@click.argument("labels", metavar="LABELS", type=opts.FILE)
@click.argument("masks", metavar="MASKS", type=opts.FILE)
@click.argument("cameras", metavar="CAMERAS", type=opts.FILE)
@opts.options(
    opts.option("--consistent-ids is_consistent", opts.FLAG,
           "Mask ids mean the same in all images, like class ids, and become the labels."
           "  [default: join masks that cover the same regions into objects, numbered from 0]"),
    opts.option("--agreement", opts.Real(0, 1, min_open=True),
           "Probability that two points of the same object are in the same mask of an image, given"
           " that both are in masks. A higher value gives more and smaller objects. Not used with"
           " --consistent-ids.",
           default=0.5),
    opts.option("--overlap", get_args(Overlap),
           "Which mask to use where masks of an image overlap.", default="smallest"),
    opts.option("--intrinsics", opts.FILE,
           "Text file with the camera intrinsics, if CAMERAS is a folder of poses: fx fy cx cy, or"
           " a matrix of 3 or 4 rows."),
)  # fmt: skip
@one_output_options("IN with the labels, or the labels alone", "IN")
@opts.format_option("IN")
@opts.drop_attributes_option("IN")
def lift_command(
    source: Path, labels: Path, masks: Path, cameras: Path, is_consistent: bool, agreement: float,
    overlap: Any, intrinsics: Path | None, format: str | None, **given: Any,
) -> None:  # fmt: skip
    """Label regions of a mesh with image masks.

    LABELS is a file with the regions, in any format that segment writes; if IN contains them, give
    IN again. MASKS is a folder with an entry for each image, with the same name: a .png, a .npy, or
    a folder of .png files. CAMERAS is a COLMAP model, a transforms.json, or a folder of poses (for
    each image, a .txt with the 4 x 4 camera-to-world matrix). Images must have no lens distortion.
    If masks cover at least half of the visible area of a region, the region gets the label whose
    masks cover most of this area.

    If LABELS is a .segs.json, an .aggregation.json of the objects lists its segments, and formats
    with one id per vertex store these segments.
    """
    from superfacets import read_cameras, read_masks

    run = OneRun(source, (labels, cameras), given)
    has_segments = labels.name.endswith(SEGMENTS)
    if (refusing := sorted(run.job.endings & {*FORMATS.vertex_outputs})) and not has_segments:
        raise click.UsageError(
            f"{refusing[0]} files cannot store regions without a label: give LABELS as a"
            f" {SEGMENTS} file, whose segments are then written, or use another format"
        )
    notes: list[str] = []

    def compute() -> tuple[Cells, MeshAttributes | None, LiftedLabels, dict[str, Any]]:
        file = read_input(str(source), format)
        cells, attributes = file.cells_and_attributes(keep=run.keeps_attributes)
        run.outputs.check_fit(cells)
        of_file = given_labels(file, cells, labels, run.labels_named)
        regions, names = kit.ranked_labels(labels_of_cells(cells, of_file))
        ids = read_masks(masks, overlap=overlap)
        size = next(iter(ids.values())).shape[::-1]
        views = read_cameras(cameras, intrinsics=intrinsics, size=size, names=ids)
        result = _lifted(
            cells, regions, ids, views, notes, consistent_ids=is_consistent, agreement=agreement,
            n_threads=run.n_threads,
        )  # fmt: skip
        own = _segments(of_file, names, result) if has_segments else {}
        return cells, attributes, result, own

    cells, attributes, result, own = run_in_background(compute)
    found = result.found.tolist()
    names = tuple(map(str, found)) if is_consistent else ("object",) * len(found)
    scores = tuple(result.label_scores.tolist())
    if own and GROUPS in run.job.endings:
        notes.append(f"the groups in {GROUPS} contain segments of {labels.name}")
    run.write(cells, result.labels, attributes, notes, own, classes=names, scores=scores)
    _report(run, cells, result)


def _lifted(
    cells: Cells, regions: Ints, ids: dict[str, Ints], views: list[PinholeCamera],
    notes: list[str], **options: Any,
) -> LiftedLabels:  # fmt: skip
    """Label regions with all masks that have a camera; append warnings to `notes`."""
    stems = [Path(view.name).stem for view in views]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ViewWarning)
        result = lift(cells, regions, [ids[stem] for stem in stems], views, **options)
    notes += [str(warning.message) for warning in caught]
    if lacking := sorted(ids.keys() - {*stems}):
        more = f" and {len(lacking) - 1} more" if len(lacking) > 1 else ""
        notes.append(f"masks without a camera are left out: {lacking[0]}{more}")
    return result


def _segments(given: GivenLabels, names: Array, result: LiftedLabels) -> dict[str, Any]:
    """Return the keyword arguments of `OutputFiles.write` for given segments of vertices.

    `names` is the segment of each region in `result`. Segments without a face have no region.
    """
    ranks, segments = kit.ranked_labels(given.labels)
    objects = np.full(len(segments), -1, np.int32)
    objects[np.searchsorted(segments, names)] = result.region_labels
    of_vertices = np.append(objects, np.int32(-1))[ranks]
    return {"of_vertices": of_vertices, "segments": (given.labels, objects, given.path)}


def _report(run: OneRun, cells: Cells, result: LiftedLabels) -> None:
    areas = kit.kind_of(cells).measures(cells, 1)
    total = float(areas.sum())
    seen = float(areas[result.seen].sum()) / total
    labeled = float(areas[result.seen & (result.labels >= 0)].sum()) / total
    scores = result.scores[result.region_labels >= 0]
    score = float(scores.mean()) if len(scores) else 0.0
    n_images, n_labels = len(result.mask_labels), len(result.found)
    facts = {"n_images": n_images, "n_labels": n_labels, "mean_score": score}
    text = (
        f"{kit.counted(n_images, 'image')}: {seen:.1%} of the area is visible;"
        f" {kit.counted(n_labels, 'label')}: {labeled:.1%} of the area is labeled;"
        f" mean score {score:.2f}"
    )
    run.report(facts | {"seen_area": seen, "labeled_area": labeled}, text, kit.kind_of(cells).noun)


@click.command("transfer")
@click.argument("source", metavar="IN", type=opts.FILE)
@click.argument("labels", metavar="LABELS", type=opts.FILE)
@click.argument("target", metavar="TARGET", type=opts.FILE)
@opts.option(
    "--max-distance", opts.NOT_NEGATIVE,
    "Cells of TARGET farther than this from IN, in units of IN, get label -1.  [default: no limit]",
)  # fmt: skip
@one_output_options("TARGET with its labels, or the labels alone", "TARGET")
@opts.format_option("IN")
@opts.format_option("TARGET", name="--target-format")
@opts.drop_attributes_option("TARGET")
def transfer_command(
    source: Path, labels: Path, target: Path, max_distance: float | None, format: str | None,
    target_format: str | None, **given: Any,
) -> None:  # fmt: skip
    """Transfer labels to another mesh or cloud of the same object.

    TARGET must have the same position as IN. Each face or point of TARGET gets the label of the
    nearest face or point of IN, or of the nearest vertex if LABELS has labels of vertices. LABELS
    is a file of any label format, such as .npy or .segs.json, or a labeled mesh; if IN contains
    the labels, give IN again.
    """
    run = OneRun(target, (source, labels), given)

    def compute() -> tuple[Cells, MeshAttributes | None, Ints]:
        origin = read_input(str(source), format)
        cells = origin.cells()
        of_source = given_labels(origin, cells, labels, run.labels_named).labels
        file = read_input(str(target), target_format)
        goal, attributes = file.cells_and_attributes(keep=run.keeps_attributes)
        run.outputs.check_fit(goal)
        with warnings.catch_warnings(record=True) as caught:  # warnings become notes
            carried = transfer(
                cells, of_source, goal, max_distance=max_distance, n_threads=run.n_threads
            )
        notes.extend(str(warning.message) for warning in caught)
        return goal, attributes, carried

    notes: list[str] = []
    goal, attributes, carried = run_in_background(compute)
    run.write(goal, carried, attributes, notes)
    n_without = int(np.count_nonzero(carried < 0))
    n_labels = len(np.unique(carried[carried >= 0]))
    noun = kit.kind_of(goal).noun
    facts = {f"n_{noun}s": len(carried), "n_labels": n_labels, "n_without": n_without}
    without = f", {n_without} without a label" if n_without else ""
    run.report(
        facts, f"{kit.counted(len(carried), noun)}, {kit.counted(n_labels, 'label')}{without}", noun
    )
