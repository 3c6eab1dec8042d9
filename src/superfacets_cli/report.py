"""Compose notes on unexpected results of commands."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from superfacets import IslandWarning, MeshAttributes, SliverWarning, kit
from superfacets.kit import FORMATS, Floats, Ints, Longs, OutputFiles, Written, counted, kind_of

MAX_FILLED = 0.2
"""Maximum fraction of regions that have the minimum number of vertices without a note. In scanned
rooms with a larger fraction, more vertices were in wrong objects than with fewer regions."""


def notes_on_result(
    outcome: Any, n_requested: int | None, endings: Collection[str], written: Written
) -> list[str]:
    """Return notes on a result of `FileOptions.segment`, and on outputs with these file endings.

    `n_requested` is the value of -n, or None. `written` is the same as in `notes_on_written`.
    """
    mesh, result, listed = outcome.mesh, outcome.result, outcome.listed
    noun, notes = kind_of(mesh).noun, []
    n_kept, n_made = int(np.count_nonzero(result.labels >= 0)), result.n_segments
    if listed is not None:
        said = f"subdivision turned {counted(len(listed), 'face')} into {mesh.n_cells}"
        is_same = len(listed) == mesh.n_cells
        notes.append("no face was subdivided: all edges are short enough" if is_same else said)
    if n_requested is not None and n_requested > n_kept:
        notes.append(
            f"{n_requested} regions were requested, but there are only {counted(n_kept, noun)}:"
            f" each {noun} became a region"
        )
    n_own = result.n_unreached if result.params["islands"] == "keep" else 0
    is_by_radius = result.params["n_segments"] is None and "cells" not in result.params
    is_warned = any(isinstance(one, IslandWarning) for one in outcome.warnings)
    if is_by_radius and n_own and not is_warned and "barriers" not in result.params:
        added = f"regions were added for {counted(n_own, 'component')} without a seed"
        notes.append(f"{added}; to join them to the nearest region, use --islands nearest")
    hidden = SliverWarning if (n_requested or 0) > n_kept else ()  # then, faces are no stripes
    notes += [str(one) for one in outcome.warnings if not isinstance(one, hidden)]
    if outcome.sharp_inside is not None and outcome.sharp_inside.any():
        notes.append(_note_on_sharp_edges(outcome.sharp_inside))
    holds_labels = not {*endings} <= {*FORMATS.cell_outputs}
    if listed is not None and holds_labels and (n := n_made - len(np.unique(listed[listed >= 0]))):
        less = f"lack {counted(n, 'region')} smaller than those faces"
        notes.append(f"label files, which have a label per face of the input, {less}")
    sizes = written.region_sizes
    n_filled = int(np.count_nonzero(sizes == OutputFiles.MIN_VERTICES))
    if n_filled > MAX_FILLED * len(sizes):
        size = "-r" if is_by_radius else "--cells" if "cells" in result.params else None
        advice = f"try a larger {size}" if size else "try a smaller -n"
        if "feature_weight" not in result.params:
            advice += ", or --features color if the file has colors"
        notes.append(
            f"{n_filled} of {counted(len(sizes), 'region')} in {_of_vertices(endings)} have the"
            f" minimum of {OutputFiles.MIN_VERTICES} vertices, because small regions take vertices"
            f" from neighbors; this makes borders less accurate: {advice}"
        )
    return notes + notes_on_written(result.labels, outcome.attributes, endings, written)


def _of_vertices(endings: Collection[str]) -> str:
    """Return the endings of formats of superpoints, for messages."""
    return " and ".join(sorted({*endings} & {*FORMATS.vertex_outputs, *FORMATS.graph_outputs}))


def _note_on_sharp_edges(inside: Floats) -> str:
    """Return a note on barrier edges inside regions; `inside` is `Outcome.sharp_inside`."""
    longest, n_others = int(np.argmax(inside)), int(np.count_nonzero(inside)) - 1
    others = f" and {counted(n_others, 'other')}" if n_others else ""
    return (
        f"{100 * inside.sum():.3g}% of the length of sharp edges is inside region {longest}{others}"
        ": these edges do not enclose an area, because some edges between their ends bend by less"
        " than --barrier-angle; if the mesh has no noise, try a smaller angle, or"
        " superfacets.cad_faces in Python"
    )


def notes_on_written(
    labels: Ints | None, attributes: MeshAttributes | None, endings: Collection[str],
    written: Written,
) -> list[str]:  # fmt: skip
    """Return notes on data that outputs with these endings do not store, or store in another form.

    `written` is the result of `OutputFiles.write`.
    """
    sizes = written.region_sizes
    notes = _notes_on_sizes(_of_vertices(endings), sizes)
    if attributes is not None and attributes.left_out:
        notes.append(f"data of the input that is not copied: {', '.join(attributes.left_out)}")
    notes += written.notes("data of the input that ")
    if attributes is not None and attributes.texture is not None:
        from superfacets_textures import notes_on_texture

        notes += notes_on_texture(attributes.texture, endings)
    return notes if labels is None else notes + _notes_on_numbers(labels, endings, sizes)


def _notes_on_sizes(files: str, sizes: Longs) -> list[str]:
    """Return notes on regions of few vertices in `files`; `sizes` as in `notes_on_written`."""
    least, notes = OutputFiles.MIN_VERTICES, []
    if n_lost := int(np.count_nonzero(sizes == 0)):
        lost = counted(n_lost, "region")
        notes.append(f"{lost} lost in {files}: all their vertices have labels of other regions")
    if n_small := int(np.count_nonzero((sizes > 0) & (sizes < least))):
        small = f"{counted(n_small, 'region')} with fewer than {least} vertices in {files}"
        notes.append(f"{small}: no neighbor has vertices to spare, and regions are not merged")
    return notes


def _notes_on_numbers(labels: Ints, endings: Collection[str], sizes: Longs) -> list[str]:
    """Return notes if output formats renumber labels; `sizes` as in `notes_on_written`."""
    given, notes = kit.ranked_labels(labels)[1], []
    has_gaps = (bool(len(given)) and given[-1] != len(given) - 1) or not sizes.all()
    renumbered = sorted({*endings} & {*FORMATS.renumbered_outputs})
    graphs = sorted({*endings} & {*FORMATS.graph_outputs})
    if renumbered and has_gaps:
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
