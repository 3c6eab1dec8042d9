"""Divide a CAD part into flat sides and areas of similar curvature, by merging flat patches."""

from __future__ import annotations

import math
import warnings

import numpy as np

from ..base.errors import IslandWarning
from ..base.types import Floats, Ints, Longs
from ..graph.constraints import ANGLE_NOISE, checked_angle, components_of
from ..graph.kinds import as_surface
from ..graph.surface import Surface
from ..mesh.convert import MeshLike, as_mesh
from ..mesh.faces import FaceMesh, corners_of

ROUNDING, COARSEST, STEPS, MAX_TILT = 1e-6, 1e-4, 2.5, 0.5
"""Rounding error that is always allowed, and largest step of rounded coordinates, as fractions of
the diagonal. Errors are at most about STEPS steps; they add up over the corners of two faces. They
tilt a face by error / height, in radians. Faces that can be tilted by MAX_TILT join a neighbor."""

DIFFERENCE, SCATTER, OUTER, FEW = 0.35, 0.3, 0.5, 8
"""Areas are similar if curvatures differ by less than DIFFERENCE + SCATTER / sqrt(n), relative to
the larger one; n is the smaller number of patches. Of the bends at a border, OUTER may belong to
either side: a fan of triangles has 2 / r on a cylinder. FEW single triangles always merge. The
first strip of a fillet has 3/4 of its curvature."""


def cad_faces(
    mesh: MeshLike, angle: float = 30.0, *, weld: float = True, n_threads: int | None = None
) -> Ints:
    """Label each flat side of a CAD part, and each other area of similar curvature.

    Borders are edges that bend by at least `angle`, 30 degrees by default, and lines where the
    curvature changes, as at the foot of a boss. A chain of fillets of one radius, straight and
    around corners, is one area. An `IslandWarning` is given if most faces have no neighbor.
    Coordinates may be rounded to steps of 1e-6 of the diagonal, or of 1e-4 if all of them have the
    same decimals or the precision of float32.

    Parameters
    ----------
    mesh : Mesh, PolygonMesh or mesh-like
        Same as in `segment`.
    angle : float, default 30
        Same as in `sharp_edges`. It must exceed the angle between two facets of a cylinder.
    weld, n_threads
        Same as in `segment`.

    Returns
    -------
    ndarray of int32, shape (N,)
        Labels from 0 to K - 1. They can be `barriers` of `segment`.

    Raises
    ------
    MeshError, ValueError, TypeError
        As for `sharp_edges`.

    Examples
    --------
    >>> valley = ([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], [[2, 1, 0], [3, 2, 0]])
    >>> cad_faces(valley).tolist(), cad_faces(valley, 91).tolist()
    ([0, 1], [0, 0])
    """
    source, limit = as_mesh(mesh), np.radians(checked_angle(angle)) - ANGLE_NOISE
    surface, n_few = as_surface(source, weld=weld, n_threads=n_threads), 0
    n_alone = int(np.count_nonzero(np.diff(surface.offsets) == 0))
    if 1 < source.n_faces < 2 * n_alone:
        found = f"{n_alone} of {source.n_faces} faces have no neighbor"
        advice = "if corners differ by rounding errors, join them with weld="
        warnings.warn(f"{found}: {advice}", IslandWarning, stacklevel=2)
    labels, sums, pairs, bends = _patches(surface, source, limit)
    while n_few <= FEW and pairs.size:
        targets = _targets(sums, pairs, bends, 1 / surface.diagonal, n_few)
        n = int(targets.max()) + 1
        n_few += n == len(sums)
        sums = np.stack([np.bincount(targets, column, n) for column in sums.T], axis=1)
        labels, (pairs, bends) = targets[labels], _distinct(targets[pairs], bends, n)
    return surface.components(labels)


def _rounding_error(vertices: Floats, diagonal: float) -> float:
    """Estimate the rounding error from the decimals or the precision of all coordinates."""
    singles, (low, high) = vertices.astype(np.float32), np.array([ROUNDING, COARSEST]) * diagonal
    stored = singles if (singles == vertices).all() else vertices
    spacing = step = float(np.spacing(np.abs(stored).max()))
    for n in range(math.ceil(1 - math.log10(low)), math.floor(-math.log10(high)) - 1, -1):
        if np.abs(vertices - vertices.round(n)).max() <= spacing:
            step = 10.0**-n if 10.0**-n <= high else spacing  # coarser decimals may be exact
    return float(max(low, STEPS * min(max(step, spacing), high)))


def _patches(surface: Surface, mesh: FaceMesh, limit: float) -> tuple[Longs, Floats, Longs, Floats]:
    """Return the flat patch of each face, sums over patches, pairs of neighbors, (2, P), and bends.

    Bends: half the angles times lengths. Sums, (K, 5): both kinds of bends, area, patches, corners.
    """
    arcs, sources, areas = surface.arc_measures(), surface.sources, surface.measures
    assert arcs.angles is not None and arcs.sides is not None  # noqa: PT018
    lengths, ends = arcs.border_lengths, np.stack([sources, surface.neighbors])
    longest = np.zeros_like(areas)
    np.maximum.at(longest, sources, lengths)
    heights = 2 * areas / np.where(longest > 0, longest, 1)
    error, sizes = _rounding_error(mesh.vertices, surface.diagonal), corners_of(mesh).sizes
    is_known = MAX_TILT * heights > error
    is_same = (sources[1:] == sources[:-1]) & (arcs.sides[1:] == arcs.sides[:-1])
    is_smooth = (np.abs(arcs.angles) < limit) & is_known[ends].all(axis=0)
    is_smooth[1:] &= ~is_same
    is_smooth[:-1] &= ~is_same
    is_flat = is_smooth & (np.abs(arcs.angles) * heights[ends].min(axis=0) < error)
    last = surface.offsets[1:][~is_known & (longest > 0)] - 1  # the longest after sorting
    is_flat[np.lexsort((lengths, is_known[ends[1]], sources))[last]] = True
    patches, n = components_of(surface, is_flat, sources)
    pairs = patches[ends[:, is_smooth]].astype(np.int64)
    bends, is_inner = (arcs.angles * lengths / 2)[is_smooth], pairs[0] == pairs[1]
    inner = np.bincount(pairs[0], bends * is_inner, n)  # of flat patches 0: noise cancels out
    outer = [np.bincount(pairs[0], np.maximum(x, 0) * ~is_inner, n) for x in (-bends, bends)]
    convex, concave = outer[0] + np.maximum(-inner, 0), outer[1] + np.maximum(inner, 0)
    total, corners = (np.bincount(patches, x, n) for x in (areas, sizes * is_known))
    sums = np.stack([convex, concave, total, np.ones(n), corners], axis=1)
    return patches.astype(np.int64), sums, *_distinct(pairs, np.abs(bends), n)


def _targets(sums: Floats, pairs: Longs, bends: Floats, floor: float, n_few: int) -> Longs:
    """Return the number, after merging, of the area that each area becomes part of.

    Curvatures below `floor` count as 0. Areas of at most `n_few` single triangles always merge.
    """
    (first, second), each, counts = pairs, np.arange(len(sums)), sums[:, 3]
    areas = np.maximum(sums[:, 2], np.finfo(float).tiny)
    curvatures, outer = (sums[:, :2].T / areas).T, np.bincount(first, bends, len(sums)) / areas
    differences = np.abs(curvatures[first] - curvatures[second]).sum(axis=1)
    differences = np.maximum(differences - OUTER * outer[pairs].max(axis=0), 0)
    differences /= np.maximum(curvatures.sum(axis=1)[pairs].max(axis=0), floor)
    differences /= DIFFERENCE + SCATTER / np.sqrt(counts[pairs].min(axis=0))
    are_few = (counts <= n_few) & (sums[:, 4] <= 3 * counts)
    chosen = np.flatnonzero((differences < 1) | are_few[pairs].any(axis=0))
    chosen = chosen[np.lexsort((-differences[chosen], first[chosen]))]
    best = each.copy()
    best[first[chosen]] = second[chosen]  # numpy assigns the last of several values
    targets = np.where(best[best] == each, np.minimum(best, each), each)
    targets = np.where(are_few & ~are_few[best], targets[best], targets)
    return np.unique(targets, return_inverse=True)[1]


def _distinct(pairs: Longs, bends: Floats, n: int) -> tuple[Longs, Floats]:
    """Add up the bends of repeated pairs. Remove pairs of one of the `n` areas with itself."""
    differ = pairs[0] != pairs[1]
    keys, at = np.unique((pairs[0] * n + pairs[1])[differ], return_inverse=True)
    return np.stack([keys // n, keys % n]), np.bincount(at, bends[differ], len(keys)).astype(float)
