"""Store labels and colors in meshes and point clouds of other libraries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from ..base.checks import checked_choice, checked_classes
from ..base.lazy import load
from ..base.types import Array, Bytes, Ints
from .base import Cells
from .convert import as_cells, cell_blocks, has_blocks
from .point_cloud import PointCloud

DEFAULT_NAME = "superfacets"
"""Default name of the array of labels in objects of other libraries."""

Location = Literal["cells", "points"]


def attach_labels(
    mesh: Any, labels: npt.ArrayLike, *, name: str = DEFAULT_NAME, location: Location = "cells",
    colors: bool | npt.ArrayLike = False,
) -> None:  # fmt: skip
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
    _put(mesh, _Results(name, checked, shades, on_points=of_vertices or are_points))


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


@dataclass(frozen=True)
class _Results:
    name: str  # name under which the labels are stored
    labels: Ints  # (n,) label of each cell or point, or -1
    colors: Bytes | None  # (n, 3) red, green and blue
    on_points: bool  # whether labels belong to vertices or points

    @property
    def arrays(self) -> dict[str, tuple[Array, Any]]:
        """Arrays to store, each with the value that marks cells without a label, keyed by name."""
        named: dict[str, tuple[Array, Any]] = {self.name: (self.labels, -1)}
        if self.colors is not None:
            named[f"{self.name}_colors"] = (self.colors, load("superfacets_show.colors:NO_COLOR"))
        return named


def _put(target: Any, results: _Results) -> None:
    if has_blocks(target):
        return _put_on_meshio(target, results)
    for names, put in _LIBRARIES:
        if _has(target, names):
            return put(target, results)
    raise TypeError(
        "labels can be stored in meshes and point clouds of trimesh, PyVista, meshio and Open3D,"
        f" got {type(target).__name__}: convert legacy classes of Open3D with"
        " open3d.t.geometry.TriangleMesh.from_legacy"
    )


def _put_on_pyvista(target: Any, results: _Results) -> None:
    for name, (values, nothing) in results.arrays.items():
        if results.on_points:
            target.point_data[name] = values
            continue
        # vertices and lines of a PolyData come first
        first = int(target.n_verts + target.n_lines) if hasattr(target, "verts") else 0
        whole = _filled(target.n_cells, values, nothing)
        whole[first : first + len(values)] = values
        target.cell_data[name] = whole


def _filled(n_rows: int, values: Array, nothing: Any) -> Array:
    """Return `n_rows` rows filled with `nothing`, in the dtype and the row shape of `values`."""
    whole = np.empty((n_rows, *values.shape[1:]), dtype=values.dtype)
    whole[:] = nothing
    return whole


def _put_on_meshio(target: Any, results: _Results) -> None:
    chosen = cell_blocks(target)
    for name, (values, nothing) in results.arrays.items():
        if results.on_points:
            target.point_data[name] = values
            continue
        stored = [_filled(len(block.data), values, nothing) for block in target.cells]
        done = 0
        for i in chosen:
            stored[i] = values[done : done + len(stored[i])]
            done += len(stored[i])
        target.cell_data[name] = stored


def _put_on_open3d(target: Any, results: _Results) -> None:
    attributes = getattr(target, "point", None)
    if attributes is None:
        attributes = target.vertex if results.on_points else target.triangle
    old = next(iter(dict(attributes.items()).values()))

    def tensor(array: Array) -> Any:
        return type(old)(np.ascontiguousarray(array), device=old.device)

    attributes[results.name] = tensor(results.labels)
    if results.colors is not None:
        attributes["colors"] = tensor(results.colors.astype(np.float32) / 255)


def _put_on_trimesh(target: Any, results: _Results) -> None:
    owner = target.vertex_attributes if results.on_points else target.face_attributes
    owner[results.name] = results.labels
    if results.colors is None:
        return
    if not hasattr(target.visual, "face_colors"):  # `visual` contains a texture, not colors
        target.visual = target.visual.to_color()
    if results.on_points:
        target.visual.vertex_colors = results.colors
    else:
        target.visual.face_colors = results.colors


def _put_on_trimesh_cloud(target: Any, results: _Results) -> None:
    target.metadata[results.name] = results.labels
    if results.colors is not None:
        target.colors = results.colors


def _has(target: Any, names: tuple[str, ...]) -> bool:
    try:
        attrgetter(*names)(target)
    except AttributeError:
        return False
    return True


_LIBRARIES: tuple[tuple[tuple[str, ...], Callable[[Any, _Results], None]], ...] = (
    (("cell_data", "n_cells"), _put_on_pyvista), (("vertex", "triangle"), _put_on_open3d),
    (("point.positions",), _put_on_open3d),
    (("face_attributes", "vertex_attributes"), _put_on_trimesh),
    (("vertices", "metadata", "colors"), _put_on_trimesh_cloud),
)  # fmt: skip
"""Pairs: the attributes by which a class of another library is recognized, and the function that
stores results in objects of this class. The first pair with matching attributes is used."""
