"""Where a picture is taken from, and the camera there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from .._validate import checked_choice, checked_number

__all__ = ["UP_CHOICES", "Camera", "Up", "View", "place_camera", "view_axes"]

FloatArray = npt.NDArray[np.float64]

# Half of the angle that the picture's height spans, degrees: a long lens, little distortion.
_HALF_VIEW_ANGLE = 10.0

# Share of the height or width left free, so that outlines are not cut by the frame.
_MARGIN = 0.03

# For each axis that may point up: the directions right and toward the viewer at azimuth 0.
_FRAMES = {
    "x": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "y": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "z": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
}

Up = Literal["auto", "x", "y", "z"]
UP_CHOICES: tuple[str, ...] = get_args(Up)
"""The choices of `View.up`."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Where a picture is taken from. The whole mesh fills the frame at zoom 1.

    Parameters
    ----------
    azimuth : float, default 30.0
        Degrees that the viewer walks around the mesh, to the viewer's right, from its front.
    elevation : float, default 15.0
        Degrees above the horizon, -90 (from below) to 90 (from above).
    up : {"auto", "y", "z", "x"}
        Axis that points up. The front is +z, but -y where z points up. By default a guess: z if the
        mesh would stand much more firmly on its lowest points along z than along y, otherwise y.
    zoom : float, default 1.0
        Magnification about the middle of the picture, > 0.

    Raises
    ------
    ValueError, TypeError
        If a value is out of range or not a number.
    """

    azimuth: float = 30.0
    elevation: float = 15.0
    up: Up = "auto"
    zoom: float = 1.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.azimuth):
            raise ValueError(f"azimuth must be finite, got {self.azimuth}")
        if not -90 <= self.elevation <= 90:
            raise ValueError(f"elevation must be -90 to 90 degrees, got {self.elevation}")
        checked_choice(self.up, "up", UP_CHOICES)
        checked_number(self.zoom, "zoom", zero=False)


@dataclass(frozen=True)
class Camera:
    """A perspective camera."""

    position: FloatArray
    target: FloatArray
    up: FloatArray
    half_slope: float  # half of the height seen, per distance


def place_camera(points: FloatArray, view: View, aspect: float) -> Camera:
    """Camera from which the points just fill the frame; the view's axis is not "auto"."""
    right, toward, up = view_axes(view)
    across, height, depth = points @ right, points @ up, points @ toward
    across_middle, height_middle, depth_middle = map(_midrange, (across, height, depth))
    slope = math.tan(math.radians(_HALF_VIEW_ANGLE))
    distance = 0.0
    # In perspective the middle of the box is not that of the picture, but the error falls more
    # than fivefold each turn.
    for _ in range(4):
        x, y, z = across - across_middle, height - height_middle, depth - depth_middle
        reach = np.maximum(np.abs(y), np.abs(x) / aspect) / (slope * (1 - _MARGIN))
        distance = float((z + reach).max())
        across_middle += distance * _midrange(x / (distance - z))
        height_middle += distance * _midrange(y / (distance - z))
    target = across_middle * right + height_middle * up + depth_middle * toward
    return Camera(target + distance * toward, target, up, slope / view.zoom)


def _midrange(values: FloatArray) -> float:
    """Mean of the least and the largest value."""
    return float(values.min() + values.max()) / 2


def view_axes(view: View) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit vectors to the right, toward the viewer and up, as the viewer sees them."""
    right, front = (np.array(axis) for axis in _FRAMES[view.up])
    azimuth, elevation = math.radians(view.azimuth), math.radians(view.elevation)
    outward = math.cos(azimuth) * front + math.sin(azimuth) * right
    right = math.cos(azimuth) * right - math.sin(azimuth) * front
    pole = np.cross(outward, right)
    toward = math.cos(elevation) * outward + math.sin(elevation) * pole
    return right, toward, np.cross(toward, right)
