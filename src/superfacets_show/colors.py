"""Choose colors for regions, and for values. Color-blind people can distinguish these colors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from superfacets import CellGraph, kit
from superfacets.kit import Array, Bytes, Cells, Floats, Ints, Longs, MeshLike
from superfacets_textures import linear_of_oklab, linear_of_srgb, oklab_of_linear, srgb_of_linear

Vision = Literal["normal", "protanopia", "deuteranopia", "tritanopia"]
VISIONS: tuple[Vision, ...] = get_args(Vision)
"""Normal vision, and color blindness from missing long, medium or short wavelength cones."""

# Matrices for linear sRGB at severity 1: Machado, Oliveira and Fernandes, "A physiologically-based
# model for simulation of color vision deficiency", 2009, table 1.
_SIMULATIONS = {
    "protanopia": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                              [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]]),
}  # fmt: skip


def oklab(colors: Array) -> Floats:
    """Return the lightness (0 to 1), green-red and blue-yellow coordinates of colors in OKLab.

    `colors` are sRGB, (N, 3), 0 to 255. Distances in OKLab approximate perceived differences.
    """
    return oklab_of_linear(_linear(colors))


def seen_as(colors: Array, vision: Vision) -> Floats:
    """Convert sRGB colors, as in `oklab`, to the OKLab colors perceived with `vision`."""
    linear = _linear(colors)
    if vision != "normal":
        linear = np.clip(linear @ _SIMULATIONS[vision].T, 0, 1)
    return oklab_of_linear(linear)


def color_distances(colors: Array, others: Array, visions: tuple[Vision, ...] = VISIONS) -> Floats:
    """Return the OKLab distance between each of N colors and each of M other colors, (N, M).

    The result is the smallest of the distances for each kind of vision in `visions`.
    """
    apart = [seen_as(colors, v)[:, np.newaxis] - seen_as(others, v) for v in visions]
    return np.asarray(np.linalg.norm(apart, axis=3).min(axis=0))


def from_oklab(places: Floats) -> Bytes:
    """Convert OKLab colors, (N, 3), to sRGB. Results outside of 0 to 255 are clipped."""
    return srgb_of_linear(linear_of_oklab(places))


def _linear(colors: Array) -> Floats:
    """Convert sRGB values from 0 to 255 to linear sRGB values from 0 to 1."""
    return linear_of_srgb(np.asarray(colors, dtype=np.float64) / 255.0)


# For all `VISIONS`, these colors have large OKLab distances from each other, and from the gray of
# cells that are in no region. The colors are the result of a farthest-point search with exchanges.
# The lightness was limited to 0.65 to 0.95, so that shaded colors are not black, and the chroma to
# 0.14, so that colors are not glaring. Distances for normal vision were multiplied by 2/3. With 12
# colors, the smallest distance would be below 0.08. Regions of a surface need 6 colors, and regions
# of a volume up to 10.
PALETTE = np.array(
    [
        (245, 195, 170), (150, 180, 250), (110, 170, 120), (250, 140, 180), (250, 240, 130),
        (175, 130, 210), (80, 230, 255), (195, 135, 0), (200, 250, 230), (190, 190, 80),
    ],
    dtype=np.uint8,
)  # fmt: skip
"""Colors of regions, sRGB, (10, 3)."""

NO_COLOR = (128, 128, 128)
"""Color of cells without a label."""

Arcs = tuple[Longs, Ints]
"""Arcs of N cells in CSR form: offsets of shape (N + 1,) and neighbors of shape (M,)."""

MIN_COLOR_DISTANCE = 0.09
"""Smallest OKLab distance between two colors of the palette for normal vision, protanopia,
deuteranopia and tritanopia. A distance of 0.02 is just noticeable."""

# Preferred minimum distance (see `_distances`) between colors of neighboring regions. Most colors
# have at least this distance from at least half of the palette.
_CLEAR_DISTANCE = 0.1

# Largest number of regions for which colors outside of the palette are used to avoid that colors
# repeat. With more regions, these additional colors would be too similar to each other.
_MAX_DISTINCT = 24

# Every planar graph has a vertex with at most 5 neighbors.
_PLANAR_DEGREE = 5


def face_colors(mesh: MeshLike | CellGraph, labels: npt.ArrayLike) -> Bytes:
    """Return a color for each face. Adjacent regions have clearly different colors.

    Parameters
    ----------
    mesh : Mesh or mesh-like, PointCloud or cloud-like, or CellGraph
        Same as in `segment`, or a `CellGraph`.
    labels : array_like of integers, shape (F,) or (V,)
        Region of each face or vertex, any integers; faces with label -1 are gray.

    Returns
    -------
    ndarray of uint8, shape (F, 3)
        Red, green and blue, 0 to 255, sRGB. The colors are suitable for color-blind people.

    Raises
    ------
    ValueError, TypeError
        If the number of labels differs from the number of faces, or labels are not integers.

    Examples
    --------
    >>> square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> face_colors(square, [0, 1])
    array([[245, 195, 170],
           [150, 180, 250]], dtype=uint8)
    """
    cells = mesh if isinstance(mesh, CellGraph) else kit.as_cells(mesh)
    n_vertices = getattr(cells, "n_vertices", None)
    of_cells = kit.of_cells(labels, cells)
    compact, _ = kit.compact_partial_labels(of_cells, cells.n_cells, n_vertices)
    arcs, of_some = kit.kind_of(cells).border_arcs(cells, compact, kit.checked_threads(None))
    return colors_of_cells(_colors_of_adjacency(arcs, of_some, int(compact.max()) + 1), compact)


def colors_of_cells(colors: Bytes, labels: Ints) -> Bytes:
    """Return the color of the region of each cell, (N, 3); gray for cells with label -1."""
    return np.concatenate([colors, np.array([NO_COLOR], dtype=np.uint8)])[labels]


def region_colors(arcs: Arcs, labels: Ints) -> Bytes:
    """Return the color of each region, (K, 3). Adjacent regions have clearly different colors.

    `arcs` has each arc in both directions. `labels` are 0 to K - 1, or -1 for cells in no region.
    As long as `PALETTE` has enough colors, as on a surface, the OKLab distance between colors of
    adjacent regions is at least `MIN_COLOR_DISTANCE` for all `VISIONS`.

    Regions with few neighbors are removed repeatedly, and regions are colored in the reverse order
    of removal. Each region gets the least used color of the palette that is far from the colors of
    its neighbors or, if there is none, the least used color that no neighbor has. If the neighbors
    use all 10 colors of the palette, the region gets an additional color: the color that differs
    most from the colors of the neighbors. If there are at most 24 regions, a region that would
    repeat a color gets an unused color instead, so all colors are distinct. Time and memory are
    linear in the number of arcs.
    """
    return _colors_of_adjacency(arcs, labels, int(labels.max()) + 1)


def _colors_of_adjacency(arcs: Arcs, labels: Ints, n_regions: int) -> Bytes:
    starts, touching = _region_adjacency(arcs, labels, n_regions)
    order = _peeled_order(starts, touching)
    return _choices()[_color_greedily(order.tolist(), starts.tolist(), touching.tolist())]


def _peeled_order(starts: Longs, touching: Longs) -> Longs:
    """Return an order of the regions in which few neighbors of a region precede the region.

    In planar graphs, at most 5 neighbors precede each region.
    """
    # Each round removes the regions with at most 5 remaining neighbors, or if there are none, the
    # regions with the fewest remaining neighbors. The last round is first in the order.
    n_left = np.diff(starts)  # number of remaining neighbors of each region
    left = np.arange(len(n_left))
    rounds = [left[:0]]
    while len(left):
        bound = max(_PLANAR_DEGREE, int(n_left[left].min()))
        is_taken = n_left[left] <= bound
        taken, left = left[is_taken], left[~is_taken]
        counts = starts[taken + 1] - starts[taken]
        skipped = np.repeat(starts[taken] - (np.cumsum(counts) - counts), counts)
        np.subtract.at(n_left, touching[np.arange(counts.sum()) + skipped], 1)
        rounds.append(taken)
    return np.concatenate(rounds[::-1])


def _region_adjacency(arcs: Arcs, labels: Ints, n_regions: int) -> tuple[Longs, Longs]:
    """Return the neighbors of each region in CSR form: offsets, (K + 1,), and neighbors."""
    offsets, neighbors = arcs
    sources = np.repeat(labels, np.diff(offsets))
    targets = labels[neighbors]
    crossing = (sources != targets) & (sources >= 0) & (targets >= 0)
    # np.unique is not used: importing numpy.ma, which it needs, takes longer than this function.
    pairs = np.sort(sources[crossing].astype(np.int64) * n_regions + targets[crossing])
    pairs = pairs[np.diff(pairs, prepend=-1) > 0]
    starts = np.searchsorted(pairs, np.arange(n_regions + 1) * n_regions)
    return starts.astype(np.int64), pairs % max(1, n_regions)


def _color_greedily(order: list[int], starts: list[int], touching: list[int]) -> list[int]:
    """Return the color of each region, as an index into `_choices`.

    `order` is the order in which regions are colored. `starts` and `touching` are the result of
    `_region_adjacency`. Sets of colors are stored as bit masks.
    """
    near, whole_palette = _near_colors(), (1 << len(PALETTE)) - 1
    are_few = len(order) <= _MAX_DISTINCT
    colors = [-1] * len(order)  # -1: not yet colored
    n_uses = [0] * len(PALETTE)
    for region in order:
        taken = {colors[other] for other in touching[starts[region] : starts[region + 1]]} - {-1}
        close, same = 0, 0
        for color in taken:
            close |= near[color]
            same |= 1 << color
        free = (whole_palette & ~close) or (whole_palette & ~same)
        candidates = [color for color in range(len(PALETTE)) if free >> color & 1]
        color = min(candidates, key=n_uses.__getitem__, default=-1)
        if color < 0 or (are_few and n_uses[color]):
            used = [other for other in colors if other >= 0] if are_few else []
            color = _additional_color(sorted(taken), used)
        if color < len(PALETTE):
            n_uses[color] += 1
        colors[region] = color
    return colors


def _additional_color(near: list[int], used: list[int]) -> int:
    """Return the index of the color that differs most from the colors in `near` and `used`.

    `near` contains the colors of the neighbors. `used` contains the colors of all other regions if
    colors must not repeat. A distance of `MIN_COLOR_DISTANCE` from the colors in `near` is enough,
    so that the color may differ more from the colors in `used`.
    """
    from_near = _distances()[:, near].min(axis=1, initial=np.inf)
    if not used:
        return int(from_near.argmax())
    from_used = _distances()[:, used].min(axis=1)
    from_used[from_near < MIN_COLOR_DISTANCE] = 0
    if not from_used.any():  # all unused colors are similar to the color of a neighbor
        from_near[used] = 0
        return int(from_near.argmax())
    return int(from_used.argmax())


@cache
def _choices() -> Bytes:
    """Return the palette, followed by additional colors, (C, 3).

    None of the additional colors is dark, white or nearly gray.
    """
    steps = np.arange(0, 256, 51)
    cube = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    lightness = oklab(cube)[:, 0]
    from_gray = color_distances(cube, np.array([NO_COLOR]))[:, 0]
    wider = cube[(lightness > 0.55) & (lightness < 0.94) & (from_gray > MIN_COLOR_DISTANCE)]
    return np.concatenate([PALETTE, wider.astype(np.uint8)])


@cache
def _distances() -> Floats:
    """Return the distance between all pairs of colors of `_choices`, (C, C).

    The distance is the smaller of `color_distances`, and the distance for normal vision with half
    of the difference in lightness, because shading changes the lightness.
    """
    places = oklab(_choices()) * (0.5, 1.0, 1.0)
    shaded = np.linalg.norm(places[:, np.newaxis] - places, axis=2)
    return np.asarray(np.minimum(color_distances(_choices(), _choices()), shaded))


@cache
def _near_colors() -> list[int]:
    """Return the palette colors that are too similar to each color of `_choices`, as bit masks."""
    near = _distances()[:, : len(PALETTE)] < _CLEAR_DISTANCE
    return [sum(1 << int(color) for color in np.flatnonzero(row)) for row in near]


def scale_colors(n: int = 256) -> Bytes:
    """Return n colors of the color scale, from the lowest to the highest value, (n, 3), sRGB.

    The colors range from blue through green to yellow, in steps of about equal length in OKLab.
    Lightness increases evenly, so the order is also visible in grayscale. Dark border lines are
    visible on all colors.
    """
    at = np.linspace(0, len(_SCALE) - 1, n)
    places = np.stack([np.interp(at, range(len(_SCALE)), column) for column in _SCALE.T], axis=1)
    return from_oklab(places)


# Control points of the color scale in OKLab; `oklab` explains the coordinates.
_SCALE = np.array(
    [
        (0.40, 0.0, -0.18), (0.535, -0.05, -0.11), (0.67, -0.10, -0.015),
        (0.805, -0.11, 0.08), (0.94, -0.04, 0.175),
    ]
)  # fmt: skip


_N_COLORS = 256


def checked_values(
    given: Any, name: str, cells: Cells, n_regions: int | None
) -> tuple[Floats, Literal["cell", "region"]]:
    """Return values as float64, and whether there is one value per "cell" or one per "region".

    Values of the vertices of a mesh are converted to values of cells: the mean over the corners of
    each cell. If numbers of cells, regions and vertices are equal, the first of these is used.
    `n_regions` is None if values per region are not allowed. Raises a ValueError or TypeError if
    the values are not real numbers, if their number is wrong, or if a value is infinite. NaN is
    allowed.
    """
    kit.refuse_mask(given, name)
    array = np.asarray(given)
    if array.dtype.kind not in "biuf":
        raise TypeError(f"{name} must be numbers, got {array.dtype}")
    corners = kit.kind_of(cells).corners(cells)
    n_vertices = None if corners is None else getattr(cells, "n_vertices", None)
    if array.shape not in {(cells.n_cells,), (n_regions,), (n_vertices,)}:
        regions = "" if n_regions is None else f", or one value per region, ({n_regions},)"
        vertices = "" if n_vertices is None else f", or one value per vertex, ({n_vertices},)"
        raise ValueError(
            f"{name} must have one value per cell, ({cells.n_cells},){regions}{vertices}; got shape"
            f" {array.shape}"
        )
    values = array.astype(np.float64)
    if np.isinf(values).any():
        raise ValueError(f"{name} has infinite values: use NaN for missing values")
    if len(values) == cells.n_cells:
        return values, "cell"
    if corners is None or len(values) == n_regions:
        return values, "region"
    return corners.means(values[:, np.newaxis])[:, 0], "cell"


@dataclass(frozen=True)
class Scale:
    """Color scale that maps values from `low` to `high` to the colors of `scale_colors`."""

    low: float
    high: float
    title: str
    has_missing: bool  # whether some values are NaN

    def shares(self, values: Floats) -> Floats:
        """Return positions of values on the scale, 0 to 1; 0.5 if `low` equals `high`."""
        # Values are halved, because the difference of two large numbers may overflow.
        span = self.high / 2 - self.low / 2
        return (values / 2 - self.low / 2) / span if span > 0 else values * 0 + 0.5

    def colors(self, values: Floats) -> Bytes:
        """Return the color of each value, (N, 3); gray for NaN."""
        shares = self.shares(values)
        is_missing = np.isnan(shares)
        steps = np.where(is_missing, 0, np.rint(shares * (_N_COLORS - 1))).astype(np.int64)
        colors = scale_colors(_N_COLORS)[steps]
        colors[is_missing] = NO_COLOR
        return colors


def scale_of(values: list[Floats], title: str) -> Scale:
    """Return one color scale for the values of several pictures.

    The scale extends from the lowest to the highest value, or from 0 to 0 if all values are NaN.
    """
    everything = np.concatenate(values)
    known = everything[~np.isnan(everything)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    return Scale(low, high, title, len(known) < len(everything))
