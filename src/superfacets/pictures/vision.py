"""Perceived differences of colors: OKLab, for normal vision and color blindness."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from .._types import Array, Bytes, Floats

Vision = Literal["normal", "protanopia", "deuteranopia", "tritanopia"]
VISIONS: tuple[Vision, ...] = get_args(Vision)
"""Normal vision, and vision without cones for long, middle or short wavelengths."""

_LINEAR_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_CONES_TO_OKLAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)

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

    Euclidean distances are close to perceived ones. Matrices: Ottosson, "A perceptual color space
    for image processing", 2020.
    """
    return _oklab_of_linear(_linear(colors))


def seen_as(colors: Array, vision: Vision) -> Floats:
    """Return sRGB colors, (N, 3), 0 to 255, in OKLab as perceived with this vision."""
    linear = _linear(colors)
    if vision != "normal":
        linear = np.clip(linear @ _SIMULATIONS[vision].T, 0, 1)
    return _oklab_of_linear(linear)


def color_distances(colors: Array, others: Array, visions: tuple[Vision, ...] = VISIONS) -> Floats:
    """Return distances in OKLab between all colors of two sets, (N, M), under the worst vision."""
    apart = [_distances(seen_as(colors, v), seen_as(others, v)) for v in visions]
    return np.asarray(np.min(apart, axis=0))


def from_oklab(places: Floats) -> Bytes:
    """Return OKLab colors, (N, 3), in sRGB, clipped to its range."""
    linear = (places @ np.linalg.inv(_CONES_TO_OKLAB).T) ** 3 @ np.linalg.inv(_LINEAR_TO_CONES).T
    linear = np.clip(linear, 0, 1)
    shares = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(shares * 255), np.uint8)


def _linear(colors: Array) -> Floats:
    """Convert sRGB colors, 0 to 255, to linear sRGB, 0 to 1."""
    scaled = np.asarray(colors, dtype=np.float64) / 255.0
    return np.where(scaled <= 0.04045, scaled / 12.92, ((scaled + 0.055) / 1.055) ** 2.4)


def _oklab_of_linear(linear: Floats) -> Floats:
    return np.asarray(np.cbrt(linear @ _LINEAR_TO_CONES.T) @ _CONES_TO_OKLAB.T)


def _distances(places: Floats, others: Floats) -> Floats:
    return np.asarray(np.linalg.norm(places[:, np.newaxis] - others[np.newaxis], axis=2))
