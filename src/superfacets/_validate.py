"""All checks and conversions of arguments.

The core checks nothing: arrays that leave this module have the dtype and layout that the core
expects. Indices are copied before they are checked, so that no other thread and no memory-mapped
file can change them afterwards. Floats are not copied.
"""

from __future__ import annotations

import functools
import math
import mmap
import numbers
import operator
import os
import reprlib
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from . import _core
from ._types import ArcLists, Array, Bools, Floats, Ints, Longs, Singles
from .errors import MeshError

MAX_CELLS = 2**31 - 1
"""Largest number of cells, labels or vertices: their indices are int32 in the core."""

EXTENT_RANGE = (1e-15, 1e15)
"""Range of extents for which labels do not depend on the unit of length. The determinant of second
moments of tetrahedra, a product of fifteen lengths, is then a normal number down to 1e-5 of the
extent."""

VALUE_RANGE = (1e-150, 1e150)
"""Range of the largest area or weight. Sums and products with positions are then normal numbers."""

MAX_SIDE = 1 << 16
"""Largest width and height of an image, in pixels."""

MAX_ROTATION_ERROR = 1e-3
"""Largest error in the scalar products of the axes of a pose: poses with four digits are accepted,
poses with a scale are not."""

MAX_THREADS_PER_CORE = 4
"""Upper bound of threads per usable core. On two cores, 1,024 threads take four times as long as
two threads, because they wait for each other."""


def exact_array(array: Any, dtype: Any) -> Array:
    """Return a contiguous, aligned array of this dtype; the numbers are copied only if needed."""
    return np.require(array, dtype, ["C_CONTIGUOUS", "ALIGNED", "ENSUREARRAY"])


def exact_doubles(array: Array) -> Floats:
    """Return `exact_array` as float64; numbers that are too large become infinite.

    Memory-mapped arrays are copied: if the file shrank, reading the map would kill the process.
    """
    # Later checks find signaling NaNs, and long doubles that do not fit into float64.
    with np.errstate(over="ignore", invalid="ignore"):
        doubles: Floats = exact_array(array, np.float64)
    owner: Any = doubles
    while isinstance(owner, np.ndarray):
        owner = owner.base
    is_mapped = isinstance(owner.obj if isinstance(owner, memoryview) else owner, mmap.mmap)
    return doubles.copy() if is_mapped else doubles


def owned(array: Array, dtype: Any) -> Array:
    """A copy of an array, so that the caller cannot change it after the check."""
    return np.array(array, dtype=dtype, order="C")


def owned_indices(array: Array) -> Ints:
    """A copy of integers as int32; integers that do not fit become -1."""
    # Numbers of 2**63 or more become negative here, so they become -1, too.
    given = exact_array(array, np.int32 if array.dtype == np.int32 else np.int64)
    narrow = _core.narrow_indices(given.ravel(), checked_threads(None))
    return narrow.reshape(array.shape)


def refuse_mask(value: Any, name: str, error: type[ValueError] = ValueError) -> None:
    """Raise an error if entries are masked: numpy would use the values under the mask."""
    if "numpy.ma" not in sys.modules:  # masked arrays exist only after this slow import
        return
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise error(f"{name} has masked entries: fill these entries or leave them out")


def restored(state: Any, names: Sequence[str]) -> list[Any]:
    """Return fields of the state of a copy or a pickle; the caller checks their values."""
    if not isinstance(state, dict) or not set(names) <= state.keys():
        raise ValueError(f"a damaged copy: it needs the fields {', '.join(names)}")
    return [state[name] for name in names]


def freeze(instance: object, **arrays: Array) -> None:
    """Set fields of a frozen dataclass to read-only views; the caller's arrays stay writable."""
    for name, array in arrays.items():
        view = array.view()
        view.flags.writeable = False
        object.__setattr__(instance, name, view)


def checked_mesh(
    vertices: Any, faces: Any, *, are_new: bool = False
) -> tuple[Floats, Ints, Floats]:
    """Vertices, faces, and the bounding box (2, 3) of the used vertices; a MeshError if wrong.

    With `are_new`, no one else refers to the arrays, and they are not copied.
    """
    return _checked_simplices(vertices, faces, "faces", 3, are_new)


def checked_polygons(
    vertices: Any, offsets: Any, indices: Any, *, are_new: bool = False
) -> tuple[Floats, Longs, Ints, Floats]:
    """Vertices, offsets, corners and the bounding box as `checked_mesh`; a MeshError if wrong."""
    points = _point_array(vertices)
    given = _row_of_integers(indices, "indices")
    corners = _int32_corners(given, are_new)
    starts = owned(_row_of_integers(offsets, "offsets"), np.int64)
    _check_offsets(starts, len(corners))
    place, box = _checked_corners(points, corners)
    if place is not None:
        face = int(np.searchsorted(starts, place, side="right")) - 1
        raise_index_error(face, given[place], len(points))
    return points, starts, corners, box


def checked_tets(vertices: Any, tets: Any) -> tuple[Floats, Ints, Floats]:
    """Vertices, tetrahedra, and the bounding box as `checked_mesh`; a MeshError if wrong."""
    return _checked_simplices(vertices, tets, "tets", 4, False)


def _checked_simplices(
    vertices: Any, cells: Any, name: str, n_corners: int, are_new: bool
) -> tuple[Floats, Ints, Floats]:
    points = _point_array(vertices)
    given = _corner_rows(cells, name, n_corners)
    corners = _int32_corners(given, are_new)
    place, box = _checked_corners(points, corners.ravel())
    if place is not None:
        raise_index_error(place // n_corners, given.ravel()[place], len(points), name)
    return points, corners, box


def _int32_corners(given: Array, are_new: bool) -> Ints:
    is_ours = are_new and given.dtype == np.int32
    return exact_array(given, np.int32) if is_ours else owned_indices(given)


def checked_mask(mask: Any, n_cells: int, name: str) -> Bools:
    """Return one bool per cell; without a mask, all are True."""
    if mask is None:
        return np.ones(n_cells, dtype=bool)
    array = np.asarray(mask)
    if array.dtype != bool:
        raise TypeError(f"{name} must be bools, got {array.dtype}")
    if array.shape != (n_cells,):
        raise ValueError(f"{name} must have shape ({n_cells},), got {array.shape}")
    return array


def polygon_arrays(faces: Any) -> tuple[Array, Array]:
    """Offsets and corners of faces, which are rows of an array or lists of vertices."""
    array = faces if isinstance(faces, np.ndarray) else None
    if array is None or array.dtype == object:
        rows = [_row_of_integers(face, "a face") for face in faces]
        lengths = np.array([len(row) for row in rows], dtype=np.int64)
        filled = [row for row in rows if len(row)]  # an empty list would be an array of floats
        corners = np.concatenate(filled) if filled else np.empty(0, dtype=np.int64)
        return np.concatenate([[0], np.cumsum(lengths)]), corners
    if array.ndim != 2:
        raise MeshError(
            f"faces must be lists of vertices or an array of shape (F, n), got {array.shape}"
        )
    refuse_mask(array, "faces", MeshError)
    return np.arange(len(array) + 1) * array.shape[1], array.ravel()


def _row_of_integers(value: Any, name: str) -> Array:
    array = _numeric_array(value, name)
    if array.ndim != 1:
        raise MeshError(f"{name} must be one-dimensional, got shape {array.shape}")
    if array.size and array.dtype.kind not in "iu":
        raise MeshError(f"{name} must be integers, got {array.dtype}")
    return array


def _check_offsets(offsets: Longs, n_corners: int) -> None:
    """Raise a MeshError unless offsets split the corners into faces of at least three corners."""
    if len(offsets) < 2:
        raise MeshError("the mesh has no faces")
    _check_size(len(offsets) - 1, "the mesh", "faces")
    if offsets[0] != 0 or offsets[-1] != n_corners:
        raise MeshError(
            f"offsets must start at 0 and end at the number of corners, {n_corners},"
            f" got {offsets[0]} and {offsets[-1]}"
        )
    sizes = np.diff(offsets)
    if sizes.min() < 3 or sizes.max() > MAX_CELLS:
        face = int(np.argmax((sizes < 3) | (sizes > MAX_CELLS)))
        raise MeshError(f"faces[{face}] has {sizes[face]} corners: a face needs at least 3")


def _checked_corners(points: Floats, corners: Ints) -> tuple[int | None, Floats]:
    """Index of the first invalid corner, or None, and the bounding box of the used vertices."""
    is_finite, is_in_range, *bounds = _core.check_mesh(points, corners, checked_threads(None))
    if not is_finite:
        _raise_not_finite(points, "vertices")
    box = np.array(bounds)
    if not is_in_range:
        return int(np.argmax((corners < 0) | (corners >= len(points)))), box
    check_extent(*box)
    return None, box


def _point_array(vertices: Any) -> Floats:
    """Vertex positions as a contiguous (V, 3) float64 array."""
    array = _rows(vertices, "vertices", count="V")
    _check_size(len(array), "the mesh", "vertices")
    return exact_doubles(array)


def _check_size(n: int, whole: str, things: str, most: int = MAX_CELLS) -> None:
    if n > most:
        raise MeshError(f"{whole} has {n} {things}; at most {most} are supported")


def _corner_rows(value: Any, name: str, n_corners: int) -> Array:
    """Triangles or tetrahedra, one row of integers each, in their original dtype."""
    array = _numeric_array(value, name)
    noun, count = ("faces", "F") if n_corners == 3 else ("tetrahedra", "N")
    if array.size == 0:
        raise MeshError(f"the mesh has no {noun}")
    if n_corners == 3 and array.ndim == 2 and array.shape[1] > 3:
        raise MeshError(
            f"faces have {array.shape[1]} corners, but a Mesh has triangles: use a PolygonMesh"
        )
    if array.ndim != 2 or array.shape[1] != n_corners:
        raise MeshError(f"{name} must have shape ({count}, {n_corners}), got {array.shape}")
    if array.dtype.kind not in "iu":
        raise MeshError(f"{name} must be integers, got {array.dtype}")
    _check_size(len(array), "the mesh", noun, MAX_CELLS if n_corners == 3 else MAX_CELLS // 4)
    return array


def raise_index_error(cell: int, vertex: int, n_vertices: int, name: str = "faces") -> None:
    """Raise a MeshError: a corner of this cell is not a vertex of the mesh."""
    raise MeshError(
        f"{name}[{cell}] refers to vertex {vertex} but the mesh has {n_vertices} vertices"
    )


def refuse_first(
    is_wrong: Bools, name: str, values: Array, must: str, error: type[ValueError] = ValueError
) -> None:
    """Raise an error with the first wrong value and what it must be."""
    if is_wrong.any():
        place = int(np.argmax(is_wrong))
        raise error(f"{name}[{place}] is {values[place]}; {must}")


def check_extent(low: Floats, high: Floats, what: str = "faces lie", whole: str = "mesh") -> None:
    """Raise a MeshError if a bounding box has no size, or is too small or too large."""
    if np.array_equal(low, high):
        raise MeshError(f"all {what} at one point: the bounding box has no size")
    with np.errstate(over="ignore"):
        diagonal = float(np.max(high - low))
    if not EXTENT_RANGE[0] <= diagonal <= EXTENT_RANGE[1]:
        raise MeshError(
            f"the bounding box is {diagonal:.3g} across: rescale the {whole} to between"
            f" {EXTENT_RANGE[0]:g} and {EXTENT_RANGE[1]:g}"
        )


def is_extent_valid(bounds: Floats) -> Bools:
    """Whether the size of each box, (K, 2, 3), is allowed for a mesh: (K,)."""
    with np.errstate(over="ignore"):
        sizes = (bounds[:, 1] - bounds[:, 0]).max(axis=1)
    return np.asarray((sizes >= EXTENT_RANGE[0]) & (sizes <= EXTENT_RANGE[1]))


def _numeric_array(value: Any, name: str) -> Array:
    refuse_mask(value, name, MeshError)
    try:
        array = np.asarray(value)
    except ValueError as error:  # the nested lists are ragged
        raise MeshError(f"{name} must be a rectangular array: {error}") from None
    if array.dtype.kind not in "fiu":
        raise MeshError(f"{name} must be numbers, got {array.dtype}")
    return array


def checked_points(points: Any) -> tuple[Floats, Floats]:
    """Points (N, 3) as float64 and their bounding box (2, 3); a MeshError if they are wrong."""
    given = _rows(points, "points")
    if not len(given):
        raise MeshError("the cloud has no points")
    _check_size(len(given), "the cloud", "points")
    array = exact_doubles(given)
    # Separate columns take a tenth of the time of min(axis=0).
    box = np.array([[axis.min() for axis in array.T], [axis.max() for axis in array.T]])
    if not np.isfinite(box).all():
        _raise_not_finite(array, "points")
    if not np.array_equal(*box):  # stages that need different points call `check_spread`
        check_spread(box)
    return array, box


def check_spread(bounds: Floats) -> None:
    """Raise a MeshError if all points of a cloud are at the same position."""
    check_extent(bounds[0], bounds[1], "points lie", "cloud")


def checked_queries(points: Any) -> Floats:
    """Points (M, 3) as float64, M >= 0; a MeshError if they are wrong."""
    array = exact_doubles(_rows(points, "points"))
    if not np.isfinite(array).all():
        _raise_not_finite(array, "points")
    largest = float(np.abs(array).max(initial=0.0))
    if largest > VALUE_RANGE[1]:
        raise MeshError(
            f"the largest coordinate of points is {largest:.3g}: rescale the points to at most"
            f" {VALUE_RANGE[1]:g}"
        )
    return array


def checked_normals(normals: Any, n_points: int, first: int = 0, name: str = "normals") -> Floats:
    """One vector of length 1 or 0 per point, (N, 3) float64; a MeshError if they are wrong.

    Messages count the points from `first`.
    """
    array = owned(exact_doubles(_rows(normals, name, n_points)), np.float64)
    if not np.isfinite(array).all():
        _raise_not_finite(array, name, first)
    largest = np.abs(array).max(axis=1, initial=0.0, keepdims=True)  # avoids overflow of squares
    np.divide(array, largest, out=array, where=largest > 0)
    lengths = np.sqrt(np.einsum("ij,ij->i", array, array))[:, None]
    np.divide(array, lengths, out=array, where=lengths > 0)
    return array


def checked_viewpoints(viewpoints: Any, n_points: int) -> Floats:
    """One viewpoint (3,), or one per point (N, 3), float64; a MeshError if wrong."""
    array = _numeric_array(viewpoints, "viewpoints")
    if array.shape not in ((3,), (n_points, 3)):
        raise MeshError(f"viewpoints must have shape (3,) or ({n_points}, 3), got {array.shape}")
    places = owned(exact_doubles(array), np.float64)
    if not np.isfinite(places).all():
        _raise_not_finite(places.reshape(-1, 3), "viewpoints")
    return places


def checked_colors(colors: Any, n_points: int) -> Singles:
    """Red, green and blue of each point from 0 to 1, (N, 3) float32; a MeshError if wrong."""
    array = _numeric_array(colors, "colors")
    if array.ndim != 2 or array.shape[0] != n_points or array.shape[1] not in (3, 4):
        raise MeshError(f"colors must have shape ({n_points}, 3), got {array.shape}")
    if array.dtype.kind == "i":
        raise MeshError(f"colors must be floats or unsigned integers, got {array.dtype}")
    if array.dtype.kind == "u":
        shades = np.asarray(array[:, :3], np.float32)
        return np.asarray(shades / np.float32(np.iinfo(array.dtype).max), np.float32)
    shades = owned(array[:, :3], np.float32)
    is_wrong = ~((shades >= 0) & (shades <= 1)).all(axis=1)  # True if a shade is NaN
    if is_wrong.any():
        first = int(np.argmax(is_wrong))
        raise MeshError(f"colors[{first}] is not from 0 to 1: {shades[first].tolist()}")
    return shades


def _rows(value: Any, name: str, n_rows: int | None = None, *, count: str = "N") -> Array:
    """An array of numbers of shape (N, 3)."""
    array = _numeric_array(value, name)
    if array.ndim != 2 or array.shape[1] != 3 or n_rows not in (None, len(array)):
        count = count if n_rows is None else str(n_rows)
        raise MeshError(f"{name} must have shape ({count}, 3), got {array.shape}")
    return array


def _raise_not_finite(rows: Floats, name: str, first: int = 0) -> None:
    wrong = int(np.argmin(np.isfinite(rows).all(axis=1)))
    raise MeshError(f"{name}[{first + wrong}] is not finite: {rows[wrong].tolist()}")


def checked_bounds(bounds: Any, positions: Floats) -> Floats:
    """Low and high corner of a box, (2, 3) float64; by default the box of the positions."""
    if bounds is None:
        return np.array([positions.min(axis=0), positions.max(axis=0)])
    array = exact_doubles(_numeric_array(bounds, "bounds"))
    if array.shape != (2, 3) or not np.isfinite(array).all() or np.any(array[0] > array[1]):
        raise ValueError("bounds must be a low and a high corner, shape (2, 3), finite")
    return array


def checked_positions(positions: Any) -> Floats:
    """Cell positions as a contiguous (N, 3) float64 array, N >= 1."""
    array = exact_doubles(_numeric_array(positions, "positions"))
    if array.ndim != 2 or array.shape[1] != 3 or not 1 <= len(array) <= MAX_CELLS:
        raise ValueError(f"positions must have shape (N, 3) with N >= 1, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("positions must be finite")
    with np.errstate(over="ignore"):
        extent = float(np.ptp(array, axis=0).max())
    if extent and not EXTENT_RANGE[0] <= extent <= EXTENT_RANGE[1]:
        raise ValueError(
            f"the positions are {extent:.3g} across: rescale them to between"
            f" {EXTENT_RANGE[0]:g} and {EXTENT_RANGE[1]:g}"
        )
    return array


def checked_nonnegative_array(value: Any, n: int, name: str, per: str, n_threads: int) -> Floats:
    """A contiguous (n,) float64 array of finite numbers >= 0."""
    refuse_mask(value, name)
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must be numbers, got {array.dtype}")
    array = exact_doubles(array)
    if array.shape != (n,):
        raise ValueError(f"{name} must have one value per {per}, shape ({n},), got {array.shape}")
    is_valid, largest = _core.check_numbers(array, n_threads)
    if not is_valid:
        is_wrong = ~(np.isfinite(array) & (array >= 0))
        refuse_first(is_wrong, name, array, "it must be finite and not negative")
    if largest and not VALUE_RANGE[0] <= largest <= VALUE_RANGE[1]:
        raise ValueError(
            f"{name} are at most {largest:.3g}: rescale them to between"
            f" {VALUE_RANGE[0]:g} and {VALUE_RANGE[1]:g}"
        )
    return array


def checked_arcs(offsets: Any, neighbors: Any, n_cells: int) -> ArcLists:
    """Arcs in CSR form, as (N + 1,) int64 offsets and (M,) int32 neighbors."""
    starts = owned(_integer_array(offsets, "offsets"), np.int64)  # 2**63 becomes negative
    targets = owned_indices(_integer_array(neighbors, "neighbors"))
    if len(starts) != n_cells + 1:
        raise ValueError(f"offsets must have shape ({n_cells + 1},), got {starts.shape}")
    if starts[0] != 0 or starts[-1] != len(targets) or np.any(np.diff(starts) < 0):
        raise ValueError("offsets must increase from 0 to the number of arcs")
    if len(targets) and not 0 <= targets.min() <= targets.max() < n_cells:
        raise ValueError(f"neighbors must be cells, 0 to {n_cells - 1}")
    return starts, targets


def checked_angles(angles: Any, n_arcs: int) -> Floats:
    """One angle per arc, (M,) float64, from -pi to pi."""
    array = owned(_numeric_array(angles, "angles"), np.float64)
    if array.shape != (n_arcs,):
        raise ValueError(
            f"angles must have one value per arc, shape ({n_arcs},), got {array.shape}"
        )
    is_wrong = ~(np.abs(array) <= math.pi)  # True for NaN
    refuse_first(is_wrong, "angles", array, "it must be from -pi to pi")
    return array


def checked_sides(sides: Any, offsets: Longs) -> Ints:
    """One side >= 0 per arc, (M,) int32, in ascending order for each cell."""
    array = owned_indices(_integer_array(sides, "sides"))
    if len(array) != offsets[-1]:
        raise ValueError(f"sides must have shape ({offsets[-1]},), got {array.shape}")
    if array.min(initial=0) < 0:
        raise ValueError("sides must not be negative")
    falls = np.flatnonzero(np.diff(array) < 0) + 1
    if not np.isin(falls, offsets).all():
        raise ValueError("sides must rise for the arcs of each cell")
    return array


def checked_seeds(seeds: Any, n_cells: int, name: str = "centers") -> Ints:
    """Distinct cells as a (K,) int32 array, K >= 1."""
    given = _integer_array(seeds, name)
    array = owned_indices(given)
    if not len(array) >= 1:
        raise ValueError(f"{name} must hold at least one face")
    is_wrong = (array < 0) | (array >= n_cells)
    refuse_first(is_wrong, name, given, f"it must be 0 to {n_cells - 1}")
    values, counts = np.unique(array, return_counts=True)
    if len(values) < len(array):
        raise ValueError(f"{name} contains {values[np.argmax(counts > 1)]} more than once")
    return array


def checked_region_centers(centers: npt.ArrayLike, labels: Ints, n_regions: int) -> Ints:
    """One cell of each region, in the order of the labels, as (K,) int32."""
    cells = checked_seeds(centers, len(labels))
    if len(cells) != n_regions:
        raise ValueError(f"there are {len(cells)} centers for {n_regions} regions")
    is_wrong = labels[cells] != np.arange(n_regions)
    if is_wrong.any():
        region = int(np.argmax(is_wrong))
        cell = cells[region]
        raise ValueError(
            f"centers[{region}] is {cell}, which has label {labels[cell]}: it must be a cell of"
            f" region {region}"
        )
    return cells


def checked_edges(edges: Any, n_vertices: int, name: str) -> Ints:
    """Pairs of vertices as an (E, 2) int32 array."""
    given = np.asarray(edges)
    if given.ndim != 2 or given.shape[1] != 2:
        raise ValueError(f"{name} must have shape (E, 2), got {given.shape}")
    flat = owned_indices(_integer_array(given.ravel(), name))
    if flat.min(initial=0) < 0 or flat.max(initial=0) >= n_vertices:
        place = int(np.argmax((flat < 0) | (flat >= n_vertices))) // 2
        raise ValueError(
            f"{name}[{place}] is {given[place].tolist()} but the mesh has {n_vertices} vertices"
        )
    return flat.reshape(-1, 2)


def checked_partial_labels(
    labels: Any, n_cells: int, name: str = "labels", *, least: int = -1,
    n_vertices: int | None = None,
) -> tuple[Ints, int]:  # fmt: skip
    """Labels as an (N,) int32 array, and the number K of regions.

    Each label from 0 to K - 1 must occur. -1 means no region; it is an error if `least` is 0.
    """
    given = _row_of_labels(labels, n_cells, name, n_vertices)
    is_wrong = (given < least) | (given >= n_cells)
    refuse_first(is_wrong, name, given, f"labels must be {least} to K - 1, K <= {n_cells}")
    array = owned_indices(given)
    counts = np.bincount(array + 1)[1:]
    if not counts.all():
        raise ValueError(f"no cell has label {int(np.argmin(counts))}")
    return array, len(counts)


def checked_regions(labels: Any, n_cells: int, n_vertices: int | None = None) -> tuple[Ints, int]:
    """Like `checked_partial_labels`, but at least one region must occur."""
    array, n_regions = checked_partial_labels(labels, n_cells, n_vertices=n_vertices)
    if not n_regions:
        raise ValueError("no cell has a label: all are -1")
    return array, n_regions


def checked_classes(labels: Any, n_cells: int, name: str) -> Ints:
    """Labels >= 0 that may have gaps, or -1 for no label, as an (N,) int32 array."""
    given = _row_of_labels(labels, n_cells, name)
    array = given.astype(np.int32, order="C")  # a copy
    is_wrong = (array < -1) | (array != given)
    refuse_first(is_wrong, name, given, f"it must be -1 to {MAX_CELLS}")
    return array


def _row_of_labels(labels: Any, n_cells: int, name: str, n_vertices: int | None = None) -> Array:
    given = _integer_array(labels, name)
    if len(given) != n_cells:
        hint = hint_at_vertices(len(given), n_vertices)
        raise ValueError(f"there are {len(given)} {name} for {n_cells} cells{hint}")
    return given


def hint_at_vertices(n_labels: int, n_vertices: int | None) -> str:
    """Advice for a wrong number of labels, if there is one label per vertex."""
    if n_labels != n_vertices:
        return ""
    call = "superfacets.transfer(mesh.vertices, labels, mesh)"
    return f": the mesh has {n_vertices} vertices, and {call} gives labels of faces"


def checked_any_labels(labels: Any, n_cells: int, n_vertices: int | None = None) -> Longs:
    """Labels, which may be any integers, as an (N,) int64 array."""
    given = _row_of_labels(labels, n_cells, "labels", n_vertices)
    array = owned(given, np.int64)
    if given.dtype.kind == "u" and array.min() < 0:
        raise ValueError("labels must fit in int64")
    return array


def compact_partial_labels(
    labels: Any, n_cells: int, n_vertices: int | None = None
) -> tuple[Ints, Array]:
    """Labels, which may be any integers, ranked as by `ranked_labels`."""
    return ranked_labels(checked_any_labels(labels, n_cells, n_vertices))


def compact_complete(
    labels: Any, n_cells: int, name: str = "labels", n_vertices: int | None = None
) -> tuple[Ints, int]:
    """Labels >= 0, renumbered as 0 to K - 1 in ascending order, and K; for metrics.

    A MeshError if a label is negative: metrics would count its cells as one more region.
    """
    array = checked_any_labels(labels, n_cells, n_vertices)
    must = "metrics need a region for each cell, labels >= 0"
    refuse_first(array < 0, name, array, must, MeshError)
    ranks, names = ranked_labels(array)
    return ranks, len(names)


def ranked_labels(labels: npt.NDArray[np.integer[Any]]) -> tuple[Ints, Array]:
    """Labels renumbered as 0 to K - 1 in ascending order (-1 is kept), and the K old labels."""
    if labels.min() >= -1 and labels.max() < len(labels):  # a table replaces sorting
        is_used = np.bincount(labels + 1) > 0
        names, places = np.arange(-1, len(is_used) - 1), labels + 1
    else:
        names, places = np.unique(labels, return_inverse=True)
        is_used = np.ones(len(names), bool)
    is_used &= names != -1
    ranks = np.cumsum(is_used, dtype=np.int32) - np.int32(1)
    ranks[names == -1] = -1
    return ranks[places], names[is_used]


def checked_count(
    value: Any, name: str, high: int | None = None, of: str = "", *, low: int = 1
) -> int:
    """Check an integer from `low` to `high`; messages say that there are `high` things `of`."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be an integer, got {reprlib.repr(value)}")
    if isinstance(value, np.ndarray):
        raise TypeError(
            f"{name} must be an integer, got an array: pass a mesh as one pair (vertices, faces)"
        )
    count = operator.index(value)
    if count < low:
        raise ValueError(f"{name} must be at least {low}, got {count}")
    if high is not None and count > high:
        raise ValueError(f"{name} is {count} but there are only {high} {of}")
    return count


def checked_number(value: Any, name: str, *, zero: bool) -> float:
    """A finite float > 0, or >= 0 where `zero` is allowed."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number, got {reprlib.repr(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number) or number < 0 or (number == 0 and not zero):
        expected = "finite and not negative" if zero else "finite and positive"
        raise ValueError(f"{name} must be {expected}, got {reprlib.repr(value)}")
    return number


def checked_share(value: Any, name: str) -> float:
    """A number from 0 to 1."""
    number = checked_number(value, name, zero=True)
    if number > 1.0:
        raise ValueError(f"{name} must be 0 to 1, got {number}")
    return number


def checked_cell_weights(weights: Any, n_cells: int) -> Floats:
    """One finite number >= 0 per cell, not all 0, as (N,) float64."""
    refuse_mask(weights, "cell_weights")
    given = np.asarray(weights)
    if given.dtype.kind not in "iufb":
        raise TypeError(f"cell_weights must be numbers, got {given.dtype}")
    if given.shape != (n_cells,):
        raise ValueError(f"cell_weights must have shape ({n_cells},), got {given.shape}")
    array = exact_doubles(given)
    is_wrong = ~(np.isfinite(array) & (array >= 0))
    refuse_first(is_wrong, "cell_weights", given, "it must be finite and not negative")
    return array


def checked_flag(value: Any, name: str) -> bool:
    """Check a value that must be True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, got {reprlib.repr(value)}")
    return bool(value)


def checked_choice(value: str, name: str, choices: tuple[str, ...]) -> str:
    """Check a value that must be one of the given names."""
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(choices)}, got {value!r}")
    return value


Function = TypeVar("Function", bound=Callable[..., Any])


def says_what_is_meant(others: Mapping[str, str]) -> Callable[[Function], Function]:
    """Decorate a function: its error for a parameter of another tool names the parameter to use."""

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def checked(*args: Any, **keywords: Any) -> Any:
            for name in keywords.keys() & others.keys():
                raise TypeError(f"{function.__name__} has no parameter {name}: {others[name]}")
            return function(*args, **keywords)

        return cast(Function, checked)

    return decorate


def checked_generator(value: Any, name: str) -> np.random.Generator:
    """A random number generator: the given one, or a new one with an integer >= 0 as seed."""
    if isinstance(value, np.random.Generator):
        return value
    if isinstance(value, (bool, np.bool_, np.ndarray)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be an integer or a Generator, got {reprlib.repr(value)}")
    seed = operator.index(value)
    if seed < 0:
        raise ValueError(f"{name} must not be negative, got {seed}")
    return np.random.default_rng(seed)


def checked_pose(pose: Any) -> Floats:
    """A new (4, 4) float64 array: rotation and position of a camera."""
    given = _numbers_of(pose, "pose")
    if given.shape not in ((4, 4), (3, 4)):
        raise ValueError(f"pose must have shape (4, 4) or (3, 4), got {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError("pose is not finite: leave out images whose pose is unknown")
    array = np.eye(4)
    array[: len(given)] = given
    if np.any(array[3] != (0, 0, 0, 1)):
        raise ValueError(f"the last row of pose must be 0, 0, 0, 1, got {array[3].tolist()}")
    rotation = array[:3, :3]
    error = float(np.abs((rotation[:, :, None] * rotation[:, None]).sum(axis=0) - np.eye(3)).max())
    if error > MAX_ROTATION_ERROR:
        raise ValueError(
            "pose must be a rotation and a position, without scale or shear: scalar products of its"
            f" axes have errors of {error:.2g}"
        )
    if np.dot(np.cross(rotation[0], rotation[1]), rotation[2]) < 0:
        raise ValueError("pose is a mirror image, not a rotation: reverse one of its axes")
    return array


def checked_intrinsics(intrinsics: Any) -> Floats:
    """Focal lengths and principal point, (4,) float64, from four numbers or a matrix."""
    given = _numbers_of(intrinsics, "intrinsics")
    if given.shape in ((3, 3), (4, 4)):
        if given[0, 1] != 0:
            raise ValueError(f"the skew of intrinsics is {given[0, 1]:g}; it must be 0")
        given = given[(0, 1, 0, 1), (0, 1, 2, 2)]
    if given.shape != (4,):
        raise ValueError(
            f"intrinsics must be fx, fy, cx, cy or a matrix (3, 3), got shape {given.shape}"
        )
    if not np.isfinite(given).all() or given[:2].min() <= 0:
        raise ValueError(
            f"intrinsics must be finite, with positive focal lengths, got {given.tolist()}"
        )
    return owned(given, np.float64)


def checked_image_size(size: Any) -> tuple[int, int]:
    """Width and height of an image in pixels, both at least 1."""
    if not isinstance(size, (tuple, list, np.ndarray)) or len(size) != 2:
        raise TypeError(f"size must be a pair of width and height, got {reprlib.repr(size)}")
    width, height = (checked_count(value, "size", MAX_SIDE, "pixels") for value in size)
    return width, height


def _numbers_of(value: Any, name: str) -> Floats:
    refuse_mask(value, name)
    try:
        array = np.asarray(value)
    except ValueError:  # the nested lists are ragged
        array = np.empty(0, object)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must be an array of numbers")
    return array.astype(np.float64)


def checked_callable(value: Any, name: str) -> Any:
    """Check a value that must be a callable or None."""
    if value is not None and not callable(value):
        raise TypeError(f"{name} must be callable, got {value!r}")
    return value


def checked_threads(n_threads: Any) -> int:
    """The number of threads: as given, else SUPERFACETS_NUM_THREADS, else one per usable core.

    At most `MAX_THREADS_PER_CORE` per usable core. Labels do not depend on the number of threads.
    """
    if n_threads is not None:
        return min(checked_count(n_threads, "n_threads"), MAX_THREADS_PER_CORE * usable_cores())
    from_environment = os.environ.get("SUPERFACETS_NUM_THREADS", "")
    if from_environment:
        if not from_environment.isdecimal():
            raise ValueError(f"SUPERFACETS_NUM_THREADS must be a number, got {from_environment!r}")
        return checked_threads(checked_count(int(from_environment), "SUPERFACETS_NUM_THREADS"))
    return usable_cores()


def usable_cores() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _integer_array(value: Any, name: str) -> Array:
    """A one-dimensional array of integers, in its original dtype."""
    refuse_mask(value, name)
    array = np.asarray(value)
    if array.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {array.shape}")
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} must be integers, got {array.dtype}")
    return array
