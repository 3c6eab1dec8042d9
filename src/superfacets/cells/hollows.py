"""Hollow shapes, such as cups and rings: their surface turns inward about as much as outward."""

from __future__ import annotations

import math

SOLID = 0.3
"""Roundness y from which a shape is solid. Convex bodies have 1 at most, long rods 3/4."""

HOLLOW = 0.15
"""Roundness up to which a shape is fully hollow. Insides and outsides of thin walls cancel out."""

MOST_EVENED = 0.25
"""Share of the cost of smooth concave edges that smooth convex ones take over in hollow shapes."""

STEPS = 1 << 16
"""Shares are rounded to multiples of 1 / `STEPS`, so that they do not depend on rounding errors."""

TURN_BITS = 31
"""The core sums turns in units of about the diagonal / 2**`TURN_BITS`."""


def evened_share(turn: int, volume: float, area: float, diagonal: float) -> float:
    """Return the share s of `crease_weights`: 0 for solid shapes to `MOST_EVENED` for hollow ones.

    `turn` is the sum over edges of length times angle, in the unit of the core; `volume` is the
    enclosed volume, 0 for an open mesh.
    """
    if not volume or not area:
        return 0.0
    unit = math.ldexp(1.0, math.frexp(diagonal)[1] - 1 - TURN_BITS)
    roundness = 3.0 * volume * (turn * unit / 2.0) / area**2
    share = min(max((SOLID - roundness) / (SOLID - HOLLOW), 0.0), 1.0)
    return MOST_EVENED * round(STEPS * share) / STEPS
