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


FEWEST_CELLS = 4
"""Minimum mean number of cells of a region, below which `segment` doubts a radius."""


def radius_note(result: Segmentation) -> str | None:
    """Return a note if a radius led to regions of fewer than `FEWEST_CELLS` cells, or None."""
    params = result.params
    if params["n_segments"] is not None or params["init"] == "given":
        return None
    n_kept = result.n_unreached if params["islands"] == "keep" else 0
    n_made = result.n_segments - n_kept
    mean = np.count_nonzero(result.labels >= 0) / max(1, n_made)
    if mean >= FEWEST_CELLS:
        return None
    things = "cells" if result.cells is None else kind_of(result.cells).plural
    return f"regions have {mean:.1f} {things} on average: is the radius in the unit of the mesh?"


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
    params = result.params
    asked = params["n_segments"]  # None if `segment` was called with a radius
    if asked is None or params["init"] == "given" or params["radius_factor"] is not None:
        return
    n_more, has_barriers = result.n_segments - asked, "barriers" in params
    if (fewer := fewer_note(result)) is not None:
        warnings.warn(fewer, IslandWarning, stacklevel=6)
        return
    if params["islands"] == "keep" and result.n_unreached:
        if has_barriers and asked == 1:  # users request this to get one region per component
            return
        advice = "to join them to the nearest region as separate pieces, use islands='nearest'"
        note = f"{counted(result.n_unreached, 'component')} got no seed; {advice}"
        if result.n_unreached > asked and (tolerance := _tolerance_of_cracks(cells)):
            note += f"; to join vertices that almost coincide, prepare(mesh, weld={tolerance:.2g})"
        if has_barriers:
            note = (
                "barriers divide the cells into components, each of which has at least one region"
            )
    elif params["islands"] == "nearest" and n_more > 0 and params["init"] not in ("flood", "grid"):
        note = f"{counted(n_more, 'part')} between barriers got no seed and cannot join a region"
    else:
        return
    message = f"{counted(result.n_segments, 'region')} instead of {asked}: {note}"
    warnings.warn(message, IslandWarning, stacklevel=6)
