"""Unpack Gaussian splats in the compressed PLY of SuperSplat."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from superfacets import MeshError
from superfacets.kit import Array, Floats, counted

_CHUNK = 256
"""Number of splats whose numbers are relative to the same limits."""

_COLOR = 0.28209479177387814
"""Value of the spherical harmonic of degree 0."""

_MAX_OPACITY = 40.0
"""Logit that stands for an opacity of 1; its negative stands for 0."""


def unpacked(packed: Mapping[str, Any], limits: Mapping[str, Any]) -> Iterator[tuple[str, Array]]:
    """Yield the properties of splats, with the names and scales of PLY files without compression.

    `packed` are the properties of the vertices, and `limits` those of the element chunk.
    """
    names = ("position", "rotation", "scale", "color")
    words = [packed.get(f"packed_{name}", np.empty(0)) for name in names]
    if any(getattr(word, "dtype", None) != np.uint32 for word in words):
        raise MeshError(f"compressed splats need packed_{', packed_'.join(names)} of type uint")
    n_chunks = -(-len(words[0]) // _CHUNK)
    if len(next(iter(limits.values()), ())) != n_chunks:
        n_points = counted(len(words[0]), "splat")
        raise MeshError(f"{n_points} need {n_chunks} rows of the element chunk")
    position, rotation, scale, color = words
    for prefix, names, word in (("", "xyz", position), ("scale_", "012", scale)):
        for own, axis, share in zip(names, "xyz", _shares(word, (11, 10, 11)), strict=True):
            yield f"{prefix}{own}", _between(limits, f"{prefix}{axis}", share)
    shares = _shares(color, (8, 8, 8, 8))
    for place, (name, share) in enumerate(zip("rgb", shares[:3], strict=True)):
        shade = _between(limits, name, share) if f"min_{name}" in limits else share
        yield f"f_dc_{place}", ((shade - 0.5) / _COLOR).astype(np.float32)
    with np.errstate(divide="ignore"):
        logits = np.log(shares[3]) - np.log1p(-shares[3])
    yield "opacity", np.clip(logits, -_MAX_OPACITY, _MAX_OPACITY).astype(np.float32)
    for place, part in enumerate(_quaternions(rotation).T):
        yield f"rot_{place}", part.astype(np.float32)


def _shares(words: Array, widths: tuple[int, ...]) -> list[Floats]:
    """Return the bit fields of words, highest bits first, divided by their maxima."""
    ends = np.cumsum(widths[::-1])[::-1]
    return [
        (words >> np.uint32(end - width) & (2**width - 1)) / (2**width - 1)
        for end, width in zip(ends, widths, strict=True)
    ]


def _between(limits: Mapping[str, Any], name: str, share: Floats) -> Array:
    low, high = (limits.get(f"{end}_{name}") for end in ("min", "max"))
    if getattr(low, "ndim", 0) != 1 or getattr(high, "ndim", 0) != 1:
        raise MeshError(f"the element chunk needs min_{name} and max_{name}")
    low, high = (np.repeat(end, _CHUNK)[: len(share)] for end in (low, high))
    return np.asarray(low * (1 - share) + high * share, np.float32)


def _quaternions(words: Array) -> Floats:
    """Return quaternions (w, x, y, z); the largest number is left out and follows from the rest."""
    largest = (words >> np.uint32(30)).astype(np.intp)
    parts = np.sqrt(2.0) * (np.stack(_shares(words, (10, 10, 10)), axis=1) - 0.5)
    rest = np.sqrt(np.clip(1.0 - np.einsum("ij,ij->i", parts, parts), 0.0, None))
    places = np.arange(4)
    found: Floats = np.take_along_axis(
        np.column_stack([parts, rest]),
        np.where(places == largest[:, np.newaxis], 3, places - (places > largest[:, np.newaxis])),
        axis=1,
    )
    return found
