"""Perceived differences of colors: OKLab, for normal vision and color blindness."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from .._types import Array, Bytes, Floats
from ..io.light import linear_of_oklab, linear_of_srgb, oklab_of_linear, srgb_of_linear

Vision = Literal["normal", "protanopia", "deuteranopia", "tritanopia"]
VISIONS: tuple[Vision, ...] = get_args(Vision)
"""Normal vision, and vision without cones for long, middle or short wavelengths."""

# Matrices for linear sRGB at severity 1: Machado, Oliveira and Fernandes, "A physiologically-based
# model for simulation of color vision deficiency", 2009, table 1.
_SIMULATIONS = {
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritanopia": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}


def oklab(colors: Array) -> Floats:
    """Return sRGB colors, (N, 3), 0 to 255, in OKLab: lightness 0 to 1, green-red, blue-yellow.

    Euclidean distances are close to perceived ones.
    """
    return oklab_of_linear(_linear(colors))


def seen_as(colors: Array, vision: Vision) -> Floats:
    """Return sRGB colors, (N, 3), 0 to 255, in OKLab as perceived with this vision."""
    linear = _linear(colors)
    if vision != "normal":
        linear = np.clip(linear @ _SIMULATIONS[vision].T, 0, 1)
    return oklab_of_linear(linear)


def color_distances(colors: Array, others: Array, visions: tuple[Vision, ...] = VISIONS) -> Floats:
    """Return distances in OKLab between all colors of two sets, (N, M), under the worst vision."""
    apart = [_distances(seen_as(colors, v), seen_as(others, v)) for v in visions]
    return np.asarray(np.min(apart, axis=0))


def from_oklab(places: Floats) -> Bytes:
    """Return OKLab colors, (N, 3), in sRGB, clipped to its range."""
    return srgb_of_linear(linear_of_oklab(places))


def _linear(colors: Array) -> Floats:
    """Convert sRGB colors, 0 to 255, to linear sRGB, 0 to 1."""
    return linear_of_srgb(np.asarray(colors, dtype=np.float64) / 255.0)


def _distances(places: Floats, others: Floats) -> Floats:
    return np.asarray(np.linalg.norm(places[:, np.newaxis] - others[np.newaxis], axis=2))
