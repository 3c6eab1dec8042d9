"""Point clouds, stored as checked arrays: positions, and optional values such as normals."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.checks import (
    checked_colors,
    checked_normals,
    checked_points,
    checked_viewpoints,
    counted,
    freeze,
)
from ..base.types import Floats, Singles
from .base import Cells


@dataclass(frozen=True, eq=False)
class PointCloud(Cells):
    """A point cloud with checked, read-only arrays.

    Points keep their order and positions. Several points may have the same position.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Finite positions, stored as read-only float64. N must be at least 1, and `segment` needs at
        least two distinct positions. A contiguous float64 array is not copied (unless it is a
        memory map), so do not change the array while the cloud is in use.
    normals : array_like, shape (N, 3), optional
        Normal vectors that point outward from a solid, or upward from the ground. Stored as float64
        with length 1. A zero vector means that a point has no normal. If all vectors are zero,
        ``normals`` becomes None. `segment` estimates missing normals from twelve neighbors, and
        orients them outward (to the convex side of an open surface), or to the ``viewpoints``.
    colors : array_like, shape (N, 3) or (N, 4), optional
        Red, green and blue, as floats from 0 to 1 or as unsigned integers over the full range of
        their type (uint8: 0 to 255). Stored as float32 from 0 to 1. A fourth column is ignored.
    axes : array_like, shape (N, 3), optional
        Normals of unknown sign, such as the shortest axes of Gaussian splats. A zero vector means
        that a point has no axis. If ``normals`` is None, `segment` estimates normals from the axes
        of neighbors, or from their positions where no neighbor has an axis.
    viewpoints : array_like, shape (3,) or (N, 3), optional
        Position of the sensor, for all points or for each point. Estimated normals face the sensor;
        given normals are unchanged. `read_cloud` takes viewpoints from the poses of scans in E57.
        For terrain, use a position far above.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Minimum and maximum corner of the bounding box of all points.

    Raises
    ------
    MeshError
        If an array is not valid; the message names the first invalid entry.

    Examples
    --------
    >>> cloud = PointCloud([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> cloud.n_points, cloud.bounds.tolist()
    (4, [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    """

    points: Floats
    normals: Floats | None = None
    colors: Singles | None = None
    axes: Floats | None = None
    viewpoints: Floats | None = None
    bounds: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points, bounds = checked_points(self.points)
        freeze(self, points=points, bounds=bounds)
        if self.normals is not None:
            normals = checked_normals(self.normals, len(points))
            if normals.any():
                freeze(self, normals=normals)
            else:
                object.__setattr__(self, "normals", None)
        if self.colors is not None:
            freeze(self, colors=checked_colors(self.colors, len(points)))
        if self.axes is not None:
            freeze(self, axes=checked_normals(self.axes, len(points), name="axes"))
        if self.viewpoints is not None:
            freeze(self, viewpoints=checked_viewpoints(self.viewpoints, len(points)))

    @property
    def n_cells(self) -> int:
        """Number of cells. The cells of a cloud are its points."""
        return len(self.points)

    @property
    def n_points(self) -> int:
        """Number of points, N."""
        return len(self.points)

    def taken(self, chosen: npt.NDArray[np.integer[Any]]) -> PointCloud:
        """Return a cloud of the points with the indices `chosen`, with all their values."""
        arrays = [self.points, self.normals, self.colors, self.axes, self.viewpoints]
        return PointCloud(
            *(rows if rows is None or rows.ndim == 1 else rows[chosen] for rows in arrays)  # type: ignore[arg-type]
        )

    def __repr__(self) -> str:
        names = ("normals", "colors", "axes", "viewpoints")
        also = [name for name in names if getattr(self, name) is not None]
        if self.colors is not None and not self.colors.any():  # files store black for no color
            also.remove("colors")
        return f"PointCloud({', '.join([counted(self.n_points, 'point'), *also])})"
