"""Notes and warnings about results: radius, number of regions, long and thin faces."""

from __future__ import annotations

import warnings

import numpy as np

from ..base.checks import checked_threads, counted
from ..base.errors import IslandWarning
from ..base.options import Sizes
from ..base.types import Floats
from ..clustering.result import Segmentation
from ..graph.kinds import kind_of
from ..graph.size import EDGE_PER_RADIUS
from ..mesh.base import Cells
from ..mesh.weld import lowest_vertices


def sliver_advice(radius: float) -> str:
    """Return advice on how to subdivide long and thin faces, for regions of the given radius."""
    max_edge = EDGE_PER_RADIUS * radius
    return f"subdivide first, mesh = superfacets.subdivide(mesh, max_edge={max_edge:.3g}).mesh"


_IN_UNIT = "is the radius in the unit of the mesh?"

FEWEST_CELLS = 4
"""Minimum mean number of cells of a region, below which `segment` doubts a radius."""


def radius_note(result: Segmentation) -> str | None:
    """Return a note if a radius led to one region, or to regions of few cells, or None."""
    params = result.params
    if params["n_segments"] is not None or params["init"] == "given":
        return None
    n_kept = result.n_unreached if params["islands"] == "keep" else 0
    n_made = result.n_segments - n_kept
    mean = np.count_nonzero(result.labels >= 0) / max(1, n_made)
    if mean >= FEWEST_CELLS:
        one = "one other region" if n_kept else "one region"
        return f"the radius gives only {one}: {_IN_UNIT}" if n_made <= 1 else None
    things = "cells" if result.cells is None else kind_of(result.cells).plural
    return f"regions have {mean:.1f} {things} on average: {_IN_UNIT}"


def fewer_note(result: Segmentation) -> str | None:
    """Return a note if a lower bound of sizes led to fewer regions than requested, or None."""
    asked, n_made = result.params["n_segments"], result.n_segments
    bounds = Sizes(bounds=result.params.get("bounds", (None, None)))
    if asked is None or n_made >= asked or bounds.bounds[0] is None:
        return None
    components = "components between barriers" if "barriers" in result.params else "components"
    return (
        f"{counted(n_made, 'region')} instead of {asked}: some {components} are too small for more"
        f" regions with {bounds.shown_bounds}"
    )


def _tolerance_of_cracks(cells: Cells) -> float | None:
    """Return a millionth of the diagonal if it joins vertices that differ, otherwise None."""
    if kind_of(cells).corners(cells) is None:
        return None
    vertices: Floats = cells.vertices  # type: ignore[attr-defined]
    tolerance = 1e-6 * float(np.linalg.norm(np.ptp(cells.bounds, axis=0)))
    n_exact, n_joined = (
        len(np.unique(lowest_vertices(vertices, weld, checked_threads(None))))
        for weld in (True, tolerance)
    )
    return tolerance if n_joined < n_exact else None


def warn_of_islands(result: Segmentation, cells: Cells) -> None:
    """Issue an IslandWarning if components or a lower bound changed the number of regions."""
    params, n_own, has_barriers = result.params, result.n_unreached, "barriers" in result.params
    asked, is_kept = params["n_segments"], params["islands"] == "keep"
    if params["init"] == "given" or params["radius_factor"] is not None:
        return
    expected = result.n_segments - n_own if asked is None else asked
    if asked is None and (has_barriers or not is_kept or n_own <= expected):
        return  # a radius sets no number, so it is a surprise only if most regions are islands
    if (fewer := fewer_note(result)) is not None:
        warnings.warn(fewer, IslandWarning, stacklevel=6)
        return
    if is_kept and n_own and has_barriers:
        if asked == 1:  # users request this to get one region per component
            return
        note = "barriers divide the cells into components, each of which has at least one region"
    elif is_kept and n_own:
        advice = "to join them to the nearest region as separate pieces, use islands='nearest'"
        note = f"{counted(n_own, 'component')} got no seed; {advice}"
        if n_own > expected and (tolerance := _tolerance_of_cracks(cells)):
            note += f"; to join vertices that almost coincide, prepare(mesh, weld={tolerance:.2g})"
    elif not is_kept and result.n_segments > expected and params["init"] not in ("flood", "grid"):
        n_more = counted(result.n_segments - expected, "part")
        note = f"{n_more} between barriers got no seed and cannot join a region"
    else:
        return
    instead = "" if asked is None else f" instead of {asked}"
    warnings.warn(
        f"{counted(result.n_segments, 'region')}{instead}: {note}", IslandWarning, stacklevel=6
    )
