"""All checks and conversions of arguments.

The core checks nothing: arrays that leave this module have the dtype and layout that it expects.
Integers that serve as indices are copied before they are checked, so that neither the caller, nor
another thread, nor the file behind a memory map can change them afterwards. Floats are not copied.
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
"""Largest number of cells, labels or vertices, because they are int32 in the core."""

EXTENT_RANGE = (1e-15, 1e15)
"""Extents for which labels do not depend on the unit of length. The determinant of the second
moments of tetrahedra, a product of fifteen lengths, stays normal down to 1e-5 of the extent."""

VALUE_RANGE = (1e-150, 1e150)
"""Range of the largest area or weight: sums, and products with positions, then stay normal."""

MAX_SIDE = 1 << 16
"""Largest width and height of an image, in pixels."""

MAX_ROTATION_ERROR = 1e-3
"""Largest error of products of the axes of a pose: four digits are enough, a scale is not."""

MAX_THREADS_PER_CORE = 4
"""Upper bound of threads per usable core. More only wait for each other: on two cores, 1,024
threads take four times as long as two."""


def exact_array(array: Any, dtype: Any) -> Array:
    """Return the numbers as a contiguous, aligned array of this type; a copy only if needed."""
    return np.require(array, dtype, ["C_CONTIGUOUS", "ALIGNED", "ENSUREARRAY"])


def exact_doubles(array: Array) -> Floats:
    """Return `exact_array` as float64, infinite where numbers are too large.

    Memory mapped from a file is copied: if the file shrank, reading it would end the process.
    """
    # Later checks find a signaling NaN, or a longdouble beyond float64.
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
    """A copy of integers as int32; -1 where one does not fit."""
    # Numbers of 2**63 or more become negative here, and do not fit either.
    given = exact_array(array, np.int32 if array.dtype == np.int32 else np.int64)
    narrow = _core.narrow_indices(given.ravel(), checked_threads(None))
    return narrow.reshape(array.shape)


def refuse_mask(value: Any, name: str, error: type[ValueError] = ValueError) -> None:
    """Raise an error if entries are masked: numpy would use the values under the mask."""
    if "numpy.ma" not in sys.modules:  # slow to import; until then no array has a mask
        return
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise error(f"{name} has masked entries: fill them, or leave them out")


def restored(state: Any, names: Sequence[str]) -> list[Any]:
    """Return fields of the state of a copy or a pickle, to be checked as for a new object."""
    if not isinstance(state, dict) or not set(names) <= state.keys():
        raise ValueError(f"a damaged copy: it does not hold {', '.join(names)}")
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
    """Vertices, faces, and the bounding box (2, 3) of the vertices used; a MeshError if wrong.

    Arrays that no one else refers to (`are_new`), such as a reader's, are not copied.
    """
    points = _point_array(vertices)
    given = _corner_rows(faces, "faces", 3)
    corners = _int32_corners(given, are_new)
    place, box = _checked_corners(points, corners.ravel())
    if place is not None:
        raise_index_error(place // 3, given.ravel()[place], len(points))
    return points, corners, box


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
    points = _point_array(vertices)
    given = _corner_rows(tets, "tets", 4)
    corners = owned_indices(given)
    place, box = _checked_corners(points, corners.ravel())
    if place is not None:
        raise_index_error(place // 4, given.ravel()[place], len(points), "tets")
    return points, corners, box


def _int32_corners(given: Array, are_new: bool) -> Ints:
    is_ours = are_new and given.dtype == np.int32
    return exact_array(given, np.int32) if is_ours else owned_indices(given)


def checked_mask(mask: Any, n_cells: int, name: str) -> Bools:
    """Return one bool per cell; all are True if `mask` is None."""
    if mask is None:
        return np.ones(n_cells, dtype=bool)
    array = np.asarray(mask)
    if array.dtype != bool:
        raise TypeError(f"{name} must be bools, got {array.dtype}")
    if array.shape != (n_cells,):
        raise ValueError(f"{name} must have shape ({n_cells},), got {array.shape}")
    return array


def polygon_arrays(faces: Any) -> tuple[Array, Array]:
    """Offsets and corners of faces given as rows of an array, or as lists of vertices."""
    array = faces if isinstance(faces, np.ndarray) else None
    if array is None or array.dtype == object:
        rows = [_row_of_integers(face, "a face") for face in faces]
        lengths = np.array([len(row) for row in rows], dtype=np.int64)
        filled = [row for row in rows if len(row)]  # empty lists become arrays of floats
        corners = np.concatenate(filled) if filled else np.empty(0, dtype=np.int64)
        return np.concatenate([[0], np.cumsum(lengths)]), corners
    if array.ndim != 2:
        raise MeshError(f"faces must be lists of vertices, or an array (F, n), got {array.shape}")
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
    """Raise a MeshError unless offsets cut the corners into faces of three and more."""
    if len(offsets) < 2:
        raise MeshError("the mesh has no faces")
    _check_size(len(offsets) - 1, "the mesh", "faces")
    if offsets[0] != 0 or offsets[-1] != n_corners:
        raise MeshError(
            f"offsets must run from 0 to the number of corners, {n_corners},"
            f" got {offsets[0]} to {offsets[-1]}"
        )
    sizes = np.diff(offsets)
    if sizes.min() < 3 or sizes.max() > MAX_CELLS:
        face = int(np.argmax((sizes < 3) | (sizes > MAX_CELLS)))
        raise MeshError(f"faces[{face}] has {sizes[face]} corners: a face needs at least 3")


def _checked_corners(points: Floats, corners: Ints) -> tuple[int | None, Floats]:
    """Index of the first invalid corner, or None, and the box of the used vertices."""
    is_finite, is_in_range, *bounds = _core.check_mesh(points, corners, checked_threads(None))
    if not is_finite:
        _raise_not_finite(points, "vertices")
    box = np.array(bounds)
    if not is_in_range:
        return int(np.argmax((corners < 0) | (corners >= len(points)))), box
    check_extent(*box)
    return None, box


def _point_array(vertices: Any) -> Floats:
    """Vertex positions as a contiguous (V, 3) float64 array; a MeshError if they are not valid."""
    array = _rows(vertices, "vertices", count="V")
    _check_size(len(array), "the mesh", "vertices")
    return exact_doubles(array)


def _check_size(n: int, whole: str, things: str, most: int = MAX_CELLS) -> None:
    if n > most:
        raise MeshError(f"{whole} has {n} {things}; at most {most} are supported")


def _corner_rows(value: Any, name: str, n_corners: int) -> Array:
    """Triangles or tetrahedra, one row of integers each, in the type given."""
    array = _numeric_array(value, name)
    noun, count = ("faces", "F") if n_corners == 3 else ("tetrahedra", "N")
    if array.size == 0:
        raise MeshError(f"the mesh has no {noun}")
    if n_corners == 3 and array.ndim == 2 and array.shape[1] > 3:
        raise MeshError(
            f"faces have {array.shape[1]} corners: a Mesh has triangles, make a PolygonMesh"
        )
    if array.ndim != 2 or array.shape[1] != n_corners:
        raise MeshError(f"{name} must have shape ({count}, {n_corners}), got {array.shape}")
    if array.dtype.kind not in "iu":
        raise MeshError(f"{name} must be integers, got {array.dtype}")
    _check_size(len(array), "the mesh", noun, MAX_CELLS if n_corners == 3 else MAX_CELLS // 4)
    return array


def raise_index_error(cell: int, vertex: int, n_vertices: int, name: str = "faces") -> None:
    """Raise the MeshError for a corner that is no vertex of the mesh."""
    raise MeshError(
        f"{name}[{cell}] refers to vertex {vertex} but the mesh has {n_vertices} vertices"
    )


def refuse_first(
    is_wrong: Bools, name: str, values: Array, must: str, error: type[ValueError] = ValueError
) -> None:
    """Raise an error that names the first wrong value, and says how it must be."""
    if is_wrong.any():
        place = int(np.argmax(is_wrong))
        raise error(f"{name}[{place}] is {values[place]}; {must}")


def check_extent(low: Floats, high: Floats, what: str = "faces lie", whole: str = "mesh") -> None:
    """Raise a MeshError if a box has no size, or one too small or too large."""
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
    """Whether each box, (K, 2, 3), has a size that a mesh may have: (K,)."""
    with np.errstate(over="ignore"):
        sizes = (bounds[:, 1] - bounds[:, 0]).max(axis=1)
    return np.asarray((sizes >= EXTENT_RANGE[0]) & (sizes <= EXTENT_RANGE[1]))


def _numeric_array(value: Any, name: str) -> Array:
    refuse_mask(value, name, MeshError)
    try:
        array = np.asarray(value)
    except ValueError as error:  # ragged nested lists
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
    # Column by column: a tenth of the time of min(axis=0).
    box = np.array([[axis.min() for axis in array.T], [axis.max() for axis in array.T]])
    if not np.isfinite(box).all():
        _raise_not_finite(array, "points")
    if not np.array_equal(*box):  # stages that need a size call `check_spread`
        check_spread(box)
    return array, box


def check_spread(bounds: Floats) -> None:
    """Raise a MeshError if all points of a cloud lie at one place."""
    check_extent(bounds[0], bounds[1], "points lie", "cloud")


def checked_queries(points: Any) -> Floats:
    """Points (M, 3) as float64, M >= 0; a MeshError if they are wrong."""
    array = exact_doubles(_rows(points, "points"))
    if not np.isfinite(array).all():
        _raise_not_finite(array, "points")
    largest = float(np.abs(array).max(initial=0.0))
    if largest > VALUE_RANGE[1]:
        raise MeshError(
            f"the largest coordinate of points is {largest:.3g}: rescale to {VALUE_RANGE[1]:g} at"
            " most"
        )
    return array


def checked_normals(normals: Any, n_points: int, first: int = 0, name: str = "normals") -> Floats:
    """One vector of length 1, or zero, per point, (N, 3) float64; a MeshError if they are wrong.

    Error messages number the points from `first`.
    """
    array = owned(exact_doubles(_rows(normals, name, n_points)), np.float64)
    if not np.isfinite(array).all():
        _raise_not_finite(array, name, first)
    largest = np.abs(array).max(axis=1, initial=0.0, keepdims=True)  # so that no length overflows
    np.divide(array, largest, out=array, where=largest > 0)
    lengths = np.sqrt(np.einsum("ij,ij->i", array, array))[:, None]
    np.divide(array, lengths, out=array, where=lengths > 0)
    return array


def checked_viewpoints(viewpoints: Any, n_points: int) -> Floats:
    """One place (3,), or one per point (N, 3), float64; a MeshError if wrong."""
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
    is_wrong = ~((shades >= 0) & (shades <= 1)).all(axis=1)  # also where one is NaN
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
    """Low and high corner of a box, (2, 3) float64; the box of the positions if None is given."""
    if bounds is None:
        return np.array([positions.min(axis=0), positions.max(axis=0)])
    array = exact_doubles(_numeric_array(bounds, "bounds"))
    if array.shape != (2, 3) or not np.isfinite(array).all() or np.any(array[0] > array[1]):
        raise ValueError("bounds must hold a low and a high corner, shape (2, 3), finite")
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
    starts = owned(_integer_array(offsets, "offsets"), np.int64)  # 2**63 or more: negative
    targets = owned_indices(_integer_array(neighbors, "neighbors"))
    if len(starts) != n_cells + 1:
        raise ValueError(f"offsets must have shape ({n_cells + 1},), got {starts.shape}")
    if starts[0] != 0 or starts[-1] != len(targets) or np.any(np.diff(starts) < 0):
        raise ValueError("offsets must rise from 0 to the number of arcs")
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
    is_wrong = ~(np.abs(array) <= math.pi)  # also where it is NaN
    refuse_first(is_wrong, "angles", array, "it must be from -pi to pi")
    return array


def checked_sides(sides: Any, offsets: Longs) -> Ints:
    """One side >= 0 per arc, (M,) int32, ascending for the arcs of each cell."""
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
        raise ValueError(f"{name} holds {values[np.argmax(counts > 1)]} more than once")
    return array


def checked_region_centers(centers: npt.ArrayLike, labels: Ints, n_regions: int) -> Ints:
    """One cell of each region, in the order of the labels, as (K,) int32; a ValueError if not."""
    cells = checked_seeds(centers, len(labels))
    if len(cells) != n_regions:
        raise ValueError(f"there are {len(cells)} centers for {n_regions} regions")
    is_wrong = labels[cells] != np.arange(n_regions)
    if is_wrong.any():
        region = int(np.argmax(is_wrong))
        cell = cells[region]
        raise ValueError(f"centers[{region}] is {cell}, which has label {labels[cell]}")
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

    Each of 0..K-1 must occur. -1 stands for no region, and is refused if `least` is 0.
    """
    given = _row_of_labels(labels, n_cells, name, n_vertices)
    is_wrong = (given < least) | (given >= n_cells)
    refuse_first(is_wrong, name, given, f"labels are {least}..K-1, K <= {n_cells}")
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
    """Labels that may have gaps, as an (N,) int32 array: 0 and up, or -1 for no label."""
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
    """The end of the message on a wrong number of labels, if it is that of the vertices."""
    if n_labels != n_vertices:
        return ""
    call = "superfacets.transfer(mesh.vertices, labels, mesh)"
    return f", as many as the vertices: {call} gives labels of faces"


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
    """Return `ranked_labels` of labels that may be any integers."""
    return ranked_labels(checked_any_labels(labels, n_cells, n_vertices))


def compact_complete(
    labels: Any, n_cells: int, name: str = "labels", n_vertices: int | None = None
) -> tuple[Ints, int]:
    """Labels of 0 and up, renamed to 0..K-1 in their order, and K; a MeshError if one is below 0.

    This is for metrics, which would count cells without a region as one more region.
    """
    array = checked_any_labels(labels, n_cells, n_vertices)
    refuse_first(array < 0, name, array, "metrics need each cell in a region, 0 and up", MeshError)
    ranks, names = ranked_labels(array)
    return ranks, len(names)


def ranked_labels(labels: npt.NDArray[np.integer[Any]]) -> tuple[Ints, Array]:
    """Labels renamed to 0..K-1 in their order, but -1 stays -1; and the K labels that occur."""
    if labels.min() >= -1 and labels.max() < len(labels):  # no need to sort
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
    """Check an integer from `low` to `high`; messages call `high` the number of `of`."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be an integer, got {reprlib.repr(value)}")
    if isinstance(value, np.ndarray):
        raise TypeError(f"{name} must be an integer, got an array: a mesh is one (vertices, faces)")
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
    if is_wrong.any():
        place = int(np.argmax(is_wrong))
        raise ValueError(f"cell_weights[{place}] is {given[place]}, not finite and >= 0")
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
    """Decorate a function: for a parameter of another tool, the error says which one is meant."""

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def checked(*args: Any, **keywords: Any) -> Any:
            for name in keywords.keys() & others.keys():
                raise TypeError(f"{function.__name__} has no parameter {name}: {others[name]}")
            return function(*args, **keywords)

        return cast(Function, checked)

    return decorate


def checked_generator(value: Any, name: str) -> np.random.Generator:
    """A generator of random numbers: as given, or seeded with an integer >= 0."""
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
        raise ValueError("pose is not finite: leave out images without a pose")
    array = np.eye(4)
    array[: len(given)] = given
    if np.any(array[3] != (0, 0, 0, 1)):
        raise ValueError(f"the last row of pose must be 0, 0, 0, 1, got {array[3].tolist()}")
    rotation = array[:3, :3]
    error = float(np.abs((rotation[:, :, None] * rotation[:, None]).sum(axis=0) - np.eye(3)).max())
    if error > MAX_ROTATION_ERROR:
        raise ValueError(
            "pose must be a rotation and a position, without scale and shear: products of its axes"
            f" are off by {error:.2g}"
        )
    if np.dot(np.cross(rotation[0], rotation[1]), rotation[2]) < 0:
        raise ValueError("pose mirrors the world: one of its axes points the wrong way")
    return array


def checked_intrinsics(intrinsics: Any) -> Floats:
    """Focal lengths and principal point, (4,) float64, from these or from their matrix."""
    given = _numbers_of(intrinsics, "intrinsics")
    if given.shape in ((3, 3), (4, 4)):
        if given[0, 1] != 0:
            raise ValueError(f"intrinsics have a skew of {given[0, 1]:g}; it must be 0")
        given = given[(0, 1, 0, 1), (0, 1, 2, 2)]
    if given.shape != (4,):
        raise ValueError(
            f"intrinsics must be fx, fy, cx, cy or a matrix (3, 3), got shape {given.shape}"
        )
    if not np.isfinite(given).all() or given[:2].min() <= 0:
        raise ValueError(
            f"intrinsics must be finite, and focal lengths positive, got {given.tolist()}"
        )
    return owned(given, np.float64)


def checked_image_size(size: Any) -> tuple[int, int]:
    """Width and height of an image, 1 and up."""
    if not isinstance(size, (tuple, list, np.ndarray)) or len(size) != 2:
        raise TypeError(f"size must be width and height, got {reprlib.repr(size)}")
    width, height = (checked_count(value, "size", MAX_SIDE, "pixels") for value in size)
    return width, height


def _numbers_of(value: Any, name: str) -> Floats:
    refuse_mask(value, name)
    try:
        array = np.asarray(value)
    except ValueError:  # ragged nested lists
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

    Never more than `MAX_THREADS_PER_CORE` for each usable core; labels do not depend on it.
    """
    if n_threads is not None:
        return min(checked_count(n_threads, "n_threads"), MAX_THREADS_PER_CORE * usable_cores())
    from_environment = os.environ.get("SUPERFACETS_NUM_THREADS", "")
    if from_environment:
        if not from_environment.isdecimal():
            raise ValueError(f"SUPERFACETS_NUM_THREADS is {from_environment!r}, not a number")
        return checked_threads(checked_count(int(from_environment), "SUPERFACETS_NUM_THREADS"))
    return usable_cores()


def usable_cores() -> int:
    """The number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _integer_array(value: Any, name: str) -> Array:
    """A one-dimensional array of integers, in the type given."""
    refuse_mask(value, name)
    array = np.asarray(value)
    if array.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {array.shape}")
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} must be integers, got {array.dtype}")
    return array
