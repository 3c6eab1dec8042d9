"""The commands ``superfacets lift``, ``transfer`` and ``cut``: new labels of one input."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

import click
import numpy as np

from superfacets import MeshAttributes, MeshError, cut_borders, kit, lift, segment, transfer
from superfacets.kit import Array, Cells, Ints
from superfacets_scans import GROUPS, SEGMENTS, LiftedLabels, Overlap

from . import options as opts
from .failures import print_notes
from .inputs import given_labels, labels_of_cells, ranked_labels_beside, read_input
from .interrupts import run_in_background
from .outputs import Job, one_job, one_output_options


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
           " that both are in masks. A higher value gives more and smaller objects. This option has"
           " no effect with --consistent-ids.",
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
    overlap: Any, intrinsics: Path | None, **given: Any,
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

    job = one_job(source, given, (labels, cameras))
    has_segments = labels.name.endswith(SEGMENTS)

    def compute() -> tuple[Cells, MeshAttributes | None, LiftedLabels, dict[str, Any]]:
        file = read_input(str(source), given["format"])
        cells, attributes = file.cells_and_attributes(keep=job.keeps_attributes)
        # Regions may get no label, but segments are stored anyway.
        job.outputs.check_fit(cells, np.full(cells.n_cells, 0 if has_segments else -1, np.int32))
        of_file = given_labels(file, cells, labels, given["labels_named"])
        regions, names = kit.ranked_labels(labels_of_cells(cells, of_file))
        ids = read_masks(masks, overlap=overlap)
        size = next(iter(ids.values())).shape[::-1]
        views = read_cameras(cameras, intrinsics=intrinsics, size=size, names=ids)
        stems = [Path(view.name).stem for view in views]
        if lacking := sorted(ids.keys() - {*stems}):
            more = f" and {len(lacking) - 1} more" if len(lacking) > 1 else ""
            print_notes([f"masks without a camera are left out: {lacking[0]}{more}"])
        result = lift(
            cells, regions, [ids[stem] for stem in stems], views, consistent_ids=is_consistent,
            agreement=agreement, n_threads=given["n_threads"],
        )  # fmt: skip
        own: dict[str, Any] = {}
        if has_segments:
            of_vertices, objects = result.of_segments(of_file.labels, names)
            own = {"of_vertices": of_vertices, "segments": (of_file.labels, objects, of_file.path)}
        return cells, attributes, result, own

    cells, attributes, result, own = run_in_background(compute)
    found = result.found.tolist()
    names = tuple(map(str, found)) if is_consistent else ("object",) * len(found)
    if own and GROUPS in job.endings:
        print_notes([f"the groups in {GROUPS} contain segments of {labels.name}"])
    form = {"classes": names, "scores": tuple(result.label_scores.tolist())}
    job.write(cells, result.labels, attributes, form=form, **own)
    _report(job, cells, result)


def _report(job: Job, cells: Cells, result: LiftedLabels) -> None:
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
    job.report(facts | {"seen_area": seen, "labeled_area": labeled}, text, kit.kind_of(cells).noun)


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
    source: Path, labels: Path, target: Path, max_distance: float | None, **given: Any
) -> None:
    """Transfer labels to another mesh or cloud of the same object.

    TARGET must have the same position as IN. Each face or point of TARGET gets the label of the
    nearest face or point of IN, or of the nearest vertex if LABELS has labels of vertices. LABELS
    is a file of any label format, such as .npy or .segs.json, or a labeled mesh; if IN contains
    the labels, give IN again.
    """
    job = one_job(target, given, (source, labels))

    def compute() -> tuple[Cells, MeshAttributes | None, Ints, dict[int, str]]:
        origin = read_input(str(source), given["format"])
        cells = origin.cells()
        known = given_labels(origin, cells, labels, given["labels_named"])
        file = read_input(str(target), given["target_format"])
        goal, attributes = file.cells_and_attributes(keep=job.keeps_attributes)
        job.outputs.check_fit(goal)
        limits: Any = {"max_distance": max_distance, "n_threads": given["n_threads"]}
        return goal, attributes, transfer(cells, known.labels, goal, **limits), known.names

    goal, attributes, carried, names = run_in_background(compute)
    job.write(goal, carried, attributes, names=names)
    n_without = int(np.count_nonzero(carried < 0))
    n_labels, noun = len(np.unique(carried[carried >= 0])), kit.kind_of(goal).noun
    facts = {f"n_{noun}s": len(carried), "n_labels": n_labels, "n_without": n_without}
    without = f", {n_without} without a label" if n_without else ""
    text = f"{kit.counted(len(carried), noun)}, {kit.counted(n_labels, 'label')}{without}"
    job.report(facts, text, noun)


@click.command("cut")
@click.argument("mesh", metavar="IN", type=opts.FILE)
@opts.labels_argument
@opts.option(
    "-n --n-segments", opts.COUNT,
    "Segment the mesh into this many regions first.  [default: use the labels in IN, or else its"
    f" named parts; if IN has neither, {opts.USUAL_COUNT}]",
)  # fmt: skip
@one_output_options("the cut mesh with its labels, or the labels of its faces alone", "IN")
@opts.format_option("IN")
@opts.drop_attributes_option("IN")
def cut_command(mesh: Path, n_segments: int | None, labels: Path | None, **given: Any) -> None:
    """Cut a mesh along smooth borders of its regions.

    Borders between regions zigzag along mesh edges. This command replaces the borders by smooth
    curves, and cuts faces along these curves. Borders that follow creases do not change, and closed
    meshes stay closed. LABELS is a label file with the regions of IN, instead of -n.
    """
    if n_segments is not None and labels is not None:
        raise click.UsageError("give -n or LABELS, not both")
    job = one_job(mesh, given, (labels,))

    def compute() -> tuple[Any, MeshAttributes | None, Array, dict[int, str]]:
        source, name = read_input(str(mesh), given["format"]), given["labels_named"]
        cells, attributes = source.cells_and_attributes(keep=job.keeps_attributes)
        if not kit.kind_of(cells).has_faces:
            raise MeshError(f"{mesh}: a mesh of faces is needed")
        surface, n_threads = kit.as_mesh(cells), given["n_threads"]
        job.outputs.check_fit(surface)
        own = None if n_segments or labels else source.own_labels(surface.n_cells, name)
        if labels or (own and np.ptp(own.values) >= own.are_parts):  # a single part has no border
            found, numbers, _, names = ranked_labels_beside(source, labels, surface, name)
        else:
            found, names = segment(surface, n_segments, n_threads=n_threads).labels, {}
            numbers = np.arange(found.max() + 1)
        cut = cut_borders(surface, found, n_threads=n_threads)
        return cut, kit.CellData(surface, attributes).attributes_of(cut), numbers[cut.labels], names

    cut, attributes, new, names = run_in_background(compute)
    job.write(cut.mesh, np.where(cut.labels < 0, -1, new).astype(np.int32), attributes, names=names)
    n_regions, n_kept = len(cut.is_kept), int(np.count_nonzero(cut.is_kept))
    n_new, facts = cut.mesh.n_faces, {"n_faces": cut.n_sources, "n_regions": n_regions}
    facts |= {"n_new_faces": n_new, "n_kept": n_kept}
    kept = f" ({n_kept} kept their old borders)" if n_kept else ""
    faces = f"{kit.counted(cut.n_sources, 'face')} cut into {n_new}"
    job.report(facts, f"{faces}, {kit.counted(n_regions, 'region')}{kept}")
