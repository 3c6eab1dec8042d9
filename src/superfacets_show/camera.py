"""Define viewpoints of pictures, and place cameras."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from superfacets.kit import Floats, checked_choice, checked_number

Clip = Literal["x", "-x", "y", "-y", "z", "-z"]
CLIPS: tuple[str, ...] = get_args(Clip)
"""Names of the halves of a volume that `plot` can show. The other half is cut away, so that the
inside of the volume is visible."""

# Half of the vertical field of view, in degrees. A narrow field of view causes little distortion.
_HALF_VIEW_ANGLE = 10.0

# Sum of the empty margins on both sides, as a fraction of the height or width of the picture.
_MARGIN = 0.03

# For each up axis, the directions to the right and toward the viewer at azimuth 0.
_FRAMES = {
    "x": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "y": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "z": ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0)),
}

Up = Literal["auto", "x", "y", "z"]
UP_CHOICES: tuple[str, ...] = get_args(Up)
"""Allowed values of `View.up`."""

# Azimuth and elevation of named views, in degrees. "iso" shows three sides of a box equally.
_NAMED_VIEWS = {
    "front": (0.0, 0.0),
    "back": (180.0, 0.0),
    "left": (-90.0, 0.0),
    "right": (90.0, 0.0),
    "top": (0.0, 90.0),
    "bottom": (0.0, -90.0),
    "iso": (45.0, math.degrees(math.atan(math.sqrt(0.5)))),
}
VIEW_NAMES: tuple[str, ...] = tuple(_NAMED_VIEWS)
"""Allowed names for `View.named`."""

# A rotating mesh is divided into horizontal slices, each enclosed by a ring at its lower end and a
# ring at its upper end. Number of slices, and number of points per ring.
_N_RINGS, _N_AROUND = 200, 90


@dataclass(frozen=True, kw_only=True)
class View:
    """Viewpoint of a picture. At zoom 1, the whole mesh fills the frame.

    Parameters
    ----------
    azimuth : float, default 30.0
        Horizontal angle of the viewer in degrees. At 0, the viewer is in front of the mesh; with
        larger angles, the viewer is farther to the right.
    elevation : float, default 15.0
        Angle of the viewer above the horizon in degrees, from -90 (below) to 90 (above).
    up : {"auto", "y", "z", "x"}
        Axis that points up. The front of the mesh faces +z, or -y if z points up. ``"auto"``
        chooses z if the mesh would stand much more stably with z up than with y up, or if it is in
        georeferenced coordinates, far from the origin in x and y, and otherwise y.
    zoom : float, default 1.0
        Magnification of the center of the picture, > 0.

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

    @staticmethod
    def named(name: str, *, up: Up = "auto", zoom: float = 1.0) -> View:
        """Return a named view: front, back, left, right, top, bottom or iso.

        "left" and "right" are the sides of the mesh as seen from the front. "iso" shows the front,
        right and top sides at equal angles.

        Raises
        ------
        ValueError
            If there is no view with this name.
        """
        checked_choice(name, "view", VIEW_NAMES)
        azimuth, elevation = _NAMED_VIEWS[name]
        return View(azimuth=azimuth, elevation=elevation, up=up, zoom=zoom)


@dataclass(frozen=True)
class Camera:
    """A perspective camera."""

    position: Floats
    target: Floats
    up: Floats
    half_slope: float  # tangent of half the vertical field of view


def place_camera(points: Floats, view: View, aspect: float) -> Camera:
    """Return a camera for which the points fill the frame at zoom 1. `view.up` cannot be "auto"."""
    right, toward, up = view_axes(view)
    across, height, depth = points @ right, points @ up, points @ toward
    across_middle, height_middle, depth_middle = map(_midrange, (across, height, depth))
    slope = math.tan(math.radians(_HALF_VIEW_ANGLE))
    distance = 0.0
    # In perspective, the center of the bounding box does not project to the center of the picture.
    # Each iteration reduces this error by a factor of more than 5.
    for _ in range(4):
        x, y, z = across - across_middle, height - height_middle, depth - depth_middle
        reach = np.maximum(np.abs(y), np.abs(x) / aspect) / (slope * (1 - _MARGIN))
        distance = float((z + reach).max())
        across_middle += distance * _midrange(x / (distance - z))
        height_middle += distance * _midrange(y / (distance - z))
    target = across_middle * right + height_middle * up + depth_middle * toward
    return Camera(target + distance * toward, target, up, slope / view.zoom)


def orbiting_cameras(points: Floats, view: View, aspect: float, n: int) -> list[Camera]:
    """Return n cameras, evenly spaced on a circle around the up axis. Each camera shows all points.

    The first camera has the azimuth of the view, and the following cameras have increasing azimuth.
    All cameras have the same height and the same distance from their target.
    """
    start = replace(view, azimuth=0.0)
    camera = place_camera(_rings_around(points, start), start, aspect)
    right, front, up = view_axes(replace(start, elevation=0.0))
    cameras = []
    for turn in range(n):
        angle = math.radians(view.azimuth) + 2 * math.pi * turn / n
        ahead = math.cos(angle) * front + math.sin(angle) * right
        # Rotation matrix from the axes at azimuth 0 to the axes at this angle.
        turned = np.stack([np.cross(up, ahead), ahead, up]).T @ np.stack([right, front, up])
        place, target = turned @ camera.position, turned @ camera.target
        cameras.append(Camera(place, target, turned @ camera.up, camera.half_slope))
    return cameras


def _rings_around(points: Floats, view: View) -> Floats:
    """Return points on rings around the up axis. The rings enclose `points` during a rotation."""
    right, front, up = view_axes(replace(view, elevation=0.0))
    heights, radii = points @ up, np.hypot(points @ right, points @ front)
    levels = np.linspace(heights.min(), heights.max(), _N_RINGS + 1)
    ring = np.clip(np.searchsorted(levels, heights, side="right") - 1, 0, _N_RINGS - 1)
    widest = np.full(_N_RINGS, -1.0)
    np.maximum.at(widest, ring, radii)
    is_met = widest >= 0
    angles = np.arange(_N_AROUND) * (2 * math.pi / _N_AROUND)
    circle = np.outer(np.cos(angles), front) + np.outer(np.sin(angles), right)
    rings = widest[is_met, np.newaxis, np.newaxis] * circle
    ends = [levels[:-1][is_met], levels[1:][is_met]]
    return np.concatenate(
        [rings + np.multiply.outer(end, up)[:, np.newaxis] for end in ends]
    ).reshape(-1, 3)


def _midrange(values: Floats) -> float:
    return float(values.min() + values.max()) / 2


def view_axes(view: View) -> tuple[Floats, Floats, Floats]:
    """Return the directions right, toward the viewer, and up, as seen by the viewer.

    The directions are unit vectors in the coordinates of the mesh.
    """
    right, front = (np.array(axis) for axis in _FRAMES[view.up])
    azimuth, elevation = math.radians(view.azimuth), math.radians(view.elevation)
    outward = math.cos(azimuth) * front + math.sin(azimuth) * right
    right = math.cos(azimuth) * right - math.sin(azimuth) * front
    pole = np.cross(outward, right)
    toward = math.cos(elevation) * outward + math.sin(elevation) * pole
    return right, toward, np.cross(toward, right)
