"""Store labels and colors in meshes and point clouds of other libraries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from ..base.lazy import load
from ..base.types import Array, Bytes, Ints
from .blocks import cell_blocks, has_blocks


@dataclass(frozen=True)
class Results:
    """Labels, and optionally colors, to store in a mesh or a point cloud of another library."""

    name: str  # name under which the labels are stored
    labels: Ints  # (n,) label of each cell or point, or -1 if the cell or point has no label
    colors: Bytes | None  # (n, 3) red, green and blue from 0 to 255; None to store no colors
    on_points: bool  # True if labels belong to vertices or points, False for faces or tetrahedra

    @property
    def arrays(self) -> dict[str, tuple[Array, Any]]:
        """Arrays to store, each with the value that marks cells without a label, keyed by name."""
        named: dict[str, tuple[Array, Any]] = {self.name: (self.labels, -1)}
        if self.colors is not None:
            named[f"{self.name}_colors"] = (self.colors, load("superfacets_show.colors:NO_COLOR"))
        return named


def put_results(target: Any, results: Results) -> None:
    """Store results in `target`, an object of trimesh, PyVista, Open3D or meshio.

    The lengths of the arrays are not checked. Raises a TypeError for objects of other classes.
    """
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


def _put_on_pyvista(target: Any, results: Results) -> None:
    for name, (values, nothing) in results.arrays.items():
        if results.on_points:
            target.point_data[name] = values
            continue
        first = first_face(target)
        whole = _filled(target.n_cells, values, nothing)
        whole[first : first + len(values)] = values
        target.cell_data[name] = whole


def first_face(target: Any) -> int:
    """Return the index of the first face among the cells of a PyVista dataset.

    In a ``PolyData``, vertices and lines come before the faces. In other datasets, the result is 0.
    """
    return int(target.n_verts + target.n_lines) if hasattr(target, "verts") else 0


def _filled(n_rows: int, values: Array, nothing: Any) -> Array:
    """Return `n_rows` rows filled with `nothing`, in the dtype and the row shape of `values`."""
    whole = np.empty((n_rows, *values.shape[1:]), dtype=values.dtype)
    whole[:] = nothing
    return whole


def _put_on_meshio(target: Any, results: Results) -> None:
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


def _put_on_open3d(target: Any, results: Results) -> None:
    """Store labels and colors as tensors with the class and the device of the existing tensors."""
    attributes = getattr(target, "point", None)
    if attributes is None:
        attributes = target.vertex if results.on_points else target.triangle
    old = next(iter(dict(attributes.items()).values()))

    def tensor(array: Array) -> Any:
        return type(old)(np.ascontiguousarray(array), device=old.device)

    attributes[results.name] = tensor(results.labels)
    if results.colors is not None:
        attributes["colors"] = tensor(results.colors.astype(np.float32) / 255)


def _put_on_trimesh(target: Any, results: Results) -> None:
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


def _put_on_trimesh_cloud(target: Any, results: Results) -> None:
    """Store labels in the metadata, because points of a trimesh cloud can have only colors."""
    target.metadata[results.name] = results.labels
    if results.colors is not None:
        target.colors = results.colors


def _has(target: Any, names: tuple[str, ...]) -> bool:
    try:
        attrgetter(*names)(target)
    except AttributeError:
        return False
    return True


_LIBRARIES: tuple[tuple[tuple[str, ...], Callable[[Any, Results], None]], ...] = (
    (("cell_data", "n_cells"), _put_on_pyvista),
    (("vertex", "triangle"), _put_on_open3d),
    (("point.positions",), _put_on_open3d),
    (("face_attributes", "vertex_attributes"), _put_on_trimesh),
    (("vertices", "metadata", "colors"), _put_on_trimesh_cloud),
)
"""Pairs: the attributes by which a class of another library is recognized, and the function that
stores results in objects of this class. The first pair with matching attributes is used."""
