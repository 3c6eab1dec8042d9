"""Colors and normal axes of Gaussian splats, and splats in the compressed PLY of SuperSplat."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Bools, Floats

_CHUNK = 256
"""Number of splats whose values are relative to the same limits."""

_COLOR = 0.5 / math.sqrt(math.pi)
"""Value of the spherical harmonic of degree 0. The color of a splat is 0.5 plus this value times
the coefficients `_SHADES`."""

_SHADES = ("f_dc_0", "f_dc_1", "f_dc_2")
_SCALES = ("scale_0", "scale_1", "scale_2")
_ROTATION = ("rot_0", "rot_1", "rot_2", "rot_3")

_FLAT = math.log(2.0)
"""Minimum difference between the two smallest log scales of a splat with a normal axis."""

_MAX_OPACITY = 40.0
"""Logit that stands for an opacity of 1; its negative stands for 0."""


def splat_colors(columns: Mapping[str, Array]) -> Floats | None:
    """Return the color of each splat, 0 to 1; None if the columns are missing or not finite."""
    if not {*_SHADES} <= columns.keys():
        return None
    shades = 0.5 + _COLOR * _table(columns, _SHADES)
    return np.clip(shades, 0.0, 1.0) if np.isfinite(shades).all() else None


def splat_axes(columns: Mapping[str, Array]) -> Floats | None:
    """Return the shortest axis of each splat, or zero if it is not clear or numbers are not finite.

    The result is None if the columns of rotations (w, x, y, z) or scales are missing. If splats
    have only two scales, the axis is the rotated z axis.
    """
    names = [name for name in _SCALES if name in columns]
    if len(names) < 2 or not {*_ROTATION} <= columns.keys():
        return None
    scales, turns = _table(columns, names), _table(columns, _ROTATION)
    squares = np.einsum("ij,ij->i", turns, turns)
    is_known: Bools = np.asarray((squares > 0) & np.isfinite(squares))
    shortest = np.full(len(scales), 2)
    if len(names) == 3:
        shortest = scales.argmin(axis=1)
        is_known &= np.isfinite(scales).all(axis=1)
        first, second, _ = np.sort(scales[is_known], axis=1).T
        is_known[is_known] = second - first >= _FLAT
    axes = np.zeros((len(scales), 3))
    w, axis = np.split(turns[is_known], [1], axis=1)
    unit, squared = np.eye(3)[shortest[is_known]], squares[is_known, np.newaxis]
    crossed = np.cross(axis, unit)
    axes[is_known] = unit + 2.0 * (w * crossed + np.cross(axis, crossed)) / squared
    return axes


def _table(columns: Mapping[str, Array], names: Sequence[str]) -> Floats:
    with np.errstate(invalid="ignore"):  # signaling NaNs
        return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def unpacked(packed: Mapping[str, Any], limits: Mapping[str, Any]) -> Iterator[tuple[str, Array]]:
    """Yield the properties of packed splats, named and scaled as in PLY files without compression.

    `packed` contains properties of the vertices, and `limits` properties of the element chunk.
    """
    names = [f"packed_{name}" for name in ("position", "rotation", "scale", "color")]
    words = [packed.get(name) for name in names]
    if any(getattr(word, "dtype", None) != np.uint32 for word in words):
        raise MeshError(f"compressed splats need {', '.join(names)} of type uint")
    position, rotation, scale, color = map(np.asarray, words)

    def between(name: str, share: Floats) -> Array:
        ends = [np.asarray(limits.get(f"{end}_{name}")) for end in ("min", "max")]
        if any(end.shape != (-(-len(share) // _CHUNK),) for end in ends):
            raise MeshError(f"min_{name} and max_{name} need a number for each {_CHUNK} splats")
        low, high = (np.repeat(end, _CHUNK)[: len(share)] for end in ends)
        return np.asarray(low * (1 - share) + high * share, np.float32)

    for axis, share in zip("xyz", _shares(position, 11, 10, 11), strict=True):
        yield axis, between(axis, share)
    for place, share in enumerate(_shares(scale, 11, 10, 11)):
        yield f"scale_{place}", between(f"scale_{'xyz'[place]}", share)
    *shades, opacity = _shares(color, 8, 8, 8, 8)
    for place, share in enumerate(shades):
        name = "rgb"[place]
        shade = between(name, share) if f"min_{name}" in limits else share
        yield f"f_dc_{place}", np.asarray((shade - 0.5) / _COLOR, np.float32)
    with np.errstate(divide="ignore"):
        logits = np.log(opacity) - np.log1p(-opacity)
    yield "opacity", np.clip(logits, -_MAX_OPACITY, _MAX_OPACITY).astype(np.float32)
    # The largest number of a quaternion (w, x, y, z) follows from the three others.
    parts = [np.sqrt(2.0) * (share - 0.5) for share in _shares(rotation, 10, 10, 10)]
    rest = np.sqrt(np.clip(1.0 - sum(part**2 for part in parts), 0.0, None))
    largest = rotation >> np.uint32(30)
    for place in range(4):
        before, after = parts[max(place - 1, 0)], parts[min(place, 2)]
        values = np.where(largest == place, rest, np.where(largest < place, before, after))
        yield f"rot_{place}", values.astype(np.float32)


def _shares(words: Array, *widths: int) -> list[Floats]:
    """Return the lowest bit fields of words, highest first, divided by their largest values."""
    ends = np.cumsum(widths[::-1])[::-1]
    return [
        (words >> np.uint32(end - width) & (2**width - 1)) / (2**width - 1)
        for end, width in zip(ends, widths, strict=True)
    ]
