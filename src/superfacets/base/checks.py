"""Check and convert arguments.

The C++ core `_core` does not check its arguments. Therefore this module returns arrays with the
dtype and the memory layout that `_core` expects. Indices are copied before they are checked, so
that no other thread and no memory-mapped file can change them afterwards. Arrays of floats are
usually not copied, unless they are memory-mapped.
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
from collections.abc import Callable, Mapping, Sequence, Sized
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from .. import _core
from .errors import MeshError
from .types import ArcLists, Array, Bools, Floats, Ints, Longs, Singles

MAX_CELLS = 2**31 - 1
"""Maximum number of cells, labels or vertices, because `_core` uses int32 indices."""

EXTENT_RANGE = (1e-15, 1e15)
"""Minimum and maximum of the longest side of a bounding box, in any unit of length. Within these
limits, no product of lengths overflows or underflows, so labels do not depend on the unit. The
longest product is the determinant of the second moments of a tetrahedron, a product of fifteen
lengths."""

VALUE_RANGE = (1e-150, 1e150)
"""Limits for the largest of all areas or weights, so that sums and products do not overflow."""

MAX_THREADS_PER_CORE = 4
"""Maximum number of threads per usable core. On two cores, 1,024 threads take four times as long as
two threads, because the threads wait for each other."""

_PLURALS = {"category": "categories", "index": "indices", "vertex": "vertices"}


def counted(n: int, thing: str) -> str:
    """Return a number and a noun for a message, in the plural if necessary: "1 face", "2 faces"."""
    return f"{n} {thing if n == 1 else _PLURALS.get(thing, thing + 's')}"


def check_length(
    given: Sized, n: int, name: str, noun: str = "cell", *, n_vertices: int | None = None,
    error: type[ValueError] = ValueError,
) -> None:  # fmt: skip
    """Check a parameter: raise an error unless it has `n` values, one value for each `noun`."""
    if len(given) == n:
        return
    hint = (
        ". For one label per vertex, convert the labels to faces with superfacets.face_labels(mesh,"
        " labels)"
    )
    raise error(
        f"{name} must have one value per {noun} ({n}), got {counted(len(given), 'value')}"
        f"{hint if len(given) == n_vertices else ''}"
    )


def exact_array(array: Any, dtype: Any) -> Array:
    """Return a contiguous, aligned array of the given dtype; copy the array only if necessary."""
    return np.require(array, dtype, ["C_CONTIGUOUS", "ALIGNED", "ENSUREARRAY"])


def exact_doubles(array: Array) -> Floats:
    """Convert to float64; copy memory-mapped arrays, because another program may cut the file."""
    # NumPy's warnings are suppressed, because later checks find NaNs and infinities.
    with np.errstate(over="ignore", invalid="ignore"):
        doubles: Floats = exact_array(array, np.float64)
    owner: Any = doubles
    while isinstance(owner, np.ndarray):
        owner = owner.base
    is_mapped = isinstance(owner.obj if isinstance(owner, memoryview) else owner, mmap.mmap)
    return doubles.copy() if is_mapped else doubles


def owned(array: Array, dtype: Any) -> Array:
    """Return a copy of an array, so that the caller cannot change values after they are checked."""
    return np.array(array, dtype=dtype, order="C")


def owned_indices(array: Array) -> Ints:
    """Return a copy of `array` as int32; integers outside the range of int32 become negative."""
    # Unsigned integers of 2**63 or more wrap to negative numbers when converted to int64.
    given = exact_array(array, np.int32 if array.dtype == np.int32 else np.int64)
    return _core.narrow_indices(given.ravel(), checked_threads(None)).reshape(array.shape)


def refuse_mask(value: Any, name: str, error: type[ValueError] = ValueError) -> None:
    """Check a parameter: raise an error for masked entries, whose values NumPy would use."""
    if "numpy.ma" not in sys.modules:  # no masked array can exist, so the slow import is avoided
        return
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise error(f"{name} must not have masked entries: fill or remove these entries")


def refuse_order(value: Any, expected: str) -> None:
    """Check the place of an argument: raise a TypeError if it belongs to another place.

    `expected` is "a path", "a mesh" or "labels". Apps use it to check paths and labels that no
    other function of this module checks. A path is also accepted as a mesh.
    """
    given, is_own = expected, type(value).__module__.startswith("superfacets")
    if isinstance(value, (str, os.PathLike)):
        given = "a path" if expected == "labels" else expected
    elif is_own and hasattr(value, "__array__"):  # a result of `segment`
        given = "labels"
    elif is_own and not hasattr(value, "n_cells"):
        names = {"a mesh": ("source", "mesh"), "labels": ("labels",)}.get(expected, ())
        hint = "".join(f": pass its .{name}" for name in names if hasattr(value, name))
        raise TypeError(f"expected {expected}, got {type(value).__name__}{hint}")
    elif isinstance(value, (np.ndarray, list, tuple)):
        given = _kind_of_array(value) or expected
    elif is_own or any(hasattr(value, name) for name in ("vertices", "points", "vertex", "point")):
        given = "a mesh"
    if given != expected:
        order = "the mesh comes first, then the labels"
        if "a path" in (given, expected):
            order = "the path comes first, then the mesh, then the labels"
        raise TypeError(f"expected {expected}, got {given}: {order}")


def _kind_of_array(value: Any) -> str | None:
    """Return "a mesh" for a (vertices, faces) pair, "labels" for a row of integers, or None."""
    if isinstance(value, np.ndarray):
        return "labels" if value.ndim == 1 and value.dtype.kind in "iu" else None
    first: Any = value[0] if len(value) else None
    if isinstance(first, (int, np.integer)):
        return "labels"
    is_pair = len(value) == 2 and isinstance(first, (np.ndarray, list, tuple))
    return "a mesh" if is_pair and np.ndim(first) == 2 else None


def restored(state: Any, names: Sequence[str]) -> list[Any]:
    """Return the fields `names` of a pickled object, or raise a ValueError if one is missing."""
    if not isinstance(state, dict) or not set(names) <= state.keys():
        raise ValueError(
            f"the copy or pickle is damaged: it must have the fields {', '.join(names)}"
        )
    return [state[name] for name in names]


def freeze(instance: object, **arrays: Array) -> None:
    """In `__post_init__` of a frozen dataclass, set fields to read-only views of arrays."""
    for name, array in arrays.items():
        view = array.view()
        view.flags.writeable = False
        object.__setattr__(instance, name, view)


def checked_polygons(
    vertices: Any, offsets: Any, indices: Any, *, are_new: bool = False
) -> tuple[Floats, Longs, Ints, Floats]:
    """Return checked vertices, offsets and corners, and the bounding box of all used vertices."""
    points = _point_array(vertices)
    given = _row_of_integers(indices, "indices")
    corners = _int32_corners(given, are_new)
    starts = owned(_row_of_integers(offsets, "offsets"), np.int64)
    _check_offsets(starts, len(corners))
    wrong, box = _checked_corners(points, corners)
    if wrong is not None:
        face = int(np.searchsorted(starts, wrong, side="right")) - 1
        raise_index_error(face, given[wrong], len(points))
    return points, starts, corners, box


def checked_simplices(
    vertices: Any, cells: Any, name: str, n_corners: int, *, are_new: bool = False
) -> tuple[Floats, Ints, Floats]:
    """Return checked vertices, checked faces or tetrahedra, and the box (2, 3) of used vertices.

    An int32 array is not copied if `are_new` is true: no other code refers to `cells`.
    """
    points = _point_array(vertices)
    given = _corner_rows(cells, name, n_corners)
    corners = _int32_corners(given, are_new)
    wrong, box = _checked_corners(points, corners.ravel())
    if wrong is not None:
        raise_index_error(wrong // n_corners, given.ravel()[wrong], len(points), name)
    return points, corners, box


def _int32_corners(given: Array, are_new: bool) -> Ints:
    needs_no_copy = are_new and given.dtype == np.int32
    return exact_array(given, np.int32) if needs_no_copy else owned_indices(given)


def checked_mask(mask: Any, n_cells: int, name: str) -> Bools:
    """Return the checked mask, with one bool per cell, or all True if `mask` is None."""
    if mask is None:
        return np.ones(n_cells, dtype=bool)
    array = np.asarray(mask)
    if array.dtype != bool:
        raise TypeError(f"{name} must be an array of bool, such as labels >= 0, got {array.dtype}")
    if array.shape != (n_cells,):
        raise ValueError(f"{name} must have shape ({n_cells},), got {array.shape}")
    return array


def polygon_arrays(faces: Any) -> tuple[Array, Array]:
    """Return offsets and corners of `faces`, an array (F, n) or a list of vertices per face."""
    array = faces if isinstance(faces, np.ndarray) else None
    if array is None or array.dtype == object:
        rows = [_row_of_integers(face, "a face") for face in faces]
        lengths = np.array([len(row) for row in rows], dtype=np.int64)
        filled = [row for row in rows if len(row)]  # because empty lists become float arrays
        corners = np.concatenate(filled) if filled else np.empty(0, dtype=np.int64)
        return np.concatenate([[0], np.cumsum(lengths)]), corners
    if array.ndim != 2:
        raise MeshError(
            f"faces must be lists of vertices or an array of shape (F, n), got shape {array.shape}"
        )
    refuse_mask(array, "faces", MeshError)
    return np.arange(len(array) + 1) * array.shape[1], array.ravel()


def _row_of_integers(value: Any, name: str) -> Array:
    array = numeric_array(value, name)
    if array.ndim != 1:
        raise MeshError(f"{name} must be one-dimensional, got shape {array.shape}")
    if array.size and array.dtype.kind not in "iu":
        raise MeshError(f"{name} must contain integers, got {array.dtype}")
    return array


def _check_offsets(offsets: Longs, n_corners: int) -> None:
    """Raise a MeshError unless offsets divide the corners into faces of three or more corners."""
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
        raise MeshError(f"faces[{face}] must have at least 3 corners, got {sizes[face]}")


def _checked_corners(points: Floats, corners: Ints) -> tuple[int | None, Floats]:
    """Return the place of the first invalid index in `corners`, or None, and the bounding box."""
    is_finite, is_in_range, *bounds = _core.check_mesh(points, corners, checked_threads(None))
    if not is_finite:
        refuse_infinite(points, "vertices")
    box = np.array(bounds)
    if not is_in_range:
        return int(np.argmax((corners < 0) | (corners >= len(points)))), box
    check_extent(box)
    return None, box


def _point_array(vertices: Any) -> Floats:
    """Return vertex positions as a contiguous (V, 3) float64 array, after checking the shape."""
    array = rows_of_three(vertices, "vertices", count="V")
    _check_size(len(array), "the mesh", "vertices")
    return exact_doubles(array)


def _check_size(n: int, whole: str, things: str, most: int = MAX_CELLS) -> None:
    if n > most:
        raise MeshError(f"{whole} has {n} {things}; at most {most} are supported")


def _corner_rows(value: Any, name: str, n_corners: int) -> Array:
    """Return checked triangles or tetrahedra, one per row, in their original dtype."""
    array = numeric_array(value, name)
    noun, count = ("faces", "F") if n_corners == 3 else ("tetrahedra", "N")
    if array.size == 0:
        raise MeshError(f"the mesh has no {noun}")
    if n_corners == 3 and array.ndim == 2 and array.shape[1] > 3:
        raise MeshError(
            f"faces of a Mesh must have 3 corners, got {array.shape[1]}: use a PolygonMesh instead"
        )
    if array.ndim != 2 or array.shape[1] != n_corners:
        raise MeshError(f"{name} must have shape ({count}, {n_corners}), got {array.shape}")
    if array.dtype.kind not in "iu":
        raise MeshError(f"{name} must contain integers, got {array.dtype}")
    _check_size(len(array), "the mesh", noun, MAX_CELLS if n_corners == 3 else MAX_CELLS // 4)
    return array


def raise_index_error(cell: int, vertex: int, n_vertices: int, name: str = "faces") -> None:
    """Raise a MeshError that says which cell refers to a vertex that does not exist."""
    raise MeshError(
        f"{name}[{cell}] refers to vertex {vertex} but the mesh has {counted(n_vertices, 'vertex')}"
    )


def refuse_first(
    is_wrong: Bools | np.bool_, name: str, values: Array, must: str,
    error: type[ValueError] = ValueError,
) -> None:  # fmt: skip
    """Raise an error for the first value that `is_wrong` marks; `must` says what is expected."""
    if is_wrong.any():
        index = int(np.argmax(is_wrong))
        raise error(f"{name}[{index}] must be {must}, got {np.asarray(values)[index].tolist()}")


def check_extent(box: Floats, things: str = "faces", whole: str = "mesh") -> None:
    """Raise a MeshError if a bounding box is a point, or if its size is not in `EXTENT_RANGE`."""
    if np.array_equal(*box):
        raise MeshError(f"all {things} lie at one point: the bounding box has no size")
    with np.errstate(over="ignore"):
        side = float(np.max(box[1] - box[0]))
    if not EXTENT_RANGE[0] <= side <= EXTENT_RANGE[1]:
        raise MeshError(
            f"the longest side of the bounding box must be {EXTENT_RANGE[0]:g} to"
            f" {EXTENT_RANGE[1]:g}, got {side:.3g}: rescale the {whole}"
        )


def numeric_array(value: Any, name: str) -> Array:
    """Return `value` as an array of numbers, or raise a MeshError."""
    refuse_mask(value, name, MeshError)
    try:
        array = np.asarray(value)
    except ValueError as error:  # the nested lists are ragged
        raise MeshError(f"{name} must be a rectangular array: {error}") from None
    if array.dtype.kind not in "fiu":
        raise MeshError(f"{name} must contain numbers, got {array.dtype}")
    return array


def checked_points(points: Any) -> tuple[Floats, Floats]:
    """Return checked points (N, 3) as float64, N at least 1, and their bounding box (2, 3)."""
    given = rows_of_three(points, "points")
    if not len(given):
        raise MeshError("the cloud has no points")
    _check_size(len(given), "the cloud", "points")
    array = exact_doubles(given)
    # A loop over the three axes is ten times faster than min(axis=0).
    box = np.array([[axis.min() for axis in array.T], [axis.max() for axis in array.T]])
    if not np.isfinite(box).all():
        refuse_infinite(array, "points")
    # Equal points are valid here. Functions that need distinct points also call `check_extent`.
    if not np.array_equal(*box):
        check_extent(box, "points", "cloud")
    return array, box


def checked_normals(normals: Any, n_points: int, name: str = "normals") -> Floats:
    """Return checked normals (N, 3) as float64, of length 1; zero vectors are not changed."""
    array = owned(exact_doubles(rows_of_three(normals, name, n_points)), np.float64)
    refuse_infinite(array, name)
    # Vectors are first divided by their largest component, so that squares cannot overflow.
    largest = np.abs(array).max(axis=1, initial=0.0, keepdims=True)
    np.divide(array, largest, out=array, where=largest > 0)
    lengths = np.sqrt(np.einsum("ij,ij->i", array, array))[:, None]
    np.divide(array, lengths, out=array, where=lengths > 0)
    return array


def checked_viewpoints(viewpoints: Any, n_points: int) -> Floats:
    """Return a checked viewpoint (3,), or one per point (N, 3), as float64."""
    array = numeric_array(viewpoints, "viewpoints")
    if array.shape not in ((3,), (n_points, 3)):
        raise MeshError(f"viewpoints must have shape (3,) or ({n_points}, 3), got {array.shape}")
    positions = owned(exact_doubles(array), np.float64)
    refuse_infinite(positions.reshape(-1, 3), "viewpoints")
    return positions


def checked_colors(colors: Any, n_points: int) -> Singles:
    """Return red, green and blue of each point, from 0 to 1, as (N, 3) float32, without alpha."""
    array = numeric_array(colors, "colors")
    if array.ndim != 2 or array.shape[0] != n_points or array.shape[1] not in (3, 4):
        raise MeshError(f"colors must have shape ({n_points}, 3), got {array.shape}")
    if array.dtype.kind == "i":
        raise MeshError(f"colors must be floats or unsigned integers, got {array.dtype}")
    if array.dtype.kind == "u":
        shades = np.asarray(array[:, :3], np.float32)
        return np.asarray(shades / np.float32(np.iinfo(array.dtype).max), np.float32)
    shades = owned(array[:, :3], np.float32)
    is_wrong = ~((shades >= 0) & (shades <= 1)).all(axis=1)  # True if a shade is NaN
    refuse_first(is_wrong, "colors", shades, "from 0 to 1", MeshError)
    return shades


def rows_of_three(value: Any, name: str, n_rows: int | None = None, *, count: str = "N") -> Array:
    """Return `value` as numbers of shape (N, 3). Messages name `n_rows`, if given, or `count`."""
    array = numeric_array(value, name)
    if array.ndim != 2 or array.shape[1] != 3 or n_rows not in (None, len(array)):
        count = count if n_rows is None else str(n_rows)
        raise MeshError(f"{name} must have shape ({count}, 3), got {array.shape}")
    return array


def refuse_infinite(rows: Floats, name: str, error: type[ValueError] = MeshError) -> None:
    """Raise an error for the first row of an array, (N, F), with a number that is not finite."""
    if not np.isfinite(rows).all():
        refuse_first(~np.isfinite(rows).all(axis=1), name, rows, "finite", error)


def checked_bounds(bounds: Any, positions: Floats) -> Floats:
    """Return the corners of a box, (2, 3) float64; if `bounds` is None, the box of `positions`."""
    if bounds is None:
        return np.array([positions.min(axis=0), positions.max(axis=0)])
    array = exact_doubles(numeric_array(bounds, "bounds"))
    if array.shape != (2, 3) or not np.isfinite(array).all() or np.any(array[0] > array[1]):
        raise ValueError(
            f"bounds must be finite low and high corners of shape (2, 3), got {array.tolist()}"
        )
    return array


def checked_positions(positions: Any) -> Floats:
    """Return checked positions of cells as a contiguous (N, 3) float64 array; N is at least 1."""
    array = exact_doubles(numeric_array(positions, "positions"))
    if array.ndim != 2 or array.shape[1] != 3 or not 1 <= len(array) <= MAX_CELLS:
        raise ValueError(f"positions must have shape (N, 3) with N >= 1, got {array.shape}")
    refuse_infinite(array, "positions", ValueError)
    with np.errstate(over="ignore"):
        extent = float(np.ptp(array, axis=0).max())
    if extent and not EXTENT_RANGE[0] <= extent <= EXTENT_RANGE[1]:
        raise ValueError(
            f"the extent of positions must be {EXTENT_RANGE[0]:g} to {EXTENT_RANGE[1]:g}, got"
            f" {extent:.3g}: rescale the positions"
        )
    return array


def checked_nonnegative_array(
    value: Any, n: int, name: str, per: str, n_threads: int, advice: str = ""
) -> Floats:
    """Check n numbers >= 0, one for each `per`; the largest must be 0 or in `VALUE_RANGE`."""
    refuse_mask(value, name)
    array = np.asarray(value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must contain numbers, got {array.dtype}")
    array = exact_doubles(array)
    if array.shape != (n,):
        must = f"one value per {per}, shape ({n},)"
        raise ValueError(f"{name} must have {must}, got {array.shape}{advice}")
    is_valid, largest = _core.check_numbers(array, n_threads)
    if not is_valid:
        refuse_first(~(np.isfinite(array) & (array >= 0)), name, array, "finite and not negative")
    if largest and not VALUE_RANGE[0] <= largest <= VALUE_RANGE[1]:
        raise ValueError(
            f"the largest value of {name} must be {VALUE_RANGE[0]:g} to {VALUE_RANGE[1]:g}, got"
            f" {largest:.3g}: rescale the values"
        )
    return array


def checked_arcs(offsets: Any, neighbors: Any, n_cells: int) -> ArcLists:
    """Return checked arcs in CSR form: offsets (N + 1,) int64, and neighbors (M,) int32."""
    starts = owned(integer_array(offsets, "offsets"), np.int64)
    targets = owned_indices(integer_array(neighbors, "neighbors"))
    if len(starts) != n_cells + 1:
        raise ValueError(f"offsets must have shape ({n_cells + 1},), got {starts.shape}")
    if starts[0] != 0 or starts[-1] != len(targets) or np.any(np.diff(starts) < 0):
        raise ValueError(f"offsets must increase from 0 to {len(targets)}, the number of arcs")
    is_wrong = (targets < 0) | (targets >= n_cells)
    refuse_first(is_wrong, "neighbors", neighbors, f"0 to {n_cells - 1}")
    return starts, targets


def checked_seeds(seeds: Any, n_cells: int, name: str = "centers") -> Ints:
    """Return the indices of K distinct cells as int32, after checking that K is at least 1."""
    given = integer_array(seeds, name)
    array = owned_indices(given)
    if not len(array):
        raise ValueError(f"{name} must contain at least one cell, but it is empty")
    refuse_first((array < 0) | (array >= n_cells), name, given, f"0 to {n_cells - 1}")
    values, counts = np.unique(array, return_counts=True)
    if len(values) < len(array):
        twice = values[np.argmax(counts > 1)]
        text = f"{name} must be distinct, but cell {twice} occurs more than once"
        hint = f"; labels need a value per cell ({n_cells}), not {len(array)} (see face_labels)"
        raise ValueError(text + hint if name == "init" else text)
    return array


def checked_region_centers(centers: npt.ArrayLike, labels: Ints, n_regions: int) -> Ints:
    """Return checked centers as (K,) int32, where entry i is a cell of region i."""
    cells = checked_seeds(centers, len(labels))
    if len(cells) != n_regions:
        raise ValueError(
            f"centers must have one cell per region ({n_regions}), got"
            f" {counted(len(cells), 'cell')}"
        )
    is_wrong = labels[cells] != np.arange(n_regions)
    if is_wrong.any():
        region = int(np.argmax(is_wrong))
        cell = cells[region]
        raise ValueError(
            f"centers[{region}] must be a cell of region {region}, got cell {cell} of region"
            f" {labels[cell]}"
        )
    return cells


def checked_partial_labels(
    labels: Any, n_cells: int, n_vertices: int | None = None, noun: str = "cell",
    advice: str = "", *, least: int = -1,
) -> tuple[Ints, int]:  # fmt: skip
    """Return labels >= `least` as (N,) int32 after checking that 0 to K - 1 occur, and K."""
    given = _row_of_labels(labels, n_cells, "labels", n_vertices, noun)
    must = f"{least} to {n_cells - 1} for {counted(n_cells, noun)}"
    refuse_first((given < least) | (given >= n_cells), "labels", given, must)
    array = owned_indices(given)
    counts = np.bincount(array + 1)[1:]
    if not counts.all():
        raise ValueError(
            f"labels must be consecutive integers from 0, but no {noun} has label"
            f" {int(np.argmin(counts))}: renumber them with"
            f" np.unique(labels, return_inverse=True)[1]{' - 1' * int((array < 0).any())}{advice}"
        )
    return array, len(counts)


def checked_regions(
    labels: Any, n_cells: int, n_vertices: int | None = None, noun: str = "cell", advice: str = ""
) -> tuple[Ints, int]:
    """Return the result of `checked_partial_labels`; raise a ValueError if all labels are -1."""
    array, n_regions = checked_partial_labels(labels, n_cells, n_vertices, noun, advice)
    if not n_regions:
        raise ValueError("labels must contain at least one region, but all labels are -1")
    return array, n_regions


def checked_classes(
    labels: Any, n: int, name: str, noun: str = "cell", *, n_vertices: int | None = None
) -> Ints:
    """Return labels of cells (or of another `noun`), which may have gaps, as a new int32 array.

    Apps use it to check labels: integers >= 0, or -1 for no label, shape (n,).
    """
    given = _row_of_labels(labels, n, name, n_vertices, noun)
    array = given.astype(np.int32, order="C")  # copies, so the caller cannot change the labels
    refuse_first((array < -1) | (array != given), name, given, f"-1 to {MAX_CELLS}")
    return array


def _row_of_labels(
    labels: Any, n: int, name: str, n_vertices: int | None = None, noun: str = "cell"
) -> Array:
    refuse_order(labels, "labels")
    given = integer_array(labels, name)
    check_length(given, n, name, noun, n_vertices=n_vertices)
    return given


def checked_any_labels(labels: Any, n_cells: int, n_vertices: int | None = None) -> Longs:
    """Return checked labels, which may be any integers, as an (N,) int64 array."""
    given = _row_of_labels(labels, n_cells, "labels", n_vertices)
    array = owned(given, np.int64)
    if given.dtype.kind == "u":
        refuse_first(array < 0, "labels", given, "less than 2**63")
    return array


def compact_partial_labels(
    labels: Any, n_cells: int, n_vertices: int | None = None
) -> tuple[Ints, Array]:
    """Check labels, which may be any integers, and return the result of `ranked_labels`."""
    return ranked_labels(checked_any_labels(labels, n_cells, n_vertices))


def ranked_labels(labels: npt.NDArray[np.integer[Any]]) -> tuple[Ints, Array]:
    """Replace K different labels by 0 to K - 1 in the same order; the label -1 is not replaced.

    Returns the new labels, and the K labels that they replace. Apps use it for labels with gaps.
    """
    # A table is faster than sorting.
    if labels.min(initial=0) >= -1 and labels.max(initial=0) < len(labels):
        is_used = np.bincount(labels + 1) > 0
        names, indices = np.arange(-1, len(is_used) - 1), labels + 1
    else:
        names, indices = np.unique(labels, return_inverse=True)
        is_used = np.ones(len(names), bool)
    is_used &= names != -1
    ranks = np.cumsum(is_used, dtype=np.int32) - np.int32(1)
    ranks[names == -1] = -1
    return ranks[indices], names[is_used]


def _shown(value: object) -> str:
    """Return a short text for a wrong value; scalars of NumPy are shown as plain numbers."""
    return str(value) if isinstance(value, (np.number, np.bool_)) else reprlib.repr(value)


def checked_count(
    value: Any, name: str, high: int | None = None, of: str = "", *, low: int = 1
) -> int:
    """Check a parameter, and return it as an integer from `low` to `high`, the number of `of`."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be an integer, got {_shown(value)}")
    if isinstance(value, np.ndarray):
        hint = ": pass vertices and faces as one pair (vertices, faces)"
        raise TypeError(
            f"{name} must be an integer, got an array{hint if name == 'n_segments' else ''}"
        )
    count = operator.index(value)
    if count < low:
        raise ValueError(f"{name} must be at least {low}, got {count}")
    if high is not None and count > high:
        meaning = f", the number of {of}" if of else ""
        raise ValueError(f"{name} must be at most {high}{meaning}, got {count}")
    return count


def checked_number(value: Any, name: str, *, zero: bool) -> float:
    """Check a parameter, and return it as a finite float > 0, or >= 0 if `zero`."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number, got {_shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number) or number < 0 or (number == 0 and not zero):
        expected = "not negative" if zero else "positive"
        raise ValueError(f"{name} must be finite and {expected}, got {_shown(value)}")
    return number


def checked_fraction(value: Any, name: str) -> float:
    """Check a parameter, and return it as a float from 0 to 1."""
    number = checked_number(value, name, zero=True)
    if number > 1.0:
        raise ValueError(f"{name} must be from 0 to 1, got {number}")
    return number


def checked_flag(value: Any, name: str) -> bool:
    """Check a parameter, and return it as bool; raise a TypeError unless it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, got {_shown(value)}")
    return bool(value)


def checked_choice(value: str, name: str, choices: tuple[str, ...]) -> str:
    """Check a parameter, and return it; raise a ValueError if it is not one of `choices`."""
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(choices)}, got {value!r}")
    return value


Function = TypeVar("Function", bound=Callable[..., Any])


def explains_parameters(others: Mapping[str, str]) -> Callable[[Function], Function]:
    """Return a decorator that raises a TypeError with advice for parameters of other tools."""

    def decorate(function: Function) -> Function:
        @functools.wraps(function)
        def checked(*args: Any, **keywords: Any) -> Any:
            for name in keywords.keys() & others.keys():
                raise TypeError(f"{function.__name__} has no parameter {name}: {others[name]}")
            return function(*args, **keywords)

        return cast(Function, checked)

    return decorate


def checked_threads(n_threads: Any) -> int:
    """Check the parameter `n_threads` of a function, and return the number of threads to use.

    If `n_threads` is None, the environment variable SUPERFACETS_NUM_THREADS is used instead. If the
    variable is not set, the result is one thread per usable core. The result is at most
    `MAX_THREADS_PER_CORE` per usable core.
    """
    if n_threads is not None:
        return min(checked_count(n_threads, "n_threads"), MAX_THREADS_PER_CORE * usable_cores())
    from_environment = os.environ.get("SUPERFACETS_NUM_THREADS", "")
    if from_environment:
        if not from_environment.isdecimal():
            raise ValueError(
                f"SUPERFACETS_NUM_THREADS must be a positive integer, got {from_environment!r}"
            )
        return checked_threads(checked_count(int(from_environment), "SUPERFACETS_NUM_THREADS"))
    return usable_cores()


def usable_cores() -> int:
    """Return the number of CPU cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def integer_array(value: Any, name: str) -> Array:
    """Return `value` as a checked one-dimensional array of integers, in its original dtype."""
    refuse_mask(value, name)
    try:
        array = np.asarray(value)
    except ValueError:  # the items differ in shape
        raise ValueError(f"{name} must be one-dimensional, got items of different shapes") from None
    if array.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {array.shape}")
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} must contain integers, got {array.dtype}")
    return array
