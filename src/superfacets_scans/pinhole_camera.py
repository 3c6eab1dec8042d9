"""Define pinhole cameras: the pose and the projection with which an image of a mesh was taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from superfacets.base.checks import checked_image_size, checked_intrinsics, checked_pose
from superfacets.kit import Floats, freeze


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
        pose, intrinsics = checked_pose(self.pose), checked_intrinsics(self.intrinsics)
        freeze(self, pose=pose, intrinsics=intrinsics)
        object.__setattr__(self, "size", checked_image_size(self.size))

    @classmethod
    def of_opengl(
        cls, pose: npt.ArrayLike, intrinsics: npt.ArrayLike, size: tuple[int, int], name: str = ""
    ) -> PinholeCamera:
        """Make a camera from a pose with right, up and backward axes, as in OpenGL and Blender."""
        opencv_pose = checked_pose(pose)
        opencv_pose[:3, 1:3] *= -1
        return cls(opencv_pose, checked_intrinsics(intrinsics), size, name)

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
