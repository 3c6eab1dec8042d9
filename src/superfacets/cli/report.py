"""The report of a run of `segment`: notes, a line, or a JSON object."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from .._types import Ints, Longs
from ..batches.files import Outcome
from ..cells.kinds import kind_of
from ..cells.size import sliver_note
from ..clustering.segmentation import Segmentation
from ..export.ids import RENUMBERED_OUTPUTS, VERTEX_OUTPUTS
from ..export.ply import names_replaced
from ..export.textures import notes_on_texture
from ..io.attributes import MeshAttributes
from ..io.guards import counted
from ..mesh.cells import Cells
from ..pipeline import SCANS, fewer_note, whole_parts


def notes_of(
    outcome: Outcome, asked: int | None, endings: Collection[str], n_lost: int, holds_labels: bool
) -> list[str]:
    """Notes on results that may surprise.

    `asked` is the number of regions given with -n. `n_lost` is as for `notes_on_written`.
    `holds_labels` tells whether some output holds labels without the cells.
    """
    mesh, result, listed = outcome.mesh, outcome.result, outcome.listed
    kind = kind_of(mesh)
    notes = []
    if listed is not None:
        is_same = len(listed) == mesh.n_cells
        said = f"{len(listed)} faces were subdivided into {mesh.n_cells}"
        notes.append("no edge is longer than max_edge" if is_same else said)
    n_kept = int(np.count_nonzero(result.labels >= 0))
    if asked is not None and asked > n_kept:
        whole = "cloud" if kind.are_points else "mesh"
        notes.append(
            f"{asked} regions were asked for; the {whole} has"
            f" {counted(n_kept, kind.noun)}, each of which became a region"
        )
    notes += notes_on_result(result)
    if listed is not None and holds_labels:
        notes += _notes_on_listed(result, listed)
    return notes + notes_on_written(mesh, outcome.attributes, endings, n_lost)


def notes_on_result(result: Segmentation) -> list[str]:
    """Notes on regions that differ from expectations."""
    asked: int | None = result.params["n_segments"]  # None if a radius was given
    notes = _notes_on_number(result, asked)
    n_own = 0 if asked is None else max(0, result.n_segments + result.n_merged - asked)
    n_nearest = result.n_unreached - n_own
    if n_nearest > 0 and result.params["islands"] == "nearest":
        notes.append(f"{counted(n_nearest, 'island')} without a seed joined the nearest region")
    if result.n_joined:
        notes.append(f"{counted(result.n_joined, 'stray piece')} joined a neighbor")
    elif _is_connected_anyway(result.params):
        notes.append("--connect has no effect: only --paper gives regions in several pieces")
    if result.n_merged:
        notes.append(f"{counted(result.n_merged, 'small region')} joined a neighbor")
    if result.n_islands:
        notes.append(f"{counted(result.n_islands, 'small region')} without a neighbor stayed")
    if result.n_extra_pieces:
        pieces = counted(result.n_extra_pieces, "separate piece")
        notes.append(f"regions have {pieces} not connected with the rest of their region")
    slivers = sliver_note(result.sliver_share or 0.0, "try --subdivide")
    return notes if slivers is None else [*notes, slivers]


def _is_connected_anyway(params: Mapping[str, Any]) -> bool:
    """Whether --connect was given although the regions are connected without it."""
    is_exact = params["radius_factor"] is None and params["islands"] == "keep"
    return is_exact and params["enforce_connectivity"]


def _notes_on_number(result: Segmentation, asked: int | None) -> list[str]:
    """A note if there are more or fewer regions than asked for, or if a radius gives one region."""
    params = result.params
    n_made = result.n_segments + result.n_merged
    n_kept = result.n_unreached if params["islands"] == "keep" else 0
    if asked is None:
        note = "the radius gives a single region: -r is a fraction of the mesh's diagonal"
        return [] if n_made - n_kept > 1 else [note]
    if n_made != asked and params["init"] in ("flood", "grid"):
        return [
            f"{counted(n_made, 'region')} in place of {asked}: --init {params['init']} makes only"
            " about as many as asked for"
        ]
    if n_made <= asked:
        fewer = fewer_note(result)
        return [] if fewer is None else [fewer]
    more = f"{counted(n_made - asked, 'more region')} than asked for"
    if params["islands"] == "nearest":
        return [f"{more}, for parts between barriers that got no seed and cannot join a neighbor"]
    why = f"{whole_parts(params)} that got no seed"
    if params["radius_factor"] is not None:
        why += ", or faces that no center reached"
    advice = "; with --islands nearest they join the nearest region"
    return [f"{more}, for {why}{'' if 'barriers' in params else advice}"]


def _notes_on_listed(result: Segmentation, listed: Longs) -> list[str]:
    """Notes on regions that files of labels lack because the input was subdivided."""
    n_lost = result.n_segments - len(np.unique(listed[listed >= 0]))
    if not n_lost:
        return []
    are, them = ("is", "it") if n_lost == 1 else ("are", "them")
    lost = counted(n_lost, "region")
    return [
        f"{lost} {are} smaller than the long faces of the input; label files have no face of {them}"
    ]


def notes_on_written(
    cells: Cells, attributes: MeshAttributes | None, endings: Collection[str], n_lost: int, *,
    are_replaced: bool = True,
) -> list[str]:  # fmt: skip
    """Notes on data that files of these cells with these endings lack.

    `n_lost` regions have no vertex in files of vertex labels. Without `are_replaced`, the labels
    come from the input itself, so none of its properties are replaced.
    """
    notes = []
    if n_lost:
        named = sorted({*endings} & {*VERTEX_OUTPUTS})
        lack = f"{' and '.join(named)} lack{'s' if len(named) == 1 else ''}"
        notes.append(f"{lack} {counted(n_lost, 'region')}, for which no vertex was left")
    if attributes is None:
        return notes
    of_points = kind_of(cells).are_points
    if attributes.left_out:
        notes.append(f"not kept from the input: {', '.join(attributes.left_out)}")
    replaced = names_replaced(attributes, of_points=of_points)
    if of_points and {".ply", ".pcd"}.isdisjoint(endings):  # LAS keeps colors
        replaced = [name for name in replaced if name.endswith(" label")]
    if not of_points and {".ply", ".vtp"}.isdisjoint(endings):
        replaced = []
    if replaced and are_replaced:
        notes.append(f"replaced by properties of the labels: {', '.join(replaced)}")
    if attributes.texture is not None:
        corners = kind_of(cells).corners(cells)
        has_polygons = corners is not None and corners.size != 3
        notes += notes_on_texture(attributes.texture, endings, has_polygons=has_polygons)
    return notes


def notes_on_numbers(labels: Ints | None, endings: Collection[str], n_lost: int) -> list[str]:
    """A note if these files renumber the labels; `n_lost` is as for `notes_on_written`."""
    renumbered = sorted({*endings} & {*RENUMBERED_OUTPUTS})
    if labels is None or not renumbered:
        return []
    given = np.unique(labels)
    if not n_lost and given[-1] == len(given) - 1:
        return []
    shown = ", ".join(map(str, given[:3])) + (", ..." if len(given) > 3 else "")
    files = " and ".join(renumbered)
    return [f"labels are renumbered without gaps in {files}; .segs.json keeps {shown}"]


def notes_on_denoising(asked: object, taken: int | None, *, scans: bool) -> list[str]:
    """A note on the steps that ``--denoise auto`` took."""
    if asked != "auto":
        return []
    other = f" (--scans takes {SCANS['denoise']})" if scans else ""
    return [f"denoise: auto took {counted(taken or 0, 'step')}{other}"]


def facts_of(result: Segmentation, timings: Mapping[str, float], noun: str) -> dict[str, Any]:
    """The run as a JSON object; `noun` is the name of the labeled elements."""
    return {
        f"n_{noun}s": len(result.labels),
        "n_segments": result.n_segments,
        "n_iter": result.n_iter,
        "stop_reason": result.stop_reason,
        "levels": [asdict(level) for level in result.levels],
        "seconds": dict(timings),
        "n_unreached": result.n_unreached,
        "sliver_share": result.sliver_share,
        "params": result.params,
    }


def summary_of(
    result: Segmentation, timings: Mapping[str, float], noun: str = "face", n_left_out: int = 0
) -> str:
    """The run in one line; `noun` is the name of the labeled elements."""
    left_out = f" ({n_left_out} left out)" if n_left_out else ""
    seconds = ", ".join(f"{stage} {spent:.3f}" for stage, spent in timings.items())
    return (
        f"{counted(len(result.labels), noun)}{left_out}, {counted(result.n_segments, 'region')}, "
        f"{counted(result.n_iter, 'iteration')}, {result.stop_reason}; seconds: {seconds}"
    )
