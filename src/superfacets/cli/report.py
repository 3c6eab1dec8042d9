"""The report of a run of `segment`: notes, a line, or a JSON object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import numpy.typing as npt

from ..cells.slivers import sliver_note
from ..cells.subdivision import Subdivision
from ..clustering.segmentation import Segmentation
from ..io.attributes import MeshAttributes
from ..io.writers.ply import names_replaced
from .options import STANDARD_STREAM

__all__ = [
    "attributes_of_parts",
    "facts_of",
    "notes_on_attributes",
    "notes_on_listed",
    "notes_on_regions",
    "summary_of",
]


def notes_on_regions(result: Segmentation, asked: int | None) -> list[str]:
    """Notes on unexpected results; `asked` is k, None with a radius."""
    notes = []
    keeps_k = result.params["init"] in ("geodesic", "farthest")
    n_more = result.n_segments + result.n_merged - asked if asked is not None and keeps_k else 0
    if n_more > 0:
        why = "components of the mesh that got no seed"
        if result.params["radius_factor"] is not None:
            why += ", or faces that no center reached"
        notes.append(
            f"{n_more} more regions than asked for, for {why};"
            " with --islands nearest they join the nearest region"
        )
    if result.n_unreached and result.params["islands"] == "nearest":
        notes.append(f"{result.n_unreached} islands without a seed joined the nearest region")
    if result.n_joined:
        notes.append(f"{result.n_joined} stray pieces joined a neighbor")
    if result.n_merged:
        notes.append(f"{result.n_merged} small regions joined another")
    if result.n_islands:
        notes.append(f"{result.n_islands} small regions touch no other, and stayed")
    slivers = sliver_note(result.sliver_share or 0.0, "try --subdivide")
    return notes if slivers is None else [*notes, slivers]


def notes_on_listed(result: Segmentation, listed: npt.NDArray[np.int64]) -> list[str]:
    """Notes on labels that are missing in files for the faces of a subdivided input."""
    n_lost = result.n_segments - len(np.unique(listed))
    if not n_lost:
        return []
    return [f"{n_lost} regions have the most area in no face of the input: label files lack them"]


def attributes_of_parts(attributes: MeshAttributes, parts: Subdivision) -> MeshAttributes:
    """What of the attributes of a mesh a subdivided one has: those of the faces, and comments."""
    left_out = [
        *attributes.left_out,
        *(f"vertex property {name}, which new vertices do not have" for name in attributes.vertex),
    ]
    face = {name: values[parts.sources] for name, values in attributes.face.items()}
    return MeshAttributes({}, face, attributes.comments, tuple(left_out))


def notes_on_attributes(attributes: MeshAttributes) -> list[str]:
    """Notes on data of the input that the labeled PLY does not hold."""
    notes = []
    if attributes.left_out:
        notes.append(f"not kept of the input: {', '.join(attributes.left_out)}")
    replaced = names_replaced(attributes)
    if replaced:
        notes.append(f"replaced by those of the labels: {', '.join(replaced)}")
    return notes


def facts_of(
    name: str, result: Segmentation, timings: Mapping[str, float], outputs: Sequence[str]
) -> dict[str, Any]:
    """The run as an object for JSON."""
    return {
        "file": name,
        "n_faces": len(result.labels),
        "n_segments": result.n_segments,
        "n_iter": result.n_iter,
        "stop_reason": result.stop_reason,
        "levels": [asdict(level) for level in result.levels],
        "seconds": dict(timings),
        "n_unreached": result.n_unreached,
        "sliver_share": result.sliver_share,
        "params": result.params,
        "outputs": list(outputs),
    }


def summary_of(
    name: str, result: Segmentation, timings: Mapping[str, float], outputs: Sequence[str]
) -> str:
    """A line per file written, and one for the run."""
    seconds = ", ".join(f"{stage} {spent:.3f}" for stage, spent in timings.items())
    lines = [
        f"wrote {'standard output' if output == STANDARD_STREAM else output}" for output in outputs
    ]
    lines.append(
        f"{name}: {len(result.labels)} faces, {result.n_segments} regions, "
        f"{result.n_iter} iterations, {result.stop_reason}; seconds: {seconds}"
    )
    return "\n".join(lines)
