"""How hollow a shape is: whether as much of its surface turns inward as outward."""

from __future__ import annotations

import math

__all__ = ["evened_share"]

SOLID = 0.3
"""From here on a shape is not hollow. Convex bodies have 1 at most, long rods 3/4."""

HOLLOW = 0.15
"""Up to here it is as hollow as can be: thin walls, whose insides cancel their outsides."""

MOST_EVENED = 0.25
"""What smooth concave edges of hollow shapes count less, and smooth convex ones count."""

STEPS = 1 << 16
"""Shares are rounded to so many steps: the last bits of a sum then change nothing."""

TURN_BITS = 31
"""As in the core, whose turns are whole numbers of the diagonal over 2 to this power."""


def evened_share(turn: int, volume: float, area: float, diagonal: float) -> float:
    """Return which share of what smooth concave edges count goes to convex ones.

    Of y = 3 V M / A^2, which is 1 for a ball, with the total mean curvature M, half the sum over
    edges of their length times the angle.

    Parameters
    ----------
    turn : int
        Sum over edges of length times angle, in the unit of the core.
    volume, area, diagonal : float
        What a closed mesh encloses, 0 where it is open; of its faces; of its bounding box.

    Returns
    -------
    float
        0 for solid shapes to `MOST_EVENED` for hollow ones.

    Examples
    --------
    A ball of radius 1, with a diagonal of 4:

    >>> import math
    >>> unit = 4 / 2**31
    >>> evened_share(round(8 * math.pi / unit), 4 / 3 * math.pi, 4 * math.pi, 4.0)
    0.0
    >>> evened_share(0, 4 / 3 * math.pi, 4 * math.pi, 4.0)
    0.25
    """
    if not volume or not area:
        return 0.0
    unit = math.ldexp(1.0, math.frexp(diagonal)[1] - 1 - TURN_BITS)
    roundness = 3.0 * volume * (turn * unit / 2.0) / area**2
    share = min(max((SOLID - roundness) / (SOLID - HOLLOW), 0.0), 1.0)
    return MOST_EVENED * round(STEPS * share) / STEPS
