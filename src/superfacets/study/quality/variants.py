"""What is compared: keywords of `superfacets.segment`, and numbers of regions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...pipeline import PARTS

KS = (50, 100, 150, 200, 300)

PLAIN = "plain"
DEFAULT = "default"
ROUGH = "default, not smooth"
OTHER_WEIGHTS = "default, eq. 2"
NO_RIDGES = "default, no ridges"
RELOCATED = "default, relocate"
BY_PARTS = "parts"

_PLAIN: dict[str, Any] = {"weights": "superfacets", "init": "farthest", "smooth": False}

VARIANTS: Mapping[str, Mapping[str, Any]] = {
    PLAIN: _PLAIN,
    "plain, smooth": _PLAIN | {"smooth": True},
    "plain, geodesic": _PLAIN | {"init": "geodesic"},
    "plain, eta 0": _PLAIN | {"eta_convex": 0.0},
    "creases, farthest": {"init": "farthest"},
    "creases, farthest, alpha 40": {"init": "farthest", "alpha": 40.0},
    "creases, alpha 10": {"alpha": 10.0},
    DEFAULT: {},
    "creases, alpha 30": {"alpha": 30.0},
    "creases, alpha 40": {"alpha": 40.0},
    NO_RIDGES: {"ridges": 0.0},
    RELOCATED: {"relocate": True},
    BY_PARTS: PARTS,
    "parts, no ridges": {**PARTS, "ridges": 0.0},
    "parts, not relocated": {"weights": "parts"},
    ROUGH: {"smooth": False},
    OTHER_WEIGHTS: {"weights": "superfacets", "eta_convex": 0.0},
    "default, eta 0.05": {"eta_convex": 0.05},
    "default, eta 0.2": {"eta_convex": 0.2},
}
"""Keywords of `superfacets.segment`, by name. `PLAIN` is the paper's method but for how it ends."""

RESOLUTION_VARIANTS = (PLAIN, OTHER_WEIGHTS, ROUGH, NO_RIDGES, DEFAULT, RELOCATED, BY_PARTS)
"""What is compared on finer and coarser meshes."""
