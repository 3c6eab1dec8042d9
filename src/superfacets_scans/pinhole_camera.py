"""Define pinhole cameras: the pose and the projection with which an image of a mesh was taken."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from superfacets.kit import Floats, checked_count, freeze, refuse_mask

MAX_SIDE = 1 << 16
"""Maximum width and height of an image, in pixels."""

MAX_PIXELS = 1 << 29
"""Maximum number of pixels of a camera. The largest aerial cameras have 450 million."""

MAX_ROTATION_ERROR = 1e-3
"""Maximum error of the scalar products of the axes of a camera pose, which should be 0 or 1. This
limit accepts rotations that were rounded to four digits, and rejects poses with a scale."""


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A pinhole camera: its pose, and the projection of points to pixels.

    Lens distortion is not supported: undistort images first.

    Parameters
    ----------
    pose : array_like, shape (4, 4) or (3, 4)
        Camera-to-world matrix: a rotation and a translation, without scale, in the coordinates of
        the mesh. The first three columns are the right, down and forward axes of the camera (as in
        OpenCV, COLMAP and ScanNet); the last column is the position of the camera. Invert
        world-to-camera matrices with ``np.linalg.inv`` first.
    intrinsics : array_like, shape (4,), (3, 3) or (4, 4)
        Focal lengths and principal point in pixels, (fx, fy, cx, cy), or a camera matrix without
        skew. The center of the first pixel is at (0.5, 0.5), as in COLMAP.
    size : (int, int)
        Width and height of the image in pixels.
    name : str, default ""
        Name of the image in messages.

    Attributes
    ----------
    pose : ndarray of float64, shape (4, 4)
    intrinsics : ndarray of float64, shape (4,)
        fx, fy, cx, cy.

    Raises
    ------
    ValueError, TypeError
        If an array has the wrong shape or is not finite, if the pose is not a rotation and a
        translation, if the camera matrix has skew, if focal lengths are not positive, if width
        or height is not from 1 to 65,536, or if there are more than 2**29 pixels.

    Examples
    --------
    A camera looks down from 5 units above the origin:

    >>> pose = [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 5], [0, 0, 0, 1]]
    >>> PinholeCamera(pose, (500, 500, 320, 240), (640, 480))
    PinholeCamera(640 x 480, at [0.0, 0.0, 5.0])
    """

    pose: npt.NDArray[np.float64]
    intrinsics: npt.NDArray[np.float64]
    size: tuple[int, int]
    name: str = ""

    def __post_init__(self) -> None:
        pose, intrinsics = _checked_pose(self.pose), _checked_intrinsics(self.intrinsics)
        freeze(self, pose=pose, intrinsics=intrinsics)
        object.__setattr__(self, "size", _checked_image_size(self.size))

    @classmethod
    def of_opengl(
        cls, pose: npt.ArrayLike, intrinsics: npt.ArrayLike, size: tuple[int, int], name: str = ""
    ) -> PinholeCamera:
        """Make a camera from a pose with right, up and backward axes, as in OpenGL and Blender."""
        opencv_pose = _checked_pose(pose)
        opencv_pose[:3, 1:3] *= -1
        return cls(opencv_pose, _checked_intrinsics(intrinsics), size, name)

    @property
    def projection(self) -> Floats:
        """Matrix of shape (3, 4) that maps (x, y, z, 1) to depth * (u, v, 1), with pixel (u, v)."""
        rotation, position = self.pose[:3, :3], self.pose[:3, 3]
        offset = -(rotation * position[:, np.newaxis]).sum(axis=0)
        right, down, ahead = np.concatenate([rotation.T, offset[:, np.newaxis]], axis=1)
        fx, fy, cx, cy = self.intrinsics
        return np.stack([fx * right + cx * ahead, fy * down + cy * ahead, ahead])

    def __repr__(self) -> str:
        name = f"{self.name!r}, " if self.name else ""
        position = self.pose[:3, 3].tolist()
        return f"PinholeCamera({name}{self.size[0]} x {self.size[1]}, at {position})"


def _checked_pose(pose: Any) -> Floats:
    """Return the checked camera pose (rotation and position) as a new array of shape (4, 4)."""
    given = _numbers_of(pose, "pose")
    if given.shape not in ((4, 4), (3, 4)):
        raise ValueError(f"pose must have shape (4, 4) or (3, 4), got {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError("pose must be finite: leave out images whose pose is unknown")
    array = np.eye(4)
    array[: len(given)] = given
    if np.any(array[3] != (0, 0, 0, 1)):
        raise ValueError(f"the last row of pose must be 0, 0, 0, 1, got {array[3].tolist()}")
    rotation = array[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        products = (rotation[:, :, None] * rotation[:, None]).sum(axis=0)
    error = float(np.abs(products - np.eye(3)).max())
    if not error <= MAX_ROTATION_ERROR:  # also if it is NaN
        raise ValueError(
            "pose must be a rotation and a position, without scale or shear: its axes must be"
            f" orthonormal to within {MAX_ROTATION_ERROR:g}, got an error of {error:.2g}"
        )
    if np.dot(np.cross(rotation[0], rotation[1]), rotation[2]) < 0:
        raise ValueError("pose must be a rotation, got a reflection: reverse one of its axes")
    return array


def _checked_intrinsics(intrinsics: Any) -> Floats:
    """Return (fx, fy, cx, cy), also from a camera matrix without skew, (3, 3) or (4, 4)."""
    given = _numbers_of(intrinsics, "intrinsics")
    if given.shape in ((3, 3), (4, 4)):
        if given[0, 1] != 0:
            raise ValueError(f"the skew of intrinsics must be 0, got {given[0, 1]:g}")
        given = given[(0, 1, 0, 1), (0, 1, 2, 2)]
    if given.shape != (4,):
        raise ValueError(
            "intrinsics must be (fx, fy, cx, cy) or a matrix of shape (3, 3) or (4, 4), got shape"
            f" {given.shape}"
        )
    if not np.isfinite(given).all() or given[:2].min() <= 0:
        raise ValueError(
            f"intrinsics must be finite, with positive focal lengths, got {given.tolist()}"
        )
    return given.copy()


def _checked_image_size(size: Any) -> tuple[int, int]:
    """Return image width and height after a comparison with `MAX_SIDE` and `MAX_PIXELS`."""
    if not isinstance(size, (tuple, list, np.ndarray)) or len(size) != 2:
        raise TypeError(f"size must be a pair of width and height, got {reprlib.repr(size)}")
    width, height = (checked_count(value, "size", MAX_SIDE) for value in size)
    if width * height > MAX_PIXELS:
        raise ValueError(f"size must be at most {MAX_PIXELS} pixels, got {width} x {height}")
    return width, height


def _numbers_of(value: Any, name: str) -> Floats:
    refuse_mask(value, name)
    try:
        array = np.asarray(value)
    except ValueError:  # the nested lists are ragged
        array = np.empty(0, object)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must be an array of numbers, got {reprlib.repr(value)}")
    return array.astype(np.float64)
