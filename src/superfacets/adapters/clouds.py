"""Stage 0: a point cloud from anything that looks like one."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from ..mesh.point_cloud import PointCloud
from .blocks import cell_blocks, has_blocks


class _Points(Protocol):
    """A point cloud of Open3D, legacy or tensor."""

    @property
    def point(self) -> Any: ...


Rows: TypeAlias = npt.NDArray[np.floating[Any] | np.integer[Any]] | Sequence[Sequence[float]]
"""Points, not `ArrayLike`, which would accept a number."""

CloudLike: TypeAlias = PointCloud | str | os.PathLike[str] | Rows | _Points
"""What functions accept as a point cloud: a `PointCloud`, a path, an (N, 3) array, or a cloud of
trimesh, PyVista, Open3D or meshio."""


def as_cloud(source: CloudLike) -> PointCloud:
    """Return `source` as a `PointCloud`.

    Parameters
    ----------
    source : PointCloud, (N, 3) array, path, or cloud of another library
        A path is read by `read_cloud`. Clouds of trimesh (``PointCloud``), PyVista (``PolyData``
        without faces), Open3D (legacy and tensor) and meshio (without faces) are recognized
        by their attributes, of which points, normals and colors are taken; none of these is
        imported.

    Raises
    ------
    MeshError
        If the cloud is not valid.
    TypeError
        If `source` does not look like a cloud.
    """
    if isinstance(source, PointCloud):
        return source
    if isinstance(source, (str, os.PathLike)):
        from ..io.readers.read import read_cloud

        return read_cloud(source)
    if isinstance(source, (np.ndarray, list, tuple)):
        return PointCloud(source)  # type: ignore[arg-type]  # checked there
    if not is_foreign_cloud(source):
        raise TypeError(f"expected a point cloud, got {type(source).__name__}")
    return PointCloud(*_arrays_of_foreign_cloud(source))


def is_foreign_cloud(source: Any) -> bool:
    """Whether an object has points, and nothing that could be faces."""
    if has_blocks(source):
        return not cell_blocks(source)
    if hasattr(source, "n_points") and hasattr(source, "n_cells"):  # PyVista
        has_faces = np.size(getattr(source, "faces", 0)) or getattr(source, "n_strips", 0)
        return hasattr(source, "verts") and source.n_points > 0 and not has_faces
    if hasattr(source, "point") and not hasattr(source, "triangle"):  # Open3D, tensor
        return "positions" in source.point
    if hasattr(source, "points"):  # Open3D, legacy
        return not hasattr(source, "faces") and not hasattr(source, "triangles")
    has_faces = hasattr(source, "faces") or hasattr(source, "triangles")  # trimesh
    return hasattr(source, "vertices") and not has_faces


def _arrays_of_foreign_cloud(source: Any) -> tuple[Any, Any, Any]:
    """Points, normals and colors of a cloud of another library; None where it has none."""
    if has_blocks(source):
        return source.points, None, None
    if hasattr(source, "n_cells"):
        data = source.point_data
        return source.points, data.get("Normals"), data.get("RGB", data.get("RGBA"))
    if hasattr(source, "point"):
        data = {name: tensor.cpu().numpy() for name, tensor in source.point.items()}
        return data["positions"], data.get("normals"), data.get("colors")
    if hasattr(source, "points"):
        normals = np.asarray(source.normals) if source.has_normals() else None
        colors = np.asarray(source.colors) if source.has_colors() else None
        return np.asarray(source.points), normals, colors
    colors = np.asarray(getattr(source, "colors", ()))
    return source.vertices, None, colors if colors.size else None
