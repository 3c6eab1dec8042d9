"""Stage 0: point clouds, as checked arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._types import Floats, Singles
from .._validate import (
    checked_colors,
    checked_normals,
    checked_points,
    checked_viewpoints,
    freeze,
    restored,
)
from .cells import Cells


@dataclass(frozen=True, eq=False)
class PointCloud(Cells):
    """A point cloud: checked and read-only.

    Points are kept as they are, in their order; several may be at the same position.

    Parameters
    ----------
    points : array_like, shape (N, 3)
        Finite positions, kept as read-only float64. N >= 1, but `segment` needs at least two
        distinct positions. A contiguous float64 array is not copied (unless it is a memory map): do
        not change it while the cloud is in use.
    normals : array_like, shape (N, 3), optional
        Vectors that point away from the surface, all to the same side of it: on the outside of a
        solid, upwards from the ground. Kept as float64 with length 1; a zero vector means that a
        point has no normal. If normals are not given, `segment` estimates them; see
        `estimate_normals`.
    colors : array_like, shape (N, 3) or (N, 4), optional
        Red, green and blue, from 0 to 1 if they are floats, or of the full range of an unsigned
        integer type (uint8: 0 to 255). Kept as float32 from 0 to 1, without a fourth column.
    axes : array_like, shape (N, 3), optional
        Normals of unknown sign, such as the shortest axes of Gaussian splats: vectors at right
        angles to the surface, on either side of it; zero where there is none. If there are no
        normals, they are estimated from the axes of neighbors, or from positions where no neighbor
        has an axis.
    viewpoints : array_like, shape (3,) or (N, 3), optional
        Place from which all points were seen, or one for each point. Estimated normals then face
        it; normals that are given stay as they are. `read_cloud` takes them from the poses of scans
        in E57. For terrain, a place far above.

    Attributes
    ----------
    bounds : ndarray of float64, shape (2, 3)
        Low and high corner of the bounding box.

    Raises
    ------
    MeshError
        If a shape, a type or a value is wrong (the first offender is named).

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
            else:  # all zero: there are none
                object.__setattr__(self, "normals", None)
        if self.colors is not None:
            freeze(self, colors=checked_colors(self.colors, len(points)))
        if self.axes is not None:
            freeze(self, axes=checked_normals(self.axes, len(points), name="axes"))
        if self.viewpoints is not None:
            freeze(self, viewpoints=checked_viewpoints(self.viewpoints, len(points)))

    def __setstate__(self, state: Any) -> None:
        """Restore a copy or a pickle with the checks of a new object."""
        PointCloud.__init__(
            self, *restored(state, ("points", "normals", "colors", "axes", "viewpoints"))
        )

    @property
    def n_cells(self) -> int:
        """Number of cells, which are the points."""
        return len(self.points)

    @property
    def n_points(self) -> int:
        """Number of points, N."""
        return len(self.points)

    def taken(self, chosen: npt.NDArray[np.integer[Any]]) -> PointCloud:
        """Return the chosen points as a cloud, with all that the cloud has of them."""
        views = self.viewpoints
        return PointCloud(
            self.points[chosen],
            None if self.normals is None else self.normals[chosen],
            None if self.colors is None else self.colors[chosen],
            None if self.axes is None else self.axes[chosen],
            views if views is None or views.ndim == 1 else views[chosen],
        )

    def __repr__(self) -> str:
        also = [
            name
            for name in ("normals", "colors", "axes", "viewpoints")
            if getattr(self, name) is not None
        ]
        return f"PointCloud({', '.join([f'{self.n_points} points', *also])})"
