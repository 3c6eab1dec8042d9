"""Compose reports of commands: notes on the result, and a summary as text or JSON."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from superfacets import (
    BalanceWarning,
    IslandWarning,
    MeshAttributes,
    RadiusWarning,
    Segmentation,
    SliverWarning,
)
from superfacets.kit import FORMATS, Cells, Floats, Ints, Longs, OutputFiles, counted, kind_of
from superfacets_textures import notes_on_texture

MAX_FILLED = 0.2
"""Maximum fraction of regions that have the minimum number of vertices without a note. In scanned
rooms with a larger fraction, more vertices were in wrong objects than with fewer regions."""


def notes_of(
    outcome: Any, n_requested: int | None, endings: Collection[str], sizes: Longs,
    holds_labels: bool,
) -> list[str]:  # fmt: skip
    """Return notes on unexpected results; `outcome` is a result of `FileOptions.segment`.

    `n_requested` is the number of regions given with -n, or None. `sizes` is the same as in
    `notes_on_written`. `holds_labels` is True if some output stores labels without the cells.
    """
    mesh, result, listed = outcome.mesh, outcome.result, outcome.listed
    kind = kind_of(mesh)
    notes = []
    if listed is not None:
        is_same = len(listed) == mesh.n_cells
        said = f"subdivision turned {counted(len(listed), 'face')} into {mesh.n_cells}"
        notes.append("no face was subdivided: all edges are short enough" if is_same else said)
    n_kept = int(np.count_nonzero(result.labels >= 0))
    if n_requested is not None and n_requested > n_kept:
        notes.append(
            f"{n_requested} regions were requested, but there are only"
            f" {counted(n_kept, kind.noun)}: each {kind.noun} became a region"
        )
    reworded = (BalanceWarning, IslandWarning, RadiusWarning, SliverWarning)
    notes += [str(one) for one in outcome.warnings if not isinstance(one, reworded)]
    notes += notes_on_result(result, outcome.warnings)
    if outcome.sharp_inside is not None:
        notes += _notes_on_sharp_edges(outcome.sharp_inside)
    if listed is not None and holds_labels:
        notes += _notes_on_listed(result, listed)
    return [
        *notes,
        *notes_on_written(mesh, outcome.attributes, endings, sizes),
        *_notes_on_filled(sizes, endings),
    ]


def notes_on_result(result: Segmentation, warnings: Collection[Warning]) -> list[str]:
    """Return notes on the number of regions, and on isolated or disconnected regions.

    `warnings` are the warnings of `segment`.
    """
    n_requested: int | None = result.params["n_segments"]  # None if a radius was given
    notes = _notes_on_number(result, n_requested, warnings)
    n_own = 0 if n_requested is None else max(0, result.n_segments - n_requested)
    n_nearest = result.n_unreached - n_own
    if n_nearest > 0 and result.params["islands"] == "nearest":
        notes.append(f"{counted(n_nearest, 'island')} without a seed joined the nearest region")
    if result.n_extra_pieces:
        pieces = counted(result.n_extra_pieces, "additional piece")
        notes.append(f"some regions are disconnected: they have {pieces}")
    slivers = SliverWarning.text(result.sliver_share or 0.0, "try --subdivide")
    return notes if slivers is None else [*notes, slivers]


def _notes_on_number(
    result: Segmentation, n_requested: int | None, warnings: Collection[Warning]
) -> list[str]:
    """Return a note if there are not `n_requested` regions, or if a radius gives only one."""
    islands = [str(warning) for warning in warnings if isinstance(warning, IslandWarning)]
    params, n_made = result.params, result.n_segments
    if n_requested is None:
        n_kept = result.n_unreached if params["islands"] == "keep" else 0
        note = "the radius gives only one region: is -r in the unit of the file?"
        notes = [] if n_made - n_kept > 1 or "cells" in params else [note]
        return [str(one) for one in warnings if isinstance(one, RadiusWarning)] or notes
    if n_made != n_requested and params["init"] in ("flood", "grid"):
        return [
            f"{counted(n_made, 'region')} instead of {n_requested}: --init {params['init']}"
            " matches -n only approximately"
        ]
    if n_made <= n_requested:
        return islands if n_made < n_requested and "bounds" in params else []
    more = f"{counted(n_made - n_requested, 'more region')} than requested"
    if params["islands"] == "nearest":
        return [f"{more}: some parts between barriers had no seed and became regions"]
    parts, has_barriers = "components without a seed", "barriers" in params
    if params["radius_factor"] is not None:
        parts += ", and cells that no center reached,"
    elif has_barriers:
        # With -n 1, users request one region per component, so there is no warning.
        return [f"{more}: {text.partition(': ')[2]}" for text in islands]
    advice = "" if has_barriers else "; --islands nearest joins them to the nearest region"
    return [f"{more}: {parts} became regions{advice}"]


def _notes_on_sharp_edges(inside: Floats) -> list[str]:
    """Return a note if barrier edges are inside regions; `inside` is `Outcome.sharp_inside`."""
    regions = np.flatnonzero(inside)
    if not len(regions):
        return []
    longest = regions[np.argsort(-inside[regions], kind="stable")]
    ids = [str(region) for region in longest[:3]]
    if len(regions) > 3:
        ids.append(counted(len(regions) - 3, "other"))
    where = f"region {ids[0]}" if len(ids) == 1 else f"regions {', '.join(ids[:-1])} and {ids[-1]}"
    return [
        f"{100 * inside.sum():.3g}% of the length of sharp edges is inside {where}: these edges do"
        " not enclose an area, because some edges between their ends bend by less than"
        " --barrier-angle; if the mesh has no noise, try a smaller angle, or"
        " superfacets.cad_faces in Python"
    ]


def _notes_on_listed(result: Segmentation, listed: Longs) -> list[str]:
    """Return a note on regions that are missing in label files because of the subdivision.

    `listed` contains the labels in these files: one for each face before the subdivision.
    """
    n_lost = result.n_segments - len(np.unique(listed[listed >= 0]))
    if not n_lost:
        return []
    lost = counted(n_lost, "region")
    return [f"{lost} lost in label files: faces of the input are larger than regions"]


def notes_on_written(
    cells: Cells, attributes: MeshAttributes | None, endings: Collection[str], sizes: Longs, *,
    are_replaced: bool = True,
) -> list[str]:  # fmt: skip
    """Return notes on data that outputs with these file endings do not store.

    `sizes` is the result of `OutputFiles.write`: the number of vertices of each region in files
    with vertex labels. `are_replaced` is False if the labels come from the input, so that they
    replace no property of the input.
    """
    notes = []
    files = " and ".join(sorted({*endings} & {*FORMATS.vertex_outputs}))
    if n_lost := int(np.count_nonzero(sizes == 0)):
        lost = counted(n_lost, "region")
        notes.append(f"{lost} lost in {files}: all their vertices have labels of other regions")
    if n_small := int(np.count_nonzero((sizes > 0) & (sizes < OutputFiles.MIN_VERTICES))):
        small = f"{counted(n_small, 'region')} with fewer than {OutputFiles.MIN_VERTICES} vertices"
        notes.append(f"{small} in {files}: no neighbor has vertices to spare")
    if attributes is None:
        return notes
    if attributes.left_out:
        notes.append(f"data of the input that is not copied: {', '.join(attributes.left_out)}")
    replaced = OutputFiles.replaced_by_labels(cells, attributes, endings)
    if replaced and are_replaced:
        notes.append(f"data of the input that labels replace: {', '.join(replaced)}")
    if attributes.texture is not None:
        corners = kind_of(cells).corners(cells)
        has_polygons = corners is not None and corners.size != 3
        notes += notes_on_texture(attributes.texture, endings, has_polygons=has_polygons)
    return notes


def _notes_on_filled(sizes: Longs, endings: Collection[str]) -> list[str]:
    """Return a note if many regions were enlarged to the minimum; `sizes` as above."""
    n_filled = int(np.count_nonzero(sizes == OutputFiles.MIN_VERTICES))
    if n_filled <= MAX_FILLED * len(sizes):
        return []
    files = " and ".join(sorted({*endings} & {*FORMATS.vertex_outputs}))
    return [
        f"{n_filled} of {counted(len(sizes), 'region')} in {files} have the minimum of"
        f" {OutputFiles.MIN_VERTICES} vertices, because small regions take vertices from neighbors;"
        " this makes borders less accurate: try a smaller -n"
    ]


def notes_on_numbers(labels: Ints | None, endings: Collection[str], sizes: Longs) -> list[str]:
    """Return notes if output formats renumber labels; `sizes` as in `notes_on_written`."""
    renumbered = sorted({*endings} & {*FORMATS.renumbered_outputs})
    graphs = sorted({*endings} & {*FORMATS.graph_outputs})
    if labels is None or not (renumbered or graphs):
        return []
    given = np.unique(labels[labels >= 0])
    has_gaps = given[-1] != len(given) - 1
    notes = []
    if renumbered and (has_gaps or not sizes.all()):
        shown = ", ".join(map(str, given[:3])) + (", ..." if len(given) > 3 else "")
        kept = f".segs.json keeps the labels {shown}"
        notes.append(f"labels are renumbered without gaps in {' and '.join(renumbered)}; {kept}")
    if graphs and has_gaps:
        kept = "the array region contains the label of each node"
        notes.append(f"nodes are numbered without gaps in {' and '.join(graphs)}; {kept}")
    return notes


def note_on_up(requested: str, up: str) -> str:
    """Return the text that follows a file name if ``--up auto`` guessed the axis `up`."""
    return f" (up: {up}, guessed; change it with --up)" if requested == "auto" else ""


def facts_of(
    result: Segmentation, timings: Mapping[str, float], noun: str, sharp_inside: float | None
) -> dict[str, Any]:
    """Return the contents of the JSON report; `noun` is the word for a labeled element.

    `sharp_inside` is the fraction of the length of barrier edges that is inside regions, or None if
    there are no barrier edges.
    """
    return {
        f"n_{noun}s": len(result.labels),
        "n_segments": result.n_segments,
        "n_iter": result.n_iter,
        "stop_reason": result.stop_reason,
        "levels": [asdict(level) for level in result.levels],
        "seconds": dict(timings),
        "n_unreached": result.n_unreached,
        "sliver_share": result.sliver_share,
        "sharp_inside": sharp_inside,
        "params": result.params,
    }


def summary_of(
    result: Segmentation, timings: Mapping[str, float], noun: str = "face", n_left_out: int = 0, *,
    denoise: object = "auto", is_verbose: bool = False,
) -> str:  # fmt: skip
    """Return a one-line summary of a run; `noun` is the word for a labeled element.

    `denoise` is the option of the user, and `is_verbose` adds the time of each stage.
    """
    regions, cells = (
        f"{n:,} {counted(n, thing).partition(' ')[2]}"
        for n, thing in ((result.n_segments, "region"), (len(result.labels), noun))
    )
    left_out = f" ({n_left_out:,} left out)" if n_left_out else ""
    text = f"{regions} of {cells}{left_out} in {sum(timings.values()):.2f} s"
    taken = result.params["denoise"]
    if denoise in (None, "auto") and taken:
        steps = counted(taken, "smoothing step")
        text += f"; noise found: creases measured after {steps}"
    if not is_verbose:
        return text
    seconds = ", ".join(f"{stage} {spent:.3f}" for stage, spent in timings.items())
    iterations = counted(result.n_iter, "iteration")
    return f"{text}; {iterations}, {result.stop_reason}; seconds: {seconds}"
