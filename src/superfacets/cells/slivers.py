"""Faces that are long and thin compared with the regions asked for, which become stripes."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._types import Floats
from .._validate import checked_threads
from ..mesh.faces import FaceMesh, measure_faces, measure_shapes, sliver_area
from .face_graph import FaceGraph
from .size import DEFAULT_N_SEGMENTS, radius_of

__all__ = [
    "EDGE_PER_RADIUS", "advised_max_edge", "area_of_slivers", "sliver_note", "sliver_share",
]  # fmt: skip

MIN_LENGTH = 2.0
"""Radii: the diameter of a region. A longer face reaches across the whole of it."""

MAX_HEIGHT = 0.5
"""Radii, above the longest side. A face that is thicker is not thin beside a region, only large:
the mesh is coarse for so many regions, but they need not be stripes. With `MIN_LENGTH`, slivers are
four times as long as high."""

MAX_SHARE = 0.1
"""Share of the area in such faces above which `segment` warns.

Chosen on 189 cases: the 95 models of the Princeton benchmark with 150 regions (14 of them with 50
and 500 too), and with 50 to 500 regions 12 CAD parts (blocks and plates with holes, flanges, a
pipe, a shaft, gears) and 15 other meshes. Subdivided at r / 4, the compactness falls by a factor of
1.2 or more in 31 of them. 26 of these have a share above 0.1, the CAD parts 0.158 at least; of the
other five the largest factor is 1.4. Seven of the 158 cases that gain less have a share above 0.1
too, and gain 1.09 to 1.18. (The share in faces longer than 3 radii and thinner than one passes over
seven of the 31, with factors up to 1.6, and is above 0.1 for four of the 158. Faces of 1.5 radii
and more would warn of meshes that gain 1.05.)"""

EDGE_PER_RADIUS = 0.25
"""Longest edge that is advised, in radii.

On 11 CAD parts with 150 regions the median compactness is 10.7; subdivided at r it is 8.1, at r / 2
7.5, at r / 4 6.6. Every halving makes three times the faces: some 100,000 of 1,000 at r / 4."""


def sliver_share(
    mesh: FaceMesh, faces: FaceGraph, longest: Floats | None, radius: float, n_threads: int
) -> float:
    """Return the share of the area in faces longer than 2 radii and thinner than half of one.

    0 to 1; 0 where the faces have no area. `longest` is that of `FaceShapes`, for
    triangles: time is O(F) in blocks of faces with so long a side.
    """
    total = _core.sum_of(faces.measures, n_threads)
    if total <= 0.0:
        return 0.0
    limits = (MIN_LENGTH * radius, MAX_HEIGHT * radius)
    area = sliver_area(mesh, faces.measures, longest, *limits, n_threads)
    return min(area / total, 1.0)


def area_of_slivers(mesh: FaceMesh, radius: float, n_threads: int) -> float:
    """Return the area of the faces that `sliver_share` counts."""
    _, areas, _, longest = measure_shapes(mesh, n_threads)
    limits = (MIN_LENGTH * radius, MAX_HEIGHT * radius)
    return sliver_area(mesh, areas, longest, *limits, n_threads)


def advised_max_edge(mesh: FaceMesh, n_segments: int | None, radius: float | None) -> float:
    """Return the longest edge that suits the regions that `segment` is asked for."""
    threads = checked_threads(None)
    if radius is not None:
        low, high = mesh.bounds
        return EDGE_PER_RADIUS * radius * float(np.linalg.norm(high - low))
    _, areas = measure_faces(mesh, threads)
    return EDGE_PER_RADIUS * radius_of(areas, n_segments or DEFAULT_N_SEGMENTS, threads)


def sliver_note(share: float, advice: str) -> str | None:
    """Return one line on what slivers do to regions; None where there are few."""
    if share <= MAX_SHARE:
        return None
    return (
        f"{share:.0%} of the area is in faces that are long and thin beside the regions, which"
        f" become stripes: {advice}"
    )
