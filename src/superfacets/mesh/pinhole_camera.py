"""Cameras of images of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._types import Floats
from .._validate import checked_image_size, checked_intrinsics, checked_pose, freeze


@dataclass(frozen=True, eq=False)
class PinholeCamera:
    """A pinhole camera: its pose, and its map from directions to pixels.

    There is no lens distortion: undistort images of other cameras first.

    Parameters
    ----------
    pose : array_like, shape (4, 4) or (3, 4)
        Camera to world, in the frame and the unit of the mesh: the columns are the directions of
        the axes of the camera, right, down and forward (as in OpenCV, COLMAP and ScanNet), and its
        position. A rotation and a translation, without scale. For a matrix from world to camera,
        pass ``np.linalg.inv`` of the matrix.
    intrinsics : array_like, shape (4,), (3, 3) or (4, 4)
        Focal lengths and principal point in pixels: fx, fy, cx, cy, or the usual matrix of these.
        The center of the first pixel is at (0.5, 0.5), as in COLMAP.
    size : (int, int)
        Width and height of the image in pixels.
    name : str, default ""
        Name of the image, for messages.

    Attributes
    ----------
    pose : ndarray of float64, shape (4, 4)
    intrinsics : ndarray of float64, shape (4,)
        fx, fy, cx, cy.

    Raises
    ------
    ValueError, TypeError
        If an array has the wrong shape or is not finite, if the pose is not a rotation and a
        translation, or if focal lengths or sizes are not positive.

    Examples
    --------
    A camera 5 above the origin that looks down:

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
        """Make a camera from axes right, up and back, as in OpenGL, Blender and NeRF."""
        turned = checked_pose(pose)
        turned[:3, 1:3] *= -1
        return cls(turned, checked_intrinsics(intrinsics), size, name)

    @property
    def projection(self) -> Floats:
        """Map of (x, y, z, 1) to (u d, v d, d) for pixel (u, v) and depth d, shape (3, 4)."""
        rotation, position = self.pose[:3, :3], self.pose[:3, 3]
        offset = -(rotation * position[:, np.newaxis]).sum(axis=0)
        right, down, ahead = np.concatenate([rotation.T, offset[:, np.newaxis]], axis=1)
        fx, fy, cx, cy = self.intrinsics
        return np.stack([fx * right + cx * ahead, fy * down + cy * ahead, ahead])

    def __repr__(self) -> str:
        name = f"{self.name!r}, " if self.name else ""
        place = self.pose[:3, 3].tolist()
        return f"PinholeCamera({name}{self.size[0]} x {self.size[1]}, at {place})"
