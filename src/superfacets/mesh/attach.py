"""Store labels and colors in meshes and point clouds of other libraries."""

from __future__ import annotations

from typing import Any, Literal, get_args

import numpy.typing as npt

from ..base.checks import checked_choice, checked_classes
from ..base.lazy import load
from ..base.types import Bytes, Ints
from .base import Cells
from .convert import as_cells
from .point_cloud import PointCloud
from .results import Results, put_results

DEFAULT_NAME = "superfacets"
"""Default name of the array of labels in objects of other libraries."""

Location = Literal["cells", "points"]


def attach_labels(
    mesh: Any,
    labels: npt.ArrayLike,
    *,
    name: str = DEFAULT_NAME,
    location: Location = "cells",
    colors: bool | npt.ArrayLike = False,
) -> None:
    """Store labels in a mesh or point cloud of another library, in place.

    Labels are stored as int32 under the name `name`. Labels and colors are stored in:

    - trimesh: ``face_attributes`` and ``visual.face_colors``; for vertices, ``vertex_attributes``
      and ``visual.vertex_colors``; for a ``PointCloud``, ``metadata`` and ``colors``.
    - PyVista and meshio: ``cell_data`` or ``point_data``, with colors under ``f"{name}_colors"``.
    - Open3D (``open3d.t.geometry``): attributes of ``triangle``, ``vertex`` or ``point``, with
      colors from 0 to 1 under ``"colors"``. Legacy classes of Open3D cannot store labels.

    An existing array with this name is replaced. Cells that are not segmented, such as lines of a
    ``PolyData`` or triangles in a meshio mesh of tetrahedra, get the label -1 and a gray color.

    Parameters
    ----------
    mesh : mesh or point cloud of trimesh, PyVista, Open3D or meshio
        An object that `segment` accepts. These libraries are not imported.
    labels : Segmentation, or array_like of integers, shape (N,)
        Label of each face, tetrahedron or point, or of each vertex (see `location`), in the order
        of the mesh; -1 for no label.
    name : str, default "superfacets"
        Name of the array of labels.
    location : {"cells", "points"}
        Whether labels belong to the cells that `segment` labels, or to the vertices of a mesh. For
        a point cloud, both values mean the points.
    colors : bool or array_like of uint8, shape (N, 3), default False
        Colors to store with the labels. If True, colors of cells are computed with `face_colors`.
        If False, no colors are stored.

    Raises
    ------
    MeshError
        If the mesh is not a valid mesh.
    ValueError
        If labels or colors do not have one row per cell or point, or if `colors` is True for the
        vertices of a mesh.
    TypeError
        If the mesh cannot store labels, if labels are not integers, or if another argument has
        the wrong type.

    Examples
    --------
    >>> import superfacets, trimesh
    >>> box = trimesh.creation.box()
    >>> superfacets.attach_labels(box, superfacets.segment(box, 2, weights="superfacets"))
    >>> box.face_attributes["superfacets"].shape
    (12,)
    """
    if not isinstance(name, str) or not name:
        raise TypeError(f"name must be a non-empty string, got {name!r}")
    checked_choice(location, "location", get_args(Location))
    cells: Any = as_cells(mesh)
    are_points = isinstance(cells, PointCloud)
    n_rows, of_vertices = cells.n_cells, False
    if location == "points" and not are_points:
        n_rows, of_vertices = cells.n_vertices, True
    checked = checked_classes(labels, n_rows, "labels")
    shades = _checked_colors(cells, checked, colors, of_vertices)
    put_results(mesh, Results(name, checked, shades, on_points=of_vertices or are_points))


def _checked_colors(
    cells: Cells, labels: Ints, colors: bool | npt.ArrayLike, of_vertices: bool
) -> Bytes | None:
    """Return the array `colors`, colors of regions if `colors` is True, or None if it is False."""
    if colors is False:
        return None
    if colors is not True:
        given: Bytes = load("superfacets_show.scene:checked_colors")(colors, len(labels))
        return given
    if of_vertices:
        raise ValueError("colors=True needs location='cells': pass colors of vertices as an array")
    shades: Bytes = load("superfacets_show.colors:face_colors")(cells, labels)
    shades[labels < 0] = load("superfacets_show.colors:NO_COLOR")
    return shades
