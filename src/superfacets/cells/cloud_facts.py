"""Facts about a point cloud that decide what can be done with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _core
from .._validate import checked_threads
from ..adapters.clouds import CloudLike, as_cloud
from .point_graph import find_point_graph

__all__ = ["CloudInfo", "cloud_info"]


@dataclass(frozen=True)
class CloudInfo:
    """Counts and sizes of a point cloud."""

    n_points: int
    """Points."""
    n_positions: int
    """Different positions of points."""
    n_components: int
    """Sets of points that are connected by arcs between near ones; see `build_point_graph`."""
    n_isolated: int
    """Points that no arc leads to."""
    has_normals: bool
    """Whether the cloud has normals."""
    has_colors: bool
    """Whether the cloud has colors."""
    spacing: float
    """Median over the points of the square root of the area around each."""
    area: float
    """Sum of the areas around the points, in the squared unit of the points."""
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    """Low and high corner of the bounding box."""
    diagonal: float
    """Length of the diagonal of that box."""


def cloud_info(cloud: CloudLike) -> CloudInfo:
    """Return counts and sizes of a point cloud.

    Parameters
    ----------
    cloud : PointCloud or cloud-like
        As for `segment`.

    Examples
    --------
    >>> info = cloud_info([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 0, 0]])
    >>> info.n_points, info.n_positions, info.n_components, info.n_isolated
    (4, 3, 1, 0)
    """
    checked = as_cloud(cloud)
    threads = checked_threads(None)
    graph = find_point_graph(checked, threads)
    same_label = np.zeros(checked.n_points, np.int32)
    _, n_components = _core.find_components(graph.offsets, graph.neighbors, same_label)
    low, high = checked.bounds.tolist()
    return CloudInfo(
        n_points=checked.n_points,
        n_positions=len(np.unique(_core.weld_vertices(checked.points, threads))),
        n_components=n_components,
        n_isolated=int(np.count_nonzero(np.diff(graph.offsets) == 0)),
        has_normals=checked.normals is not None,
        has_colors=checked.colors is not None,
        spacing=float(np.sqrt(np.median(graph.measures))),
        area=_core.sum_of(graph.measures, threads),
        bounds=(tuple(low), tuple(high)),
        diagonal=graph.diagonal,
    )
