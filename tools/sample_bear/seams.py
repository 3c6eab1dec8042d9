"""Which quads belong to which solid, such that the seams between solids are smooth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .bear import ellipsoids
from .lattice import IndexArray
from .quads import QuadSurface, is_on_seam, solids_of_vertices


def place_seams(surface: QuadSurface) -> QuadSurface:
    """Give each quad to the nearest solid, then smooth the seams between quads of two solids.

    Vertices on a seam will be put on the crease. A quad with all corners on seams would be
    squeezed flat there, and a spur two quads wide be folded over. So quads that are outvoted by
    the quads around them change hands, one at a time around a vertex. Only those outvoted at the
    start do, lest small parts be worn away turn by turn; flat ones always. A few turns suffice;
    the bound is for creases that the grid cannot resolve at all.
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
    """Strongest other solid around each quad, (Q,), and its votes less those of the quad's own.

    Each quad votes at each of its corners, so neighbors across a side have two votes, but not for
    itself. Away from seams the margin is -1.
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
    """Which of the quads are the first in the list at all of their corners."""
    first = np.full(n_vertices, len(quads))
    rank = np.arange(len(quads))
    np.minimum.at(first, quads.ravel(), np.repeat(rank, 4))
    return np.asarray((first[quads] == rank[:, None]).all(axis=1))
