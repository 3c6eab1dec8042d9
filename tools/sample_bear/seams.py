"""Assign each quad to a solid, so that the seams between solids are smooth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .bear import ellipsoids
from .lattice import IndexArray
from .quads import QuadSurface, is_on_seam, solids_of_vertices


def place_seams(surface: QuadSurface) -> QuadSurface:
    """Assign each quad to the nearest solid, then smooth the seams between solids.

    Vertices on a seam are later moved onto the crease between the two solids. A quad with all
    corners on seams would then be flat, and a spur of two quads would fold over. Therefore quads
    that are outvoted by their neighbors change their solid. In each round, at most one quad around
    a vertex changes. Only flat quads, and quads that are outvoted in the first round, may change;
    otherwise small solids would disappear. A few rounds suffice, except for creases that the grid
    cannot resolve.
    """
    middles = surface.points[surface.quads].mean(axis=1)
    owners = ellipsoids().nearest(middles).astype(np.int64)
    outvoted = None
    for _ in range(8):
        on_seam = is_on_seam(solids_of_vertices(replace(surface, owners=owners)))
        rivals, margins = _vote(surface.quads, owners, on_seam)
        outvoted = margins > 0 if outvoted is None else outvoted
        flat = on_seam[surface.quads].all(axis=1)
        loses = np.flatnonzero((margins > 0) & outvoted | (margins >= 0) & flat)
        if len(loses) == 0:
            break
        chosen = loses[_lowest_around(surface.quads[loses], len(surface.points))]
        owners[chosen] = rivals[chosen]
    return replace(surface, owners=owners)


def _vote(
    quads: IndexArray, owners: IndexArray, on_seam: npt.NDArray[np.bool_]
) -> tuple[IndexArray, IndexArray]:
    """Return rivals and margins of all quads, (Q,) each.

    The rival is the solid, other than the solid of the quad, with the most votes around the quad.
    The margin is the votes of the rival minus the votes of the solid of the quad; it is -1 away
    from seams. Each quad votes for its solid at each of its corners, so that neighbors across a
    side have two votes. A quad does not vote for itself.
    """
    n_solids = len(ellipsoids().centers)
    ballots = (quads * n_solids + owners[:, None]).ravel()
    votes_at = np.bincount(ballots, minlength=len(on_seam) * n_solids).reshape(-1, n_solids)
    at_seam = np.flatnonzero(on_seam[quads].any(axis=1))
    votes = votes_at[quads[at_seam]].sum(axis=1)
    own = owners[at_seam, None]
    own_votes = np.take_along_axis(votes, own, axis=1)[:, 0] - 4
    np.put_along_axis(votes, own, -1, axis=1)
    rivals, margins = owners.copy(), np.full(len(quads), -1)
    rivals[at_seam], margins[at_seam] = votes.argmax(axis=1), votes.max(axis=1) - own_votes
    return rivals, margins


def _lowest_around(quads: IndexArray, n_vertices: int) -> npt.NDArray[np.bool_]:
    """Return whether each of `quads` precedes all other `quads` that share a corner with it."""
    first = np.full(n_vertices, len(quads))
    rank = np.arange(len(quads))
    np.minimum.at(first, quads.ravel(), np.repeat(rank, 4))
    return np.asarray((first[quads] == rank[:, None]).all(axis=1))
